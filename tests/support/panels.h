// SPDX-License-Identifier: GPL-3.0-or-later
// Panels for tests of mechanics, without trims or with straight ones along the parameter axes.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

#include "analysis/shell/shell_model.h"
#include "geometry/nurbs_surface.h"
#include "geometry/trimmed_surface.h"
#include "trimming/quadrature.h"

namespace toile::test {

// Numbers in [-1, 1) that are the same on every machine. [splitmix64, Steele et al. 2014]
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  double operator()() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ull);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1.0p-52 - 1.0;
  }
  Eigen::VectorXd vector(Eigen::Index n) {
    Eigen::VectorXd v(n);
    for (double& x : v) x = (*this)();
    return v;
  }

 private:
  std::uint64_t state_;
};

// Weight of every point of a body [N], 3 n.
inline Eigen::VectorXd weight_of(const Body& body, const Eigen::Vector3d& gravity) {
  Eigen::VectorXd force(3 * body.point_count());
  for (int i = 0; i < body.point_count(); ++i) force.segment<3>(3 * i) = body.lumped_mass()[i] * gravity;
  return force;
}

// n-point Gauss-Legendre abscissae and weights on [-1, 1], by Newton on the Legendre polynomial.
inline std::vector<std::pair<double, double>> gauss_rule(int n) {
  std::vector<std::pair<double, double>> rule;
  for (int i = 0; i < n; ++i) {
    double x = -std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5)), slope = 1;
    for (int iteration = 0; iteration < 20; ++iteration) {
      double p0 = 1, p1 = x;
      for (int k = 2; k <= n; ++k) p0 = std::exchange(p1, ((2 * k - 1) * x * p1 - (k - 1) * p0) / k);
      slope = n * (x * p1 - p0) / (x * x - 1);
      x -= p1 / slope;
    }
    rule.emplace_back(x, 2 / ((1 - x * x) * slope * slope));
  }
  return rule;
}

// Gauss points on every cell, or on the part of every cell that lies in the rectangle `material` of the parameter
// plane; `points` per direction, 0: degree + 1.
inline CutQuadrature tensor_quadrature(const NurbsSurface& surface, std::array<Interval, 2> material, int points = 0) {
  const std::vector<double> u = surface.u().breaks(), v = surface.v().breaks();
  const auto rule_u = gauss_rule(points > 0 ? points : surface.u().degree() + 1);
  const auto rule_v = gauss_rule(points > 0 ? points : surface.v().degree() + 1);
  CutQuadrature out;
  for (std::size_t j = 0; j + 1 < v.size(); ++j)
    for (std::size_t i = 0; i + 1 < u.size(); ++i) {
      const double u0 = std::max(u[i], material[0].min), u1 = std::min(u[i + 1], material[0].max);
      const double v0 = std::max(v[j], material[1].min), v1 = std::min(v[j + 1], material[1].max);
      if (!(u0 < u1 && v0 < v1)) continue;
      CellRule cell{static_cast<int>(i), static_cast<int>(j), static_cast<int>(out.points.size())};
      cell.area = (u1 - u0) * (v1 - v0);
      cell.cut_fraction = cell.area / ((u[i + 1] - u[i]) * (v[j + 1] - v[j]));
      cell.tensor = u0 == u[i] && u1 == u[i + 1] && v0 == v[j] && v1 == v[j + 1];
      for (const auto& [y, wy] : rule_v)
        for (const auto& [x, wx] : rule_u) {
          out.points.emplace_back(u0 + (u1 - u0) * (1 + x) / 2, v0 + (v1 - v0) * (1 + y) / 2);
          out.weights.push_back(cell.area * wx * wy / 4);
        }
      cell.count = static_cast<int>(out.points.size()) - cell.first;
      out.cells.push_back(cell);
      out.area += cell.area;
    }
  return out;
}
inline CutQuadrature tensor_quadrature(const NurbsSurface& surface, int points = 0) {
  return tensor_quadrature(surface, {surface.u().domain(), surface.v().domain()}, points);
}

// The rectangle [0, width] x [0, height] of the plane z = 0: u runs along x, v along y, control points at Greville
// abscissae.
inline NurbsSurface flat_surface(double width, double height, KnotVector u, KnotVector v) {
  Eigen::Matrix3Xd points(3, u.control_point_count() * v.control_point_count());
  for (int j = 0; j < v.control_point_count(); ++j)
    for (int i = 0; i < u.control_point_count(); ++i)
      points.col(i + u.control_point_count() * j) << width * (u.greville(i) - u.domain().min) / u.domain().length(),
          height * (v.greville(j) - v.domain().min) / v.domain().length(), 0;
  return {std::move(u), std::move(v), points};
}

// A unit square about the origin of the plane z = 0 as a trim, in a square surface of edge `size` whose net is turned
// by `angle` [rad]. Curves 0 to 3 run from corner (-1/2, -1/2) counter-clockwise.
inline TrimmedSurface turned_square(int degree, int spans, double size, double angle) {
  const KnotVector knots = uniform_knots(degree, spans, {-size / 2, size / 2});
  const NurbsSurface flat = flat_surface(size, size, knots, knots);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  TrimmedSurface face;
  face.surface = flat.with_points(turn * (flat.points().colwise() - Eigen::Vector3d(size / 2, size / 2, 0)));
  const Eigen::Vector2d corners[] = {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}};
  const Eigen::Rotation2Dd back(-angle);
  TrimLoop loop;
  for (int k = 0; k < 4; ++k) {
    loop.curves.push_back({line_segment<2>(back * corners[k], back * corners[(k + 1) % 4]), k, false, {}});
  }
  face.loops = {std::move(loop)};
  return face;
}

inline ClothPanel make_panel(NurbsSurface rest, const Fabric& fabric = {}, double grain = 0) {
  ClothPanel panel{"panel", std::move(rest), {}, fabric, grain};
  panel.quadrature = tensor_quadrature(panel.rest);
  return panel;
}

inline ClothPanel make_flat_panel(double width, double height, int degree, int spans_u, int spans_v,
                                  const Fabric& fabric = {}, double grain = 0) {
  return make_panel(flat_surface(width, height, uniform_knots(degree, spans_u), uniform_knots(degree, spans_v)), fabric,
                    grain);
}

// Exact rational cylinder: u runs along the arc (angle < pi) from the lowest line of the cylinder, v along the axis y;
// the normal points to the axis, so that the curvature along u is 1 / radius.
inline NurbsSurface cylinder_surface(double radius, double angle, double length, int spans_u, int spans_v) {
  KnotVector u = uniform_knots(2, spans_u), v = uniform_knots(2, spans_v);
  const double w = std::cos(angle / 2), half = radius * std::tan(angle / 2);
  const Eigen::Vector3d ends[3] = {
      {0, 0, 1}, {w * half, 0, w}, {radius * std::sin(angle), radius * (1 - std::cos(angle)), 1}};  // w x, w z, w
  const auto blossom = [&](double a, double b) -> Eigen::Vector3d {
    return (1 - b) * ((1 - a) * ends[0] + a * ends[1]) + b * ((1 - a) * ends[1] + a * ends[2]);
  };
  Eigen::Matrix3Xd points(3, u.control_point_count() * v.control_point_count());
  std::vector<double> weights;
  for (int j = 0; j < v.control_point_count(); ++j)
    for (int i = 0; i < u.control_point_count(); ++i) {
      const Eigen::Vector3d h = blossom(u[i + 1], u[i + 2]);
      points.col(i + u.control_point_count() * j) << h[0] / h[2], length * v.greville(j), h[1] / h[2];
      weights.push_back(h[2]);
    }
  return {std::move(u), std::move(v), points, weights};
}

// A curved, skewed, rational piece of surface about 1 m across, with nothing special about it.
inline NurbsSurface bumpy_surface(int degree, int spans_u, int spans_v, bool rational, std::uint64_t seed = 1) {
  NurbsSurface flat =
      flat_surface(1.0, 0.8, uniform_knots(degree, spans_u, {-1, 2}), uniform_knots(degree, spans_v, {0, 0.5}));
  Random random(seed);
  Eigen::Matrix3Xd points = flat.points();
  const double step = 0.2 / std::max(spans_u, spans_v);
  std::vector<double> weights;
  for (int k = 0; k < points.cols(); ++k) {
    const double x = points(0, k), y = points(1, k);
    points.col(k) += Eigen::Vector3d(0.3 * y, 0, 0.25 * x * x - 0.2 * x * y + 0.1 * std::sin(4 * y));
    points.col(k) += step * Eigen::Vector3d(random(), random(), random());
    if (rational) weights.push_back(std::exp(0.5 * random()));
  }
  return {flat.u(), flat.v(), points, weights};
}

}  // namespace toile::test
