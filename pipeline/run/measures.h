// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers of a state: strains and stresses over the cloth, at constraint points, at asked points, reactions.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/build/system.h"

namespace toile {

class StressField;

// Points of a 50 x 50 grid (middles of equal parts of the domain) that lie in the material, weighted by rest area.
struct GridSample {
  int panel = 0;
  Eigen::Vector2d uv;
  double weight = 0;  // m2
};
std::vector<GridSample> grid_samples(const Build& build, int per_direction = 50);

// Places along the border of the material: where trims meet knot lines, and the middles between.
std::vector<GridSample> border_samples(const Build& build);

// Weft and warp of a strain or stress over the grid.
struct Extremes {
  Eigen::Vector2d min{0, 0}, max{0, 0}, mean{0, 0}, mean_abs{0, 0};
  Eigen::Vector2d p001{0, 0}, p999{0, 0};  // 0.1 and 99.9 % of the area lie below
};

struct ShearExtremes {
  double min = 0, max = 0, mean_abs = 0;
};

// How near cloth and obstacles are, by 7 x 7 points of the surface a cell.
struct ContactMeasures {
  // Of the place that is worst by what is allowed there.
  double penetration = 0;               // m: how far the cloth's surface is within half its thickness and the skin
  double allowed = 0;                   // m, there: 0.1 of the cloth's thickness, the skin and the chord error
  double distance = 0;                  // m, least, of the cloth's middle from an obstacle's surface; infinite: far
  std::string where;                    // of the penetration
  std::vector<Eigen::Vector3d> forces;  // N, of each obstacle on the cloth in the last step
};

struct SeamMeasures {
  double gap = 0;                    // m, largest along it between what is to be one place
  double force = 0, mean_force = 0;  // N/m of its length that it carries, largest and mean
};

struct StateMeasures {
  std::optional<ContactMeasures> contact;  // where obstacles are
  Extremes strain;                         // E11, E22
  ShearExtremes shear;                     // 2 E12, on the same grid
  // N/m, the fabric's and what the strain limit carries, recovered [eq. 37]. Min and max also see the cloth's border.
  Extremes nominal;
  Extremes second_pk;                      // N/m, likewise
  Extremes raw_nominal, raw_second_pk;     // N/m, at the limit's rows as they are, by their areas; 0 without a limit
  double unseen_energy = 0;                // J, of weft and warp strain of the fabric between the limit's rows
  double at_constraints_max = 0;           // largest |E| of the strain rows taken (of all points where no limit is on)
  Extremes at_constraints;                 // min and max alone: strains of the rows taken, 0 included
  double lowest = 0, highest = 0;          // m, along the scene's "up" (against gravity; z without gravity)
  double largest_deflection = 0;           // m, of the grid's points from where the run started
  double area = 0, mass = 0;               // m2, kg, of the rest
  std::vector<Eigen::Vector3d> points;     // those that the scene asks for [m]
  std::vector<Eigen::Vector3d> reactions;  // per pin: force on the cloth [N]
  std::vector<SeamMeasures> seams;         // in the scene's order
  // Per pin along a curve: how far the cloth is from where the pin has it, at most, at 200 places or more along the
  // curve [m].
  std::vector<std::optional<double>> gaps;
};
// `dt`: of the last step [s], 0 before the first, where nothing is known of the forces of pins and limits.
StateMeasures measure(const Build& build, const System& system, const DynamicState& state, double dt);

// Parts of it: places of the scene's output points [m], force of each pin on the cloth [N],
// what seams carry.
std::vector<Eigen::Vector3d> output_points(const Build& build, const Eigen::VectorXd& q);
std::vector<SeamMeasures> seam_forces(const Build& build, const System& system, const DynamicState& state, double dt);
std::vector<Eigen::Vector3d> pin_reactions(const Build& build, const System& system, const DynamicState& state,
                                           double dt);

// Force [N m] of each strain row in the last step, for row_stress().
Eigen::VectorXd row_forces(const System& system, const Eigen::VectorXd& q, double dt);
// The stress that holds the nodes where they are, of fabric and limit together (the fabric's alone before a first
// step).
StressField stress_field(const Build& build, const System& system, const Eigen::VectorXd& q, double dt);

// Unit vector against gravity; z where there is none.
Eigen::Vector3d up(const Scene& scene);

}  // namespace toile
