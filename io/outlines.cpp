// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/outlines.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

#include "geometry/error.h"
#include "geometry/measure.h"
#include "geometry/refine.h"
#include "geometry/text.h"
#include "io/flat_panel.h"
#include "io/outline_chains.h"
#include "io/outline_repair.h"
#include "trimming/loops.h"
#include "trimming/winding.h"

namespace toile {

namespace {

using drawing::Chain;
using drawing::Chains;
using drawing::Piece;
using drawing::place_text;
using drawing::Places;
using drawing::Step;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double join_tolerance = 1e-5;   // of the drawing's size
constexpr double touch_tolerance = 1e-3;  // of a panel's size: a mark this near to the outline touches it
constexpr double notch_length = 0.05;     // of a panel's size: longer marks that touch the outline are lines

// A plane with coordinates: x = origin + u du + v dv, du and dv orthonormal.
struct Plane {
  Vector3d normal;
  double height = 0;  // along the normal
  AffinePatch map;
  Vector2d operator()(const Vector3d& x) const { return {map.du.dot(x), map.dv.dot(x)}; }
};

Plane plane_of(const std::vector<Piece>& pieces, const Chain& chain) {
  // Newell's sum over the control polygon, from a point of it: the rounding of far-away drawings cancels.
  const Vector3d base = pieces[static_cast<std::size_t>(chain[0].piece)].curve.points().col(0);
  Vector3d sum(0, 0, 0), last(0, 0, 0), widest(0, 0, 0), crosswise(0, 0, 0);
  const auto visit = [&](const Vector3d& x) {
    sum += last.cross(x - base);
    last = x - base;
    if (widest.cross(last).squaredNorm() > crosswise.squaredNorm()) crosswise = widest.cross(last);
    if (last.squaredNorm() > widest.squaredNorm()) widest = last;
  };
  for (const Step& step : chain) {
    const Eigen::Matrix3Xd& p = pieces[static_cast<std::size_t>(step.piece)].curve.points();
    for (Eigen::Index k = 0; k < p.cols(); ++k) visit(p.col(step.reversed ? p.cols() - 1 - k : k));
  }
  Plane plane;
  // An outline that crosses itself may enclose as much on one side as on the other: any three of its points then.
  if (!(sum.norm() > 1e-9 * widest.squaredNorm())) sum = crosswise;
  plane.normal = sum.stableNormalized();
  int axis = 0;
  plane.normal.cwiseAbs().maxCoeff(&axis);
  if (plane.normal[axis] < 0) plane.normal = -plane.normal;
  if (plane.normal[axis] > 1 - 1e-12) {
    // u and v are the two other coordinates in cyclic order; bitwise, for the dot products add zeros.
    plane.normal = Vector3d::Unit(axis);
    plane.map.du = Vector3d::Unit((axis + 1) % 3);
    plane.map.dv = Vector3d::Unit((axis + 2) % 3);
  } else {
    const Vector3d aside = std::abs(plane.normal.z()) < 0.9 ? Vector3d::UnitZ() : Vector3d::UnitX();
    plane.map.du = aside.cross(plane.normal).normalized();
    plane.map.dv = plane.normal.cross(plane.map.du);
  }
  plane.height = plane.normal.dot(base);
  plane.map.origin = plane.height * plane.normal;
  return plane;
}

Curve2 in_plane(const Plane& plane, const Curve3& curve) {
  Curve2::Points points(2, curve.points().cols());
  for (Eigen::Index k = 0; k < points.cols(); ++k) points.col(k) = plane(curve.points().col(k));
  return Curve2(curve.knots(), std::move(points), curve.weights());
}

struct Loop {
  Chain chain;
  int id = 0;
  std::string name;
  int plane = 0;
  std::vector<TrimCurve> curves;  // in the plane
  std::vector<TrimSpan> spans;    // head to tail
  Vector2d low, high;
  int parent = -1, depth = 0;
  double size() const { return (high - low).norm(); }
};

Vector2d middle(const Curve2& curve) {
  const Interval domain = curve.domain();
  return curve(domain.min + domain.length() / 2);
}

enum class Side { outside, border, inside };
Side side_of(const Loop& loop, const Vector2d& p) {
  if (!((p - loop.low).minCoeff() >= 0 && (loop.high - p).minCoeff() >= 0)) return Side::outside;
  PredicateCounts counts;
  const std::optional<int> winding = winding_number(loop.spans, p, counts);
  return !winding ? Side::border : *winding != 0 ? Side::inside : Side::outside;
}

// Where the ends and middles of b's curves lie with respect to a.
struct Sides {
  bool inside = false, outside = false;
};
Sides sides(const Loop& a, const Loop& b) {
  Sides out;
  if ((b.low - a.high).maxCoeff() > 0 || (a.low - b.high).maxCoeff() > 0) return {false, true};
  for (const TrimCurve& trim : b.curves) {
    for (const Vector2d& p : {trim.curve.start(), middle(trim.curve)}) {
      const Side side = side_of(a, p);
      out.inside = out.inside || side == Side::inside;
      out.outside = out.outside || side == Side::outside;
    }
  }
  return out;
}

// The same outline drawn again, from wherever it begins and whichever way round.
bool repeats(const Loop& a, const Loop& b, double tolerance) {
  const std::size_t n = a.spans.size();
  if (b.spans.size() != n || !((a.low - b.low).norm() <= tolerance && (a.high - b.high).norm() <= tolerance))
    return false;
  const auto from = [&](std::size_t shift, bool back) {
    for (std::size_t k = 0; k < n; ++k) {
      const TrimSpan& other = b.spans[back ? (shift + n - k) % n : (shift + k) % n];
      for (const double s : {0.0, 0.25, 0.5, 0.75, 1.0})
        if (!((a.spans[k].at(s) - other.at(back ? 1 - s : s)).norm() <= tolerance)) return false;
    }
    return true;
  };
  for (std::size_t shift = 0; shift < n; ++shift)
    if (from(shift, false) || from(shift, true)) return true;
  return false;
}

// Distance of a point to a chain, from samples: for telling what a mark is, never for topology.
double distance(const Loop& loop, const Vector2d& p) {
  double least = std::numeric_limits<double>::infinity();
  for (const TrimCurve& trim : loop.curves) {
    const Interval t = trim.curve.domain();
    const int pieces = trim.curve.degree() == 1 ? static_cast<int>(trim.curve.knots().spans().size())
                                                : 16 * static_cast<int>(trim.curve.knots().spans().size());
    Vector2d a = trim.curve.start();
    for (int k = 1; k <= pieces; ++k) {
      const Vector2d b = trim.curve(t.min + t.length() * k / pieces), d = b - a;
      const double s = d.squaredNorm() > 0 ? std::clamp((p - a).dot(d) / d.squaredNorm(), 0.0, 1.0) : 0.0;
      least = std::min(least, (p - a - s * d).norm());
      a = b;
    }
  }
  return least;
}

bool straight(const Curve2& curve) {
  const Vector2d a = curve.start(), d = curve.end() - a;
  for (Eigen::Index k = 0; k < curve.points().cols(); ++k) {
    const Vector2d p = curve.points().col(k) - a;
    if (std::abs(d.x() * p.y() - d.y() * p.x()) > 1e-9 * d.squaredNorm()) return false;
  }
  return d.squaredNorm() > 0;
}

bool says_grain(std::string name) {
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
  return name.find("grain") != std::string::npos;
}

class Finder {
 public:
  Finder(std::vector<LooseCurve> curves, const std::vector<LoosePoint>& points, double resolution) : points_(points) {
    Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (const LooseCurve& loose : curves)
      for (const Curve3& c : loose.pieces) {
        low = low.cwiseMin(c.points().rowwise().minCoeff());
        high = high.cwiseMax(c.points().rowwise().maxCoeff());
      }
    if (curves.empty() || !((high - low).norm() > 0) || !std::isfinite((high - low).norm())) return;
    // Coordinates far from the origin are no finer than their rounding.
    const double reach = std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff());
    tolerance_ = std::max({resolution, join_tolerance * (high - low).norm(), 64 * 2.3e-16 * reach});
    harmless_ = harmless_steps * std::max(resolution, step_of(curves));
    Places places(tolerance_);
    std::vector<Chain> closed;
    std::vector<bool> used;
    for (LooseCurve& loose : curves) {
      const std::size_t first = pieces_.size();
      for (Curve3& c : loose.pieces) {
        Piece piece{std::move(c), loose.id, loose.name};
        piece.from = places(piece.curve.start());
        piece.to = places(piece.curve.end());
        // Shorter than the tolerance: its neighbours meet without it.
        const bool nothing =
            piece.from == piece.to &&
            (piece.curve.points().colwise() - piece.curve.points().col(0)).colwise().norm().maxCoeff() <= tolerance_;
        if (!nothing) pieces_.push_back(std::move(piece));
      }
      std::optional<Chain> chain = drawing::closed_in_order(pieces_, first, pieces_.size() - first);
      used.resize(pieces_.size(), chain.has_value());
      if (chain) closed.push_back(std::move(*chain));
    }
    Chains chains(pieces_, std::move(used), places.count(), out_.notes);
    chains.find(places);
    open_ = std::move(chains.open);
    for (std::vector<Chain>* list : {&closed, &chains.closed})
      for (Chain& chain : *list) add_loop(std::move(chain));
    slit_pieces_ = std::move(chains.slits);
    if (loops_.empty() && out_.notes.empty()) explain(chains.loose, places);
  }

  Outlines find() {
    nest();
    make_panels();
    add_marks();
    add_slits();
    choose_grain();
    return std::move(out_);
  }

 private:
  static double step_of(const std::vector<LooseCurve>& curves);
  void explain(const std::vector<std::pair<int, int>>& loose, const Places& places);
  void add_loop(Chain chain);
  void add_repaired(Loop loop, std::vector<TrimCurve> curves);
  void nest();
  void make_panels();
  void add_marks();
  void add_slits();
  void choose_grain();
  int panel_at(const Vector3d& x) const;
  void add_mark(const Piece& piece);

  const std::vector<LoosePoint>& points_;
  double tolerance_ = 0, harmless_ = 0;
  std::vector<Piece> pieces_;
  std::vector<int> slit_pieces_;
  std::vector<std::pair<int, Curve2>> slits_;  // of outlines, with their plane
  std::vector<int> open_;
  std::vector<Plane> planes_;
  std::vector<Loop> loops_;
  std::vector<int> outer_;                            // loop of each panel
  std::vector<std::vector<std::size_t>> candidates_;  // marks of each panel that may be its grain line
  Outlines out_;
};

double Finder::step_of(const std::vector<LooseCurve>& curves) {
  std::vector<Vector2d> points;
  for (const LooseCurve& loose : curves) {
    for (const Curve3& c : loose.pieces) {
      if (c.degree() != 1) continue;
      for (Eigen::Index k = 0; k < c.points().cols(); ++k) {
        points.emplace_back(c.points().col(k).head<2>());
        points.emplace_back(c.points()(2, k), 0);
      }
    }
  }
  return points.empty() ? 0 : decimal_step(points);
}

// Nothing is closed: the two loose ends nearest to each other are the likeliest place of the fault.
void Finder::explain(const std::vector<std::pair<int, int>>& loose, const Places& places) {
  constexpr std::size_t most = 500;
  if (loose.size() < 2 || loose.size() > most) return;
  double gap = std::numeric_limits<double>::infinity();
  std::pair<std::size_t, std::size_t> ends;
  for (std::size_t i = 0; i < loose.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double d = (places.point(loose[i].first) - places.point(loose[j].first)).norm();
      if (d < gap) gap = d, ends = {j, i};
    }
  }
  out_.notes.push_back({pieces_[static_cast<std::size_t>(loose[ends.second].second)].id,
                        "the outline is open: it ends at " + place_text(places.point(loose[ends.second].first)) +
                            ", the nearest other end is " + text(gap) + " away at " +
                            place_text(places.point(loose[ends.first].first)) + " (ends nearer than " +
                            text(tolerance_) + " are joined)",
                        true});
}

void Finder::add_loop(Chain chain) {
  // From the smallest id on.
  const auto first = std::ranges::min_element(chain, {}, [&](const Step& s) { return s.piece; });
  std::rotate(chain.begin(), first, chain.end());
  Loop loop;
  for (const Step& step : chain) {
    const Piece& piece = pieces_[static_cast<std::size_t>(step.piece)];
    if (loop.name.empty()) loop.name = piece.name;
  }
  loop.id = pieces_[static_cast<std::size_t>(chain[0].piece)].id;
  Plane plane = plane_of(pieces_, chain);
  const auto leave_out = [&](const std::string& why) {
    out_.notes.push_back({loop.id, why});
    for (const Step& step : chain) open_.push_back(step.piece);
  };
  if (!(plane.normal.norm() > 0.5)) return leave_out("the closed outline encloses no area; it makes no panel");
  for (const Step& step : chain) {
    const Eigen::Matrix3Xd& p = pieces_[static_cast<std::size_t>(step.piece)].curve.points();
    const double off = (plane.normal.transpose() * p).array().operator-(plane.height).abs().maxCoeff();
    if (off > tolerance_)
      return leave_out("the closed outline leaves its plane by " + text(off) + "; it makes no panel");
  }
  const auto same = std::ranges::find_if(planes_, [&](const Plane& p) {
    return (p.normal - plane.normal).norm() <= 1e-9 && std::abs(p.height - plane.height) <= tolerance_;
  });
  loop.plane = static_cast<int>(same - planes_.begin());
  if (same == planes_.end()) planes_.push_back(plane);
  const Plane& in = planes_[static_cast<std::size_t>(loop.plane)];
  std::vector<TrimCurve> curves;
  for (const Step& step : chain) {
    TrimCurve trim;
    trim.curve = in_plane(in, pieces_[static_cast<std::size_t>(step.piece)].curve);
    if (step.reversed) trim.curve = reversed(trim.curve);
    trim.index = static_cast<int>(curves.size());
    curves.push_back(std::move(trim));
  }
  RepairedOutline repaired = repair_outline(std::move(curves), {tolerance_, harmless_});
  for (const OutlineChange& change : repaired.changes)
    out_.notes.push_back({loop.id, change.what + ", at (" + text(change.at.x()) + ", " + text(change.at.y()) + ")"});
  for (Curve2& slit : repaired.slits) slits_.emplace_back(loop.plane, std::move(slit));
  if (repaired.loops.empty()) return leave_out("the closed outline encloses nothing; it makes no panel");
  loop.chain = std::move(chain);
  for (std::vector<TrimCurve>& outline : repaired.loops) {
    add_repaired(loop, std::move(outline));
    loop.chain.clear();
  }
}

// One closed chain; curve K is its K-th.
void Finder::add_repaired(Loop loop, std::vector<TrimCurve> curves) {
  loop.low.setConstant(std::numeric_limits<double>::infinity());
  loop.high = -loop.low;
  for (TrimCurve& trim : curves) {
    trim.index = static_cast<int>(loop.curves.size());
    loop.low = loop.low.cwiseMin(trim.curve.points().rowwise().minCoeff());
    loop.high = loop.high.cwiseMax(trim.curve.points().rowwise().maxCoeff());
    const std::vector<TrimSpan> spans = trim_spans(trim.curve);
    loop.spans.insert(loop.spans.end(), spans.begin(), spans.end());
    loop.curves.push_back(std::move(trim));
  }
  // Ends that were joined are one point for the winding number.
  for (std::size_t k = 0; k < loop.spans.size(); ++k) {
    TrimSpan& next = loop.spans[(k + 1) % loop.spans.size()];
    next.u[0] = loop.spans[k].last().x();
    next.v[0] = loop.spans[k].last().y();
  }
  loops_.push_back(std::move(loop));
}

void Finder::nest() {
  std::ranges::stable_sort(loops_, {}, &Loop::id);
  // Larger ones first, so that a container is settled before what it holds.
  std::vector<std::size_t> order(loops_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return loops_[a].size() > loops_[b].size(); });
  std::vector<bool> gone(loops_.size(), false);
  for (std::size_t n = 0; n < order.size(); ++n) {
    Loop& loop = loops_[order[n]];
    for (std::size_t m = 0; m < n; ++m) {
      const Loop& other = loops_[order[m]];
      if (gone[order[m]] || other.plane != loop.plane) continue;
      if (repeats(other, loop, tolerance_)) {
        out_.notes.push_back({loop.id, "the closed curve repeats the outline of entity " + std::to_string(other.id) +
                                           "; it is left out"});
        gone[order[n]] = true;
        break;
      }
      const Sides where = sides(other, loop);
      if (where.inside && where.outside) {
        out_.notes.push_back({loop.id, "the closed curve crosses the outline of entity " + std::to_string(other.id) +
                                           "; it is kept as a mark"});
        for (const Step& step : loop.chain) {
          pieces_[static_cast<std::size_t>(step.piece)].of_closed = true;
          open_.push_back(step.piece);
        }
        gone[order[n]] = true;
        break;
      }
      if (!where.inside) continue;
      ++loop.depth;
      if (loop.parent < 0 || other.depth > loops_[static_cast<std::size_t>(loop.parent)].depth)
        loop.parent = static_cast<int>(order[m]);
    }
  }
  for (std::size_t k = 0; k < loops_.size(); ++k)
    if (gone[k]) loops_[k].depth = -1;
}

void Finder::make_panels() {
  for (std::size_t k = 0; k < loops_.size(); ++k) {
    const Loop& loop = loops_[k];
    if (loop.depth < 0 || loop.depth % 2 != 0) continue;
    std::vector<std::vector<TrimCurve>> bounds{loop.curves};
    for (const Loop& hole : loops_)
      if (hole.depth == loop.depth + 1 && hole.parent == static_cast<int>(k)) bounds.push_back(hole.curves);
    try {
      for (const std::vector<TrimCurve>& bound : bounds)
        if (const std::string crossing = self_crossing(bound); !crossing.empty()) throw GeometryError(crossing);
      TrimmedSurface face = flat_panel(std::move(bounds), planes_[static_cast<std::size_t>(loop.plane)].map);
      face.name = loop.name;
      TrimmedSurface valid = face;
      validate_loops(valid);
      out_.panels.push_back(std::move(face));
      out_.ids.push_back(loop.id);
      outer_.push_back(static_cast<int>(k));
    } catch (const GeometryError& error) {
      out_.notes.push_back({loop.id, std::string(error.what()) + "; it makes no panel", true});
    }
  }
}

// The panel whose outline holds the point: the deepest, as they may lie within each other's holes.
int Finder::panel_at(const Vector3d& x) const {
  int best = -1, depth = -1;
  for (std::size_t k = 0; k < outer_.size(); ++k) {
    const Loop& loop = loops_[static_cast<std::size_t>(outer_[k])];
    const Plane& plane = planes_[static_cast<std::size_t>(loop.plane)];
    if (std::abs(plane.normal.dot(x) - plane.height) > std::max(tolerance_, touch_tolerance * loop.size())) continue;
    if (loop.depth <= depth) continue;
    const Vector2d p = plane(x);
    const double near = touch_tolerance * loop.size();
    const bool boxed = (p - loop.low).minCoeff() >= -near && (loop.high - p).minCoeff() >= -near;
    if (!boxed || (side_of(loop, p) == Side::outside && distance(loop, p) > near)) continue;
    best = static_cast<int>(k);
    depth = loop.depth;
  }
  return best;
}

void Finder::add_mark(const Piece& piece) {
  const Interval domain = piece.curve.domain();
  int panel = -1;
  for (const double t : {domain.min + domain.length() / 2, domain.min, domain.max}) {
    panel = panel_at(piece.curve(t));
    if (panel >= 0) break;
  }
  if (panel < 0) {
    out_.notes.push_back({piece.id, "the open curve lies in no panel"});
    return;
  }
  TrimmedSurface& face = out_.panels[static_cast<std::size_t>(panel)];
  const Loop& loop = loops_[static_cast<std::size_t>(outer_[static_cast<std::size_t>(panel)])];
  PanelMark mark;
  mark.curve = in_plane(planes_[static_cast<std::size_t>(loop.plane)], piece.curve);
  mark.at = mark.curve->start();
  mark.text = piece.name;
  const double near = touch_tolerance * loop.size();
  const bool touches = distance(loop, mark.curve->start()) <= near || distance(loop, mark.curve->end()) <= near;
  const double length = (mark.curve->end() - mark.curve->start()).norm();
  if (says_grain(piece.name) && straight(*mark.curve)) {
    mark.kind = MarkKind::grain;
  } else if (touches && length <= notch_length * loop.size()) {
    mark.kind = MarkKind::notch;
  }
  if (mark.kind == MarkKind::line && !touches && !piece.of_closed && straight(*mark.curve))
    candidates_[static_cast<std::size_t>(panel)].push_back(face.marks.size());
  face.marks.push_back(std::move(mark));
}

void Finder::add_marks() {
  candidates_.resize(out_.panels.size());
  std::ranges::sort(open_);
  for (const int k : open_) add_mark(pieces_[static_cast<std::size_t>(k)]);
  for (const LoosePoint& point : points_) {
    const int panel = panel_at(point.at);
    if (panel < 0) {
      out_.notes.push_back(
          {point.id, std::string(point.text.empty() ? "the point" : "the text") + " lies in no panel"});
      continue;
    }
    const Loop& loop = loops_[static_cast<std::size_t>(outer_[static_cast<std::size_t>(panel)])];
    PanelMark mark;
    mark.at = planes_[static_cast<std::size_t>(loop.plane)](point.at);
    mark.kind = !point.text.empty()                                        ? MarkKind::text
                : distance(loop, mark.at) <= touch_tolerance * loop.size() ? MarkKind::notch
                                                                           : MarkKind::drill;
    mark.text = point.text.empty() ? point.name : point.text;
    out_.panels[static_cast<std::size_t>(panel)].marks.push_back(std::move(mark));
  }
}

void Finder::add_slits() {
  const auto add = [&](int panel, Curve2 curve) {
    if (panel < 0) return;  // outside of every panel: what the outline overshot
    PanelMark mark;
    mark.kind = MarkKind::slit;
    mark.at = curve.start();
    mark.curve = std::move(curve);
    out_.panels[static_cast<std::size_t>(panel)].marks.push_back(std::move(mark));
  };
  for (auto& [plane, slit] : slits_) {
    const AffinePatch& map = planes_[static_cast<std::size_t>(plane)].map;
    const Vector2d p = middle(slit);
    add(panel_at(map.origin + p.x() * map.du + p.y() * map.dv), std::move(slit));
  }
  for (const int k : slit_pieces_) {
    const Curve3& curve = pieces_[static_cast<std::size_t>(k)].curve;
    const int panel = panel_at(curve(curve.domain().min + curve.domain().length() / 2));
    if (panel < 0) continue;
    const Loop& loop = loops_[static_cast<std::size_t>(outer_[static_cast<std::size_t>(panel)])];
    add(panel, in_plane(planes_[static_cast<std::size_t>(loop.plane)], curve));
  }
}

void Finder::choose_grain() {
  for (std::size_t k = 0; k < out_.panels.size(); ++k) {
    TrimmedSurface& face = out_.panels[k];
    if (std::ranges::find(face.marks, MarkKind::grain, &PanelMark::kind) != face.marks.end()) continue;
    const std::vector<std::size_t>& candidates = candidates_[k];
    if (candidates.size() == 1) {
      face.marks[candidates[0]].kind = MarkKind::grain;
      out_.notes.push_back({out_.ids[k], "the one straight line inside the panel is taken as its grain line"});
    } else if (candidates.size() > 1) {
      out_.notes.push_back(
          {out_.ids[k], std::to_string(candidates.size()) +
                            " straight lines inside the panel could be its grain line and none is called "
                            "'grain': set grain_deg in the scene"});
    }
  }
}

}  // namespace

Outlines find_outlines(std::vector<LooseCurve> curves, const std::vector<LoosePoint>& points, double resolution) {
  return Finder(std::move(curves), points, resolution).find();
}

}  // namespace toile
