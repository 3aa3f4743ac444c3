// SPDX-License-Identifier: GPL-3.0-or-later
// Static equilibrium under dead loads that grow from nothing to the whole: by steps of the load, or of the length of
// the path, which goes on beyond limit points. [Riks 1979; Crisfield 1981; Ramm 1981]
#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <string>

#include "analysis/scheme/verlet.h"
#include "geometry/fields.h"

namespace toile {

struct PathOptions {
  int load_steps = 10;  // a step takes 1 / load_steps of the loads at most
  bool arc_length = false;
  double residual = 1e-7;  // of the loads, that a step may leave
  int max_iterations = 25;
};

// How far along the path a state is, and how it goes on from there.
struct PathPoint {
  double factor = 0;      // of the loads; 1 at the end
  double length = 0;      // of the next step: of the factor, or root mean square of the moves [m]; 0: none was taken
  double shortest = 0;    // below it a step is given up
  Eigen::VectorXd moved;  // of the last step
  int steps = 0, halvings = 0, iterations = 0;
  int negative = 0;  // eigenvalues of this state's stiffness that are below 0: the equilibrium is not stable
  double remaining = std::numeric_limits<double>::infinity();  // m, that the last iteration moved a node
};
void fields(auto& archive, Like<PathPoint> auto& p) {
  archive(p.factor, p.length, p.shortest, p.moved, p.steps, p.halvings, p.iterations, p.negative, p.remaining);
}

struct PathReport {
  StepReport step;
  std::string trouble;  // empty: the state is the next equilibrium; else why there was none
};

// Newton's method with the exact tangent, which need not be positive; place rows are held by multipliers.
//   (1) an accepted state is in equilibrium with `factor` of the loads, to the residual, and `negative` is of its own
//       stiffness;
//   (2) a step without balance is tried again from where it began with half of what it tried, which may be less than it
//       was allowed: no attempt is made twice, and none where the stiffness is singular from the start;
//   (3) nothing shorter is tried than 1/1024 of a step of the load, or of the first step of the path;
//   (4) steps of the load land on each multiple of 1 / load_steps; both kinds end at a factor of 1;
//   (5) the same bits for any number of threads.
class EquilibriumPath {
 public:
  // Throws SolverError where the system has strain rows or drag, or nodes without mass. The system must outlive it.
  EquilibriumPath(const MechanicalSystem& system, const PathOptions& options);
  ~EquilibriumPath();

  // The next equilibrium, at time t + dt. With trouble the state is what it was.
  PathReport step(DynamicState& state, double dt, PathPoint& point, StepWork& work);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace toile
