// SPDX-License-Identifier: GPL-3.0-or-later
// The constrained Lagrange problem of a step by Newton's method on places and multipliers together.
// [Peng & Zheng 2022, eqs. 25-28]
#pragma once

#include <Eigen/Core>
#include <memory>

#include "analysis/map/affine_map.h"
#include "analysis/projection/constraint_solver.h"
#include "analysis/projection/fast_projection.h"

namespace toile {

// Solves M (x - candidate) + J(x)^T lambda = 0, C(x) = 0, all rows hard: the constraint forces point along the
// gradients at the end of the step, and x is a nearest point of the constraints. Eq. (27) multiplied by M is symmetric,
//
//   [ K  J^T ] [ dx      ]     [ M (x - candidate) + J^T lambda ]
//   [ J  -S  ] [ dlambda ] = - [ C - S (lambda - anchor)        ],   K = M + sum_r lambda_r C_r'' = M + D^T Lambda D
//
// with a softness S, `regularisation` times the diagonal of J M^-1 J^T at rest (1e-8 times that for place rows, whose
// anchor is lambda). The anchor stays 0 where C = S lambda meets the tolerance: dependent rows share their load, and
// the answer is one. It follows lambda while the tolerance isn't met. dlambda is eliminated: K + J^T S^-1 J, symmetric,
// 3 n rows, is factored.
//   (1) M (x - candidate) = -J(x)^T lambda but for the part `residual`: no moment about the places at the end;
//   (2) the factor exists exactly where the step leads to a minimum. Where it doesn't (cloth that buckles under the
//       multipliers of compression), K leaves out negative multipliers, then S grows.
//   (3) Where Newton's method gains nothing in five iterations (buckling by a tenth in one step), the step is the
//       projection's, and `damped` says so.
class LagrangeNewton final : public ConstraintSolver {
 public:
  // `residual` bounds ProjectionReport::residual; a `regularisation` below 1e-8 counts as 1e-8. Throws SolverError
  // where a node has no mass or a place row touches only fixed control points.
  LagrangeNewton(const AffineMap& map, const Eigen::VectorXd& node_mass, ConstraintRows rows,
                 const ProjectionOptions& options = {});
  ~LagrangeNewton() override;

  // Iterates until the tolerances and `residual` are met, else as FastProjection does. Multipliers start at 0, as in
  // the paper: the first iteration is the projection's. A step is the projection of its candidate.
  ProjectionReport project(Eigen::Ref<Eigen::VectorXd> x, double t) override;
  ProjectionReport step(Eigen::Ref<Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> v, double t,
                        const Eigen::Ref<const Eigen::VectorXd>& start, double dt, ConstraintForces& forces) override;
  ProjectionReport measure(const Eigen::Ref<const Eigen::VectorXd>& x, double t) override;
  const ProjectionMemory& memory() const override;
  void use_threads(Workers* workers) override;
  const ConstraintRows& rows() const override;
  std::size_t factor_nonzeros() const override;

 private:
  void set_memory(const ProjectionMemory& memory) override;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace toile
