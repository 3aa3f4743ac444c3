#include "trimming/triangulation.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Constrained_triangulation_face_base_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "trimming/cell_boundary.h"

// Cells meet only along knot lines, so the mesh conforms where both sides of a cell edge carry the same points: the
// grid points of the edge and every vertex of a trim polygon that lies on it. These are collected first; then each cell
// is triangulated by itself.
namespace toile {
namespace {

using Real = BoundaryBezier::Real;
using Eigen::Vector2d;

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<int, Kernel>;
using FaceBase =
    CGAL::Constrained_triangulation_face_base_2<Kernel, CGAL::Triangulation_face_base_with_info_2<int, Kernel>>;
using Delaunay =
    CGAL::Constrained_Delaunay_triangulation_2<Kernel, CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>,
                                               CGAL::Exact_predicates_tag>;

using Polygon = std::vector<Vector2d>;

// k-th of n + 1 equal steps, the ends bitwise.
double grid(double a, double b, int k, int n) {
  return k == 0 ? a : k == n ? b : a + (b - a) * k / n;
}

struct Cell {
  Interval u, v;
  int i = 0, j = 0;
};
Cell cell_at(const KnotMesh& mesh, int i, int j) {
  return {{mesh.u[i], mesh.u[i + 1]}, {mesh.v[j], mesh.v[j + 1]}, i, j};
}

// Largest distance of the control points from the chord, in units of the cell.
double sagitta(const BoundaryBezier& piece, const Cell& cell) {
  const auto point = [&](int k) {
    return Vector2d(static_cast<double>(piece.x[k] / piece.w[k]) / cell.u.length(),
                    static_cast<double>(piece.y[k] / piece.w[k]) / cell.v.length());
  };
  const Vector2d a = point(0), chord = point(piece.degree) - a;
  const double length_squared = chord.squaredNorm();
  double largest = 0;
  for (int k = 1; k < piece.degree; ++k) {
    const Vector2d p = point(k) - a;
    const double along = length_squared > 0 ? std::clamp(p.dot(chord) / length_squared, 0.0, 1.0) : 0;
    largest = std::max(largest, (p - along * chord).norm());
  }
  return largest;
}

// De Casteljau at 1/2: the piece becomes its first half, the second is returned.
BoundaryBezier split(BoundaryBezier& piece) {
  BoundaryBezier right = piece;
  const int d = piece.degree;
  for (auto values : {&BoundaryBezier::x, &BoundaryBezier::y, &BoundaryBezier::w}) {
    auto c = piece.*values;
    for (int r = 0; r <= d; ++r) {
      (piece.*values)[r] = c[0];
      (right.*values)[d - r] = c[d - r];
      for (int j = 0; j < d - r; ++j) c[j] = (c[j] + c[j + 1]) / 2;
    }
  }
  return right;
}

// Points strictly between the ends of a piece, in order.
void flatten(BoundaryBezier piece, const Cell& cell, const Vector2d& origin, double chord, int depth, Polygon& out) {
  if (depth == 0 || sagitta(piece, cell) <= chord) return;
  const BoundaryBezier right = split(piece);
  flatten(piece, cell, origin, chord, depth - 1, out);
  const auto u = static_cast<double>(origin.x() + right.x[0] / right.w[0]);
  const auto v = static_cast<double>(origin.y() + right.y[0] / right.w[0]);
  out.emplace_back(std::clamp(u, cell.u.min, cell.u.max), std::clamp(v, cell.v.min, cell.v.max));
  flatten(right, cell, origin, chord, depth - 1, out);
}

std::vector<Polygon> polygons_of(const TrimmedSurface& surface, const CutCell& cut, const Cell& cell, double chord) {
  std::vector<Polygon> polygons;
  std::vector<BoundaryBezier> pieces;
  for (const auto& loop : cut.loops) {
    Polygon polygon;
    const auto add = [&](const Vector2d& p) {
      if (polygon.empty() || polygon.back() != p) polygon.push_back(p);
    };
    for (const BoundaryPiece& piece : loop) {
      add(piece.from);
      if (piece.curve < 0) continue;
      pieces.clear();
      append_pieces(surface, piece, piece.from, pieces);
      for (std::size_t k = 0; k < pieces.size(); ++k) {
        Polygon inner;
        if (k > 0)
          inner.emplace_back(
              std::clamp(static_cast<double>(piece.from.x() + pieces[k].x[0] / pieces[k].w[0]), cell.u.min, cell.u.max),
              std::clamp(static_cast<double>(piece.from.y() + pieces[k].y[0] / pieces[k].w[0]), cell.v.min,
                         cell.v.max));
        flatten(pieces[k], cell, piece.from, chord, 24, inner);
        for (const Vector2d& p : inner) add(p);
      }
    }
    while (polygon.size() > 1 && polygon.front() == polygon.back()) polygon.pop_back();
    if (polygon.size() > 2) polygons.push_back(std::move(polygon));
  }
  return polygons;
}

// The points on each cell edge besides its ends, ascending.
class EdgePoints {
 public:
  EdgePoints(const KnotMesh& mesh, int per_cell)
      : mesh_(mesh),
        per_cell_(per_cell),
        upright_(mesh.u.size() * static_cast<std::size_t>(mesh.cells_v())),
        level_(mesh.v.size() * static_cast<std::size_t>(mesh.cells_u())) {}

  void add(const Cell& cell, const Vector2d& p) {
    for (int side = 0; side < 2; ++side) {
      if (p.x() == mesh_.u[cell.i + side]) insert(upright(cell.i + side, cell.j), p.y(), cell.v);
      if (p.y() == mesh_.v[cell.j + side]) insert(level(cell.i, cell.j + side), p.x(), cell.u);
    }
  }

  bool empty(const Cell& cell) const {
    return upright_[at_upright(cell.i, cell.j)].empty() && upright_[at_upright(cell.i + 1, cell.j)].empty() &&
           level_[at_level(cell.i, cell.j)].empty() && level_[at_level(cell.i, cell.j + 1)].empty();
  }

  // The polygon with every side that runs along a cell edge divided at the edge's points.
  Polygon refined(const Cell& cell, const Polygon& polygon) const {
    Polygon out;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const Vector2d &p = polygon[k], &q = polygon[(k + 1) % polygon.size()];
      out.push_back(p);
      for (int side = 0; side < 2; ++side) {
        if (p.x() == mesh_.u[cell.i + side] && q.x() == p.x())
          for (const double v : between(upright_[at_upright(cell.i + side, cell.j)], cell.v, p.y(), q.y()))
            out.emplace_back(p.x(), v);
        if (p.y() == mesh_.v[cell.j + side] && q.y() == p.y())
          for (const double u : between(level_[at_level(cell.i, cell.j + side)], cell.u, p.x(), q.x()))
            out.emplace_back(u, p.y());
      }
    }
    return out;
  }

 private:
  std::size_t at_upright(int line, int j) const { return static_cast<std::size_t>(line) + mesh_.u.size() * j; }
  std::size_t at_level(int i, int line) const {
    return static_cast<std::size_t>(i) + static_cast<std::size_t>(mesh_.cells_u()) * line;
  }
  std::vector<double>& upright(int line, int j) { return upright_[at_upright(line, j)]; }
  std::vector<double>& level(int i, int line) { return level_[at_level(i, line)]; }

  void insert(std::vector<double>& points, double x, Interval range) const {
    if (!(range.min < x && x < range.max)) return;
    for (int k = 1; k < per_cell_; ++k)
      if (x == grid(range.min, range.max, k, per_cell_)) return;
    const auto place = std::lower_bound(points.begin(), points.end(), x);
    if (place == points.end() || *place != x) points.insert(place, x);
  }

  std::vector<double> between(const std::vector<double>& points, Interval range, double a, double b) const {
    std::vector<double> out;
    const double low = std::min(a, b), high = std::max(a, b);
    for (const double x : points)
      if (low < x && x < high) out.push_back(x);
    for (int k = 1; k < per_cell_; ++k)
      if (const double x = grid(range.min, range.max, k, per_cell_); low < x && x < high) out.push_back(x);
    std::sort(out.begin(), out.end());
    if (a > b) std::reverse(out.begin(), out.end());
    return out;
  }

  const KnotMesh& mesh_;
  int per_cell_;
  std::vector<std::vector<double>> upright_, level_;
};

// Collects vertices, each place once.
class Mesh {
 public:
  int vertex(const Vector2d& p) {
    const auto [place, fresh] = index_.try_emplace({p.x() + 0.0, p.y() + 0.0}, static_cast<int>(out_.uv.size()));
    if (fresh) out_.uv.push_back(p);
    return place->second;
  }
  void triangle(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
    const int ia = vertex(a), ib = vertex(b), ic = vertex(c);
    out_.triangles.push_back({ia, ib, ic});
  }
  TrimmedTriangles take() { return std::move(out_); }

 private:
  std::map<std::pair<double, double>, int> index_;
  TrimmedTriangles out_;
};

// Grid points of the cell inside the polygons and not near their sides.
Polygon inner_points(const std::vector<Polygon>& polygons, const Cell& cell, int per_cell) {
  constexpr double clearance = 0.3;  // of the grid's spacing
  Polygon out;
  for (int l = 1; l < per_cell; ++l)
    for (int k = 1; k < per_cell; ++k) {
      const Vector2d g(grid(cell.u.min, cell.u.max, k, per_cell), grid(cell.v.min, cell.v.max, l, per_cell));
      const auto scaled = [&](const Vector2d& p) {
        return Vector2d((p.x() - g.x()) / cell.u.length(), (p.y() - g.y()) / cell.v.length());
      };
      int winding = 0;
      bool near = false;
      for (const Polygon& polygon : polygons)
        for (std::size_t s = 0; s < polygon.size() && !near; ++s) {
          const Vector2d a = scaled(polygon[s]), b = scaled(polygon[(s + 1) % polygon.size()]), d = b - a;
          const double cross = a.x() * b.y() - a.y() * b.x();
          if (a.y() <= 0 && b.y() > 0 && cross > 0) ++winding;
          if (a.y() > 0 && b.y() <= 0 && cross < 0) --winding;
          const double t = d.squaredNorm() > 0 ? std::clamp(-a.dot(d) / d.squaredNorm(), 0.0, 1.0) : 0;
          near = (a + t * d).norm() < clearance / per_cell;
        }
      if (!near && winding > 0) out.push_back(g);
    }
  return out;
}

// Nesting depth of the faces, counted by the polygon sides between them and the outside.
void mark_depths(Delaunay& delaunay) {
  for (auto face = delaunay.all_faces_begin(); face != delaunay.all_faces_end(); ++face) face->info() = -1;
  std::vector<Delaunay::Face_handle> now = {delaunay.infinite_face()}, next;
  for (int depth = 0; !now.empty(); ++depth, now.swap(next), next.clear())
    while (!now.empty()) {
      const Delaunay::Face_handle face = now.back();
      now.pop_back();
      if (face->info() >= 0) continue;
      face->info() = depth;
      for (int k = 0; k < 3; ++k) {
        const Delaunay::Face_handle neighbour = face->neighbor(k);
        if (neighbour->info() < 0) (face->is_constrained(k) ? next : now).push_back(neighbour);
      }
    }
}

// False, and nothing added, where sides of the polygons cross and `last` is not set.
bool triangulate_polygons(const std::vector<Polygon>& polygons, const Polygon& inner, bool last, Mesh& mesh) {
  using Place = Kernel::Point_2;
  Delaunay delaunay;
  const auto insert = [&](const Vector2d& p, Delaunay::Vertex_handle near) {
    return delaunay.insert(Place(p.x(), p.y()), near == nullptr ? Delaunay::Face_handle() : near->face());
  };
  std::vector<std::vector<Delaunay::Vertex_handle>> rings;
  for (const Polygon& polygon : polygons) {
    Delaunay::Vertex_handle near = nullptr;
    auto& ring = rings.emplace_back();
    for (const Vector2d& p : polygon) ring.push_back(near = insert(p, near));
  }
  Delaunay::Vertex_handle near = nullptr;
  for (const Vector2d& p : inner) near = insert(p, near);
  const auto vertices = delaunay.number_of_vertices();
  for (const auto& ring : rings)
    for (std::size_t k = 0; k < ring.size(); ++k)
      if (ring[k] != ring[(k + 1) % ring.size()]) delaunay.insert_constraint(ring[k], ring[(k + 1) % ring.size()]);
  if (delaunay.dimension() < 2) return true;
  if (delaunay.number_of_vertices() != vertices && !last) return false;
  mark_depths(delaunay);
  const auto at = [](Delaunay::Vertex_handle v) { return Vector2d(v->point().x(), v->point().y()); };
  for (auto face = delaunay.finite_faces_begin(); face != delaunay.finite_faces_end(); ++face)
    if (face->info() % 2 == 1) mesh.triangle(at(face->vertex(0)), at(face->vertex(1)), at(face->vertex(2)));
  return true;
}

void add_quads(const Cell& cell, int per_cell, Mesh& mesh) {
  for (int l = 0; l < per_cell; ++l)
    for (int k = 0; k < per_cell; ++k) {
      const auto corner = [&](int a, int b) {
        return Vector2d(grid(cell.u.min, cell.u.max, k + a, per_cell), grid(cell.v.min, cell.v.max, l + b, per_cell));
      };
      mesh.triangle(corner(0, 0), corner(1, 0), corner(1, 1));
      mesh.triangle(corner(0, 0), corner(1, 1), corner(0, 1));
    }
}

}  // namespace

TrimmedTriangles triangulate(const TrimmedSurface& surface, const TrimTopology& topology,
                             const TriangulationOptions& options) {
  const KnotMesh& knots = topology.mesh;
  const int per_cell = std::max(options.per_cell, 1);

  // Polygons of the cut cells; where sides of one cell's polygons would cross (material thinner than the chord), finer.
  constexpr int attempts = 9;
  EdgePoints edges(knots, per_cell);
  std::vector<std::vector<Polygon>> polygons;
  for (const CutCell& cut : topology.cut_cells) {
    const Cell cell = cell_at(knots, cut.i, cut.j);
    double chord = options.chord;
    for (int attempt = 1;; ++attempt, chord /= 4) {
      auto candidate = polygons_of(surface, cut, cell, chord);
      Mesh scratch;
      if (attempt < attempts && !triangulate_polygons(candidate, {}, false, scratch)) continue;
      polygons.push_back(std::move(candidate));
      break;
    }
    for (const Polygon& polygon : polygons.back())
      for (const Vector2d& p : polygon) edges.add(cell, p);
  }

  Mesh mesh;
  std::size_t next_cut = 0;
  for (int j = 0; j < knots.cells_v(); ++j)
    for (int i = 0; i < knots.cells_u(); ++i) {
      const Cell cell = cell_at(knots, i, j);
      std::vector<Polygon> refined;
      if (topology.cells[knots.cell(i, j)] == CellKind::inside) {
        if (edges.empty(cell)) {
          add_quads(cell, per_cell, mesh);
          continue;
        }
        refined = {edges.refined(
            cell,
            {{cell.u.min, cell.v.min}, {cell.u.max, cell.v.min}, {cell.u.max, cell.v.max}, {cell.u.min, cell.v.max}})};
      } else if (topology.cells[knots.cell(i, j)] == CellKind::cut) {
        while (next_cut < topology.cut_cells.size() &&
               knots.cell(topology.cut_cells[next_cut].i, topology.cut_cells[next_cut].j) < knots.cell(i, j))
          ++next_cut;
        if (next_cut == topology.cut_cells.size() || topology.cut_cells[next_cut].i != i ||
            topology.cut_cells[next_cut].j != j)
          continue;
        for (const Polygon& polygon : polygons[next_cut]) refined.push_back(edges.refined(cell, polygon));
      } else {
        continue;
      }
      triangulate_polygons(refined, inner_points(refined, cell, per_cell), true, mesh);
    }
  return mesh.take();
}

}  // namespace toile
