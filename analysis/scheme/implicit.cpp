// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/scheme/implicit.h"

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "analysis/projection/primal_dual.h"
#include "analysis/scheme/reduced_matrix.h"
#include "geometry/clock.h"

namespace toile {
namespace {

using Vector = Eigen::VectorXd;
using Places = Eigen::Ref<const Vector>;

// TR-BDF2 with the one gamma whose stages have the same matrix.
constexpr double gamma = 2 - std::numbers::sqrt2;
constexpr double c1 = 1 / (gamma * (2 - gamma)), c0 = c1 - 1;

BlockPattern couplings_of(const MechanicalSystem& system) {
  std::vector<std::vector<int>> groups;
  for (const Potential* potential : system.potentials)
    for (std::vector<int>& group : potential->couplings()) groups.push_back(std::move(group));
  return BlockPattern(system.map->control_points(), groups);
}

// Elastic energy, loads and drag over nodes, at one time.
class Smooth final : public SmoothEnergy {
 public:
  explicit Smooth(const MechanicalSystem& system)
      : system_(system),
        pattern_(couplings_of(system)),
        reduced_(pattern_, *system.map),
        points_(pattern_),
        nodes_(reduced_.pattern()),
        q_(3 * system.map->control_points()),
        f_(q_.size()),
        of_nodes_(3 * system.map->nodes()) {
    for (const Potential* potential : system.potentials) slots_.push_back(potential->slots(pattern_));
  }
  const BlockPattern& pattern() const { return reduced_.pattern(); }

  // Drag sees the velocity (x - from) / beta.
  void at(double t, const Vector& from, double beta) {
    system_.map->fixed_places(t, fixed_places_);
    from_ = from;
    beta_ = beta;
  }
  // Forces on control points without drag, and what the potentials store.
  Elastic force(const Places& x, Vector& q, Vector& f) {
    system_.map->expand(x, fixed_places_, q, system_.workers);
    const Elastic elastic = internal_force(system_.potentials, q, f, system_.workers);
    f += system_.loads.force;
    return elastic;
  }

  double value(const Places& x) override {
    double sum = force(x, q_, f_).total() - system_.loads.force.dot(q_);
    for (int k = 0; k < system_.map->nodes(); ++k)
      sum += 0.5 * system_.node_drag[k] * beta_ * (velocity(x, k) - system_.loads.wind).squaredNorm();
    return sum;
  }
  void add_gradient(const Places& x, Vector& g) override {
    force(x, q_, f_);
    system_.map->reduce(f_, of_nodes_, system_.workers);
    g -= of_nodes_;
    for (int k = 0; k < system_.map->nodes(); ++k)
      g.segment<3>(3 * k) += system_.node_drag[k] * (velocity(x, k) - system_.loads.wind);
  }
  const BlockMatrix& hessian(const Places& x, bool positive) override {
    system_.map->expand(x, fixed_places_, q_, system_.workers);
    points_.set_zero();
    for (std::size_t k = 0; k < slots_.size(); ++k)
      system_.potentials[k]->add_hessian(q_, positive ? TangentKind::positive : TangentKind::exact, slots_[k], points_,
                                         system_.workers);
    reduced_.reduce(points_, nodes_);
    for (int k = 0; k < system_.map->nodes(); ++k)
      for (int a = 0; a < 3; ++a) nodes_.block(pattern().first_slot(k))[4 * a] += system_.node_drag[k] / beta_;
    return nodes_;
  }
  const Eigen::Matrix3Xd& fixed_places() const { return fixed_places_; }

 private:
  Eigen::Vector3d velocity(const Places& x, int k) const {
    return (x.segment<3>(3 * k) - from_.segment<3>(3 * k)) / beta_;
  }

  const MechanicalSystem& system_;
  BlockPattern pattern_;
  ReducedMatrix reduced_;
  BlockMatrix points_, nodes_;
  std::vector<std::vector<int>> slots_;
  Eigen::Matrix3Xd fixed_places_;
  Vector q_, f_, of_nodes_, from_;
  double beta_ = 1;
};

}  // namespace

struct ImplicitScheme::Impl {
  const MechanicalSystem& system;
  const ImplicitRule rule;
  Smooth smooth;
  PrimalDual newton;
  ConstraintForces forces;
  ProjectionMemory impulses;  // of the step so far
  double reference = 0;

  Impl(const MechanicalSystem& s, const PrimalDualOptions& limits, ImplicitRule r)
      : system(s),
        rule(r),
        smooth(s),
        newton(*s.map, s.node_mass, s.projection ? s.projection->rows() : ConstraintRows(), limits, &smooth.pattern()) {
    newton.use_threads(s.workers);
  }

  // M^-1 of the forces at x, with those of rows and pins: the whole acceleration.
  Vector acceleration(const Vector& x, const Vector& v, double t) {
    Vector out = Vector::Zero(x.size());
    smooth.at(t, x - v, 1);  // drag sees v
    smooth.add_gradient(x, out);
    if (system.projection) newton.add_forces(x, t, forces, out);
    for (int k = 0; k < system.node_mass.size(); ++k) out.segment<3>(3 * k) /= -system.node_mass[k];
    return out;
  }
  ProjectionReport minimise(Vector& x, const Vector& guess, const Vector& from, double beta, double t, double weight) {
    smooth.at(t, from, beta);
    const ProjectionReport report = newton.minimise(x, guess, beta, t, smooth, reference, forces);
    const ProjectionMemory now = newton.memory();
    impulses.strain_impulses += weight * now.strain_impulses;
    impulses.place_multipliers += weight * now.place_multipliers;
    impulses.strain_multipliers = now.strain_multipliers;
    return report;
  }
  ProjectionReport advance(const DynamicState& state, double dt, Vector& x, Vector& v);
};

ProjectionReport ImplicitScheme::Impl::advance(const DynamicState& state, double dt, Vector& x, Vector& v) {
  const double dt2 = dt * dt, t1 = state.t + dt;
  if (rule == ImplicitRule::backward_euler) {
    x = state.x;
    const ProjectionReport report = minimise(x, state.x + dt * state.v, state.x, dt, t1, dt2);
    v = (x - state.x) / dt;
    return report;
  }
  const Vector a0 = acceleration(state.x, state.v, state.t);
  const bool whole = rule == ImplicitRule::newmark;
  const double beta = (whole ? 1 : gamma) * dt / 2;
  const double ends = whole ? 0.5 : std::numbers::sqrt2 / 4;
  const ProjectionMemory start = newton.memory();
  impulses.strain_impulses += ends * dt2 * start.strain_impulses;
  impulses.place_multipliers += ends * dt2 * start.place_multipliers;
  x = state.x;
  ProjectionReport report = minimise(x, state.x + 2 * beta * state.v + beta * beta * a0, state.x + beta * state.v, beta,
                                     state.t + 2 * beta, ends * dt2);
  v = (x - state.x) / beta - state.v;
  if (whole) return report;
  const Vector coasting = c1 * v - c0 * state.v, from = c1 * x - c0 * state.x + beta * coasting;
  const ProjectionReport last = minimise(x, from, from - beta * coasting, beta, t1, gamma / 2 * dt2);
  v = coasting + (x - from) / beta;
  const ProjectionReport first = report;
  report = last;
  report.converged = first.converged && last.converged;
  report.iterations += first.iterations;
  report.factor_seconds += first.factor_seconds;
  report.solve_seconds += first.solve_seconds;
  return report;
}

ImplicitScheme::ImplicitScheme(const MechanicalSystem& system, const PrimalDualOptions& limits, ImplicitRule rule,
                               const ImplicitOptions& options) {
  PrimalDualOptions tuned = limits;
  tuned.force_residual = tuned.law_residual = options.residual;
  tuned.max_iterations = options.max_iterations;
  impl_ = std::make_unique<Impl>(system, tuned, rule);
}
ImplicitScheme::~ImplicitScheme() = default;

StepReport ImplicitScheme::step(DynamicState& state, double dt, StepWork& work) {
  const Clock::time_point start = Clock::now();
  DynamicState& next = begin(state, dt, work);
  ProjectionReport found;
  found.converged = true;
  if (next.x.size() > 0) found = impl_->advance(state, dt, next.x, next.v);
  StepReport report = finish(state, dt, work, found);
  report.projection_seconds = since(start);
  return report;
}

StepReport ImplicitScheme::equilibrate(DynamicState& state, double dt, double beta, StepWork& work) {
  const Clock::time_point start = Clock::now();
  DynamicState& next = begin(state, dt, work);
  ProjectionReport found;
  found.converged = true;
  if (next.x.size() > 0) found = impl_->minimise(next.x, state.x, state.x, beta, next.t, dt * dt);
  next.v.setZero();
  StepReport report = finish(state, dt, work, found);
  report.projection_seconds = since(start);
  return report;
}

// What is left is compared with the loads.
DynamicState& ImplicitScheme::begin(const DynamicState& state, double dt, StepWork& work) {
  Impl& s = *impl_;
  DynamicState& next = work.other;
  next.t = state.t + dt;
  next.x = state.x;
  next.v = state.v;
  s.forces = state.constraint;
  s.impulses = no_impulses(s.newton.rows());
  Vector loads(3 * s.system.map->nodes());
  s.system.map->reduce(s.system.loads.force, loads, s.system.workers);
  double size = 0;
  for (int k = 0; k < s.system.node_mass.size(); ++k)
    size += loads.segment<3>(3 * k).squaredNorm() / s.system.node_mass[k];
  s.reference = std::sqrt(size);
  return next;
}

StepReport ImplicitScheme::finish(DynamicState& state, double dt, StepWork& work, const ProjectionReport& found) {
  Impl& s = *impl_;
  const MechanicalSystem& system = s.system;
  DynamicState& next = work.other;
  StepReport report;
  report.dt = dt;
  report.at_end = true;
  report.projection = found;
  report.limit_energy = found.energy;
  next.constraint = s.forces;
  if (system.projection) system.projection->restore(s.impulses);
  next.q.resize(3 * system.map->control_points());
  next.f.resize(next.q.size());
  s.smooth.at(next.t, next.x, 1);
  report.elastic = s.smooth.force(next.x, next.q, next.f);
  // The cloth's own acceleration, for whoever goes on from here.
  next.a.resize(next.x.size());
  system.map->reduce(next.f, next.a, system.workers);
  bool finite = true;
  for (int k = 0; k < system.node_mass.size(); ++k) {
    const Eigen::Vector3d v = next.v.segment<3>(3 * k), move = next.x.segment<3>(3 * k) - state.x.segment<3>(3 * k);
    const double mass = system.node_mass[k];
    report.kinetic += 0.5 * mass * move.squaredNorm() / (dt * dt);
    report.kinetic_end += 0.5 * mass * v.squaredNorm();
    // Mean of the ends, as the work of a force that changes evenly.
    const Eigen::Vector3d mean = 0.5 * (v + state.v.segment<3>(3 * k));
    report.drag_work -= system.node_drag[k] * (mean - system.loads.wind).dot(move);
    next.a.segment<3>(3 * k) -= system.node_drag[k] * (v - system.loads.wind);
    next.a.segment<3>(3 * k) /= mass;
    finite = finite && next.x.segment<3>(3 * k).allFinite() && v.allFinite();
  }
  report.load_work = system.loads.force.dot(next.q - state.q);
  report.finite = finite && std::isfinite(report.kinetic_end) && std::isfinite(report.elastic.total());
  if (!report.finite) return report;
  report.motion_work = motion_work(system, state, next, work);
  std::swap(state, next);
  return report;
}

}  // namespace toile
