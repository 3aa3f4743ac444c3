#include "analysis/dynamics/verlet.h"

#include <chrono>
#include <cmath>

namespace toile {
namespace {

using Vector = Eigen::VectorXd;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// f_int + f_ext on control points.
Vector total_force(const DynamicSystem& system, const Vector& q, ShellEnergy* energy = nullptr) {
  Vector f(q.size());
  const ShellEnergy elastic = system.model->internal_force(q, f);
  if (energy) *energy = elastic;
  return f + system.loads.force;
}

// M a + C (v + h (a + constraint) - wind) = f, with h = 0 for an explicit start.
Vector acceleration(const DynamicSystem& system, const Vector& q_force, const Vector& v, const Vector& constraint,
                    double h) {
  Vector a(3 * system.map->nodes());
  system.map->reduce(q_force, a);
  for (int k = 0; k < system.map->nodes(); ++k) {
    const double m = system.node_mass[k], c = system.node_drag[k];
    const Eigen::Vector3d known = v.segment<3>(3 * k) + h * constraint.segment<3>(3 * k);
    a.segment<3>(3 * k) = (a.segment<3>(3 * k) - c * (known - system.loads.wind)) / (m + h * c);
  }
  return a;
}

void add(const ScalarRow& row, const Eigen::Vector3d& force, Vector& f) {
  for (std::size_t k = 0; k < row.index.size(); ++k) f.segment<3>(3 * row.index[k]) += row.value[k] * force;
}

// Adds the constraints' forces to f (control points) and returns those of the place rows.
Eigen::Matrix3Xd add_constraint_forces(const DynamicSystem& system, double dt, Vector& f) {
  if (!system.projection) return Eigen::Matrix3Xd(3, 0);
  const ConstraintSolver& projection = *system.projection;
  const ConstraintRows& rows = projection.rows();
  const double per_step = 1 / (dt * dt);
  for (std::size_t r = 0; r < rows.strain.size(); ++r) {
    const ScalarRow& row = rows.strain[r].row;
    const Eigen::Vector3d impulse = projection.strain_impulses().col(r);
    if (!impulse.isZero(0)) add(row, -per_step * impulse, f);
  }
  Eigen::Matrix3Xd place(3, rows.place.size());
  for (std::size_t p = 0; p < rows.place.size(); ++p) {
    const ScalarRow& row = rows.place[p].row;
    place.col(p) = -per_step * projection.place_multipliers().col(p);
    add(row, place.col(p), f);
  }
  return place;
}

// Work that moved pins do on the cloth between two states: their force against what the cloth pulls, trapezoidal.
double motion_work(const DynamicSystem& system, const Vector& q0, double t0, double t1, const Vector& f1) {
  const AffineMap& map = *system.map;
  const Eigen::Matrix3Xd moves = map.fixed_places(t1) - map.fixed_places(t0);
  std::vector<Eigen::Vector3d> target_moves;
  bool still = moves.cols() == 0 || moves.cwiseAbs().maxCoeff() == 0;
  if (system.projection)
    for (const PlaceRow& row : system.projection->rows().place) {
      target_moves.emplace_back(row.target(t1) - row.target(t0));
      still = still && target_moves.back().isZero(0);
    }
  if (still) return 0;

  Vector f = 0.5 * (total_force(system, q0) + f1);
  const Eigen::Matrix3Xd place = add_constraint_forces(system, t1 - t0, f);
  double work = 0;
  for (std::size_t p = 0; p < target_moves.size(); ++p) work += place.col(p).dot(target_moves[p]);
  for (int i = 0; i < map.control_points(); ++i)
    for (AffineMap::Matrix::InnerIterator e(map.fixed_part(), i); e; ++e)
      work -= e.value() * f.segment<3>(3 * i).dot(moves.col(e.col()));
  return work;
}

}  // namespace

void initialise(const DynamicSystem& system, DynamicState& state) {
  Vector q(3 * system.map->control_points());
  system.map->expand(state.x, state.t, q);
  state.a = acceleration(system, total_force(system, q), state.v, Vector::Zero(state.v.size()), 0);
}

StepReport step(const DynamicSystem& system, DynamicState& state, double dt) {
  StepReport report;
  report.dt = dt;
  DynamicState next;
  next.t = state.t + dt;
  const Vector candidate = state.x + dt * state.v + (0.5 * dt * dt) * state.a;
  next.x = candidate;
  report.projection.converged = true;
  if (system.projection) {
    const auto start = std::chrono::steady_clock::now();
    next.constraint = state.constraint;
    report.projection = system.projection->step(next.x, next.t, state.x, dt, next.constraint);
    report.limit_energy = report.projection.energy;
    report.projection_seconds = seconds_since(start);
  }
  const Vector move = next.x - state.x;
  const Vector v_half = move / dt, constraint = (next.x - candidate) / (dt * dt);

  Vector q0(3 * system.map->control_points()), q1(q0.size());
  system.map->expand(state.x, state.t, q0);
  system.map->expand(next.x, next.t, q1);
  const auto start = std::chrono::steady_clock::now();
  const Vector force = total_force(system, q1, &report.elastic);
  report.force_seconds = seconds_since(start);
  next.a = acceleration(system, force, v_half, constraint, 0.5 * dt);
  next.v = v_half + (0.5 * dt) * next.a;

  report.load_work = system.loads.force.dot(q1 - q0);
  for (int k = 0; k < system.map->nodes(); ++k) {
    report.kinetic += 0.5 * system.node_mass[k] * v_half.segment<3>(3 * k).squaredNorm();
    if (!system.projection) report.kinetic_end += 0.5 * system.node_mass[k] * next.v.segment<3>(3 * k).squaredNorm();
    const auto held = constraint.segment<3>(3 * k);
    report.kick +=
        0.125 * dt * dt * system.node_mass[k] *
        std::max((state.a.segment<3>(3 * k) + held).squaredNorm(), (next.a.segment<3>(3 * k) + held).squaredNorm());
    report.drag_work -=
        system.node_drag[k] * (v_half.segment<3>(3 * k) - system.loads.wind).dot(move.segment<3>(3 * k));
  }
  report.finite = std::isfinite(report.kinetic) && std::isfinite(report.elastic.total()) && next.x.allFinite() &&
                  next.a.allFinite();
  if (!report.finite) return report;
  report.motion_work = motion_work(system, q0, state.t, next.t, force);
  state = std::move(next);
  return report;
}

Reactions reactions(const DynamicSystem& system, const DynamicState& state, double dt) {
  const AffineMap& map = *system.map;
  const ShellModel& model = *system.model;
  Vector q(3 * map.control_points());
  map.expand(state.x, state.t, q);
  Vector f = total_force(system, q);
  Reactions out;
  out.place = add_constraint_forces(system, dt, f);

  // Velocity and acceleration of the pins themselves, from where they have been.
  const Eigen::Matrix3Xd now = map.fixed_places(state.t), before = map.fixed_places(state.t - dt),
                         earlier = map.fixed_places(state.t - 2 * dt);
  const Eigen::Matrix3Xd pin_velocity = (now - before) / dt;
  const Eigen::Matrix3Xd pin_acceleration = (now - 2 * before + earlier) / (dt * dt);
  out.fixed = Eigen::Matrix3Xd::Zero(3, map.fixed().size());
  for (int i = 0; i < map.control_points(); ++i) {
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero(), inertia = Eigen::Vector3d::Zero();
    for (AffineMap::Matrix::InnerIterator e(map.free_part(), i); e; ++e)
      velocity += e.value() * state.v.segment<3>(3 * e.col());
    for (AffineMap::Matrix::InnerIterator e(map.fixed_part(), i); e; ++e) {
      velocity += e.value() * pin_velocity.col(e.col());
      inertia += e.value() * model.lumped_mass()[i] * pin_acceleration.col(e.col());
    }
    const Eigen::Vector3d drag = -model.lumped_drag()[i] * (velocity - system.loads.wind);
    for (AffineMap::Matrix::InnerIterator e(map.fixed_part(), i); e; ++e)
      out.fixed.col(e.col()) += e.value() * (inertia - f.segment<3>(3 * i) - drag);
  }
  return out;
}

}  // namespace toile
