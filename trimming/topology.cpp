// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/topology.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "geometry/error.h"
#include "trimming/crossings.h"
#include "trimming/text.h"

namespace toile {
namespace {

// Where a point or an open arc lies among the knot lines of each direction: 2k on line k, 2k + 1 between k and k + 1.
struct Place {
  int u = 0, v = 0;
  bool operator==(const Place&) const = default;
};

bool on_line(int place) {
  return place % 2 == 0;
}

int place_of(double x, const std::vector<double>& lines) {
  const auto at = std::lower_bound(lines.begin(), lines.end(), x);
  const int k = static_cast<int>(at - lines.begin());
  return at != lines.end() && *at == x ? 2 * k : 2 * k - 1;
}

// A point at which a loop meets knot lines, or a joint of two spans that may turn out to be one.
struct Node {
  Place place;
  int curve = 0;
  double t = 0;
  Eigen::Vector2d uv{0, 0};
  double error = 0;  // bound on uv's rounding; knot coordinates and joints are exact
};

// A part of one curve inside an arc.
struct Portion {
  int curve = 0;
  double t0 = 0, t1 = 0;
  Eigen::Vector2d from{0, 0}, to{0, 0};
};

// What a loop does between two nodes: within one open cell, or along one knot line.
struct Arc {
  Place place;
  int loop = 0;
  int from = -1, to = -1;  // into Tracer::nodes; -1: a whole loop that meets no knot line
  std::vector<Portion> portions;
};

// A root of some knot line on one span.
struct SpanEvent {
  std::optional<LineForm> u, v;
  int line_u = -1, line_v = -1;
  LineRoot root;
  bool crosses_u = false, crosses_v = false;
};

class Tracer {
 public:
  explicit Tracer(const TrimmedSurface& surface) : surface_(surface) {
    out_.mesh = knot_mesh(surface.surface);
    out_.spans = trim_spans(surface.loops);
  }

  TrimTopology run() {
    for (int l = 0; l < static_cast<int>(surface_.loops.size()); ++l) walk(l);
    classify();
    return std::move(out_);
  }

 private:
  const std::vector<double>& lines(Axis axis) const { return axis == Axis::u ? out_.mesh.u : out_.mesh.v; }
  const TrimLoop& loop(int l) const { return surface_.loops[static_cast<std::size_t>(l)]; }
  [[noreturn]] void fail(int l, int curve, const std::string& what, const Eigen::Vector2d& uv) const {
    const TrimLoop& of = loop(l);
    throw GeometryError(place_name(surface_, of, &of.curves[static_cast<std::size_t>(curve)]) + ": " + what + " at " +
                        point_text(uv));
  }

  void add_roots(const TrimSpan& span, Axis axis, std::vector<SpanEvent>& events) {
    const auto& x = axis == Axis::u ? span.u : span.v;
    const auto [low, high] = std::minmax_element(x.begin(), x.begin() + span.degree + 1);
    const std::vector<double>& all = lines(axis);
    for (auto line = std::lower_bound(all.begin(), all.end(), *low); line != all.end() && *line <= *high; ++line) {
      const LineForm form(span, axis, *line);
      if (form.zero()) continue;
      for (LineRoot& root : roots(form, out_.counts)) {
        SpanEvent event;
        (axis == Axis::u ? event.line_u : event.line_v) = static_cast<int>(line - all.begin());
        (axis == Axis::u ? event.u : event.v) = form;
        (axis == Axis::u ? event.crosses_u : event.crosses_v) = root.crosses;
        event.root = std::move(root);
        events.push_back(std::move(event));
      }
    }
  }

  int order(SpanEvent& a, SpanEvent& b) {
    return compare(a.u ? *a.u : *a.v, a.root, b.u ? *b.u : *b.v, b.root, out_.counts);
  }

  // Events in the open span, ascending; a u- and a v-root at one parameter become one event.
  std::vector<SpanEvent> span_events(const TrimSpan& span) {
    std::vector<SpanEvent> of_u, of_v, merged;
    add_roots(span, Axis::u, of_u);
    add_roots(span, Axis::v, of_v);
    const auto ascending = [this](SpanEvent& a, SpanEvent& b) { return order(a, b) < 0; };
    // Insertion sort: the comparison narrows what it compares.
    for (std::vector<SpanEvent>* list : {&of_u, &of_v}) {
      for (std::size_t i = 1; i < list->size(); ++i) {
        for (std::size_t k = i; k > 0 && ascending((*list)[k], (*list)[k - 1]); --k)
          std::swap((*list)[k], (*list)[k - 1]);
      }
    }
    std::size_t i = 0, j = 0;
    while (i < of_u.size() || j < of_v.size()) {
      const int c = i == of_u.size() ? 1 : j == of_v.size() ? -1 : order(of_u[i], of_v[j]);
      if (c < 0) {
        merged.push_back(std::move(of_u[i++]));
      } else if (c > 0) {
        merged.push_back(std::move(of_v[j++]));
      } else {
        SpanEvent both = std::move(of_u[i++]);
        both.line_v = of_v[j].line_v;
        both.crosses_v = of_v[j++].crosses_v;
        merged.push_back(std::move(both));
      }
    }
    return merged;
  }

  Node joint(const TrimSpan& span, bool end) const {
    Node node;
    node.uv = end ? span.last() : span.first();
    node.place = {place_of(node.uv.x(), out_.mesh.u), place_of(node.uv.y(), out_.mesh.v)};
    node.curve = span.curve;
    node.t = end ? span.range.max : span.range.min;
    return node;
  }

  Node interior_node(const TrimSpan& span, const SpanEvent& event, Place before) const {
    Node node;
    node.place = before;
    node.curve = span.curve;
    node.t = span.t(event.root.s());
    const Eigen::Vector2d x = span.at(event.root.s());
    node.uv = x;
    for (int axis = 0; axis < 2; ++axis) {
      const std::vector<double>& all = axis == 0 ? out_.mesh.u : out_.mesh.v;
      const int line = axis == 0 ? event.line_u : event.line_v;
      int& place = axis == 0 ? node.place.u : node.place.v;
      if (line >= 0) {
        place = 2 * line;
        node.uv[axis] = all[static_cast<std::size_t>(line)];
      } else if (on_line(place)) {
        node.uv[axis] = all[static_cast<std::size_t>(place / 2)];
      } else {
        const double low = all[static_cast<std::size_t>(place / 2)],
                     high = all[static_cast<std::size_t>(place / 2 + 1)];
        node.uv[axis] = std::clamp(node.uv[axis], low, high);
        const double spread = std::abs(span.at(event.root.hi)[axis] - span.at(event.root.lo)[axis]);
        node.error = spread + 8 * std::numeric_limits<double>::epsilon() * std::max(std::abs(low), std::abs(high));
      }
    }
    return node;
  }

  // Place of the open arc just after the start (before the end) of a span.
  static int place_beside(const TrimSpan& span, Axis axis, bool end, int place, double line) {
    if (!on_line(place)) return place;
    const LineForm form(span, axis, line);
    return place + (end ? form.sign_before_end() : form.sign_after_start());
  }

  // One loop as a cyclic sequence: nodes[k], then arc k, then nodes[k + 1], ...
  void walk(int l) {
    std::vector<Node> nodes;
    std::vector<Place> places;
    std::vector<Portion> portions;
    std::optional<Eigen::Vector2d> last;
    const TrimLoop& of = loop(l);
    Eigen::Vector2d start{0, 0};
    for (int c = 0; c < static_cast<int>(of.curves.size()); ++c) {
      const bool backwards = of.curves[static_cast<std::size_t>(c)].reversed;
      const std::span<const TrimSpan> spans = out_.spans.of(l, c);
      for (std::size_t k = 0; k < spans.size(); ++k) {
        const TrimSpan& span = spans[backwards ? spans.size() - 1 - k : k];
        if (span.degenerate()) continue;
        const Eigen::Vector2d from = backwards ? span.last() : span.first();
        if (last && from != *last) fail(l, c, "the loop is open", from);
        if (!last) start = from;
        last = backwards ? span.first() : span.last();
        append(span, backwards, l, nodes, places, portions);
      }
    }
    if (nodes.empty()) fail(l, 0, "the loop is a point", start);
    if (*last != start) fail(l, static_cast<int>(of.curves.size()) - 1, "the loop is open", *last);
    choose_curve_at_joints(l, nodes, portions);
    build_arcs(l, nodes, places, portions);
  }

  // The nodes and arcs of one span in traversal order, without its end node (the next span's start).
  void append(const TrimSpan& span, bool backwards, int l, std::vector<Node>& nodes, std::vector<Place>& places,
              std::vector<Portion>& portions) {
    std::vector<SpanEvent> events = span_events(span);
    Node first = joint(span, false), end = joint(span, true);
    const auto line_at = [](const Node& node, int axis) { return node.uv[axis]; };
    Place place{place_beside(span, Axis::u, false, first.place.u, line_at(first, 0)),
                place_beside(span, Axis::v, false, first.place.v, line_at(first, 1))};
    std::vector<Node> own{first};
    std::vector<Place> own_places{place};
    for (const SpanEvent& event : events) {
      if (outside(place)) fail(l, span.curve, "the trim leaves the domain", span.at(event.root.s()));
      own.push_back(interior_node(span, event, place));
      if (event.line_u >= 0 && event.crosses_u) place.u = place.u < 2 * event.line_u ? place.u + 2 : place.u - 2;
      if (event.line_v >= 0 && event.crosses_v) place.v = place.v < 2 * event.line_v ? place.v + 2 : place.v - 2;
      own_places.push_back(place);
    }
    if (outside(place)) fail(l, span.curve, "the trim leaves the domain", span.at(0.5));
    own.push_back(end);
    const std::size_t n = own_places.size();
    for (std::size_t k = 0; k < n; ++k) {
      const Node& a = own[backwards ? n - k : k];
      const Node& b = own[backwards ? n - k - 1 : k + 1];
      nodes.push_back(a);
      places.push_back(own_places[backwards ? n - 1 - k : k]);
      portions.push_back({span.curve, a.t, b.t, a.uv, b.uv});
    }
  }

  bool outside(Place p) const {
    return p.u < 0 || p.v < 0 || p.u > 2 * out_.mesh.cells_u() || p.v > 2 * out_.mesh.cells_v();
  }

  // A joint of two curves belongs to the later one in the file's order, whichever way the loop is traversed.
  void choose_curve_at_joints(int l, std::vector<Node>& nodes, const std::vector<Portion>& portions) const {
    if (!against_the_file(loop(l))) return;
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const Portion& before = portions[(k + portions.size() - 1) % portions.size()];
      if (before.curve != nodes[k].curve || before.t1 != nodes[k].t) {
        nodes[k].curve = before.curve;
        nodes[k].t = before.t1;
      }
    }
  }

  void build_arcs(int l, const std::vector<Node>& nodes, const std::vector<Place>& places,
                  const std::vector<Portion>& portions) {
    const std::size_t n = nodes.size();
    const auto is_break = [&](std::size_t k) {
      return nodes[k].place != places[k] || nodes[k].place != places[(k + n - 1) % n];
    };
    std::size_t first = 0;
    while (first < n && !is_break(first)) ++first;
    const bool closed = first == n;
    if (closed) first = 0;
    const std::size_t first_arc = arcs_.size();
    for (std::size_t step = 0; step < n; ++step) {
      const std::size_t k = (first + step) % n;
      if ((closed && step == 0) || (!closed && is_break(k))) {
        Arc arc;
        arc.place = places[k];
        arc.loop = l;
        if (!closed) {
          arc.from = static_cast<int>(nodes_.size());
          nodes_.push_back(nodes[k]);
        }
        arcs_.push_back(arc);
      }
      std::vector<Portion>& list = arcs_.back().portions;
      const Portion& p = portions[k];
      if (!list.empty() && list.back().curve == p.curve && list.back().t1 == p.t0) {
        list.back().t1 = p.t1;
        list.back().to = p.to;
      } else {
        list.push_back(p);
      }
    }
    if (closed) return;
    for (std::size_t a = first_arc; a < arcs_.size(); ++a) {
      arcs_[a].to = arcs_[a + 1 < arcs_.size() ? a + 1 : first_arc].from;
    }
    add_events(l, first_arc);
  }

  // Which side of line `line` the loop has before and after a stay on it that includes the node at the start of arc a.
  bool crosses(Axis axis, int line, std::size_t first_arc, std::size_t a) const {
    const std::size_t n = arcs_.size() - first_arc;
    const auto at = [&](std::size_t k) {
      const Place& p = arcs_[first_arc + k % n].place;
      return axis == Axis::u ? p.u : p.v;
    };
    std::size_t after = a - first_arc, before = after + n - 1;
    for (std::size_t step = 0; step < n && at(after) == 2 * line; ++step) ++after;
    for (std::size_t step = 0; step < n && at(before) == 2 * line; ++step) before += n - 1;
    return at(before) != at(after);
  }

  void add_events(int l, std::size_t first_arc) {
    for (std::size_t a = first_arc; a < arcs_.size(); ++a) {
      const Node& node = nodes_[static_cast<std::size_t>(arcs_[a].from)];
      TrimEvent event;
      event.loop = l;
      event.curve = node.curve;
      event.t = node.t;
      event.uv = node.uv;
      if (on_line(node.place.u)) event.line_u = node.place.u / 2;
      if (on_line(node.place.v)) event.line_v = node.place.v / 2;
      if (event.line_u >= 0 && event.line_v >= 0) {
        event.kind = PointKind::crossing_uv;
      } else if (event.line_u >= 0) {
        event.kind = crosses(Axis::u, event.line_u, first_arc, a) ? PointKind::crossing_u : PointKind::tangent_u;
      } else {
        event.kind = crosses(Axis::v, event.line_v, first_arc, a) ? PointKind::crossing_v : PointKind::tangent_v;
      }
      out_.events.push_back(event);
    }
  }

  // ---- cells ----

  // An end of an arc on the border of its cell.
  struct End {
    int arc = 0;
    bool leaves = false;  // the arc leaves the cell here
    int side = 0;         // 0 bottom, 1 right, 2 top, 3 left, counter-clockwise
    bool corner = false;  // at the start of the side
    double along = 0, error = 0;
    double angle = 0;  // into the cell, from the direction the border comes from
  };

  void classify() {
    const KnotMesh& mesh = out_.mesh;
    const int nu = mesh.cells_u(), nv = mesh.cells_v();
    out_.cells.assign(static_cast<std::size_t>(nu * nv), CellKind::outside);
    out_.vertices.assign(static_cast<std::size_t>((nu + 1) * (nv + 1)), VertexKind::outside);
    std::vector<std::vector<int>> arcs_of(static_cast<std::size_t>(nu * nv));
    // Change of the winding number from left to right just above row line j: across line i, and inside cell (i, j).
    std::vector<int> across(static_cast<std::size_t>((nu + 1) * (nv + 1)), 0),
        within(static_cast<std::size_t>(nu * nv), 0);
    for (std::size_t a = 0; a < arcs_.size(); ++a) {
      const Arc& arc = arcs_[a];
      if (on_line(arc.place.v)) continue;
      const int j = arc.place.v / 2;
      int change = 0;
      if (arc.from >= 0) {
        if (nodes_[static_cast<std::size_t>(arc.from)].place.v == 2 * j) --change;
        if (nodes_[static_cast<std::size_t>(arc.to)].place.v == 2 * j) ++change;
      }
      if (on_line(arc.place.u)) {
        across[static_cast<std::size_t>(mesh.vertex(arc.place.u / 2, j))] += change;
      } else {
        const std::size_t cell = static_cast<std::size_t>(mesh.cell(arc.place.u / 2, j));
        within[cell] += change;
        arcs_of[cell].push_back(static_cast<int>(a));
      }
    }
    for (int j = 0; j < nv; ++j) {
      int winding = 0;
      for (int i = 0; i <= nu; ++i) {
        const std::size_t vertex = static_cast<std::size_t>(mesh.vertex(i, j));
        winding += across[vertex];
        if (winding == 1 && i > 0 && j > 0 && i < nu) out_.vertices[vertex] = VertexKind::inside;
        if (i == nu) break;
        const std::size_t cell = static_cast<std::size_t>(mesh.cell(i, j));
        if (winding != 0 && winding != 1) bad_nesting(i, j, winding);
        if (arcs_of[cell].empty()) {
          out_.cells[cell] = winding == 1 ? CellKind::inside : CellKind::outside;
        } else {
          out_.cells[cell] = CellKind::cut;
          out_.cut_cells.push_back(cut_cell(i, j, arcs_of[cell], winding == 1));
        }
        winding += within[cell];
      }
      if (winding != 0) bad_nesting(nu - 1, j, winding);
    }
    for (const Node& node : nodes_) {
      if (on_line(node.place.u) && on_line(node.place.v)) {
        out_.vertices[static_cast<std::size_t>(mesh.vertex(node.place.u / 2, node.place.v / 2))] = VertexKind::border;
      }
    }
  }

  [[noreturn]] void bad_nesting(int i, int j, int winding) const {
    const Eigen::Vector2d uv{out_.mesh.u[static_cast<std::size_t>(i)], out_.mesh.v[static_cast<std::size_t>(j)]};
    throw GeometryError(place_name(surface_) + ": the loops enclose " + point_text(uv) + " " + std::to_string(winding) +
                        " times; the outer loop must run counter-clockwise, holes clockwise and inside it");
  }

  End end_of(int a, bool leaves, int i, int j) const {
    const Arc& arc = arcs_[static_cast<std::size_t>(a)];
    const Node& node = nodes_[static_cast<std::size_t>(leaves ? arc.to : arc.from)];
    const int pu = node.place.u - 2 * i, pv = node.place.v - 2 * j;  // 0, 1, 2
    End end;
    end.arc = a;
    end.leaves = leaves;
    end.corner = pu != 1 && pv != 1;
    end.side = end.corner ? (pv == 0 ? (pu == 0 ? 0 : 1) : (pu == 2 ? 2 : 3))
                          : (pv == 0   ? 0
                             : pu == 2 ? 1
                             : pv == 2 ? 2
                                       : 3);
    if (!end.corner) {
      const double x = end.side % 2 == 0 ? node.uv.x() : node.uv.y();
      end.along = end.side < 2 ? x : -x;
      end.error = node.error;
    }
    const Eigen::Vector2d in = direction(arc, leaves);
    const std::array<Eigen::Vector2d, 4> forward{{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};
    // Clockwise from where the border comes from: against its direction at a side, along the previous side at a corner.
    const Eigen::Vector2d back = -forward[static_cast<std::size_t>(end.corner ? (end.side + 3) % 4 : end.side)];
    end.angle = std::atan2(-(back.x() * in.y() - back.y() * in.x()), back.dot(in));
    if (end.angle < -1e-6) end.angle += 2 * M_PI;
    if (!std::isfinite(end.angle)) end.angle = 0;
    return end;
  }

  // From an end of an arc into its cell.
  Eigen::Vector2d direction(const Arc& arc, bool at_end) const {
    const Portion& p = at_end ? arc.portions.back() : arc.portions.front();
    const double t = at_end ? p.t1 : p.t0, other = at_end ? p.t0 : p.t1;
    const std::span<const TrimSpan> spans = out_.spans.of(arc.loop, p.curve);
    const bool up = other > t;
    // The span on the inner side of t.
    const auto span = up ? std::prev(std::upper_bound(spans.begin(), spans.end(), t,
                                                      [](double x, const TrimSpan& s) { return x < s.range.min; }))
                         : std::lower_bound(spans.begin(), spans.end(), t,
                                            [](const TrimSpan& s, double x) { return s.range.max < x; });
    const double length = span->range.length();
    if (up && t == span->range.min) {
      for (int i = 1; i <= span->degree; ++i) {
        if (span->point(i) != span->first()) return (span->point(i) - span->first()).normalized();
      }
    }
    if (!up && t == span->range.max) {
      for (int i = span->degree - 1; i >= 0; --i) {
        if (span->point(i) != span->last()) return (span->point(i) - span->last()).normalized();
      }
    }
    const double s = (t - span->range.min) / length, reach = std::min(1e-6, std::abs(other - t) / length);
    return (span->at(s + (up ? reach : -reach)) - span->at(s)).normalized();
  }

  // Ends in order along the border from its bottom left corner, leaving and entering in turn. Loops don't cross, so
  // where ends share a place (touches) or are too close to tell apart, the turn decides; among equals the direction
  // does.
  std::vector<End> border_order(int i, int j, const std::vector<int>& arcs, bool inside) const {
    std::vector<End> ends;
    for (const int a : arcs) {
      if (arcs_[static_cast<std::size_t>(a)].from < 0) continue;
      ends.push_back(end_of(a, false, i, j));
      ends.push_back(end_of(a, true, i, j));
    }
    std::sort(ends.begin(), ends.end(), [](const End& a, const End& b) {
      if (a.side != b.side) return a.side < b.side;
      if (a.corner != b.corner) return a.corner;
      if (a.along != b.along) return a.along < b.along;
      if (a.angle != b.angle) return a.angle < b.angle;
      return a.arc < b.arc;
    });
    std::vector<End> ordered;
    for (std::size_t first = 0; first < ends.size();) {
      std::size_t last = first + 1;
      while (last < ends.size() && ends[last].side == ends[first].side && ends[last].corner == ends[first].corner &&
             ends[last].along - ends[last].error <= ends[last - 1].along + ends[last - 1].error)
        ++last;
      std::vector<End> group(ends.begin() + static_cast<std::ptrdiff_t>(first),
                             ends.begin() + static_cast<std::ptrdiff_t>(last));
      while (!group.empty()) {
        const auto next = std::find_if(group.begin(), group.end(), [&](const End& e) { return e.leaves == !inside; });
        if (next == group.end()) {
          const Arc& arc = arcs_[static_cast<std::size_t>(group.front().arc)];
          const Portion& p = group.front().leaves ? arc.portions.back() : arc.portions.front();
          fail(arc.loop, p.curve, "the loops cross or run the wrong way", group.front().leaves ? p.to : p.from);
        }
        ordered.push_back(*next);
        inside = !inside;
        group.erase(next);
      }
      first = last;
    }
    return ordered;
  }

  Eigen::Vector2d corner(int i, int j, int k) const {
    const bool right = k == 1 || k == 2, top = k == 2 || k == 3;
    return {out_.mesh.u[static_cast<std::size_t>(i + right)], out_.mesh.v[static_cast<std::size_t>(j + top)]};
  }

  static void add_straight(const Eigen::Vector2d& to, std::vector<BoundaryPiece>& chain, const Eigen::Vector2d& from) {
    if (from == to) return;
    BoundaryPiece piece;
    piece.from = from;
    piece.to = to;
    chain.push_back(piece);
  }

  void add_arc(const Arc& arc, std::vector<BoundaryPiece>& chain) const {
    for (const Portion& p : arc.portions) chain.push_back({arc.loop, p.curve, p.t0, p.t1, p.from, p.to});
  }

  CutCell cut_cell(int i, int j, const std::vector<int>& arcs, bool inside) const {
    CutCell cell;
    cell.i = i;
    cell.j = j;
    const std::vector<End> ends = border_order(i, j, arcs, inside);
    // Position of each arc's ends in the order.
    std::vector<int> leaves_at(arcs.size(), -1);
    const auto local = [&](int a) {
      return static_cast<std::size_t>(std::lower_bound(arcs.begin(), arcs.end(), a) - arcs.begin());
    };
    for (std::size_t k = 0; k < ends.size(); ++k) {
      if (ends[k].leaves) leaves_at[local(ends[k].arc)] = static_cast<int>(k);
    }
    std::vector<bool> done(arcs.size(), false);
    for (std::size_t start = 0; start < arcs.size(); ++start) {
      if (done[start]) continue;
      std::vector<BoundaryPiece>& chain = cell.loops.emplace_back();
      std::size_t at = start;
      while (!done[at]) {
        done[at] = true;
        const Arc& arc = arcs_[static_cast<std::size_t>(arcs[at])];
        add_arc(arc, chain);
        if (arc.from < 0) break;
        const std::size_t k = static_cast<std::size_t>(leaves_at[at]), next = (k + 1) % ends.size();
        const End& a = ends[k];
        const End& b = ends[next];
        const int last_side = b.side + (next <= k ? 4 : 0);
        Eigen::Vector2d x = nodes_[static_cast<std::size_t>(arc.to)].uv;
        for (int side = a.side + 1; side <= last_side; ++side) {
          add_straight(corner(i, j, side % 4), chain, x);
          x = corner(i, j, side % 4);
        }
        at = local(b.arc);
        add_straight(nodes_[static_cast<std::size_t>(arcs_[static_cast<std::size_t>(b.arc)].from)].uv, chain, x);
      }
    }
    if (ends.empty() && inside) {
      std::vector<BoundaryPiece> border;
      for (int k = 0; k < 4; ++k) add_straight(corner(i, j, (k + 1) % 4), border, corner(i, j, k));
      cell.loops.insert(cell.loops.begin(), border);
    }
    return cell;
  }

  const TrimmedSurface& surface_;
  TrimTopology out_;
  std::vector<Node> nodes_;
  std::vector<Arc> arcs_;
};

}  // namespace

KnotMesh knot_mesh(const NurbsSurface& surface) {
  return {surface.u().breaks(), surface.v().breaks()};
}

const char* name(PointKind kind) {
  switch (kind) {
    case PointKind::vertex:
      return "vertex";
    case PointKind::crossing_u:
      return "crossing_u";
    case PointKind::crossing_v:
      return "crossing_v";
    case PointKind::tangent_u:
      return "tangent_u";
    case PointKind::tangent_v:
      return "tangent_v";
    case PointKind::crossing_uv:
      return "crossing_uv";
    case PointKind::corner:
      return "corner";
  }
  return "";
}

TrimTopology trace_trims(const TrimmedSurface& surface) {
  return Tracer(surface).run();
}

}  // namespace toile
