// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/cell_triangles.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "geometry/error.h"
#include "geometry/finite.h"
#include "trimming/delaunay.h"
#include "trimming/text.h"

namespace toile {
namespace {

using Eigen::Vector2d;

constexpr double most_triangles = 4e6;
constexpr double clearance = 0.4;  // of the spacing: lattice points nearer to a trim's vertex are left out

class CellMesher {
 public:
  CellMesher(const TrimmedSurface& surface, const TrimTopology& topology, std::pair<int, int> divisions)
      : surface_(surface), topology_(topology), nu_(divisions.first), nv_(divisions.second) {
    if (nu_ < 1 || nv_ < 1) throw GeometryError(place_name(surface) + ": cells need at least one division");
    const double all = 2.0 * nu_ * nv_ * static_cast<double>(topology.cells.size());
    if (!(all < most_triangles))
      throw GeometryError(place_name(surface) + ": the triangles of its cells would be " + text(all));
  }

  CellTriangles run() {
    const KnotMesh& mesh = topology_.mesh;
    std::size_t cut = 0;
    for (int j = 0; j < mesh.cells_v(); ++j)
      for (int i = 0; i < mesh.cells_u(); ++i) {
        cell_ = mesh.cell(i, j);
        i_ = i;
        j_ = j;
        const CellKind kind = topology_.cells[static_cast<std::size_t>(cell_)];
        if (kind == CellKind::inside) fill();
        if (kind == CellKind::cut) triangulate(topology_.cut_cells[cut++]);
      }
    return std::move(out_);
  }

 private:
  double lattice(const std::vector<double>& knots, int cell, int k, int divisions) const {
    const double from = knots[static_cast<std::size_t>(cell)], to = knots[static_cast<std::size_t>(cell) + 1];
    return k == divisions ? to : from + (to - from) * k / divisions;
  }
  double u(int k) const { return lattice(topology_.mesh.u, i_, k, nu_); }
  double v(int k) const { return lattice(topology_.mesh.v, j_, k, nv_); }

  int vertex(const Vector2d& uv) {
    const auto [at, added] = number_.try_emplace({uv.x(), uv.y()}, static_cast<int>(out_.uv.size()));
    if (added) out_.uv.push_back(uv);
    return at->second;
  }
  void add(int a, int b, int c) {
    out_.triangles.push_back({a, b, c});
    out_.cell.push_back(cell_);
  }

  void fill() {
    for (int b = 0; b < nv_; ++b)
      for (int a = 0; a < nu_; ++a) {
        const int p = vertex({u(a), v(b)}), q = vertex({u(a + 1), v(b)}), r = vertex({u(a + 1), v(b + 1)}),
                  s = vertex({u(a), v(b + 1)});
        // Diagonals alternate, so that no direction of the cloth is preferred.
        if ((a + b) % 2 == 0) {
          add(p, q, r);
          add(p, r, s);
        } else {
          add(p, q, s);
          add(q, r, s);
        }
      }
  }

  // A cell's coordinates in units of its lattice.
  Vector2d scaled(const Vector2d& uv) const {
    return {(uv.x() - u(0)) / (u(nu_) - u(0)) * nu_, (uv.y() - v(0)) / (v(nv_) - v(0)) * nv_};
  }

  // Vertices of a piece from its start on, its end left out.
  void divide(const BoundaryPiece& piece, std::vector<Vector2d>& chain) const {
    chain.push_back(piece.from);
    if (piece.loop < 0) {
      const bool along_u = piece.from.y() == piece.to.y();
      const int axis = along_u ? 0 : 1, n = along_u ? nu_ : nv_;
      const double from = piece.from[axis], to = piece.to[axis];
      for (int step = 1; step < n; ++step) {
        const int k = from < to ? step : n - step;
        const double x = along_u ? u(k) : v(k);
        if (!(std::min(from, to) < x && x < std::max(from, to))) continue;
        Vector2d between = piece.from;
        between[axis] = x;
        chain.push_back(between);
      }
      return;
    }
    const Curve2& curve =
        surface_.loops[static_cast<std::size_t>(piece.loop)].curves[static_cast<std::size_t>(piece.curve)].curve;
    std::vector<double> stops{piece.t0};
    for (const double knot : curve.knots().breaks())
      if (std::min(piece.t0, piece.t1) < knot && knot < std::max(piece.t0, piece.t1)) stops.push_back(knot);
    if (piece.t0 > piece.t1) std::sort(stops.begin(), stops.end(), std::greater<>());
    stops.push_back(piece.t1);
    for (std::size_t s = 0; s + 1 < stops.size(); ++s) {
      const auto at = [&](double share) { return curve(stops[s] + share * (stops[s + 1] - stops[s])); };
      constexpr int samples = 8;
      double length = 0;
      for (int k = 0; k < samples; ++k)
        length += (scaled(at((k + 1.0) / samples)) - scaled(at(static_cast<double>(k) / samples))).norm();
      const int parts = std::max(1, static_cast<int>(std::ceil(length - 1e-9)));
      for (int k = s == 0 ? 1 : 0; k < parts; ++k) {
        Vector2d uv = at(static_cast<double>(k) / parts);
        uv = {std::clamp(uv.x(), u(0), u(nu_)), std::clamp(uv.y(), v(0), v(nv_))};
        chain.push_back(uv);
      }
    }
  }

  void triangulate(const CutCell& cut) {
    delaunay_.clear();
    for (const std::vector<BoundaryPiece>& loop : cut.loops) {
      std::vector<Vector2d> chain;
      for (const BoundaryPiece& piece : loop) divide(piece, chain);
      std::vector<Delaunay::Vertex_handle> handles;
      for (const Vector2d& uv : chain) handles.push_back(insert(uv));
      for (std::size_t k = 0; k < handles.size(); ++k) {
        const Delaunay::Vertex_handle a = handles[k], b = handles[(k + 1) % handles.size()];
        if (a != b) delaunay_.insert_constraint(a, b);
      }
    }
    const auto from_trim = [&](const Vector2d& at) {
      const Delaunay::Vertex_handle near = nearest(at);
      return near == Delaunay::Vertex_handle() ? 1 : (Vector2d(near->point().x(), near->point().y()) - at).norm();
    };
    mark_depths(delaunay_);
    std::vector<Vector2d> inner;
    for (int b = 1; b < nv_; ++b)
      for (int a = 1; a < nu_; ++a) {
        const Vector2d at(a, b);
        Delaunay::Locate_type type;
        int index = 0;
        const Delaunay::Face_handle face = delaunay_.locate({at.x(), at.y()}, type, index);
        if (type == Delaunay::FACE && face->info() % 2 == 1 && from_trim(at) > clearance) inner.push_back({u(a), v(b)});
      }
    for (const Vector2d& uv : inner) insert(uv);
    mark_depths(delaunay_);
    for (const auto f : delaunay_.finite_face_handles()) {
      if (f->info() % 2 == 0) continue;
      std::array<int, 3> corner;
      for (int k = 0; k < 3; ++k) corner[static_cast<std::size_t>(k)] = number(f->vertex(k));
      add(corner[0], corner[1], corner[2]);
    }
  }

  // Triangles are made in the cell's own coordinates; a vertex keeps the parameters that it was made of.
  Delaunay::Vertex_handle insert(const Vector2d& uv) {
    const Vector2d at = scaled(uv);
    require_finite(at, "a vertex of the triangles");
    const auto count = delaunay_.number_of_vertices();
    const Delaunay::Vertex_handle handle = delaunay_.insert({at.x(), at.y()});
    if (delaunay_.number_of_vertices() != count) handle->info() = vertex(uv);
    return handle;
  }
  // Where chords crossed, Delaunay made vertices of its own.
  int number(Delaunay::Vertex_handle handle) {
    if (handle->info() < 0)
      handle->info() = vertex(
          {u(0) + (u(nu_) - u(0)) * handle->point().x() / nu_, v(0) + (v(nv_) - v(0)) * handle->point().y() / nv_});
    return handle->info();
  }
  Delaunay::Vertex_handle nearest(const Vector2d& at) const {
    Delaunay::Vertex_handle best;
    double least = HUGE_VAL;
    for (const auto handle : delaunay_.finite_vertex_handles()) {
      const double distance = (Vector2d(handle->point().x(), handle->point().y()) - at).squaredNorm();
      if (distance < least) {
        least = distance;
        best = handle;
      }
    }
    return best;
  }

  const TrimmedSurface& surface_;
  const TrimTopology& topology_;
  const int nu_, nv_;
  int cell_ = 0, i_ = 0, j_ = 0;
  Delaunay delaunay_;  // of a cut cell, in units of its lattice
  std::map<std::pair<double, double>, int> number_;
  CellTriangles out_;
};

}  // namespace

CellTriangles triangulate_cells(const TrimmedSurface& surface, const TrimTopology& topology,
                                std::pair<int, int> divisions) {
  return CellMesher(surface, topology, divisions).run();
}

}  // namespace toile
