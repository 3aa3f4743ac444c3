#include "trimming/loops.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/error.h"
#include "geometry/refine.h"
#include "trimming/contacts.h"
#include "trimming/text.h"
#include "trimming/winding.h"

namespace toile {
namespace {

using Eigen::Vector2d;

class Validator {
 public:
  Validator(TrimmedSurface& surface, const LoopOptions& options)
      : surface_(surface), lines_{surface.surface.u().breaks(), surface.surface.v().breaks()} {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double size = lines_[axis].back() - lines_[axis].front();
      tolerance_[static_cast<Eigen::Index>(axis)] = options.repair_tolerance * size;
    }
    snap_ = options.snap.value_or(surface.resolution);
  }

  std::vector<LoopRepair> run() {
    check_outer_loops();
    for (TrimLoop& loop : surface_.loops) {
      prepare(loop);
      chain(loop);
      move_into_domain(loop);
      snap(loop);
      close(loop);
    }
    spans_ = trim_spans(surface_.loops);
    check_simple();
    for (std::size_t l = 0; l < surface_.loops.size(); ++l) orient(static_cast<int>(l));
    check_nesting();
    return std::move(repairs_);
  }

 private:
  [[noreturn]] void fail(const TrimLoop& loop, const TrimCurve* curve, const std::string& what,
                         const Vector2d& uv) const {
    throw GeometryError(place_name(surface_, loop, curve) + ": " + what + " at " + point_text(uv));
  }
  void report(const TrimLoop& loop, const std::string& what, double move, const Vector2d& place) {
    repairs_.push_back({loop.index, what, move, place});
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
      report(loop, "turned curve " + std::to_string(curve.index), 0, start(curve));
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
           "the loop is open: a gap of " + text((a - b).norm()) + " to curve " + std::to_string(c[(k + 1) % n].index),
           a);
    }
  }

  // Largest excursion of a curve beyond a line, and where; exact zero where it stays within.
  std::pair<double, Vector2d> excursion(const TrimCurve& c, Axis axis, bool beyond_max) {
    const std::size_t a = axis == Axis::u ? 0 : 1;
    const double line = beyond_max ? lines_[a].back() : lines_[a].front();
    const int beyond = beyond_max ? 1 : -1;
    std::pair<double, Vector2d> worst{0, {0, 0}};
    for (const TrimSpan& span : trim_spans(c.curve)) {
      const LineForm form(span, axis, line);
      bool hull = false;
      for (int i = 0; i <= form.degree(); ++i) hull = hull || form.coefficient_sign(i) == beyond;
      if (!hull) continue;
      bool leaves = form.sign_after_start() == beyond || form.sign_before_end() == beyond;
      for (const LineRoot& root : roots(form, counts_)) leaves = leaves || root.crosses;
      if (!leaves) continue;
      for (int k = 0; k <= 64; ++k) {
        const Vector2d x = span.at(k / 64.0);
        const double out = beyond * (x[static_cast<Eigen::Index>(a)] - line);
        if (out >= worst.first) worst = {std::max(out, std::numeric_limits<double>::min()), x};
      }
    }
    return worst;
  }

  void move_into_domain(TrimLoop& loop) {
    for (TrimCurve& c : loop.curves) {
      for (const Axis axis : {Axis::u, Axis::v}) {
        const Eigen::Index a = axis == Axis::u ? 0 : 1;
        const double min = lines_[static_cast<std::size_t>(a)].front(),
                     max = lines_[static_cast<std::size_t>(a)].back();
        for (const bool beyond_max : {false, true}) {
          Curve2::Points points = c.curve.points();
          const double hull = beyond_max ? points.row(a).maxCoeff() - max : min - points.row(a).minCoeff();
          if (!(hull > 0)) continue;
          const auto [out, place] = excursion(c, axis, beyond_max);
          if (out == 0) continue;
          if (out > tolerance_[a]) fail(loop, &c, "the trim leaves the domain by " + text(out), place);
          // The hull sticks out further than the curve; pulling it in moves the curve by no more than that.
          if (hull > 8 * tolerance_[a]) fail(loop, &c, "the trim leaves the domain by " + text(out), place);
          points.row(a) = beyond_max ? points.row(a).cwiseMin(max).eval() : points.row(a).cwiseMax(min).eval();
          set_points(c, points);
          report(loop, "moved curve " + std::to_string(c.index) + " into the domain", hull, place);
        }
      }
    }
  }

  // Snapping distance in the parameter plane at uv.
  Vector2d snap_distance(const Vector2d& uv) const {
    const NurbsSurface& s = surface_.surface;
    const SurfaceJet jet = evaluate(s, std::clamp(uv.x(), lines_[0].front(), lines_[0].back()),
                                    std::clamp(uv.y(), lines_[1].front(), lines_[1].back()));
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

  void check_simple() {
    for (const LoopContact& contact : find_contacts(surface_.loops, spans_)) {
      const TrimLoop& a = surface_.loops[static_cast<std::size_t>(contact.loop_a)];
      const TrimLoop& b = surface_.loops[static_cast<std::size_t>(contact.loop_b)];
      const TrimCurve& curve_a = a.curves[static_cast<std::size_t>(contact.curve_a)];
      const TrimCurve& curve_b = b.curves[static_cast<std::size_t>(contact.curve_b)];
      const std::string other =
          contact.loop_a == contact.loop_b
              ? (contact.curve_a == contact.curve_b ? " itself" : " curve " + std::to_string(curve_b.index))
              : " loop " + std::to_string(b.index) + ", curve " + std::to_string(curve_b.index) + ",";
      if (contact.kind == ContactKind::crossing) fail(a, &curve_a, "crosses" + other, contact.uv);
      if (contact.kind == ContactKind::overlap) fail(a, &curve_a, "runs along" + other, contact.uv);
      if (contact.loop_a != contact.loop_b) {
        check_sides(contact.loop_a, contact.loop_b, contact.uv);
        check_sides(contact.loop_b, contact.loop_a, contact.uv);
      }
      report(a, "curve " + std::to_string(curve_a.index) + " touches" + other, 0, contact.uv);
    }
  }

  std::optional<int> winding(int l, const Vector2d& x) {
    const TrimLoop& loop = surface_.loops[static_cast<std::size_t>(l)];
    int total = 0;
    for (std::size_t c = 0; c < loop.curves.size(); ++c) {
      const auto n = winding_number(spans_.of(l, static_cast<int>(c)), x, counts_);
      if (!n) return std::nullopt;
      total += loop.curves[c].reversed ? -*n : *n;
    }
    return total;
  }

  // A simple loop winds once around the points on one side of it: exact winding numbers of two points close to it.
  void orient(int l) {
    TrimLoop& loop = surface_.loops[static_cast<std::size_t>(l)];
    const int wanted = loop.kind == LoopKind::outer ? 1 : -1;
    for (const TrimSpan& span : spans_.of(l)) {
      const Vector2d x = span.at(0.5), chord = span.at(0.51) - span.at(0.49);
      const bool backwards = loop.curves[static_cast<std::size_t>(span.curve)].reversed;
      const double aspect = tolerance_.x() / tolerance_.y();
      const Vector2d left = (backwards ? -1 : 1) * Vector2d(-chord.y() * aspect, chord.x() / aspect);
      for (double reach = 1; reach > 1e-13; reach /= 8) {
        const auto inner = winding(l, x + reach * left), outer = winding(l, x - reach * left);
        if (!inner || !outer || *inner - *outer != 1 || *inner * *outer != 0) continue;
        if (*inner + *outer != wanted) {
          std::reverse(loop.curves.begin(), loop.curves.end());
          for (TrimCurve& c : loop.curves) c.reversed = !c.reversed;
          report(loop, "reversed", 0, start(loop.curves.front()));
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

  // Side of a loop that doesn't cross `other`: by an end point of its spans that isn't on `other`, else by a point
  // between whose rounding (8 eps of its coordinates at most) doesn't matter.
  int winding_of_loop(int l, int other) {
    for (const TrimSpan& span : spans_.of(l)) {
      if (const auto n = winding(other, span.first())) return *n;
    }
    for (const TrimSpan& span : spans_.of(l)) {
      for (const double s : {0.5, 0.25, 0.75}) {
        const Vector2d x = span.at(s), d = 8 * std::numeric_limits<double>::epsilon() * x.cwiseAbs();
        const auto n = winding(other, x + d);
        if (n && n == winding(other, x - d) && n == winding(other, x + Vector2d(d.x(), -d.y())) &&
            n == winding(other, x + Vector2d(-d.x(), d.y())))
          return *n;
      }
    }
    return 0;
  }

  void check_nesting() {
    const int count = static_cast<int>(surface_.loops.size());
    for (int l = 0; l < count; ++l) {
      const TrimLoop& loop = surface_.loops[static_cast<std::size_t>(l)];
      if (loop.kind == LoopKind::outer) continue;
      for (int other = 0; other < count; ++other) {
        if (other == l) continue;
        const TrimLoop& of = surface_.loops[static_cast<std::size_t>(other)];
        const bool within = winding_of_loop(l, other) != 0;
        if (of.kind == LoopKind::outer && !within)
          fail(loop, nullptr, "the hole lies outside the outer loop", start(loop.curves.front()));
        if (of.kind == LoopKind::hole && within)
          fail(loop, nullptr, "the hole lies inside loop " + std::to_string(of.index) + ", another hole",
               start(loop.curves.front()));
      }
    }
  }

  TrimmedSurface& surface_;
  std::array<std::vector<double>, 2> lines_;
  Vector2d tolerance_;
  double snap_ = 0;
  TrimSpans spans_;
  PredicateCounts counts_;
  std::vector<LoopRepair> repairs_;
};

}  // namespace

std::vector<LoopRepair> validate_loops(TrimmedSurface& surface, const LoopOptions& options) {
  return Validator(surface, options).run();
}

}  // namespace toile
