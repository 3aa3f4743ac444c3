// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/face_triangles.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "geometry/error.h"
#include "geometry/measure.h"
#include "trimming/text.h"
#include "trimming/triangulation.h"

namespace toile {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Of parameters: a curve evaluated at its end is off by no more, as a share of how large they are.
constexpr double rounding = 1e-12;

// Triangles that are halved where they are too far off.
class Refinement {
 public:
  Refinement(const TrimmedSurface& face, const TrimmedTriangles& coarse)
      : face_(face), uv_(coarse.uv), triangles_(coarse.triangles), trims_(coarse.uv.size()) {
    for (const Vector2d& uv : uv_) x_.push_back(face.surface(uv.x(), uv.y()));
    for (const BoundaryVertex& b : coarse.boundary) trims_[b.vertex].push_back({b.loop, b.curve, b.t});
    // A vertex where a curve ends is listed with the next one.
    for (const BoundaryVertex& b : coarse.boundary) {
      const TrimLoop& loop = face.loops[b.loop];
      for (int k = 0; k < static_cast<int>(loop.curves.size()); ++k) {
        const Curve2& curve = loop.curves[k].curve;
        for (const double t : {curve.domain().min, curve.domain().max})
          if ((curve(t) - uv_[b.vertex]).norm() <= loop.gap + rounding * uv_[b.vertex].norm())
            trims_[b.vertex].push_back({b.loop, k, t});
      }
    }
  }

  // Halves every edge that is farther off than `chord_error`, the longest edge of such triangles, and that of every
  // triangle that is halved [Rivara 1984]: an edge below the chord error beside edges above it would stay, and
  // triangles along it grow thinner without end. Whether there was one.
  bool refine(double chord_error) {
    const MeshTopology topology(triangles_, static_cast<int>(uv_.size()));
    std::vector<int> middle(topology.edge_count(), -1);
    std::vector<Middle> found(topology.edge_count());
    worst_ = 0;
    const auto split = [&](int e) {
      if (middle[e] >= 0) return;
      middle[e] = static_cast<int>(uv_.size());
      uv_.push_back(found[e].uv);
      x_.push_back(face_.surface(found[e].uv.x(), found[e].uv.y()));
      trims_.emplace_back();
      if (found[e].on_trim) trims_.back().push_back(found[e].trim);
    };
    for (int e = 0; e < topology.edge_count(); ++e) {
      found[e] = middle_of(topology.edge(e), topology.faces_of_edge(e).size() == 1);
      worst_ = std::max(worst_, found[e].off);
    }
    for (int e = 0; e < topology.edge_count(); ++e)
      if (found[e].off > chord_error) split(e);
    const int count = static_cast<int>(triangles_.size());
    std::vector<int> longest(count);
    for (int f = 0; f < count; ++f) {
      longest[f] = longest_edge(topology, f);
      const auto [a, b, c] = triangles_[f];
      const Vector2d uv = (uv_[a] + uv_[b] + uv_[c]) / 3;
      const double off = (face_.surface(uv.x(), uv.y()) - (x_[a] + x_[b] + x_[c]) / 3).norm();
      worst_ = std::max(worst_, off);
      if (off > chord_error) split(longest[f]);
    }
    for (bool more = true; more;) {
      more = false;
      for (int f = 0; f < count; ++f) {
        if (middle[longest[f]] >= 0) continue;
        if (std::ranges::none_of(topology.edges_of_face(f), [&](int e) { return middle[e] >= 0; })) continue;
        split(longest[f]);
        more = true;
      }
    }
    std::vector<Triangle> finer;
    for (int f = 0; f < count; ++f) {
      std::array<int, 3> on;
      for (int k = 0; k < 3; ++k) on[k] = middle[topology.edges_of_face(f)[k]];
      cut(triangles_[f], on, finer);
    }
    const bool changed = finer.size() > triangles_.size();
    triangles_ = std::move(finer);
    return changed;
  }

  double worst() const { return worst_; }
  std::size_t size() const { return triangles_.size(); }
  TriangleMesh mesh() const {
    TriangleMesh out;
    out.triangles = triangles_;
    out.vertices.resize(3, static_cast<Eigen::Index>(x_.size()));
    for (std::size_t k = 0; k < x_.size(); ++k) out.vertices.col(static_cast<Eigen::Index>(k)) = x_[k];
    return out;
  }

 private:
  struct OnTrim {
    int loop = 0, curve = 0;
    double t = 0;
  };
  struct Middle {
    Vector2d uv{0, 0};
    double off = 0;
    bool on_trim = false;
    OnTrim trim;
  };

  // Of an edge along a trim the middle of the trim between its ends.
  Middle middle_of(const std::array<int, 2>& edge, bool border) const {
    const int a = edge[0], b = edge[1];
    Middle out;
    out.uv = 0.5 * (uv_[a] + uv_[b]);
    if (border) {
      const double length = (uv_[b] - uv_[a]).norm();
      for (const OnTrim& s : trims_[a])
        for (const OnTrim& t : trims_[b]) {
          if (s.loop != t.loop || s.curve != t.curve) continue;
          const OnTrim half{s.loop, s.curve, 0.5 * (s.t + t.t)};
          const Vector2d uv = face_.loops[half.loop].curves[half.curve].curve(half.t);
          // Where a curve closes, its ends lie between neighbours too.
          if (!((uv - out.uv).norm() <= 0.5 * length)) continue;
          out.uv = uv;
          out.on_trim = true;
          out.trim = half;
        }
    }
    const auto look = [&](const Vector2d& uv, double share) {
      out.off = std::max(out.off, (face_.surface(uv.x(), uv.y()) - (1 - share) * x_[a] - share * x_[b]).norm());
    };
    look(out.uv, 0.5);
    look(0.5 * (uv_[a] + out.uv), 0.25);
    look(0.5 * (out.uv + uv_[b]), 0.75);
    return out;
  }

  int longest_edge(const MeshTopology& topology, int f) const {
    int best = 0;
    double most = -1;
    for (const int e : topology.edges_of_face(f)) {
      const auto [a, b] = topology.edge(e);
      if (const double length = (x_[b] - x_[a]).squaredNorm(); length > most) {
        most = length;
        best = e;
      }
    }
    return best;
  }

  // on[k]: the vertex on edge k, or -1.
  void cut(const Triangle& t, const std::array<int, 3>& on, std::vector<Triangle>& out) const {
    const auto halves = std::ranges::count_if(on, [](int v) { return v >= 0; });
    if (halves == 0) {
      out.push_back(t);
    } else if (halves == 3) {
      out.insert(out.end(), {{t[0], on[0], on[2]}, {on[0], t[1], on[1]}, {on[2], on[1], t[2]}, {on[0], on[1], on[2]}});
    } else {
      // Turned so that edge 0 is halved and, of two, edge 1 too.
      int k = 0;
      while (on[k] < 0 || (halves == 2 && on[(k + 1) % 3] < 0)) ++k;
      const int a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3], p = on[k], q = on[(k + 1) % 3];
      if (halves == 1) {
        out.insert(out.end(), {{a, p, c}, {p, b, c}});
      } else {
        out.push_back({p, b, q});
        if ((x_[q] - x_[a]).squaredNorm() < (x_[c] - x_[p]).squaredNorm())
          out.insert(out.end(), {{a, p, q}, {a, q, c}});
        else
          out.insert(out.end(), {{a, p, c}, {p, q, c}});
      }
    }
  }

  const TrimmedSurface& face_;
  std::vector<Vector2d> uv_;
  std::vector<Vector3d> x_;
  std::vector<Triangle> triangles_;
  std::vector<std::vector<OnTrim>> trims_;  // of each vertex
  double worst_ = 0;
};

}  // namespace

FaceTriangles face_triangles(const TrimmedSurface& face, double chord_error) {
  if (!(chord_error > 0) || !std::isfinite(chord_error))
    throw GeometryError(place_name(face) + ": its chord error is " + text(chord_error) +
                        ", must be positive and finite");
  constexpr double coarsest = 0.25;                // of the face's size
  constexpr std::size_t most_triangles = 1000000;  // of which the last round may make four
  const double size = bounding_box(face.surface).diagonal().norm();
  TriangulationOptions options;
  options.size = coarsest * size;
  Refinement refinement(face, triangulate(face, trace_trims(face), options));
  while (refinement.refine(chord_error) && refinement.size() < most_triangles) {
  }
  FaceTriangles out;
  out.mesh = refinement.mesh();
  out.chord_error = refinement.worst();
  return out;
}

}  // namespace toile
