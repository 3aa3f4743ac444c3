// SPDX-License-Identifier: GPL-3.0-or-later
// Changes of one knot vector, whatever hangs on it: the common core of refine.h for curves and for either direction of
// a surface. Internal to geometry/.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "geometry/knot_vector.h"
#include "geometry/nurbs_surface.h"

namespace toile::detail {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Row i holds everything that control point i carries: homogeneous coordinates of one curve, or of all the lines of a
// surface net side by side. rows.rows() = knots.control_point_count().
struct LineNet {
  KnotVector knots;
  Rows rows;
};

// Homogeneous coordinates where the surface is rational. Along u a row holds the points of one i for every j; along v
// the other way round.
LineNet to_net(const NurbsSurface& surface, Direction d);
// The surface that `net` is in direction d; all else is as in `like`.
NurbsSurface to_surface(LineNet net, const NurbsSurface& like, Direction d);
// Equal weights are kept, so that a file's numbers come back.
std::vector<double> equal_weights(const std::vector<double>& weights, Eigen::Index count);

LineNet insert_knots(LineNet net, std::span<const double> added);

// The part over `range` (within the domain) with clamped ends.
LineNet cut(LineNet net, Interval range);

// One block of p + 1 rows per nonempty span of the domain, Bezier coefficients on that span.
std::vector<Rows> bezier_rows(const LineNet& net);

// The (p + 1) x (p + 1) matrix that takes the p + 1 control points of a nonempty span (knot index) to the Bezier
// coefficients on it; all entries are nonnegative and each row sums to 1.
Eigen::MatrixXd bezier_extraction(const KnotVector& knots, int span);

// Degree `degree` >= p on clamped knots; every interior multiplicity grows by the difference.
LineNet elevate_degree(const LineNet& net, int degree);

// The net without one occurrence of the interior knot; exact where the spline allows it, else near.
LineNet without_knot(const LineNet& net, double knot);

}  // namespace toile::detail
