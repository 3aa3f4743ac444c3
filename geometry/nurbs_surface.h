// SPDX-License-Identifier: GPL-3.0-or-later
// NURBS surfaces: net, weights, evaluation with derivatives.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "geometry/basis.h"
#include "geometry/knot_vector.h"

namespace toile {

enum class Direction { u, v };

// A tensor-product surface: control points 3 x (n_u n_v), u fastest (point (i,j) is column i + n_u j), Euclidean;
// weights alike, an empty vector means that all are 1.
//   (1) sizes match the knots; (2) points finite, weights positive and finite. Throws GeometryError.
class NurbsSurface {
 public:
  NurbsSurface() = default;
  NurbsSurface(KnotVector u, KnotVector v, Eigen::Matrix3Xd points, std::vector<double> weights = {});

  const KnotVector& knots(Direction d) const { return knots_[d == Direction::u ? 0 : 1]; }
  const KnotVector& u() const { return knots_[0]; }
  const KnotVector& v() const { return knots_[1]; }
  int count_u() const { return knots_[0].control_point_count(); }
  int count_v() const { return knots_[1].control_point_count(); }
  int index(int i, int j) const { return i + count_u() * j; }
  const Eigen::Matrix3Xd& points() const { return points_; }
  const std::vector<double>& weights() const { return weights_; }
  double weight(int k) const { return weights_.empty() ? 1.0 : weights_[static_cast<std::size_t>(k)]; }
  // False also where all weights are equal: the surface is polynomial.
  bool rational() const { return rational_; }

  Eigen::Vector3d operator()(double u, double v) const;

  // The same surface with another net of the same size: what a drape does.
  NurbsSurface with_points(Eigen::Matrix3Xd points) const;

  bool operator==(const NurbsSurface&) const = default;

 private:
  std::array<KnotVector, 2> knots_;
  Eigen::Matrix3Xd points_ = Eigen::Matrix3Xd::Zero(3, 4);
  std::vector<double> weights_;
  bool rational_ = false;
};

// Position and partial derivatives at a parameter.
struct SurfaceJet {
  Eigen::Vector3d x, u, v, uu, uv, vv;
  double area_scale() const { return u.cross(v).norm(); }  // area in space per area in the parameter plane
};
SurfaceJet evaluate(const NurbsSurface& surface, double u, double v);
// The same of the piece on the named spans (knot indices), continued where the point lies outside: one-sided
// derivatives at knots.
SurfaceJet evaluate_on_span(const NurbsSurface& surface, int span_u, int span_v, double u, double v);

// The nonzero (rational) surface functions at a parameter with first and second derivatives.
// Row r of `value` holds N, N_u, N_v, N_uu, N_uv, N_vv; entry a + (p_u+1) b belongs to control point
// (first_u + a, first_v + b). Row 0 sums to 1, the others to 0. Degrees above 7 throw GeometryError.
struct SurfaceBasis {
  static constexpr int capacity = 64;
  int first_u = 0, first_v = 0;
  int count_u = 0, count_v = 0;
  std::array<std::array<double, capacity>, 6> value;
  int size() const { return count_u * count_v; }
};
// The point is evaluated on the span that holds it; with spans named (knot indices), on those.
void evaluate_basis(const NurbsSurface& surface, double u, double v, SurfaceBasis& out);
void evaluate_basis_on_span(const NurbsSurface& surface, int span_u, int span_v, double u, double v, SurfaceBasis& out);

}  // namespace toile
