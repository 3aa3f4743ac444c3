// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/outline_repair.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "geometry/measure.h"
#include "geometry/refine.h"
#include "geometry/text.h"
#include "io/flat_panel.h"
#include "trimming/contacts.h"

namespace toile {

namespace {

using Eigen::Vector2d;
using Chain = std::vector<TrimCurve>;

constexpr double backwards = 0.02;  // sine of the angle between a stretch and the one that comes back along it
constexpr double largest_join = 1e-3, largest_harmless = 1e-2;  // of the outline's size, whatever the tolerances
constexpr int max_crossings = 64;                               // of one outline that are cut off

std::string place(const Vector2d& p) {
  return std::string("(") + text(p.x()) + ", " + text(p.y()) + ")";
}

bool is_polyline(const Curve2& c) {
  return c.degree() == 1 && !c.rational();
}

std::vector<Vector2d> vertices(const Curve2& c) {
  std::vector<Vector2d> out;
  for (Eigen::Index k = 0; k < c.points().cols(); ++k) out.emplace_back(c.points().col(k));
  return out;
}

// Does q -> r come back along p -> q?
bool comes_back(const Vector2d& p, const Vector2d& q, const Vector2d& r, double join) {
  const Vector2d out = p - q, back = r - q;
  const double lengths = out.norm() * back.norm();
  if (!(lengths > 0) || !(out.dot(back) > 0)) return false;
  const double cross = std::abs(out.x() * back.y() - out.y() * back.x());
  return cross <= backwards * lengths && cross <= join * std::max(out.norm(), back.norm());
}

// b is a run backwards, within `join`.
bool same_backwards(const Curve2& a, const Curve2& b, double join) {
  if ((a.start() - b.end()).norm() > join || (a.end() - b.start()).norm() > join) return false;
  constexpr int places = 8;
  for (int k = 1; k < places; ++k) {
    const Vector2d p = a(a.domain().min + a.domain().length() * k / places);
    if (closest_point<2>(b, p).distance > join) return false;
  }
  return a.start() != a.end();
}

Vector2d extent(const Chain& chain) {
  if (chain.empty()) return {0, 0};
  Vector2d low = chain[0].curve.points().col(0), high = low;
  for (const TrimCurve& trim : chain) {
    low = low.cwiseMin(trim.curve.points().rowwise().minCoeff());
    high = high.cwiseMax(trim.curve.points().rowwise().maxCoeff());
  }
  return high - low;
}

class Repair {
 public:
  explicit Repair(const OutlineTolerances& tolerances) : tolerances_(tolerances) {}
  RepairedOutline run(Chain chain) {
    // Coarse numbers are no reason to take a shape of their size for an accident.
    const double size = extent(chain).maxCoeff();
    tolerances_.join = std::min(tolerances_.join, largest_join * size);
    tolerances_.harmless = std::min(tolerances_.harmless, largest_harmless * size);
    take_apart(std::move(chain));
    for (std::vector<Vector2d>& spike : spikes_) {
      std::ranges::reverse(spike);  // from the outline inwards
      double length = 0;
      for (std::size_t k = 0; k + 1 < spike.size(); ++k) length += (spike[k + 1] - spike[k]).norm();
      out_.changes.push_back(
          {"an edge is drawn out and back, " + text(length) + " long: a slit, kept as a mark", spike.front(), length});
      out_.slits.push_back(polyline_curve(spike));
    }
    for (Chain& loop : out_.loops) cut_crossings(loop);
    return std::move(out_);
  }

 private:
  void take_apart(Chain chain) {
    split_at_spikes(chain);
    while (take_back(chain)) {
    }
    join_halves(chain);
    for (std::size_t i = 0; i < chain.size(); ++i) {
      for (std::size_t j = i + 2; j < chain.size(); ++j) {
        if (i == 0 && j + 1 == chain.size()) continue;
        if (!same_backwards(chain[i].curve, chain[j].curve, tolerances_.join)) continue;
        const Curve2 cut = chain[i].curve;
        out_.changes.push_back({"an edge is drawn out, around a loop and back: a cut, kept as a mark", cut.start(),
                                (cut.end() - cut.start()).norm()});
        out_.slits.push_back(cut);
        const auto at = [&](std::size_t k) { return chain.begin() + static_cast<std::ptrdiff_t>(k); };
        Chain inner(at(i + 1), at(j)), outer(at(j + 1), chain.end());
        outer.insert(outer.end(), at(0), at(i));
        take_apart(std::move(inner));
        take_apart(std::move(outer));
        return;
      }
    }
    if (!chain.empty()) out_.loops.push_back(std::move(chain));
  }

  void split_at_spikes(Chain& chain) const {
    for (std::size_t k = 0; k < chain.size(); ++k) {
      if (!is_polyline(chain[k].curve)) continue;
      const std::vector<Vector2d> points = vertices(chain[k].curve);
      for (std::size_t v = 1; v + 1 < points.size(); ++v) {
        if (!comes_back(points[v - 1], points[v], points[v + 1], tolerances_.join)) continue;
        const auto at = points.begin() + static_cast<std::ptrdiff_t>(v);
        TrimCurve rest = chain[k];
        chain[k].curve = polyline_curve({points.begin(), at + 1});
        rest.curve = polyline_curve({at, points.end()});
        chain.insert(chain.begin() + static_cast<std::ptrdiff_t>(k) + 1, std::move(rest));
        break;
      }
    }
  }
  // Parts of one polyline that nothing came of are one again.
  void join_halves(Chain& chain) const {
    for (std::size_t k = 0; k + 1 < chain.size();) {
      TrimCurve &a = chain[k], &b = chain[k + 1];
      if (a.index != b.index || !is_polyline(a.curve) || !is_polyline(b.curve)) {
        ++k;
        continue;
      }
      std::vector<Vector2d> points = vertices(a.curve);
      const std::vector<Vector2d> more = vertices(b.curve);
      points.insert(points.end(), more.begin() + 1, more.end());
      a.curve = polyline_curve(points);
      chain.erase(chain.begin() + static_cast<std::ptrdiff_t>(k) + 1);
    }
  }

  // One stretch that comes back at once; false where there is none.
  bool take_back(Chain& chain) {
    for (std::size_t i = 0; i < chain.size(); ++i) {
      const std::size_t j = (i + 1) % chain.size();
      if (i == j) return false;
      TrimCurve &a = chain[i], &b = chain[j];
      if (is_polyline(a.curve) && is_polyline(b.curve)) {
        std::vector<Vector2d> out = vertices(a.curve), back = vertices(b.curve);
        const Vector2d p = out[out.size() - 2], q = out.back(), r = back[1];
        if (!comes_back(p, q, r, tolerances_.join)) continue;
        const double to_p = (p - q).norm(), to_r = (r - q).norm();
        const Vector2d base = to_r < to_p - tolerances_.join ? r : p;
        add_spike(q, base);
        if (to_p > to_r + tolerances_.join) {
          out.back() = r;
        } else {
          out.pop_back();
        }
        if (to_r > to_p + tolerances_.join) {
          back.front() = p;
        } else {
          back.erase(back.begin());
          back.front() = base;
        }
        replace(chain, i, j, out, back);
        return true;
      }
      if (!same_backwards(a.curve, b.curve, tolerances_.join)) continue;
      const double length = (a.curve.end() - a.curve.start()).norm();
      out_.changes.push_back({"a curve is drawn out and back: a slit, kept as a mark", a.curve.start(), length});
      out_.slits.push_back(a.curve);
      replace(chain, i, j, {}, {});
      return true;
    }
    return false;
  }
  static void replace(Chain& chain, std::size_t i, std::size_t j, const std::vector<Vector2d>& out,
                      const std::vector<Vector2d>& back) {
    if (out.size() > 1) chain[i].curve = polyline_curve(out);
    if (back.size() > 1) chain[j].curve = polyline_curve(back);
    std::vector<std::size_t> gone;
    if (out.size() < 2) gone.push_back(i);
    if (back.size() < 2) gone.push_back(j);
    std::ranges::sort(gone, std::greater<>());
    for (const std::size_t k : gone) chain.erase(chain.begin() + static_cast<std::ptrdiff_t>(k));
  }
  void add_spike(const Vector2d& tip, const Vector2d& base) {
    for (std::vector<Vector2d>& spike : spikes_) {
      if (spike.back() != tip) continue;
      spike.push_back(base);
      return;
    }
    spikes_.push_back({tip, base});
  }

  void cut_crossings(Chain& chain);

  OutlineTolerances tolerances_;
  std::vector<std::vector<Vector2d>> spikes_;  // tip first
  RepairedOutline out_;
};

// A place on a chain.
struct At {
  std::size_t curve = 0;
  double t = 0;
};

// Parameters at which a curve passes a point that it passes twice.
std::vector<double> passes(const Curve2& curve, const Vector2d& p) {
  const Interval domain = curve.domain();
  const int samples = 32 * static_cast<int>(curve.knots().spans().size());
  const auto distance = [&](int k) { return (curve(domain.min + domain.length() * k / samples) - p).norm(); };
  std::vector<double> out;
  for (int k = 0; k <= samples; ++k) {
    if ((k > 0 && distance(k - 1) < distance(k)) || (k < samples && distance(k + 1) <= distance(k))) continue;
    ClosestPointOptions options;
    options.start = Vector2d(domain.min + domain.length() * k / samples, 0);
    const auto found = closest_point<2>(curve, p, options);
    if (found.distance <= 1e-6 * (curve.points().rowwise().maxCoeff() - curve.points().rowwise().minCoeff()).norm())
      out.push_back(found.t);
  }
  std::ranges::sort(out);
  return out;
}

struct Crossing {
  At first, second;  // in the order of the chain
  Vector2d at;
  bool overlap = false;
};

// Neighbours' ends bitwise one, for predicates.
TrimLoop joined(Chain chain) {
  for (std::size_t k = 0; k < chain.size(); ++k) {
    TrimCurve& next = chain[(k + 1) % chain.size()];
    Curve2::Points points = next.curve.points();
    points.col(0) = chain[k].curve.points().col(chain[k].curve.points().cols() - 1);
    next.curve = Curve2(next.curve.knots(), std::move(points), next.curve.weights());
  }
  TrimLoop loop;
  loop.curves = std::move(chain);
  return loop;
}

std::vector<Crossing> crossings(const Chain& chain) {
  const std::vector<TrimLoop> loops{joined(chain)};
  std::vector<Crossing> out;
  for (const LoopContact& contact : find_contacts(loops, trim_spans(loops))) {
    if (contact.kind == ContactKind::touch) continue;
    Crossing c{{static_cast<std::size_t>(contact.curve_a), 0},
               {static_cast<std::size_t>(contact.curve_b), 0},
               contact.uv,
               contact.kind == ContactKind::overlap};
    if (c.first.curve > c.second.curve) std::swap(c.first, c.second);
    if (c.first.curve == c.second.curve) {
      const std::vector<double> t = passes(chain[c.first.curve].curve, contact.uv);
      if (t.empty()) continue;
      c.first.t = t.front();
      c.second.t = t.back();
    } else {
      c.first.t = closest_point<2>(chain[c.first.curve].curve, contact.uv).t;
      c.second.t = closest_point<2>(chain[c.second.curve].curve, contact.uv).t;
    }
    out.push_back(c);
  }
  return out;
}

// The chain from one place on to the other; over its end where that lies before.
Chain part(const Chain& chain, const At& from, const At& to) {
  Chain out;
  const auto add = [&](std::size_t k, double t0, double t1) {
    if (!(t1 > t0)) return;
    out.push_back(chain[k]);
    if (t0 != chain[k].curve.domain().min || t1 != chain[k].curve.domain().max)
      out.back().curve = sub_curve(chain[k].curve, {t0, t1});
  };
  const auto domain = [&](std::size_t k) { return chain[k].curve.domain(); };
  if (from.curve == to.curve && from.t < to.t) {
    add(from.curve, from.t, to.t);
    return out;
  }
  add(from.curve, from.t, domain(from.curve).max);
  for (std::size_t k = (from.curve + 1) % chain.size(); k != to.curve; k = (k + 1) % chain.size())
    add(k, domain(k).min, domain(k).max);
  add(to.curve, domain(to.curve).min, to.t);
  return out;
}

// Both ends of a part that becomes a chain of its own.
void close_at(Chain& chain, const Vector2d& p) {
  Curve2& first = chain.front().curve;
  Curve2::Points points = first.points();
  points.col(0) = p;
  first = Curve2(first.knots(), points, first.weights());
  Curve2& last = chain.back().curve;
  points = last.points();
  points.col(points.cols() - 1) = p;
  last = Curve2(last.knots(), points, last.weights());
}

void Repair::cut_crossings(Chain& chain) {
  for (int round = 0; round < max_crossings; ++round) {
    bool cut = false;
    for (const Crossing& c : crossings(chain)) {
      if (c.overlap) continue;
      Chain between = part(chain, c.first, c.second), around = part(chain, c.second, c.first);
      Chain* small = extent(between).maxCoeff() <= extent(around).maxCoeff() ? &between : &around;
      Chain* large = small == &between ? &around : &between;
      const Vector2d size = extent(*small);
      if (size.maxCoeff() > tolerances_.harmless || large->empty()) continue;
      close_at(*large, c.at);
      // The part that goes on over the chain's end begins where the chain did.
      const auto start =
          std::ranges::adjacent_find(*large, [](const auto& a, const auto& b) { return b.index < a.index; });
      if (start != large->end()) std::rotate(large->begin(), start + 1, large->end());
      out_.changes.push_back(
          {"the outline crosses itself; the loop there, " + text(size.x()) + " x " + text(size.y()) + ", is cut off",
           c.at, size.maxCoeff()});
      chain = std::move(*large);
      cut = true;
      break;
    }
    if (!cut) return;
  }
}

}  // namespace

double decimal_step(const std::vector<Vector2d>& points) {
  double scale = 1;
  for (int places = 0; places <= 9; ++places, scale *= 10) {
    const auto whole = [&](double x) {
      return std::abs(x * scale - std::round(x * scale)) <= 1e-6 + 1e-15 * std::abs(x * scale);
    };
    if (std::ranges::all_of(points, [&](const Vector2d& p) { return whole(p.x()) && whole(p.y()); })) return 1 / scale;
  }
  return 0;
}

RepairedOutline repair_outline(std::vector<TrimCurve> chain, const OutlineTolerances& tolerances) {
  return Repair(tolerances).run(std::move(chain));
}

std::string self_crossing(const std::vector<TrimCurve>& chain) {
  for (const Crossing& c : crossings(chain)) {
    if (c.overlap) return "the outline runs along itself at " + place(c.at);
    const Vector2d between = extent(part(chain, c.first, c.second)), around = extent(part(chain, c.second, c.first));
    const Vector2d size = between.maxCoeff() <= around.maxCoeff() ? between : around;
    return "the outline crosses itself at " + place(c.at) + "; the smaller loop there measures " + text(size.x()) +
           " x " + text(size.y());
  }
  return {};
}

}  // namespace toile
