// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/projection/lagrange_newton.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "analysis/constraint/composed_rows.h"
#include "analysis/linear/cholesky.h"
#include "geometry/clock.h"
#include "geometry/error.h"

namespace toile {
namespace {

constexpr int patience = 5;              // iterations without gain before giving up
constexpr double least_gain = 0.99;      // an excess above this times the best so far is no gain
constexpr double least_softness = 1e-8;  // of the diagonal of J M^-1 J^T: its inverse times rounding is still small
constexpr double rounding = 1e-14;       // of the places: a smaller correction has no direction
constexpr double least_strain = 1e-3;    // of the tolerance: smaller violations are compared with this instead

// Lower triangle of sum_r (d_r^T d_r) x B_r + diag(m) x I over nodes, B_r a symmetric 3 x 3 block.
struct NodeBlocks {
  SparsePattern pattern;
  std::vector<int> below;  // of each pair of a row's entries (first <= second): how many blocks below the diagonal's

  NodeBlocks(const CompressedRows& rows, int nodes) {
    std::vector<std::vector<int>> near(nodes);  // itself and the nodes of larger number that a row has in common
    for (int j = 0; j < nodes; ++j) near[j].push_back(j);
    for_pairs(rows, [&](int first, int second) { near[first].push_back(second); });
    pattern.column_start.push_back(0);
    for (int j = 0; j < nodes; ++j) {
      std::sort(near[j].begin(), near[j].end());
      near[j].erase(std::unique(near[j].begin(), near[j].end()), near[j].end());
      for (int b = 0; b < 3; ++b) {
        for (const int i : near[j])
          for (int a = i == j ? b : 0; a < 3; ++a) pattern.row.push_back(3 * i + a);
        pattern.column_start.push_back(static_cast<int>(pattern.row.size()));
      }
    }
    for_pairs(rows, [&](int first, int second) {
      const auto place = std::lower_bound(near[first].begin(), near[first].end(), second);
      below.push_back(static_cast<int>(place - near[first].begin()));
    });
  }

  // visit(node, node of equal or larger number), row by row.
  template <class Visit>
  static void for_pairs(const CompressedRows& rows, Visit visit) {
    for (int r = 0; r < rows.size(); ++r)
      for (int p = rows.start[r]; p < rows.start[r + 1]; ++p)
        for (int q = p; q < rows.start[r + 1]; ++q) visit(rows.column[p], rows.column[q]);
  }

  // Of values: column b of the block that many below the diagonal's, its row 0 (in the diagonal block, rows from b on).
  double* column(std::vector<double>& values, int node, int lower, int b) const {
    return values.data() + pattern.column_start[3 * node + b] + 3 * lower - b;
  }
};

}  // namespace

struct LagrangeNewton::Impl {
  AffineMap map;
  ConstraintRows rows;
  ProjectionOptions options;
  ComposedRows composed;
  Eigen::VectorXd mass;           // per node
  Eigen::VectorXd gram_diagonal;  // of D M^-1 D^T, per scalar row; 0: takes no part
  NodeBlocks blocks;
  std::vector<double> values;
  std::unique_ptr<Cholesky> factor;

  Eigen::Matrix3Xd y, targets, fixed_places, gap;   // gap: of place rows
  Eigen::VectorXd softness;                         // S, per scalar row
  Eigen::VectorXd strain, missed, anchor;           // of strain rows: C, C - S (lambda - anchor)
  Eigen::VectorXd candidate, force, rhs, solution;  // force: M (x - candidate) + J^T lambda
  double first_strain = 0;                          // largest |C| of the candidate
  ProjectionMemory memory;
  std::unique_ptr<FastProjection> projection;  // made where Newton's method fails first
  Workers* workers = nullptr;                  // of the factor and the projection; null: one thread

  Impl(const AffineMap& m, const Eigen::VectorXd& node_mass, ConstraintRows r, const ProjectionOptions& o)
      : map(m),
        rows(std::move(r)),
        options(o),
        composed(compose(map, rows)),
        mass(node_mass),
        gram_diagonal(Eigen::VectorXd::Zero(composed.free.size())),
        blocks(composed.free, map.nodes()),
        values(blocks.pattern.row.size()),
        y(3, size()),
        targets(3, places()),
        gap(3, places()),
        softness(size()),
        strain(strains()),
        missed(strains()),
        anchor(strains()),
        candidate(3 * map.nodes()),
        force(3 * map.nodes()),
        rhs(3 * map.nodes()),
        solution(3 * map.nodes()),
        memory{Eigen::VectorXd::Zero(strains()), Eigen::Matrix3Xd::Zero(3, places()),
               Eigen::Matrix3Xd::Zero(3, strains())} {
    if (mass.size() != map.nodes()) throw SolverError("constraints: one mass per free node expected");
    for (int k = 0; k < mass.size(); ++k)
      if (!(mass[k] > 0))
        throw SolverError("constraints: control point " + std::to_string(map.node_control_point()[k]) + " has no mass");
    const CompressedRows& d = composed.free;
    for (int k = 0; k < size(); ++k)
      for (int e = d.start[k]; e < d.start[k + 1]; ++e) gram_diagonal[k] += d.value[e] * d.value[e] / mass[d.column[e]];
    for (int p = 0; p < places(); ++p)
      if (!(gram_diagonal[strains() + p] > 0))
        throw SolverError("pin " + std::to_string(rows.place[p].pin) +
                          " holds a point whose control points are all fixed by other pins: remove one of them");
    if (mass.size() > 0) factor = std::make_unique<Cholesky>(blocks.pattern);
  }

  Eigen::VectorXd& lambda() { return memory.strain_multipliers; }
  int strains() const { return static_cast<int>(rows.strain.size()); }
  int places() const { return static_cast<int>(rows.place.size()); }
  int size() const { return composed.free.size(); }

  // to += d_r^T w: what a force w in row r gives the nodes; and the row's value.
  void spread(int r, const Eigen::Vector3d& w, Eigen::VectorXd& to) const {
    for (int e = composed.free.start[r]; e < composed.free.start[r + 1]; ++e)
      to.segment<3>(3 * composed.free.column[e]) += composed.free.value[e] * w;
  }
  Eigen::Vector3d gather(int r, const Eigen::VectorXd& from) const {
    Eigen::Vector3d w = Eigen::Vector3d::Zero();
    for (int e = composed.free.start[r]; e < composed.free.start[r + 1]; ++e)
      w += composed.free.value[e] * from.segment<3>(3 * composed.free.column[e]);
    return w;
  }

  void begin(double t);
  void measure(const Eigen::Ref<const Eigen::VectorXd>& x, ProjectionReport& report);
  void balance(const Eigen::Ref<const Eigen::VectorXd>& x, ProjectionReport& report);
  void assemble(bool compression);
  bool factorise(ProjectionReport& report);
  void correct(Eigen::Ref<Eigen::VectorXd> x, ProjectionReport& report);
  void project(Eigen::Ref<Eigen::VectorXd> x, double t, ProjectionReport& report);
};

void LagrangeNewton::Impl::begin(double t) {
  map.fixed_places(t, fixed_places);
  for (int p = 0; p < places(); ++p) targets.col(p) = rows.place[p].target(t);
}

void LagrangeNewton::Impl::measure(const Eigen::Ref<const Eigen::VectorXd>& x, ProjectionReport& report) {
  evaluate(composed, x, fixed_places, y);
  report.strain_violation = report.place_violation = 0;
  report.worst_row = -1;
  for (int r = 0; r < strains(); ++r) {
    strain[r] = gram_diagonal[r] > 0 ? 0.5 * (y.col(r).squaredNorm() - 1) : 0;
    if (strain[r] == 0 || std::abs(strain[r]) <= report.strain_violation || std::isnan(report.strain_violation))
      continue;  // NaN counts as worst
    report.strain_violation = std::abs(strain[r]);
    report.worst_row = r;
  }
  gap = y.rightCols(places()) - targets;
  for (int p = 0; p < places(); ++p)
    if (!(gap.col(p).norm() <= report.place_violation) && !std::isnan(report.place_violation))
      report.place_violation = gap.col(p).norm();
  report.converged = report.strain_violation <= options.tolerance && report.place_violation <= options.place_tolerance;
}

// Force and missed strains at what was measured, and how large they are.
void LagrangeNewton::Impl::balance(const Eigen::Ref<const Eigen::VectorXd>& x, ProjectionReport& report) {
  missed = strain - softness.head(strains()).cwiseProduct(lambda() - anchor);
  for (int k = 0; k < mass.size(); ++k) force.segment<3>(3 * k) = mass[k] * (x - candidate).segment<3>(3 * k);
  const auto size_of_force = [&] {
    double sum = 0;
    for (int k = 0; k < mass.size(); ++k) sum += force.segment<3>(3 * k).squaredNorm() / mass[k];
    return std::sqrt(sum);
  };
  const double moved = size_of_force();
  double smallest_move = 0;
  for (int k = 0; k < mass.size(); ++k) smallest_move += mass[k] * x.segment<3>(3 * k).squaredNorm();
  smallest_move = rounding * std::sqrt(smallest_move);
  for (int r = 0; r < strains(); ++r) spread(r, lambda()[r] * y.col(r), force);
  for (int p = 0; p < places(); ++p) spread(strains() + p, memory.place_multipliers.col(p), force);
  const double left = size_of_force();
  report.residual = left <= smallest_move ? 0 : left / std::max(moved, smallest_move);
  const double first = std::max(first_strain, least_strain * options.tolerance);
  if (strains() > 0) report.residual = std::max(report.residual, missed.cwiseAbs().maxCoeff() / first);
}

// K + J^T S^-1 J at the present y and multipliers; without those of compression, it is positive.
void LagrangeNewton::Impl::assemble(bool compression) {
  std::fill(values.begin(), values.end(), 0.0);
  for (int k = 0; k < mass.size(); ++k)
    for (int a = 0; a < 3; ++a) blocks.column(values, k, 0, a)[a] = mass[k];
  const CompressedRows& d = composed.free;
  const int* below = blocks.below.data();
  for (int r = 0; r < size(); ++r) {
    if (gram_diagonal[r] == 0) continue;
    Eigen::Matrix3d curvature = Eigen::Matrix3d::Identity() / softness[r];
    if (r < strains()) {
      curvature = y.col(r) * (y.col(r).transpose() / softness[r]);
      curvature.diagonal().array() += compression ? lambda()[r] : std::max(lambda()[r], 0.0);
    }
    for (int p = d.start[r]; p < d.start[r + 1]; ++p)
      for (int q = p; q < d.start[r + 1]; ++q, ++below) {
        const double weight = d.value[p] * d.value[q];
        for (int b = 0; b < 3; ++b) {
          double* column = blocks.column(values, d.column[p], *below, b);
          for (int a = p == q ? b : 0; a < 3; ++a) column[a] += weight * curvature(a, b);
        }
      }
  }
}

bool LagrangeNewton::Impl::factorise(ProjectionReport& report) {
  for (int attempt = 0; attempt < 5; ++attempt) {
    if (attempt > 1) softness *= 10;
    assemble(attempt == 0);
    const Clock::time_point start = Clock::now();
    const bool positive = factor->factorise(values);
    report.factor_seconds += since(start);
    if (positive) return true;
  }
  return false;
}

void LagrangeNewton::Impl::correct(Eigen::Ref<Eigen::VectorXd> x, ProjectionReport& report) {
  missed = strain - softness.head(strains()).cwiseProduct(lambda() - anchor);
  rhs = -force;
  for (int r = 0; r < strains(); ++r)
    if (gram_diagonal[r] > 0) spread(r, -missed[r] / softness[r] * y.col(r), rhs);
  for (int p = 0; p < places(); ++p) spread(strains() + p, -gap.col(p) / softness[strains() + p], rhs);
  const Clock::time_point start = Clock::now();
  factor->solve(rhs, solution);
  report.solve_seconds += since(start);
  x += solution;
  for (int r = 0; r < strains(); ++r)
    if (gram_diagonal[r] > 0) lambda()[r] += (missed[r] + y.col(r).dot(gather(r, solution))) / softness[r];
  for (int p = 0; p < places(); ++p)
    memory.place_multipliers.col(p) += (gap.col(p) + gather(strains() + p, solution)) / softness[strains() + p];
}

// The candidate's projection instead.
void LagrangeNewton::Impl::project(Eigen::Ref<Eigen::VectorXd> x, double t, ProjectionReport& report) {
  if (!projection) {
    projection = std::make_unique<FastProjection>(map, mass, rows, options);
    projection->use_threads(workers);
  }
  x = candidate;
  const ProjectionReport instead = projection->project(x, t);
  memory = projection->memory();
  const int iterations = report.iterations + instead.iterations;
  const double factor_seconds = report.factor_seconds + instead.factor_seconds;
  const double solve_seconds = report.solve_seconds + instead.solve_seconds, residual = report.residual;
  report = instead;
  report.damped = true;
  report.iterations = iterations;
  report.factor_seconds = factor_seconds;
  report.solve_seconds = solve_seconds;
  report.residual = residual;
}

LagrangeNewton::LagrangeNewton(const AffineMap& map, const Eigen::VectorXd& node_mass, ConstraintRows rows,
                               const ProjectionOptions& options)
    : impl_(std::make_unique<Impl>(map, node_mass, std::move(rows), options)) {}
LagrangeNewton::~LagrangeNewton() = default;

ProjectionReport LagrangeNewton::project(Eigen::Ref<Eigen::VectorXd> x, double t) {
  Impl& s = *impl_;
  s.begin(t);
  s.candidate = x;
  s.lambda().setZero();
  s.memory.place_multipliers.setZero();
  s.anchor.setZero();
  s.softness = least_softness * s.gram_diagonal;
  s.softness.head(s.strains()) *= std::max(s.options.regularisation / least_softness, 1.0);
  ProjectionReport report;
  double best = std::numeric_limits<double>::infinity();
  int waited = 0;
  while (true) {
    s.measure(x, report);
    if (report.iterations == 0) s.first_strain = report.strain_violation;
    if (report.strain_violation > s.options.tolerance) s.anchor = s.lambda();
    s.balance(x, report);
    const double excess =
        std::max({report.strain_violation / std::max(s.options.tolerance, std::numeric_limits<double>::min()),
                  report.place_violation / std::max(s.options.place_tolerance, std::numeric_limits<double>::min()),
                  report.residual / s.options.residual});
    if (s.size() == 0 || (excess <= 1 && report.iterations >= s.options.min_iterations)) break;
    if (report.iterations >= s.options.max_iterations) break;
    waited = excess < least_gain * best ? 0 : waited + 1;
    best = std::min(best, excess);
    if (!std::isfinite(excess) || waited >= patience || !s.factorise(report)) {
      s.project(x, t, report);
      return report;
    }
    s.correct(x, report);
    ++report.iterations;
  }
  for (int r = 0; r < s.strains(); ++r) s.memory.strain_impulses.col(r) = s.lambda()[r] * s.y.col(r);
  return report;
}

ProjectionReport LagrangeNewton::step(Eigen::Ref<Eigen::VectorXd> x, double t, const Eigen::Ref<const Eigen::VectorXd>&,
                                      double, ConstraintForces&) {
  return project(x, t);
}

ProjectionReport LagrangeNewton::measure(const Eigen::Ref<const Eigen::VectorXd>& x, double t) {
  ProjectionReport report;
  impl_->begin(t);
  impl_->measure(x, report);
  return report;
}

double LagrangeNewton::energy(const Eigen::Ref<const Eigen::VectorXd>&, double) {
  return 0;
}
const Eigen::VectorXd& LagrangeNewton::strain_multipliers() const {
  return impl_->memory.strain_multipliers;
}
const Eigen::Matrix3Xd& LagrangeNewton::place_multipliers() const {
  return impl_->memory.place_multipliers;
}
const Eigen::Matrix3Xd& LagrangeNewton::strain_impulses() const {
  return impl_->memory.strain_impulses;
}
ProjectionMemory LagrangeNewton::memory() const {
  return impl_->memory;
}
bool LagrangeNewton::restore(const ProjectionMemory& memory) {
  ProjectionMemory& now = impl_->memory;
  const auto fits = [](const auto& a, const auto& b) { return a.rows() == b.rows() && a.cols() == b.cols(); };
  if (!fits(memory.strain_multipliers, now.strain_multipliers) || !fits(memory.strain_impulses, now.strain_impulses) ||
      !fits(memory.place_multipliers, now.place_multipliers))
    return false;
  now = memory;
  return true;
}
void LagrangeNewton::use_threads(Workers* workers) {
  if (impl_->factor) impl_->factor->use_threads(workers);
  if (impl_->projection) impl_->projection->use_threads(workers);
  impl_->workers = workers;
}
const ConstraintRows& LagrangeNewton::rows() const {
  return impl_->rows;
}
std::size_t LagrangeNewton::factor_nonzeros() const {
  return impl_->factor ? impl_->factor->factor_nonzeros() : 0;
}

}  // namespace toile
