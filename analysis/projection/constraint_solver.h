// SPDX-License-Identifier: GPL-3.0-or-later
// What a time step asks of whatever meets its constraints: PrimalDual, Substeps, FastProjection or LagrangeNewton.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <vector>

#include "analysis/constraint/constraint_rows.h"
#include "geometry/fields.h"

namespace toile {

class Workers;

struct ProjectionReport {
  bool converged = false;  // <=> strain_violation <= tolerance and place_violation <= place_tolerance
  int iterations = 0;
  double strain_violation = 0;  // at the end: largest |C|, with slack in the band what C lies outside of it
  double place_violation = 0;   // m
  // Of rows with a law the largest |C - law(lambda)|, over the limit. By the Lagrange Newton the part of the correction
  // that is no constraint force: |M (x - candidate) + J^T lambda| over |M (x - candidate)|, weighted by M^-1.
  double residual = 0;
  bool damped = false;        // the Lagrange Newton found no solution: projected instead, which damps
  int worst_row = -1;         // strain row with the largest violation
  double tightened = 0;       // J, energy of the limits by rows that grew stiffer in the step
  double within = 1;          // part of the strain rows, by area, that meets its limit: where a percentile is held
  double energy = 0;          // J, of the limit laws at the end
  int contacts = 0;           // at work at the end
  bool contact_met = true;    // they and the other constraints found a balance
  double contact_work = 0;    // J, of moving obstacles on the cloth
  double factor_seconds = 0;  // wall time of the numeric factorisations
  double solve_seconds = 0;   // and of the solutions by them
};
void fields(auto& archive, Like<ProjectionReport> auto& r) {
  archive(r.converged, r.iterations, r.strain_violation, r.place_violation, r.residual, r.worst_row, r.within, r.energy,
          r.tightened, r.contacts, r.contact_met, r.contact_work);
}

// Contacts at work at one time. Friction holds each to an anchor, a point of the obstacle.
struct ContactForces {
  std::vector<int> key;            // four numbers each, ascending (ContactRow::key)
  Eigen::Matrix3Xd force, anchor;  // N, that moves the candidate; m
};
void fields(auto& archive, Like<ContactForces> auto& f) {
  archive(f.key, f.force, f.anchor);
}

// Constraint forces at one time: where a solver goes on from. Empty where there were none.
struct ConstraintForces {
  Eigen::VectorXd strain;  // N m, per strain row
  Eigen::Matrix3Xd place;  // N, per place row
  // Per strain row: how many times as stiff as at the start it is, and for how long it has been beyond its limit [s].
  Eigen::VectorXd stiffening, beyond;
  ContactForces contact;
};
void fields(auto& archive, Like<ConstraintForces> auto& f) {
  archive(f.strain, f.place, f.stiffening, f.beyond, f.contact);
}

// What the last step left behind, for reactions.
struct ProjectionMemory {
  // Per row [kg m2 for strain rows, kg m for place rows]: divided by dt^2 they are the constraint forces' quadrature
  // weights [N m, N].
  Eigen::VectorXd strain_multipliers;
  Eigen::Matrix3Xd place_multipliers;
  // Multiplier times direction, summed over the iterations [kg m]: control point I was pushed by -d_I times its column.
  Eigen::Matrix3Xd strain_impulses;
  // Of contacts [kg m]: on the body's points (3 n, empty without obstacles) and, per obstacle, on the cloth.
  Eigen::VectorXd contact = {};
  Eigen::Matrix3Xd by_obstacle = {};
};
void fields(auto& archive, Like<ProjectionMemory> auto& m) {
  archive(m.strain_multipliers, m.place_multipliers, m.strain_impulses, m.contact, m.by_obstacle);
}
inline ProjectionMemory no_impulses(const ConstraintRows& rows) {
  const auto strains = static_cast<Eigen::Index>(rows.strain.size()),
             places = static_cast<Eigen::Index>(rows.place.size());
  return {Eigen::VectorXd::Zero(strains), Eigen::Matrix3Xd::Zero(3, places), Eigen::Matrix3Xd::Zero(3, strains)};
}

//   (1) fixed control points don't move;
//   (2) linear momentum is kept where nothing is pinned;
//   (3) pattern analysed once, in the constructor;
//   (4) a strain row that touches only fixed control points takes no part and counts in no violation.
class ConstraintSolver {
 public:
  virtual ~ConstraintSolver() = default;

  // Corrects x (free nodes) at time t onto the constraints, all rows hard.
  virtual ProjectionReport project(Eigen::Ref<Eigen::VectorXd> x, double t) = 0;
  // The same for the candidate of a step from the places `start` at t - dt: x and v are where the cloth would be
  // without constraints under the acceleration a of the start, x0 + dt v0 + dt^2/2 a and v0 + dt a. `forces` at its
  // start become those at t, unless the solver needs none.
  virtual ProjectionReport step(Eigen::Ref<Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> v, double t,
                                const Eigen::Ref<const Eigen::VectorXd>& start, double dt,
                                ConstraintForces& forces) = 0;
  // The last step once more, for another x and v, from its own result: `forces` are those of its start again.
  virtual ProjectionReport again(Eigen::Ref<Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> v, double t,
                                 const Eigen::Ref<const Eigen::VectorXd>& start, double dt, ConstraintForces& forces) {
    return step(x, v, t, start, dt, forces);
  }
  // Whether x follows a change of the candidate by a part of it, so that contact may find its balance by asking again;
  // else contact comes once a step, after the others.
  virtual bool follows() const { return true; }
  // Whether v then has all of the constraints' impulse, so that cloth at rest has v = 0; else it has what moves the
  // candidate, over dt: half of it.
  virtual bool end_velocity() const { return false; }
  // Once v is whole, with the cloth's own forces at t too: takes out of it what the next step can't resolve. The work
  // that moving obstacles do by it [J].
  virtual double settle(Eigen::Ref<Eigen::VectorXd>, double) { return 0; }
  // Largest part of the cloth's own stable step that a step should take.
  virtual double step_share() const { return 1; }
  // How far x is from the constraints, nothing moved.
  virtual ProjectionReport measure(const Eigen::Ref<const Eigen::VectorXd>& x, double t) = 0;
  // Energy [J] that the constraints store at x; 0 where they are hard.
  virtual double energy(const Eigen::Ref<const Eigen::VectorXd>&, double) { return 0; }

  virtual const ProjectionMemory& memory() const = 0;
  // Puts it back where a run is taken up again; false where its sizes are of other rows.
  bool restore(const ProjectionMemory& memory);

  // Steps by these threads from now on: the same bits. Null: the caller's alone.
  virtual void use_threads(Workers* workers) = 0;

  virtual const ConstraintRows& rows() const = 0;
  virtual std::size_t factor_nonzeros() const = 0;
  virtual std::size_t gram_nonzeros() const { return 0; }  // of the whole J M^-1 J^T; 0 where it isn't formed

 private:
  virtual void set_memory(const ProjectionMemory& memory) = 0;
};

inline bool ConstraintSolver::restore(const ProjectionMemory& from) {
  const ProjectionMemory& to = memory();
  if (from.strain_multipliers.size() != to.strain_multipliers.size() ||
      from.strain_impulses.cols() != to.strain_impulses.cols() ||
      from.place_multipliers.cols() != to.place_multipliers.cols() || from.contact.size() != to.contact.size() ||
      from.by_obstacle.cols() != to.by_obstacle.cols())
    return false;
  set_memory(from);
  return true;
}

}  // namespace toile
