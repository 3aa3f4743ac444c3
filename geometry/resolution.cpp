// SPDX-License-Identifier: GPL-3.0-or-later
// Refinement to analysis resolution: refine() and the flat affine case.
#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/error.h"
#include "geometry/quadrature_rule.h"
#include "geometry/refine.h"
#include "geometry/text.h"

namespace toile {
namespace {

// Rounding of insertion, elevation and removal, relative to the size of the net.
constexpr double rounding = 256 * std::numeric_limits<double>::epsilon();

// More spans than this in one direction are a mistake in a unit, not a wish.
constexpr double most_spans = 1e6;
// And more control points than this: at a few kB each they fill the memory of a large machine.
constexpr double most_control_points = 2e6;

void check_size(double count_u, double count_v) {
  if (count_u * count_v > most_control_points)
    throw GeometryError("this refinement makes " + text(count_u) + " x " + text(count_v) +
                        " control points, more than the " + text(most_control_points) +
                        " possible; ask for fewer or longer spans");
}

double net_size(const NurbsSurface& surface) {
  return (surface.points().rowwise().maxCoeff() - surface.points().rowwise().minCoeff()).norm();
}

Eigen::Vector3d at(const AffinePatch& patch, double u, double v) {
  return patch.origin + u * patch.du + v * patch.dv;
}

// Largest distance between the polynomial surface and the map: that of the control points from the map at Greville
// abscissae, since such a net reproduces the map.
double polynomial_deviation(const NurbsSurface& surface, const AffinePatch& patch) {
  double deviation = 0;
  for (int j = 0; j < surface.count_v(); ++j)
    for (int i = 0; i < surface.count_u(); ++i)
      deviation = std::max(deviation, (surface.points().col(surface.index(i, j)) -
                                       at(patch, surface.u().greville(i), surface.v().greville(j)))
                                          .norm());
  return deviation;
}

// The same for a rational surface A / W: |A - L W| / W, its numerator bounded by the Bernstein coefficients of degree
// (pu + 1, pv + 1) on each Bezier patch, W by its own.
double rational_deviation(const NurbsSurface& surface, const AffinePatch& patch) {
  double deviation = 0;
  for (const BezierPatch& bezier : bezier_patches(surface)) {
    const int pu = bezier.degree_u, pv = bezier.degree_v;
    const Eigen::Vector3d l00 = at(patch, bezier.u.min, bezier.v.min);
    const Eigen::Vector3d lu = patch.du * bezier.u.length(), lv = patch.dv * bezier.v.length();
    double numerator = 0;
    for (int j = 0; j <= pv + 1; ++j)
      for (int i = 0; i <= pu + 1; ++i) {
        Eigen::Vector3d coefficient = Eigen::Vector3d::Zero();
        for (int b = 0; b < 2; ++b)
          for (int a = 0; a < 2; ++a) {
            const int ii = i - a, jj = j - b;
            if (ii < 0 || ii > pu || jj < 0 || jj > pv) continue;
            const double share_u = static_cast<double>(a == 0 ? pu + 1 - i : i) / (pu + 1);
            const double share_v = static_cast<double>(b == 0 ? pv + 1 - j : j) / (pv + 1);
            const int k = ii + (pu + 1) * jj;
            coefficient += share_u * share_v * bezier.weights[k] * (bezier.points.col(k) - (l00 + a * lu + b * lv));
          }
        numerator = std::max(numerator, coefficient.norm());
      }
    deviation = std::max(deviation, numerator / bezier.weights.minCoeff());
  }
  return deviation;
}

double deviation_from(const NurbsSurface& surface, const AffinePatch& patch) {
  return surface.rational() ? rational_deviation(surface, patch) : polynomial_deviation(surface, patch);
}

AffinePatch through_corners(const NurbsSurface& surface) {
  const Interval u = surface.u().domain(), v = surface.v().domain();
  const Eigen::Vector3d x00 = surface(u.min, v.min);
  AffinePatch patch;
  patch.du = (surface(u.max, v.min) - x00) / u.length();
  patch.dv = (surface(u.min, v.max) - x00) / v.length();
  patch.origin = x00 - u.min * patch.du - v.min * patch.dv;
  return patch;
}

// Least squares on the points at Greville abscissae.
AffinePatch fitted(const NurbsSurface& surface) {
  const int nu = surface.count_u(), nv = surface.count_v();
  const Interval u = surface.u().domain(), v = surface.v().domain();
  const double mu = u.min + u.length() / 2, mv = v.min + v.length() / 2;
  Eigen::MatrixXd a(nu * nv, 3), b(nu * nv, 3);
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i) {
      const int k = surface.index(i, j);
      const double gu = surface.u().greville(i), gv = surface.v().greville(j);
      a.row(k) << 1.0, (gu - mu) / u.length(), (gv - mv) / v.length();
      b.row(k) = (surface.rational() ? surface(gu, gv) : Eigen::Vector3d(surface.points().col(k))).transpose();
    }
  const Eigen::Matrix3d x = a.colPivHouseholderQr().solve(b);
  AffinePatch patch;
  patch.du = x.row(1).transpose() / u.length();
  patch.dv = x.row(2).transpose() / v.length();
  patch.origin = x.row(0).transpose() - mu * patch.du - mv * patch.dv;
  return patch;
}

}  // namespace

Eigen::Vector2d parameters_at(const AffinePatch& patch, const Eigen::Vector3d& x) {
  const Eigen::Vector3d d = x - patch.origin;
  const double uu = patch.du.squaredNorm(), uv = patch.du.dot(patch.dv), vv = patch.dv.squaredNorm();
  const double a = patch.du.dot(d), b = patch.dv.dot(d), determinant = uu * vv - uv * uv;
  return {(vv * a - uv * b) / determinant, (uu * b - uv * a) / determinant};
}

std::optional<AffinePatch> affine_patch(const NurbsSurface& surface, double tolerance) {
  if (surface.u().degree() == 0 || surface.v().degree() == 0) return std::nullopt;
  // Corners first: where they serve to rounding, their coordinates stay as they are.
  AffinePatch patch = through_corners(surface);
  patch.deviation = deviation_from(surface, patch);
  if (patch.deviation > rounding * net_size(surface)) {
    AffinePatch other = fitted(surface);
    other.deviation = deviation_from(surface, other);
    if (other.deviation < patch.deviation) patch = other;
  }
  if (!(patch.deviation <= tolerance)) return std::nullopt;
  return patch;
}

NurbsSurface rebuild(const AffinePatch& patch, KnotVector u, KnotVector v) {
  if (u.degree() == 0 || v.degree() == 0) throw GeometryError("an affine panel needs degree 1 or more, asked for 0");
  const int nu = u.control_point_count(), nv = v.control_point_count();
  Eigen::Matrix3Xd points(3, nu * nv);
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i) points.col(i + nu * j) = at(patch, u.greville(i), v.greville(j));
  return {std::move(u), std::move(v), std::move(points)};
}

namespace {

std::string name(Direction d) {
  return d == Direction::u ? "u" : "v";
}

// Length of the longest iso-curve over each span of direction d, found on nine lines of every span of the other.
std::vector<double> span_lengths(const NurbsSurface& surface, Direction d) {
  const Direction other = d == Direction::u ? Direction::v : Direction::u;
  const std::vector<double> along = surface.knots(d).breaks(), across = surface.knots(other).breaks();
  std::vector<double> lengths(along.size() - 1, 0);
  constexpr int lines = 8;
  for (std::size_t c = 0; c + 1 < across.size(); ++c)
    for (int k = c == 0 ? 0 : 1; k <= lines; ++k) {
      const double q = k == lines ? across[c + 1] : across[c] + (across[c + 1] - across[c]) * k / lines;
      const auto speed = [&](double t) {
        return d == Direction::u ? evaluate(surface, t, q).u.norm() : evaluate(surface, q, t).v.norm();
      };
      for (std::size_t s = 0; s < lengths.size(); ++s)
        lengths[s] = std::max(lengths[s], gauss8(speed, along[s], along[s + 1]));
    }
  return lengths;
}

// How often each span is split for a total: one after the other, always the span with the longest parts; ties (to
// rounding) go to the first.
std::vector<int> distribute(const std::vector<double>& lengths, int total) {
  std::vector<int> parts(lengths.size(), 1);
  for (int left = total - static_cast<int>(parts.size()); left > 0; --left) {
    std::size_t best = 0;
    for (std::size_t s = 1; s < parts.size(); ++s)
      if (lengths[s] / parts[s] > lengths[best] / parts[best] * (1 + 1e-9)) best = s;
    ++parts[best];
  }
  return parts;
}

std::vector<int> parts_for_span(const std::vector<double>& lengths, double span, Direction d) {
  std::vector<int> parts;
  double total = 0;
  for (double length : lengths) {
    // A length that is a multiple of the span to rounding isn't split once more.
    const double count = std::max(1.0, std::ceil(length / span * (1 - 1e-9)));
    total += count;
    if (!(total <= most_spans))
      throw GeometryError("spans of length " + text(span) + " split direction " + name(d) + " into more than " +
                          text(most_spans) + " parts");
    parts.push_back(static_cast<int>(count));
  }
  return parts;
}

std::vector<double> split(const std::vector<double>& breaks, const std::vector<int>& parts) {
  std::vector<double> result;
  for (std::size_t s = 0; s < parts.size(); ++s)
    for (int k = 0; k < parts[s]; ++k) result.push_back(breaks[s] + (breaks[s + 1] - breaks[s]) * k / parts[s]);
  result.push_back(breaks.back());
  return result;
}

void check(const RefineOptions& options) {
  if (options.degree && (*options.degree < 1 || *options.degree > max_degree))
    throw GeometryError("degree " + std::to_string(*options.degree) + " is outside 1 to " + std::to_string(max_degree));
  if (options.span && !(*options.span > 0 && std::isfinite(*options.span)))
    throw GeometryError("span " + text(*options.span) + " must be a positive length");
  if (options.span.has_value() + options.spans.has_value() + options.control_points.has_value() > 1)
    throw GeometryError("ask for one of span, spans and control_points");
  for (const auto& totals : {options.spans, options.control_points})
    if (totals)
      for (int n : *totals)
        if (n > most_spans) throw GeometryError(std::to_string(n) + " is above the most possible, " + text(most_spans));
}

// The span total asked for in one direction; `fewest` is what the surface has, `other_points` = control points - spans.
std::optional<int> asked_total(const RefineOptions& options, Direction d, int fewest, int other_points) {
  const int k = d == Direction::u ? 0 : 1;
  if (options.spans) {
    const int total = (*options.spans)[k];
    if (total < fewest)
      throw GeometryError("direction " + name(d) + " was asked for " + std::to_string(total) + " spans; at least " +
                          std::to_string(fewest) + " are possible");
    return total;
  }
  if (options.control_points) {
    const int total = (*options.control_points)[k];
    if (total - other_points < fewest)
      throw GeometryError("direction " + name(d) + " was asked for " + std::to_string(total) +
                          " control points; at least " + std::to_string(fewest + other_points) + " are possible");
    return total - other_points;
  }
  return std::nullopt;
}

KnotVector flat_knots(const KnotVector& knots, Direction d, double length_per_parameter, const RefineOptions& options) {
  const int degree = options.degree.value_or(std::max(knots.degree(), 2));
  const std::vector<double> breaks = knots.breaks();
  const int own = static_cast<int>(breaks.size()) - 1;
  std::vector<double> lengths;
  for (int s = 0; s < own; ++s) lengths.push_back(length_per_parameter * (breaks[s + 1] - breaks[s]));
  if (const auto total = asked_total(options, d, 1, degree)) {
    // An affine map lies on any knots: where the file's own are too many for the total, equal spans.
    if (*total < own) return uniform_knots(degree, *total, knots.domain());
    return clamped_knots(degree, split(breaks, distribute(lengths, *total)));
  }
  if (options.span) return clamped_knots(degree, split(breaks, parts_for_span(lengths, *options.span, d)));
  return clamped_knots(degree, breaks);
}

// Removes knots of multiplicity >= degree until the surface is as smooth there as its geometry, but keeps every knot
// once. Returns the sum of the deviations.
double smooth_kinks(NurbsSurface& surface, Direction d, double tolerance) {
  double moved = 0;
  const std::vector<double> breaks = surface.knots(d).breaks();
  for (std::size_t i = 1; i + 1 < breaks.size(); ++i) {
    if (surface.knots(d).multiplicity(breaks[i]) < surface.knots(d).degree()) continue;
    while (surface.knots(d).multiplicity(breaks[i]) > 1) {
      double deviation = 0;
      auto next = remove_knot(surface, d, breaks[i], tolerance - moved, &deviation);
      if (!next) break;
      surface = std::move(*next);
      moved += deviation;
    }
  }
  return moved;
}

std::vector<double> splitting_knots(const NurbsSurface& surface, Direction d, const RefineOptions& options) {
  const std::vector<double> breaks = surface.knots(d).breaks();
  const int own = static_cast<int>(breaks.size()) - 1;
  std::vector<int> parts;
  if (const auto total = asked_total(options, d, own, surface.knots(d).control_point_count() - own))
    parts = distribute(span_lengths(surface, d), *total);
  else if (options.span)
    parts = parts_for_span(span_lengths(surface, d), *options.span, d);
  else
    return {};
  std::vector<double> added;
  for (double b : split(breaks, parts))
    if (!std::ranges::binary_search(breaks, b)) added.push_back(b);
  return added;
}

}  // namespace

Refinement refine(const NurbsSurface& surface, const RefineOptions& options) {
  check(options);
  Refinement result;
  const double tolerance = std::max(options.tolerance, rounding * net_size(surface));
  if (const auto patch = affine_patch(surface, tolerance)) {
    KnotVector u = flat_knots(surface.u(), Direction::u, patch->du.norm(), options);
    KnotVector v = flat_knots(surface.v(), Direction::v, patch->dv.norm(), options);
    check_size(u.control_point_count(), v.control_point_count());
    // A file that has these knots already keeps its numbers.
    if (u == surface.u() && v == surface.v() && !surface.rational()) {
      result.surface = surface;
    } else {
      result.surface = rebuild(*patch, std::move(u), std::move(v));
      result.deviation = patch->deviation;
      result.rebuilt_flat = true;
    }
  } else {
    NurbsSurface s = clamp(surface);
    for (Direction d : {Direction::u, Direction::v}) {
      const int own = s.knots(d).degree();
      s = elevate_degree(s, d, options.degree ? std::max({own, *options.degree, 2}) : own);
    }
    for (Direction d : {Direction::u, Direction::v})
      result.deviation += smooth_kinks(s, d, tolerance - result.deviation);
    const std::vector<double> u = splitting_knots(s, Direction::u, options);
    const std::vector<double> v = splitting_knots(s, Direction::v, options);
    check_size(s.count_u() + static_cast<double>(u.size()), s.count_v() + static_cast<double>(v.size()));
    result.surface = insert_knots(insert_knots(s, Direction::u, u), Direction::v, v);
  }
  for (Direction d : {Direction::u, Direction::v}) {
    const KnotVector& knots = result.surface.knots(d);
    const std::vector<double> breaks = knots.breaks();
    for (std::size_t i = 1; i + 1 < breaks.size(); ++i)
      if (knots.multiplicity(breaks[i]) >= knots.degree()) result.kinks.emplace_back(d, breaks[i]);
  }
  return result;
}

}  // namespace toile
