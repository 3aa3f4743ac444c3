// SPDX-License-Identifier: GPL-3.0-or-later
// Velocity Verlet with projection, one step at a time. [Peng & Zheng 2022, eqs. 18-19, 24-34; Bridson et al. 2003]
#pragma once

#include <Eigen/Core>
#include <vector>

#include "analysis/map/affine_map.h"
#include "analysis/model/model.h"
#include "analysis/projection/constraint_solver.h"
#include "geometry/fields.h"

namespace toile {

// Free nodes: places, velocities, accelerations at one time; forces of the constraints up to then; and what follows
// from the places, so that no step works it out twice: control points and the force on them, without the constraints'.
// Restartable bit by bit.
struct DynamicState {
  double t = 0;
  Eigen::VectorXd x, v, a;
  ConstraintForces constraint;
  Eigen::VectorXd q, f;  // [m], [N]; 3 n
};
void fields(auto& archive, Like<DynamicState> auto& s) {
  archive(s.t, s.x, s.v, s.a, s.constraint, s.q, s.f);
}

// Dead loads on control points [N], 3 n: gravity on the true mass, tractions and forces; wind [m/s] acts through drag.
struct Loads {
  Eigen::VectorXd force;
  Eigen::Vector3d wind = Eigen::Vector3d::Zero();
};

struct StepReport {
  double dt = 0;
  ProjectionReport projection;
  Elastic elastic;          // at the end
  double limit_energy = 0;  // J, of the strain limits at the end
  double kinetic = 0;       // J, in the middle of the step, where the velocity obeys the constraints
  double kinetic_end = 0;   // J, at the end, unless a solver's forces lack there (ConstraintSolver::end_velocity)
  double kick = 0;          // J, kinetic energy of half a step's acceleration: by so much `kinetic` depends on dt
  double kick_end = 0;      // J, by the cloth's own acceleration at the end
  bool at_end = false;      // a solver with end_velocity(): the law below holds at the end
  double load_work = 0;     // J, work of dead loads in the step
  double drag_work = 0;     // J, work of drag (negative: dissipated)
  double motion_work = 0;   // J, work of moved pins, of moving obstacles, and of what tightens rows
  bool finite = true;
  double force_seconds = 0, projection_seconds = 0;  // wall time
};
// In the middle of a step, kinetic + mean of (elastic + limit_energy) at both ends - works up to the step - half the
// works of the step never rises, up to the order of the scheme: what projection takes is lost, nothing is gained. At
// its end that is kinetic_end - kick_end + elastic + limit_energy - works: of linear forces Verlet keeps this exactly.
// Masses and drag are the nodes'.

// Everything a step needs that doesn't change from step to step. The caller keeps the parts alive.
struct MechanicalSystem {
  const Body* body = nullptr;
  std::vector<const Potential*> potentials;
  const AffineMap* map = nullptr;
  Eigen::VectorXd node_mass, node_drag;  // reduced lumped mass with floor [kg], drag [kg/s]
  Loads loads;
  ConstraintSolver* projection = nullptr;  // null: no limits and no place rows
  Workers* workers = nullptr;              // null: the caller's thread alone
};

// Accelerations, control points and forces from places and velocities, and what the cloth stores: for the start, after
// a change of the system, and for schemes that find places and velocities alone. `load_factor`: of the dead loads.
Elastic initialise(const MechanicalSystem& system, DynamicState& state, double load_factor = 1);

// Advances state by dt. The velocity between the steps is (x_n+1 - x_n) / dt after projection; drag is implicit.
//   x~ = x + dt v + dt^2/2 a, projected at t + dt;  v_half = (x_n+1 - x_n) / dt
//   M a + C (v_half + dt/2 (a + a_c) - wind) = T^T (f_int + f_ext) at n+1;  v = v_half + dt/2 a
// with the constraints' acceleration a_c of the step: drag sees the velocity that the constraints allow.
// A step that ends in non-finite numbers leaves `state` as it was and says so. With `work` from an earlier step of the
// same system nothing is allocated but by the projection.
struct StepWork {
  // Energies of a piece of the nodes or control points, so that no sum depends on the number of threads.
  struct Sums {
    double kinetic = 0, kinetic_end = 0, kick = 0, kick_end = 0, drag_work = 0, load_work = 0;
    bool finite = true;
  };
  DynamicState other;  // after a finite step: the state before it, which a swap brings back
  std::vector<Sums> sums;
  Eigen::VectorXd candidate, move, constraint, force;
  Eigen::Matrix3Xd fixed_places, place_force;
};
StepReport step(const MechanicalSystem& system, DynamicState& state, double dt, StepWork& work);
StepReport step(const MechanicalSystem& system, DynamicState& state, double dt);

// Work that moved pins do on the cloth between two states [J], trapezoidal: of fixed control points by the mean of what
// the cloth pulls with at both states, of place rows by the force of the step between them. (Obstacles':
// ProjectionReport::contact_work.)
double motion_work(const MechanicalSystem& system, const DynamicState& from, const DynamicState& to, StepWork& work);

// Force that each fixed control point and each place row exerts on the cloth [N] at the state's time, dt being the last
// step's. A constraint's force is -J^T lambda / dt^2. Exact at rest: the sum balances the dead loads.
struct Reactions {
  Eigen::Matrix3Xd fixed;  // AffineMap::fixed order
  Eigen::Matrix3Xd place;  // place rows
};
Reactions reactions(const MechanicalSystem& system, const DynamicState& state, double dt);

}  // namespace toile
