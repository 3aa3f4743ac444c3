// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/map/smooth_seam.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace toile {
namespace {

constexpr double equal_ratio = 1e-9;    // of weights along the seam
constexpr double largest_uneven = 1e3;  // of the two neighbours' distances from the seam

// A net seen across direction d: control point `i` across, `line` along the seam.
struct Across {
  const NurbsSurface& surface;
  Direction d;
  int count() const { return d == Direction::u ? surface.count_u() : surface.count_v(); }
  int lines() const { return d == Direction::u ? surface.count_v() : surface.count_u(); }
  int at(int i, int line) const { return d == Direction::u ? surface.index(i, line) : surface.index(line, i); }
  Eigen::Vector3d point(int i, int line) const { return surface.points().col(at(i, line)); }
  double weight(int i, int line) const { return surface.weight(at(i, line)); }
};

// c of P0 - P' = c (P1 - P0) on all lines, where it is one number.
std::optional<double> ratio_across(const Across& net, double tolerance) {
  const int n = net.count();
  if (n < 4) return std::nullopt;
  double before_after = 0, after_after = 0;
  for (int line = 0; line < net.lines(); ++line) {
    const Eigen::Vector3d after = net.point(1, line) - net.point(0, line);
    before_after += after.dot(net.point(0, line) - net.point(n - 2, line));
    after_after += after.squaredNorm();
    for (const int beside : {1, n - 2}) {
      const double here = net.weight(beside, line) * net.weight(0, 0),
                   first = net.weight(beside, 0) * net.weight(0, line);
      if (!(std::abs(here - first) <= equal_ratio * first)) return std::nullopt;
    }
  }
  const double c = before_after / after_after;
  if (!(c > 1 / largest_uneven && c < largest_uneven)) return std::nullopt;
  for (int line = 0; line < net.lines(); ++line) {
    const Eigen::Vector3d between = (c * net.point(1, line) + net.point(n - 2, line)) / (1 + c);
    if (!((between - net.point(0, line)).norm() <= tolerance)) return std::nullopt;
  }
  return c;
}

bool independent(const AffineMap::Matrix& dependence, int row) {
  AffineMap::Matrix::InnerIterator entry(dependence, row);
  if (!entry || entry.col() != row || entry.value() != 1) return false;
  return !++entry;
}

}  // namespace

bool SmoothSeams::any() const {
  return std::ranges::find(u, true) != u.end() || std::ranges::find(v, true) != v.end();
}

bool SmoothSeams::follows(const NurbsSurface& surface, int control_point) const {
  const int i = control_point % surface.count_u(), j = control_point / surface.count_u();
  const auto on_seam = [](int k, int n) { return k == 0 || k == n - 1; };
  return (!u.empty() && on_seam(i, surface.count_u()) && u[static_cast<std::size_t>(j)]) ||
         (!v.empty() && on_seam(j, surface.count_v()) && v[static_cast<std::size_t>(i)]);
}

bool SmoothSeams::at(const NurbsSurface& surface, Direction d, double at) const {
  const std::vector<bool>& lines = d == Direction::u ? u : v;
  if (lines.empty()) return false;
  const KnotVector& along = surface.knots(d == Direction::u ? Direction::v : Direction::u);
  const int span = along.find_span(at);
  for (int k = span - along.degree(); k <= span; ++k)
    if (!lines[static_cast<std::size_t>(k)]) return false;
  return true;
}

SmoothSeams tie_smooth_seams(const NurbsSurface& rest, const Closure& closure, double tolerance,
                             AffineMap::Matrix& dependence) {
  SmoothSeams seams;
  for (const Direction d : {Direction::u, Direction::v}) {
    const Across net{rest, d};
    const auto c = closure.in(d) ? ratio_across(net, tolerance) : std::nullopt;
    if (!c) continue;
    std::vector<bool>& smooth = d == Direction::u ? seams.u : seams.v;
    smooth.assign(static_cast<std::size_t>(net.lines()), false);
    AffineMap::Matrix tie = AffineMap::identity(static_cast<int>(rest.points().cols()));
    for (int line = 0; line < net.lines(); ++line) {
      const int seam = net.at(0, line), after = net.at(1, line), before = net.at(net.count() - 2, line);
      const bool other_seam = closure.in(d == Direction::u ? Direction::v : Direction::u);
      if (other_seam && line == net.lines() - 1) {
        smooth.back() = smooth.front();
        continue;
      }
      // Where the seams of a surface closed both ways meet, the first of them has tied this one through its neighbours.
      if (d == Direction::v && line == 0 && !seams.u.empty() && seams.u.front()) {
        smooth[0] = true;
        continue;
      }
      if (!independent(dependence, seam) || !independent(dependence, after) || !independent(dependence, before))
        continue;
      smooth[static_cast<std::size_t>(line)] = true;
      tie.coeffRef(seam, seam) = 0;
      tie.coeffRef(seam, after) = *c / (1 + *c);
      tie.coeffRef(seam, before) = 1 / (1 + *c);
    }
    tie.prune(0.0);
    dependence = AffineMap::Matrix(dependence * tie);
  }
  return seams;
}

}  // namespace toile
