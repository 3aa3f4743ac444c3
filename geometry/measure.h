// SPDX-License-Identifier: GPL-3.0-or-later
// Closest points, bounding boxes, lengths and areas.
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "geometry/nurbs_curve.h"
#include "geometry/nurbs_surface.h"

namespace toile {

// Boxes of the geometry within its control polygon's hull: exact containment, not tight.
template <int Dim>
Eigen::AlignedBox<double, Dim> bounding_box(const NurbsCurve<Dim>& curve);
Eigen::AlignedBox3d bounding_box(const NurbsSurface& surface);

// Area of the whole (untrimmed) surface over its domain.
double surface_area(const NurbsSurface& surface, double relative_tolerance = 1e-10);

// Unit mean of d x / du over a flat surface: straight threads of a cloth cut from it run at one angle to it, however
// the net is skewed. Depends on the geometry alone, not on its knots. Nothing where the net leaves its plane by more
// than `flatness` of its size, or where the mean points nowhere (u runs around a ring).
std::optional<Eigen::Vector3d> mean_u_direction(const NurbsSurface& surface, double flatness = 1e-9);

// The point of the surface nearest to `target`. `residual` is the length of the part of x - target that lies in those
// tangent directions which the border leaves open; `converged` says whether it fell below the tolerance (or the
// rounding of the coordinates). At a fold (a C0 knot) it means that neither side leads nearer. What did not converge is
// still the best found. Without a `start` the whole surface is searched: no point of it is nearer than `lower_bound`,
// which comes within 1e-7 of the surface's size of `distance` unless nearly all of a region is as near (then see how
// far it came). With a `start` the nearest point is a local one and lower_bound is 0. Throws GeometryError for a target
// or start that isn't finite.
struct ClosestPoint {
  double u = 0, v = 0;
  Eigen::Vector3d x = Eigen::Vector3d::Zero();
  double distance = 0;
  double residual = 0;
  int iterations = 0;
  bool converged = false;
  double lower_bound = 0;
};
struct ClosestPointOptions {
  double tolerance = 1e-12;  // relative to the size of the surface's bounding box
  int max_iterations = 60;
  std::optional<Eigen::Vector2d> start = {};  // descend from here only (curves use the first entry); else search
};
ClosestPoint closest_point(const NurbsSurface& surface, const Eigen::Vector3d& target, const ClosestPointOptions& = {});

template <int Dim>
struct CurveClosestPoint {
  double t = 0;
  Eigen::Matrix<double, Dim, 1> x;
  double distance = 0;
  double residual = 0;
  int iterations = 0;
  bool converged = false;
  double lower_bound = 0;
};
template <int Dim>
CurveClosestPoint<Dim> closest_point(const NurbsCurve<Dim>& curve, const Eigen::Matrix<double, Dim, 1>& target,
                                     const ClosestPointOptions& = {});

}  // namespace toile
