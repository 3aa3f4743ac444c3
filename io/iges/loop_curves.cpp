// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/iges/loop_curves.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/error.h"
#include "geometry/measure.h"
#include "geometry/refine.h"
#include "io/iges/entity.h"
#include "io/iges/parameter_reading.h"
#include "trimming/pull_back.h"

namespace toile::iges {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Of the surface's size: model curves further off it, or parameter curves further off them, bound something else.
constexpr double believable = 1e-2;
constexpr double bridgeable = 1e-2;  // of the domain: wider gaps are refused
constexpr double corner = 0.01;      // tangent of the angle by which a curve turns at once
constexpr const char* out_of_order =
    "its curves don't follow each other in the file's order; they are sorted by their ends";

Curve2 flattened(const Curve3& c) {
  return Curve2(c.knots(), c.points().topRows<2>(), c.weights());
}

// The order in which curves, given by their ends, follow each other from the first one on, each running either way.
// Empty where that is the order they have, or where they don't close within `reach`.
template <class Point>
std::vector<std::size_t> order_by_ends(const std::vector<std::array<Point, 2>>& ends, double reach) {
  const std::size_t n = ends.size();
  if (n < 3 || n > 1000) return {};
  std::vector<std::size_t> order{0};
  std::vector<bool> taken(n, false);
  Point at = ends[0][1];
  while (order.size() < n) {
    taken[order.back()] = true;
    std::size_t best = 0;
    int side = 0;
    double least = reach;
    for (std::size_t i = 0; i < n; ++i)
      for (int k = 0; k < 2; ++k)
        if (const double d = (ends[i][static_cast<std::size_t>(k)] - at).norm(); !taken[i] && d <= least) {
          least = d;
          best = i;
          side = k;
        }
    if (best == 0) return {};
    order.push_back(best);
    at = ends[best][static_cast<std::size_t>(1 - side)];
  }
  if ((at - ends[0][0]).norm() > reach || std::ranges::is_sorted(order)) return {};
  return order;
}

// A curve cut where it turns a corner: one curve may run all around a face, whose size this is.
std::vector<Curve3> smooth_pieces(const Curve3& c, double size) {
  std::vector<double> corners;
  const int p = c.degree();
  for (int i = p + 1; i + p <= c.knots().control_point_count(); ++i) {
    if (c.knots()[i] != c.knots()[i + p - 1] || c.knots()[i] == c.domain().min || c.knots()[i] >= c.domain().max)
      continue;
    const Vector3d before = c.points().col(i - 1) - c.points().col(i - 2),
                   after = c.points().col(i) - c.points().col(i - 1);
    // Where a curve stands still its legs are rounding.
    if (std::min(before.norm(), after.norm()) <= 1e-7 * size) continue;
    if (!corners.empty() && corners.back() == c.knots()[i]) continue;
    if (before.dot(after) <= 0 || before.cross(after).norm() > corner * before.dot(after))
      corners.push_back(c.knots()[i]);
  }
  if (p < 2 || corners.empty()) return {c};
  std::vector<Curve3> out;
  double from = c.domain().min;
  for (const double to : corners) {
    out.push_back(sub_curve(c, {from, to}));
    from = to;
  }
  out.push_back(sub_curve(c, {from, c.domain().max}));
  return out;
}

class LoopCurves {
 public:
  LoopCurves(const FacePlane& plane, const ParameterMap& map) : plane_(plane), map_(map) {}

  std::vector<TrimCurve> run(BoundaryCurves& b) const {
    std::vector<TrimCurve> out = best_of(b);
    bridge_gaps(out, b);
    return out;
  }

 private:
  // The parameter curves, or what the model curves draw where those are better.
  std::vector<TrimCurve> best_of(BoundaryCurves& b) const {
    std::string trouble;
    std::vector<TrimCurve> own;
    double off = 0;
    if (b.parameter.empty()) {
      trouble = "there are no parameter curves";
    } else {
      own = from_parameters(b, b.parameter);
      const Fit fit = fit_of(own);
      if (fit.gap > usable)
        trouble = "its parameter curves don't close: gap " + format_real(fit.gap) + " of the domain";
      if (fit.excursion > usable) trouble = "its parameter curves leave the domain by " + format_real(fit.excursion);
      if (!b.model.empty()) {
        off = disagreement(plane_, b, map_);
        const std::string apart = "its parameter curves lie " + format_real(off) + " from its model curves";
        const bool taken = b.parameter_preferred && off <= believable * plane_.size;
        if (trouble.empty() && off > agreed(plane_)) {
          if (taken)
            plane_.note(b, "apart", apart + "; the boundary prefers the parameter curves, which are taken");
          else
            trouble = apart;
        }
        if (b.model.size() != b.parameter.size())
          plane_.note(b, "segment counts",
                      std::to_string(b.parameter.size()) + " parameter curves and " + std::to_string(b.model.size()) +
                          " model curves" + (trouble.empty() ? "; the parameter curves are taken" : ""));
      }
    }
    if (b.parameter.size() == b.model.size())
      for (TrimCurve& c : own)
        if (const auto i = static_cast<std::size_t>(c.index); i < b.model.size()) c.model = b.model[i];
    if (trouble.empty()) return own;
    if (b.model.empty()) {
      if (own.empty()) plane_.fail(b, "it has neither parameter curves nor model curves");
      plane_.note(b, "bad loop", trouble);
      return own;
    }
    std::string why;
    try {
      Pulled p = pulled(b);
      const Fit fit = fit_of(p.curves);
      // Where neither is good the file's parameter curves stay, for validation to say where they fail.
      const Fit old = own.empty() ? Fit{1, 1} : fit_of(own);
      const bool better =
          std::max(fit.gap, fit.excursion) < std::max(old.gap, old.excursion) || (fit.good() && p.distance < 0.5 * off);
      if (p.distance <= believable * plane_.size && (better || own.empty())) {
        plane_.note(b, "pulled back",
                    trouble + "; its model curves are pulled back onto the surface, " +
                        (p.error > 0 ? "off by " + format_real(p.error) : std::string("exactly")) +
                        (p.distance > std::max(plane_.options.resolution, 1e-9 * plane_.size)
                             ? "; they lie " + format_real(p.distance) + " off it"
                             : std::string()));
        b.converted = "parameter curves pulled back from the model curves, " +
                      (p.error > 0 ? "off by " + format_real(p.error) : std::string("exactly")) +
                      ", the model curves lying " + format_real(p.distance) + " off the surface";
        if (p.sorted) plane_.note(b, "order", out_of_order);
        return std::move(p.curves);
      }
      why = "its model curves lie " + format_real(p.distance) + " off the surface at (" + format_real(p.place.x()) +
            ", " + format_real(p.place.y()) + ", " + format_real(p.place.z()) + ")";
    } catch (const GeometryError& error) {
      why = error.what();
    }
    if (own.empty()) plane_.fail(b, trouble + ", and " + why);
    plane_.note(b, "bad loop", trouble + ", and " + why);
    return own;
  }

  // Each curve's direction, and its period where the surface is closed, so that it begins where the one before it ends.
  // Ends that meet as they stand go before ends that meet a period apart. Where ends don't meet at all, as at a pole
  // whose side the file leaves out, the later curves keep the period in which the loop closes.
  void chain(std::vector<TrimCurve>& curves) const {
    const auto gap = [&](const Vector2d& a, const Vector2d& b, bool across) {
      Vector2d d = b - a;
      for (int k = 0; k < 2; ++k) {
        const auto i = static_cast<std::size_t>(k);
        if (across && plane_.closed[i]) d[k] -= plane_.period[i] * std::round(d[k] / plane_.period[i]);
        d[k] /= plane_.domain[i].length();
      }
      return d.norm();
    };
    const auto turn_to_meet = [&](TrimCurve& c, auto&& distance) {
      for (const bool across : {false, true}) {
        if (distance(c, across) <= usable) return;
        c.reversed = !c.reversed;
        if (distance(c, across) <= usable) return;
        c.reversed = !c.reversed;
      }
    };
    const std::size_t n = curves.size();
    if (n > 1) {
      turn_to_meet(curves[0], [&](const TrimCurve& c, bool across) {
        return std::min(gap(last(c), first(curves[1]), across), gap(last(c), last(curves[1]), across));
      });
    }
    std::size_t broken = n;  // the last curve whose start doesn't meet what precedes it
    Vector2d periods{0, 0};  // by which the latest curve has been shifted
    for (std::size_t i = 1; i < n; ++i) {
      const Vector2d x = last(curves[i - 1]);
      turn_to_meet(curves[i], [&](const TrimCurve& c, bool across) { return gap(x, first(c), across); });
      const Vector2d from = first(curves[i]);
      if (gap(x, from, true) > usable || along_pole(x, from + periods))
        broken = i;
      else
        periods = whole_periods(x - from);
      shift_by(curves[i], periods);
    }
    const Vector2d tail = last(curves.back()), head = first(curves.front());
    if (broken == n || along_pole(tail, head)) return;
    for (std::size_t i = broken; i < n; ++i) shift_by(curves[i], -whole_periods(tail - head));
  }

  // Whether a jump is the side of the surface that is one point in space, from end to end or in part.
  bool along_pole(const Vector2d& a, const Vector2d& b) const {
    const Vector2d jump = (b - a).cwiseQuotient(Vector2d(plane_.domain[0].length(), plane_.domain[1].length()));
    return jump.norm() > usable && std::min(std::abs(jump.x()), std::abs(jump.y())) <= usable && collapsed(a, b);
  }

  // The whole periods nearest to a way.
  Vector2d whole_periods(const Vector2d& way) const {
    Vector2d out{0, 0};
    for (int k = 0; k < 2; ++k)
      if (const double period = plane_.period[static_cast<std::size_t>(k)]; period > 0)
        out[k] = period * std::round(way[k] / period);
    return out;
  }
  static void shift_by(TrimCurve& c, const Vector2d& way) {
    for (int k = 0; k < 2; ++k) shift(c, k, way[k]);
  }

  // Whether the straight way between two places of the parameter plane is one point in space.
  bool collapsed(const Vector2d& a, const Vector2d& b) const {
    const double reach = std::max(plane_.options.resolution, 1e-6 * plane_.size);
    const Vector3d start = point_at(plane_, a);
    for (int k = 1; k <= 4; ++k)
      if ((point_at(plane_, a + (b - a) * k / 4) - start).norm() > reach) return false;
    return true;
  }

  // Where a surface is collapsed to a point, exporters leave out the side that has no length: a leg along it.
  void bridge_poles(std::vector<TrimCurve>& curves) const {
    for (std::size_t i = 0; i < curves.size(); ++i) {
      const Vector2d a = last(curves[i]), b = first(curves[(i + 1) % curves.size()]);
      if (!along_pole(a, b)) continue;
      curves.insert(curves.begin() + static_cast<std::ptrdiff_t>(++i), leg(a, b, static_cast<int>(curves.size())));
    }
  }

  // Gaps too wide to be closed by moving ends, and narrow beside the surface: a straight piece.
  void bridge_gaps(std::vector<TrimCurve>& curves, BoundaryCurves& b) const {
    for (std::size_t i = 0; i < curves.size(); ++i) {
      const Vector2d from = last(curves[i]), to = first(curves[(i + 1) % curves.size()]);
      const double jump =
          (to - from).cwiseQuotient(Vector2d(plane_.domain[0].length(), plane_.domain[1].length())).norm();
      if (jump <= usable || jump > bridgeable) continue;
      plane_.note(b, "gap",
                  "a gap of " + format_real(jump) + " of the domain, " +
                      format_real((point_at(plane_, to) - point_at(plane_, from)).norm()) + " in space, after curve " +
                      std::to_string(curves[i].index) + " is closed by a straight piece");
      b.converted = "a gap closed by a straight piece";
      curves.insert(curves.begin() + static_cast<std::ptrdiff_t>(++i), leg(from, to, static_cast<int>(curves.size())));
    }
  }

  // Largest gap, and how far the curves leave the domain where it isn't closed; both relative to it.
  struct Fit {
    double gap = 0, excursion = 0;
    bool good() const { return gap <= usable && excursion <= usable; }
  };
  Fit fit_of(const std::vector<TrimCurve>& curves) const {
    Fit fit;
    for (std::size_t i = 0; i < curves.size(); ++i) {
      Vector2d jump = first(curves[(i + 1) % curves.size()]) - last(curves[i]);
      for (int k = 0; k < 2; ++k) {
        const auto j = static_cast<std::size_t>(k);
        if (plane_.closed[j]) jump[k] -= plane_.period[j] * std::round(jump[k] / plane_.period[j]);
        jump[k] /= plane_.domain[j].length();
        if (plane_.closed[j]) continue;
        for (const Vector2d& p : {curves[i].curve.start(), curves[i].curve.end()})
          fit.excursion = std::max({fit.excursion, (plane_.domain[j].min - p[k]) / plane_.domain[j].length(),
                                    (p[k] - plane_.domain[j].max) / plane_.domain[j].length()});
      }
      fit.gap = std::max(fit.gap, jump.norm());
    }
    return fit;
  }

  static std::vector<TrimCurve> numbered(std::vector<Curve2> curves) {
    std::vector<TrimCurve> out;
    for (Curve2& c : curves) {
      TrimCurve t;
      t.curve = std::move(c);
      t.index = static_cast<int>(out.size());
      out.push_back(std::move(t));
    }
    return out;
  }

  std::vector<TrimCurve> from_parameters(BoundaryCurves& b, const std::vector<Curve3>& source) const {
    std::vector<Curve2> flat;
    double error = 0;
    const bool plain = map_.identity();
    const double speed = plain ? 1 : plane_.size / std::min(plane_.domain[0].length(), plane_.domain[1].length());
    const double tolerance = std::max(1e-9 * plane_.size, 0.1 * plane_.snap) / speed;
    for (const Curve3& c : source) {
      if (plain) {
        flat.push_back(flattened(c));
        continue;
      }
      CarriedCurve image = carried(flattened(c), map_, {tolerance, tolerance});
      error = std::max(error, image.error);
      flat.push_back(std::move(image.curve));
    }
    if (!plain)
      b.converted = "parameter curves carried along with the surface" +
                    (error > 0 ? ", off by " + format_real(error) + " in its parameters" : std::string(", exactly"));
    std::vector<TrimCurve> out = numbered(std::move(flat));
    std::vector<std::array<Vector2d, 2>> ends;
    const Vector2d lengths(plane_.domain[0].length(), plane_.domain[1].length());
    for (const TrimCurve& c : out)
      ends.push_back({c.curve.start().cwiseQuotient(lengths), c.curve.end().cwiseQuotient(lengths)});
    if (std::vector<TrimCurve> whole = along_seam(out); !whole.empty()) {
      plane_.note(b, "along the seam", "the loop is the seam there and back; it is closed along the surface's ends");
      b.converted = "loop of a seam closed along the surface's ends";
      return whole;
    }
    chain(out);
    bridge_poles(out);
    if (fit_of(out).gap <= usable) return out;
    if (const std::vector<std::size_t> order = order_by_ends(ends, usable); !order.empty()) {
      std::vector<TrimCurve> sorted;
      for (const std::size_t i : order) sorted.push_back(std::move(out[i]));
      for (TrimCurve& c : sorted) c.reversed = false;
      chain(sorted);
      plane_.note(b, "order", out_of_order);
      return sorted;
    }
    return out;
  }

  // A loop that is the seam of a closed surface, there and back on its two sides, bounds all between its ends.
  std::vector<TrimCurve> along_seam(const std::vector<TrimCurve>& curves) const {
    if (curves.size() != 2) return {};
    for (int k = 0; k < 2; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const auto lies_on = [&](const TrimCurve& c, double line) {
        return (c.curve.points().row(k).array() - line).abs().maxCoeff() <= 1e-9 * plane_.period[i];
      };
      const auto &a = curves[0], &b = curves[1];
      if (!plane_.closed[i] || !((lies_on(a, plane_.domain[i].min) && lies_on(b, plane_.domain[i].max)) ||
                                 (lies_on(a, plane_.domain[i].max) && lies_on(b, plane_.domain[i].min))))
        continue;
      std::vector<TrimCurve> out{a, leg(last(a), last(b), 2), b, leg(first(b), first(a), 3)};
      if ((last(a) - first(b)).norm() < (last(a) - last(b)).norm()) {
        out[1] = leg(last(a), first(b), 2);
        out[3] = leg(last(b), first(a), 3);
      } else {
        out[2].reversed = true;
      }
      return out;
    }
    return {};
  }

  // Model curves head to tail: each may run either way. Where both ways meet, as in a circle of two halves, the file's
  // stands: ends that differ by rounding decide nothing.
  void chain(std::vector<Curve3>& curves) const {
    const double meeting = std::max(plane_.options.resolution, 1e-6 * plane_.size);
    const auto gap = [&](const Vector3d& a, const Vector3d& b) { return std::max((a - b).norm(), meeting); };
    for (std::size_t i = 0; i + 1 < curves.size(); ++i) {
      Curve3 &a = curves[i], &b = curves[i + 1];
      if (i == 0) {
        const double end = std::min(gap(a.end(), b.start()), gap(a.end(), b.end()));
        const double start = std::min(gap(a.start(), b.start()), gap(a.start(), b.end()));
        if (start < 0.1 * end) a = reversed(a);
      }
      if (gap(a.end(), b.end()) < 0.1 * gap(a.end(), b.start())) b = reversed(b);
    }
  }

  struct Pulled {
    std::vector<TrimCurve> curves;
    double error = 0, distance = 0;
    Vector3d place{0, 0, 0};
    bool sorted = false;
  };

  bool follow_each_other(const std::vector<std::array<Vector3d, 2>>& ends) const {
    for (std::size_t i = 0; i < ends.size(); ++i) {
      const auto &a = ends[i], &b = ends[(i + 1) % ends.size()];
      if (std::min(std::min((a[0] - b[0]).norm(), (a[0] - b[1]).norm()),
                   std::min((a[1] - b[0]).norm(), (a[1] - b[1]).norm())) > usable * plane_.size)
        return false;
    }
    return true;
  }

  // The joint of two pulled curves: a coordinate that one of them keeps all along is the better one.
  static void meet(TrimCurve& a, TrimCurve& b) {
    Curve2::Points p = a.curve.points(), q = b.curve.points();
    const Eigen::Index n = p.cols() - 1;
    for (int k = 0; k < 2; ++k) {
      const bool level_b = (q.row(k).array() == q(k, 0)).all(), level_a = (p.row(k).array() == p(k, 0)).all();
      (level_b && !level_a ? p(k, n) : q(k, 0)) = level_b && !level_a ? q(k, 0) : p(k, n);
    }
    a.curve = Curve2(a.curve.knots(), std::move(p), a.curve.weights());
    b.curve = Curve2(b.curve.knots(), std::move(q), b.curve.weights());
  }

  Pulled pulled(const BoundaryCurves& boundary, std::optional<Vector2d> start) const {
    Pulled out;
    std::vector<Curve3> pieces;
    std::vector<int> number;
    for (const Curve3& m : boundary.model) {
      // The side of a surface that is one point in space: bridge_poles() adds it, where the others end.
      if (boundary.model.size() > 1 && (m.points().colwise() - m.points().col(0)).norm() <= 1e-7 * plane_.size)
        continue;
      for (Curve3& piece : smooth_pieces(m, plane_.size)) {
        pieces.push_back(std::move(piece));
        number.push_back(static_cast<int>(&m - boundary.model.data()));
      }
    }
    std::vector<Curve3> model = pieces;
    std::vector<std::array<Vector3d, 2>> ends;
    for (const Curve3& m : model) ends.push_back({m.start(), m.end()});
    const std::vector<std::size_t> order =
        follow_each_other(ends) ? std::vector<std::size_t>{} : order_by_ends(ends, usable * plane_.size);
    for (std::size_t i = 0; i < order.size(); ++i) model[i] = pieces[order[i]];
    chain(model);
    const std::optional<AffinePatch> patch =
        plane_.file.plane ? std::nullopt : affine_patch(plane_.surface, 1e-9 * plane_.size);
    std::vector<Curve2> flat;
    for (const Curve3& m : model) {
      if (plane_.file.plane) {
        Curve2::Points points(2, m.points().cols());
        for (Eigen::Index i = 0; i < points.cols(); ++i) {
          const Vector3d x = plane_.file.plane->local(m.points().col(i));
          points.col(i) = x.head<2>();
          if (std::abs(x.z()) > out.distance) out.distance = std::abs(x.z()), out.place = m.points().col(i);
        }
        flat.emplace_back(m.knots(), std::move(points), m.weights());
        continue;
      }
      if (patch) {
        // The inverse map on the control points is exact.
        Curve2::Points points(2, m.points().cols());
        for (Eigen::Index i = 0; i < points.cols(); ++i) points.col(i) = parameters_at(*patch, m.points().col(i));
        flat.emplace_back(m.knots(), std::move(points), m.weights());
        for (const Vector3d& x : {m.start(), m.end()}) {
          const Vector2d uv = parameters_at(*patch, x);
          const double off = (patch->origin + patch->du * uv.x() + patch->dv * uv.y() - x).norm();
          if (off > out.distance) out.distance = off, out.place = x;
        }
        continue;
      }
      PullBackOptions options;
      options.snap = plane_.snap;
      options.max_distance = believable;
      options.start = start;
      PulledCurve c = pull_back(plane_.surface, m, options);
      start = c.curve.end();
      out.error = std::max(out.error, c.error);
      if (c.distance > out.distance) out.distance = c.distance, out.place = c.place;
      flat.push_back(std::move(c.curve));
    }
    out.curves = numbered(std::move(flat));
    for (std::size_t i = 0; i < model.size(); ++i) out.curves[i].model = model[i];
    for (std::size_t i = 0; i < model.size(); ++i) out.curves[i].index = number[order.empty() ? i : order[i]];
    out.sorted = !order.empty();
    chain(out.curves);
    bridge_poles(out.curves);
    const std::size_t n = out.curves.size();
    for (std::size_t i = 0; i < n && !(n == 1 && out.curves[0].curve.points().cols() < 3); ++i) {
      TrimCurve &a = out.curves[i], &b = out.curves[(i + 1) % n];
      const Vector2d jump =
          (first(b) - last(a)).cwiseQuotient(Vector2d(plane_.domain[0].length(), plane_.domain[1].length()));
      const bool clamped = a.curve.knots().clamped() && b.curve.knots().clamped() && !a.reversed && !b.reversed;
      if (clamped && jump.norm() > 0 && jump.norm() <= 1e-7) meet(a, b);
    }
    return out;
  }

  // A start on a seam may mean either side of it: the side from which the loop closes is meant.
  Pulled pulled(const BoundaryCurves& b) const {
    Pulled best = pulled(b, std::nullopt);
    const auto open = [&](const Pulled& p) { return (first(p.curves.front()) - last(p.curves.back())).norm(); };
    if (!(plane_.closed[0] || plane_.closed[1]) || best.curves.empty()) return best;
    for (int k = 0; k < 2; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const double start = first(best.curves.front())[k];
      if (!plane_.closed[i] || open(best) < usable * plane_.domain[i].length() ||
          (start != plane_.domain[i].min && start != plane_.domain[i].max))
        continue;
      Vector2d other = first(best.curves.front());
      other[k] = start == plane_.domain[i].min ? plane_.domain[i].max : plane_.domain[i].min;
      Pulled again = pulled(b, other);
      if (open(again) < open(best)) best = std::move(again);
    }
    return best;
  }

  const FacePlane& plane_;
  const ParameterMap& map_;
};

}  // namespace

std::vector<TrimCurve> loop_curves(const FacePlane& plane, const ParameterMap& map, BoundaryCurves& boundary) {
  return LoopCurves(plane, map).run(boundary);
}

}  // namespace toile::iges
