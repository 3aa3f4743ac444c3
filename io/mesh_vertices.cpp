// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/mesh_vertices.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "io/pattern_sheet.h"

namespace toile {

namespace {

using Eigen::Vector2d;

// A pattern's box on the common sheet.
struct Piece {
  const NurbsSurface* flat = nullptr;
  Eigen::AlignedBox2d box;
  Vector2d at{0, 0};  // of its lower left corner in the layout
};

// Rows of pieces, the tallest first, none wider than `width`. Returns the layout's size.
Vector2d lay_rows(std::vector<Piece>& pieces, const std::vector<std::size_t>& order, double width, double gap) {
  Vector2d at(0, 0), size(0, 0);
  double row = 0;
  for (const std::size_t k : order) {
    const Vector2d box = pieces[k].box.sizes();
    if (at.x() > 0 && at.x() + box.x() > width) at = {0, at.y() + row + gap}, row = 0;
    pieces[k].at = at;
    size = size.cwiseMax(at + box);
    row = std::max(row, box.y());
    at.x() += box.x() + gap;
  }
  return size;
}

// Lays the pieces out in about a square; returns the length of its side.
double lay_out(std::vector<Piece>& pieces) {
  std::vector<std::size_t> order(pieces.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t k) { return -pieces[k].box.sizes().y(); });
  double area = 0, widest = 0;
  for (const Piece& piece : pieces) {
    area += piece.box.volume();
    widest = std::max(widest, piece.box.sizes().x());
  }
  const double gap = pieces.size() > 1 ? 0.01 * std::sqrt(area) : 0;
  double best_width = widest, best = std::numeric_limits<double>::infinity();
  for (int k = 0; k <= 16; ++k) {
    const double width = std::max(widest, (1 + k / 16.0) * std::sqrt(area));
    const double side = lay_rows(pieces, order, width, gap).maxCoeff();
    if (side < best) best = side, best_width = width;
  }
  return lay_rows(pieces, order, best_width, gap).maxCoeff();
}

const NurbsSurface* pattern_of(const FramePanel& panel) {
  return panel.flat ? panel.flat : panel.surface;
}

}  // namespace

std::vector<std::vector<Vector2d>> pattern_coordinates(const Frame& frame) {
  std::vector<Piece> pieces;
  std::vector<std::size_t> piece_of;
  std::vector<std::vector<Vector2d>> out;
  for (const FramePanel& panel : frame.panels) {
    const PatternSheet sheet(*pattern_of(panel));
    const auto found = std::ranges::find(pieces, pattern_of(panel), &Piece::flat);
    piece_of.push_back(static_cast<std::size_t>(found - pieces.begin()));
    if (found == pieces.end()) pieces.push_back({pattern_of(panel), {}});
    std::vector<Vector2d>& coordinates = out.emplace_back();
    for (const Vector2d& uv : panel.triangles->uv) {
      coordinates.push_back(sheet(uv));
      pieces[piece_of.back()].box.extend(coordinates.back());
    }
  }
  for (Piece& piece : pieces)
    if (piece.box.isEmpty()) piece.box.extend(Vector2d(0, 0));
  const double side = lay_out(pieces);
  const double scale = side > 0 ? 1 / side : 0;
  for (std::size_t k = 0; k < out.size(); ++k) {
    const Piece& piece = pieces[piece_of[k]];
    for (Vector2d& x : out[k]) x = (scale * (piece.at + x - piece.box.min())).cwiseMax(0).cwiseMin(1);
  }
  return out;
}

std::vector<MeshVertices> mesh_vertices(const Frame& frame) {
  std::vector<std::vector<Vector2d>> texture = pattern_coordinates(frame);
  std::vector<MeshVertices> out(frame.panels.size());
  for (std::size_t k = 0; k < out.size(); ++k) {
    for (const Vector2d& uv : frame.panels[k].triangles->uv) {
      const SurfaceJet jet = evaluate(*frame.panels[k].surface, uv.x(), uv.y());
      const Eigen::Vector3d normal = jet.u.cross(jet.v).stableNormalized();
      out[k].position.push_back(jet.x);
      out[k].normal.push_back(normal.norm() > 0.5 ? normal : Eigen::Vector3d(0, 0, 1));
    }
    out[k].texture = std::move(texture[k]);
  }
  return out;
}

}  // namespace toile
