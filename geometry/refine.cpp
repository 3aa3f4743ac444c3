// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/refine.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/error.h"
#include "geometry/line_net.h"
#include "geometry/text.h"

namespace toile {
namespace {

using detail::equal_weights;
using detail::LineNet;
using detail::Rows;
using detail::to_net;
using detail::to_surface;

// Homogeneous coordinates beside each other; polynomial geometry travels without its weight column.
template <int Dim>
LineNet to_net(const NurbsCurve<Dim>& curve) {
  Rows rows(curve.points().cols(), curve.rational() ? Dim + 1 : Dim);
  rows.template leftCols<Dim>() = curve.points().transpose();
  if (curve.rational())
    for (int i = 0; i < rows.rows(); ++i) {
      rows.row(i).template head<Dim>() *= curve.weight(i);
      rows(i, Dim) = curve.weight(i);
    }
  return {curve.knots(), std::move(rows)};
}

template <int Dim>
NurbsCurve<Dim> to_curve(LineNet net, const NurbsCurve<Dim>& like) {
  const Eigen::Index count = net.rows.rows();
  typename NurbsCurve<Dim>::Points points = net.rows.template leftCols<Dim>().transpose();
  if (!like.rational()) return {std::move(net.knots), std::move(points), equal_weights(like.weights(), count)};
  std::vector<double> weights(static_cast<std::size_t>(count));
  for (Eigen::Index i = 0; i < count; ++i) {
    weights[static_cast<std::size_t>(i)] = net.rows(i, Dim);
    points.col(i) /= net.rows(i, Dim);
  }
  return {std::move(net.knots), std::move(points), std::move(weights)};
}

// A bound on the distance between two splines on the same knots, whose row groups hold `width` homogeneous coordinates
// (the last of width - Dim = 1 being the weight). Polynomial: basis functions are nonnegative and sum to 1, so no point
// moves further than the farthest control point. Rational, with C = A / W and C' = A' / W':
//   C - C' = sum N_i (dA_i - C' dW_i) / sum N_i w_i <= max_i |w'_i (P_i - P'_i) + (P_i - C') dW_i| / w_i,
// and where N_i acts, C' lies in the hull of the P'_k. Weights must be positive.
template <int Dim>
double deviation_bound(const Rows& a, const Rows& b, bool rational) {
  const int width = rational ? Dim + 1 : Dim;
  const Eigen::Index groups = a.cols() / width;
  double bound = 0;
  if (!rational) {
    for (Eigen::Index i = 0; i < a.rows(); ++i)
      for (Eigen::Index g = 0; g < groups; ++g)
        bound = std::max(bound, (a.row(i).segment(g * Dim, Dim) - b.row(i).segment(g * Dim, Dim)).norm());
    return bound;
  }
  Eigen::Array<double, 1, Dim> low = Eigen::Array<double, 1, Dim>::Constant(std::numeric_limits<double>::infinity());
  Eigen::Array<double, 1, Dim> high = -low;
  for (const Rows* net : {&a, &b})
    for (Eigen::Index i = 0; i < net->rows(); ++i)
      for (Eigen::Index g = 0; g < groups; ++g) {
        const double w = (*net)(i, g * width + Dim);
        const Eigen::Array<double, 1, Dim> point = net->row(i).segment(g * width, Dim).array() / w;
        low = low.min(point);
        high = high.max(point);
      }
  const double diameter = (high - low).matrix().norm();
  for (Eigen::Index i = 0; i < a.rows(); ++i)
    for (Eigen::Index g = 0; g < groups; ++g) {
      const double wa = a(i, g * width + Dim), wb = b(i, g * width + Dim);
      const Eigen::RowVectorXd move = a.row(i).segment(g * width, Dim) / wa - b.row(i).segment(g * width, Dim) / wb;
      bound = std::max(bound, (wb * move.norm() + diameter * std::abs(wa - wb)) / wa);
    }
  return bound;
}

// Removal may leave control points without a positive weight although the curve between them has one.
template <int Dim>
bool weights_positive(const Rows& rows) {
  for (Eigen::Index k = Dim; k < rows.cols(); k += Dim + 1)
    if (!(rows.col(k).minCoeff() > 0)) return false;
  return true;
}

struct Removed {
  LineNet net;
  double bound;
};
template <int Dim>
Removed try_removal(const LineNet& net, double knot, bool rational) {
  LineNet without = detail::without_knot(net, knot);
  // A knot of multiplicity p + 1 cannot be put back by insertion: doubling the joined point does it.
  const int p = net.knots.degree();
  Rows again;
  if (net.knots.multiplicity(knot) <= p) {
    again = detail::insert_knots(without, std::span(&knot, 1)).rows;
  } else {
    const auto t = net.knots.knots();
    const auto joined = std::upper_bound(t.begin(), t.end(), knot) - t.begin() - 2 - p;
    again.resize(net.rows.rows(), net.rows.cols());
    again.topRows(joined + 1) = without.rows.topRows(joined + 1);
    again.bottomRows(again.rows() - joined - 1) = without.rows.bottomRows(without.rows.rows() - joined);
  }
  const double bound = rational && !weights_positive<Dim>(without.rows)
                           ? std::numeric_limits<double>::infinity()
                           : deviation_bound<Dim>(net.rows, again, rational);
  return {std::move(without), bound};
}

void check_removable(const KnotVector& knots, double knot) {
  const Interval domain = knots.domain();
  if (!(domain.min < knot && knot < domain.max) || knots.multiplicity(knot) == 0)
    throw GeometryError(text(knot) + " is no interior knot of the domain [" + text(domain.min) + ", " +
                        text(domain.max) + "]");
}

}  // namespace

template <int Dim>
NurbsCurve<Dim> insert_knots(const NurbsCurve<Dim>& curve, std::span<const double> added) {
  if (added.empty()) return curve;
  return to_curve(detail::insert_knots(to_net(curve), added), curve);
}

NurbsSurface insert_knots(const NurbsSurface& surface, Direction direction, std::span<const double> added) {
  if (added.empty()) return surface;
  return to_surface(detail::insert_knots(to_net(surface, direction), added), surface, direction);
}

template <int Dim>
NurbsCurve<Dim> clamp(const NurbsCurve<Dim>& curve) {
  if (curve.knots().clamped()) return curve;
  return to_curve(detail::cut(to_net(curve), curve.domain()), curve);
}

NurbsSurface clamp(const NurbsSurface& surface) {
  NurbsSurface result = surface;
  for (Direction d : {Direction::u, Direction::v})
    if (!result.knots(d).clamped())
      result = to_surface(detail::cut(to_net(result, d), result.knots(d).domain()), result, d);
  return result;
}

template <int Dim>
NurbsCurve<Dim> elevate_degree(const NurbsCurve<Dim>& curve, int degree) {
  return to_curve(detail::elevate_degree(to_net(curve), degree), curve);
}

NurbsSurface elevate_degree(const NurbsSurface& surface, Direction direction, int degree) {
  return to_surface(detail::elevate_degree(to_net(surface, direction), degree), surface, direction);
}

template <int Dim>
std::optional<NurbsCurve<Dim>> remove_knot(const NurbsCurve<Dim>& curve, double knot, double tolerance) {
  check_removable(curve.knots(), knot);
  Removed removed = try_removal<Dim>(to_net(curve), knot, curve.rational());
  if (!std::isfinite(removed.bound) || removed.bound > tolerance) return std::nullopt;
  return to_curve(std::move(removed.net), curve);
}

std::optional<NurbsSurface> remove_knot(const NurbsSurface& surface, Direction direction, double knot, double tolerance,
                                        double* deviation) {
  check_removable(surface.knots(direction), knot);
  Removed removed = try_removal<3>(to_net(surface, direction), knot, surface.rational());
  if (!std::isfinite(removed.bound) || removed.bound > tolerance) return std::nullopt;
  if (deviation) *deviation = removed.bound;
  return to_surface(std::move(removed.net), surface, direction);
}

template <int Dim>
std::vector<BezierCurve<Dim>> bezier_pieces(const NurbsCurve<Dim>& curve) {
  const std::vector<double> breaks = curve.knots().breaks();
  const std::vector<Rows> rows = detail::bezier_rows(to_net(curve));
  std::vector<BezierCurve<Dim>> pieces(rows.size());
  for (std::size_t k = 0; k < rows.size(); ++k) {
    pieces[k].range = {breaks[k], breaks[k + 1]};
    pieces[k].points = rows[k].template leftCols<Dim>().transpose();
    pieces[k].weights.setOnes(rows[k].rows());
    if (!curve.rational()) continue;
    pieces[k].weights = rows[k].col(Dim);
    for (Eigen::Index i = 0; i < rows[k].rows(); ++i) pieces[k].points.col(i) /= pieces[k].weights[i];
  }
  return pieces;
}

std::vector<BezierPatch> bezier_patches(const NurbsSurface& surface) {
  const std::vector<double> breaks_u = surface.u().breaks(), breaks_v = surface.v().breaks();
  const int pu = surface.u().degree(), pv = surface.v().degree();
  const int width = surface.rational() ? 4 : 3;
  const std::vector<Rows> strips = detail::bezier_rows(to_net(surface, Direction::u));
  std::vector<BezierPatch> patches(strips.size() * (breaks_v.size() - 1));
  for (std::size_t su = 0; su < strips.size(); ++su) {
    // The strip turned: one row per control point along v, with its pu + 1 points beside each other.
    const Rows& strip = strips[su];
    Rows turned(surface.count_v(), width * (pu + 1));
    for (int j = 0; j < surface.count_v(); ++j)
      for (int i = 0; i <= pu; ++i) turned.row(j).segment(width * i, width) = strip.row(i).segment(width * j, width);
    const std::vector<Rows> cells = detail::bezier_rows({surface.v(), std::move(turned)});
    for (std::size_t sv = 0; sv < cells.size(); ++sv) {
      BezierPatch& patch = patches[su + strips.size() * sv];
      patch.u = {breaks_u[su], breaks_u[su + 1]};
      patch.v = {breaks_v[sv], breaks_v[sv + 1]};
      patch.degree_u = pu;
      patch.degree_v = pv;
      patch.points.resize(3, (pu + 1) * (pv + 1));
      patch.weights.setOnes(patch.points.cols());
      for (int j = 0; j <= pv; ++j)
        for (int i = 0; i <= pu; ++i) {
          const int k = i + (pu + 1) * j;
          patch.points.col(k) = cells[sv].row(j).segment<3>(width * i).transpose();
          if (width == 3) continue;
          patch.weights[k] = cells[sv](j, width * i + 3);
          patch.points.col(k) /= patch.weights[k];
        }
    }
  }
  return patches;
}

template <int Dim>
NurbsCurve<Dim> sub_curve(const NurbsCurve<Dim>& curve, Interval range) {
  return to_curve(detail::cut(to_net(curve), range), curve);
}

template <int Dim>
NurbsCurve<Dim> reversed(const NurbsCurve<Dim>& curve) {
  const Interval domain = curve.domain();
  const auto t = curve.knots().knots();
  std::vector<double> knots(t.rbegin(), t.rend());
  for (double& k : knots) {
    const bool inside = domain.contains(k);
    k = k == domain.min ? domain.max : k == domain.max ? domain.min : domain.min + (domain.max - k);
    // Rounding must not push an interior knot over the end of the domain.
    if (inside) k = std::clamp(k, domain.min, domain.max);
  }
  typename NurbsCurve<Dim>::Points points = curve.points().rowwise().reverse();
  return {KnotVector(curve.degree(), std::move(knots)), std::move(points),
          std::vector<double>(curve.weights().rbegin(), curve.weights().rend())};
}

template <int Dim>
NurbsCurve<Dim> with_domain(const NurbsCurve<Dim>& curve, Interval domain) {
  const Interval old = curve.domain();
  const double scale = domain.length() / old.length();
  std::vector<double> knots(curve.knots().knots().begin(), curve.knots().knots().end());
  for (double& k : knots) {
    const bool inside = old.contains(k);
    k = k == old.min ? domain.min : k == old.max ? domain.max : domain.min + (k - old.min) * scale;
    if (inside) k = std::clamp(k, domain.min, domain.max);
  }
  return {KnotVector(curve.degree(), std::move(knots)), curve.points(), curve.weights()};
}

#define TOILE_INSTANTIATE(Dim)                                                                 \
  template NurbsCurve<Dim> insert_knots(const NurbsCurve<Dim>&, std::span<const double>);      \
  template NurbsCurve<Dim> clamp(const NurbsCurve<Dim>&);                                      \
  template NurbsCurve<Dim> elevate_degree(const NurbsCurve<Dim>&, int);                        \
  template std::optional<NurbsCurve<Dim>> remove_knot(const NurbsCurve<Dim>&, double, double); \
  template std::vector<BezierCurve<Dim>> bezier_pieces(const NurbsCurve<Dim>&);                \
  template NurbsCurve<Dim> sub_curve(const NurbsCurve<Dim>&, Interval);                        \
  template NurbsCurve<Dim> reversed(const NurbsCurve<Dim>&);                                   \
  template NurbsCurve<Dim> with_domain(const NurbsCurve<Dim>&, Interval);
TOILE_INSTANTIATE(2)
TOILE_INSTANTIATE(3)
#undef TOILE_INSTANTIATE

}  // namespace toile
