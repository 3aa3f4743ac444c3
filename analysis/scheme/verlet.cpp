// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/scheme/verlet.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "analysis/parallel/workers.h"
#include "geometry/clock.h"

namespace toile {
namespace {

using Vector = Eigen::VectorXd;

// f_int + f_ext on the body's points.
Elastic total_force(const MechanicalSystem& system, double load_factor, const Vector& q, Vector& f) {
  f.resize(q.size());
  const Elastic elastic = internal_force(system.potentials, q, f, system.workers);
  f += load_factor * system.loads.force;
  return elastic;
}

// M a + C (v + h a + lag constraint - wind) = f, with h = 0 for an explicit start.
void acceleration(const MechanicalSystem& system, const Vector& q_force, const Vector& v, const Vector& constraint,
                  double lag, double h, Vector& a) {
  a.resize(3 * system.map->nodes());
  system.map->reduce(q_force, a, system.workers);
  share_out(system.workers, system.map->nodes(), [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const double m = system.node_mass[k], c = system.node_drag[k];
      const Eigen::Vector3d known = v.segment<3>(3 * k) + lag * constraint.segment<3>(3 * k);
      a.segment<3>(3 * k) = (a.segment<3>(3 * k) - c * (known - system.loads.wind)) / (m + h * c);
    }
  });
}

void add(const ScalarRow& row, const Eigen::Vector3d& force, Vector& f) {
  for (std::size_t k = 0; k < row.index.size(); ++k) f.segment<3>(3 * row.index[k]) += row.value[k] * force;
}

// Adds the constraints' forces to f (control points); `place`: those of the place rows.
void add_constraint_forces(const MechanicalSystem& system, double dt, Vector& f, Eigen::Matrix3Xd& place) {
  if (!system.projection) {
    place.resize(3, 0);
    return;
  }
  const ConstraintSolver& projection = *system.projection;
  const ConstraintRows& rows = projection.rows();
  const ProjectionMemory& last = projection.memory();
  const double per_step = 1 / (dt * dt);
  for (std::size_t r = 0; r < rows.strain.size(); ++r) {
    const ScalarRow& row = rows.strain[r].row;
    const Eigen::Vector3d impulse = last.strain_impulses.col(r);
    if (!impulse.isZero(0)) add(row, -per_step * impulse, f);
  }
  if (last.contact.size() > 0) f += per_step * last.contact;
  place.resize(3, static_cast<Eigen::Index>(rows.place.size()));
  for (std::size_t p = 0; p < rows.place.size(); ++p) {
    const ScalarRow& row = rows.place[p].row;
    place.col(p) = -per_step * last.place_multipliers.col(p);
    add(row, place.col(p), f);
  }
}

}  // namespace

double motion_work(const MechanicalSystem& system, const DynamicState& from, const DynamicState& to, StepWork& work) {
  const AffineMap& map = *system.map;
  const auto moved = [&](int i) -> Eigen::Vector3d { return to.q.segment<3>(3 * i) - from.q.segment<3>(3 * i); };
  const auto target_moved = [&](const PlaceRow& row) -> Eigen::Vector3d {
    return row.target(to.t) - row.target(from.t);
  };
  bool still = true;
  for (const int i : map.fixed()) still = still && moved(i).isZero(0);
  if (system.projection)
    for (const PlaceRow& row : system.projection->rows().place) still = still && target_moved(row).isZero(0);
  if (still) return 0;

  work.force = 0.5 * (from.f + to.f);
  add_constraint_forces(system, to.t - from.t, work.force, work.place_force);
  double sum = 0;
  for (Eigen::Index p = 0; p < work.place_force.cols(); ++p)
    sum += work.place_force.col(p).dot(target_moved(system.projection->rows().place[static_cast<std::size_t>(p)]));
  for (int i = 0; i < map.control_points(); ++i)
    for (AffineMap::Matrix::InnerIterator e(map.fixed_part(), i); e; ++e)
      sum -= e.value() * work.force.segment<3>(3 * i).dot(moved(map.fixed()[static_cast<std::size_t>(e.col())]));
  return sum;
}

Elastic initialise(const MechanicalSystem& system, DynamicState& state, double load_factor) {
  state.q.resize(3 * system.map->control_points());
  system.map->expand(state.x, system.map->fixed_places(state.t), state.q, system.workers);
  const Elastic elastic = total_force(system, load_factor, state.q, state.f);
  acceleration(system, state.f, state.v, Vector::Zero(state.v.size()), 0, 0, state.a);
  return elastic;
}

StepReport step(const MechanicalSystem& system, DynamicState& state, double dt) {
  StepWork work;
  return step(system, state, dt, work);
}

StepReport step(const MechanicalSystem& system, DynamicState& state, double dt, StepWork& work) {
  StepReport report;
  report.dt = dt;
  const int nodes = system.map->nodes();
  DynamicState& next = work.other;
  next.t = state.t + dt;
  for (Vector* v : {&work.candidate, &work.move, &work.constraint, &next.x, &next.v}) v->resize(state.x.size());
  const bool end_velocity = !system.projection || system.projection->end_velocity();
  share_pieces(system.workers, nodes, [&](int, int begin, int end) {
    const auto piece = [&](auto& v) { return v.segment(3 * begin, 3 * (end - begin)); };
    piece(work.candidate) = piece(state.x) + dt * piece(state.v) + (0.5 * dt * dt) * piece(state.a);
    piece(next.x) = piece(work.candidate);
    piece(next.v) = piece(state.v) + dt * piece(state.a);
  });
  report.projection.converged = true;
  report.at_end = system.projection && end_velocity;
  if (system.projection) {
    const Clock::time_point start = Clock::now();
    next.constraint = state.constraint;
    report.projection = system.projection->step(next.x, next.v, next.t, state.x, dt, next.constraint);
    report.limit_energy = report.projection.energy;
    report.projection_seconds = since(start);
  }
  // What the velocity is but for the acceleration of the end.
  share_pieces(system.workers, nodes, [&](int, int begin, int end) {
    const auto piece = [&](auto& v) { return v.segment(3 * begin, 3 * (end - begin)); };
    piece(work.move) = piece(next.x) - piece(state.x);
    piece(work.constraint) = (piece(next.x) - piece(work.candidate)) / (dt * dt);
    piece(next.v) -= (0.5 * dt) * piece(state.a);
  });

  next.q.resize(3 * system.map->control_points());
  system.map->fixed_places(next.t, work.fixed_places);
  system.map->expand(next.x, work.fixed_places, next.q, system.workers);
  const Clock::time_point start = Clock::now();
  report.elastic = total_force(system, 1, next.q, next.f);
  report.force_seconds = since(start);
  acceleration(system, next.f, next.v, work.constraint, end_velocity ? 0 : 0.5 * dt, 0.5 * dt, next.a);

  const int control_points = system.map->control_points();
  work.sums.assign(static_cast<std::size_t>(pieces(control_points)), {});
  share_pieces(system.workers, nodes, [&](int index, int begin, int end) {
    StepWork::Sums sums;
    for (int k = begin; k < end; ++k) {
      const auto move = work.move.segment<3>(3 * k), held = work.constraint.segment<3>(3 * k);
      const auto a = next.a.segment<3>(3 * k);
      auto v = next.v.segment<3>(3 * k);
      const Eigen::Vector3d v_half = move / dt;
      const double mass = system.node_mass[k];
      sums.kinetic += 0.5 * mass * v_half.squaredNorm();
      sums.drag_work -= system.node_drag[k] * (v_half - system.loads.wind).dot(move);
      sums.kick +=
          0.125 * dt * dt * mass * std::max((state.a.segment<3>(3 * k) + held).squaredNorm(), (a + held).squaredNorm());
      sums.kick_end += 0.125 * dt * dt * mass * a.squaredNorm();
      v += 0.5 * dt * a;
      sums.finite = sums.finite && next.x.segment<3>(3 * k).allFinite() && a.allFinite();
    }
    work.sums[static_cast<std::size_t>(index)] = sums;
  });
  share_pieces(system.workers, control_points, [&](int index, int begin, int end) {
    const auto piece = [&](auto& v) { return v.segment(3 * begin, 3 * (end - begin)); };
    work.sums[static_cast<std::size_t>(index)].load_work =
        piece(system.loads.force).dot(piece(next.q) - piece(state.q));
  });
  if (report.at_end) report.projection.contact_work += system.projection->settle(next.v, next.t);
  share_pieces(system.workers, end_velocity ? nodes : 0, [&](int index, int begin, int end) {
    for (int k = begin; k < end; ++k)
      work.sums[static_cast<std::size_t>(index)].kinetic_end +=
          0.5 * system.node_mass[k] * next.v.segment<3>(3 * k).squaredNorm();
  });
  for (const StepWork::Sums& sums : work.sums) {
    report.kinetic += sums.kinetic;
    report.kinetic_end += sums.kinetic_end;
    report.kick += sums.kick;
    report.kick_end += sums.kick_end;
    report.drag_work += sums.drag_work;
    report.load_work += sums.load_work;
    report.finite = report.finite && sums.finite;
  }
  report.finite = report.finite && std::isfinite(report.kinetic) && std::isfinite(report.elastic.total());
  if (!report.finite) return report;
  report.motion_work =
      motion_work(system, state, next, work) + report.projection.tightened + report.projection.contact_work;
  std::swap(state, next);
  return report;
}

Reactions reactions(const MechanicalSystem& system, const DynamicState& state, double dt) {
  const AffineMap& map = *system.map;
  Vector f = state.f;
  Reactions out;
  add_constraint_forces(system, dt, f, out.place);

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
      inertia += e.value() * system.body->lumped_mass()[i] * pin_acceleration.col(e.col());
    }
    const Eigen::Vector3d drag = -system.body->lumped_drag()[i] * (velocity - system.loads.wind);
    for (AffineMap::Matrix::InnerIterator e(map.fixed_part(), i); e; ++e)
      out.fixed.col(e.col()) += e.value() * (inertia - f.segment<3>(3 * i) - drag);
  }
  return out;
}

}  // namespace toile
