// SPDX-License-Identifier: GPL-3.0-or-later
// The system that the step loop advances: a build with the pins that hold at some time.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "analysis/contact/contact_projection.h"
#include "analysis/scheme/equilibrium_path.h"
#include "analysis/scheme/implicit.h"
#include "analysis/seam/seam_springs.h"
#include "pipeline/build/build.h"

namespace toile {

// Pins, projection, masses. `dynamic`, `implicit` and `path` point into the rest, so a System stays where it is made.
struct System {
  System() = default;
  System(const System&) = delete;

  std::vector<int> fixed_pin;  // pin of each fixed control point, in map order
  // Per panel: which the projection takes, and why not. Those that the panel lists, and those of the sampling rule and
  // of pins besides; a StrainRow's `point` counts through the first, then the second.
  std::vector<std::vector<ConstraintPoint>> points, extra_points;
  std::vector<std::string> warnings;                          // pins that hold what others hold
  int strain_rows = 0, place_rows = 0, place_components = 0;  // components that place rows hold
  std::optional<Eigen::Vector2d> unbalanced;   // unbalanced_part() of the strain rows, where they are of points
  std::vector<int> place_pin;                  // pin of each place row; -1: it is of a seam
  std::vector<std::array<int, 2>> place_seam;  // of each place row: seam and which of its rows; -1: it is of a pin
  std::vector<PlaceRow> along_seams;           // places along each seam, closely
  std::shared_ptr<Sewing> sewing = std::make_shared<Sewing>();  // how far they are closed; set_sewing()
  std::unique_ptr<SeamSprings> springs;                         // while they pull; null: rows hold
  std::vector<PlaceRow> along_curves;  // 200 places along each curve that a pin holds by some of its points
  std::unique_ptr<AffineMap> map;
  std::unique_ptr<ConstraintSolver> projection;  // null: nothing to project
  const ContactProjection* contact = nullptr;    // the same, where anything may touch
  MechanicalSystem dynamic;
  std::unique_ptr<ImplicitScheme> implicit;  // null: velocity Verlet
  std::unique_ptr<EquilibriumPath> path;     // of loads that grow; null: none
};

// A step of the system's scheme.
StepReport step(const System& system, DynamicState& state, double dt, StepWork& work);

// Edge of the square whose corners are as far from its middle as the farthest cloth is [m].
double extent(const ClothPanel& panel);

// Stiffness of the strain limit of a panel [N/m]: the scene's, else one that strains by a tenth of the narrowest limit
// under the panel's whole weight or the largest traction, and is at least ten times the fabric's own.
double limit_stiffness(const Build& build, int panel);
double default_limit_stiffness(const Build& build, int panel);

// Pins released at or before t are left out. Throws InputError where two pins hold one control point and move apart,
// or farther than the cloth between them reaches, GeometryError for places that don't exist, SolverError where place
// rows contradict each other. `workers`: threads of the steps, which must outlive the system; null: the caller's alone.
// `sewing`: how far seams are closed; null: as at the start. Until they are done there is no gravity and no friction,
// unless the scene wants them.
std::unique_ptr<System> assemble(const Build& build, double t, Workers* workers = nullptr,
                                 const Sewing* sewing = nullptr);

// How far seams are closed from here on; what that adds to the energy of springs at q [J].
double set_sewing(System& system, const Build& build, const Sewing& sewing, const Eigen::VectorXd& q);

// How far the control points and places that pins move go from t to t + dt at most [m]. `now`, `then`: working memory.
double pins_move(const System& system, double t, double dt, Eigen::Matrix3Xd& now, Eigen::Matrix3Xd& then);

// State that continues control points q with velocities v (3 n each) under this system at time t.
DynamicState state_from(const System& system, const Eigen::VectorXd& q, const Eigen::VectorXd& v, double t);

// Velocities of all control points [m/s], those of moved pins included.
Eigen::VectorXd control_point_velocity(const System& system, const DynamicState& state);
Eigen::VectorXd control_points(const System& system, const DynamicState& state);

}  // namespace toile
