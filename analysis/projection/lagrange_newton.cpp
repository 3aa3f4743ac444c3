// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/projection/lagrange_newton.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "analysis/constraint/composed_rows.h"
#include "analysis/projection/force_norm.h"
#include "analysis/projection/row_matrix.h"
#include "geometry/clock.h"
#include "geometry/error.h"

namespace toile {
namespace {

constexpr int patience = 5;              // iterations without gain before giving up
constexpr double least_gain = 0.99;      // an excess above this times the best so far is no gain
constexpr double least_softness = 1e-8;  // of the diagonal of J M^-1 J^T: its inverse times rounding is still small
constexpr double rounding = 1e-14;       // of the places: a smaller correction has no direction
constexpr double least_strain = 1e-3;    // of the tolerance: smaller violations are compared with this instead

}  // namespace

struct LagrangeNewton::Impl {
  AffineMap map;
  ConstraintRows rows;
  ProjectionOptions options;
  ComposedRows composed;
  Eigen::VectorXd mass;           // per node
  Eigen::VectorXd gram_diagonal;  // of D M^-1 D^T, per scalar row; 0: takes no part
  RowMatrix matrix;

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
        gram_diagonal(toile::gram_diagonal(map, rows, composed, mass)),
        matrix(composed.free, mass),
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
        memory(no_impulses(rows)) {}

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
  const double moved = force_norm(force, mass);
  double smallest_move = 0;
  for (int k = 0; k < mass.size(); ++k) smallest_move += mass[k] * x.segment<3>(3 * k).squaredNorm();
  smallest_move = rounding * std::sqrt(smallest_move);
  for (int r = 0; r < strains(); ++r) spread(r, lambda()[r] * y.col(r), force);
  for (int p = 0; p < places(); ++p) spread(strains() + p, memory.place_multipliers.col(p), force);
  const double left = force_norm(force, mass);
  report.residual = left <= smallest_move ? 0 : left / std::max(moved, smallest_move);
  const double first = std::max(first_strain, least_strain * options.tolerance);
  if (strains() > 0) report.residual = std::max(report.residual, missed.cwiseAbs().maxCoeff() / first);
}

// K + J^T S^-1 J at the present y and multipliers; without those of compression, it is positive.
void LagrangeNewton::Impl::assemble(bool compression) {
  for (int r = 0; r < size(); ++r) {
    if (gram_diagonal[r] == 0) continue;
    const double slope = 1 / softness[r];
    matrix.blocks[r] = r >= strains() ? SymmetricBlock{slope, slope, slope}
                                      : SymmetricBlock::along(slope, y.col(r).data(),
                                                              compression ? lambda()[r] : std::max(lambda()[r], 0.0));
  }
}

bool LagrangeNewton::Impl::factorise(ProjectionReport& report) {
  for (int attempt = 0; attempt < 5; ++attempt) {
    if (attempt > 1) softness *= 10;
    assemble(attempt == 0);
    const Clock::time_point start = Clock::now();
    const bool positive = matrix.factorise();
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
  matrix.solve(rhs, solution);
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
    : impl_(std::make_unique<Impl>(map, node_mass, std::move(rows), options)) {
  require_whole_places(impl_->rows);
}
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

ProjectionReport LagrangeNewton::step(Eigen::Ref<Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> v, double t,
                                      const Eigen::Ref<const Eigen::VectorXd>&, double dt, ConstraintForces&) {
  v -= x / dt;
  const ProjectionReport report = project(x, t);
  v += x / dt;
  return report;
}

ProjectionReport LagrangeNewton::measure(const Eigen::Ref<const Eigen::VectorXd>& x, double t) {
  ProjectionReport report;
  impl_->begin(t);
  impl_->measure(x, report);
  return report;
}

const ProjectionMemory& LagrangeNewton::memory() const {
  return impl_->memory;
}
void LagrangeNewton::set_memory(const ProjectionMemory& memory) {
  impl_->memory = memory;
}
void LagrangeNewton::use_threads(Workers* workers) {
  impl_->matrix.use_threads(workers);
  if (impl_->projection) impl_->projection->use_threads(workers);
  impl_->workers = workers;
}
const ConstraintRows& LagrangeNewton::rows() const {
  return impl_->rows;
}
std::size_t LagrangeNewton::factor_nonzeros() const {
  return impl_->matrix.factor_nonzeros();
}

}  // namespace toile
