// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/projection/primal_dual.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "analysis/constraint/composed_rows.h"
#include "analysis/parallel/workers.h"
#include "analysis/projection/fast_projection.h"
#include "analysis/projection/force_norm.h"
#include "analysis/projection/row_matrix.h"
#include "geometry/clock.h"
#include "geometry/error.h"

namespace toile {
namespace {

constexpr double place_softness = 1e-8;  // of the diagonal of J M^-1 J^T
constexpr double longest_turn = 0.1;     // of a thread's direction, in an iteration
constexpr double least_strain = 0.01;    // of the limit: at least that is what missed strains are compared with
constexpr int patience = 16;             // iterations before the energy is searched along the direction
constexpr double armijo = 1e-4;
// Over what is allowed: a strain beyond its limit, at least; what a guess must meet to be left as it is; near enough
// for the factor of the iteration before, as long as each leaves no more than the part `gain`.
constexpr double unmet = 2, negligible = 1e-3, near = 20, gain = 0.5;
constexpr double place_rounding = 1e-14;  // of the places
// Conjugate gradients where rows stiffen nodes no more than so, no longer than a factor takes, and to this part of what
// may be left of the forces.
constexpr double easy = 10, gradient_tolerance = 0.1;
constexpr int most_gradients = 30;
constexpr int sharpness = 3;           // (s / (1 + s))^3 of a motion is taken out, s = (omega dt / 2)^2
constexpr double pin_interval = 1e-5;  // s, for velocities of pins

}  // namespace

struct PrimalDual::Impl {
  AffineMap map;
  ConstraintRows rows;
  PrimalDualOptions options;
  ComposedRows composed;
  Eigen::VectorXd mass;           // per node
  Eigen::VectorXd gram_diagonal;  // of D M^-1 D^T, per scalar row; 0: takes no part
  RowMatrix matrix;
  Workers* workers = nullptr;
  SmoothEnergy* smooth = nullptr;  // of minimise()

  Eigen::Matrix3Xd y, targets, fixed_places, gap, change;  // change: D dx
  Eigen::VectorXd strain, missed, slope;                   // per strain row: C, C - law(lambda), 1 / (dC / dlambda)
  Eigen::VectorXd guess, force, rhs, solution, trial;      // guess: where inertia alone would lead
  Eigen::VectorXd held, part, answer;
  Eigen::VectorXd friction, strain_before;  // per strain row: N m per strain, and the strain at the start
  Eigen::Matrix3Xd pins_later, pin_velocity, row_velocity;
  Eigen::VectorXd place_compliance;  // m/N
  Eigen::VectorXd lambda;            // N m
  Eigen::Matrix3Xd mu;               // N
  Eigen::Matrix3Xd row_force;        // per scalar row: lambda y, mu
  // |M^-1/2 force|: at work at the start of the step, of rounded places, what may be left of a step.
  double reference = 0, rounding = 0, allowed = 0;
  double tau = 0;
  bool has_matrix = false, factored = false;   // of this step; whether by a factor
  ProjectionMemory memory, half_memory;        // of the whole step; of the forces at its start
  std::unique_ptr<FastProjection> projection;  // made where a start breaks the limits

  Impl(const AffineMap& m, const Eigen::VectorXd& node_mass, ConstraintRows r, const PrimalDualOptions& o,
       const BlockPattern* added)
      : map(m),
        rows(std::move(r)),
        options(o),
        composed(compose(map, rows)),
        mass(node_mass),
        gram_diagonal(toile::gram_diagonal(map, rows, composed, mass)),
        matrix(composed.free, mass, added),
        y(3, size()),
        targets(3, places()),
        gap(3, places()),
        change(3, size()),
        strain(strains()),
        missed(strains()),
        slope(strains()),
        friction(Eigen::VectorXd::Zero(strains())),
        strain_before(Eigen::VectorXd::Zero(strains())),
        row_velocity(3, size()),
        place_compliance(places()),
        lambda(Eigen::VectorXd::Zero(strains())),
        mu(Eigen::Matrix3Xd::Zero(3, places())),
        row_force(3, size()),
        memory(no_impulses(rows)) {
    for (const StrainRow& row : rows.strain)
      if (!(row.stiffness > 0)) throw SolverError("strain limit: a row has no stiffness");
    for (Eigen::VectorXd* v : {&guess, &force, &rhs, &solution, &trial, &held, &part, &answer})
      v->resize(3 * map.nodes());
  }

  int strains() const { return static_cast<int>(rows.strain.size()); }
  int places() const { return static_cast<int>(rows.place.size()); }
  int size() const { return composed.free.size(); }
  bool takes_part(int r) const { return gram_diagonal[r] > 0; }
  LimitLaw law(int r) const {
    return {rows.strain[r].warp ? options.warp : options.weft, 1 / rows.strain[r].stiffness};
  }
  double narrow(int r) const {
    const StrainBand& b = rows.strain[r].warp ? options.warp : options.weft;
    return std::min(b.stretch, b.compress);
  }

  void soften_places(const Eigen::Ref<const Eigen::VectorXd>& x);

  void at(double t) {
    map.fixed_places(t, fixed_places);
    for (int p = 0; p < places(); ++p) targets.col(p) = rows.place[p].target(t);
  }
  template <class Body>
  void each_row(const Body& body) {
    share_out(workers, strains(), [&](int begin, int end) {
      for (int r = begin; r < end; ++r) body(r);
    });
  }
  // What a row pulls with at the present strain, N m.
  double pull(int r) const { return lambda[r] + friction[r] * (strain[r] - strain_before[r]); }
  void measure(const Eigen::Ref<const Eigen::VectorXd>& x, ProjectionReport& report);
  void add_forces_of_rows(Eigen::VectorXd& f);
  double excess(const Eigen::Ref<const Eigen::VectorXd>& x, ProjectionReport& report);
  void set_slopes();
  void set_matrix();
  bool factorise(const Eigen::Ref<const Eigen::VectorXd>& x);
  bool solve(const Eigen::Ref<const Eigen::VectorXd>& x, bool anew, ProjectionReport& report);
  bool iterate(Eigen::Ref<Eigen::VectorXd> x, ProjectionReport& report, bool goes_on = false);
  bool search(Eigen::Ref<Eigen::VectorXd> x, ProjectionReport& report);
  // Notes down what the rows' forces at the present y add to the impulses.
  void act(double weight) {
    each_row([&](int r) { memory.strain_impulses.col(r) += weight * pull(r) * y.col(r); });
    memory.place_multipliers += weight * mu;
  }
  void take(ConstraintForces& forces);  // measured at their place: what is missing follows from the strains
  void move_pins(double t);
  double merit(const Eigen::Ref<const Eigen::VectorXd>& x);
  double limit_energy();
  const Eigen::VectorXd& end(const Eigen::Ref<const Eigen::VectorXd>& x, Eigen::Ref<Eigen::VectorXd> v, double t,
                             const Eigen::Ref<const Eigen::VectorXd>& start, double dt, bool goes_on,
                             ConstraintForces& forces, ProjectionReport& report);
};

// y, C and how far from the limits and pins they are.
void PrimalDual::Impl::measure(const Eigen::Ref<const Eigen::VectorXd>& x, ProjectionReport& report) {
  share_out(workers, strains() + places(),
            [&](int begin, int end) { evaluate(composed, x, fixed_places, begin, end, y); });
  report.strain_violation = report.place_violation = 0;
  report.worst_row = -1;
  for (int r = 0; r < strains(); ++r) {
    strain[r] = takes_part(r) ? 0.5 * (y.col(r).squaredNorm() - 1) : 0;
    const StrainBand& b = rows.strain[r].warp ? options.warp : options.weft;
    const double violation =
        b.slack > 0 ? std::max({strain[r] - b.stretch, -b.compress - strain[r], 0.0}) : std::abs(strain[r]);
    if (!takes_part(r) || violation <= report.strain_violation || std::isnan(report.strain_violation)) continue;
    report.strain_violation = violation;  // NaN counts as worst
    report.worst_row = r;
  }
  gap = y.rightCols(places()) - targets;
  for (int p = 0; p < places(); ++p) {
    gap.col(p) = gap.col(p).cwiseProduct(rows.place[p].axes);
    if (!(gap.col(p).norm() <= report.place_violation) && !std::isnan(report.place_violation))
      report.place_violation = gap.col(p).norm();
  }
  report.converged = report.strain_violation <= options.tolerance && report.place_violation <= options.place_tolerance;
}

// f += J^T of what rows pull with and pins push, at the present y.
void PrimalDual::Impl::add_forces_of_rows(Eigen::VectorXd& f) {
  each_row([&](int r) { row_force.col(r) = (takes_part(r) ? pull(r) : 0.0) * y.col(r); });
  row_force.rightCols(places()) = mu;
  matrix.spread(row_force, f);
}

// What is left of a step's equations over what is allowed; sets force and missed.
double PrimalDual::Impl::excess(const Eigen::Ref<const Eigen::VectorXd>& x, ProjectionReport& report) {
  measure(x, report);
  each_row([&](int r) {
    missed[r] = 0;
    if (!takes_part(r)) return;
    const LimitLaw l = law(r);
    if (lambda[r] == 0 && l.slack_at(strain[r])) return;
    missed[r] = strain[r] - l.strain(lambda[r] != 0 ? lambda[r] : std::copysign(0.0, strain[r]));
  });
  const double per = 1 / (tau * tau);
  for (int k = 0; k < mass.size(); ++k) force.segment<3>(3 * k) = per * mass[k] * (x - guess).segment<3>(3 * k);
  const double inertia = force_norm(force, mass);
  add_forces_of_rows(force);
  if (smooth) smooth->add_gradient(x, force);
  allowed = std::max(options.force_residual * std::max(reference, inertia), rounding);
  double of_law = 0, largest = 0, near_wall = 0;  // over the limit; over what is left to it
  for (int r = 0; r < strains(); ++r) {
    of_law = std::max(of_law, std::abs(missed[r]) / narrow(r));
    if (missed[r] != 0) near_wall = std::max(near_wall, std::abs(missed[r]) * law(r).steepness(lambda[r]));
    largest = std::max(largest, std::abs(strain[r]) / narrow(r));
  }
  report.residual = of_law;
  const double of_force = std::max(force_norm(force, mass) - rounding, 0.0) / allowed;
  const double of_largest = of_law / std::clamp(largest, least_strain, 1.0);
  const double left = std::max({of_force, of_largest / options.law_residual, near_wall / options.wall_residual,
                                report.place_violation / options.place_tolerance});
  return report.converged ? left : std::max(left, unmet);
}

// A small part of what a row would give by inertia and the nodes' own stiffness.
void PrimalDual::Impl::soften_places(const Eigen::Ref<const Eigen::VectorXd>& x) {
  for (int p = 0; p < places(); ++p) place_compliance[p] = place_softness * gram_diagonal[strains() + p] * tau * tau;
  if (!smooth || places() == 0) return;
  const BlockMatrix& hessian = smooth->hessian(x, true);
  for (int p = 0; p < places(); ++p)
    place_compliance[p] =
        place_softness * own_compliance(composed.free, strains() + p, 1 / (tau * tau) * mass, hessian);
}

// By `slope`, friction and the tensions.
void PrimalDual::Impl::set_matrix() {
  matrix.scale = 1 / (tau * tau);
  each_row([&](int r) {
    const double stiff = slope[r] + friction[r];
    matrix.blocks[r] =
        stiff == 0 ? SymmetricBlock() : SymmetricBlock::along(stiff, y.col(r).data(), std::max(pull(r), 0.0));
  });
  for (int p = 0; p < places(); ++p) {
    const Eigen::Vector3d stiff = rows.place[p].axes / place_compliance[p];
    matrix.blocks[strains() + p] = {stiff.x(), stiff.y(), stiff.z()};
  }
  has_matrix = true;
}

bool PrimalDual::Impl::factorise(const Eigen::Ref<const Eigen::VectorXd>& x) {
  if (!smooth) return matrix.factorise();
  return matrix.factorise(&smooth->hessian(x, false)) || matrix.factorise(&smooth->hessian(x, true));
}

// The direction of Newton's method in `solution`, its D dx in `change`: right side by `force`, `missed` and `gap`.
// `anew`: not by the factor of the iteration before. False where the matrix is not positive.
bool PrimalDual::Impl::solve(const Eigen::Ref<const Eigen::VectorXd>& x, bool anew, ProjectionReport& report) {
  each_row([&](int r) { row_force.col(r) = -slope[r] * missed[r] * y.col(r); });
  for (int p = 0; p < places(); ++p) row_force.col(strains() + p) = -gap.col(p) / place_compliance[p];
  rhs = -force;
  matrix.spread(row_force, rhs);
  const Clock::time_point start = Clock::now();
  if (anew) {
    set_matrix();
    solution.setZero();
    factored = smooth || places() > 0 || matrix.stiffening() > easy ||
               !matrix.conjugate_gradients(rhs, solution, gradient_tolerance * options.force_residual, most_gradients);
    if (factored && !factorise(x)) return false;
    (factored ? report.factor_seconds : report.solve_seconds) += since(start);
  }
  if (factored) {
    const Clock::time_point solving = Clock::now();
    matrix.solve(rhs, solution);
    report.solve_seconds += since(solving);
  }
  matrix.gather(solution, change);
  return true;
}

void PrimalDual::Impl::set_slopes() {
  each_row([&](int r) {
    const LimitLaw l = law(r);
    const bool at_work = takes_part(r) && !(lambda[r] == 0 && l.slack_at(strain[r]));
    slope[r] = at_work ? 1 / l.slope(lambda[r]) : 0;
  });
}

// Newton's method on places and multipliers. `goes_on`: from an answer, by the factor at hand.
bool PrimalDual::Impl::iterate(Eigen::Ref<Eigen::VectorXd> x, ProjectionReport& report, bool goes_on) {
  bool old = false;
  double last = 0;
  for (int k = 0;; ++k) {
    const double left = excess(x, report);
    if (left <= (k == 0 ? negligible : 1)) return true;
    if (k >= std::min(patience, options.max_iterations) || !std::isfinite(left)) return false;
    set_slopes();
    // Near the answer the factor at hand leads on, as long as it gains.
    const bool anew = !factored || (goes_on && k == 0 ? false : k == 0 || left > near || (old && left > gain * last));
    old = !anew;
    last = left;
    if (!solve(x, anew, report)) return false;
    // What is left of stiff cloth under small loads may be rounding of its own forces: then no step is left either.
    if (smooth && k > 0 && report.converged &&
        solution.lpNorm<Eigen::Infinity>() <= 10 * place_rounding * x.lpNorm<Eigen::Infinity>())
      return true;
    ++report.iterations;
    const double turn = strains() > 0 ? std::sqrt(change.leftCols(strains()).colwise().squaredNorm().maxCoeff()) : 0;
    const double share = std::min(1.0, longest_turn / turn);
    x += share * solution;
    each_row([&](int r) {
      if (slope[r] == 0) return;
      // From near the wall the law's tangent would lead far to the other side: there the force follows the strain.
      const double after = lambda[r] + share * slope[r] * (y.col(r).dot(change.col(r)) + missed[r]);
      lambda[r] =
          after * lambda[r] >= 0 ? after : law(r).force(0.5 * ((y.col(r) + share * change.col(r)).squaredNorm() - 1));
    });
    for (int p = 0; p < places(); ++p)
      mu.col(p) +=
          share / place_compliance[p] * (gap.col(p) + change.col(strains() + p).cwiseProduct(rows.place[p].axes));
  }
}

// What a step makes least: inertia, limits, and pins by their forces and the softness.
double PrimalDual::Impl::merit(const Eigen::Ref<const Eigen::VectorXd>& x) {
  ProjectionReport unused;
  measure(x, unused);
  double sum = 0;
  for (int k = 0; k < mass.size(); ++k)
    sum += 0.5 * mass[k] / (tau * tau) * (x - guess).segment<3>(3 * k).squaredNorm();
  for (int p = 0; p < places(); ++p)
    sum += mu.col(p).dot(gap.col(p)) + 0.5 / place_compliance[p] * gap.col(p).squaredNorm();
  for (int r = 0; r < strains(); ++r) sum += 0.5 * friction[r] * std::pow(strain[r] - strain_before[r], 2);
  if (smooth) sum += smooth->value(x);
  return sum + limit_energy();
}

// Newton's method on the places alone, each step searched: for where the other goes astray.
bool PrimalDual::Impl::search(Eigen::Ref<Eigen::VectorXd> x, ProjectionReport& report) {
  const auto by_strain = [&] {
    each_row([&](int r) { lambda[r] = takes_part(r) ? law(r).multiplier(strain[r]) : 0; });
  };
  double now = merit(x);
  for (int k = 0; k < options.max_iterations; ++k) {
    by_strain();
    excess(x, report);
    // By the law as it goes on beyond the wall.
    const double left = force_norm(force, mass) / allowed;
    if (left <= 1 && report.place_violation <= options.place_tolerance) {
      each_row([&](int r) { lambda[r] = takes_part(r) ? law(r).force(strain[r]) : 0; });
      return true;
    }
    if (!std::isfinite(left)) return false;
    each_row([&](int r) {
      slope[r] = takes_part(r) ? law(r).stiffness(strain[r]) : 0;
      missed[r] = 0;
    });
    if (!solve(x, true, report)) return false;
    ++report.iterations;
    const double down = -rhs.dot(solution);
    double share = 1, there = 0;
    for (int halvings = 0;; ++halvings, share /= 2) {
      trial = x + share * solution;
      there = merit(trial);
      if (there <= now + armijo * share * down) break;
      if (halvings == 30) return false;
    }
    x = trial;
    for (int p = 0; p < places(); ++p) mu.col(p) += gap.col(p) / place_compliance[p];
    now = places() > 0 ? merit(x) : there;
  }
  return false;
}

ProjectionReport PrimalDual::step(Eigen::Ref<Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> v, double t,
                                  const Eigen::Ref<const Eigen::VectorXd>& start, double dt, ConstraintForces& forces) {
  Impl& s = *impl_;
  ProjectionReport report;
  s.has_matrix = false;
  if (s.mass.size() == 0) {
    s.at(t);
    s.measure(x, report);
    return report;
  }
  s.tau = dt / 2;
  const double tau2 = s.tau * s.tau;
  s.soften_places(start);
  s.at(t - dt);
  s.measure(start, report);
  s.take(forces);
  s.act(0.5 * dt * dt);
  s.held.setZero();
  s.add_forces_of_rows(s.held);  // J0^T lambda0
  // By how much rows ring at this step; what they don't resolve acts at its end alone.
  s.strain_before = s.strain;
  s.set_slopes();
  s.each_row([&](int r) {
    const double ringing = tau2 * s.slope[r] * s.gram_diagonal[r];
    s.friction[r] = s.slope[r] * std::pow(ringing / (1 + ringing), sharpness);
  });

  double own = 0, size = 0;
  for (int k = 0; k < s.mass.size(); ++k) {
    own += s.mass[k] * (x - start - dt * v).segment<3>(3 * k).squaredNorm();  // -dt^2/2 of the acceleration
    size += s.mass[k] * start.segment<3>(3 * k).squaredNorm();
  }
  s.reference = std::max(2 / (dt * dt) * std::sqrt(own), force_norm(s.held, s.mass));
  s.rounding = place_rounding * std::sqrt(size) / tau2;
  for (int k = 0; k < s.mass.size(); ++k) s.held.segment<3>(3 * k) *= tau2 / s.mass[k];
  s.half_memory = s.memory;
  x = s.end(x, v, t, start, dt, false, forces, report);
  return report;
}

ProjectionReport PrimalDual::again(Eigen::Ref<Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> v, double t,
                                   const Eigen::Ref<const Eigen::VectorXd>& start, double dt,
                                   ConstraintForces& forces) {
  Impl& s = *impl_;
  if (!s.has_matrix || s.mass.size() == 0) return step(x, v, t, start, dt, forces);
  ProjectionReport report;
  s.memory = s.half_memory;
  x = s.end(x, v, t, start, dt, true, forces, report);
  return report;
}

// The end of a step from the candidate x, v; `goes_on`: by Newton's method from the last answer. (The header's
// equation; `held` is its first sum.)
const Eigen::VectorXd& PrimalDual::Impl::end(const Eigen::Ref<const Eigen::VectorXd>& x, Eigen::Ref<Eigen::VectorXd> v,
                                             double t, const Eigen::Ref<const Eigen::VectorXd>& start, double dt,
                                             bool goes_on, ConstraintForces& forces, ProjectionReport& report) {
  v -= 2 / dt * x;
  guess = x - held;
  // x0 + dt v0: a better start for Newton's method than forces that rows don't resolve.
  if (!goes_on) answer = -start - dt * v;
  at(t);
  bool solved = iterate(answer, report, goes_on);
  if (!solved) {
    answer = start;
    solved = search(answer, report) && iterate(answer, report);
  }
  v += 2 / dt * answer;
  act(0.5 * dt * dt);
  memory.strain_multipliers = dt * dt * lambda;
  forces.strain = lambda;
  forces.place = mu;
  report.energy = limit_energy();
  report.converged = report.converged && solved;
  return answer;
}

void PrimalDual::Impl::take(ConstraintForces& forces) {
  if (forces.strain.size() != strains()) {
    forces.strain.setZero(strains());
    for (int r = 0; r < strains(); ++r)
      if (takes_part(r)) forces.strain[r] = law(r).multiplier(strain[r]);
  }
  if (forces.place.cols() != places()) forces.place.setZero(3, places());
  lambda = forces.strain;
  mu = forces.place;
  friction.setZero();
  memory.strain_impulses.setZero();
  memory.place_multipliers.setZero();
}

void PrimalDual::add_forces(const Eigen::VectorXd& x, double t, ConstraintForces& forces, Eigen::VectorXd& f) {
  ProjectionReport unused;
  impl_->at(t);
  impl_->measure(x, unused);
  impl_->take(forces);
  impl_->act(1);
  impl_->add_forces_of_rows(f);
}

ProjectionReport PrimalDual::minimise(Eigen::VectorXd& x, const Eigen::VectorXd& guess, double tau, double t,
                                      SmoothEnergy& smooth, double reference, ConstraintForces& forces) {
  Impl& s = *impl_;
  ProjectionReport report;
  s.smooth = &smooth;
  s.has_matrix = false;
  s.tau = tau;
  s.guess = guess;
  s.reference = reference;
  s.rounding = 0;
  for (int k = 0; k < s.mass.size(); ++k) s.rounding += s.mass[k] * x.segment<3>(3 * k).squaredNorm();
  s.rounding = place_rounding * std::sqrt(s.rounding) / (tau * tau);
  s.at(t);
  s.measure(x, report);
  s.take(forces);
  s.soften_places(x);
  const Eigen::VectorXd was = x;
  bool solved = s.iterate(x, report);
  if (!solved) {
    x = was;
    solved = s.search(x, report) && s.iterate(x, report);
  }
  forces.strain = s.lambda;
  forces.place = s.mu;
  s.memory.strain_impulses.setZero();
  s.memory.place_multipliers.setZero();
  s.act(1);  // forces; the caller makes impulses of them
  s.memory.strain_multipliers = s.lambda;
  report.energy = s.limit_energy();
  report.converged = report.converged && solved;
  s.smooth = nullptr;
  return report;
}

double PrimalDual::settle(Eigen::Ref<Eigen::VectorXd> v, double t) {
  Impl& s = *impl_;
  if (s.mass.size() == 0 || s.size() == 0) return 0;
  if (!s.has_matrix) {
    s.set_slopes();
    s.set_matrix();
    s.factored = s.places() > 0 || s.matrix.stiffening() > easy;
    if (s.factored && !s.matrix.factorise()) return 0;
  }
  s.move_pins(t);
  s.part = v;
  for (int k = 0; k < sharpness; ++k) {
    // What rows and pins at work leave of it is resolved; the rest goes on.
    s.each_row([&](int r) { s.row_force.col(r) = -(s.matrix.blocks[r] * s.row_velocity.col(r)); });
    for (int p = 0; p < s.places(); ++p)
      s.row_force.col(s.strains() + p) = s.row_velocity.col(s.strains() + p) / s.place_compliance[p];
    for (int n = 0; n < s.mass.size(); ++n)
      s.rhs.segment<3>(3 * n) = s.matrix.scale * s.mass[n] * s.part.segment<3>(3 * n);
    s.matrix.spread(s.row_force, s.rhs);
    s.solution = s.part;
    if (s.factored)
      s.matrix.solve(s.rhs, s.solution);
    else
      s.matrix.conjugate_gradients(s.rhs, s.solution, gradient_tolerance * s.options.force_residual, most_gradients);
    s.part -= s.solution;
    s.row_velocity.setZero();
  }
  v -= s.part;
  return 0;
}

// Velocities of what is prescribed: of strain rows what moved control points add to D v, of place rows their targets'
// less that.
void PrimalDual::Impl::move_pins(double t) {
  map.fixed_places(t + pin_interval, pins_later);
  map.fixed_places(t - pin_interval, pin_velocity);
  pin_velocity = (pins_later - pin_velocity) / (2 * pin_interval);
  solution.setZero();
  evaluate(composed, solution, pin_velocity, row_velocity);
  for (int p = 0; p < places(); ++p) {
    row_velocity.col(strains() + p) =
        (rows.place[p].target(t + pin_interval) - rows.place[p].target(t - pin_interval)) / (2 * pin_interval) -
        row_velocity.col(strains() + p);
    row_velocity.col(strains() + p) = row_velocity.col(strains() + p).cwiseProduct(rows.place[p].axes);
  }
}

double PrimalDual::Impl::limit_energy() {
  double sum = 0;
  for (int r = 0; r < strains(); ++r)
    if (takes_part(r)) sum += law(r).energy(strain[r]);
  return sum;
}

PrimalDual::PrimalDual(const AffineMap& map, const Eigen::VectorXd& node_mass, ConstraintRows rows,
                       const PrimalDualOptions& options, const BlockPattern* added)
    : impl_(std::make_unique<Impl>(map, node_mass, std::move(rows), options, added)) {}
PrimalDual::~PrimalDual() = default;

ProjectionReport PrimalDual::project(Eigen::Ref<Eigen::VectorXd> x, double t) {
  Impl& s = *impl_;
  require_whole_places(
      s.rows,
      "steps keep such a pin, but cloth that starts beyond its strain limit, or away from a pin, can't "
      "be moved there; let it start within the limit and with each pin where it holds, or hold xyz");
  if (!s.projection) {
    s.projection = std::make_unique<FastProjection>(
        s.map, s.mass, s.rows,
        ProjectionOptions{.tolerance = s.options.tolerance, .place_tolerance = s.options.place_tolerance});
    s.projection->use_threads(s.workers);
  }
  const ProjectionReport report = s.projection->project(x, t);
  s.memory = s.projection->memory();
  return report;
}

ProjectionReport PrimalDual::measure(const Eigen::Ref<const Eigen::VectorXd>& x, double t) {
  ProjectionReport report;
  impl_->at(t);
  impl_->measure(x, report);
  return report;
}

double PrimalDual::energy(const Eigen::Ref<const Eigen::VectorXd>& x, double t) {
  ProjectionReport report;
  impl_->at(t);
  impl_->measure(x, report);
  return impl_->limit_energy();
}
const ProjectionMemory& PrimalDual::memory() const {
  return impl_->memory;
}
void PrimalDual::set_memory(const ProjectionMemory& memory) {
  impl_->memory = memory;
}
void PrimalDual::use_threads(Workers* workers) {
  impl_->matrix.use_threads(workers);
  if (impl_->projection) impl_->projection->use_threads(workers);
  impl_->workers = workers;
}
const ConstraintRows& PrimalDual::rows() const {
  return impl_->rows;
}
std::size_t PrimalDual::factor_nonzeros() const {
  return impl_->matrix.factor_nonzeros();
}

}  // namespace toile
