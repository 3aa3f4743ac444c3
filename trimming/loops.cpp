// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/loops.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include "geometry/error.h"
#include "trimming/contacts.h"
#include "trimming/loop_closing.h"
#include "trimming/material.h"
#include "trimming/text.h"
#include "trimming/winding.h"

namespace toile {
namespace {

using Eigen::Vector2d;

class Validator {
 public:
  Validator(TrimmedSurface& surface, const LoopOptions& options) : surface_(surface), options_(options) {}

  std::vector<LoopRepair> run() {
    check_outer_loops();
    repairs_ = close_loops(surface_, options_, true);
    spans_ = trim_spans(surface_.loops);
    std::vector<LoopContact> contacts = find_contacts(surface_.loops, spans_);
    const auto bad = std::ranges::find_if(contacts, [](const LoopContact& c) { return c.kind != ContactKind::touch; });
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
