// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/continuation.h"

#include <algorithm>

#include "geometry/line_net.h"

namespace toile {
namespace {

using detail::LineNet;
using detail::Rows;

// Control points of the first span's polynomial for a first knot (p + 1 times) in place of the present one: its blossom
// at the knots between. [Ramshaw 1989]
LineNet with_first_knot(const LineNet& net, double knot) {
  const int p = net.knots.degree();
  std::vector<double> knots(net.knots.knots().begin(), net.knots.knots().end());
  std::fill_n(knots.begin(), p + 1, knot);
  Rows rows = net.rows;
  for (int i = 0; i < p; ++i) {
    Rows d = net.rows.topRows(p + 1);
    for (int r = 1; r <= p; ++r) {
      const double at = knots[static_cast<std::size_t>(i + r)];
      for (int k = p; k >= r; --k) {
        const double left = net.knots[k], right = net.knots[k + p - r + 1], share = (at - left) / (right - left);
        d.row(k) = ((1 - share) * d.row(k - 1) + share * d.row(k)).eval();
      }
    }
    rows.row(i) = d.row(p);
  }
  return {KnotVector(p, std::move(knots)), std::move(rows)};
}

// Run the other way.
LineNet turned(const LineNet& net) {
  std::vector<double> knots;
  for (auto k = net.knots.knots().rbegin(); k != net.knots.knots().rend(); ++k) knots.push_back(-*k);
  return {KnotVector(net.knots.degree(), std::move(knots)), net.rows.colwise().reverse()};
}

bool weights_positive(const Rows& rows) {
  for (Eigen::Index k = 3; k < rows.cols(); k += 4)
    if (!(rows.col(k).minCoeff() > 0)) return false;
  return true;
}

}  // namespace

std::optional<NurbsSurface> continued(const NurbsSurface& surface, Direction direction, Interval to) {
  LineNet net = detail::to_net(surface, direction);
  if (!net.knots.clamped()) net = detail::cut(std::move(net), net.knots.domain());
  const Interval own = net.knots.domain();
  if (to.min < own.min) net = with_first_knot(net, to.min);
  if (to.max > own.max) net = turned(with_first_knot(turned(net), -to.max));
  if (surface.rational() && !weights_positive(net.rows)) return std::nullopt;
  return detail::to_surface(std::move(net), surface, direction);
}

}  // namespace toile
