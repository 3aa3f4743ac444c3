// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/arrangement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>

#include "geometry/error.h"
#include "trimming/bezier_piece.h"
#include "trimming/text.h"
#include "trimming/winding.h"

namespace toile {
namespace {

using Eigen::Vector2d;

// Distances are counted in tolerances: the plane is scaled so that both are 1.
constexpr double same = 2;         // places nearer than this are one vertex
constexpr double coincident = 4;   // pieces between two vertices that keep nearer than this are one edge
constexpr double flat = 1.0 / 16;  // a piece this near to its chord is crossed as a segment

// A part of a span, in its loop's direction, in scaled coordinates.
struct Part {
  int loop = 0, link = 0;  // link: the span's number in its loop
  int from = -1, to = -1;  // vertices
  BezierPiece piece;
};

struct Cut {
  double x = 0;  // on the part, in [0, 1]
  int vertex = 0;
};

// Calls f(i, j), i < j in the order of the lower ends, for the boxes that come nearer than `margin`.
template <class Call>
void for_near_boxes(const std::vector<Part>& parts, double margin, const Call& f) {
  std::vector<int> order(parts.size()), active;
  std::iota(order.begin(), order.end(), 0);
  const auto box = [&](int k) -> const Box& { return parts[static_cast<std::size_t>(k)].piece.box; };
  std::ranges::stable_sort(order, {}, [&](int k) { return box(k).min.x(); });
  for (const int b : order) {
    std::erase_if(active, [&](int a) { return box(a).max.x() + margin < box(b).min.x(); });
    for (const int a : active)
      if (box(a).max.y() + margin >= box(b).min.y() && box(b).max.y() + margin >= box(a).min.y())
        f(std::min(a, b), std::max(a, b));
    active.push_back(b);
  }
}

class Arranger {
 public:
  Arranger(const std::vector<TrimLoop>& loops, const Vector2d& tolerance)
      : loops_(loops), spans_(trim_spans(loops)), scale_(tolerance.cwiseInverse()) {}

  Arrangement run() {
    for (std::size_t l = 0; l < loops_.size(); ++l) add_loop(static_cast<int>(l));
    cut_at_vertices();
    cut_at_crossings();
    make_edges();
    make_components();
    for (ArrangedEdge& edge : out_.edges) decide_sides(edge);
    return std::move(out_);
  }

 private:
  const TrimCurve& curve(int loop, int c) const {
    return loops_[static_cast<std::size_t>(loop)].curves[static_cast<std::size_t>(c)];
  }
  Vector2d scaled(const Vector2d& x) const { return x.cwiseProduct(scale_); }
  Vector2d unscaled(const Vector2d& x) const { return x.cwiseQuotient(scale_); }
  Vector2d vertex(int v) const { return scaled(out_.vertices[static_cast<std::size_t>(v)]); }

  // The vertex at a place, within `same` of it; made where there is none.
  int vertex_at(const Vector2d& uv, int loop) {
    const Vector2d x = scaled(uv);
    const auto cell = [](const Vector2d& at) {
      return std::pair(std::llround(at.x() / (2 * same)), std::llround(at.y() / (2 * same)));
    };
    const auto [i, j] = cell(x);
    int best = -1;
    double least = same;
    for (long long a = i - 1; a <= i + 1; ++a)
      for (long long b = j - 1; b <= j + 1; ++b) {
        const auto found = grid_.find({a, b});
        if (found == grid_.end()) continue;
        for (const int v : found->second)
          if (const double d = (vertex(v) - x).norm(); d < least) {
            least = d;
            best = v;
          }
      }
    if (best >= 0) return best;
    best = static_cast<int>(out_.vertices.size());
    out_.vertices.push_back(uv);
    owner_.push_back(loop);
    grid_[{i, j}].push_back(best);
    return best;
  }

  // A vertex on a part along a line of constant u or v keeps that coordinate; of two such lines an earlier loop's goes
  // first, as its vertices do.
  void keep_level(const Part& part, int v) {
    if (part.loop >= owner_[static_cast<std::size_t>(v)]) return;
    for (int axis = 0; axis < 2; ++axis)
      if (const std::optional<double> level = level_of(part, axis))
        out_.vertices[static_cast<std::size_t>(v)][axis] = *level;
  }
  std::optional<double> level_of(const Part& part, int axis) const {
    const TrimSpan& span = links_[static_cast<std::size_t>(part.loop)][static_cast<std::size_t>(part.link)];
    for (int i = 1; i <= span.degree; ++i)
      if (span.point(i)[axis] != span.point(0)[axis]) return std::nullopt;
    return span.point(0)[axis];
  }

  void add_loop(int l) {
    std::vector<TrimSpan>& links = links_.emplace_back();
    const TrimLoop& loop = loops_[static_cast<std::size_t>(l)];
    for (std::size_t c = 0; c < loop.curves.size(); ++c) {
      const auto of = spans_.of(l, static_cast<int>(c));
      for (std::size_t k = 0; k < of.size(); ++k) {
        TrimSpan span = of[loop.curves[c].reversed ? of.size() - 1 - k : k];
        if (span.degenerate()) continue;
        if (loop.curves[c].reversed) turn(span);
        TrimSpan whole = span;
        for (std::size_t i = 0; i <= static_cast<std::size_t>(span.degree); ++i) {
          whole.u[i] *= scale_.x();
          whole.v[i] *= scale_.y();
        }
        if (BezierPiece(whole).is_point()) continue;  // its ends differ by their last bit
        const int link = static_cast<int>(links.size());
        links.push_back(span);
        const std::size_t first = parts_.size();
        split_forward(BezierPiece(whole), [&](const BezierPiece& piece) {
          parts_.push_back({l, link, -1, -1, piece});
        });
        for (std::size_t i = first; i < parts_.size(); ++i) {
          parts_[i].from = i == first ? vertex_at(span.first(), l) : parts_[i - 1].to;
          parts_[i].to = vertex_at(i + 1 == parts_.size() ? span.last() : unscaled(parts_[i].piece.last()), l);
        }
      }
    }
  }

  // ---- cutting ----

  void cut_at_vertices() {
    std::vector<std::vector<Cut>> cuts(parts_.size());
    std::vector<int> order(out_.vertices.size());
    std::iota(order.begin(), order.end(), 0);
    std::ranges::sort(order, {}, [&](int v) { return vertex(v).x(); });
    std::vector<double> x;
    for (const int v : order) x.push_back(vertex(v).x());
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      const Part& part = parts_[p];
      const auto begin = std::lower_bound(x.begin(), x.end(), part.piece.box.min.x() - same);
      for (auto k = begin; k != x.end() && *k <= part.piece.box.max.x() + same; ++k) {
        const int v = order[static_cast<std::size_t>(k - x.begin())];
        if (v == part.from || v == part.to) continue;
        const Vector2d at = vertex(v);
        if (at.y() < part.piece.box.min.y() - same || at.y() > part.piece.box.max.y() + same) continue;
        const auto [s, distance] = nearest(part.piece, at);
        if (distance > same) continue;
        cuts[p].push_back({s, v});
        keep_level(part, v);
      }
    }
    cut(cuts);
  }

  void cut_at_crossings() {
    std::vector<std::vector<Cut>> cuts(parts_.size());
    for_near_boxes(parts_, 0, [&](int i, int j) {
      const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
      if (coincide(parts_[a], parts_[b])) return;
      crossings(parts_[a].piece, parts_[b].piece, flat, [&](double s, double t) {
        const int v = crossing_vertex(parts_[a], s, parts_[b], t);
        if (v != parts_[a].from && v != parts_[a].to) cuts[a].push_back({s, v});
        if (v != parts_[b].from && v != parts_[b].to) cuts[b].push_back({t, v});
      });
    });
    cut(cuts);
  }

  int crossing_vertex(const Part& a, double s, const Part& b, double t) {
    Vector2d x = unscaled(0.5 * (a.piece.at(s) + b.piece.at(t)));
    for (int axis = 0; axis < 2; ++axis) {
      const auto level_a = level_of(a, axis), level_b = level_of(b, axis);
      if (level_a || level_b) x[axis] = !level_b || (level_a && a.loop <= b.loop) ? *level_a : *level_b;
    }
    const int v = vertex_at(x, std::min(a.loop, b.loop));
    keep_level(a, v);
    keep_level(b, v);
    return v;
  }

  void cut(std::vector<std::vector<Cut>>& cuts) {
    std::vector<Part> out;
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      Part rest = parts_[p];
      std::ranges::stable_sort(cuts[p], {}, &Cut::x);
      double done = 0;
      for (const Cut& c : cuts[p]) {
        if (c.vertex == rest.from || !(c.x > done) || !(c.x < 1)) continue;
        Part left = rest;
        std::tie(left.piece, rest.piece) = split(rest.piece, (c.x - done) / (1 - done));
        left.to = rest.from = c.vertex;
        done = c.x;
        out.push_back(std::move(left));
      }
      if (rest.from != rest.to || rest.piece.size() > coincident) out.push_back(std::move(rest));
    }
    parts_ = std::move(out);
  }

  static bool coincide(const Part& a, const Part& b) {
    if (std::minmax(a.from, a.to) != std::minmax(b.from, b.to)) return false;
    for (const double s : {0.5, 0.25, 0.75, 0.125, 0.375, 0.625, 0.875})
      if (nearest(b.piece, a.piece.at(s)).second > coincident) return false;
    return true;
  }

  // ---- the map ----

  void make_edges() {
    out_.chains.resize(loops_.size());
    std::map<std::pair<int, int>, std::vector<int>> between;  // edges by their vertices
    std::vector<const Part*> first;
    for (const Part& part : parts_) {
      std::vector<int>& edges = between[std::minmax(part.from, part.to)];
      const auto known =
          std::ranges::find_if(edges, [&](int e) { return coincide(*first[static_cast<std::size_t>(e)], part); });
      int e = static_cast<int>(out_.edges.size());
      if (known != edges.end()) {
        e = *known;
      } else {
        edges.push_back(e);
        first.push_back(&part);
        ArrangedEdge& edge = out_.edges.emplace_back();
        edge.from = part.from;
        edge.to = part.to;
        edge.near_from = unscaled(part.piece.at(1e-3));
        edge.near_to = unscaled(part.piece.at(1 - 1e-3));
        edge.middle = unscaled(part.piece.at(0.5));
      }
      ArrangedEdge& edge = out_.edges[static_cast<std::size_t>(e)];
      out_.chains[static_cast<std::size_t>(part.loop)].push_back({e, static_cast<int>(edge.uses.size())});
      edge.uses.push_back(use_of(part, edge));
    }
    for (const Part* part : first) pieces_.push_back(part->piece);
  }

  ArrangedEdge::Use use_of(const Part& part, const ArrangedEdge& edge) const {
    const TrimSpan& span = links_[static_cast<std::size_t>(part.loop)][static_cast<std::size_t>(part.link)];
    const bool reversed = curve(part.loop, span.curve).reversed;
    const auto t = [&](double s) { return span.t(reversed ? 1 - s : s); };
    // A closed edge is judged by its inside: it runs forward, or the two never coincide.
    const bool forward = part.from == edge.from;
    ArrangedEdge::Use use{part.loop, span.curve, t(part.piece.s0), t(part.piece.s1), forward};
    if (!forward) std::swap(use.t0, use.t1);
    return use;
  }

  void make_components() {
    std::vector<int> parent(loops_.size()), of_vertex(out_.vertices.size(), -1);
    std::iota(parent.begin(), parent.end(), 0);
    const auto root = [&](int l) {
      while (parent[static_cast<std::size_t>(l)] != l) l = parent[static_cast<std::size_t>(l)];
      return l;
    };
    for (const ArrangedEdge& edge : out_.edges)
      for (const auto& use : edge.uses)
        for (const int v : {edge.from, edge.to}) {
          int& holder = of_vertex[static_cast<std::size_t>(v)];
          if (holder < 0) holder = use.loop;
          const int a = root(holder), b = root(use.loop);
          parent[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
        }
    for (std::size_t l = 0; l < loops_.size(); ++l) out_.component.push_back(root(static_cast<int>(l)));
  }

  // ---- sides ----

  std::optional<int> winding(int l, const Vector2d& uv) { return winding_number(loops_, spans_, l, uv, counts_); }

  [[noreturn]] static void undecided(const Vector2d& uv) {
    throw GeometryError("loops come so near to each other that what lies between them can't be decided, at " +
                        point_text(uv));
  }

  void decide_sides(ArrangedEdge& edge) {
    const BezierPiece& piece = pieces_[static_cast<std::size_t>(&edge - out_.edges.data())];
    const int component = out_.component[static_cast<std::size_t>(edge.uses[0].loop)];
    for (int l = component; l < static_cast<int>(loops_.size()); ++l) {
      if (out_.component[static_cast<std::size_t>(l)] != component) continue;
      int runs = 0;
      bool used = false;
      for (const auto& use : edge.uses)
        if (use.loop == l) {
          used = true;
          runs += use.forward ? 1 : -1;
        }
      const auto [left, right] = used ? beside(l, piece, runs) : std::pair(along(l, piece), along(l, piece));
      if (left != 0 || right != 0) edge.sides.push_back({l, left, right});
    }
  }

  // Of a loop that has no run along the piece: its places must agree.
  int along(int l, const BezierPiece& piece) {
    std::optional<int> known;
    for (const double s : {0.5, 0.3, 0.8, 0.1, 0.95}) {
      const std::optional<int> n = winding(l, unscaled(piece.at(s)));
      if (n && known.value_or(*n) != *n) undecided(unscaled(piece.at(s)));
      if (n) known = n;
    }
    if (!known) undecided(unscaled(piece.at(0.5)));
    return *known;
  }

  // Of a loop that runs along it: places a little off it, the nearest first at which both sides are told apart.
  std::pair<int, int> beside(int l, const BezierPiece& piece, int runs) {
    for (double reach = 2 * coincident; reach < std::max(piece.size(), 16 * coincident); reach *= 2)
      for (const double s : {0.5, 0.3, 0.7, 0.15, 0.85}) {
        const Vector2d x = piece.at(s), chord = piece.at(s + 1e-3) - piece.at(s - 1e-3);
        const Vector2d normal = Vector2d(-chord.y(), chord.x()).normalized();
        const auto left = winding(l, unscaled(x + reach * normal)), right = winding(l, unscaled(x - reach * normal));
        if (left && right && *left - *right == runs) return {*left, *right};
      }
    undecided(unscaled(piece.at(0.5)));
  }

  const std::vector<TrimLoop>& loops_;
  TrimSpans spans_;
  Vector2d scale_;
  std::vector<std::vector<TrimSpan>> links_;  // spans of each loop in its direction, not scaled
  std::vector<Part> parts_;                   // in loop order
  std::vector<BezierPiece> pieces_;           // of each edge
  std::vector<int> owner_;                    // of each vertex: the first loop through it
  std::map<std::pair<long long, long long>, std::vector<int>> grid_;
  PredicateCounts counts_;
  Arrangement out_;
};

}  // namespace

Arrangement arrange(const std::vector<TrimLoop>& loops, const Vector2d& tolerance) {
  return Arranger(loops, tolerance).run();
}

}  // namespace toile
