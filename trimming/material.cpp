// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/material.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>

#include "geometry/error.h"
#include "geometry/refine.h"
#include "trimming/arrangement.h"
#include "trimming/contacts.h"
#include "trimming/text.h"
#include "trimming/winding.h"

namespace toile {
namespace {

using Eigen::Vector2d;

constexpr int nothing = -1;  // no material

[[noreturn]] void refuse(const std::string& what, const Vector2d& uv) {
  throw GeometryError(what + ", at " + point_text(uv));
}

// Loops that meet each other, taken apart along the edges of their arrangement.
class Resolver {
 public:
  Resolver(const std::vector<TrimLoop>& loops, const Arrangement& arrangement, bool outer_known, Material& out)
      : loops_(loops), map_(arrangement), known_(outer_known), out_(out) {}

  // The simple loops of a component, with their sources.
  void run(int component, std::vector<TrimLoop>& made, std::vector<int>& source) {
    for (int l = component; l < static_cast<int>(loops_.size()); ++l)
      if (map_.component[index(l)] == component) members_.push_back(l);
    for (std::size_t e = 0; e < map_.edges.size(); ++e)
      if (map_.component[index(map_.edges[e].uses[0].loop)] == component) edges_.push_back(static_cast<int>(e));
    check_loops();
    decide_roles();
    find_borders();
    for (const int l : members_)
      if (clean(l)) {
        made.push_back(loops_[index(l)]);
        source.push_back(l);
      }
    for (TrimLoop& loop : walk()) {
      made.push_back(std::move(loop));
      source.push_back(-1);
    }
    collect_slits();
    report();
  }

  struct Slit {
    PanelMark mark;
    Vector2d middle;
    int loop;
  };
  std::vector<Slit> slits;

 private:
  static std::size_t index(int i) { return static_cast<std::size_t>(i); }
  const ArrangedEdge& edge(int e) const { return map_.edges[index(e)]; }

  static int winding(const ArrangedEdge& e, int loop, bool left) {
    for (const auto& s : e.sides)
      if (s.loop == loop) return left ? s.left : s.right;
    return 0;
  }
  bool in(int e, int loop, bool left) const { return winding(edge(e), loop, left) != 0; }

  // A loop winds once around what it bounds, everywhere in one direction. A hole may bound nothing: a line out and
  // back.
  void check_loops() {
    bare_.assign(loops_.size(), false);
    for (const int l : members_) {
      int seen = 0;
      for (const int e : edges_)
        for (const bool left : {true, false}) {
          const int w = winding(edge(e), l, left);
          if (w == 0 || w == seen) continue;
          if (seen != 0 || std::abs(w) > 1) refuse("loop " + number(l) + " crosses itself", edge(e).middle);
          seen = w;
        }
      bare_[index(l)] = seen == 0;
      if (seen == 0 && !(known_ && l > 0)) refuse("loop " + number(l) + " bounds nothing", edge(edges_.front()).middle);
    }
  }
  std::string number(int l) const { return std::to_string(loops_[index(l)].index); }

  // A place where both, or only one, of two loops hold the plane.
  struct Overlap {
    std::optional<int> both, first, second;
  };
  Overlap overlap(int a, int b) const {
    Overlap out;
    for (const int e : edges_)
      for (const bool left : {true, false}) {
        const bool x = in(e, a, left), y = in(e, b, left);
        if (x && y) out.both = e;
        if (x && !y) out.first = e;
        if (y && !x) out.second = e;
      }
    return out;
  }

  void decide_roles() {
    beside_.assign(loops_.size(), false);
    if (!known_) return nest(members_);
    if (members_.front() != 0) return;  // holes only: their union
    outer_ = 0;
    for (const int l : members_) {
      if (l == 0 || bare_[index(l)]) continue;
      const Overlap o = overlap(0, l);
      if (!o.first && !o.second)
        refuse("loop " + number(l) + " is the outer loop again: nothing is left", edge(*o.both).middle);
      if (!o.first && outer_ == 0) outer_ = l;  // it holds the loop that is called the outer one
    }
    std::vector<int> outside;
    for (const int l : members_)
      if (l != outer_ && !bare_[index(l)] && !overlap(outer_, l).both) outside.push_back(l);
    nest(outside);
    // A loop that lies beside the outer one is a second outer loop where it is around others, else it takes nothing
    // away.
    for (const int l : outside) {
      beside_[index(l)] = std::ranges::any_of(outside, [&](int m) { return m != l && overlap(l, m).both.has_value(); });
      if (!beside_[index(l)]) out_.idle.push_back(l);
    }
  }

  // Loops of which none is known to be a hole lie within or beside each other.
  void nest(const std::vector<int>& loops) const {
    for (std::size_t i = 0; i < loops.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) {
        const Overlap o = overlap(loops[j], loops[i]);
        if (!o.both) continue;
        if (o.first && o.second)
          refuse("loops " + number(loops[j]) + " and " + number(loops[i]) +
                     " overlap, and the file doesn't say which of them is a hole",
                 edge(*o.both).middle);
        if (!o.first && !o.second)
          refuse("loops " + number(loops[j]) + " and " + number(loops[i]) + " are the same", edge(*o.both).middle);
      }
  }

  // The piece of material on a side of an edge: the number of the loop that bounds it from outside.
  int label(int e, bool left) const {
    const auto innermost_of = [&](auto&& counts) {
      // Of loops within each other, the one that no other of them lies in has the most around it.
      int depth = 0, last = nothing;
      for (const int l : members_) {
        if (!counts(l) || !in(e, l, left)) continue;
        ++depth;
        if (last == nothing || !overlap(l, last).first) last = l;
      }
      return depth % 2 == 1 ? last : nothing;
    };
    if (!known_) return innermost_of([](int) { return true; });
    if (outer_ == nothing) {
      for (const int l : members_)
        if (in(e, l, left)) return members_.front();
      return nothing;
    }
    if (!in(e, outer_, left)) return innermost_of([&](int l) { return static_cast<bool>(beside_[index(l)]); });
    for (const int l : members_)
      if (l != outer_ && in(e, l, left)) return nothing;
    return outer_;
  }

  // An edge in the direction that has the material on its left.
  struct Border {
    int edge = 0;
    bool forward = true;
    int label = 0;
    bool walked = false;
  };

  void find_borders() {
    of_edge_.assign(map_.edges.size(), {});
    for (const int e : edges_) {
      const int left = label(e, true), right = label(e, false);
      if (left == right) continue;
      if (left != nothing) add_border({e, true, left, false});
      if (right != nothing) add_border({e, false, right, false});
    }
  }
  void add_border(const Border& border) {
    const int b = static_cast<int>(borders_.size());
    of_edge_[index(border.edge)].push_back(b);
    out_of_[border.forward ? edge(border.edge).from : edge(border.edge).to].push_back(b);
    borders_.push_back(border);
  }

  // A loop none of whose edges another shares, all of them borders of one piece of material on one side.
  bool clean(int l) {
    std::vector<int> own;
    for (const auto& step : map_.chains[index(l)]) {
      const std::vector<int>& borders = of_edge_[index(step.edge)];
      if (edge(step.edge).uses.size() != 1 || borders.size() != 1) return false;
      own.push_back(borders[0]);
      const auto along = [&](int b) {
        const Border& border = borders_[index(b)];
        return edge(border.edge).uses[0].forward == border.forward;
      };
      if (along(own.back()) != along(own.front())) return false;
      if (borders_[index(own.back())].label != borders_[index(own.front())].label) return false;
    }
    for (const int b : own) borders_[index(b)].walked = true;
    return !own.empty();
  }

  int end_of(const Border& b) const { return b.forward ? edge(b.edge).to : edge(b.edge).from; }

  std::vector<TrimLoop> walk() {
    std::vector<TrimLoop> out;
    // Each loop begins where its first curve in the file's order does.
    for (const int l : members_)
      for (const auto& step : map_.chains[index(l)])
        for (const int b : of_edge_[index(step.edge)]) {
          if (borders_[index(b)].walked) continue;
          std::vector<int> chain;
          for (int at = b; at != nothing; at = next(at, b)) {
            borders_[index(at)].walked = true;
            chain.push_back(at);
          }
          out.push_back(loop_of(chain));
        }
    return out;
  }

  // The border that goes on after one: along the same loop where that is a border too, else the one that keeps to the
  // same sector of material. Nothing where the loop is closed.
  int next(int at, int first) const {
    const Border& b = borders_[index(at)];
    const int v = end_of(b);
    std::vector<int> open;
    bool closes = false;
    for (const int c : out_of_.at(v)) {
      const Border& other = borders_[index(c)];
      if (other.label != b.label) continue;
      if (c == first) closes = true;
      if (!other.walked) open.push_back(c);
    }
    if (open.empty()) {
      if (!closes) refuse("the loops can't be taken apart", map_.vertices[index(v)]);
      return nothing;
    }
    if (closes) open.push_back(first);
    if (open.size() == 1) return open[0];
    return sharpest(b, open, first);
  }

  // The first of several borders clockwise from the one that ends: what lies between them is one sector of material.
  int sharpest(const Border& b, const std::vector<int>& open, int first) const {
    constexpr double full = 2 * std::numbers::pi, unclear = 1e-9;
    std::vector<std::pair<double, int>> turns;
    for (const int c : open) {
      const double turn = direction(b, false) - direction(borders_[index(c)], true);
      turns.emplace_back(turn - full * std::floor(turn / full), c);
    }
    std::ranges::sort(turns);
    if (turns[0].first < unclear || turns.back().first > full - unclear || turns[1].first - turns[0].first < unclear)
      refuse("loops leave a place in one direction and can't be told apart", map_.vertices[index(end_of(b))]);
    return turns[0].second == first ? nothing : turns[0].second;
  }

  // Direction [rad] in which a border leaves its start, or in which its end looks back.
  double direction(const Border& b, bool start) const {
    const ArrangedEdge& e = edge(b.edge);
    const bool from = b.forward == start;
    const Vector2d d = from ? e.near_from - map_.vertices[index(e.from)] : e.near_to - map_.vertices[index(e.to)];
    return std::atan2(d.y(), d.x());
  }

  // ---- curves ----

  // A run along one curve of the file.
  struct Run {
    int loop = 0, curve = 0;
    double t0 = 0, t1 = 0;  // in the direction of the new loop
    Vector2d from, to;
  };

  Run run_of(const Border& b, const Run* before) const {
    const ArrangedEdge& e = edge(b.edge);
    const ArrangedEdge::Use* best = &e.uses[0];
    for (const auto& use : e.uses)
      if (before ? use.loop == before->loop && use.curve == before->curve : use.loop < best->loop) best = &use;
    const Vector2d &x = map_.vertices[index(e.from)], &y = map_.vertices[index(e.to)];
    if (b.forward) return {best->loop, best->curve, best->t0, best->t1, x, y};
    return {best->loop, best->curve, best->t1, best->t0, y, x};
  }

  static bool continues(const Run& a, const Run& b) {
    return a.loop == b.loop && a.curve == b.curve && a.t1 == b.t0 && (a.t1 > a.t0) == (b.t1 > b.t0);
  }

  TrimLoop loop_of(const std::vector<int>& chain) {
    std::vector<Run> runs;
    for (const int b : chain) {
      const Run run = run_of(borders_[index(b)], runs.empty() ? nullptr : &runs.back());
      if (!runs.empty() && continues(runs.back(), run)) {
        runs.back().t1 = run.t1;
        runs.back().to = run.to;
      } else {
        runs.push_back(run);
      }
    }
    if (runs.size() > 1 && continues(runs.back(), runs.front())) {
      runs.front().t0 = runs.back().t0;
      runs.front().from = runs.back().from;
      runs.pop_back();
    }
    std::set<int> sources;
    for (const Run& run : runs) sources.insert(run.loop);
    TrimLoop loop;
    loop.index = loops_[index(*sources.begin())].index;
    std::map<int, int> offset;  // of the numbers of each loop of the file, whose copies share them
    int numbers = 0;
    for (const int l : sources) {
      const auto [known, added] = offset.try_emplace(loops_[index(l)].index, numbers);
      if (!added) continue;
      for (const TrimCurve& c : loops_[index(l)].curves) numbers = std::max(numbers, known->second + c.index + 1);
    }
    for (const Run& run : runs) {
      loop.curves.push_back(curve_of(run));
      loop.curves.back().index += offset[loops_[index(run.loop)].index];
    }
    return loop;
  }

  TrimCurve curve_of(const Run& run) const {
    const TrimCurve& given = loops_[index(run.loop)].curves[index(run.curve)];
    TrimCurve out = given;
    out.reversed = run.t1 < run.t0;
    const Interval range{std::min(run.t0, run.t1), std::max(run.t0, run.t1)};
    if (range.min != given.curve.domain().min || range.max != given.curve.domain().max) {
      out.curve = sub_curve(given.curve, range);
      out.model.reset();
    }
    Curve2::Points points = out.curve.points();
    points.col(0) = out.reversed ? run.to : run.from;
    points.rightCols(1) = out.reversed ? run.from : run.to;
    if (points != out.curve.points()) {
      // A line of constant u or v stays one.
      for (int axis = 0; axis < 2; ++axis)
        if ((given.curve.points().row(axis).array() == given.curve.points()(axis, 0)).all() &&
            points(axis, 0) == points(axis, points.cols() - 1))
          points.row(axis).setConstant(points(axis, 0));
      out.curve = Curve2(out.curve.knots(), std::move(points), out.curve.weights());
    }
    return out;
  }

  // ---- pieces that bound nothing ----

  bool bounds_nothing(int e, int l) const {
    int runs = 0, sum = 0;
    for (const auto& use : edge(e).uses)
      if (use.loop == l) {
        ++runs;
        sum += use.forward ? 1 : -1;
      }
    return runs > 1 && sum == 0 && of_edge_[index(e)].empty();
  }
  bool on_border(int v) const { return out_of_.contains(v); }

  void collect_slits() {
    std::set<int> taken;
    for (const int l : members_) {
      std::vector<Run> runs;
      std::vector<Vector2d> middles;
      std::vector<std::array<int, 2>> ends;
      for (const auto& step : map_.chains[index(l)]) {
        if (!bounds_nothing(step.edge, l) || !taken.insert(step.edge).second) continue;
        const ArrangedEdge& e = edge(step.edge);
        const Run run =
            run_of({step.edge, e.uses[index(step.use)].forward, 0, false}, runs.empty() ? nullptr : &runs.back());
        const std::array<int, 2> at =
            e.uses[index(step.use)].forward ? std::array{e.from, e.to} : std::array{e.to, e.from};
        if (!runs.empty() && continues(runs.back(), run) && !on_border(at[0])) {
          runs.back().t1 = run.t1;
          runs.back().to = run.to;
          ends.back()[1] = at[1];
        } else {
          runs.push_back(run);
          middles.push_back(e.middle);
          ends.push_back(at);
        }
      }
      for (std::size_t i = 0; i < runs.size(); ++i) {
        PanelMark mark;
        const TrimCurve c = curve_of(runs[i]);
        mark.at = c.reversed ? c.curve.end() : c.curve.start();
        mark.curve = c.reversed ? reversed(c.curve) : c.curve;
        mark.kind = MarkKind::slit;
        if (on_border(ends[i][0]) && on_border(ends[i][1])) mark.text = "bridge";
        slits.push_back({std::move(mark), middles[i], l});
      }
    }
  }

  void report() {
    for (const int l : members_) {
      const auto& chain = map_.chains[index(l)];
      const auto shared = std::ranges::find_if(chain, [&](const auto& step) {
        return edge(step.edge).uses.size() > 1 || of_edge_[index(step.edge)].empty();
      });
      if (shared == chain.end()) continue;
      const int e = shared->edge;
      if (bounds_nothing(e, l) || std::ranges::find(out_.idle, l) != out_.idle.end()) continue;  // said elsewhere
      const bool hole = known_ && l != (outer_ == nothing ? members_.front() : outer_);
      if (known_ && outer_ != nothing && l == outer_) continue;  // said with the hole
      out_.changes.push_back({loops_[index(l)].index,
                              hole ? "crosses or runs along another loop; both are cut there and joined"
                                   : "shares an edge with another loop; both are cut there",
                              0, edge(e).middle});
    }
  }

  const std::vector<TrimLoop>& loops_;
  const Arrangement& map_;
  bool known_;
  Material& out_;
  std::vector<int> members_, edges_;
  int outer_ = nothing;
  std::vector<bool> beside_, bare_;
  std::vector<Border> borders_;
  std::vector<std::vector<int>> of_edge_;   // borders of each edge
  std::map<int, std::vector<int>> out_of_;  // borders that leave each vertex
};

// Panels of simple loops that don't cross: a loop within an odd number of others is a hole.
// Where one of them is known to be the outer loop, one of the given loops that lies beside it bounds nothing.
void group(std::vector<TrimLoop>& loops, const std::vector<int>& source, bool outer_known, Material& out) {
  const TrimSpans spans = trim_spans(loops);
  PredicateCounts counts;
  const int n = static_cast<int>(loops.size());
  std::vector<std::vector<int>> around(loops.size());
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      if (i != j && winding_around(loops, spans, i, j, counts) != 0) around[static_cast<std::size_t>(i)].push_back(j);
  std::vector<int> panel(loops.size());
  const auto add = [&](int l, std::size_t to, LoopKind kind) {
    Material::Panel& p = out.panels[to];
    p.loops.push_back(std::move(loops[static_cast<std::size_t>(l)]));
    p.loops.back().kind = kind;
    p.source.push_back(source[static_cast<std::size_t>(l)]);
  };
  const auto idle = [&](int l) {
    return outer_known && source[static_cast<std::size_t>(l)] > 0 && around[static_cast<std::size_t>(l)].empty() &&
           std::ranges::none_of(
               around, [&](const std::vector<int>& others) { return std::ranges::find(others, l) != others.end(); });
  };
  for (int l = 0; l < n; ++l) {
    if (around[static_cast<std::size_t>(l)].size() % 2 != 0) continue;
    if (idle(l)) {
      out.idle.push_back(source[static_cast<std::size_t>(l)]);
      continue;
    }
    panel[static_cast<std::size_t>(l)] = static_cast<int>(out.panels.size());
    out.panels.emplace_back();
    add(l, out.panels.size() - 1, LoopKind::outer);
  }
  for (int l = 0; l < n; ++l) {
    const std::vector<int>& others = around[static_cast<std::size_t>(l)];
    if (others.size() % 2 == 0) continue;
    // Of the loops around it the innermost has the most around itself.
    const int parent =
        *std::ranges::max_element(others, {}, [&](int j) { return around[static_cast<std::size_t>(j)].size(); });
    add(l, static_cast<std::size_t>(panel[static_cast<std::size_t>(parent)]), LoopKind::hole);
  }
}

bool holds(const Material::Panel& panel, const TrimSpans& spans, const Vector2d& uv, PredicateCounts& counts) {
  for (std::size_t l = 0; l < panel.loops.size(); ++l)
    if ((winding_number(panel.loops, spans, static_cast<int>(l), uv, counts).value_or(0) != 0) != (l == 0))
      return false;
  return true;
}

// A loop may be given several times, a period apart: one that counts is enough.
void report_idle(const std::vector<TrimLoop>& loops, Material& out) {
  std::set<int> counts;
  for (int l = 0; l < static_cast<int>(loops.size()); ++l)
    if (std::ranges::find(out.idle, l) == out.idle.end()) counts.insert(loops[static_cast<std::size_t>(l)].index);
  for (const int l : out.idle) {
    const TrimLoop& loop = loops[static_cast<std::size_t>(l)];
    if (!counts.insert(loop.index).second) continue;
    const TrimCurve& c = loop.curves.front();
    out.changes.push_back({loop.index, "lies beside the outer loop, where it takes nothing away; it is left out", 0,
                           c.reversed ? c.curve.end() : c.curve.start()});
  }
}

void add_slits(std::vector<Resolver::Slit>& slits, const std::vector<TrimLoop>& loops, Material& out) {
  if (slits.empty()) return;
  PredicateCounts counts;
  std::vector<TrimSpans> spans;
  for (const Material::Panel& panel : out.panels) spans.push_back(trim_spans(panel.loops));
  for (Resolver::Slit& slit : slits) {
    std::string what = "an edge run out and back bounds nothing; it is left out";
    for (std::size_t p = 0; p < out.panels.size(); ++p) {
      if (!holds(out.panels[p], spans[p], slit.middle, counts)) continue;
      what = slit.mark.text.empty() ? "an edge run out and back is kept as a mark, a slit"
                                    : "an edge run twice joins two loops; they are parted, and it is kept as a mark";
      out.panels[p].marks.push_back(std::move(slit.mark));
      break;
    }
    out.changes.push_back({loops[static_cast<std::size_t>(slit.loop)].index, what, 0, slit.middle});
  }
}

}  // namespace

Eigen::Vector2d meeting_tolerance(const TrimmedSurface& surface) {
  const auto& points = surface.surface.points();
  const double size = (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).norm();
  const double share = size > 0 ? std::clamp(surface.resolution / size, 1e-10, 1e-6) : 1e-10;
  return share * Eigen::Vector2d(surface.surface.u().domain().length(), surface.surface.v().domain().length());
}

Material material_of(const std::vector<TrimLoop>& loops, const MaterialOptions& options) {
  Material out;
  std::vector<TrimLoop> simple;
  std::vector<int> source;
  std::vector<Resolver::Slit> slits;
  const std::vector<LoopContact> contacts = find_contacts(loops, trim_spans(loops));
  if (std::ranges::all_of(contacts, [](const LoopContact& c) { return c.kind == ContactKind::touch; })) {
    simple = loops;
    source.resize(loops.size());
    std::iota(source.begin(), source.end(), 0);
  } else {
    const Arrangement map = arrange(loops, options.tolerance);
    for (int l = 0; l < static_cast<int>(loops.size()); ++l) {
      if (map.component[static_cast<std::size_t>(l)] != l) continue;
      Resolver resolver(loops, map, options.outer_known, out);
      resolver.run(l, simple, source);
      std::ranges::move(resolver.slits, std::back_inserter(slits));
    }
  }
  group(simple, source, options.outer_known, out);
  report_idle(loops, out);
  if (out.panels.empty()) throw GeometryError("the loops leave no material");
  add_slits(slits, loops, out);
  return out;
}

}  // namespace toile
