// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/projection/fast_projection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "analysis/constraint/composed_rows.h"
#include "analysis/linear/cholesky.h"
#include "analysis/parallel/workers.h"
#include "geometry/clock.h"
#include "geometry/error.h"

namespace toile {
namespace {

constexpr int patience = 15;         // iterations without gain before giving up; dependent rows make pauses of up to 10
constexpr double least_gain = 0.99;  // a violation above this times the best so far is no gain
constexpr double poor_gain = 0.25;   // an iteration that leaves more than this of the residual asks for a new factor
constexpr double no_gain = 0.5;      // more than this left: the directions at hand no longer lead there
constexpr double damped_residual = 0.1;  // what damps anyway needn't be exact
// The next step corrects the remaining violation, adding a velocity of violation / dt: what is allowed falls with dt,
// but not below rounding.
constexpr double least_exactness = 1e-6;
constexpr double shortest_tangent = 1e-4;  // |y| below which a collapsed tangent is scaled as if it were this long

// Of the law's forces at the end of a step, at its start, one and two steps before: see `step`.
Eigen::Vector4d force_weights(double damping) {
  return damping * Eigen::Vector4d::Unit(0) + (1 - damping) / 27 * Eigen::Vector4d(8, 12, 6, 1);
}

}  // namespace

// The worst of some strain rows.
struct Violation {
  double violation = 0, residual = 0;
  int row = -1;
  void take(double v, int r) {
    if (!(v <= violation) && !std::isnan(violation)) violation = v, row = r;  // NaN counts as worst
  }
};

// System rows: one per strain row, then three (x, y, z) per place row. Row i of J is (row of D) x direction_i: a
// tangent for strain rows, a unit vector for place rows; hence
// (J M^-1 J^T)_ij = (D M^-1 D^T)_ij (direction_i . direction_j), whose first factor never changes.
struct FastProjection::Impl {
  AffineMap map;
  ConstraintRows rows;
  ProjectionOptions options;
  ComposedRows composed;
  CompressedRows at_node;  // M^-1 D^T
  // Of `rows`, close together, as every iteration reads them.
  std::vector<char> warp;
  std::vector<double> stiffness, damping_rate;
  double least_damping_rate = std::numeric_limits<double>::infinity();  // of rows with a law that damps
  std::vector<double> gram_diagonal;                                    // per scalar row; 0: takes no part
  std::vector<int> system_scalar;                                       // scalar row of each system row
  SparsePattern pattern;
  std::vector<double> gram, values;  // per entry of the pattern
  std::unique_ptr<Cholesky> factor;
  Workers* workers = nullptr;  // null: one thread

  Eigen::Matrix3Xd y, tangents, direction, targets, fixed_places;  // direction: scaled, per system row
  Eigen::VectorXd scale, residual, rhs, solution, candidate;
  Eigen::VectorXd strain_lambda, compliance;  // compliance 0: hard
  double exactness = 1;                       // of the residuals that are allowed in a step, see `step`
  Eigen::VectorXd share;                      // of the force at the end in what acts in a step
  std::vector<char> slack;                    // within the band without a force: takes no part for now
  Eigen::Matrix3Xd place_lambda, strain_impulse;
  Eigen::Matrix3Xd impulse;    // per scalar row, of one push
  Eigen::VectorXd row_energy;  // per strain row
  std::vector<Violation> worst_of_piece;

  Impl(const AffineMap& m, ConstraintRows r, const ProjectionOptions& o)
      : map(m), rows(std::move(r)), options(o), composed(compose(map, rows)) {}

  int strains() const { return static_cast<int>(rows.strain.size()); }
  int places() const { return static_cast<int>(rows.place.size()); }
  int size() const { return strains() + 3 * places(); }
  const StrainBand& band(int r) const { return warp[r] ? options.warp : options.weft; }
  bool takes_part(int r) const { return gram_diagonal[r] > 0; }
  bool has_law(int r) const { return takes_part(r) && stiffness[r] > 0; }
  bool soft(int r) const { return compliance[r] > 0; }
  LimitLaw law(int r) const { return {band(r), compliance[r]}; }
  // The law of a row in forces instead of a step's multipliers.
  LimitLaw force_law(int r) const { return {band(r), 1 / stiffness[r]}; }
  double strain(const Eigen::Matrix3Xd& tangent, int r) const { return 0.5 * (tangent.col(r).squaredNorm() - 1); }
  double limit_energy() {
    share_out(strains(), [&](int begin, int end) {
      for (int r = begin; r < end; ++r) row_energy[r] = has_law(r) ? force_law(r).energy(strain(y, r)) : 0;
    });
    double sum = 0;
    for (const double energy : row_energy) sum += energy;
    return sum;
  }

  template <class Body>
  void share_out(int count, const Body& body) {
    toile::share_out(workers, count, body);
  }

  void build(const Eigen::VectorXd& node_mass);
  void begin(double t);
  void clear();
  void complete(ConstraintForces& forces) const;
  void measure(const Eigen::Ref<const Eigen::VectorXd>& x, ProjectionReport& report);
  Violation measure_strain(int begin, int end);
  void point_along(const Eigen::Matrix3Xd& tangents);
  bool factorise(ProjectionReport& report);
  void correct(Eigen::Ref<Eigen::VectorXd> x, ProjectionReport& report);
  void push(const Eigen::VectorXd& amounts, Eigen::Ref<Eigen::VectorXd> x);
  // Where the rows point while iterating: as they do, giving up where that gains nothing; along the candidate's
  // gradients, renewed where that gains nothing; or along those of each iteration.
  enum class Directions { start, candidate, renewed };
  ProjectionReport iterate(Eigen::Ref<Eigen::VectorXd> x, Directions directions);
};

void FastProjection::Impl::build(const Eigen::VectorXd& node_mass) {
  if (node_mass.size() != map.nodes()) throw SolverError("projection: one mass per free node expected");
  for (int k = 0; k < node_mass.size(); ++k)
    if (!(node_mass[k] > 0))
      throw SolverError("projection: control point " + std::to_string(map.node_control_point()[k]) + " has no mass");

  at_node = transposed_by_mass(composed.free, node_mass);
  for (const StrainRow& row : rows.strain) {
    warp.push_back(row.warp);
    stiffness.push_back(row.stiffness);
    damping_rate.push_back(row.damping_rate);
  }

  const GramMatrix scalar = gram_matrix(composed.free, node_mass);
  const int scalars = strains() + places();
  gram_diagonal.resize(scalars);
  for (int r = 0; r < scalars; ++r) gram_diagonal[r] = scalar.value[scalar.pattern.column_start[r]];
  for (int r = 0; r < strains(); ++r)
    if (has_law(r) && damping_rate[r] > 0) least_damping_rate = std::min(least_damping_rate, damping_rate[r]);
  for (int p = 0; p < places(); ++p)
    if (!(gram_diagonal[strains() + p] > 0))
      throw SolverError("pin " + std::to_string(rows.place[p].pin) +
                        " holds a point whose control points are all fixed by other pins: remove one of them");

  for (int r = 0; r < strains(); ++r) system_scalar.push_back(r);
  for (int p = 0; p < 3 * places(); ++p) system_scalar.push_back(strains() + p / 3);
  pattern.column_start.push_back(0);
  for (int c = 0; c < size(); ++c) {
    const int sc = system_scalar[c];
    for (int e = scalar.pattern.column_start[sc]; e < scalar.pattern.column_start[sc + 1]; ++e) {
      const int sr = scalar.pattern.row[e];
      const auto add = [&](int row) {
        pattern.row.push_back(row);
        gram.push_back(scalar.value[e]);
      };
      if (sr < strains())
        add(sr);
      else if (sc < strains())
        for (int k = 0; k < 3; ++k) add(strains() + 3 * (sr - strains()) + k);
      else
        add(strains() + 3 * (sr - strains()) + (c - strains()) % 3);  // different components don't meet
    }
    pattern.column_start.push_back(static_cast<int>(pattern.row.size()));
  }
  values.resize(gram.size());
  if (size() > 0) factor = std::make_unique<Cholesky>(pattern);

  y.resize(3, scalars);
  tangents.resize(3, scalars);
  direction.resize(3, size());
  targets.resize(3, places());
  scale.resize(size());
  residual.resize(size());
  rhs.resize(size());
  solution.resize(size());
  strain_lambda = Eigen::VectorXd::Zero(strains());
  compliance = Eigen::VectorXd::Zero(strains());
  share = Eigen::VectorXd::Ones(strains());
  slack.assign(strains(), 0);
  place_lambda = Eigen::Matrix3Xd::Zero(3, places());
  strain_impulse = Eigen::Matrix3Xd::Zero(3, strains());
  impulse.resize(3, scalars);
  row_energy.resize(strains());
  worst_of_piece.resize(static_cast<std::size_t>(pieces(strains())));
}

void FastProjection::Impl::begin(double t) {
  map.fixed_places(t, fixed_places);
  for (int p = 0; p < places(); ++p) targets.col(p) = rows.place[p].target(t);
  compliance.setZero();
  exactness = 1;
  clear();
}

void FastProjection::Impl::clear() {
  strain_lambda.setZero();
  place_lambda.setZero();
  strain_impulse.setZero();
}

// Where nothing came before, what the strains at the start stand for.
void FastProjection::Impl::complete(ConstraintForces& forces) const {
  if (forces.strain.cols() != strains()) {
    forces.strain.setZero(3, strains());
    for (int r = 0; r < strains(); ++r)
      if (has_law(r)) forces.strain.col(r).setConstant(force_law(r).multiplier(strain(tangents, r)));
  }
  if (forces.place.cols() != places()) forces.place.setZero(3, places());
}

// Violation and residual of strain rows, at y.
Violation FastProjection::Impl::measure_strain(int begin, int end) {
  Violation worst;
  for (int r = begin; r < end; ++r) {
    slack[r] = 0;
    residual[r] = 0;
    if (!takes_part(r)) continue;
    const double C = strain(y, r);
    double violation = std::abs(C);
    residual[r] = C;
    if (soft(r)) {
      const StrainBand& b = band(r);
      if (b.slack > 0) violation = std::max({C - b.stretch, -b.compress - C, 0.0});
      slack[r] = b.slack > 0 && strain_lambda[r] == 0 && law(r).slack_at(C);
      const double lambda = strain_lambda[r] != 0 ? strain_lambda[r] : std::copysign(0.0, C);
      residual[r] = slack[r] ? 0 : C - law(r).strain(lambda);
      worst.residual = std::max(worst.residual, std::abs(residual[r]) / std::min(b.stretch, b.compress));
    }
    worst.take(violation, r);
  }
  return worst;
}

void FastProjection::Impl::measure(const Eigen::Ref<const Eigen::VectorXd>& x, ProjectionReport& report) {
  share_pieces(workers, strains(), [&](int index, int begin, int end) {
    evaluate(composed, x, fixed_places, begin, end, y);
    worst_of_piece[static_cast<std::size_t>(index)] = measure_strain(begin, end);
  });
  Violation worst;
  for (const Violation& piece : worst_of_piece) {
    worst.take(piece.violation, piece.row);
    worst.residual = std::max(worst.residual, piece.residual);
  }
  report.strain_violation = worst.violation;
  report.worst_row = worst.row;
  report.residual = worst.residual;
  report.place_violation = report.energy = 0;
  evaluate(composed, x, fixed_places, strains(), strains() + places(), y);
  for (int p = 0; p < places(); ++p) {
    const Eigen::Vector3d gap = y.col(strains() + p) - targets.col(p);
    residual.segment<3>(strains() + 3 * p) = gap;
    if (!(gap.norm() <= report.place_violation) && !std::isnan(report.place_violation))
      report.place_violation = gap.norm();
  }
  report.converged = report.strain_violation <= options.tolerance && report.place_violation <= options.place_tolerance;
}

void FastProjection::Impl::point_along(const Eigen::Matrix3Xd& along) {
  share_out(strains(), [&](int begin, int end) {
    for (int r = begin; r < end; ++r) {
      const double length = std::max(along.col(r).norm(), shortest_tangent);
      scale[r] = takes_part(r) ? 1 / (std::sqrt(gram_diagonal[r]) * length) : 0;
      direction.col(r) = scale[r] * along.col(r);
    }
  });
  for (int i = strains(); i < size(); ++i) {
    scale[i] = 1 / std::sqrt(gram_diagonal[system_scalar[i]]);
    direction.col(i) = scale[i] * Eigen::Vector3d::Unit((i - strains()) % 3);
  }
}

bool FastProjection::Impl::factorise(ProjectionReport& report) {
  const double* t = direction.data();
  share_out(size(), [&](int begin, int end) {
    for (int c = begin; c < end; ++c) {
      const bool idle = c < strains() && slack[c];
      const double t0 = t[3 * c], t1 = t[3 * c + 1], t2 = t[3 * c + 2];
      for (int e = pattern.column_start[c]; e < pattern.column_start[c + 1]; ++e) {
        const int r = pattern.row[e];
        const double* s = t + 3 * r;
        values[e] = idle || (r < strains() && slack[r]) ? 0 : gram[e] * (s[0] * t0 + s[1] * t1 + s[2] * t2);
      }
    }
  });
  // Strain rows may depend on each other (an edge between two pins); place rows may not, and get no softness unless the
  // factor fails without it.
  double strain_softness = options.regularisation, place_softness = 0;
  for (int attempt = 0; attempt < 4; ++attempt) {
    share_out(size(), [&](int begin, int end) {
      for (int i = begin; i < end; ++i) {
        double softness = i < strains() ? strain_softness : place_softness;
        if (i < strains() && soft(i))
          softness = std::max(softness, law(i).slope(strain_lambda[i]) * scale[i] * scale[i]);
        values[pattern.column_start[i]] = 1 + softness;
      }
    });
    const Clock::time_point start = Clock::now();
    const bool positive = factor->factorise(values);
    report.factor_seconds += since(start);
    if (positive) return true;
    strain_softness = std::max(10 * strain_softness, 1e-8);
    place_softness = std::max(10 * place_softness, 1e-10);
  }
  return false;
}

// x -= M^-1 J^T amounts, for amounts of scaled rows.
void FastProjection::Impl::push(const Eigen::VectorXd& amounts, Eigen::Ref<Eigen::VectorXd> x) {
  share_out(strains(), [&](int begin, int end) {
    for (int r = begin; r < end; ++r) {
      impulse.col(r) = amounts[r] * direction.col(r);
      strain_lambda[r] += scale[r] * amounts[r];
      strain_impulse.col(r) += impulse.col(r);
    }
  });
  for (int i = strains(); i < size(); ++i) {
    const int p = (i - strains()) / 3, k = (i - strains()) % 3;
    impulse(k, strains() + p) = amounts[i] * scale[i];
    place_lambda(k, p) += impulse(k, strains() + p);
  }
  // Node by node, so that a thread writes what no other does.
  share_out(map.nodes(), [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      double s0 = 0, s1 = 0, s2 = 0;
      for (int e = at_node.start[k]; e < at_node.start[k + 1]; ++e) {
        const double* of_row = impulse.data() + 3 * static_cast<std::ptrdiff_t>(at_node.column[e]);
        const double w = at_node.value[e];
        s0 += w * of_row[0], s1 += w * of_row[1], s2 += w * of_row[2];
      }
      double* place = x.data() + 3 * static_cast<std::ptrdiff_t>(k);
      place[0] -= s0, place[1] -= s1, place[2] -= s2;
    }
  });
}

void FastProjection::Impl::correct(Eigen::Ref<Eigen::VectorXd> x, ProjectionReport& report) {
  share_out(size(), [&](int begin, int end) {
    for (int i = begin; i < end; ++i) rhs[i] = scale[i] * residual[i];
  });
  const Clock::time_point start = Clock::now();
  factor->solve(rhs, solution);
  report.solve_seconds += since(start);
  // A row with slack can't change sides within an iteration: it lets go first.
  if (options.weft.slack > 0 || options.warp.slack > 0) {
    for (int r = 0; r < strains(); ++r)
      if (soft(r) && band(r).slack > 0) {
        const double after = strain_lambda[r] + scale[r] * solution[r];
        const double side = strain_lambda[r] != 0 ? strain_lambda[r] : residual[r];
        if (slack[r] || after * side < 0) solution[r] = scale[r] > 0 ? -strain_lambda[r] / scale[r] : 0;
      }
  }
  push(solution, x);
}

ProjectionReport FastProjection::Impl::iterate(Eigen::Ref<Eigen::VectorXd> x, Directions directions) {
  ProjectionReport report;
  double best = std::numeric_limits<double>::infinity(), last = best;
  int waited = 0;
  bool factored = false;
  while (true) {
    measure(x, report);
    const double excess = std::max(
        {report.strain_violation / std::max(options.tolerance, 1e-30),
         report.place_violation / std::max(options.place_tolerance, 1e-30),
         report.residual / (exactness * (directions == Directions::start ? options.residual : damped_residual))});
    if (size() == 0 || (report.converged && excess <= 1 && report.iterations >= options.min_iterations)) break;
    if (report.iterations >= options.max_iterations) break;
    if (!std::isfinite(excess)) break;
    waited = excess < least_gain * best ? 0 : waited + 1;
    best = std::min(best, excess);
    if (waited >= patience) break;
    const bool gained = excess <= no_gain * last;
    if (directions == Directions::start && !gained) break;
    if (directions == Directions::renewed || (directions == Directions::candidate && (!factored || !gained))) {
      point_along(y);
      factored = false;
    }
    if (!factored || excess > poor_gain * last) {
      if (!factorise(report)) break;
      factored = true;
    }
    last = excess;
    correct(x, report);
    ++report.iterations;
  }
  report.energy = limit_energy();
  return report;
}

FastProjection::FastProjection(const AffineMap& map, const Eigen::VectorXd& node_mass, ConstraintRows rows,
                               const ProjectionOptions& options)
    : impl_(std::make_unique<Impl>(map, std::move(rows), options)) {
  impl_->build(node_mass);
}
FastProjection::~FastProjection() = default;
FastProjection::FastProjection(FastProjection&&) noexcept = default;
FastProjection& FastProjection::operator=(FastProjection&&) noexcept = default;

ProjectionReport FastProjection::project(Eigen::Ref<Eigen::VectorXd> x, double t) {
  impl_->begin(t);
  return impl_->iterate(x, Impl::Directions::renewed);
}

ProjectionReport FastProjection::step(Eigen::Ref<Eigen::VectorXd> x, double t,
                                      const Eigen::Ref<const Eigen::VectorXd>& start, double dt,
                                      ConstraintForces& forces) {
  Impl& s = *impl_;
  if (s.options.variant == ProjectionVariant::paper) return project(x, t);
  s.map.fixed_places(t - dt, s.fixed_places);
  s.share_out(s.strains() + s.places(),
              [&](int begin, int end) { evaluate(s.composed, start, s.fixed_places, begin, end, s.tangents); });
  s.begin(t);
  s.point_along(s.tangents);
  s.complete(forces);
  const double dt2 = dt * dt;
  s.exactness = std::clamp(s.least_damping_rate * dt, least_exactness, 1.0);
  s.candidate = x;
  // What the steps before are owed, and as a first guess that the forces stay as they are. Multipliers are what the
  // end of the step adds.
  s.share_out(s.strains(), [&](int begin, int end) {
    for (int r = begin; r < end; ++r) {
      s.rhs[r] = 0;
      if (!s.has_law(r)) continue;
      Eigen::Vector4d weights = force_weights(std::min(1.0, dt * s.damping_rate[r]));
      s.share[r] = weights[0];
      s.compliance[r] = 1 / (s.share[r] * s.stiffness[r] * dt2);
      weights[1] += weights[0];
      s.rhs[r] = dt2 * weights.tail<3>().dot(forces.strain.col(r)) / s.scale[r];
    }
  });
  for (int i = s.strains(); i < s.size(); ++i)
    s.rhs[i] = dt2 * forces.place((i - s.strains()) % 3, (i - s.strains()) / 3) / s.scale[i];
  s.push(s.rhs, x);
  s.share_out(s.strains(), [&](int begin, int end) {
    for (int r = begin; r < end; ++r) s.strain_lambda[r] = s.soft(r) ? s.share[r] * dt2 * forces.strain(0, r) : 0;
  });
  ProjectionReport report = s.iterate(x, Impl::Directions::start);
  if (!report.converged || report.residual > s.exactness * s.options.residual) {
    // From no force on.
    x = s.candidate;
    s.clear();
    s.compliance = s.compliance.cwiseProduct(s.share);
    s.share.setOnes();
    const ProjectionReport again = s.iterate(x, Impl::Directions::candidate);
    const int iterations = report.iterations + again.iterations;
    const double factor_seconds = report.factor_seconds + again.factor_seconds;
    const double solve_seconds = report.solve_seconds + again.solve_seconds;
    report = again;
    report.damped = true;
    report.iterations = iterations;
    report.factor_seconds = factor_seconds;
    report.solve_seconds = solve_seconds;
  }
  s.share_out(s.strains(), [&](int begin, int end) {
    for (int r = begin; r < end; ++r) {
      s.strain_lambda[r] /= s.share[r];
      forces.strain(2, r) = forces.strain(1, r);
      forces.strain(1, r) = forces.strain(0, r);
      forces.strain(0, r) = s.strain_lambda[r] / dt2;
    }
  });
  forces.place = s.place_lambda / dt2;
  return report;
}

void FastProjection::use_threads(Workers* workers) {
  if (impl_->factor) impl_->factor->use_threads(workers);
  impl_->workers = workers;
}

ProjectionReport FastProjection::measure(const Eigen::Ref<const Eigen::VectorXd>& x, double t) {
  ProjectionReport report;
  impl_->begin(t);
  impl_->measure(x, report);
  return report;
}

double FastProjection::energy(const Eigen::Ref<const Eigen::VectorXd>& x, double t) {
  Impl& s = *impl_;
  if (s.options.variant == ProjectionVariant::paper) return 0;
  s.map.fixed_places(t, s.fixed_places);
  evaluate(s.composed, x, s.fixed_places, s.y);
  return s.limit_energy();
}

const Eigen::VectorXd& FastProjection::strain_multipliers() const {
  return impl_->strain_lambda;
}
const Eigen::Matrix3Xd& FastProjection::place_multipliers() const {
  return impl_->place_lambda;
}
const Eigen::Matrix3Xd& FastProjection::strain_impulses() const {
  return impl_->strain_impulse;
}
ProjectionMemory FastProjection::memory() const {
  return {impl_->strain_lambda, impl_->place_lambda, impl_->strain_impulse};
}
bool FastProjection::restore(const ProjectionMemory& memory) {
  Impl& s = *impl_;
  if (memory.strain_multipliers.size() != s.strains() || memory.strain_impulses.cols() != s.strains() ||
      memory.place_multipliers.cols() != s.places())
    return false;
  s.strain_lambda = memory.strain_multipliers;
  s.place_lambda = memory.place_multipliers;
  s.strain_impulse = memory.strain_impulses;
  return true;
}
const ConstraintRows& FastProjection::rows() const {
  return impl_->rows;
}
const ProjectionOptions& FastProjection::options() const {
  return impl_->options;
}
std::size_t FastProjection::gram_nonzeros() const {
  return 2 * impl_->pattern.row.size() - static_cast<std::size_t>(impl_->size());  // the pattern is the lower triangle
}
std::size_t FastProjection::factor_nonzeros() const {
  return impl_->factor ? impl_->factor->factor_nonzeros() : 0;
}

}  // namespace toile
