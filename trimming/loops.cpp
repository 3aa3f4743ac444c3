// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/loops.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <set>

#include "geometry/error.h"
#include "geometry/measure.h"
#include "geometry/refine.h"
#include "trimming/contacts.h"
#include "trimming/loop_closing.h"
#include "trimming/material.h"
#include "trimming/text.h"
#include "trimming/winding.h"

namespace toile {
namespace {

using Eigen::Vector2d;

constexpr int most_tips = 100;  // that are cut off one face

class Validator {
 public:
  Validator(TrimmedSurface& surface, const LoopOptions& options) : surface_(surface), options_(options) {}

  std::vector<LoopRepair> run() {
    check_outer_loops();
    repairs_ = close_loops(surface_, options_, true);
    spans_ = trim_spans(surface_.loops);
    std::vector<LoopContact> contacts = find_contacts(surface_.loops, spans_);
    auto bad = std::ranges::find_if(contacts, not_touching);
    // Each cut leaves a loop without one of its tips.
    for (int cuts = 0; cuts < most_tips && bad != contacts.end() && cut_tip(*bad); ++cuts) {
      spans_ = trim_spans(surface_.loops);
      contacts = find_contacts(surface_.loops, spans_);
      bad = std::ranges::find_if(contacts, not_touching);
    }
    if (bad != contacts.end()) {
      resolve(*bad);
      spans_ = trim_spans(surface_.loops);
      contacts = find_contacts(surface_.loops, spans_);
    }
    check_simple(contacts);
    for (std::size_t l = 0; l < surface_.loops.size(); ++l) orient(static_cast<int>(l));
    check_nesting();
    return std::move(repairs_);
  }

 private:
  static bool not_touching(const LoopContact& c) { return c.kind != ContactKind::touch; }
  [[noreturn]] void fail(const TrimLoop& loop, const TrimCurve* curve, const std::string& what,
                         const Vector2d& uv) const {
    throw GeometryError(place_name(surface_, loop, curve) + ": " + what + " at " + point_text(uv));
  }

  static Vector2d start(const TrimCurve& c) {
    return c.curve.points().col(c.reversed ? c.curve.points().cols() - 1 : 0);
  }
  void check_outer_loops() const {
    std::vector<const TrimLoop*> outer;
    for (const TrimLoop& loop : surface_.loops) {
      if (loop.kind == LoopKind::outer) outer.push_back(&loop);
    }
    if (outer.empty()) throw GeometryError(place_name(surface_) + ": has no outer loop, needs exactly one");
    if (outer.size() == 1) return;
    const TrimLoop& second = *outer[1];
    throw GeometryError(place_name(surface_, second) + ": a second outer loop, beside loop " +
                        std::to_string(outer[0]->index) + "; make a face of each" +
                        (second.curves.empty() ? "" : " (at " + point_text(start(second.curves.front())) + ")"));
  }

  // "curve 2: crosses loop 1, curve 0," with the file's numbers.
  std::string contact_text(const LoopContact& contact) const {
    const TrimLoop& b = surface_.loops[static_cast<std::size_t>(contact.loop_b)];
    const TrimCurve& curve_b = b.curves[static_cast<std::size_t>(contact.curve_b)];
    const std::string other =
        contact.loop_a == contact.loop_b
            ? (contact.curve_a == contact.curve_b ? " itself" : " curve " + std::to_string(curve_b.index))
            : " loop " + std::to_string(b.index) + ", curve " + std::to_string(curve_b.index) + ",";
    return (contact.kind == ContactKind::crossing  ? "crosses"
            : contact.kind == ContactKind::overlap ? "runs along"
                                                   : "touches") +
           other;
  }
  // How near two parts are that can't be told apart, and what would have to be finer.
  std::string gap_text(const LoopContact& contact) const {
    if (contact.kind != ContactKind::overlap) return "";
    const Vector2d least = meeting_tolerance(surface_);
    return ", less than " + text(least.minCoeff()) + " apart; the file's resolution is " + text(surface_.resolution);
  }
  [[noreturn]] void fail(const LoopContact& contact, const std::string& why) const {
    const TrimLoop& a = surface_.loops[static_cast<std::size_t>(contact.loop_a)];
    throw GeometryError(place_name(surface_, a, &a.curves[static_cast<std::size_t>(contact.curve_a)]) + ": " +
                        contact_text(contact) + " at " + point_text(contact.uv) + gap_text(contact) + why);
  }

  // The neighbours that meet beyond a contact, in their loop's order.
  std::optional<std::array<int, 2>> neighbours(const LoopContact& contact) const {
    const int n = static_cast<int>(surface_.loops[static_cast<std::size_t>(contact.loop_a)].curves.size());
    if (contact.loop_a != contact.loop_b || n < 3) return std::nullopt;
    if ((contact.curve_a + 1) % n == contact.curve_b) return std::array{contact.curve_a, contact.curve_b};
    if ((contact.curve_b + 1) % n == contact.curve_a) return std::array{contact.curve_b, contact.curve_a};
    return std::nullopt;
  }

  double distance(const Vector2d& x, const Vector2d& y) const {
    return (surface_.surface(x.x(), x.y()) - surface_.surface(y.x(), y.y())).norm();
  }

  // Curves that meet in a cusp may cross before they meet: exporters fit each by itself. The tip beyond the crossing is
  // cut off where it is narrower than ten times the file's resolution.
  bool cut_tip(const LoopContact& contact) {
    const auto pair = neighbours(contact);
    if (contact.kind != ContactKind::crossing || !pair) return false;
    TrimLoop& loop = surface_.loops[static_cast<std::size_t>(contact.loop_a)];
    const auto [first, second] = *pair;
    TrimCurve &a = loop.curves[static_cast<std::size_t>(first)], &b = loop.curves[static_cast<std::size_t>(second)];
    const std::optional<Eigen::Vector2d> at = crossing_parameters(a.curve, b.curve, contact.uv);
    if (!at) return false;
    const Interval tip_a =
        a.reversed ? Interval{a.curve.domain().min, at->x()} : Interval{at->x(), a.curve.domain().max};
    const Interval tip_b =
        b.reversed ? Interval{at->y(), b.curve.domain().max} : Interval{b.curve.domain().min, at->y()};
    if (!(tip_a.length() > 0 && tip_b.length() > 0 && tip_a.length() < a.curve.domain().length() &&
          tip_b.length() < b.curve.domain().length()))
      return false;
    const double width = tip_width(a.curve, tip_a, b.curve, tip_b);
    if (!(width <= 10 * surface_.resolution)) return false;
    Vector2d x = a.curve(at->x());
    // A line of constant u or v stays one.
    for (const TrimCurve* c : {&a, &b})
      for (int axis = 0; axis < 2; ++axis)
        if (const auto row = c->curve.points().row(axis).array(); (row == row(0)).all()) x[axis] = row(0);
    const std::string what = "curves " + std::to_string(a.index) + " and " + std::to_string(b.index) +
                             " cross before they meet; the tip beyond, " + text(width) + " wide, is cut off";
    keep(a, a.reversed ? Interval{at->x(), a.curve.domain().max} : Interval{a.curve.domain().min, at->x()}, a.reversed,
         x);
    keep(b, b.reversed ? Interval{b.curve.domain().min, at->y()} : Interval{at->y(), b.curve.domain().max}, !b.reversed,
         x);
    repairs_.push_back({loop.index, what, 0, x});
    return true;
  }

  // The parameters of two curves where they cross, near to a place.
  static std::optional<Eigen::Vector2d> crossing_parameters(const Curve2& a, const Curve2& b, const Vector2d& near) {
    Eigen::Vector2d t(closest_point(a, near).t, closest_point(b, near).t);
    for (int k = 0; k < 20; ++k) {
      const auto ja = evaluate(a, t.x()), jb = evaluate(b, t.y());
      Eigen::Matrix2d m;
      m << ja.d1, -jb.d1;
      const Eigen::Vector2d step = m.fullPivLu().solve(jb.x - ja.x);
      if (!step.allFinite()) return std::nullopt;
      t += step;
      t = {std::clamp(t.x(), a.domain().min, a.domain().max), std::clamp(t.y(), b.domain().min, b.domain().max)};
      if (step.norm() <= 1e-15 * t.norm()) break;
    }
    return t;
  }

  // Width in space of what lies between two stretches of curves: the largest distance across it.
  double tip_width(const Curve2& a, const Interval& of_a, const Curve2& b, const Interval& of_b) const {
    constexpr int places = 16;
    const Curve2 other = sub_curve(b, of_b);
    double width = 0;
    for (int k = 1; k < places; ++k) {
      const Vector2d x = a(of_a.min + of_a.length() * k / places), y = closest_point(other, x).x;
      width = std::max(width, distance(x, y));
    }
    return width;
  }

  // A stretch of a curve, of which one end is put where the other curve's is.
  static void keep(TrimCurve& c, const Interval& range, bool start, const Vector2d& end) {
    Curve2 part = sub_curve(c.curve, range);
    Curve2::Points points = part.points();
    points.col(start ? 0 : points.cols() - 1) = end;
    c.curve = Curve2(part.knots(), std::move(points), part.weights());
    c.model.reset();
  }

  // Loops that cross or run along each other become loops that do neither.
  void resolve(const LoopContact& bad) {
    Material material;
    try {
      material = material_of(surface_.loops, {true, meeting_tolerance(surface_)});
    } catch (const GeometryError& error) {
      fail(bad, std::string("; ") + error.what());
    }
    if (material.panels.size() != 1)
      fail(bad, "; what they bound is " + std::to_string(material.panels.size()) + " pieces; make a face of each");
    surface_.loops = std::move(material.panels[0].loops);
    std::ranges::move(material.panels[0].marks, std::back_inserter(surface_.marks));
    std::ranges::move(material.changes, std::back_inserter(repairs_));
    number_loops();
    // Holes beyond the border are cut off now; what rounding leaves there moves in.
    std::ranges::move(close_loops(surface_, options_, true), std::back_inserter(repairs_));
  }

  // A loop that came apart keeps its number once.
  void number_loops() {
    std::set<int> taken;
    int free = 0;
    for (const TrimLoop& loop : surface_.loops) free = std::max(free, loop.index + 1);
    for (TrimLoop& loop : surface_.loops)
      if (!taken.insert(loop.index).second) loop.index = free++;
  }

  void check_simple(const std::vector<LoopContact>& contacts) {
    for (const LoopContact& contact : contacts) {
      if (contact.kind != ContactKind::touch) fail(contact, "");
      if (contact.loop_a != contact.loop_b) {
        check_sides(contact.loop_a, contact.loop_b, contact.uv);
        check_sides(contact.loop_b, contact.loop_a, contact.uv);
      }
      const TrimLoop& a = surface_.loops[static_cast<std::size_t>(contact.loop_a)];
      const int curve = a.curves[static_cast<std::size_t>(contact.curve_a)].index;
      repairs_.push_back({a.index, "curve " + std::to_string(curve) + " " + contact_text(contact), 0, contact.uv});
    }
  }

  std::optional<int> winding(int l, const Vector2d& x) { return winding_number(surface_.loops, spans_, l, x, counts_); }

  // A simple loop winds once around the points on one side of it: exact winding numbers of two points close to it.
  void orient(int l) {
    TrimLoop& loop = surface_.loops[static_cast<std::size_t>(l)];
    const int wanted = loop.kind == LoopKind::outer ? 1 : -1;
    for (const TrimSpan& span : spans_.of(l)) {
      const Vector2d x = span.at(0.5), chord = span.at(0.51) - span.at(0.49);
      const bool backwards = loop.curves[static_cast<std::size_t>(span.curve)].reversed;
      const double aspect = surface_.surface.u().domain().length() / surface_.surface.v().domain().length();
      const Vector2d left = (backwards ? -1 : 1) * Vector2d(-chord.y() * aspect, chord.x() / aspect);
      for (double reach = 1; reach > 1e-13; reach /= 8) {
        const auto inner = winding(l, x + reach * left), outer = winding(l, x - reach * left);
        if (!inner || !outer || *inner - *outer != 1 || *inner * *outer != 0) continue;
        if (*inner + *outer != wanted) {
          std::reverse(loop.curves.begin(), loop.curves.end());
          for (TrimCurve& c : loop.curves) c.reversed = !c.reversed;
          repairs_.push_back({loop.index, "reversed", 0, start(loop.curves.front()), true});
          spans_ = trim_spans(surface_.loops);
        }
        return;
      }
    }
    throw GeometryError(place_name(surface_, loop) + ": encloses nothing");
  }

  // A loop that only touches `other` has all its span ends, which are exact points of it, on one side or on `other`.
  // How branches leave a contact is read from rounded points; this is not.
  void check_sides(int l, int other, const Vector2d& contact) {
    std::optional<bool> within;
    for (const TrimSpan& span : spans_.of(l)) {
      const auto n = winding(other, span.first());
      if (!n) continue;
      const bool in = *n != 0;
      if (within.value_or(in) != in) {
        const TrimLoop& loop = surface_.loops[static_cast<std::size_t>(l)];
        fail(loop, &loop.curves[static_cast<std::size_t>(span.curve)],
             "crosses loop " + std::to_string(surface_.loops[static_cast<std::size_t>(other)].index), contact);
      }
      within = in;
    }
  }

  void check_nesting() {
    const int count = static_cast<int>(surface_.loops.size());
    for (int l = 0; l < count; ++l) {
      const TrimLoop& loop = surface_.loops[static_cast<std::size_t>(l)];
      if (loop.kind == LoopKind::outer) continue;
      for (int other = 0; other < count; ++other) {
        if (other == l) continue;
        const TrimLoop& of = surface_.loops[static_cast<std::size_t>(other)];
        const bool within = winding_around(surface_.loops, spans_, l, other, counts_) != 0;
        if (of.kind == LoopKind::outer && !within)
          fail(loop, nullptr, "the hole lies outside the outer loop", start(loop.curves.front()));
        if (of.kind == LoopKind::hole && within)
          fail(loop, nullptr, "the hole lies inside loop " + std::to_string(of.index) + ", another hole",
               start(loop.curves.front()));
      }
    }
  }

  TrimmedSurface& surface_;
  const LoopOptions& options_;
  TrimSpans spans_;
  PredicateCounts counts_;
  std::vector<LoopRepair> repairs_;
};

}  // namespace

std::vector<LoopRepair> validate_loops(TrimmedSurface& surface, const LoopOptions& options) {
  return Validator(surface, options).run();
}

}  // namespace toile
