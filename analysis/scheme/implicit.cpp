// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/scheme/implicit.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "analysis/projection/force_norm.h"
#include "analysis/projection/primal_dual.h"
#include "analysis/scheme/node_forces.h"
#include "geometry/clock.h"

namespace toile {
namespace {

using Vector = Eigen::VectorXd;

// TR-BDF2 with the one gamma whose stages have the same matrix.
constexpr double gamma = 2 - std::numbers::sqrt2;
constexpr double c1 = 1 / (gamma * (2 - gamma)), c0 = c1 - 1;

}  // namespace

struct ImplicitScheme::Impl {
  const MechanicalSystem& system;
  const ImplicitRule rule;
  NodeForces smooth;
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
    const ProjectionMemory& now = newton.memory();
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
  s.reference = force_norm(loads, s.system.node_mass);
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
  report.elastic = initialise(system, next);
  bool finite = true;
  for (int k = 0; k < system.node_mass.size(); ++k) {
    const Eigen::Vector3d v = next.v.segment<3>(3 * k), move = next.x.segment<3>(3 * k) - state.x.segment<3>(3 * k);
    const double mass = system.node_mass[k];
    report.kinetic += 0.5 * mass * move.squaredNorm() / (dt * dt);
    report.kinetic_end += 0.5 * mass * v.squaredNorm();
    // Mean of the ends, as the work of a force that changes evenly.
    const Eigen::Vector3d mean = 0.5 * (v + state.v.segment<3>(3 * k));
    report.drag_work -= system.node_drag[k] * (mean - system.loads.wind).dot(move);
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
