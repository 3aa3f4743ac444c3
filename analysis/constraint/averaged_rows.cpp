// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/constraint/averaged_rows.h"

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <string>

#include "geometry/error.h"
#include "geometry/text.h"

namespace toile {
namespace {

// Sums rows of functions, entry by entry.
struct RowSum {
  std::map<int, double> entries;
  void add(const MaterialPoint& point, int which, double factor) {
    for (std::size_t k = 0; k < point.index.size(); ++k) entries[point.index[k]] += factor * point.value[which][k];
  }
  ScalarRow over(double length) const {
    ScalarRow row;
    for (const auto& [i, value] : entries) {
      if (value == 0) continue;
      row.index.push_back(i);
      row.value.push_back(value / length);
    }
    return row;
  }
};

// Of the cloth at a quadrature point.
double area_at(const ClothPanel& panel, int point) {
  const Eigen::Vector2d& uv = panel.quadrature.points[point];
  return panel.quadrature.weights[point] * evaluate(panel.rest, uv.x(), uv.y()).area_scale();
}

double material_area(const ClothPanel& panel, const CellRule& cell) {
  double area = 0;
  for (int k = cell.first; k < cell.first + cell.count; ++k) area += area_at(panel, k);
  return area;
}

std::vector<StrainRow> cell_averages(const Body& body, int index) {
  const ClothPanel& panel = body.panels()[index];
  std::vector<StrainRow> rows;
  for (const CellRule& cell : panel.quadrature.cells) {
    RowSum sums[2];
    double area = 0;
    Eigen::Vector2d middle(0, 0);
    for (int k = cell.first; k < cell.first + cell.count; ++k) {
      const Eigen::Vector2d& uv = panel.quadrature.points[k];
      const double weight = area_at(panel, k);
      const MaterialPoint point = body.material_point(index, uv.x(), uv.y());
      for (int d : {0, 1}) sums[d].add(point, 1 + d, weight);
      area += weight;
      middle += weight * uv;
    }
    middle /= area;
    for (int d : {0, 1}) {
      const double length = apply(sums[d].over(1), body.rest()).norm();
      rows.push_back({sums[d].over(length), index, -1, d == 1, area, 0, middle, Eigen::Vector2d::Unit(d)});
    }
  }
  return rows;
}

std::vector<StrainRow> springs(const Body& body, int index, const TrimTopology& topology, const Closure& closure,
                               bool diagonals) {
  const ClothPanel& panel = body.panels()[index];
  const KnotMesh& mesh = topology.mesh;
  const int nu = mesh.cells_u(), nv = mesh.cells_v();
  std::vector<double> cloth(static_cast<std::size_t>(nu) * nv, 0);
  for (const CellRule& cell : panel.quadrature.cells) cloth[mesh.cell(cell.i, cell.j)] = material_area(panel, cell);
  // Of cell (i, j); beyond a closed surface's seam the one at the other end, beyond an open edge nothing.
  const auto cloth_of = [&](int i, int j) {
    if (closure.u) i = (i + nu) % nu;
    if (closure.v) j = (j + nv) % nv;
    return i < 0 || j < 0 || i >= nu || j >= nv ? 0.0 : cloth[mesh.cell(i, j)];
  };
  const auto there = [&](int i, int j) { return topology.vertices[mesh.vertex(i, j)] != VertexKind::outside; };
  std::vector<StrainRow> rows;
  const auto add = [&](int ai, int aj, int bi, int bj, double area) {
    if (area == 0 || !there(ai, aj) || !there(bi, bj)) return;
    RowSum sum;
    sum.add(body.material_point(index, mesh.u[bi], mesh.v[bj]), 0, 1);
    sum.add(body.material_point(index, mesh.u[ai], mesh.v[aj]), 0, -1);
    const Eigen::Vector3d along = apply(sum.over(1), body.rest());
    const double length = along.norm();
    if (!(length > 0))
      throw GeometryError("panel '" + panel.name + "': a spring between (u, v) = (" + text(mesh.u[ai]) + ", " +
                          text(mesh.v[aj]) + ") and the next knot vertex has no length");
    const Eigen::Vector2d middle(0.5 * (mesh.u[ai] + mesh.u[bi]), 0.5 * (mesh.v[aj] + mesh.v[bj]));
    const MaterialPoint frame = body.material_point(index, middle.x(), middle.y());
    Eigen::Vector2d thread;
    for (int d : {0, 1}) {
      RowSum tangent;
      tangent.add(frame, 1 + d, 1);
      thread[d] = apply(tangent.over(1), body.rest()).dot(along);
    }
    thread.normalize();
    rows.push_back({sum.over(length), index, -1, std::abs(thread[1]) > std::abs(thread[0]), area, 0, middle, thread});
  };
  for (int j = 0; j <= nv - (closure.v ? 1 : 0); ++j)
    for (int i = 0; i < nu; ++i) add(i, j, i + 1, j, 0.5 * (cloth_of(i, j - 1) + cloth_of(i, j)));
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i <= nu - (closure.u ? 1 : 0); ++i)
      add(i, j, i, j + 1, 0.5 * (cloth_of(i - 1, j) + cloth_of(i, j)));
  if (!diagonals) return rows;
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i) {
      const bool rising = (i + j) % 2 == 0;
      add(i, rising ? j : j + 1, i + 1, rising ? j + 1 : j, cloth_of(i, j));
    }
  return rows;
}

}  // namespace

std::vector<StrainRow> averaged_rows(const Body& body, int panel, const TrimTopology& topology, const Closure& closure,
                                     PointRule rule) {
  if (rule == PointRule::cell_average) return cell_averages(body, panel);
  if (rule == PointRule::springs_quad) return springs(body, panel, topology, closure, false);
  if (rule == PointRule::springs_triangle) return springs(body, panel, topology, closure, true);
  return {};
}

}  // namespace toile
