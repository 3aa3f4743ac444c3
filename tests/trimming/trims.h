// SPDX-License-Identifier: GPL-3.0-or-later
// Trimmed surfaces made by hand for tests of topology, and the laws that every traced one obeys.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "geometry/refine.h"
#include "support/near.h"
#include "trimming/constraint_points.h"
#include "trimming/loops.h"
#include "trimming/topology.h"

namespace toile::test {

using Eigen::Vector2d;

// The identity map (u, v, 0), degree 1, with the given knot lines.
inline NurbsSurface knot_plane(std::vector<double> u, std::vector<double> v) {
  const KnotVector ku = clamped_knots(1, u), kv = clamped_knots(1, v);
  Eigen::Matrix3Xd net(3, static_cast<Eigen::Index>(u.size() * v.size()));
  for (std::size_t j = 0; j < v.size(); ++j)
    for (std::size_t i = 0; i < u.size(); ++i) net.col(static_cast<Eigen::Index>(i + u.size() * j)) << u[i], v[j], 0;
  return {ku, kv, net};
}

// Lines 0, 1, ..., n in both directions.
inline NurbsSurface unit_cells(int n) {
  std::vector<double> lines;
  for (int k = 0; k <= n; ++k) lines.push_back(k);
  return knot_plane(lines, lines);
}

inline Curve2 bezier_curve(const std::vector<Vector2d>& points, std::vector<double> weights = {}) {
  Curve2::Points p(2, static_cast<Eigen::Index>(points.size()));
  for (std::size_t k = 0; k < points.size(); ++k) p.col(static_cast<Eigen::Index>(k)) = points[k];
  return Curve2(uniform_knots(static_cast<int>(points.size()) - 1, 1), p, std::move(weights));
}

inline TrimLoop loop_of(const std::vector<Curve2>& curves, LoopKind kind = LoopKind::outer) {
  TrimLoop loop;
  loop.kind = kind;
  for (const Curve2& curve : curves) {
    TrimCurve trim;
    trim.curve = curve;
    trim.index = static_cast<int>(loop.curves.size());
    loop.curves.push_back(trim);
  }
  return loop;
}

inline TrimLoop polygon_loop(const std::vector<Vector2d>& corners, LoopKind kind = LoopKind::outer) {
  std::vector<Curve2> lines;
  for (std::size_t k = 0; k < corners.size(); ++k)
    lines.push_back(line_segment<2>(corners[k], corners[(k + 1) % corners.size()]));
  return loop_of(lines, kind);
}

// One closed curve: the circle through (x +- r, y), (x, y +- r) as four rational quadratic arcs with weight `w` at the
// square's corners (a circle to rounding for sqrt(1/2)); every touch of its bounding square is exact.
inline Curve2 round_curve(Vector2d centre, double r, double w = std::sqrt(0.5)) {
  const double x[] = {1, 1, 0, -1, -1, -1, 0, 1, 1}, y[] = {0, 1, 1, 1, 0, -1, -1, -1, 0};
  Curve2::Points points(2, 9);
  std::vector<double> weights;
  for (int k = 0; k < 9; ++k) {
    points.col(k) = centre + r * Vector2d(x[k], y[k]);
    weights.push_back(k % 2 == 0 ? 1 : w);
  }
  return Curve2(KnotVector(2, {0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4}), points, weights);
}

inline Curve2 backwards(const Curve2& curve) {
  const Interval d = curve.domain();
  std::vector<double> knots(curve.knots().knots().begin(), curve.knots().knots().end());
  std::reverse(knots.begin(), knots.end());
  for (double& k : knots) k = d.min + d.max - k;
  std::vector<double> weights(curve.weights().rbegin(), curve.weights().rend());
  return Curve2(KnotVector(curve.degree(), knots), curve.points().rowwise().reverse(), weights);
}

inline TrimLoop backwards(const TrimLoop& loop) {
  TrimLoop out = loop;
  std::reverse(out.curves.begin(), out.curves.end());
  for (TrimCurve& c : out.curves) c.reversed = !c.reversed;
  return out;
}

inline TrimmedSurface trimmed(NurbsSurface surface, std::vector<TrimLoop> loops) {
  TrimmedSurface out;
  out.name = "panel";
  out.surface = std::move(surface);
  out.loops = std::move(loops);
  for (std::size_t l = 0; l < out.loops.size(); ++l) {
    out.loops[l].index = static_cast<int>(l);
    out.loops[l].kind = l == 0 ? LoopKind::outer : LoopKind::hole;
  }
  return out;
}

// Area left of a piece and its chord to the origin: integral of (u dv - v du) / 2.
inline double swept_area(const TrimmedSurface& surface, const BoundaryPiece& piece) {
  if (piece.loop < 0) return (piece.from.x() * piece.to.y() - piece.from.y() * piece.to.x()) / 2;
  const Curve2& curve =
      surface.loops[static_cast<std::size_t>(piece.loop)].curves[static_cast<std::size_t>(piece.curve)].curve;
  // Gauss-Legendre, 5 points on each of 64 parts between knots.
  static const double x[] = {-0.9061798459386640, -0.5384693101056831, 0, 0.5384693101056831, 0.9061798459386640};
  static const double w[] = {0.2369268850561891, 0.4786286704993665, 0.5688888888888889, 0.4786286704993665,
                             0.2369268850561891};
  std::vector<double> stops{std::min(piece.t0, piece.t1)};
  for (const double k : curve.knots().breaks())
    if (k > stops.front() && k < std::max(piece.t0, piece.t1)) stops.push_back(k);
  stops.push_back(std::max(piece.t0, piece.t1));
  double sum = 0;
  for (std::size_t s = 0; s + 1 < stops.size(); ++s) {
    const int parts = curve.rational() ? 64 : 4;
    for (int k = 0; k < parts; ++k) {
      const double h = (stops[s + 1] - stops[s]) / parts, mid = stops[s] + (k + 0.5) * h;
      for (int q = 0; q < 5; ++q) {
        const auto jet = evaluate(curve, mid + x[q] * h / 2);
        sum += w[q] * h / 2 * (jet.x.x() * jet.d1.y() - jet.x.y() * jet.d1.x()) / 2;
      }
    }
  }
  return piece.t0 <= piece.t1 ? sum : -sum;
}

inline double loop_area(const TrimmedSurface& surface) {
  double area = 0;
  for (std::size_t l = 0; l < surface.loops.size(); ++l)
    for (std::size_t c = 0; c < surface.loops[l].curves.size(); ++c) {
      const TrimCurve& curve = surface.loops[l].curves[c];
      BoundaryPiece piece;
      piece.loop = static_cast<int>(l);
      piece.curve = static_cast<int>(c);
      piece.t0 = curve.reversed ? curve.curve.domain().max : curve.curve.domain().min;
      piece.t1 = curve.reversed ? curve.curve.domain().min : curve.curve.domain().max;
      area += swept_area(surface, piece);
    }
  return area;
}

inline double cut_area(const TrimmedSurface& surface, const CutCell& cell) {
  double area = 0;
  for (const auto& chain : cell.loops)
    for (const BoundaryPiece& piece : chain) area += swept_area(surface, piece);
  return area;
}

// Laws (1) to (4) of TrimTopology that can be checked on any surface.
inline void expect_laws(const TrimmedSurface& surface, const TrimTopology& topology) {
  const KnotMesh& mesh = topology.mesh;
  double area = 0;
  std::size_t cut = 0;
  int last = -1;
  for (int j = 0; j < mesh.cells_v(); ++j)
    for (int i = 0; i < mesh.cells_u(); ++i) {
      const CellKind kind = topology.cells[static_cast<std::size_t>(mesh.cell(i, j))];
      const double full = (mesh.u[i + 1] - mesh.u[i]) * (mesh.v[j + 1] - mesh.v[j]);
      if (kind == CellKind::inside) area += full;
      if (kind != CellKind::cut) continue;
      ASSERT_LT(cut, topology.cut_cells.size());
      const CutCell& cell = topology.cut_cells[cut++];
      EXPECT_EQ(cell.i, i);
      EXPECT_EQ(cell.j, j);
      EXPECT_GT(mesh.cell(i, j), last);
      last = mesh.cell(i, j);
      for (const auto& chain : cell.loops) {
        ASSERT_FALSE(chain.empty());
        for (std::size_t k = 0; k < chain.size(); ++k) {
          EXPECT_EQ(chain[k].to, chain[(k + 1) % chain.size()].from) << "chain broken in cell " << i << ", " << j;
          for (const Vector2d& x : {chain[k].from, chain[k].to}) {
            EXPECT_LE(mesh.u[i], x.x());
            EXPECT_GE(mesh.u[i + 1], x.x());
            EXPECT_LE(mesh.v[j], x.y());
            EXPECT_GE(mesh.v[j + 1], x.y());
          }
        }
      }
      const double part = cut_area(surface, cell);
      EXPECT_GE(part, -1e-13 * full) << i << ", " << j;
      EXPECT_LE(part, full * (1 + 1e-13)) << i << ", " << j;
      area += part;
    }
  EXPECT_EQ(cut, topology.cut_cells.size());
  const double expected = loop_area(surface);
  expect_near_rel(area, expected, 1e-11, 1e-15 * (mesh.u.back() - mesh.u.front()) * (mesh.v.back() - mesh.v.front()));
  for (const TrimEvent& e : topology.events) {
    if (e.line_u >= 0) {
      EXPECT_EQ(e.uv.x(), mesh.u[static_cast<std::size_t>(e.line_u)]);
    }
    if (e.line_v >= 0) {
      EXPECT_EQ(e.uv.y(), mesh.v[static_cast<std::size_t>(e.line_v)]);
    }
    const Curve2& curve =
        surface.loops[static_cast<std::size_t>(e.loop)].curves[static_cast<std::size_t>(e.curve)].curve;
    const double size = std::max(
        {std::abs(mesh.u.front()), std::abs(mesh.u.back()), std::abs(mesh.v.front()), std::abs(mesh.v.back())});
    EXPECT_LE((curve(e.t) - e.uv).norm(), 1e-7 * size);  // 1e-7: a touch is as flat as the square root of rounding
  }
}

// How many events of each kind, and the classes of cells and vertices.
struct Tally {
  int crossing_u = 0, crossing_v = 0, tangent_u = 0, tangent_v = 0, crossing_uv = 0;
  int inside = 0, cut = 0, outside = 0;
  int vertices = 0;  // strictly inside
  bool operator==(const Tally&) const = default;
  friend std::ostream& operator<<(std::ostream& out, const Tally& t) {
    return out << "{u " << t.crossing_u << ", v " << t.crossing_v << ", tangent_u " << t.tangent_u << ", tangent_v "
               << t.tangent_v << ", uv " << t.crossing_uv << "; cells inside " << t.inside << ", cut " << t.cut
               << ", outside " << t.outside << "; vertices " << t.vertices << "}";
  }
};
inline Tally tally(const TrimTopology& topology) {
  Tally t;
  for (const TrimEvent& e : topology.events) {
    switch (e.kind) {
      case PointKind::crossing_u:
        ++t.crossing_u;
        break;
      case PointKind::crossing_v:
        ++t.crossing_v;
        break;
      case PointKind::tangent_u:
        ++t.tangent_u;
        break;
      case PointKind::tangent_v:
        ++t.tangent_v;
        break;
      case PointKind::crossing_uv:
        ++t.crossing_uv;
        break;
      case PointKind::vertex:
      case PointKind::corner:
        ADD_FAILURE() << "no kind of an event";
    }
  }
  for (const CellKind kind : topology.cells) {
    ++(kind == CellKind::inside ? t.inside : kind == CellKind::cut ? t.cut : t.outside);
  }
  for (const VertexKind kind : topology.vertices) t.vertices += kind == VertexKind::inside;
  return t;
}

// The same trimmed surface moved in its parameter plane by (u, v) -> (a u + b v, c u + d v), entries 0 or +- a power
// of 2.
inline TrimmedSurface moved(const TrimmedSurface& from, const Eigen::Matrix2d& map) {
  const auto lines = [&](int axis) {
    const int source = map(axis, 0) != 0 ? 0 : 1;
    std::vector<double> x = source == 0 ? from.surface.u().breaks() : from.surface.v().breaks();
    for (double& value : x) value *= map(axis, source);
    std::sort(x.begin(), x.end());
    return x;
  };
  TrimmedSurface to = from;
  to.surface = knot_plane(lines(0), lines(1));
  for (TrimLoop& loop : to.loops) {
    for (TrimCurve& c : loop.curves) c.curve = Curve2(c.curve.knots(), map * c.curve.points(), c.curve.weights());
    if (map.determinant() < 0) loop = backwards(loop);
  }
  return to;
}

// Every curve with a knot more in the middle of every span.
inline TrimmedSurface knot_refined(const TrimmedSurface& from) {
  TrimmedSurface to = from;
  for (TrimLoop& loop : to.loops)
    for (TrimCurve& c : loop.curves) {
      std::vector<double> added;
      const std::vector<double> breaks = c.curve.knots().breaks();
      for (std::size_t k = 0; k + 1 < breaks.size(); ++k) added.push_back((breaks[k] + breaks[k + 1]) / 2);
      c.curve = insert_knots(c.curve, added);
    }
  return to;
}

// Traces the surface, checks its laws and the tally; then the same mirrored, turned, scaled, run backwards by the file
// and knot-refined.
inline TrimTopology expect_tally(const TrimmedSurface& surface, const Tally& expected, bool refine = true) {
  TrimmedSurface given = surface;
  validate_loops(given);
  const TrimTopology topology = trace_trims(given);
  EXPECT_EQ(tally(topology), expected);
  expect_laws(given, topology);
  const auto same = [&](const char* what, TrimmedSurface variant, bool turned) {
    SCOPED_TRACE(what);
    validate_loops(variant);
    const TrimTopology traced = trace_trims(variant);
    Tally t = tally(traced);
    if (turned) {
      std::swap(t.crossing_u, t.crossing_v);
      std::swap(t.tangent_u, t.tangent_v);
    }
    EXPECT_EQ(t, expected);
    expect_laws(variant, traced);
  };
  const auto map = [](double a, double b, double c, double d) { return (Eigen::Matrix2d() << a, b, c, d).finished(); };
  same("mirrored in u", moved(surface, map(-1, 0, 0, 1)), false);
  same("mirrored in v", moved(surface, map(1, 0, 0, -1)), false);
  same("turned by 90 degrees", moved(surface, map(0, -1, 1, 0)), true);
  same("transposed", moved(surface, map(0, 1, 1, 0)), true);
  same("scaled up", moved(surface, map(0x1p20, 0, 0, 0x1p20)), false);
  same("scaled down", moved(surface, map(0x1p-20, 0, 0, 0x1p-20)), false);
  same("scaled apart", moved(surface, map(0x1p20, 0, 0, 0x1p-20)), false);
  TrimmedSurface reversed = surface;
  for (TrimLoop& loop : reversed.loops)
    for (TrimCurve& c : loop.curves) {
      c.curve = backwards(c.curve);
      c.reversed = !c.reversed;
    }
  same("curves reversed", reversed, false);
  if (refine) same("knot-refined", knot_refined(surface), false);
  return topology;
}

}  // namespace toile::test
