// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/scheme/equilibrium_path.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>

#include "analysis/constraint/composed_rows.h"
#include "analysis/projection/force_norm.h"
#include "analysis/projection/row_matrix.h"
#include "analysis/scheme/node_forces.h"
#include "geometry/clock.h"
#include "geometry/error.h"

namespace toile {
namespace {

using Vector = Eigen::VectorXd;

constexpr double place_softness = 1e-8;   // of what a row would give by its nodes alone
constexpr double place_tolerance = 1e-9;  // m
constexpr double rounding = 1e-13;        // of the places: an iteration that moves no node by more has nothing to gain
constexpr int halvings_at_most = 10;
constexpr int easy_iterations = 5;  // steps that take fewer grow
constexpr double growth = 1.5;

std::string text_of(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

}  // namespace

struct EquilibriumPath::Impl {
  const MechanicalSystem& system;
  const PathOptions options;
  ConstraintRows rows;
  ComposedRows composed;
  NodeForces forces;
  RowMatrix matrix;
  Vector loads;  // the whole, over nodes
  double loads_size = 0, mass_sum = 0;
  Vector compliance;  // of place rows, m/N
  Eigen::Matrix3Xd y, gap, row_force, change;
  Vector force, rhs, move, along;

  // Of the attempt at hand.
  Vector x;
  Eigen::Matrix3Xd mu;
  double factor = 0, left = 0, remaining = 0;
  double length = 0;   // that it tried
  bool stuck = false;  // where it began: no length helps
  int iterations = 0, negative = 0;

  Impl(const MechanicalSystem& s, const PathOptions& o)
      : system(s),
        options(o),
        rows(s.projection ? s.projection->rows() : ConstraintRows()),
        composed(compose(*s.map, rows)),
        forces(s),
        matrix(composed.free, s.node_mass, &forces.pattern()),
        loads(3 * s.map->nodes()),
        mass_sum(s.node_mass.sum()),
        compliance(places()),
        y(3, places()),
        gap(3, places()),
        row_force(3, places()),
        change(3, places()),
        force(loads.size()),
        rhs(loads.size()),
        move(loads.size()),
        along(loads.size()) {
    if (!rows.strain.empty()) throw SolverError("equilibrium path: strain limits have no tangent here");
    if ((s.node_drag.array() != 0).any()) throw SolverError("equilibrium path: drag has no equilibrium");
    gram_diagonal(*s.map, rows, composed, s.node_mass);  // throws for what can't be held
    matrix.scale = 0;
    matrix.use_threads(s.workers);
  }
  int places() const { return static_cast<int>(rows.place.size()); }

  // Root of the mean product of two moves, by mass.
  double product(const Vector& a, const Vector& b) const {
    double sum = 0;
    for (int k = 0; k < system.node_mass.size(); ++k)
      sum += system.node_mass[k] * a.segment<3>(3 * k).dot(b.segment<3>(3 * k));
    return sum / mass_sum;
  }

  void begin(const DynamicState& state, double t);
  void measure(double t);
  std::optional<int> factorise();
  void solve(bool with_gaps, Vector& out);
  bool attempt(const DynamicState& state, double t, PathPoint& point, double at_most, bool by_load,
               std::string& trouble);
  std::string unbalanced() const;
  void finish(DynamicState& state, double dt, const PathPoint& point, StepWork& work, StepReport& report);
};

void EquilibriumPath::Impl::begin(const DynamicState& state, double t) {
  system.map->reduce(system.loads.force, loads, system.workers);
  loads_size = force_norm(loads, system.node_mass);
  forces.at(t, state.x, 1);
  const BlockMatrix& hessian = forces.hessian(state.x, true);
  const Vector none = Vector::Zero(system.node_mass.size());
  for (int p = 0; p < places(); ++p) {
    compliance[p] = place_softness * own_compliance(composed.free, p, none, hessian);
    const Eigen::Vector3d stiff = rows.place[p].axes / compliance[p];
    matrix.blocks[static_cast<std::size_t>(p)] = {stiff.x(), stiff.y(), stiff.z()};
  }
}

// What is left of the balance, with the pins' forces, and of the pins' places.
void EquilibriumPath::Impl::measure(double t) {
  force.setZero();
  forces.load_factor = factor;
  forces.add_gradient(x, force);
  matrix.spread(mu, force);
  evaluate(composed, x, forces.fixed_places(), y);
  for (int p = 0; p < places(); ++p) gap.col(p) = (y.col(p) - rows.place[p].target(t)).cwiseProduct(rows.place[p].axes);
  left = force_norm(force, system.node_mass) / loads_size;
}

std::optional<int> EquilibriumPath::Impl::factorise() {
  return matrix.factorise_any(&forces.hessian(x, false));
}

// `rhs` and what closes the gaps, by the factor at hand.
void EquilibriumPath::Impl::solve(bool with_gaps, Vector& out) {
  if (with_gaps) {
    for (int p = 0; p < places(); ++p) row_force.col(p) = -gap.col(p) / compliance[p];
    matrix.spread(row_force, rhs);
  }
  matrix.solve(rhs, out);
}

std::string EquilibriumPath::Impl::unbalanced() const {
  return "Newton's method finds no balance in " + std::to_string(iterations) + " iterations (" + text_of(left) +
         " of the loads is left)";
}

// Newton's method from the state to the next equilibrium: with `by_load` at the factor point.factor + at_most, else
// where the path has gone on by `at_most`, or by what a load step allows: along the tangent first and then normal to
// the move so far.
bool EquilibriumPath::Impl::attempt(const DynamicState& state, double t, PathPoint& point, double at_most, bool by_load,
                                    std::string& trouble) {
  x = state.x;
  mu = state.constraint.place;
  if (mu.cols() != places()) mu.setZero(3, places());
  factor = by_load ? point.factor + at_most : point.factor;
  length = at_most;
  remaining = std::numeric_limits<double>::infinity();
  for (iterations = 0;; ++iterations, ++point.iterations) {
    measure(t);
    const bool held = places() == 0 || gap.colwise().norm().maxCoeff() <= place_tolerance;
    const bool balanced = left <= options.residual || remaining <= rounding * x.lpNorm<Eigen::Infinity>();
    const bool found = iterations > 0 && held && balanced;
    if (!found && (!std::isfinite(left) || iterations == options.max_iterations)) {
      trouble = unbalanced();
      return false;
    }
    const std::optional<int> below = factorise();
    if (!below) {
      stuck = iterations == 0;
      trouble = "the stiffness is singular";
      return false;
    }
    negative = *below;
    if (found) return true;
    rhs = -force;
    solve(true, move);
    if (!by_load) {
      rhs = loads;
      solve(false, along);
      double share = 0;
      if (iterations == 0) {
        const double size = std::sqrt(product(along, along));
        const bool back = point.moved.size() > 0 && product(point.moved, along) < 0;
        length = std::min(at_most, size / options.load_steps);
        share = (back ? -1 : 1) * length / size;
      } else {
        const Vector so_far = x - state.x;
        share = -product(so_far, move) / product(so_far, along);
      }
      move += share * along;
      factor += share;
    }
    x += move;
    matrix.gather(move, change);
    for (int p = 0; p < places(); ++p)
      mu.col(p) += (gap.col(p) + change.col(p).cwiseProduct(rows.place[p].axes)) / compliance[p];
    remaining = move.lpNorm<Eigen::Infinity>();
  }
}

EquilibriumPath::EquilibriumPath(const MechanicalSystem& system, const PathOptions& options)
    : impl_(std::make_unique<Impl>(system, options)) {}
EquilibriumPath::~EquilibriumPath() = default;

PathReport EquilibriumPath::step(DynamicState& state, double dt, PathPoint& point, StepWork& work) {
  Impl& s = *impl_;
  PathReport out;
  const Clock::time_point start = Clock::now();
  const double t = state.t + dt, whole = 1.0 / s.options.load_steps;
  s.begin(state, t);
  if (!(s.loads_size > 0)) throw SolverError("equilibrium path: there are no loads");
  // To the next multiple of a load step at most.
  const double next = std::min(1.0, whole * (std::floor(point.factor / whole + 1e-9) + 1)) - point.factor;
  const bool arc = s.options.arc_length && point.length > 0;
  if (point.length == 0) point.length = whole, point.shortest = std::ldexp(whole, -halvings_at_most);
  bool found = false, landed = false;
  s.stuck = false;
  for (;; ++point.halvings) {
    found = s.attempt(state, t, point, arc ? point.length : std::min(point.length, next), !arc, out.trouble);
    const double tried = s.length;
    // Past the end: back to it, from where the path was last. Where that finds nothing, a shorter step may end before.
    if (found && arc && s.factor >= 1) {
      found = !landed && s.attempt(state, t, point, 1 - point.factor, true, out.trouble);
      landed = true;
    }
    if (found) break;
    s.length = tried;
    if (s.stuck || tried / 2 < point.shortest) break;
    point.length = tried / 2;
  }
  out.step.projection.iterations = s.iterations;
  out.step.projection.converged = found;
  if (!found) {
    out.trouble = "beyond " + text_of(point.factor) + " of the loads, with steps down to " + text_of(s.length) +
                  (arc ? " m of the path: " : " of them: ") + out.trouble;
    return out;
  }
  out.trouble.clear();
  s.finish(state, dt, point, work, out.step);
  const double grown = s.iterations <= easy_iterations ? growth : 1;
  point.moved = s.x - work.other.x;
  const double went = std::sqrt(s.product(point.moved, point.moved));
  if (s.options.arc_length && !arc) point.shortest = std::ldexp(went, -halvings_at_most);
  point.length = s.options.arc_length ? grown * went : std::min(grown * point.length, whole);
  point.factor = s.factor >= 1 - 1e-12 ? 1 : s.factor;
  point.negative = s.negative;
  point.remaining = s.remaining;
  ++point.steps;
  out.step.projection_seconds = since(start);
  return out;
}

// Energies and forces of the new state; `work.other` is the one before.
void EquilibriumPath::Impl::finish(DynamicState& state, double dt, const PathPoint& point, StepWork& work,
                                   StepReport& report) {
  DynamicState& next = work.other;
  next.t = state.t + dt;
  next.x = x;
  next.v = Vector::Zero(x.size());
  next.constraint = state.constraint;
  next.constraint.place = mu;
  report.dt = dt;
  report.at_end = true;
  report.elastic = initialise(system, next, factor);
  report.load_work = 0.5 * (point.factor + factor) * system.loads.force.dot(next.q - state.q);
  if (system.projection) {
    ProjectionMemory memory = no_impulses(rows);
    memory.place_multipliers = dt * dt * mu;
    system.projection->restore(memory);
  }
  std::swap(state, next);
}

}  // namespace toile
