// SPDX-License-Identifier: GPL-3.0-or-later
// Implicit steps: each minimises an incremental potential of inertia, elastic energy, the strain limit as energy,
// loads, drag and wind. [Kane et al. 2000; Bank et al. 1985; Newmark 1959]
#pragma once

#include <memory>

#include "analysis/projection/primal_dual.h"
#include "analysis/scheme/verlet.h"

namespace toile {

enum class ImplicitRule {
  backward_euler,  // first order, damping
  bdf2,            // TR-BDF2: second order, what a step doesn't resolve is gone at its end; two minima a step
  newmark,         // beta = 1/4, gamma = 1/2: second order, keeps energy, and what it doesn't resolve rings
};

struct ImplicitOptions {
  double residual = 1e-3;  // of the forces at work, that a step may leave
  int max_iterations = 50;
};

// A step leads to x with M (x - x^) / beta^2 = forces(x), rule by rule:
//   backward Euler  x^ = x0 + dt v0,                               beta = dt,    v1 = (x1 - x0) / dt
//   Newmark         x^ = x0 + dt v0 + beta^2 a0,                   beta = dt/2,  v1 = 2 (x1 - x0) / dt - v0
//   TR-BDF2         to g dt by Newmark's, then from both by BDF2,  beta = g dt/2, g = 2 - sqrt 2
// with a0 the whole acceleration at the start. Newton's method with the exact tangent, the positive one where that has
// no factor, and a searched step; forces of limits and pins as PrimalDual finds them.
//   (1) any step size is stable; (2) drag is implicit; (3) a step that finds no minimum says so (ProjectionReport) and
//       leaves the state that it reached; (4) the same bits for any number of threads.
class ImplicitScheme {
 public:
  // The system's rows, if any, are taken from its constraint solver, which is told the forces for reactions; the system
  // must outlive it. Throws SolverError where nodes have no mass.
  ImplicitScheme(const MechanicalSystem& system, const PrimalDualOptions& limits, ImplicitRule rule,
                 const ImplicitOptions& options = {});
  ~ImplicitScheme();

  // As Verlet's step(): energies at the end, `at_end`.
  StepReport step(DynamicState& state, double dt, StepWork& work);
  // Towards static equilibrium at t + dt: the least of |x - x0|^2_M / (2 beta^2) + what is stored, from rest to rest.
  // The larger beta, the nearer. [pseudo-transient continuation: Kelley & Keyes 1998]
  StepReport equilibrate(DynamicState& state, double dt, double beta, StepWork& work);

 private:
  StepReport finish(DynamicState& state, double dt, StepWork& work, const ProjectionReport& found);
  DynamicState& begin(const DynamicState& state, double dt, StepWork& work);

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace toile
