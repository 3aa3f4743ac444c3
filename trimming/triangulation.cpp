// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/triangulation.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <deque>
#include <numbers>

#include "geometry/error.h"
#include "geometry/finite.h"
#include "trimming/delaunay.h"
#include "trimming/text.h"

namespace toile {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double most_triangles = 4e6;

// The boundary between two neighbouring vertices: one curve over [t0, t1], in the loop's direction.
struct Segment {
  int loop = 0, curve = 0;
  double t0 = 0, t1 = 0;
  Vector2d from{0, 0};
  bool given = false;  // between given points: not to be divided
};

class Mesher {
 public:
  Mesher(const TrimmedSurface& surface, const TrimTopology& topology, const TriangulationOptions& options)
      : surface_(surface), options_(options) {
    roll_out(topology);
    if (options.size) size_ = *options.size;
    if (!(size_ > 0) || !std::isfinite(size_))
      throw GeometryError(place_name(surface) + ": a triangle size of " + text(size_) + ", must be positive");
    if (!(options.chord > 0))
      throw GeometryError(place_name(surface) + ": a chord of " + text(options.chord) + ", must be positive");
    for (const GivenPoints& g : options.given) {
      if (g.loop < 0 || g.loop >= static_cast<int>(surface.loops.size()) || g.curve < 0 ||
          g.curve >= static_cast<int>(surface.loops[static_cast<std::size_t>(g.loop)].curves.size()))
        throw GeometryError(place_name(surface) + ": points are given for loop " + std::to_string(g.loop) + ", curve " +
                            std::to_string(g.curve) + ", which isn't there");
    }
    const double expected = area_ / (size_ * size_ * std::sqrt(3.0) / 4);
    if (!(expected < most_triangles))
      throw GeometryError(place_name(surface) + ": triangles of size " + text(size_) + " would be " + text(expected));
    for (std::size_t l = 0; l < surface.loops.size(); ++l) divide_loop(static_cast<int>(l));
  }

  TrimmedTriangles run() {
    // Chords of thin material may cross each other: divided until they don't. Material thinner than 2^-12 of an edge
    // keeps its crossings, as vertices where they meet.
    constexpr int rounds = 12;
    for (int round = 0; !constrain(round == rounds); ++round) {
    }
    mark_depths(delaunay_);
    refine();
    collect();
    return std::move(out_);
  }

 private:
  // The affine map with the mean metric of the panel, the area and the mean size of a cell.
  void roll_out(const TrimTopology& topology) {
    const KnotMesh& mesh = topology.mesh;
    Eigen::Vector3d metric(0, 0, 0);
    int cells = 0;
    for (int j = 0; j < mesh.cells_v(); ++j) {
      for (int i = 0; i < mesh.cells_u(); ++i) {
        if (topology.cells[static_cast<std::size_t>(mesh.cell(i, j))] == CellKind::outside) continue;
        const double u0 = mesh.u[static_cast<std::size_t>(i)], u1 = mesh.u[static_cast<std::size_t>(i) + 1],
                     v0 = mesh.v[static_cast<std::size_t>(j)], v1 = mesh.v[static_cast<std::size_t>(j) + 1];
        const SurfaceJet jet = evaluate(surface_.surface, u0 + (u1 - u0) / 2, v0 + (v1 - v0) / 2);
        metric += Eigen::Vector3d(jet.u.dot(jet.u), jet.u.dot(jet.v), jet.v.dot(jet.v));
        area_ += jet.area_scale() * (u1 - u0) * (v1 - v0);
        ++cells;
      }
    }
    if (cells == 0 || !(area_ > 0)) throw GeometryError(place_name(surface_) + ": has no area to triangulate");
    metric /= cells;
    const double a = std::sqrt(metric[0]), b = metric[1] / a,
                 c = std::sqrt(std::max(metric[2] - b * b, 1e-12 * metric[2]));
    plane_ << a, b, 0, c;
    back_ = plane_.inverse();
    size_ = std::sqrt(area_ / cells) / 4;
  }

  const Curve2& curve(int l, int c) const {
    return surface_.loops[static_cast<std::size_t>(l)].curves[static_cast<std::size_t>(c)].curve;
  }
  Vector3d position(const Vector2d& uv) const { return surface_.surface(uv.x(), uv.y()); }

  // The curve at t, its ends the control points that its neighbours share bitwise.
  Vector2d on_curve(int l, int c, double t) const {
    const Curve2& x = curve(l, c);
    if (t == x.domain().min) return x.points().col(0);
    if (t == x.domain().max) return x.points().col(x.points().cols() - 1);
    const Interval u = surface_.surface.u().domain(), v = surface_.surface.v().domain();
    const Vector2d uv = x(t);
    return {std::clamp(uv.x(), u.min, u.max), std::clamp(uv.y(), v.min, v.max)};
  }

  double speed(const Curve2& c, double t) const {
    const CurveJet<2> at = evaluate(c, t);
    const SurfaceJet jet = evaluate(surface_.surface, at.x.x(), at.x.y());
    return (jet.u * at.d1.x() + jet.v * at.d1.y()).norm();
  }

  // Parameters between t0 and t1 that part the curve into lengths of at most the size, nearly equal.
  std::vector<double> equal_parts(const Curve2& c, double t0, double t1) const {
    std::vector<double> stops{t0};
    for (const double k : c.knots().breaks())
      if (t0 < k && k < t1) stops.push_back(k);
    stops.push_back(t1);
    constexpr int steps = 16;  // per span, by Simpson's rule
    std::vector<double> t{t0}, length{0};
    for (std::size_t s = 0; s + 1 < stops.size(); ++s) {
      const double h = (stops[s + 1] - stops[s]) / steps;
      for (int k = 0; k < steps; ++k) {
        const double a = stops[s] + k * h;
        t.push_back(k + 1 == steps ? stops[s + 1] : a + h);
        length.push_back(length.back() + h / 6 * (speed(c, a) + 4 * speed(c, a + h / 2) + speed(c, a + h)));
      }
    }
    const double parts = std::max(1.0, std::ceil(length.back() / size_ - 1e-9));
    if (!(parts < most_triangles))
      throw GeometryError(place_name(surface_) + ": its boundary has no size to triangulate");
    std::vector<double> out;
    std::size_t at = 0;
    for (double k = 1; k < parts; ++k) {
      const double x = length.back() * k / parts;
      while (at + 2 < t.size() && length[at + 1] < x) ++at;
      const double step = length[at + 1] - length[at];
      const double place = t[at] + (t[at + 1] - t[at]) * (step > 0 ? (x - length[at]) / step : 0.5);
      if (place > (out.empty() ? t0 : out.back()) && place < t1) out.push_back(place);
    }
    return out;
  }

  void divide_loop(int l) {
    const TrimLoop& loop = surface_.loops[static_cast<std::size_t>(l)];
    std::vector<Segment>& ring = rings_.emplace_back();
    for (std::size_t k = 0; k < loop.curves.size(); ++k) {
      const int c = static_cast<int>(k);
      const Curve2& x = loop.curves[k].curve;
      const Interval domain = x.domain();
      std::vector<double> t{domain.min};
      const auto given = std::find_if(options_.given.begin(), options_.given.end(),
                                      [&](const GivenPoints& g) { return g.loop == l && g.curve == c; });
      const bool free = given == options_.given.end();
      if (free) {
        // Kinks are vertices.
        std::vector<double> kinks;
        for (const double knot : x.knots().breaks())
          if (domain.min < knot && knot <= domain.max &&
              (knot == domain.max || x.knots().multiplicity(knot) >= x.degree()))
            kinks.push_back(knot);
        for (const double kink : kinks) {
          const std::vector<double> between = equal_parts(x, t.back(), kink);
          t.insert(t.end(), between.begin(), between.end());
          t.push_back(kink);
        }
      } else {
        for (const double inner : given->t) {
          if (!(t.back() < inner && inner < domain.max))
            throw GeometryError(place_name(surface_, loop, &loop.curves[k]) + ": given point t = " + text(inner) +
                                " is not between " + text(t.back()) + " and " + text(domain.max));
          t.push_back(inner);
        }
        t.push_back(domain.max);
      }
      if (loop.curves[k].reversed) std::reverse(t.begin(), t.end());
      for (std::size_t i = 0; i + 1 < t.size(); ++i) {
        const Segment segment{l, c, t[i], t[i + 1], on_curve(l, c, t[i]), !free};
        free ? follow(segment, on_curve(l, c, t[i + 1]), 12, ring) : ring.push_back(segment);
      }
    }
    // Three sides at least enclose something.
    while (ring.size() < 3) {
      std::vector<Segment> finer;
      for (const Segment& s : ring) halve(s, finer);
      if (finer.size() == ring.size())
        throw GeometryError(place_name(surface_, loop) + ": too few given points: the loop has " +
                            std::to_string(ring.size()) + " edges");
      ring = finer;
    }
  }

  void halve(const Segment& s, std::vector<Segment>& out) const {
    const double mid = s.t0 + (s.t1 - s.t0) / 2;
    if (s.given || mid == s.t0 || mid == s.t1) {
      out.push_back(s);
      return;
    }
    out.push_back({s.loop, s.curve, s.t0, mid, s.from, false});
    out.push_back({s.loop, s.curve, mid, s.t1, on_curve(s.loop, s.curve, mid), false});
  }

  // Halves a segment until its chord keeps near the trim.
  void follow(const Segment& s, const Vector2d& to, int depth, std::vector<Segment>& out) const {
    const Vector3d a = position(s.from), chord = position(to) - a;
    double largest = 0;
    for (const double share : {0.25, 0.5, 0.75}) {
      const Vector3d x = position(on_curve(s.loop, s.curve, s.t0 + share * (s.t1 - s.t0))) - a;
      const double along = chord.squaredNorm() > 0 ? std::clamp(x.dot(chord) / chord.squaredNorm(), 0.0, 1.0) : 0;
      // A chord in the parameter plane is curved on a curved surface: its own distance counts too.
      largest = std::max(largest, (x - along * chord).norm());
    }
    std::vector<Segment> halves;
    if (depth > 0 && largest > options_.chord * size_) halve(s, halves);
    if (halves.size() < 2) {
      out.push_back(s);
      return;
    }
    follow(halves[0], halves[1].from, depth - 1, out);
    follow(halves[1], to, depth - 1, out);
  }

  // Vertices and constraints of all rings; false where chords crossed, which have been divided then.
  bool constrain(bool last) {
    delaunay_.clear();
    out_ = {};
    std::vector<std::vector<Delaunay::Vertex_handle>> handles;
    for (const std::vector<Segment>& ring : rings_) {
      auto& own = handles.emplace_back();
      Delaunay::Face_handle near;
      for (const Segment& s : ring) {
        const auto count = delaunay_.number_of_vertices();
        const Vector2d x = plane_ * s.from;
        require_finite(x, "a vertex of the triangles");
        const Delaunay::Vertex_handle v = delaunay_.insert({x.x(), x.y()}, near);
        if (delaunay_.number_of_vertices() != count) {
          v->info() = static_cast<int>(out_.uv.size());
          out_.uv.push_back(s.from);
        }
        near = v->face();
        own.push_back(v);
        out_.boundary.push_back({v->info(), s.loop, s.curve, s.t0});
      }
    }
    std::vector<std::vector<char>> crossed;
    bool any = false;
    for (std::size_t r = 0; r < rings_.size(); ++r) {
      crossed.emplace_back(rings_[r].size(), 0);
      for (std::size_t k = 0; k < handles[r].size(); ++k) {
        const Delaunay::Vertex_handle a = handles[r][k], b = handles[r][(k + 1) % handles[r].size()];
        if (a == b) continue;
        const auto count = delaunay_.number_of_vertices();
        delaunay_.insert_constraint(a, b);
        if (delaunay_.number_of_vertices() == count) continue;
        any = true;
        crossed[r][k] = 1;
      }
    }
    if (!any) return true;
    if (last) {
      for (const auto v : delaunay_.finite_vertex_handles()) {
        if (v->info() >= 0) continue;
        v->info() = static_cast<int>(out_.uv.size());
        out_.uv.push_back(back_ * Vector2d(v->point().x(), v->point().y()));
      }
      return true;
    }
    divide_crossed(crossed);
    return false;
  }

  // Halves every crossed segment and all whose boxes meet it.
  void divide_crossed(const std::vector<std::vector<char>>& crossed) {
    const auto box = [&](const std::vector<Segment>& ring, std::size_t k) {
      Eigen::AlignedBox2d b(ring[k].from);
      b.extend(ring[(k + 1) % ring.size()].from);
      return b;
    };
    std::vector<Eigen::AlignedBox2d> bad;
    for (std::size_t r = 0; r < rings_.size(); ++r)
      for (std::size_t k = 0; k < rings_[r].size(); ++k)
        if (crossed[r][k]) bad.push_back(box(rings_[r], k));
    bool divided = false;
    std::vector<std::vector<Segment>> finer(rings_.size());
    for (std::size_t r = 0; r < rings_.size(); ++r)
      for (std::size_t k = 0; k < rings_[r].size(); ++k) {
        const Eigen::AlignedBox2d own = box(rings_[r], k);
        const std::size_t before = finer[r].size();
        if (std::any_of(bad.begin(), bad.end(), [&](const Eigen::AlignedBox2d& b) { return b.intersects(own); }))
          halve(rings_[r][k], finer[r]);
        else
          finer[r].push_back(rings_[r][k]);
        divided = divided || finer[r].size() - before > 1;
      }
    if (!divided) {
      for (std::size_t r = 0; r < rings_.size(); ++r)
        for (std::size_t k = 0; k < rings_[r].size(); ++k)
          if (crossed[r][k])
            throw GeometryError(place_name(surface_, surface_.loops[r]) +
                                ": boundary edges between given points cross at " + point_text(rings_[r][k].from));
    }
    rings_ = std::move(finer);
  }

  bool inside(Delaunay::Face_handle f) const { return !delaunay_.is_infinite(f) && f->info() % 2 == 1; }

  std::array<double, 3> edges(Delaunay::Face_handle f) const {
    std::array<Vector3d, 3> x;
    for (int k = 0; k < 3; ++k)
      x[static_cast<std::size_t>(k)] = positions_[static_cast<std::size_t>(f->vertex(k)->info())];
    return {(x[1] - x[2]).norm(), (x[2] - x[0]).norm(), (x[0] - x[1]).norm()};
  }

  // Too large, or too thin while its edges aren't short. The circumcircle of an equilateral triangle has 0.577 of its
  // edge; circles of 0.7 leave edges around the size. A ratio of radius to shortest edge above sqrt(2) is an angle
  // below 20.7 degrees [Ruppert 1995]. Where the panel is all but collapsed (a weight of 1e4), triangles are thin in
  // space however they are divided: without a long edge they stay.
  bool poor(Delaunay::Face_handle f) const {
    const auto [a, b, c] = edges(f);
    const double shortest = std::min({a, b, c}), p = (a + b + c) / 2;
    const double radius = a * b * c / (4 * std::sqrt(std::max(p * (p - a) * (p - b) * (p - c), 0.0)));
    return (radius > 0.7 * size_ && std::max({a, b, c}) > size_) ||
           (radius > std::numbers::sqrt2 * shortest && shortest > size_ / 8);
  }

  // Circumcentres of poor triangles become vertices unless they lie out of sight or in the circle over a boundary edge:
  // boundary edges are never divided. Each is farther than its circle's radius from all others, so this ends.
  // [Chew 1989; Ruppert 1995]
  void refine() {
    for (const Vector2d& uv : out_.uv) positions_.push_back(position(uv));
    struct Task {
      Delaunay::Vertex_handle a, b, c;
    };
    std::deque<Task> tasks;
    const auto push = [&](Delaunay::Face_handle f) {
      if (inside(f) && poor(f)) tasks.push_back({f->vertex(0), f->vertex(1), f->vertex(2)});
    };
    for (auto f = delaunay_.finite_faces_begin(); f != delaunay_.finite_faces_end(); ++f) push(f);
    std::vector<Delaunay::Edge> border;
    std::vector<Delaunay::Face_handle> conflicts;
    while (!tasks.empty()) {
      const Task task = tasks.front();
      tasks.pop_front();
      Delaunay::Face_handle face;
      if (!delaunay_.is_face(task.a, task.b, task.c, face)) continue;
      const PlaneKernel::Point_2 x = delaunay_.circumcenter(face);
      if (!std::isfinite(x.x()) || !std::isfinite(x.y())) continue;  // of corners on a line but for rounding
      Delaunay::Locate_type type;
      int index = 0;
      const Delaunay::Face_handle at = delaunay_.locate(x, type, index, face);
      if (type == Delaunay::VERTEX || type == Delaunay::OUTSIDE_CONVEX_HULL || type == Delaunay::OUTSIDE_AFFINE_HULL ||
          !inside(at))
        continue;
      border.clear();
      conflicts.clear();
      delaunay_.get_conflicts_and_boundary(x, std::back_inserter(conflicts), std::back_inserter(border), at);
      // The circle's triangle must be in sight of its centre.
      if (std::find(conflicts.begin(), conflicts.end(), face) == conflicts.end()) continue;
      const bool encroaches = std::any_of(border.begin(), border.end(), [&](const Delaunay::Edge& e) {
        if (!e.first->is_constrained(e.second)) return false;
        const auto &p = e.first->vertex(Delaunay::cw(e.second))->point(),
                   &q = e.first->vertex(Delaunay::ccw(e.second))->point();
        return (p.x() - x.x()) * (q.x() - x.x()) + (p.y() - x.y()) * (q.y() - x.y()) <= 0;
      });
      if (encroaches) continue;
      const Vector2d uv = back_ * Vector2d(x.x(), x.y());
      if (!surface_.surface.u().domain().contains(uv.x()) || !surface_.surface.v().domain().contains(uv.y())) continue;
      if (!(static_cast<double>(out_.uv.size()) < most_triangles))
        throw GeometryError(place_name(surface_) + ": triangles of size " + text(size_) + " are more than " +
                            text(most_triangles));
      const Delaunay::Vertex_handle v = delaunay_.insert(x, type, at, index);
      v->info() = static_cast<int>(out_.uv.size());
      out_.uv.push_back(uv);
      positions_.push_back(position(uv));
      Delaunay::Face_circulator around = delaunay_.incident_faces(v), end = around;
      do around->info() = 1;
      while (++around != end);
      do push(around);
      while (++around != end);
    }
  }

  void collect() {
    TriangleQuality& quality = out_.quality;
    quality = {std::numbers::pi, HUGE_VAL, 0};
    std::vector<int> number(out_.uv.size(), -1);
    std::vector<Vector2d> used;
    const auto vertex = [&](int k) {
      int& n = number[static_cast<std::size_t>(k)];
      if (n < 0) {
        n = static_cast<int>(used.size());
        used.push_back(out_.uv[static_cast<std::size_t>(k)]);
      }
      return n;
    };
    for (auto f = delaunay_.finite_faces_begin(); f != delaunay_.finite_faces_end(); ++f) {
      if (!inside(f)) continue;
      out_.triangles.push_back(
          {vertex(f->vertex(0)->info()), vertex(f->vertex(1)->info()), vertex(f->vertex(2)->info())});
      const std::array<double, 3> e = edges(f);
      for (std::size_t k = 0; k < 3; ++k) {
        const double a = e[k], b = e[(k + 1) % 3], c = e[(k + 2) % 3];
        quality.shortest_edge = std::min(quality.shortest_edge, a);
        quality.longest_edge = std::max(quality.longest_edge, a);
        quality.smallest_angle =
            std::min(quality.smallest_angle, std::acos(std::clamp((b * b + c * c - a * a) / (2 * b * c), -1.0, 1.0)));
      }
    }
    if (out_.triangles.empty()) quality = {};
    out_.uv = std::move(used);
    for (BoundaryVertex& b : out_.boundary) b.vertex = number[static_cast<std::size_t>(b.vertex)];
    std::erase_if(out_.boundary, [](const BoundaryVertex& b) { return b.vertex < 0; });
  }

  const TrimmedSurface& surface_;
  const TriangulationOptions& options_;
  Matrix2d plane_ = Matrix2d::Identity(), back_ = Matrix2d::Identity();  // uv to the plane and back
  double area_ = 0, size_ = 0;
  std::vector<std::vector<Segment>> rings_;
  Delaunay delaunay_;
  std::vector<Vector3d> positions_;
  TrimmedTriangles out_;
};

}  // namespace

TrimmedTriangles triangulate(const TrimmedSurface& surface, const TrimTopology& topology,
                             const TriangulationOptions& options) {
  return Mesher(surface, topology, options).run();
}

}  // namespace toile
