// SPDX-License-Identifier: GPL-3.0-or-later
// Continuum fast projection: moves a candidate state onto the constraints with the least change of kinetic energy.
// [Peng & Zheng 2022, eqs. 29-36; Goldenthal et al. 2007]
#pragma once

#include <Eigen/Core>
#include <memory>

#include "analysis/constraint/constraint_rows.h"
#include "analysis/map/affine_map.h"
#include "analysis/projection/constraint_solver.h"

namespace toile {

struct ProjectionOptions {
  double tolerance = 0.01;        // largest |C| of a strain row that counts as met
  double place_tolerance = 1e-9;  // m, of place rows
  double residual = 0.005;        // of ProjectionReport::residual, by LagrangeNewton
  // Added to the unit diagonal of the scaled strain rows, which depend on each other where an edge runs between two
  // pins. 1e-3: example 4.1(a) gains no energy at the auto step and at 1, 2 and 4 ms; at 1e-4 it gains 0.5 % of the
  // work of gravity at the auto step.
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

  // The candidate projected: of first order in time, damping.
  ProjectionReport step(Eigen::Ref<Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> v, double t,
                        const Eigen::Ref<const Eigen::VectorXd>& start, double dt, ConstraintForces& forces) override;

  ProjectionReport measure(const Eigen::Ref<const Eigen::VectorXd>& x, double t) override;
  const ProjectionMemory& memory() const override;
  void use_threads(Workers* workers) override;
  const ConstraintRows& rows() const override;
  const ProjectionOptions& options() const;
  std::size_t factor_nonzeros() const override;
  std::size_t gram_nonzeros() const override;

 private:
  void set_memory(const ProjectionMemory& memory) override;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace toile
