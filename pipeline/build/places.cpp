// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/build/places.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "geometry/error.h"
#include "geometry/measure.h"
#include "geometry/quadrature_rule.h"

namespace toile {

// The part of a piece that an address names, as fractions of the piece's length.
struct PathPart {
  CurveOnSurface path;
  double from = 0, to = 1;
};

CurveOnSurface::CurveOnSurface(const TrimmedSurface& face, const TrimTopology& topology, int loop, int curve,
                               const NurbsSurface& surface)
    : curve_(face.loops[static_cast<std::size_t>(loop)].curves[static_cast<std::size_t>(curve)].curve),
      surface_(surface) {
  t_ = curve_.knots().breaks();
  for (const TrimEvent& event : topology.events) {
    if (event.loop == loop && event.curve == curve) t_.push_back(event.t);
  }
  std::ranges::sort(t_);
  const Interval domain = curve_.domain();
  // Events that differ by rounding make no piece of their own.
  const double least = 1e-12 * domain.length();
  std::vector<double> distinct{domain.min};
  for (const double t : t_) {
    if (t > distinct.back() + least && t < domain.max - least) distinct.push_back(t);
  }
  distinct.push_back(domain.max);
  t_ = std::move(distinct);
  sum_.assign(t_.size(), 0);
  for (std::size_t k = 1; k < t_.size(); ++k) {
    sum_[k] = sum_[k - 1] + gauss8([&](double t) { return speed(t); }, t_[k - 1], t_[k]);
  }
}

Eigen::Vector2d CurveOnSurface::uv(double t) const {
  return curve_(t);
}

double CurveOnSurface::speed(double t) const {
  const CurveJet<2> c = evaluate(curve_, t);
  const SurfaceJet s = evaluate(surface_, c.x.x(), c.x.y());
  return (s.u * c.d1.x() + s.v * c.d1.y()).norm();
}

double CurveOnSurface::cells(double t) const {
  const CurveJet<2> c = evaluate(curve_, t);
  const auto spans = [](const KnotVector& knots, double u, double du) {
    const int k = knots.find_span(u);
    return du / (knots[k + 1] - knots[k]);
  };
  return std::hypot(spans(surface_.u(), c.x.x(), c.d1.x()), spans(surface_.v(), c.x.y(), c.d1.y()));
}

double CurveOnSurface::parameter(double fraction) const {
  if (fraction <= 0) return t_.front();
  if (fraction >= 1) return t_.back();
  const double wanted = fraction * length();
  const auto above = std::ranges::upper_bound(sum_, wanted);
  const std::size_t k = std::clamp<std::size_t>(static_cast<std::size_t>(above - sum_.begin()), 1, t_.size() - 1);
  double low = t_[k - 1], high = t_[k];
  const auto gap = [&](double t) {
    return sum_[k - 1] + gauss8([&](double s) { return speed(s); }, t_[k - 1], t) - wanted;
  };
  // Newton's method for the bounds, halves down to neighbouring numbers.
  double near = low + (wanted - sum_[k - 1]) / (sum_[k] - sum_[k - 1]) * (high - low);
  for (int step = 0; step < 4 && near > low && near < high; ++step) near -= gap(near) / speed(near);
  const double around = 1e-9 * (high - low);
  for (const double t : {near - around, near + around})
    if (t > low && t < high) (gap(t) < 0 ? low : high) = t;
  while (true) {
    const double middle = low + (high - low) / 2;
    if (middle <= low || middle >= high) return middle;
    (gap(middle) < 0 ? low : high) = middle;
  }
}

std::vector<double> CurveOnSurface::breaks(double from, double to) const {
  const double t0 = parameter(from), t1 = parameter(to);
  const double least = 1e-9 * (t1 - t0);
  std::vector<double> result{t0};
  for (const double t : t_) {
    if (t > t0 + least && t < t1 - least) result.push_back(t);
  }
  result.push_back(t1);
  return result;
}

namespace {

struct Edge {
  int direction = 0;  // 0: u = const
  int end = 0;        // 0: min, 1: max
};

Interval domain_of(const NurbsSurface& s, int direction) {
  return (direction == 0 ? s.u() : s.v()).domain();
}

double line_of(const NurbsSurface& s, const Edge& edge) {
  const Interval d = domain_of(s, edge.direction);
  return edge.end == 0 ? d.min : d.max;
}

// Does every control point of the curve lie on the line, so that the curve does?
bool runs_along(const Curve2& curve, int direction, double line) {
  return (curve.points().row(direction).array() == line).all();
}

// Do these curves cover the whole edge of the domain? Curves that don't run along it count for nothing.
bool cover(const std::vector<const Curve2*>& curves, const Edge& edge, const NurbsSurface& surface) {
  const Interval across = domain_of(surface, 1 - edge.direction);
  std::vector<Interval> covered;
  for (const Curve2* curve : curves) {
    if (!runs_along(*curve, edge.direction, line_of(surface, edge))) continue;
    const double a = curve->start()[1 - edge.direction], b = curve->end()[1 - edge.direction];
    covered.push_back({std::min(a, b), std::max(a, b)});
  }
  std::ranges::sort(covered, {}, &Interval::min);
  double reached = across.min;
  for (const Interval& c : covered) {
    if (c.min <= reached) reached = std::max(reached, c.max);
  }
  return reached >= across.max;
}

// Does the trim follow the whole edge of the domain?
bool trim_follows(const TrimmedSurface& face, const Edge& edge) {
  std::vector<const Curve2*> curves;
  for (const TrimLoop& loop : face.loops) {
    for (const TrimCurve& trim : loop.curves) curves.push_back(&trim.curve);
  }
  return cover(curves, edge, face.surface);
}

// Positions of the file's loop and curve numbers.
struct CurvePosition {
  int loop = 0, curve = 0;
};

// What is left of the file's curve, in its direction: reading cuts a curve where another loop meets it, and its pieces
// keep its number and its parameters.
std::vector<CurvePosition> find_curve(const Address& at, const PanelPlaces& panel, const std::string& who) {
  const std::vector<TrimLoop>& loops = panel.face.loops;
  const auto loop = std::ranges::find(loops, at.a, &TrimLoop::index);
  if (loop == loops.end()) {
    throw GeometryError(fmt::format("{}: panel '{}' has loops 0 to {}", who, panel.name, loops.size() - 1));
  }
  const std::vector<TrimCurve>& curves = loop->curves;
  std::vector<CurvePosition> pieces;
  for (std::size_t c = 0; c < curves.size(); ++c) {
    if (curves[c].index == at.b) pieces.push_back({static_cast<int>(loop - loops.begin()), static_cast<int>(c)});
  }
  if (pieces.empty()) {
    const int last = std::ranges::max(curves, {}, &TrimCurve::index).index;
    throw GeometryError(fmt::format("{}: loop {} of panel '{}' has curves 0 to {}", who, at.a, panel.name, last));
  }
  const auto curve_at = [&](const CurvePosition& p) -> const TrimCurve& {
    return curves[static_cast<std::size_t>(p.curve)];
  };
  if (curve_at(pieces.front()).reversed) std::ranges::reverse(pieces);
  std::ranges::stable_sort(pieces, {}, [&](const CurvePosition& p) { return curve_at(p).curve.domain().min; });
  return pieces;
}

std::vector<PathPart> path_of(const Address& at, const std::vector<CurvePosition>& pieces, const PanelPlaces& panel) {
  std::vector<PathPart> parts;
  double length = 0;
  for (const CurvePosition& p : pieces) {
    parts.push_back({CurveOnSurface(panel.face, panel.topology, p.loop, p.curve, panel.rest), at.from, at.to});
    length += parts.back().path.length();
  }
  if (parts.size() == 1) return parts;
  std::vector<PathPart> named;
  double before = 0;
  for (PathPart& part : parts) {
    const double own = part.path.length();
    part.from = std::max(0.0, (at.from * length - before) / own);
    part.to = std::min(1.0, (at.to * length - before) / own);
    before += own;
    if (part.from < part.to) named.push_back(std::move(part));
  }
  return named;
}

// Parts that follow each other, measured in cells.
class PathInCells {
 public:
  // The parts must outlive it.
  explicit PathInCells(std::span<const PathPart> parts) {
    for (const PathPart& part : parts) {
      const std::vector<double> t = part.path.breaks(part.from, part.to);
      for (std::size_t k = 1; k < t.size(); ++k) {
        pieces_.push_back({&part.path, t[k - 1], t[k], length_});
        length_ += cells(pieces_.back(), t[k]);
      }
    }
  }
  double length() const { return length_; }
  Eigen::Vector2d start() const { return pieces_.front().path->uv(pieces_.front().from); }
  Eigen::Vector2d end() const { return pieces_.back().path->uv(pieces_.back().to); }
  // Newton's method within ever nearer bounds.
  Eigen::Vector2d at(double length) const {
    const auto above = std::ranges::upper_bound(pieces_, length, {}, &Piece::before);
    const Piece& piece = above == pieces_.begin() ? pieces_.front() : *(above - 1);
    double low = piece.from, high = piece.to, t = low;
    for (int k = 0; k < 100; ++k) {
      const double beyond = piece.before + cells(piece, t) - length;
      (beyond < 0 ? low : high) = t;
      double next = t - beyond / piece.path->cells(t);
      if (!(next > low && next < high)) next = low + (high - low) / 2;
      if (std::abs(next - t) <= 1e-14 * (piece.to - piece.from)) break;
      t = next;
    }
    return piece.path->uv(t);
  }

 private:
  struct Piece {
    const CurveOnSurface* path = nullptr;
    double from = 0, to = 0;  // parameters of the curve
    double before = 0;        // length up to it
  };
  static double cells(const Piece& piece, double t) {
    return gauss8([&](double s) { return piece.path->cells(s); }, piece.from, t);
  }

  std::vector<Piece> pieces_;
  double length_ = 0;
};

// Adds what holds one stretch of a curve; `required` of its points come first in `out`.
void hold_along(std::span<const PathPart> parts, const NurbsSurface& surface, HeldPlace& out) {
  constexpr double open_spacing = 1, closed_spacing = 1.15;  // spans
  const PathInCells path(parts);
  const Eigen::Vector2d a = path.start(), b = path.end();
  double length = 0;
  for (const PathPart& part : parts) length += (part.to - part.from) * part.path.length();
  const bool closed = (surface(a.x(), a.y()) - surface(b.x(), b.y())).norm() <= 1e-9 * length;
  const int degree = std::max(surface.u().degree(), surface.v().degree());
  const int n = std::max(static_cast<int>(std::lround(path.length() / (closed ? closed_spacing : open_spacing))),
                         closed ? 2 * degree + 1 : degree);
  const auto point = [&](int k) -> Eigen::Vector2d { return k == 0 ? a : k == n ? b : path.at(path.length() * k / n); };
  const std::vector<int> first = closed ? std::vector<int>{0, n / 3, 2 * n / 3} : std::vector<int>{0, n};
  std::vector<Eigen::Vector2d> required;
  for (const int k : first) required.push_back(point(k));
  out.points.insert(out.points.begin() + static_cast<std::ptrdiff_t>(out.required), required.begin(), required.end());
  out.required += required.size();
  for (int k = 1; k < n; ++k)
    if (std::ranges::find(first, k) == first.end()) out.points.push_back(point(k));
  const int places = std::max(200, 3 * n);
  for (int k = 0; k < places; ++k) out.curve.push_back(path.at(path.length() * (k + 0.5) / places));
}

// The edge of the domain that curves cover from end to end, if they do.
std::optional<Edge> whole_edge(const std::vector<const Curve2*>& curves, const NurbsSurface& surface) {
  for (int direction = 0; direction < 2; ++direction) {
    for (int end = 0; end < 2; ++end) {
      const Edge edge{direction, end};
      const double line = line_of(surface, edge);
      const bool along = std::ranges::all_of(curves, [&](const Curve2* c) { return runs_along(*c, direction, line); });
      if (along && cover(curves, edge, surface)) return edge;
    }
  }
  return std::nullopt;
}

Edge edge_of(const Address& at) {
  return {at.a, at.b};
}

void require_edge(const Edge& edge, const PanelPlaces& panel, const std::string& who) {
  if (trim_follows(panel.face, edge)) return;
  throw GeometryError(
      fmt::format("{}: edge {}{} of panel '{}' is trimmed away, wholly or in part; address a trim curve "
                  "instead (curve:LOOP,K; `toile inspect FILE --svg` shows their numbers)",
                  who, edge.direction == 0 ? 'u' : 'v', edge.end, panel.name));
}

void add_edge(const Edge& edge, bool clamp, const NurbsSurface& surface, HeldPlace& out) {
  const int n_u = surface.count_u(), n_v = surface.count_v();
  const int across = edge.direction == 0 ? n_u : n_v, along = edge.direction == 0 ? n_v : n_u;
  const auto at = [&](int row, int k) {
    const int fixed = edge.end == 0 ? row : across - 1 - row;
    return edge.direction == 0 ? surface.index(fixed, k) : surface.index(k, fixed);
  };
  for (int row = 0; row < (clamp ? 2 : 1); ++row) {
    for (int k = 0; k < along; ++k) out.control_points.push_back(at(row, k));
  }
  for (int k = 0; clamp && k < along; ++k) out.across.push_back({at(0, k), at(1, k)});
}

[[noreturn]] void no_clamp(const std::string& who) {
  throw InputError(
      fmt::format("{}: clamp = true works at corner:, edge:, cp: and at curves that cover a whole edge of the "
                  "domain in this version",
                  who));
}

}  // namespace

bool in_material(const TrimmedSurface& face, const TrimTopology& topology, const Eigen::Vector2d& uv) {
  const Interval u = face.surface.u().domain(), v = face.surface.v().domain();
  if (!u.contains(uv.x()) || !v.contains(uv.y())) return false;
  if (contains(face, topology, uv)) return true;
  const double near = 1e-9 * std::hypot(u.length(), v.length());
  for (const TrimLoop& loop : face.loops) {
    for (const TrimCurve& trim : loop.curves) {
      if (closest_point<2>(trim.curve, uv).distance <= near) return true;
    }
  }
  return false;
}

Eigen::Vector2d point_uv(const Address& at, const NurbsSurface& surface) {
  if (at.kind == Address::Kind::uv) return at.uv;
  const Interval u = surface.u().domain(), v = surface.v().domain();
  return {at.a == 0 ? u.min : u.max, at.b == 0 ? v.min : v.max};
}

CurveChain::CurveChain(int loop, std::span<const int> curves, double from, double to, const PanelPlaces& panel,
                       const std::string& who) {
  std::vector<PathPart> whole;
  std::vector<double> at{0};      // m, where parts end
  std::vector<std::size_t> last;  // parts that end a curve
  for (const int curve : curves) {
    Address address;
    address.kind = Address::Kind::curve;
    address.a = loop, address.b = curve;
    for (PathPart& part : path_of(address, find_curve(address, panel, who), panel)) {
      at.push_back(at.back() + part.path.length());
      whole.push_back(std::move(part));
    }
    last.push_back(whole.size() - 1);
  }
  const double start = from * at.back(), end = to * at.back();
  length_ = end - start;
  for (std::size_t k = 0; k < whole.size(); ++k) {
    PathPart& part = whole[k];
    const double own = part.path.length();
    part.from = std::max(0.0, (start - at[k]) / own);
    part.to = std::min(1.0, (end - at[k]) / own);
    if (!(part.from < part.to)) continue;
    before_.push_back(std::max(0.0, at[k] - start));
    parts_.push_back(std::move(part));
    const double fraction = (at[k + 1] - start) / length_;
    if (fraction < 1 - 1e-9 && std::ranges::find(last, k) != last.end()) ends_.push_back(fraction);
  }
}
CurveChain::~CurveChain() = default;

CurveChain::Place CurveChain::place(double fraction) const {
  const double wanted = fraction * length_;
  const auto above = std::ranges::upper_bound(before_, wanted);
  const auto k = static_cast<std::size_t>(std::max<std::ptrdiff_t>(above - before_.begin(), 1) - 1);
  const PathPart& part = parts_[k];
  const double own = std::clamp(part.from + (wanted - before_[k]) / part.path.length(), part.from, part.to);
  return {&part, part.path.parameter(own)};
}

Eigen::Vector2d CurveChain::at(double fraction) const {
  const Place there = place(fraction);
  return there.part->path.uv(there.t);
}

double CurveChain::cells_per_metre(double fraction) const {
  const Place there = place(fraction);
  return there.part->path.cells(there.t) / there.part->path.speed(there.t);
}

HeldPlace held_place(const Address& at, bool clamp, const PanelPlaces& panel, const std::string& who) {
  const NurbsSurface& surface = panel.rest;
  const int n_u = surface.count_u(), n_v = surface.count_v();
  HeldPlace held;
  switch (at.kind) {
    case Address::Kind::corner: {
      const Eigen::Vector2d uv = point_uv(at, surface);
      if (!contains(panel.face, panel.topology, uv)) {
        throw GeometryError(
            fmt::format("{}: corner ({}, {}) of panel '{}' is trimmed away; address the material instead "
                        "(uv:U,V or curve:LOOP,K)",
                        who, at.a, at.b, panel.name));
      }
      const int i = at.a == 0 ? 0 : n_u - 1, j = at.b == 0 ? 0 : n_v - 1;
      held.control_points.push_back(surface.index(i, j));
      if (clamp) {
        const int i1 = at.a == 0 ? 1 : n_u - 2, j1 = at.b == 0 ? 1 : n_v - 2;
        for (const int k : {surface.index(i1, j), surface.index(i, j1), surface.index(i1, j1)}) {
          held.control_points.push_back(k);
        }
      }
      break;
    }
    case Address::Kind::edge: {
      require_edge(edge_of(at), panel, who);
      add_edge(edge_of(at), clamp, surface, held);
      break;
    }
    case Address::Kind::curve: {
      const std::vector<CurvePosition> pieces = find_curve(at, panel, who);
      std::vector<const Curve2*> curves;
      for (const CurvePosition& p : pieces) {
        const TrimLoop& loop = panel.face.loops[static_cast<std::size_t>(p.loop)];
        curves.push_back(&loop.curves[static_cast<std::size_t>(p.curve)].curve);
      }
      const auto edge = whole_edge(curves, surface);
      if (edge && at.from == 0 && at.to == 1) {
        add_edge(*edge, clamp, surface, held);
        break;
      }
      if (clamp) no_clamp(who);
      const std::vector<PathPart> parts = path_of(at, pieces, panel);
      const auto ends = [](const PathPart& part, double fraction) {
        return part.path.uv(part.path.parameter(fraction));
      };
      for (std::size_t first = 0, k = 1; k <= parts.size(); ++k) {
        if (k < parts.size() && ends(parts[k - 1], parts[k - 1].to) == ends(parts[k], parts[k].from)) continue;
        hold_along(std::span(parts).subspan(first, k - first), surface, held);
        first = k;
      }
      break;
    }
    case Address::Kind::uv: {
      const Interval du = surface.u().domain(), dv = surface.v().domain();
      if (!du.contains(at.uv.x()) || !dv.contains(at.uv.y())) {
        throw GeometryError(fmt::format("{}: ({}, {}) lies outside panel '{}', whose domain is [{}, {}] x [{}, {}]",
                                        who, at.uv.x(), at.uv.y(), panel.name, du.min, du.max, dv.min, dv.max));
      }
      if (!in_material(panel.face, panel.topology, at.uv)) {
        throw GeometryError(
            fmt::format("{}: ({}, {}) of panel '{}' is trimmed away", who, at.uv.x(), at.uv.y(), panel.name));
      }
      SurfaceBasis basis;
      evaluate_basis(surface, at.uv.x(), at.uv.y(), basis);
      for (int b = 0; b < basis.count_v; ++b) {
        for (int a = 0; a < basis.count_u; ++a) {
          if (basis.value[0][static_cast<std::size_t>(a + basis.count_u * b)] == 1) {
            held.control_points.push_back(surface.index(basis.first_u + a, basis.first_v + b));
          }
        }
      }
      if (clamp) no_clamp(who);
      if (held.control_points.empty()) held.points.push_back(at.uv), held.required = 1;
      break;
    }
    case Address::Kind::control_point: {
      if (at.a >= n_u || at.b >= n_v) {
        throw GeometryError(
            fmt::format("{}: the net of panel '{}' is {} x {}, indices start from 0", who, panel.name, n_u, n_v));
      }
      if (!panel.carries_cloth[static_cast<std::size_t>(surface.index(at.a, at.b))]) {
        throw GeometryError(
            fmt::format("{}: control point ({}, {}) of panel '{}' carries no cloth", who, at.a, at.b, panel.name));
      }
      for (int j = std::max(0, at.b - (clamp ? 1 : 0)); j <= std::min(n_v - 1, at.b + (clamp ? 1 : 0)); ++j) {
        for (int i = std::max(0, at.a - (clamp ? 1 : 0)); i <= std::min(n_u - 1, at.a + (clamp ? 1 : 0)); ++i) {
          held.control_points.push_back(surface.index(i, j));
        }
      }
      break;
    }
    case Address::Kind::box: {
      if (clamp) no_clamp(who);
      for (int k = 0; k < panel.start.cols(); ++k) {
        const Eigen::Vector3d x = panel.start.col(k);
        if (panel.carries_cloth[static_cast<std::size_t>(k)] && (x.array() >= at.min.array()).all() &&
            (x.array() <= at.max.array()).all()) {
          held.control_points.push_back(k);
        }
      }
      if (held.control_points.empty()) {
        throw GeometryError(fmt::format("{}: the box holds no control point of panel '{}'", who, panel.name));
      }
      break;
    }
  }
  std::ranges::sort(held.control_points);
  held.control_points.erase(std::unique(held.control_points.begin(), held.control_points.end()),
                            held.control_points.end());
  return held;
}

std::vector<LinePoint> line_points(const Address& along, const PanelPlaces& panel, const std::string& who) {
  std::vector<LinePoint> points;
  const auto integrate = [&](double t0, double t1, auto&& uv, auto&& speed) {
    const double middle = t0 + (t1 - t0) / 2, half = (t1 - t0) / 2;
    for (int side = -1; side <= 1; side += 2) {
      for (std::size_t k = 0; k < gauss8_x.size(); ++k) {
        const double t = middle + side * half * gauss8_x[k];
        points.push_back({uv(t), gauss8_w[k] * half * speed(t)});
      }
    }
  };
  if (along.kind == Address::Kind::curve) {
    for (const PathPart& part : path_of(along, find_curve(along, panel, who), panel)) {
      const CurveOnSurface& path = part.path;
      const std::vector<double> t = path.breaks(part.from, part.to);
      for (std::size_t k = 1; k < t.size(); ++k) {
        integrate(
            t[k - 1], t[k], [&](double s) { return path.uv(s); }, [&](double s) { return path.speed(s); });
      }
    }
    return points;
  }
  const Edge edge = edge_of(along);
  require_edge(edge, panel, who);
  const double line = line_of(panel.rest, edge);
  const std::vector<double> t = (edge.direction == 0 ? panel.rest.v() : panel.rest.u()).breaks();
  const auto uv = [&](double s) { return edge.direction == 0 ? Eigen::Vector2d(line, s) : Eigen::Vector2d(s, line); };
  const auto speed = [&](double s) {
    const SurfaceJet jet = evaluate(panel.rest, uv(s).x(), uv(s).y());
    return (edge.direction == 0 ? jet.v : jet.u).norm();
  };
  for (std::size_t k = 1; k < t.size(); ++k) integrate(t[k - 1], t[k], uv, speed);
  return points;
}

}  // namespace toile
