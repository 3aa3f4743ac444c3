// SPDX-License-Identifier: GPL-3.0-or-later
// The strain limit as a law, by Newton's method on places and multipliers together with the tension's own stiffness:
// implicit where velocity Verlet is explicit. [Stern & Grinspun 2009; law: limit_law.h]
#pragma once

#include <Eigen/Core>
#include <memory>

#include "analysis/linear/block_matrix.h"
#include "analysis/map/affine_map.h"
#include "analysis/projection/constraint_solver.h"
#include "analysis/projection/limit_law.h"

namespace toile {

struct PrimalDualOptions {
  StrainBand weft = {}, warp = {};
  double tolerance = 0.01;        // largest violation of a strain row that counts as met, see ProjectionReport
  double place_tolerance = 1e-9;  // m, of place rows
  // A stage is solved until the forces that are left are below this part of those at work, and C - law(lambda) below
  // this part of the largest strain, and of what the law leaves to the limit.
  double force_residual = 1e-3, law_residual = 1e-3, wall_residual = 0.05;
  int max_iterations = 50;
};

// What acts on the nodes besides rows, where that is implicit too.
class SmoothEnergy {
 public:
  virtual ~SmoothEnergy() = default;
  virtual double value(const Eigen::Ref<const Eigen::VectorXd>& x) = 0;                           // J
  virtual void add_gradient(const Eigen::Ref<const Eigen::VectorXd>& x, Eigen::VectorXd& g) = 0;  // N
  // On the pattern given to PrimalDual; `positive`: without what makes it indefinite.
  virtual const BlockMatrix& hessian(const Eigen::Ref<const Eigen::VectorXd>& x, bool positive) = 0;
};

// Rows must have a stiffness. The cloth's own forces act by velocity Verlet, the rows' by the trapezoidal rule: with
// the accelerations a0 at the start and the candidate x~ = x0 + dt v0 + dt^2/2 a0
//
//   M (x1 - x~) = -dt^2/4 (J0^T lambda0 + J1^T phi1),   phi1 = lambda1 + friction (C1 - C0),
//   v = 2 (x1 - x0) / dt - v0,
//
// which is stable wherever Verlet is, whatever the rows' stiffness, without resonance. x1 minimises inertia plus the
// limit's energy. The step resolves the share 1 - r of a vibration of the rows at omega, r = (s / (1 + s))^3,
// s = (omega dt/2)^2. The rest is removed: from strains by a friction of r times the law's slope at the start, from
// velocities by settle(), which applies (I - (I + dt^2/4 M^-1 K)^-1)^3. Per step that is 1e-4 of an amplitude at
// omega dt = 1/2, 0.5 % at 1. Place rows are held exactly.
//   (1) every strain stays below its limit;
//   (2) nothing but places, velocities and forces at the start is remembered, so the next step may have any size;
//   (3) momentum is kept where nothing is pinned, spin but for errors of the step.
class PrimalDual final : public ConstraintSolver {
 public:
  // Throws SolverError where a node has no mass, a strain row has no stiffness, or a place row touches only fixed
  // control points.
  // `added`: the pattern of what minimise() adds; must outlive it.
  PrimalDual(const AffineMap& map, const Eigen::VectorXd& node_mass, ConstraintRows rows,
             const PrimalDualOptions& options = {}, const BlockPattern* added = nullptr);
  ~PrimalDual() override;

  // FastProjection's: throws SolverError where a place row holds some components only.
  ProjectionReport project(Eigen::Ref<Eigen::VectorXd> x, double t) override;
  ProjectionReport step(Eigen::Ref<Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> v, double t,
                        const Eigen::Ref<const Eigen::VectorXd>& start, double dt, ConstraintForces& forces) override;
  ProjectionReport again(Eigen::Ref<Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> v, double t,
                         const Eigen::Ref<const Eigen::VectorXd>& start, double dt, ConstraintForces& forces) override;
  bool end_velocity() const override { return true; }
  // f += J^T of `forces` at x and time t; memory() then holds them as if a step of 1 s had ended there.
  void add_forces(const Eigen::VectorXd& x, double t, ConstraintForces& forces, Eigen::VectorXd& f);
  // x from where it is to the least of |x - guess|^2_M / (2 tau^2) + energy of the limit + `smooth`, place rows held,
  // at time t. `forces` are the first guess and the answer; `reference`: |M^-1/2 force| that what is left is compared
  // with.
  ProjectionReport minimise(Eigen::VectorXd& x, const Eigen::VectorXd& guess, double tau, double t,
                            SmoothEnergy& smooth, double reference, ConstraintForces& forces);
  double settle(Eigen::Ref<Eigen::VectorXd> v, double t) override;
  ProjectionReport measure(const Eigen::Ref<const Eigen::VectorXd>& x, double t) override;
  double energy(const Eigen::Ref<const Eigen::VectorXd>& x, double t) override;
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
