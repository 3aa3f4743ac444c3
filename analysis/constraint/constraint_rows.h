// SPDX-License-Identifier: GPL-3.0-or-later
// Constraints as sparse scalar rows on control points: everything fast projection needs to know about a scene.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "analysis/map/affine_map.h"
#include "analysis/model/body.h"
#include "trimming/constraint_points.h"

namespace toile {

// Each has a row d over the body's points, which gives the vector y = sum_I d_I q_I.
//   strain rows: d = N_,weft or N_,warp at a constraint point; C = (y.y - 1) / 2                 [eq. 36]
//   place rows:  d = N at a pinned material point; C = y - target(t), three components or some, always an equality;
//                of a seam the difference of N at two points that are sewn to each other.
struct StrainRow {
  ScalarRow row;
  int panel = 0;
  int point = 0;  // in the panel's constraint points; -1: the row is a mean, of no point
  bool warp = false;
  double area = 0;               // m2, of the cloth that the row represents
  double stiffness = 0;          // N m, force per strain times area, of the limit's law; 0: hard
  Eigen::Vector2d uv{0, 0};      // where it stands on the panel
  Eigen::Vector2d thread{1, 0};  // unit, in weft and warp: the direction whose strain C is; `warp` says the nearer
};
struct PlaceRow {
  ScalarRow row;
  int pin = 0;                                    // of the scene, for reactions and messages
  std::function<Eigen::Vector3d(double)> target;  // place at time t [m]
  Eigen::Vector3d axes{1, 1, 1};                  // 1: held, 0: free
  int seam = -1;                                  // of the scene, instead of a pin; -1: none
};
std::string name(const PlaceRow& row);  // "pin 3", "seam 0"

struct ConstraintRows {
  std::vector<StrainRow> strain;
  std::vector<PlaceRow> place;
};

// For what can hold all components of a place row only. Throws SolverError where a row holds some: "pin N holds some
// components only (hold): `remedy`".
void require_whole_places(const ConstraintRows& rows,
                          const std::string& remedy = "only the default solver of the strain limit keeps such a pin");

// Weft and warp row of every point that is used, in the order of the points; `points[panel]` as constraint_points()
// gives them. Functions that vanish at a point (all but p per direction on a C1 knot line) are left out. Rows are hard;
// their areas are those of weigh_rows().
std::vector<StrainRow> strain_rows(const Body& body, const AffineMap& map,
                                   const std::vector<std::vector<ConstraintPoint>>& points);

}  // namespace toile
