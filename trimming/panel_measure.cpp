// SPDX-License-Identifier: GPL-3.0-or-later
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "trimming/cell_boundary.h"
#include "trimming/gauss.h"
#include "trimming/quadrature.h"

namespace toile {
namespace {

using Real = BoundaryBezier::Real;

// A rule is taken where the coarser one before it is off by no more than this. Between knot lines the integrands are
// analytic, and Gauss rules converge geometrically: with a third more points, what was 1e-9 is 1e-12, mostly far less.
constexpr double coarse_tolerance = 1e-9;

// |S_u x S_v| at the places (u[a], v[b]) of one knot cell: entry a + u.size() b. Sums run over u first, then over v.
void area_densities(const NurbsSurface& surface, std::span<const double> u, std::span<const double> v,
                    std::vector<double>& out) {
  const std::size_t n_u = u.size(), n_v = v.size();
  const int span_u = surface.u().find_span(u[n_u / 2]), span_v = surface.v().find_span(v[n_v / 2]);
  out.resize(n_u * n_v);
  std::vector<BasisValues> along_v(n_v);
  for (std::size_t b = 0; b < n_v; ++b) evaluate_basis_on_span(surface.v(), span_v, v[b], 1, along_v[b]);
  const int count_v = surface.v().degree() + 1;
  std::array<Eigen::Vector4d, max_degree + 1> row,
      row_u;  // (w x, w y, w z, w) and its u-derivative for each v-function
  BasisValues basis;
  for (std::size_t a = 0; a < n_u; ++a) {
    evaluate_basis_on_span(surface.u(), span_u, u[a], 1, basis);
    for (int j = 0; j < count_v; ++j) {
      row[j].setZero();
      row_u[j].setZero();
      for (int i = 0; i <= basis.degree; ++i) {
        const int k = surface.index(basis.first + i, along_v[0].first + j);
        const double w = surface.weight(k);
        Eigen::Vector4d p;
        p << w * surface.points().col(k), w;
        row[j] += basis.value[0][i] * p;
        row_u[j] += basis.value[1][i] * p;
      }
    }
    for (std::size_t b = 0; b < n_v; ++b) {
      Eigen::Vector4d p_u = Eigen::Vector4d::Zero(), p_v = p_u;
      for (int j = 0; j < count_v; ++j) {
        p_u += along_v[b].value[0][j] * row_u[j];
        p_v += along_v[b].value[1][j] * row[j];
      }
      Eigen::Vector3d x_u = p_u.head<3>(), x_v = p_v.head<3>();
      if (surface.rational()) {
        Eigen::Vector4d p = Eigen::Vector4d::Zero();
        for (int j = 0; j < count_v; ++j) p += along_v[b].value[0][j] * row[j];
        const Eigen::Vector3d x = p.head<3>() / p.w();
        x_u = (x_u - p_u.w() * x) / p.w();
        x_v = (x_v - p_v.w() * x) / p.w();
      } else {
        const double w = surface.weight(0);
        x_u /= w;
        x_v /= w;
      }
      out[a + n_u * b] = x_u.cross(x_v).norm();
    }
  }
}

std::vector<double> places(Interval range, const GaussRule& rule) {
  std::vector<double> out(rule.size());
  for (int q = 0; q < rule.size(); ++q) out[q] = range.min + range.length() * (1 + rule.x[q]) / 2;
  return out;
}

double box_area(const NurbsSurface& surface, Interval u, Interval v, int n, std::vector<double>& density) {
  const GaussRule& rule = gauss_rule(n);
  area_densities(surface, places(u, rule), places(v, rule), density);
  double sum = 0;
  for (int b = 0; b < n; ++b)
    for (int a = 0; a < n; ++a) sum += rule.w[a] * rule.w[b] * density[a + n * b];
  return sum * u.length() * v.length() / 4;
}

// Gauss of rising order, then quarters.
double box_area_adaptive(const NurbsSurface& surface, Interval u, Interval v, int depth, std::vector<double>& density) {
  double before = box_area(surface, u, v, 4, density);
  for (const int n : {7, 12, 20}) {
    const double area = box_area(surface, u, v, n, density);
    if (std::abs(area - before) <= coarse_tolerance * area) return area;
    before = area;
  }
  if (depth == 0) return before;
  const double um = (u.min + u.max) / 2, vm = (v.min + v.max) / 2;
  double sum = 0;
  for (const Interval half_u : {Interval{u.min, um}, Interval{um, u.max}})
    for (const Interval half_v : {Interval{v.min, vm}, Interval{vm, v.max}})
      sum += box_area_adaptive(surface, half_u, half_v, depth - 1, density);
  return sum;
}

// The density interpolated at n x n Gauss points of the material's box, integrated by the material's exact moments,
// `stride` of them in a row.
double cut_area(const NurbsSurface& surface, const CellBoundary& boundary, const BoundaryBox& box,
                const std::vector<Real>& moments, int stride, int n, std::vector<double>& density) {
  const GaussRule& rule = gauss_rule(n);
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
      for (int a = 0; a < n; ++a)
        along[b + n * q] += Real(2 * a + 1) / 2 * legendre[a + n * q] * moments[a + stride * b];
  std::vector<double> us(n), vs(n);
  for (int q = 0; q < n; ++q) {
    const auto u = static_cast<double>(boundary.origin.x() + box.centre_x + box.half_x * rule.node[q]);
    const auto v = static_cast<double>(boundary.origin.y() + box.centre_y + box.half_y * rule.node[q]);
    us[q] = std::clamp(u, boundary.u.min, boundary.u.max);
    vs[q] = std::clamp(v, boundary.v.min, boundary.v.max);
  }
  area_densities(surface, us, vs, density);
  double area = 0;
  for (int r = 0; r < n; ++r)
    for (int q = 0; q < n; ++q) {
      Real share = 0;
      for (int b = 0; b < n; ++b) share += Real(2 * b + 1) / 2 * legendre[b + n * r] * along[b + n * q];
      area += rule.w[q] * rule.w[r] * static_cast<double>(share) * density[q + n * r];
    }
  return area * static_cast<double>(box.half_x * box.half_y);
}

double cut_area_adaptive(const TrimmedSurface& surface, const KnotMesh& mesh, const CutCell& cell,
                         std::vector<double>& density) {
  CellBoundary boundary;
  build_boundary(surface, mesh, cell, boundary);
  if (boundary.pieces.empty()) return 0;
  const BoundaryBox box = box_of(boundary);
  if (!(box.half_x > 0 && box.half_y > 0)) return 0;
  scale_to_box(boundary, box);
  std::vector<Real> moments;
  double before = 0;
  // Two rules share the first moments.
  for (const int n : {5, 8, 12, 16}) {
    const int stride = std::max(n, 8);
    if (n != 8) legendre_moments(boundary.pieces, stride - 1, stride - 1, moments);
    const double area = cut_area(surface.surface, boundary, box, moments, stride, n, density);
    if (n > 5 && std::abs(area - before) <= coarse_tolerance * std::abs(area)) return area;
    before = area;
  }
  return before;
}

double speed(const NurbsSurface& surface, const Curve2& curve, double t) {
  const auto [x, d1, d2] = evaluate(curve, t);
  const SurfaceJet jet = evaluate(surface, x.x(), x.y());
  return (jet.u * d1.x() + jet.v * d1.y()).norm();
}

double gauss_length(const NurbsSurface& surface, const Curve2& curve, Interval t, int n) {
  const GaussRule& rule = gauss_rule(n);
  double sum = 0;
  for (int q = 0; q < n; ++q) sum += rule.w[q] * speed(surface, curve, t.min + t.length() * (1 + rule.x[q]) / 2);
  return sum * t.length() / 2;
}

// `coarse`: by 6 points. Then 10, then halves.
double length_adaptive(const NurbsSurface& surface, const Curve2& curve, Interval t, double coarse, double scale,
                       int depth) {
  const double fine = gauss_length(surface, curve, t, 10);
  if (depth == 0 || std::abs(fine - coarse) <= coarse_tolerance * scale) return fine;
  const double middle = (t.min + t.max) / 2;
  double sum = 0;
  for (const Interval half : {Interval{t.min, middle}, Interval{middle, t.max}})
    sum += length_adaptive(surface, curve, half, gauss_length(surface, curve, half, 6), scale, depth - 1);
  return sum;
}

// Where each curve of each loop meets knot lines, in one pass.
std::vector<std::vector<std::vector<double>>> event_parameters(const TrimmedSurface& surface,
                                                               const TrimTopology& topology) {
  std::vector<std::vector<std::vector<double>>> out;
  for (const TrimLoop& loop : surface.loops) out.emplace_back(loop.curves.size());
  for (const TrimEvent& event : topology.events) out[event.loop][event.curve].push_back(event.t);
  return out;
}

}  // namespace

PanelMeasure measure(const TrimmedSurface& surface, const TrimTopology& topology) {
  const KnotMesh& mesh = topology.mesh;
  PanelMeasure result;
  std::vector<double> density;  // of the cell in hand
  for (int j = 0; j < mesh.cells_v(); ++j)
    for (int i = 0; i < mesh.cells_u(); ++i)
      if (topology.cells[mesh.cell(i, j)] == CellKind::inside)
        result.area +=
            box_area_adaptive(surface.surface, {mesh.u[i], mesh.u[i + 1]}, {mesh.v[j], mesh.v[j + 1]}, 4, density);
  for (const CutCell& cell : topology.cut_cells) result.area += cut_area_adaptive(surface, mesh, cell, density);

  const std::vector<std::vector<std::vector<double>>> events = event_parameters(surface, topology);
  for (int l = 0; l < static_cast<int>(surface.loops.size()); ++l) {
    double length = 0;
    for (int k = 0; k < static_cast<int>(surface.loops[l].curves.size()); ++k) {
      // The speed is smooth between the curve's own knots and the surface's knot lines.
      const Curve2& curve = surface.loops[l].curves[k].curve;
      std::vector<double> breaks = curve.knots().breaks();
      breaks.insert(breaks.end(), events[l][k].begin(), events[l][k].end());
      std::sort(breaks.begin(), breaks.end());
      std::vector<double> coarse;
      // A curve along a pole has no length: rounding of the places is what its integrals may differ by.
      double scale = 1e-3 * surface.surface.points().cwiseAbs().maxCoeff();
      for (std::size_t s = 0; s + 1 < breaks.size(); ++s)
        scale += coarse.emplace_back(gauss_length(surface.surface, curve, {breaks[s], breaks[s + 1]}, 6));
      for (std::size_t s = 0; s + 1 < breaks.size(); ++s)
        if (breaks[s] < breaks[s + 1])
          length += length_adaptive(surface.surface, curve, {breaks[s], breaks[s + 1]}, coarse[s], scale, 30);
    }
    result.loop_lengths.push_back(length);
  }
  return result;
}

}  // namespace toile
