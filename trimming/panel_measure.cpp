#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "trimming/cell_boundary.h"
#include "trimming/gauss.h"
#include "trimming/quadrature.h"

namespace toile {
namespace {

using Real = BoundaryBezier::Real;

constexpr double relative_tolerance = 1e-11;

double area_density(const NurbsSurface& surface, double u, double v) {
  const SurfaceJet jet = evaluate(surface, u, v);
  return jet.u.cross(jet.v).norm();
}

double box_area(const NurbsSurface& surface, Interval u, Interval v, int n) {
  const GaussRule& rule = gauss_rule(n);
  double sum = 0;
  for (int b = 0; b < n; ++b)
    for (int a = 0; a < n; ++a)
      sum += rule.w[a] * rule.w[b] *
             area_density(surface, u.min + u.length() * (1 + rule.x[a]) / 2, v.min + v.length() * (1 + rule.x[b]) / 2);
  return sum * u.length() * v.length() / 4;
}

// Gauss of rising order, then quarters.
double box_area_adaptive(const NurbsSurface& surface, Interval u, Interval v, int depth) {
  double before = box_area(surface, u, v, 4);
  for (const int n : {7, 12, 20}) {
    const double area = box_area(surface, u, v, n);
    if (std::abs(area - before) <= relative_tolerance * area) return area;
    before = area;
  }
  if (depth == 0) return before;
  const double um = (u.min + u.max) / 2, vm = (v.min + v.max) / 2;
  return box_area_adaptive(surface, {u.min, um}, {v.min, vm}, depth - 1) +
         box_area_adaptive(surface, {um, u.max}, {v.min, vm}, depth - 1) +
         box_area_adaptive(surface, {u.min, um}, {vm, v.max}, depth - 1) +
         box_area_adaptive(surface, {um, u.max}, {vm, v.max}, depth - 1);
}

// The density interpolated at n x n Gauss points of the material's box, integrated by the material's exact moments.
double cut_area(const NurbsSurface& surface, const CellBoundary& boundary, const BoundaryBox& box, int n) {
  const GaussRule& rule = gauss_rule(n);
  std::vector<Real> moments;
  legendre_moments(boundary.pieces, n - 1, n - 1, moments);
  std::vector<double> legendre(n * n);  // P_k at node q: k + n q
  for (int q = 0; q < n; ++q) {
    legendre[n * q] = 1;
    if (n > 1) legendre[1 + n * q] = rule.x[q];
    for (int k = 2; k < n; ++k)
      legendre[k + n * q] = ((2 * k - 1) * rule.x[q] * legendre[k - 1 + n * q] - (k - 1) * legendre[k - 2 + n * q]) / k;
  }
  // Sum over a, b of coefficient (a, b) times moment (a, b), gathered per node: the weight that the material gives it.
  std::vector<Real> along(n * n, 0);  // summed over a: b + n q
  for (int q = 0; q < n; ++q)
    for (int b = 0; b < n; ++b)
      for (int a = 0; a < n; ++a) along[b + n * q] += Real(2 * a + 1) / 2 * legendre[a + n * q] * moments[a + n * b];
  double area = 0;
  for (int r = 0; r < n; ++r)
    for (int q = 0; q < n; ++q) {
      Real share = 0;
      for (int b = 0; b < n; ++b) share += Real(2 * b + 1) / 2 * legendre[b + n * r] * along[b + n * q];
      const auto u = static_cast<double>(boundary.origin.x() + box.centre_x + box.half_x * rule.node[q]);
      const auto v = static_cast<double>(boundary.origin.y() + box.centre_y + box.half_y * rule.node[r]);
      area += rule.w[q] * rule.w[r] * static_cast<double>(share) *
              area_density(surface, std::clamp(u, boundary.u.min, boundary.u.max),
                           std::clamp(v, boundary.v.min, boundary.v.max));
    }
  return area * static_cast<double>(box.half_x * box.half_y);
}

double cut_area_adaptive(const TrimmedSurface& surface, const KnotMesh& mesh, const CutCell& cell) {
  CellBoundary boundary;
  build_boundary(surface, mesh, cell, boundary);
  if (boundary.pieces.empty()) return 0;
  const BoundaryBox box = box_of(boundary);
  if (!(box.half_x > 0 && box.half_y > 0)) return 0;
  scale_to_box(boundary, box);
  double before = cut_area(surface.surface, boundary, box, 3);
  for (const int n : {5, 8, 12, 16}) {
    const double area = cut_area(surface.surface, boundary, box, n);
    if (std::abs(area - before) <= relative_tolerance * std::abs(area)) return area;
    before = area;
  }
  return before;
}

double speed(const NurbsSurface& surface, const Curve2& curve, double t) {
  const auto [x, d1, d2] = evaluate(curve, t);
  const SurfaceJet jet = evaluate(surface, x.x(), x.y());
  return (jet.u * d1.x() + jet.v * d1.y()).norm();
}

double gauss_length(const NurbsSurface& surface, const Curve2& curve, double t0, double t1) {
  const GaussRule& rule = gauss_rule(10);
  double sum = 0;
  for (int q = 0; q < rule.size(); ++q)
    sum += rule.w[q] * speed(surface, curve, (t0 + t1) / 2 + (t1 - t0) / 2 * rule.x[q]);
  return sum * (t1 - t0) / 2;
}

double length_adaptive(const NurbsSurface& surface, const Curve2& curve, double t0, double t1, double whole,
                       double scale, int depth) {
  const double middle = (t0 + t1) / 2;
  const double left = gauss_length(surface, curve, t0, middle), right = gauss_length(surface, curve, middle, t1);
  if (depth == 0 || std::abs(left + right - whole) <= relative_tolerance * scale) return left + right;
  return length_adaptive(surface, curve, t0, middle, left, scale, depth - 1) +
         length_adaptive(surface, curve, middle, t1, right, scale, depth - 1);
}

}  // namespace

PanelMeasure measure(const TrimmedSurface& surface, const TrimTopology& topology) {
  const KnotMesh& mesh = topology.mesh;
  PanelMeasure result;
  for (int j = 0; j < mesh.cells_v(); ++j)
    for (int i = 0; i < mesh.cells_u(); ++i)
      if (topology.cells[mesh.cell(i, j)] == CellKind::inside)
        result.area += box_area_adaptive(surface.surface, {mesh.u[i], mesh.u[i + 1]}, {mesh.v[j], mesh.v[j + 1]}, 4);
  for (const CutCell& cell : topology.cut_cells) result.area += cut_area_adaptive(surface, mesh, cell);

  for (int l = 0; l < static_cast<int>(surface.loops.size()); ++l) {
    double length = 0;
    for (int k = 0; k < static_cast<int>(surface.loops[l].curves.size()); ++k) {
      // The speed is smooth between the curve's own knots and the surface's knot lines.
      const Curve2& curve = surface.loops[l].curves[k].curve;
      std::vector<double> breaks = curve.knots().breaks();
      for (const TrimEvent& event : topology.events)
        if (event.loop == l && event.curve == k) breaks.push_back(event.t);
      std::sort(breaks.begin(), breaks.end());
      // A curve along a pole has no length: rounding of the places is what its integrals may differ by.
      double scale = 1e-3 * surface.surface.points().cwiseAbs().maxCoeff();
      for (std::size_t s = 0; s + 1 < breaks.size(); ++s)
        scale += gauss_length(surface.surface, curve, breaks[s], breaks[s + 1]);
      for (std::size_t s = 0; s + 1 < breaks.size(); ++s)
        if (breaks[s] < breaks[s + 1])
          length += length_adaptive(surface.surface, curve, breaks[s], breaks[s + 1],
                                    gauss_length(surface.surface, curve, breaks[s], breaks[s + 1]), scale, 30);
    }
    result.loop_lengths.push_back(length);
  }
  return result;
}

}  // namespace toile
