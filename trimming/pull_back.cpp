// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/pull_back.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "geometry/cubic_fit.h"
#include "geometry/error.h"
#include "geometry/measure.h"
#include "geometry/refine.h"
#include "trimming/text.h"

namespace toile {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

struct Place {
  double t = 0;
  Vector2d uv{0, 0};  // continuous along the curve
  double distance = 0;
  std::array<bool, 2> lost{};  // the surface is collapsed there: any value of this coordinate names the point
};

class Puller {
 public:
  Puller(const NurbsSurface& surface, const Curve3& model, const PullBackOptions& options)
      : s_(surface), model_(model), domain_{surface.u().domain(), surface.v().domain()} {
    size_ = (s_.points().rowwise().maxCoeff() - s_.points().rowwise().minCoeff()).norm();
    const double rounding = 64 * std::numeric_limits<double>::epsilon() * s_.points().cwiseAbs().maxCoeff();
    tolerance_ = std::max(options.tolerance * size_, rounding);
    snap_ = std::max(options.snap, tolerance_);
    closed_ = closed_directions(s_, std::max(snap_, 1e-9 * size_));
    start_ = options.start;
    max_distance_ = options.max_distance;
  }

  PulledCurve run() {
    sample();
    find_constants();
    PulledCurve out;
    for (const Place& p : places_) {
      if (p.distance <= out.distance) continue;
      out.distance = p.distance;
      out.place = model_(p.t);
    }
    if (!(out.distance <= max_distance_ * size_)) {
      throw GeometryError("a model curve leaves its surface by " + text(out.distance) + " at (" + text(out.place.x()) +
                          ", " + text(out.place.y()) + ", " + text(out.place.z()) + ")");
    }
    if (const std::optional<PulledCurve> straight = segment()) {
      out.curve = straight->curve;
      out.error = straight->error;
      return out;
    }
    std::vector<SmoothPath<2>> path;
    const std::vector<double> breaks = model_.knots().breaks();
    for (std::size_t i = 0; i + 1 < breaks.size(); ++i) {
      const int span = model_.knots().find_span(0.5 * (breaks[i] + breaks[i + 1]));
      path.push_back({{breaks[i], breaks[i + 1]}, [this, span](double t) { return path_point(span, t); }});
    }
    CubicFitOptions<2> fit;
    fit.tolerance = std::max(tolerance_, 0.01 * out.distance);
    fit.max_halvings = 10;
    fit.distance = [this](double, const Vector2d& path_uv, const Vector2d& uv) {
      return length(path_uv, uv - path_uv);
    };
    const CubicFit<2> fitted = fit_cubic<2>(path, fit);
    out.curve = fitted.curve;
    out.error = fitted.error;
    return out;
  }

 private:
  Vector2d wrapped(Vector2d uv) const {
    for (int k = 0; k < 2; ++k) {
      const Interval d = domain_[static_cast<std::size_t>(k)];
      if (closed_[static_cast<std::size_t>(k)] && !d.contains(uv[k]))
        uv[k] -= d.length() * std::floor((uv[k] - d.min) / d.length());
      uv[k] = std::clamp(uv[k], d.min, d.max);
    }
    return uv;
  }

  // The same point of the surface, written so that it lies nearest to `near`.
  Vector2d unwrapped(Vector2d uv, const Vector2d& near) const {
    for (int k = 0; k < 2; ++k)
      if (closed_[static_cast<std::size_t>(k)]) {
        const double period = domain_[static_cast<std::size_t>(k)].length();
        uv[k] += period * std::round((near[k] - uv[k]) / period);
      }
    return uv;
  }

  SurfaceJet jet(const Vector2d& uv) const {
    const Vector2d w = wrapped(uv);
    return evaluate(s_, w.x(), w.y());
  }
  double length(const Vector2d& at, const Vector2d& step) const {
    const SurfaceJet j = jet(at);
    return (j.u * step.x() + j.v * step.y()).norm();
  }

  // The nearest point by descent from `near`, with both sides of a seam tried.
  ClosestPoint nearest(const Vector3d& x, const Vector2d& near) const {
    ClosestPointOptions options;
    options.start = wrapped(near);
    ClosestPoint best = closest_point(s_, x, options);
    for (int k = 0; k < 2; ++k) {
      const Interval d = domain_[static_cast<std::size_t>(k)];
      const double at = k == 0 ? best.u : best.v;
      if (!closed_[static_cast<std::size_t>(k)] || (at != d.min && at != d.max)) continue;
      options.start = Vector2d(best.u, best.v);
      (*options.start)[k] = at == d.min ? d.max : d.min;
      const ClosestPoint other = closest_point(s_, x, options);
      if (other.distance < best.distance) best = other;
    }
    return best;
  }

  Place place(double t, const Vector2d& near, double expected) const {
    const Vector3d x = model_(t);
    ClosestPoint found = nearest(x, near);
    if (!found.converged || found.distance > 2 * expected + snap_) {
      const ClosestPoint other = closest_point(s_, x);
      if (other.distance < found.distance) found = other;
    }
    return {t, unwrapped({found.u, found.v}, near), found.distance, {}};
  }

  void sample() {
    constexpr int pieces = 8;
    const std::vector<double> breaks = model_.knots().breaks();
    std::vector<double> ts{breaks.front()};
    for (std::size_t i = 0; i + 1 < breaks.size(); ++i)
      for (int k = 1; k <= pieces; ++k)
        ts.push_back(k == pieces ? breaks[i + 1] : breaks[i] + (breaks[i + 1] - breaks[i]) * k / pieces);
    Vector2d near;
    double expected = 0;
    if (start_) {
      near = *start_;
      const ClosestPoint found = nearest(model_(ts[0]), near);
      expected = found.distance;
    } else {
      const ClosestPoint found = closest_point(s_, model_(ts[0]));
      near = {found.u, found.v};
      expected = found.distance;
    }
    for (const double t : ts) {
      Place p = place(t, near, expected);
      const SurfaceJet j = jet(p.uv);
      const double collapsed = 1e-7 * size_;
      p.lost = {j.u.norm() * domain_[0].length() <= collapsed, j.v.norm() * domain_[1].length() <= collapsed};
      if (p.lost[0]) p.uv.x() = near.x();
      if (p.lost[1]) p.uv.y() = near.y();
      near = p.uv;
      expected = p.distance;
      places_.push_back(p);
    }
    // Where the curve begins in a collapsed edge, its first regular place says where it leaves it.
    for (int k = 0; k < 2; ++k) {
      const auto first = std::find_if(places_.begin(), places_.end(),
                                      [&](const Place& p) { return !p.lost[static_cast<std::size_t>(k)]; });
      if (first == places_.end()) continue;
      for (auto p = places_.begin(); p != first; ++p) p->uv[k] = first->uv[k];
    }
  }

  // Largest speed of the surface along a coordinate, at the samples.
  double speed(int k) const {
    double fastest = 0;
    for (const Place& p : places_) {
      const SurfaceJet j = jet(p.uv);
      fastest = std::max(fastest, k == 0 ? j.u.norm() : j.v.norm());
    }
    return fastest;
  }

  void find_constants() {
    for (int k = 0; k < 2; ++k) {
      const Interval d = domain_[static_cast<std::size_t>(k)];
      const double allowed = snap_ / std::max(speed(k), 1e-300);
      const auto stays = [&](double value) {
        return std::all_of(places_.begin(), places_.end(), [&](const Place& p) {
          return p.lost[static_cast<std::size_t>(k)] || std::abs(p.uv[k] - value) <= allowed;
        });
      };
      const double start = places_.front().uv[k];
      const double period = closed_[static_cast<std::size_t>(k)] ? d.length() : 0;
      for (const double line : (k == 0 ? s_.u() : s_.v()).breaks()) {
        const double shifted = period > 0 ? line + period * std::round((start - line) / period) : line;
        if (stays(shifted)) constant_[static_cast<std::size_t>(k)] = shifted;
      }
      // The tighter tolerance off the knot lines: nothing says that an iso-curve was meant.
      auto& constant = constant_[static_cast<std::size_t>(k)];
      const double middle = places_[places_.size() / 2].uv[k];
      const double tight = tolerance_ / std::max(speed(k), 1e-300);
      if (!constant && std::all_of(places_.begin(), places_.end(),
                                   [&](const Place& p) { return std::abs(p.uv[k] - middle) <= tight; }))
        constant = middle;
    }
    for (Place& p : places_)
      for (int k = 0; k < 2; ++k)
        if (constant_[static_cast<std::size_t>(k)]) p.uv[k] = *constant_[static_cast<std::size_t>(k)];
    // Ends within the snap of a border lie on it. Where the surface is collapsed every value does, and says nothing.
    for (Place* p : {&places_.front(), &places_.back()})
      for (int k = 0; k < 2; ++k) {
        if (p->lost[static_cast<std::size_t>(k)]) continue;
        const Interval d = domain_[static_cast<std::size_t>(k)];
        const SurfaceJet j = jet(p->uv);
        for (const double line : {d.min, d.max})
          if (std::abs(p->uv[k] - line) * (k == 0 ? j.u.norm() : j.v.norm()) <= snap_) p->uv[k] = line;
      }
  }

  // A straight segment in the parameter plane, where that is all that the curve is.
  std::optional<PulledCurve> segment() const {
    const Place &a = places_.front(), &b = places_.back();
    const Vector2d chord = b.uv - a.uv;
    if (chord.norm() == 0) return std::nullopt;
    PulledCurve out;
    const bool iso = constant_[0] || constant_[1];
    bool monotone = true;
    double off = 0, last = 0;
    for (const Place& p : places_) {
      const double along = iso ? (constant_[0] ? (p.uv.y() - a.uv.y()) / chord.y() : (p.uv.x() - a.uv.x()) / chord.x())
                               : (p.t - a.t) / (b.t - a.t);
      monotone = monotone && along >= last - 1e-9;
      last = along;
      off = std::max(off, length(p.uv, a.uv + std::clamp(along, 0.0, 1.0) * chord - p.uv));
    }
    if (!monotone || off > tolerance_) return std::nullopt;
    out.error = off;
    out.curve = with_domain(line_segment<2>(a.uv, b.uv), model_.domain());
    return out;
  }

  PathPoint<2> path_point(int span, double t) const {
    const auto above =
        std::lower_bound(places_.begin(), places_.end(), t, [](const Place& p, double at) { return p.t < at; });
    Place at;
    if (above != places_.end() && above->t == t) {
      at = *above;
    } else {
      const Place& b = above == places_.end() ? places_.back() : *above;
      const Place& a = above == places_.begin() ? b : *std::prev(above);
      const double f = b.t > a.t ? (t - a.t) / (b.t - a.t) : 0;
      const Vector2d guess = a.uv + f * (b.uv - a.uv);
      at = place(t, guess, std::max(a.distance, b.distance));
      for (int k = 0; k < 2; ++k)
        if (constant_[static_cast<std::size_t>(k)]) at.uv[k] = *constant_[static_cast<std::size_t>(k)];
    }
    const SurfaceJet j = jet(at.uv);
    Eigen::Matrix<double, 3, 2> map;
    map << j.u, j.v;
    const Vector3d d = evaluate_on_span(model_, span, t).d1;
    // The derivative of the condition that the rest stands upright on the surface.
    const Vector3d rest = model_(t) - j.x;
    Eigen::Matrix2d bending;
    bending << rest.dot(j.uu), rest.dot(j.uv), rest.dot(j.uv), rest.dot(j.vv);
    Eigen::Matrix2d normal = map.transpose() * map;
    if ((normal - bending).determinant() > 0.1 * normal.determinant()) normal -= bending;
    normal.diagonal().array() += 1e-14 * normal.trace();  // collapsed edges
    Vector2d rate = normal.ldlt().solve(map.transpose() * d);
    if (!rate.allFinite()) rate.setZero();
    for (int k = 0; k < 2; ++k)
      if (constant_[static_cast<std::size_t>(k)]) rate[k] = 0;
    return {at.uv, rate};
  }

  const NurbsSurface& s_;
  const Curve3& model_;
  std::array<Interval, 2> domain_;
  std::array<bool, 2> closed_{};
  double size_ = 0, tolerance_ = 0, snap_ = 0, max_distance_ = 0;
  std::optional<Vector2d> start_;
  std::vector<Place> places_;
  std::array<std::optional<double>, 2> constant_{};
};

}  // namespace

std::array<bool, 2> closed_directions(const NurbsSurface& s, double tolerance) {
  std::array<bool, 2> out{};
  const Interval u = s.u().domain(), v = s.v().domain();
  // Edges that are one curve have nets that agree once clamped; places between the breaks tell as well and need no
  // copy.
  const auto same = [&](const KnotVector& along, auto&& at) {
    bool moves = false;
    const Vector3d first = at(along.domain().min, false);
    for (const int i : along.spans())
      for (int k = 0; k <= 2 * along.degree() + 1; ++k) {
        const double t = along[i] + (along[i + 1] - along[i]) * k / (2 * along.degree() + 1);
        const Vector3d x = at(t, false);
        if ((x - at(t, true)).norm() > tolerance) return false;
        moves = moves || (x - first).norm() > tolerance;
      }
    return moves;
  };
  out[0] = same(s.v(), [&](double t, bool end) { return s(end ? u.max : u.min, t); });
  out[1] = same(s.u(), [&](double t, bool end) { return s(t, end ? v.max : v.min); });
  return out;
}

PulledCurve pull_back(const NurbsSurface& surface, const Curve3& model, const PullBackOptions& options) {
  return Puller(surface, model, options).run();
}

}  // namespace toile
