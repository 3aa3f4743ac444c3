// SPDX-License-Identifier: GPL-3.0-or-later
// A panel of cloth as every model takes it.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "analysis/fabric/fabric.h"
#include "analysis/model/kink_points.h"
#include "geometry/nurbs_surface.h"
#include "trimming/quadrature.h"

namespace toile {

// SI, in the scene's axes. `rest` is unstrained; its directions weft (turned by grain from the u direction within the
// tangent plane, counter-clockwise seen against the normal) and warp carry the fabric's laws. The u direction is
// `straight_u`, projected, where that is set: threads of a flat panel are straight however its net is skewed.
struct ClothPanel {
  std::string name;
  NurbsSurface rest;
  CutQuadrature quadrature;
  Fabric fabric;
  double grain = 0;                                // rad
  std::optional<Eigen::Vector3d> straight_u = {};  // unit; unset: d rest / du of each point
  std::vector<KinkPoint> kinks = {};               // on C0 knot lines, see kink_points()
};

}  // namespace toile
