// SPDX-License-Identifier: GPL-3.0-or-later
// The shadow that draped cloth throws on a level plane, and what Cusick's drape test reads off it.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "geometry/triangle_mesh.h"

namespace toile {

// A plane figure seen from a centre, along `rays` equally spaced rays from it; ray k at the angle 2 pi k / rays from
// the plane's first axis.
struct Shadow {
  std::vector<double> radius;  // m, of its farthest point on each ray; 0 where the ray meets nothing
  double area = 0;             // m2, of the union of what each ray meets: right for outlines that turn back, too
};

// The union of triangles in the plane and of a disc of radius `support` about the centre. Ray by ray, so that the area
// errs as the trapezoid rule of the outline does.
Shadow shadow_of(const Eigen::Matrix2Xd& points, std::span<const Triangle> triangles, const Eigen::Vector2d& centre,
                 double support, int rays = 3600);

// A fold: a maximum of the outline's radius.
struct DrapeNode {
  double angle = 0;      // rad
  double radius = 0;     // m
  double amplitude = 0;  // m: half its height above the mean of the valleys beside it
};

struct DrapeMeasure {
  double support = 0;      // m, radius
  double area = 0;         // m2, shadow
  double flat_area = 0;    // m2
  double coefficient = 0;  // %: (shadow - support) / (flat - support)
  double least = 0;        // m, prominence of what counts as a node: 2 % of the free ring's width
  std::vector<DrapeNode> nodes;
};

// Nodes have more than `least` of prominence: so far the outline falls on both sides before it rises higher.
// The support must be smaller than the flat cloth.
DrapeMeasure measure_drape(const Shadow& shadow, double support, double flat_area);

// Outline, nodes, support and flat disc, at true size (1 user unit = 1 mm).
std::string drape_svg(const Shadow& shadow, const DrapeMeasure& measure);

}  // namespace toile
