// SPDX-License-Identifier: GPL-3.0-or-later
// The strain limit by two clocks: the cloth's own forces at the step, the limit's springs by many small steps within.
// [impulse method: Tuckerman, Berne & Martyna 1992]
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "analysis/map/affine_map.h"
#include "analysis/projection/constraint_solver.h"
#include "analysis/projection/limit_law.h"

namespace toile {

// Points of a body that are a tensor net, u fastest.
struct TensorNet {
  int first = 0, count_u = 0, count_v = 0;
};

struct SubstepsOptions {
  StrainBand weft = {}, warp = {};  // without the wall of LimitLaw: a spring from the slack on
  double tolerance = 0.01;          // largest violation of a strain row that counts as within, see ProjectionReport
  double place_tolerance = 1e-9;    // m, of place rows
  double percentile = 99.9;         // of the rows' area, to be within
  double damping = 0.1;             // share of a spring's force, by what it changed since the substep before
  // A row beyond its limit for longer than this [s] grows stiffer, twofold in as long.
  double doubling = 1.0 / 30;
  // Where rows of a whole net are products f(u) g(v), lines of them are worked off at once: the same but for rounding.
  std::vector<TensorNet> nets = {};
};

// Rows must have a stiffness. A step of dt = n h from x0, v0 under the acceleration a of its start:
//
//   v += dt/2 a;   n times  v -= h M^-1 J^T lambda (half of it before the first and after the last), x += h v;
//   v += dt/2 a;
//   lambda = k (e + damping h / h_max (e - e of the substep before)),   e = C beyond the slack
//
// h is the largest part of dt up to h_max = 0.98 * 2 / sqrt((1 + 2 damping) G), G a bound of the springs' eigenvalues
// at the start. Place rows are met after each substep, by the constant factor of N M^-1 N^T; fixed control points move
// with the substeps.
//   (1) nothing but places and velocities at the start, and how stiff rows have become, is remembered;
//   (2) momentum is kept, and without damping so are areas in phase space: no step size adds energy;
//   (3) no iteration, no tolerance: the same bits for any number of threads.
// Strain is not bounded row by row. `converged` says that the percentile is within the limit; while it is not, the rows
// beyond grow stiffer (ConstraintForces::stiffening), up to sixteenfold.
class Substeps final : public ConstraintSolver {
 public:
  // Throws SolverError where a node has no mass, a strain row has no stiffness, or place rows depend on each other or
  // touch only fixed control points.
  Substeps(const AffineMap& map, const Eigen::VectorXd& node_mass, ConstraintRows rows,
           const SubstepsOptions& options = {});
  ~Substeps() override;

  ProjectionReport project(Eigen::Ref<Eigen::VectorXd> x, double t) override;  // FastProjection's
  // `iterations` of the report: substeps.
  ProjectionReport step(Eigen::Ref<Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> v, double t,
                        const Eigen::Ref<const Eigen::VectorXd>& start, double dt, ConstraintForces& forces) override;
  bool end_velocity() const override { return true; }
  bool follows() const override { return false; }  // a kick may come back within the step
  // From 0.6 on the two clocks may add 1 % of energy where cloth snaps taut again and again.
  double step_share() const override { return 0.5; }
  ProjectionReport measure(const Eigen::Ref<const Eigen::VectorXd>& x, double t) override;
  double energy(const Eigen::Ref<const Eigen::VectorXd>& x, double t) override;
  // Impulses: of rows at fixed control points the mean over the step, of others that of its start and end.
  const ProjectionMemory& memory() const override;
  void use_threads(Workers* workers) override;
  const ConstraintRows& rows() const override;
  std::size_t factor_nonzeros() const override;
  int nets() const;  // that are worked off by lines

 private:
  void set_memory(const ProjectionMemory& memory) override;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace toile
