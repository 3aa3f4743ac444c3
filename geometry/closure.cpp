// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/closure.h"

#include <cmath>

namespace toile {
namespace {

int count(const NurbsSurface& surface, Direction d) {
  return d == Direction::u ? surface.count_u() : surface.count_v();
}

Direction other(Direction d) {
  return d == Direction::u ? Direction::v : Direction::u;
}

// Control point `i` across d, `k` along the line.
int at(const NurbsSurface& surface, Direction d, int i, int k) {
  return d == Direction::u ? surface.index(i, k) : surface.index(k, i);
}

bool weights_meet(const NurbsSurface& surface, Direction d) {
  constexpr double equal = 1e-10;
  const int last = count(surface, d) - 1;
  const auto ratio = [&](int k) {
    return surface.weight(at(surface, d, last, k)) / surface.weight(at(surface, d, 0, k));
  };
  for (int k = 1; k < count(surface, other(d)); ++k)
    if (!(std::abs(ratio(k) - ratio(0)) <= equal * ratio(0))) return false;
  return true;
}

}  // namespace

bool ends_meet(const NurbsSurface& surface, Direction d, double tolerance) {
  const int last = count(surface, d) - 1;
  for (int k = 0; k < count(surface, other(d)); ++k) {
    const Eigen::Vector3d gap =
        surface.points().col(at(surface, d, last, k)) - surface.points().col(at(surface, d, 0, k));
    if (!(gap.norm() <= tolerance)) return false;
  }
  return true;
}

Closure find_closure(const NurbsSurface& surface, double tolerance) {
  const auto closes = [&](Direction d) { return ends_meet(surface, d, tolerance) && weights_meet(surface, d); };
  return {closes(Direction::u), closes(Direction::v)};
}

NurbsSurface close_exactly(const NurbsSurface& surface, const Closure& closure) {
  if (!closure.any()) return surface;
  const std::vector<int> leader = seam_leaders(surface, closure);
  Eigen::Matrix3Xd points = surface.points();
  for (std::size_t k = 0; k < leader.size(); ++k)
    points.col(static_cast<Eigen::Index>(k)) = surface.points().col(leader[k]);
  return surface.with_points(std::move(points));
}

std::vector<int> seam_leaders(const NurbsSurface& surface, const Closure& closure) {
  const int nu = surface.count_u(), nv = surface.count_v();
  std::vector<int> leader;
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i)
      leader.push_back(surface.index(closure.u && i == nu - 1 ? 0 : i, closure.v && j == nv - 1 ? 0 : j));
  return leader;
}

bool collapsed(const NurbsSurface& surface, Direction d, int end, double tolerance) {
  const int line = end == 0 ? 0 : count(surface, d) - 1;
  const Eigen::Vector3d first = surface.points().col(at(surface, d, line, 0));
  for (int k = 1; k < count(surface, other(d)); ++k)
    if (!((surface.points().col(at(surface, d, line, k)) - first).norm() <= tolerance)) return false;
  return true;
}

}  // namespace toile
