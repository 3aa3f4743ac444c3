// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/projection/fast_projection.h"

#include <algorithm>
#include <cmath>
#include <limits>
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
constexpr double shortest_tangent = 1e-4;  // |y| below which a collapsed tangent is scaled as if it were this long

}  // namespace

// The worst of some strain rows.
struct Violation {
  double violation = 0;
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
  CompressedRows at_node;          // M^-1 D^T
  Eigen::VectorXd gram_diagonal;   // per scalar row; 0: takes no part
  std::vector<int> system_scalar;  // scalar row of each system row
  SparsePattern pattern;
  std::vector<double> gram, values;  // per entry of the pattern
  std::unique_ptr<Cholesky> factor;
  Workers* workers = nullptr;  // null: one thread

  Eigen::Matrix3Xd y, direction, targets, fixed_places;  // direction: scaled, per system row
  Eigen::VectorXd scale, residual, rhs, solution;
  ProjectionMemory memory;
  Eigen::Matrix3Xd impulse;  // per scalar row, of one push
  std::vector<Violation> worst_of_piece;

  Impl(const AffineMap& m, ConstraintRows r, const ProjectionOptions& o)
      : map(m), rows(std::move(r)), options(o), composed(compose(map, rows)), memory(no_impulses(rows)) {}

  int strains() const { return static_cast<int>(rows.strain.size()); }
  int places() const { return static_cast<int>(rows.place.size()); }
  int size() const { return strains() + 3 * places(); }
  bool takes_part(int r) const { return gram_diagonal[r] > 0; }
  double strain(const Eigen::Matrix3Xd& tangent, int r) const { return 0.5 * (tangent.col(r).squaredNorm() - 1); }
  template <class Body>
  void share_out(int count, const Body& body) {
    toile::share_out(workers, count, body);
  }

  void build(const Eigen::VectorXd& node_mass);
  void begin(double t);
  void measure(const Eigen::Ref<const Eigen::VectorXd>& x, ProjectionReport& report);
  Violation measure_strain(int begin, int end);
  void point_along(const Eigen::Matrix3Xd& tangents);
  bool factorise(ProjectionReport& report);
  void correct(Eigen::Ref<Eigen::VectorXd> x, ProjectionReport& report);
  void push(const Eigen::VectorXd& amounts, Eigen::Ref<Eigen::VectorXd> x);
  ProjectionReport iterate(Eigen::Ref<Eigen::VectorXd> x);
};

void FastProjection::Impl::build(const Eigen::VectorXd& node_mass) {
  gram_diagonal = toile::gram_diagonal(map, rows, composed, node_mass);
  at_node = transposed_by_mass(composed.free, node_mass);

  const GramMatrix scalar = gram_matrix(composed.free, node_mass);
  const int scalars = strains() + places();

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
  direction.resize(3, size());
  targets.resize(3, places());
  scale.resize(size());
  residual.resize(size());
  rhs.resize(size());
  solution.resize(size());
  impulse.resize(3, scalars);
  worst_of_piece.resize(static_cast<std::size_t>(pieces(strains())));
}

void FastProjection::Impl::begin(double t) {
  map.fixed_places(t, fixed_places);
  for (int p = 0; p < places(); ++p) targets.col(p) = rows.place[p].target(t);
  memory.strain_multipliers.setZero();
  memory.place_multipliers.setZero();
  memory.strain_impulses.setZero();
}

// Violation and residual of strain rows, at y.
Violation FastProjection::Impl::measure_strain(int begin, int end) {
  Violation worst;
  for (int r = begin; r < end; ++r) {
    residual[r] = takes_part(r) ? strain(y, r) : 0;
    if (takes_part(r)) worst.take(std::abs(residual[r]), r);
  }
  return worst;
}

void FastProjection::Impl::measure(const Eigen::Ref<const Eigen::VectorXd>& x, ProjectionReport& report) {
  share_pieces(workers, strains(), [&](int index, int begin, int end) {
    evaluate(composed, x, fixed_places, begin, end, y);
    worst_of_piece[static_cast<std::size_t>(index)] = measure_strain(begin, end);
  });
  Violation worst;
  for (const Violation& piece : worst_of_piece) worst.take(piece.violation, piece.row);
  report.strain_violation = worst.violation;
  report.worst_row = worst.row;
  report.place_violation = 0;
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
      const double t0 = t[3 * c], t1 = t[3 * c + 1], t2 = t[3 * c + 2];
      for (int e = pattern.column_start[c]; e < pattern.column_start[c + 1]; ++e) {
        const int r = pattern.row[e];
        const double* s = t + 3 * r;
        values[e] = gram[e] * (s[0] * t0 + s[1] * t1 + s[2] * t2);
      }
    }
  });
  // Strain rows may depend on each other (an edge between two pins); place rows may not, and get no softness unless the
  // factor fails without it.
  double strain_softness = options.regularisation, place_softness = 0;
  for (int attempt = 0; attempt < 4; ++attempt) {
    share_out(size(), [&](int begin, int end) {
      for (int i = begin; i < end; ++i)
        values[pattern.column_start[i]] = 1 + (i < strains() ? strain_softness : place_softness);
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
      memory.strain_multipliers[r] += scale[r] * amounts[r];
      memory.strain_impulses.col(r) += impulse.col(r);
    }
  });
  for (int i = strains(); i < size(); ++i) {
    const int p = (i - strains()) / 3, k = (i - strains()) % 3;
    impulse(k, strains() + p) = amounts[i] * scale[i];
    memory.place_multipliers(k, p) += impulse(k, strains() + p);
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
  push(solution, x);
}

ProjectionReport FastProjection::Impl::iterate(Eigen::Ref<Eigen::VectorXd> x) {
  ProjectionReport report;
  double best = std::numeric_limits<double>::infinity();
  int waited = 0;
  while (true) {
    measure(x, report);
    const double excess = std::max(report.strain_violation / std::max(options.tolerance, 1e-30),
                                   report.place_violation / std::max(options.place_tolerance, 1e-30));
    if (size() == 0 || (report.converged && report.iterations >= options.min_iterations)) break;
    if (report.iterations >= options.max_iterations || !std::isfinite(excess)) break;
    waited = excess < least_gain * best ? 0 : waited + 1;
    best = std::min(best, excess);
    if (waited >= patience) break;
    point_along(y);
    if (!factorise(report)) break;
    correct(x, report);
    ++report.iterations;
  }
  return report;
}

FastProjection::FastProjection(const AffineMap& map, const Eigen::VectorXd& node_mass, ConstraintRows rows,
                               const ProjectionOptions& options)
    : impl_(std::make_unique<Impl>(map, std::move(rows), options)) {
  require_whole_places(impl_->rows);
  impl_->build(node_mass);
}
FastProjection::~FastProjection() = default;
FastProjection::FastProjection(FastProjection&&) noexcept = default;
FastProjection& FastProjection::operator=(FastProjection&&) noexcept = default;

ProjectionReport FastProjection::project(Eigen::Ref<Eigen::VectorXd> x, double t) {
  impl_->begin(t);
  return impl_->iterate(x);
}

ProjectionReport FastProjection::step(Eigen::Ref<Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> v, double t,
                                      const Eigen::Ref<const Eigen::VectorXd>&, double dt, ConstraintForces&) {
  v -= x / dt;
  const ProjectionReport report = project(x, t);
  v += x / dt;
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

const ProjectionMemory& FastProjection::memory() const {
  return impl_->memory;
}
void FastProjection::set_memory(const ProjectionMemory& memory) {
  impl_->memory = memory;
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
