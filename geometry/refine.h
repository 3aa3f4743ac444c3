// SPDX-License-Identifier: GPL-3.0-or-later
// Changes of representation that keep the geometry: knot insertion and removal, degree elevation, exact rebuild of flat
// panels, Bezier extraction, splitting, reversal.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "geometry/nurbs_curve.h"
#include "geometry/nurbs_surface.h"

namespace toile {

// Knots may repeat; each must lie in the domain and may reach multiplicity p at most in the interior. Existing knots
// stay bitwise. Unclamped input stays unclamped. [Piegl & Tiller 1997, A5.4 (Boehm)]
template <int Dim>
NurbsCurve<Dim> insert_knots(const NurbsCurve<Dim>& curve, std::span<const double> added);
NurbsSurface insert_knots(const NurbsSurface& surface, Direction direction, std::span<const double> added);

// The same geometry with clamped end knots.
template <int Dim>
NurbsCurve<Dim> clamp(const NurbsCurve<Dim>& curve);
NurbsSurface clamp(const NurbsSurface& surface);

// The same geometry in a higher degree (up to max_degree) on clamped knots; every interior multiplicity grows by the
// difference, so continuity stays.
template <int Dim>
NurbsCurve<Dim> elevate_degree(const NurbsCurve<Dim>& curve, int degree);
NurbsSurface elevate_degree(const NurbsSurface& surface, Direction direction, int degree);

// Removes one occurrence of an interior knot when the geometry stays within `tolerance` (a length in the units of the
// control points; the bound holds over the whole domain); nullopt where it doesn't. `deviation` takes the
// bound reached. Throws GeometryError where `knot` is no interior knot. [Piegl & Tiller 1997, A5.8]
template <int Dim>
std::optional<NurbsCurve<Dim>> remove_knot(const NurbsCurve<Dim>& curve, double knot, double tolerance);
std::optional<NurbsSurface> remove_knot(const NurbsSurface& surface, Direction direction, double knot, double tolerance,
                                        double* deviation = nullptr);

// The affine map (u, v) -> origin + u * du + v * dv that the surface is, when it is one within `tolerance` (length).
struct AffinePatch {
  Eigen::Vector3d origin, du, dv;
  double deviation = 0;  // largest distance found, same unit
};
std::optional<AffinePatch> affine_patch(const NurbsSurface& surface, double tolerance);
// (u, v) of the point of the patch's plane nearest to x.
Eigen::Vector2d parameters_at(const AffinePatch& patch, const Eigen::Vector3d& x);

// A flat affine panel on other knots of the same domain: control points at Greville abscissae, which is exact.
NurbsSurface rebuild(const AffinePatch& patch, KnotVector u, KnotVector v);

// Bezier pieces of a curve, one per nonempty span of the domain, each with its parameter range. Control points Dim x
// (p+1) Euclidean, weights p+1 (1 for polynomial curves).
template <int Dim>
struct BezierCurve {
  Interval range;
  Eigen::Matrix<double, Dim, Eigen::Dynamic> points;
  Eigen::VectorXd weights;
};
template <int Dim>
std::vector<BezierCurve<Dim>> bezier_pieces(const NurbsCurve<Dim>& curve);

// Bezier pieces of a surface: points 3 x (p_u+1)(p_v+1), u fastest; ordered u fastest over the span grid.
struct BezierPatch {
  Interval u, v;
  int degree_u = 0, degree_v = 0;
  Eigen::Matrix3Xd points;
  Eigen::VectorXd weights;
};
std::vector<BezierPatch> bezier_patches(const NurbsSurface& surface);

// The part of a curve over a sub-range of its domain, with that range as its (clamped) domain.
template <int Dim>
NurbsCurve<Dim> sub_curve(const NurbsCurve<Dim>& curve, Interval range);

// The same curve run backwards over the same domain: c(min + max - t).
template <int Dim>
NurbsCurve<Dim> reversed(const NurbsCurve<Dim>& curve);

// The same curve over another domain: knots mapped affinely, the domain's ends bitwise those of `domain`.
template <int Dim>
NurbsCurve<Dim> with_domain(const NurbsCurve<Dim>& curve, Interval domain);

// Refinement to analysis resolution, clamped.
//   (1) Degree per direction: the larger of the surface's and the asked one (at least 2 when one is asked). A flat
//       affine panel takes exactly what is asked, and the larger of its own and 2 when nothing is.
//   (2) `span` [unit of the net] splits each span of the surface into ceil(length / span) equal parts, length being its
//       longest iso-curve (a multiple to 1e-9 isn't split once more); `spans` and `control_points` ask for totals per
//       direction, shared by length. At most one of the three may be set.
//   (3) The surface's own distinct knots stay, bitwise; only where a flat affine panel is asked for fewer spans than it
//       has does it get equal ones.
//   (4) Where the continuity is below C1, knots are removed as far as the surface stays within `tolerance` (or
//       rounding, 256 epsilon of the net's size); those that stay C0 are listed.
//   (5) A flat affine panel that has the resulting knots already comes back unchanged.
struct RefineOptions {
  std::optional<int> degree = {};
  std::optional<double> span = {};
  std::optional<std::array<int, 2>> spans = {};
  std::optional<std::array<int, 2>> control_points = {};
  double tolerance = 0;  // length, unit of the net: how far flatness and knot removal may move the surface
};
struct Refinement {
  NurbsSurface surface;
  bool rebuilt_flat = false;
  double deviation = 0;                             // largest move of the surface, unit of the net
  std::vector<std::pair<Direction, double>> kinks;  // interior knots that stay C0 (multiplicity >= degree)
};
// Throws GeometryError for options out of range, where the totals asked for can't be had on the surface's spans, and
// above two million control points.
Refinement refine(const NurbsSurface& surface, const RefineOptions& options);

}  // namespace toile
