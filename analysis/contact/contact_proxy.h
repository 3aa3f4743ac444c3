// SPDX-License-Identifier: GPL-3.0-or-later
// The cloth as contact sees it: points of the material and flat triangles between them. Contact knows no model.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "analysis/constraint/composed_rows.h"
#include "analysis/map/affine_map.h"
#include "analysis/model/body.h"
#include "trimming/cell_triangles.h"

namespace toile {

class Workers;

struct ProxyPanel {
  CellTriangles mesh;
  double half_thickness = 0;  // m, of the cloth
  double friction = 0.3;      // of the cloth
};

//   (1) a vertex is a material point: a row of weights on nodes and fixed control points, which sum to 1;
//   (2) no triangle crosses a knot line, so that its vertices depend on the control points of one cell.
class ContactProxy {
 public:
  // Panels as those of the body, in order. Throws SolverError where their numbers differ.
  ContactProxy(const Body& body, const AffineMap& map, const Eigen::VectorXd& node_mass,
               const std::vector<ProxyPanel>& panels);

  int vertices() const { return static_cast<int>(panel_.size()); }
  const std::vector<std::array<int, 3>>& triangles() const { return triangles_; }
  const std::vector<int>& cells() const { return cells_; }                 // knot cell of each triangle, on its panel
  const std::vector<std::array<int, 2>>& edges() const { return edges_; }  // ascending
  int panel(int vertex) const { return panel_[static_cast<std::size_t>(vertex)]; }
  const Eigen::Vector2d& uv(int vertex) const { return uv_[static_cast<std::size_t>(vertex)]; }
  double half_thickness(int vertex) const { return half_thickness_[static_cast<std::size_t>(panel(vertex))]; }
  double friction(int vertex) const { return friction_[static_cast<std::size_t>(panel(vertex))]; }
  const ComposedRows& rows() const { return rows_; }  // of the vertices, over nodes and fixed control points
  const ScalarRow& points(int vertex) const { return points_[static_cast<std::size_t>(vertex)]; }  // over the body's
  const Eigen::VectorXd& inverse_mass() const { return inverse_mass_; }                            // 1/kg per node

  void positions(const Eigen::Ref<const Eigen::VectorXd>& x, const Eigen::Matrix3Xd& fixed_places,
                 Eigen::Matrix3Xd& out, Workers* workers = nullptr) const;
  // How far the material bulges from the flat triangles around a vertex against `normal` at most [m]: spacing times the
  // angle between neighbouring triangles over 8, of the edges that meet there.
  double chord_error(int vertex, const Eigen::Matrix3Xd& positions, const Eigen::Vector3d& normal) const;
  std::span<const int> neighbours(int vertex) const;  // by edges

 private:
  std::vector<std::array<int, 3>> triangles_;
  std::vector<int> cells_;
  std::vector<std::array<int, 2>> edges_;
  std::vector<std::array<int, 2>> opposite_;              // per edge the vertices across, -1 at a border
  std::vector<int> edges_start_, edges_at_, neighbours_;  // per vertex
  std::vector<int> panel_;
  std::vector<Eigen::Vector2d> uv_;
  std::vector<double> half_thickness_, friction_;  // per panel
  std::vector<ScalarRow> points_;
  ComposedRows rows_;
  Eigen::VectorXd inverse_mass_;
};

}  // namespace toile
