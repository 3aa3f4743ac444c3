// Continuum fast projection: moves a candidate state onto the constraints with the least change of kinetic energy.
// [Peng & Zheng 2022, eqs. 29-36; Goldenthal et al. 2007]
#pragma once

#include <Eigen/Core>
#include <memory>

#include "analysis/affine_map.h"
#include "analysis/projection/constraint_rows.h"

namespace toile {

struct ProjectionOptions {
  double tolerance = 0.01;        // largest |C| of a strain row that counts as met
  double place_tolerance = 1e-9;  // m, of place rows
  // Added to the unit diagonal of the scaled strain rows. Example 4.1(a) for 0.6 s: without drag the energy never rises above
  // its start plus work at 1e-3, at the auto step and at 1, 2 and 4 ms; at 1e-4 it rises by 0.5 % of the work of gravity at
  // the auto step.
  double regularisation = 1e-3;
  // The same for guard rows: rows that the flat cloth can spare, but that hold the trimmed border of a bent one. Left out,
  // the border stretches; taken like the others, they lock bending across the net. Chosen by the table in
  // analysis/README.md, "Which rows", which also says how it was measured.
  double guard_softness = 0.01;
  int min_iterations = 1;         // projecting at least once a step is smooth in dt
  int max_iterations = 50;
};

struct ProjectionReport {
  bool converged = false;         // <=> strain_violation <= tolerance and place_violation <= place_tolerance
  int iterations = 0;
  double strain_violation = 0;    // largest |C| at the end, guard rows apart
  double place_violation = 0;     // m
  int worst_row = -1;             // strain row with the largest |C|
  double factor_seconds = 0;      // wall time of the numeric factorisations
};

// What the last projection left behind, for reactions: rows and shapes as below.
struct ProjectionMemory {
  Eigen::VectorXd strain_multipliers;
  Eigen::Matrix3Xd place_multipliers, strain_impulses;
};

//   (1) fixed control points don't move;
//   (2) linear momentum is kept where nothing is pinned, and every iteration's impulse has no moment about the places
//       it started from (angular momentum);
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

  // Corrects x (free nodes) at time t: M (x_after - x_before) = -sum over iterations of J^T d lambda. Iterates until the
  // tolerances are met, `max_iterations` are spent, or fifteen iterations in a row gain nothing (constraints that
  // contradict each other; going on would only pile up multipliers).
  ProjectionReport project(Eigen::Ref<Eigen::VectorXd> x, double t);

  // Sum over the last projection's iterations of the multipliers, per row [kg m2 for strain rows, kg m for place rows]:
  // divided by dt^2 they are the constraint forces' quadrature weights [N m, N].
  const Eigen::VectorXd& strain_multipliers() const;
  const Eigen::Matrix3Xd& place_multipliers() const;
  // Multiplier times tangent, summed over the iterations with the tangents of each [kg m]: control point I was pushed by
  // -d_I times its column. What a reaction needs; lambda y at the end differs from it by the move of the last step.
  const Eigen::Matrix3Xd& strain_impulses() const;
  // All three, and putting them back where a run is taken up again; false where their sizes are of other rows.
  ProjectionMemory memory() const;
  bool restore(const ProjectionMemory& memory);
  const ConstraintRows& rows() const;
  const ProjectionOptions& options() const;
  std::size_t factor_nonzeros() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace toile
