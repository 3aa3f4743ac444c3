#include "io/iges/face.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "geometry/error.h"
#include "geometry/measure.h"
#include "geometry/refine.h"
#include "io/iges/entity.h"
#include "trimming/pull_back.h"

namespace toile::iges {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double believable = 1e-2;  // of the surface's size: model curves further off it bound something else
constexpr const char* out_of_order =
    "its curves don't follow each other in the file's order; they are sorted by their ends";
constexpr double usable = 1e-3;  // of the domain; gaps and excursions beyond it are refused by validation

Vector2d first(const TrimCurve& c) {
  return c.reversed ? c.curve.end() : c.curve.start();
}
Vector2d last(const TrimCurve& c) {
  return c.reversed ? c.curve.start() : c.curve.end();
}

Curve2 flattened(const Curve3& c) {
  return Curve2(c.knots(), c.points().topRows<2>(), c.weights());
}

void shift(TrimCurve& c, int k, double by) {
  if (by == 0) return;
  Curve2::Points points = c.curve.points();
  points.row(k).array() += by;
  c.curve = Curve2(c.curve.knots(), std::move(points), c.curve.weights());
}

// Places along a loop, in its direction.
std::vector<Vector2d> polygon(const std::vector<TrimCurve>& curves) {
  std::vector<Vector2d> out;
  for (const TrimCurve& c : curves) {
    const std::size_t begin = out.size();
    for (const int i : c.curve.knots().spans()) {
      const double a = c.curve.knots()[i], b = c.curve.knots()[i + 1];
      const int pieces = c.curve.degree() == 1 ? 1 : 12;
      for (int k = 0; k < pieces; ++k) out.push_back(c.curve(a + (b - a) * k / pieces));
    }
    out.push_back(c.curve.end());
    if (c.reversed) std::reverse(out.begin() + static_cast<std::ptrdiff_t>(begin), out.end());
  }
  return out;
}

double signed_area(const std::vector<Vector2d>& p) {
  double sum = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Vector2d &a = p[i] - p[0], &b = p[(i + 1) % p.size()] - p[0];
    sum += a.x() * b.y() - a.y() * b.x();
  }
  return sum / 2;
}

bool contains(const std::vector<Vector2d>& p, const Vector2d& x) {
  bool in = false;
  for (std::size_t i = 0, j = p.size() - 1; i < p.size(); j = i++)
    if ((p[i].y() > x.y()) != (p[j].y() > x.y()) &&
        x.x() < (p[j].x() - p[i].x()) * (x.y() - p[i].y()) / (p[j].y() - p[i].y()) + p[i].x())
      in = !in;
  return in;
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

class FaceMaker {
 public:
  FaceMaker(const FileSurface& surface, std::vector<BoundaryCurves>& boundaries, const FaceOptions& options)
      : file_(surface), s_(surface.surface), boundaries_(boundaries), options_(options) {
    domain_ = {s_.u().domain(), s_.v().domain()};
    size_ = (s_.points().rowwise().maxCoeff() - s_.points().rowwise().minCoeff()).norm();
    snap_ = std::min(options.resolution, 1e-6 * size_);
    closed_ = closed_directions(s_, std::max(snap_, 1e-9 * size_));
    for (std::size_t k = 0; k < 2; ++k) period_[k] = closed_[k] ? domain_[k].length() : 0;
  }

  std::vector<TrimmedSurface> run() {
    map_ = &best_map();
    for (std::size_t i = 0; i < boundaries_.size(); ++i) {
      TrimLoop loop;
      loop.index = static_cast<int>(i);
      loop.kind = i == 0 ? LoopKind::outer : LoopKind::hole;
      loop.curves = curves_of(boundaries_[i]);
      loops_.push_back(std::move(loop));
    }
    join_across_seams();
    std::vector<TrimmedSurface> out;
    for (std::vector<TrimLoop>& group : classified()) {
      TrimmedSurface face;
      face.surface = s_;
      face.loops = std::move(group);
      fit_into_domain(face);
      for (TrimLoop& loop : face.loops)
        for (std::size_t i = 0; i < loop.curves.size(); ++i) {
          const Vector2d jump = first(loop.curves[(i + 1) % loop.curves.size()]) - last(loop.curves[i]);
          loop.gap = std::max(loop.gap, jump.norm());
        }
      out.push_back(std::move(face));
    }
    return out;
  }

 private:
  [[noreturn]] void fail(const BoundaryCurves& b, const std::string& what) const {
    throw GeometryError(b.place + what);
  }
  void note(const BoundaryCurves& b, const std::string& kind, const std::string& what) const {
    options_.note(kind, b.place + what);
  }

  // A point of the surface under a parameter that may lie a period away. Beyond an open border the polynomial goes on.
  Vector3d at(Vector2d uv) const {
    for (int k = 0; k < 2; ++k) {
      const auto i = static_cast<std::size_t>(k);
      if (!closed_[i] || domain_[i].contains(uv[k])) continue;
      uv[k] -= period_[i] * std::floor((uv[k] - domain_[i].min) / period_[i]);
      uv[k] = std::clamp(uv[k], domain_[i].min, domain_[i].max);
    }
    return s_(uv.x(), uv.y());
  }

  // How far a boundary's parameter curves, mapped, lie from its model curves: ends and middles of curves that are
  // paired, else starts and middles against the nearest model curve.
  double disagreement(const BoundaryCurves& b, const ParameterMap& map) const {
    double largest = 0;
    const auto image = [&](const Curve3& c, double f) {
      return at(map(c(c.domain().min + f * c.domain().length()).head<2>()));
    };
    for (std::size_t i = 0; i < b.parameter.size(); ++i) {
      const Curve3& c = b.parameter[i];
      const Vector3d start = image(c, 0), middle = image(c, 0.5), end = image(c, 1);
      if (b.parameter.size() == b.model.size()) {
        const Curve3& m = b.model[i];
        largest = std::max(largest, std::min(std::max((start - m.start()).norm(), (end - m.end()).norm()),
                                             std::max((start - m.end()).norm(), (end - m.start()).norm())));
        if ((middle - m(0.5 * (m.domain().min + m.domain().max))).norm() > agreed())
          largest = std::max(largest, closest_point(m, middle).distance);
        continue;
      }
      for (const Vector3d& x : {start, middle}) {
        double nearest = std::numeric_limits<double>::infinity();
        for (const Curve3& m : b.model) nearest = std::min(nearest, closest_point(m, x).distance);
        largest = std::max(largest, nearest);
      }
    }
    return largest;
  }
  double agreed() const { return std::max(10 * options_.resolution, 1e-4 * size_); }

  double extent(const Curve3& c, int k) const { return std::max(std::abs(c.start()[k]), std::abs(c.end()[k])); }

  // The standard's reading of the file's parameters, unless another lies nearer to the model curves.
  const ParameterMap& best_map() const {
    if (file_.maps.size() == 1) return file_.maps[0];
    const ParameterMap* best = &file_.maps[0];
    double least = std::numeric_limits<double>::infinity();
    bool seen = false;
    for (const ParameterMap& map : file_.maps) {
      double off = 0;
      for (const BoundaryCurves& b : boundaries_) {
        if (b.parameter.empty() || b.model.empty()) continue;
        seen = true;
        off = std::max(off, disagreement(b, map));
      }
      if (off < least * (1 - 1e-6) - 1e-12 * size_) {
        least = off;
        best = &map;
      }
    }
    if (seen) return *best;
    // Nothing to compare with: angles that stay within a turn of radians are radians.
    double widest = 0;
    for (const BoundaryCurves& b : boundaries_)
      for (const Curve3& c : b.parameter) widest = std::max(widest, extent(c, 0));
    return widest > 6.3 ? file_.maps[0] : file_.maps[1];
  }

  // Each curve's direction, and its period where the surface is closed, so that it begins where the one before it ends.
  // Ends that meet as they stand go before ends that meet a period apart.
  void chain(std::vector<TrimCurve>& curves) const {
    const auto gap = [&](const Vector2d& a, const Vector2d& b, bool across) {
      Vector2d d = b - a;
      for (int k = 0; k < 2; ++k) {
        const auto i = static_cast<std::size_t>(k);
        if (across && closed_[i]) d[k] -= period_[i] * std::round(d[k] / period_[i]);
        d[k] /= domain_[i].length();
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
    for (std::size_t i = 1; i < n; ++i) {
      const Vector2d x = last(curves[i - 1]);
      turn_to_meet(curves[i], [&](const TrimCurve& c, bool across) { return gap(x, first(c), across); });
      const Vector2d d = x - first(curves[i]);
      for (int k = 0; k < 2; ++k)
        if (const double period = period_[static_cast<std::size_t>(k)]; period > 0)
          shift(curves[i], k, period * std::round(d[k] / period));
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
        if (closed_[j]) jump[k] -= period_[j] * std::round(jump[k] / period_[j]);
        jump[k] /= domain_[j].length();
        if (closed_[j]) continue;
        for (const Vector2d& p : {curves[i].curve.start(), curves[i].curve.end()})
          fit.excursion = std::max({fit.excursion, (domain_[j].min - p[k]) / domain_[j].length(),
                                    (p[k] - domain_[j].max) / domain_[j].length()});
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
    const bool plain = map_->u.affine() && map_->v.affine() && map_->u.scale == 1 && map_->u.shift == 0 &&
                       map_->v.scale == 1 && map_->v.shift == 0;
    const double speed = plain ? 1 : size_ / std::min(domain_[0].length(), domain_[1].length());
    const double tolerance = std::max(1e-9 * size_, 0.1 * snap_) / speed;
    for (const Curve3& c : source) {
      if (plain) {
        flat.push_back(flattened(c));
        continue;
      }
      CarriedCurve image = carried(flattened(c), *map_, {tolerance, tolerance});
      error = std::max(error, image.error);
      flat.push_back(std::move(image.curve));
    }
    if (!plain)
      b.converted = "parameter curves carried along with the surface" +
                    (error > 0 ? ", off by " + format_real(error) + " in its parameters" : std::string(", exactly"));
    std::vector<TrimCurve> out = numbered(std::move(flat));
    std::vector<std::array<Vector2d, 2>> ends;
    const Vector2d lengths(domain_[0].length(), domain_[1].length());
    for (const TrimCurve& c : out)
      ends.push_back({c.curve.start().cwiseQuotient(lengths), c.curve.end().cwiseQuotient(lengths)});
    if (std::vector<TrimCurve> whole = along_seam(out); !whole.empty()) {
      note(b, "along the seam", "the loop is the seam there and back; it is closed along the surface's ends");
      b.converted = "loop of a seam closed along the surface's ends";
      return whole;
    }
    chain(out);
    if (fit_of(out).gap <= usable) return out;
    if (const std::vector<std::size_t> order = order_by_ends(ends, usable); !order.empty()) {
      std::vector<TrimCurve> sorted;
      for (const std::size_t i : order) sorted.push_back(std::move(out[i]));
      for (TrimCurve& c : sorted) c.reversed = false;
      chain(sorted);
      note(b, "order", out_of_order);
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
        return (c.curve.points().row(k).array() - line).abs().maxCoeff() <= 1e-9 * period_[i];
      };
      const auto &a = curves[0], &b = curves[1];
      if (!closed_[i] || !((lies_on(a, domain_[i].min) && lies_on(b, domain_[i].max)) ||
                           (lies_on(a, domain_[i].max) && lies_on(b, domain_[i].min))))
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

  // Model curves head to tail: each may run either way.
  static void chain(std::vector<Curve3>& curves) {
    const auto gap = [](const Vector3d& a, const Vector3d& b) { return (a - b).norm(); };
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
                   std::min((a[1] - b[0]).norm(), (a[1] - b[1]).norm())) > usable * size_)
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
    std::vector<Curve3> model = boundary.model;
    std::vector<std::array<Vector3d, 2>> ends;
    for (const Curve3& m : model) ends.push_back({m.start(), m.end()});
    const std::vector<std::size_t> order =
        follow_each_other(ends) ? std::vector<std::size_t>{} : order_by_ends(ends, usable * size_);
    for (std::size_t i = 0; i < order.size(); ++i) model[i] = boundary.model[order[i]];
    chain(model);
    const std::optional<AffinePatch> patch = file_.plane ? std::nullopt : affine_patch(s_, 1e-9 * size_);
    std::vector<Curve2> flat;
    for (const Curve3& m : model) {
      if (file_.plane) {
        Curve2::Points points(2, m.points().cols());
        for (Eigen::Index i = 0; i < points.cols(); ++i) {
          const Vector3d x = file_.plane->local(m.points().col(i));
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
      options.snap = snap_;
      options.max_distance = believable;
      options.start = start;
      PulledCurve c = pull_back(s_, m, options);
      start = c.curve.end();
      out.error = std::max(out.error, c.error);
      if (c.distance > out.distance) out.distance = c.distance, out.place = c.place;
      flat.push_back(std::move(c.curve));
    }
    out.curves = numbered(std::move(flat));
    for (std::size_t i = 0; i < model.size(); ++i) out.curves[i].model = model[i];
    for (std::size_t i = 0; i < order.size(); ++i) out.curves[i].index = static_cast<int>(order[i]);
    out.sorted = !order.empty();
    chain(out.curves);
    const std::size_t n = out.curves.size();
    for (std::size_t i = 0; i < n && !(n == 1 && out.curves[0].curve.points().cols() < 3); ++i) {
      TrimCurve &a = out.curves[i], &b = out.curves[(i + 1) % n];
      const Vector2d jump = (first(b) - last(a)).cwiseQuotient(Vector2d(domain_[0].length(), domain_[1].length()));
      const bool clamped = a.curve.knots().clamped() && b.curve.knots().clamped() && !a.reversed && !b.reversed;
      if (clamped && jump.norm() > 0 && jump.norm() <= 1e-7) meet(a, b);
    }
    return out;
  }

  // A start on a seam may mean either side of it: the side from which the loop closes is meant.
  Pulled pulled(const BoundaryCurves& b) const {
    Pulled best = pulled(b, std::nullopt);
    const auto open = [&](const Pulled& p) { return (first(p.curves.front()) - last(p.curves.back())).norm(); };
    if (!(closed_[0] || closed_[1]) || best.curves.empty()) return best;
    for (int k = 0; k < 2; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const double start = first(best.curves.front())[k];
      if (!closed_[i] || open(best) < usable * domain_[i].length() ||
          (start != domain_[i].min && start != domain_[i].max))
        continue;
      Vector2d other = first(best.curves.front());
      other[k] = start == domain_[i].min ? domain_[i].max : domain_[i].min;
      Pulled again = pulled(b, other);
      if (open(again) < open(best)) best = std::move(again);
    }
    return best;
  }

  std::vector<TrimCurve> curves_of(BoundaryCurves& b) const {
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
        off = disagreement(b, *map_);
        if (trouble.empty() && off > agreed())
          trouble = "its parameter curves lie " + format_real(off) + " from its model curves";
        if (b.model.size() != b.parameter.size())
          note(b, "segment counts",
               std::to_string(b.parameter.size()) + " parameter curves and " + std::to_string(b.model.size()) +
                   " model curves" + (trouble.empty() ? "; the parameter curves are taken" : ""));
      }
    }
    if (own.size() == b.model.size())
      for (TrimCurve& c : own) c.model = b.model[static_cast<std::size_t>(c.index)];
    if (trouble.empty()) return own;
    if (b.model.empty()) {
      if (own.empty()) fail(b, "it has neither parameter curves nor model curves");
      note(b, "bad loop", trouble);
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
      if (p.distance <= believable * size_ && (better || own.empty())) {
        note(b, "pulled back",
             trouble + "; its model curves are pulled back onto the surface, " +
                 (p.error > 0 ? "off by " + format_real(p.error) : std::string("exactly")) +
                 (p.distance > std::max(options_.resolution, 1e-9 * size_)
                      ? "; they lie " + format_real(p.distance) + " off it"
                      : std::string()));
        b.converted = "parameter curves pulled back from the model curves, " +
                      (p.error > 0 ? "off by " + format_real(p.error) : std::string("exactly")) +
                      ", the model curves lying " + format_real(p.distance) + " off the surface";
        if (p.sorted) note(b, "order", out_of_order);
        return std::move(p.curves);
      }
      why = "its model curves lie " + format_real(p.distance) + " off the surface at (" + format_real(p.place.x()) +
            ", " + format_real(p.place.y()) + ", " + format_real(p.place.z()) + ")";
    } catch (const GeometryError& error) {
      why = error.what();
    }
    if (own.empty()) fail(b, trouble + ", and " + why);
    note(b, "bad loop", trouble + ", and " + why);
    return own;
  }

  // Whole periods that a loop runs through before it closes.
  std::array<int, 2> windings(const TrimLoop& loop) const {
    std::array<int, 2> out{};
    const Vector2d way = last(loop.curves.back()) - first(loop.curves.front());
    for (std::size_t k = 0; k < 2; ++k)
      if (closed_[k]) out[k] = static_cast<int>(std::lround(way[static_cast<Eigen::Index>(k)] / period_[k]));
    return out;
  }

  TrimCurve leg(const Vector2d& a, const Vector2d& b, int index) const {
    TrimCurve c;
    c.curve = line_segment<2>(a, b);
    c.index = index;
    return c;
  }

  // The border of the domain in the other direction that is one point in space; which, where there are two, by what
  // lies to the left of a loop that runs `forward`.
  std::optional<double> pole(std::size_t k, bool forward) const {
    const std::size_t other = 1 - k;
    std::array<bool, 2> collapsed{};
    for (std::size_t side = 0; side < 2; ++side) {
      const double line = side == 0 ? domain_[other].min : domain_[other].max;
      collapsed[side] = true;
      Vector3d before = Vector3d::Zero();
      for (int i = 0; i <= 4; ++i) {
        const double along = domain_[k].min + domain_[k].length() * i / 5;
        const Vector3d x = k == 0 ? s_(along, line) : s_(line, along);
        if (i > 0 && (x - before).norm() > 1e-9 * size_) collapsed[side] = false;
        before = x;
      }
    }
    // With u around, the left of a loop towards larger u is larger v; with v around it is smaller u.
    const bool want_max = (k == 0) == forward;
    if (collapsed[0] && collapsed[1]) return want_max ? domain_[other].max : domain_[other].min;
    if (collapsed[0]) return domain_[other].min;
    if (collapsed[1]) return domain_[other].max;
    return std::nullopt;
  }

  // Loops that wind around a closed surface bound a band, or the region about a pole: cut open along a seam.
  void join_across_seams() {
    for (std::size_t k = 0; k < 2; ++k) {
      std::vector<std::size_t> winding;
      for (std::size_t i = 0; i < loops_.size(); ++i)
        if (windings(loops_[i])[k] != 0) winding.push_back(i);
      if (winding.empty()) continue;
      const auto axis = static_cast<Eigen::Index>(k);
      TrimLoop& a = loops_[winding[0]];
      BoundaryCurves& place = boundaries_[static_cast<std::size_t>(a.index)];
      const int turns = windings(a)[k];
      const Vector2d from = first(a.curves.front()), to = last(a.curves.back());
      const int n = static_cast<int>(a.curves.size());
      if (winding.size() == 1 && std::abs(turns) == 1) {
        const std::optional<double> line = pole(k, turns > 0);
        if (!line) fail(place, "the loop runs around the closed surface and bounds nothing");
        Vector2d far = to, near = from;
        far[1 - axis] = near[1 - axis] = *line;
        a.curves.push_back(leg(to, far, n));
        a.curves.push_back(leg(far, near, n + 1));
        a.curves.push_back(leg(near, from, n + 2));
        note(place, "seam", "the loop runs around the closed surface; it is joined with the pole");
      } else if (winding.size() == 2 && std::abs(turns) == 1) {
        TrimLoop& b = loops_[winding[1]];
        if (windings(b)[k] == turns) {
          std::reverse(b.curves.begin(), b.curves.end());
          for (TrimCurve& c : b.curves) c.reversed = !c.reversed;
        }
        const double period = period_[k];
        const double by = period * std::round((to[axis] - first(b.curves.front())[axis]) / period);
        for (TrimCurve& c : b.curves) shift(c, static_cast<int>(k), by);
        const Vector2d head = first(b.curves.front()), tail = last(b.curves.back());
        a.curves.push_back(leg(to, head, n));
        for (TrimCurve& c : b.curves) {
          c.index += n + 1;
          a.curves.push_back(c);
        }
        a.curves.push_back(leg(tail, from, static_cast<int>(a.curves.size())));
        note(place, "seam", "two loops run around the closed surface; they are joined across its seam");
        loops_.erase(loops_.begin() + static_cast<std::ptrdiff_t>(winding[1]));
      } else {
        fail(place, "loops run around the closed surface " + std::to_string(std::abs(turns)) + " times, " +
                        std::to_string(winding.size()) + " of them: what they bound is not clear");
      }
      place.converted = "loop joined across the seam of the closed surface";
    }
  }

  // Outer loops with their holes. A loop within an odd number of others is a hole.
  std::vector<std::vector<TrimLoop>> classified() {
    const std::size_t n = loops_.size();
    if (n == 1) {
      loops_[0].kind = LoopKind::outer;
      return {std::move(loops_)};
    }
    std::vector<std::vector<Vector2d>> polygons;
    std::vector<double> areas;
    for (const TrimLoop& loop : loops_) {
      polygons.push_back(polygon(loop.curves));
      areas.push_back(std::abs(signed_area(polygons.back())));
    }
    // By a place on the inner loop; touching loops agree on most of theirs.
    const auto within = [&](std::size_t inner, std::size_t outer) {
      if (areas[inner] >= areas[outer]) return false;
      std::size_t in = 0;
      for (const Vector2d& x : polygons[inner])
        in += contains(polygons[outer], shifted_into(x, polygons[outer])) ? 1 : 0;
      return 2 * in > polygons[inner].size();
    };
    std::vector<std::vector<std::size_t>> around(n);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j)
        if (i != j && within(i, j)) around[i].push_back(j);
    std::size_t outers = 0;
    for (std::size_t i = 0; i < n; ++i) outers += around[i].size() % 2 == 0 ? 1 : 0;
    const bool as_said = outers == 1 && around[0].empty();
    if (options_.outer_known && as_said) return {std::move(loops_)};
    if (options_.outer_known) {
      // Loops beside each other where the file names one outer loop: a panel each.
      note(boundaries_[0], "outer loop",
           outers == 1 ? "the loop that the file calls the outer one lies within another; that one is taken"
                       : std::to_string(outers) + " loops lie beside each other on one surface; each becomes a panel");
    }
    std::vector<std::vector<TrimLoop>> out;
    std::vector<std::size_t> group(n);
    for (std::size_t i = 0; i < n; ++i)
      if (around[i].size() % 2 == 0) {
        group[i] = out.size();
        out.emplace_back();
        out.back().push_back(loops_[i]);
        out.back().back().kind = LoopKind::outer;
      }
    for (std::size_t i = 0; i < n; ++i) {
      if (around[i].size() % 2 == 0) continue;
      // Its panel is the innermost loop around it.
      const std::size_t parent = *std::min_element(around[i].begin(), around[i].end(),
                                                   [&](std::size_t x, std::size_t y) { return areas[x] < areas[y]; });
      loops_[i].kind = LoopKind::hole;
      out[group[parent]].push_back(std::move(loops_[i]));
    }
    return out;
  }

  Vector2d shifted_into(Vector2d x, const std::vector<Vector2d>& of) const {
    for (int k = 0; k < 2; ++k)
      if (const double period = period_[static_cast<std::size_t>(k)]; period > 0) {
        double low = std::numeric_limits<double>::infinity();
        for (const Vector2d& p : of) low = std::min(low, p[k]);
        x[k] -= period * std::floor((x[k] - low) / period);
      }
    return x;
  }

  // Loops moved by whole periods into the domain; the surface unrolled over its seam where a loop crosses it.
  void fit_into_domain(TrimmedSurface& face) {
    for (std::size_t k = 0; k < 2; ++k) {
      if (!closed_[k]) continue;
      const auto axis = static_cast<Eigen::Index>(k);
      const double period = period_[k], slack = 1e-9 * period;
      const auto range = [&](const TrimLoop& loop) {
        Interval r{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
        for (const Vector2d& p : polygon(loop.curves)) {
          r.min = std::min(r.min, p[axis]);
          r.max = std::max(r.max, p[axis]);
        }
        return r;
      };
      const auto move = [&](TrimLoop& loop, double by) {
        for (TrimCurve& c : loop.curves) shift(c, static_cast<int>(k), by);
      };
      TrimLoop& outer = face.loops[0];
      const BoundaryCurves& place = boundaries_[static_cast<std::size_t>(outer.index)];
      Interval r = range(outer);
      const double by = -period * std::floor((r.min + slack - domain_[k].min) / period);
      if (by != 0) {
        move(outer, by);
        r.min += by, r.max += by;
        note(place, "period", "the loop lies beyond the closed surface's domain; it is moved by " + format_real(by));
      }
      if (r.length() > 2 * period - slack) fail(place, "the loop runs around the closed surface more than twice");
      Interval window = domain_[k];
      if (r.max > domain_[k].max + slack) {
        window = {std::max(r.min, domain_[k].min), std::min(r.max, domain_[k].max + period)};
        // A window as wide as the domain keeps all of the surface.
        face.surface = unrolled(face.surface, k == 0 ? Direction::u : Direction::v, window);
        note(place, "seam crossed",
             "the loop crosses the seam of the closed surface; the surface is unrolled from " +
                 format_real(window.min) + " to " + format_real(window.max));
        boundaries_[static_cast<std::size_t>(outer.index)].converted = "surface unrolled over its seam";
      }
      for (std::size_t i = 1; i < face.loops.size(); ++i) {
        const Interval hole = range(face.loops[i]);
        move(face.loops[i], -period * std::floor((hole.min + slack - window.min) / period));
      }
    }
  }

  const FileSurface& file_;
  NurbsSurface s_;
  std::vector<BoundaryCurves>& boundaries_;
  const FaceOptions& options_;
  std::array<Interval, 2> domain_;
  std::array<bool, 2> closed_{};
  std::array<double, 2> period_{};
  double size_ = 0, snap_ = 0;
  const ParameterMap* map_ = nullptr;
  std::vector<TrimLoop> loops_;
};

NurbsSurface unrolled_u(const NurbsSurface& closed, Interval window) {
  const NurbsSurface s = clamp(closed);
  const KnotVector& k = s.u();
  const int p = k.degree(), n = s.count_u();
  const double period = k.domain().length();
  std::vector<double> knots(k.knots().begin(), k.knots().end() - 1);
  for (int i = p + 1; i < n + p + 1; ++i) knots.push_back(i < n ? k[i] + period : k.domain().max + period);
  const int count = 2 * n - 1;
  Eigen::Matrix3Xd points(3, count * s.count_v());
  std::vector<double> weights;
  for (int j = 0; j < s.count_v(); ++j) {
    const double ratio = s.weight(s.index(n - 1, j)) / s.weight(s.index(0, j));
    for (int i = 0; i < count; ++i) {
      const int from = s.index(i < n ? i : i - n + 1, j);
      points.col(i + count * j) = s.points().col(from);
      if (s.rational()) weights.push_back(s.weight(from) * (i < n ? 1 : ratio));
    }
  }
  SplineSurface twice{NurbsSurface(KnotVector(p, std::move(knots)), s.v(), std::move(points), std::move(weights)),
                      window, s.v().domain()};
  return restricted(twice);
}

}  // namespace

NurbsSurface unrolled(const NurbsSurface& surface, Direction direction, Interval window) {
  return direction == Direction::u ? unrolled_u(surface, window) : transposed(unrolled_u(transposed(surface), window));
}

std::vector<TrimmedSurface> make_faces(const FileSurface& surface, std::vector<BoundaryCurves>& boundaries,
                                       const FaceOptions& options) {
  return FaceMaker(surface, boundaries, options).run();
}

Eigen::AlignedBox3d reach(const Frame& frame, const std::vector<BoundaryCurves>& boundaries) {
  Eigen::AlignedBox3d box;
  for (const BoundaryCurves& b : boundaries)
    for (const Curve3& c : b.model)
      for (const auto& p : c.points().colwise()) box.extend(frame.local(p));
  return box;
}

}  // namespace toile::iges
