// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/polyline.h"

#include <algorithm>

namespace toile {

namespace {

struct Chord {
  double t = 0;
  Eigen::Vector3d x;
};

double distance_to_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d d = b - a;
  const double length_squared = d.squaredNorm();
  const double s = length_squared > 0 ? std::clamp((p - a).dot(d) / length_squared, 0.0, 1.0) : 0.0;
  return (p - a - s * d).norm();
}

template <class Evaluate>
void split(const Evaluate& at, const Chord& a, const Chord& b, double tolerance, int depth, int least_depth,
           std::vector<double>& out) {
  constexpr int deepest = 12;
  const double middle = a.t + (b.t - a.t) / 2;
  const Chord m{middle, at(middle)};
  bool flat = depth >= least_depth;
  for (const double s : {0.25, 0.5, 0.75})
    flat = flat && distance_to_segment(at(a.t + s * (b.t - a.t)), a.x, b.x) <= tolerance;
  if (flat || depth == deepest) {
    out.push_back(b.t);
    return;
  }
  split(at, a, m, tolerance, depth + 1, least_depth, out);
  split(at, m, b, tolerance, depth + 1, least_depth, out);
}

}  // namespace

std::vector<double> polyline_parameters(const NurbsSurface& surface, const TrimCurve& curve, double chord) {
  const auto at = [&](double t) {
    const Eigen::Vector2d p = curve.curve(t);
    return surface(p[0], p[1]);
  };
  const Eigen::Vector3d size = surface.points().rowwise().maxCoeff() - surface.points().rowwise().minCoeff();
  const std::vector<double> breaks = curve.curve.knots().breaks();
  std::vector<double> out{breaks.front()};
  for (std::size_t k = 0; k + 1 < breaks.size(); ++k)
    split(at, {breaks[k], at(breaks[k])}, {breaks[k + 1], at(breaks[k + 1])}, chord * size.norm(), 0, 3, out);
  if (curve.reversed) std::reverse(out.begin(), out.end());
  return out;
}

std::vector<Eigen::Vector3d> surface_polyline(const NurbsSurface& surface, const TrimCurve& curve, double chord) {
  std::vector<Eigen::Vector3d> out;
  for (const double t : polyline_parameters(surface, curve, chord)) {
    const Eigen::Vector2d p = curve.curve(t);
    out.push_back(surface(p[0], p[1]));
  }
  return out;
}

}  // namespace toile
