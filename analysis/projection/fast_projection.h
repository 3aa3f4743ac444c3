// Continuum fast projection: moves a candidate state onto the constraints with the least change of kinetic energy.
// [Peng & Zheng 2022, eqs. 29-36; Goldenthal et al. 2007]
#pragma once

#include <Eigen/Core>
#include <memory>

#include "analysis/affine_map.h"
#include "analysis/projection/constraint_rows.h"
#include "analysis/projection/limit_law.h"

namespace toile {

// Where the constraint forces of a step point.
enum class ProjectionVariant {
  // Along the constraint gradients at the start of the step, as in SHAKE: second order in time. [Ryckaert et al. 1977]
  second_order,
  // Along those of the candidate, renewed in each iteration: the paper's, of first order, damping. [eqs. 31-34]
  paper,
};

struct ProjectionOptions {
  ProjectionVariant variant = ProjectionVariant::second_order;
  StrainBand weft = {}, warp = {};  // limits of rows with a stiffness
  double tolerance = 0.01;          // largest violation of a strain row that counts as met, see ProjectionReport
  double place_tolerance = 1e-9;    // m, of place rows
  // Strain rows are solved until C - law(lambda) falls below this part of the band. A rest is energy from nowhere.
  double residual = 0.001;
  // Added to the unit diagonal of the scaled strain rows. Dependent rows (an edge between two pins) need it where rows
  // are hard; where they have a stiffness it only steadies the iteration. 1e-3: example 4.1(a) by the paper's variant
  // gains no energy at the auto step and at 1, 2 and 4 ms; at 1e-4 it gains 0.5 % of the work of gravity at the auto
  // step.
  double regularisation = 1e-3;
  int min_iterations = 1;  // projecting at least once a step is smooth in dt
  int max_iterations = 50;
};

struct ProjectionReport {
  bool converged = false;  // <=> strain_violation <= tolerance and place_violation <= place_tolerance
  int iterations = 0;
  double strain_violation = 0;  // at the end: largest |C|, with slack in the band what C lies outside of it
  double place_violation = 0;   // m
  double residual = 0;          // largest |C - law(lambda)| of rows with a stiffness, over the band
  bool damped = false;  // the start's gradients did not lead to the law's solution: the candidate's did, which damps
  int worst_row = -1;   // strain row with the largest violation
  double energy = 0;    // J, of the limit laws at the end
  double factor_seconds = 0;  // wall time of the numeric factorisations
};

// Constraint forces of the steps before: what the next step needs to be of second order. Empty where there were none.
struct ConstraintForces {
  Eigen::Matrix3Xd strain;  // N m, per strain row: at the start of the step, one and two steps before
  Eigen::Matrix3Xd place;   // N, per place row at the start: a first guess only
};

// What the last projection left behind, for reactions: rows and shapes as below.
struct ProjectionMemory {
  Eigen::VectorXd strain_multipliers;
  Eigen::Matrix3Xd place_multipliers, strain_impulses;
};

//   (1) fixed control points don't move;
//   (2) linear momentum is kept where nothing is pinned; a step's impulse has no moment about the places where its
//       directions were taken (angular momentum);
//   (3) pattern analysed once, in the constructor;
//   (4) a strain row that touches only fixed control points takes no part and counts in no violation.
class FastProjection {
 public:
  // Throws SolverError where a node has no mass or a place row touches only fixed control points.
  FastProjection(const AffineMap& map, const Eigen::VectorXd& node_mass, ConstraintRows rows,
                 const ProjectionOptions& options = {});
  ~FastProjection();
  FastProjection(FastProjection&&) noexcept;
  FastProjection& operator=(FastProjection&&) noexcept;

  // Corrects x (free nodes) at time t onto C = 0 along the gradients at x, all rows hard. Iterates until the
  // tolerances are met, `max_iterations` are spent, or fifteen iterations in a row gain nothing (constraints that
  // contradict each other; going on would only pile up multipliers).
  ProjectionReport project(Eigen::Ref<Eigen::VectorXd> x, double t);

  // The same for the candidate x of a step from the state `start` at t - dt; `forces` become those at t. Rows with a
  // stiffness obey their law F(C):
  //   M (x_after - x_before) = -dt^2 J^T F*,  F_n+1 = F(C(x_after)),
  //   F* = d F_n+1 + (1 - d) (8 F_n+1 + 12 F_n + 6 F_n-1 + F_n-2) / 27,  d = min(1, damping_rate dt).
  // F* is F at the start to second order. With a linear law the step is stable whatever the stiffness: with d = 0
  // vibrations too fast for it lose half of their size in each step (8 z^3 + 12 z^2 + 6 z + 1 = (2 z + 1)^3), slow ones
  // nearly nothing; d takes energy from the slow ones too, in proportion to dt^2.
  // Where the gradients at the start don't lead there (light nodes that turn far in a step), those of the candidate are
  // taken and F* = F_n+1: of first order, damping. The paper's variant projects and leaves `forces` alone.
  ProjectionReport step(Eigen::Ref<Eigen::VectorXd> x, double t, const Eigen::Ref<const Eigen::VectorXd>& start,
                        double dt, ConstraintForces& forces);

  // Sum over the last projection's iterations of the multipliers, per row [kg m2 for strain rows, kg m for place rows]:
  // divided by dt^2 they are the constraint forces' quadrature weights [N m, N]. After a step those at its end.
  const Eigen::VectorXd& strain_multipliers() const;
  const Eigen::Matrix3Xd& place_multipliers() const;
  // Multiplier times direction, summed over the iterations [kg m]: control point I was pushed by -d_I times its column.
  const Eigen::Matrix3Xd& strain_impulses() const;
  // All three, and putting them back where a run is taken up again; false where their sizes are of other rows.
  ProjectionMemory memory() const;
  bool restore(const ProjectionMemory& memory);

  // How far x is from the constraints, nothing moved.
  ProjectionReport measure(const Eigen::Ref<const Eigen::VectorXd>& x, double t);

  // Energy [J] of the limit laws at x; 0 in the paper's variant.
  double energy(const Eigen::Ref<const Eigen::VectorXd>& x, double t);
  const ConstraintRows& rows() const;
  const ProjectionOptions& options() const;
  std::size_t factor_nonzeros() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace toile
