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

// The point of the surface nearest to `target`. `residual` is the length of the tangential part of (x - target), scaled
// to a length; `converged` says whether it fell below the tolerance (or the minimum sits on the border with the gradient
// pointing out). A result that did not converge is still the best found, never silent.
struct ClosestPoint {
  double u = 0, v = 0;
  Eigen::Vector3d x = Eigen::Vector3d::Zero();
  double distance = 0;
  double residual = 0;
  int iterations = 0;
  bool converged = false;
};
struct ClosestPointOptions {
  double tolerance = 1e-12;  // relative to the size of the surface's bounding box
  int max_iterations = 60;
  std::optional<Eigen::Vector2d> start;  // else the nearest point of a sampling of every span
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
};
template <int Dim>
CurveClosestPoint<Dim> closest_point(const NurbsCurve<Dim>& curve, const Eigen::Matrix<double, Dim, 1>& target,
                                     const ClosestPointOptions& = {});

}  // namespace toile
