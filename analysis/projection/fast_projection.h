// SPDX-License-Identifier: GPL-3.0-or-later
// Continuum fast projection: moves a candidate state onto the constraints with the least change of kinetic energy.
// [Peng & Zheng 2022, eqs. 29-36; Goldenthal et al. 2007]
#pragma once

#include <Eigen/Core>
#include <memory>

#include "analysis/constraint/constraint_rows.h"
#include "analysis/map/affine_map.h"
#include "analysis/projection/constraint_solver.h"
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
  // Strain rows are solved until C - law(lambda) falls below this part of the band, in a step below min(1, damping_rate
  // dt) times that. Residual left here shows up as spurious energy.
  double residual = 0.005;
  // Added to the unit diagonal of the scaled strain rows. Dependent rows (an edge between two pins) need it where rows
  // are hard; where they have a stiffness it only steadies the iteration. 1e-3: example 4.1(a) by the paper's variant
  // gains no energy at the auto step and at 1, 2 and 4 ms; at 1e-4 it gains 0.5 % of the work of gravity at the auto
  // step.
  double regularisation = 1e-3;
  int min_iterations = 1;  // projecting at least once a step is smooth in dt
  int max_iterations = 50;
};

// Besides what every ConstraintSolver keeps: a step's impulse has no moment about the places where its directions were
// taken (angular momentum).
class FastProjection final : public ConstraintSolver {
 public:
  // Throws SolverError where a node has no mass or a place row touches only fixed control points.
  FastProjection(const AffineMap& map, const Eigen::VectorXd& node_mass, ConstraintRows rows,
                 const ProjectionOptions& options = {});
  ~FastProjection() override;
  FastProjection(FastProjection&&) noexcept;
  FastProjection& operator=(FastProjection&&) noexcept;

  // Corrects x (free nodes) at time t onto C = 0 along the gradients at x, all rows hard. Iterates until the
  // tolerances are met, `max_iterations` are spent, or fifteen iterations in a row gain nothing (constraints that
  // contradict each other; going on would only pile up multipliers).
  ProjectionReport project(Eigen::Ref<Eigen::VectorXd> x, double t) override;

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
                        double dt, ConstraintForces& forces) override;

  ProjectionReport measure(const Eigen::Ref<const Eigen::VectorXd>& x, double t) override;
  double energy(const Eigen::Ref<const Eigen::VectorXd>& x, double t) override;  // 0 in the paper's variant
  const Eigen::VectorXd& strain_multipliers() const override;
  const Eigen::Matrix3Xd& place_multipliers() const override;
  const Eigen::Matrix3Xd& strain_impulses() const override;
  ProjectionMemory memory() const override;
  bool restore(const ProjectionMemory& memory) override;
  void use_threads(Workers* workers) override;
  const ConstraintRows& rows() const override;
  const ProjectionOptions& options() const;
  std::size_t factor_nonzeros() const override;
  std::size_t gram_nonzeros() const override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace toile
