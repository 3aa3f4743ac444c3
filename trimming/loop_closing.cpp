// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/loop_closing.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/error.h"
#include "geometry/refine.h"
#include "trimming/crossings.h"
#include "trimming/text.h"

namespace toile {
namespace {

using Eigen::Vector2d;

constexpr double rounding = 1e-9;  // of the domain's size: moves this small say nothing against a file

class Closer {
 public:
  Closer(TrimmedSurface& surface, const LoopOptions& options)
      : surface_(surface), lines_{surface.surface.u().breaks(), surface.surface.v().breaks()} {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double size = lines_[axis].back() - lines_[axis].front();
      tolerance_[static_cast<Eigen::Index>(axis)] = options.repair_tolerance * size;
    }
    repair_tolerance_ = options.repair_tolerance;
    snap_ = options.snap.value_or(surface.resolution);
  }

  std::vector<LoopRepair> run(bool fit) {
    for (TrimLoop& loop : surface_.loops) {
      prepare(loop);
      chain(loop);
      if (fit) {
        move_into_domain(loop);
        snap(loop);
      }
      close(loop);
      if (!fit) continue;
      // A control point that moved may have taken its curve out again, where that touches the border.
      move_into_domain(loop);
      close(loop);
    }
    return std::move(repairs_);
  }

 private:
  [[noreturn]] void fail(const TrimLoop& loop, const TrimCurve* curve, const std::string& what,
                         const Vector2d& uv) const {
    throw GeometryError(place_name(surface_, loop, curve) + ": " + what + " at " + point_text(uv));
  }
  void report(const TrimLoop& loop, const std::string& what, double move, const Vector2d& place) {
    const double size = std::max(lines_[0].back() - lines_[0].front(), lines_[1].back() - lines_[1].front());
    repairs_.push_back({loop.index, what, move, place, move > 0 && move <= rounding * size});
  }

  static Vector2d start(const TrimCurve& c) {
    return c.curve.points().col(c.reversed ? c.curve.points().cols() - 1 : 0);
  }
  static Vector2d end(const TrimCurve& c) { return c.curve.points().col(c.reversed ? 0 : c.curve.points().cols() - 1); }
  static void set_points(TrimCurve& c, const Curve2::Points& points) {
    c.curve = Curve2(c.curve.knots(), points, c.curve.weights());
  }
  static void set_end(TrimCurve& c, bool at_end, const Vector2d& x) {
    Curve2::Points points = c.curve.points();
    points.col(at_end != c.reversed ? points.cols() - 1 : 0) = x;
    set_points(c, points);
  }
  bool within_tolerance(const Vector2d& a, const Vector2d& b) const {
    return ((a - b).cwiseAbs().array() <= tolerance_.array()).all();
  }

  // Ends that are control points; no curve that is a point.
  void prepare(TrimLoop& loop) {
    for (TrimCurve& c : loop.curves) {
      if (c.curve.degree() < 1) fail(loop, &c, "a trim curve of degree 0", start(c));
      if (!c.curve.knots().clamped()) c.curve = clamp(c.curve);
    }
    const auto is_point = [](const TrimCurve& c) {
      return (c.curve.points().colwise() - c.curve.points().col(0)).cwiseAbs().maxCoeff() == 0;
    };
    for (const TrimCurve& c : loop.curves) {
      if (is_point(c)) report(loop, "dropped curve " + std::to_string(c.index) + ", a point", 0, start(c));
    }
    std::erase_if(loop.curves, is_point);
    if (loop.curves.empty()) throw GeometryError(place_name(surface_, loop) + ": has no curves");
  }

  // Each curve's direction in the loop, where the file's chains only the other way round.
  void chain(TrimLoop& loop) {
    std::vector<TrimCurve>& c = loop.curves;
    const auto turn = [&](TrimCurve& curve) {
      curve.reversed = !curve.reversed;
      // Directions are free: both readings of a file are right.
      repairs_.push_back({loop.index, "turned curve " + std::to_string(curve.index), 0, start(curve), true});
    };
    const std::size_t n = c.size();
    if (n > 1) {
      const auto meets = [&](const Vector2d& x) {
        return within_tolerance(x, start(c[1])) || within_tolerance(x, end(c[1]));
      };
      if (!meets(end(c[0])) && meets(start(c[0]))) turn(c[0]);
    }
    for (std::size_t k = 1; k < n; ++k) {
      const Vector2d x = end(c[k - 1]);
      if (!within_tolerance(x, start(c[k])) && within_tolerance(x, end(c[k]))) turn(c[k]);
    }
    for (std::size_t k = 0; k < n; ++k) {
      const Vector2d a = end(c[k]), b = start(c[(k + 1) % n]);
      loop.gap = std::max(loop.gap, (a - b).norm());
      if (within_tolerance(a, b)) continue;
      fail(loop, &c[k],
           "the loop is open: a gap of " + text((a - b).norm()) + " to curve " + std::to_string(c[(k + 1) % n].index) +
               ", " + text(gap_in_space(a, b)) + " in space; gaps up to " + text(tolerance_.minCoeff()) +
               " are closed (the file's resolution is " + text(surface_.resolution) + ")",
           a);
    }
  }

  double gap_in_space(const Vector2d& a, const Vector2d& b) const { return (jet_at(a).x - jet_at(b).x).norm(); }

  // What a double of the domain's size can't tell.
  double rounding_at(Axis axis) const {
    const std::vector<double>& lines = lines_[axis == Axis::u ? 0 : 1];
    return std::numeric_limits<double>::epsilon() * std::max(std::abs(lines.front()), std::abs(lines.back()));
  }

  // Largest excursion of a curve beyond a line, and where; exact zero where it stays within.
  std::pair<double, Vector2d> excursion(const TrimCurve& c, Axis axis, bool beyond_max) {
    const std::size_t a = axis == Axis::u ? 0 : 1;
    const double line = beyond_max ? lines_[a].back() : lines_[a].front();
    const int beyond = beyond_max ? 1 : -1;
    const double unit = rounding_at(axis);
    std::pair<double, Vector2d> worst{0, {0, 0}};
    for (const TrimSpan& span : trim_spans(c.curve)) {
      const LineForm form(span, axis, line);
      bool hull = false;
      for (int i = 0; i <= form.degree(); ++i) hull = hull || form.coefficient_sign(i) == beyond;
      if (!hull) continue;
      bool leaves = form.sign_after_start() == beyond || form.sign_before_end() == beyond;
      Vector2d at = span.at(0.5);
      for (const LineRoot& root : roots(form, counts_)) {
        leaves = leaves || root.crosses;
        at = span.at(root.s());
      }
      if (!leaves) continue;
      // What no double of this size can show, and no sample below, is still an excursion.
      if (worst.first == 0) worst = {unit, at};
      for (int k = 0; k <= 64; ++k) {
        const Vector2d x = span.at(k / 64.0);
        const double out = beyond * (x[static_cast<Eigen::Index>(a)] - line);
        if (out > worst.first) worst = {out, x};
      }
    }
    return worst;
  }

  // How far a curve may be moved at a place: the repair tolerance, and whatever is below the file's resolution in
  // space, up to a tenth of the domain.
  double reach(const Vector2d& uv, Eigen::Index axis) const {
    const SurfaceJet jet = jet_at(uv);
    const double speed = (axis == 0 ? jet.u : jet.v).norm(), most = 0.1 * tolerance_[axis] / repair_tolerance_;
    return std::max(tolerance_[axis], snap_ < speed * most ? snap_ / speed : snap_ > 0 ? most : 0);
  }

  void move_into_domain(TrimLoop& loop) {
    for (TrimCurve& c : loop.curves) {
      for (const Axis axis : {Axis::u, Axis::v}) {
        const Eigen::Index a = axis == Axis::u ? 0 : 1;
        const double min = lines_[static_cast<std::size_t>(a)].front(),
                     max = lines_[static_cast<std::size_t>(a)].back();
        for (const bool beyond_max : {false, true}) {
          const double hull =
              beyond_max ? c.curve.points().row(a).maxCoeff() - max : min - c.curve.points().row(a).minCoeff();
          // Points of spans are rounded, by less than this.
          if (!(hull > -4 * rounding_at(axis))) continue;
          const auto [out, place] = excursion(c, axis, beyond_max);
          if (out == 0) continue;
          if (out > reach(place, a)) {
            if (loop.kind == LoopKind::hole) continue;  // cut off where it crosses the outer loop, or refused there
            fail(loop, &c, "the trim leaves the domain by " + text(out) + ", limit " + text(reach(place, a)), place);
          }
          const double moved = pull_in(c, axis, beyond_max, out, place);
          if (moved == 0) fail(loop, &c, "the trim leaves the domain by " + text(out), place);
          report(loop, "moved curve " + std::to_string(c.index) + " into the domain", moved, place);
        }
      }
    }
  }

  // Moves a curve that leaves the domain by `out` into it, and says how far its control points moved; 0 where that
  // fails. Ends that stick out move onto the border, and so do all points where they stick out no further than the
  // curve does: what runs along the border stays straight. Else the points of the spans that leave move back by a
  // little more than the curve has to. `place` is where it leaves the most.
  double pull_in(TrimCurve& c, Axis axis, bool beyond_max, double out, const Vector2d& place) {
    const Eigen::Index a = axis == Axis::u ? 0 : 1, last = c.curve.points().cols() - 1;
    const std::vector<double>& lines = lines_[static_cast<std::size_t>(a)];
    const double line = beyond_max ? lines.back() : lines.front(), inwards = beyond_max ? -1 : 1;
    const Curve2 given = c.curve;
    const auto beyond = [&](double x) { return inwards * (line - x); };
    Curve2::Points points = given.points();
    double hull = 0;
    for (Eigen::Index i = 0; i <= last; ++i) hull = std::max(hull, beyond(points(a, i)));
    const bool all = hull <= std::max(4 * out, rounding * (lines.back() - lines.front()));
    for (Eigen::Index i = 0; i <= last; ++i)
      if (beyond(points(a, i)) > 0 && (all || i == 0 || i == last)) points(a, i) = line;
    set_points(c, points);
    double by = 2 * out;
    for (int attempt = 0; attempt < 8 && excursion(c, axis, beyond_max).first > 0; ++attempt, by *= 2) {
      for (Eigen::Index i = 1; i < last; ++i)
        if (beyond(points(a, i)) > -by) c.curve = moved(c.curve, i, a, inwards * by);
    }
    // Where that isn't enough, the whole net moves in, if it sticks out no further than the curve may.
    if (excursion(c, axis, beyond_max).first > 0) {
      points = given.points();
      if (hull > reach(place, a)) {
        c.curve = given;
        return 0;
      }
      for (Eigen::Index i = 0; i <= last; ++i)
        if (beyond(points(a, i)) > 0) points(a, i) = line;
      set_points(c, points);
    }
    return (c.curve.points().row(a) - given.points().row(a)).cwiseAbs().maxCoeff();
  }
  static Curve2 moved(const Curve2& curve, Eigen::Index i, Eigen::Index axis, double by) {
    Curve2::Points points = curve.points();
    points(axis, i) += by;
    return Curve2(curve.knots(), std::move(points), curve.weights());
  }

  SurfaceJet jet_at(const Vector2d& uv) const {
    return evaluate(surface_.surface, std::clamp(uv.x(), lines_[0].front(), lines_[0].back()),
                    std::clamp(uv.y(), lines_[1].front(), lines_[1].back()));
  }

  // Snapping distance in the parameter plane at uv.
  Vector2d snap_distance(const Vector2d& uv) const {
    const SurfaceJet jet = jet_at(uv);
    const double longest = 1e-3;  // of a repair tolerance: also where the surface is collapsed
    const auto distance = [&](double speed, double tolerance) {
      return speed * tolerance * longest > snap_ ? snap_ / speed : tolerance * longest;
    };
    return {distance(jet.u.norm(), tolerance_.x()), distance(jet.v.norm(), tolerance_.y())};
  }

  void snap(TrimLoop& loop) {
    if (!(snap_ > 0)) return;
    for (TrimCurve& c : loop.curves) {
      Curve2::Points points = c.curve.points();
      for (Eigen::Index k = 0; k < points.cols(); ++k) {
        for (Eigen::Index axis = 0; axis < 2; ++axis) {
          const std::vector<double>& lines = lines_[static_cast<std::size_t>(axis)];
          const double x = points(axis, k);
          const auto above = std::lower_bound(lines.begin(), lines.end(), x);
          double nearest = above == lines.end() ? lines.back() : *above;
          if (above != lines.begin() && std::abs(x - *std::prev(above)) < std::abs(x - nearest))
            nearest = *std::prev(above);
          // Cheap bound first: no snap is longer than 1e-3 of the repair tolerance.
          if (x == nearest || std::abs(x - nearest) > 1e-3 * tolerance_[axis]) continue;
          if (std::abs(x - nearest) > snap_distance(points.col(k))[axis]) continue;
          points(axis, k) = nearest;
          report(loop,
                 "snapped curve " + std::to_string(c.index) + " to " + (axis == 0 ? "u = " : "v = ") + text(nearest),
                 std::abs(x - nearest), points.col(k));
        }
      }
      set_points(c, points);
    }
  }

  bool is_line(Eigen::Index axis, double x) const {
    const std::vector<double>& lines = lines_[static_cast<std::size_t>(axis)];
    return std::binary_search(lines.begin(), lines.end(), x);
  }

  // The last leg keeps the coordinate: the curve runs along a line of constant u or v there.
  static bool level(const TrimCurve& c, bool at_end, Eigen::Index axis) {
    const bool last = at_end != c.reversed;
    const Eigen::Index n = c.curve.points().cols();
    return c.curve.points()(axis, last ? n - 1 : 0) == c.curve.points()(axis, last ? n - 2 : 1);
  }

  // Neighbours meet in one point: on a knot line if either end is, else where a level leg lies, else half way.
  void close(TrimLoop& loop) {
    const std::size_t n = loop.curves.size();
    for (std::size_t k = 0; k < n; ++k) {
      TrimCurve& a = loop.curves[k];
      TrimCurve& b = loop.curves[(k + 1) % n];
      const Vector2d p = end(a), q = start(b);
      if (p == q) continue;
      Vector2d x;
      for (Eigen::Index axis = 0; axis < 2; ++axis) {
        const bool p_first = is_line(axis, p[axis]) || (level(a, true, axis) && !is_line(axis, q[axis]));
        const bool q_first = is_line(axis, q[axis]) || level(b, false, axis);
        x[axis] = p_first ? p[axis] : q_first ? q[axis] : p[axis] + (q[axis] - p[axis]) / 2;
      }
      set_end(a, true, x);
      set_end(b, false, x);
      report(loop, "closed a gap of " + text((p - q).norm()) + " after curve " + std::to_string(a.index),
             std::max((p - x).norm(), (q - x).norm()), x);
    }
  }

  TrimmedSurface& surface_;
  std::array<std::vector<double>, 2> lines_;
  Vector2d tolerance_;
  double repair_tolerance_ = 0, snap_ = 0;
  PredicateCounts counts_;
  std::vector<LoopRepair> repairs_;
};

}  // namespace

std::vector<LoopRepair> close_loops(TrimmedSurface& surface, const LoopOptions& options, bool fit) {
  return Closer(surface, options).run(fit);
}

}  // namespace toile
