// SPDX-License-Identifier: GPL-3.0-or-later
// Boxes in a tree: which of them meet, which is nearest.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace toile {

using Box = Eigen::AlignedBox3d;  // m

// Whether two boxes are within `gap` of each other along every axis: so are all things in them that are within `gap`.
inline bool within(const Box& a, const Box& b, double gap) {
  return ((a.min() - b.max()).array() <= gap).all() && ((b.min() - a.max()).array() <= gap).all();
}

// A binary tree over boxes, built once; its nodes hold what lies below them, also after a refit.
//   (1) A query finds what a search of all boxes finds.
//   (2) The order of what is found depends on the boxes that the tree was built of, and on nothing else.
//   (3) Numbers are finite: boxes and places that aren't, and boxes turned inside out, throw GeometryError and leave
//       the tree as it was. Boxes without extent are as good as any.
// Queries may come from several threads. "Box k" is the k-th of those given.
class BoundsTree {
 public:
  BoundsTree() = default;
  explicit BoundsTree(std::span<const Box> boxes);

  // The same number of boxes, changed: as far as they keep their neighbours, queries keep their speed.
  void refit(std::span<const Box> boxes);

  int size() const { return static_cast<int>(order_.size()); }

  // found(k) for each box within `gap` of `box`.
  template <class Found>
  void meeting(const Box& box, double gap, const Found& found) const;

  struct Nearest {
    int box = 0;
    double distance_squared = 0;  // m2
  };
  // The k of least distance_squared(k), the squared distance of p from what box k bounds; of those that tie one that
  // depends on (2) alone. Unset where all are farther than `reach` [m],
  // which may be infinite.
  template <class DistanceSquared>
  std::optional<Nearest> nearest(const Eigen::Vector3d& p, double reach, const DistanceSquared& distance_squared) const;

  // found(j, k) with j < k for each two boxes here within `gap` of each other, once.
  template <class Found>
  void own_pairs(double gap, const Found& found) const;

 private:
  // Node i has the children 2 i + 1 and 2 i + 2; the last level, of 2^depth nodes, holds slices of `order_`.
  static constexpr int most_in_slice = 4;
  static constexpr int most_open = 128;  // nodes that wait in a walk: at most three a level of two trees

  int first_of_last_level() const { return (1 << depth_) - 1; }
  bool is_last(int node) const { return node >= first_of_last_level(); }
  int at(int level, int k) const { return static_cast<int>((static_cast<long>(size()) * k) >> level); }
  std::pair<int, int> slice(int node) const {
    const int k = node - first_of_last_level();
    return {at(depth_, k), at(depth_, k + 1)};
  }
  static double distance_squared(const Box& box, const Eigen::Vector3d& p) {
    return (box.min() - p).cwiseMax(p - box.max()).cwiseMax(0).squaredNorm();
  }
  static void require_query(const Eigen::Vector3d& p, double reach);
  static void require_query(const Box& box, double gap);
  static void require_query(double gap);

  int depth_ = 0;
  std::vector<int> order_;  // of boxes, neighbours together
  std::vector<Box> boxes_;  // in that order
  std::vector<Box> nodes_{Box()};
};

template <class Found>
void BoundsTree::meeting(const Box& box, double gap, const Found& found) const {
  require_query(box, gap);
  std::array<int, most_open> open;
  int count = 0;
  open[count++] = 0;
  while (count > 0) {
    const int node = open[--count];
    if (!within(nodes_[node], box, gap)) continue;
    if (!is_last(node)) {
      open[count++] = 2 * node + 2;
      open[count++] = 2 * node + 1;
      continue;
    }
    const auto [begin, end] = slice(node);
    for (int i = begin; i < end; ++i)
      if (within(boxes_[i], box, gap)) found(order_[i]);
  }
}

template <class DistanceSquared>
std::optional<BoundsTree::Nearest> BoundsTree::nearest(const Eigen::Vector3d& p, double reach,
                                                       const DistanceSquared& distance_squared_of) const {
  require_query(p, reach);
  if (order_.empty() || reach < 0) return std::nullopt;
  Nearest best{-1, reach * reach};
  std::array<std::pair<int, double>, most_open> open;
  int count = 0;
  open[count++] = {0, distance_squared(nodes_[0], p)};
  while (count > 0) {
    const auto [node, from] = open[--count];
    if (from > best.distance_squared) continue;
    if (!is_last(node)) {
      std::pair<int, double> near{2 * node + 1, distance_squared(nodes_[2 * node + 1], p)};
      std::pair<int, double> far{2 * node + 2, distance_squared(nodes_[2 * node + 2], p)};
      if (far.second < near.second) std::swap(near, far);
      open[count++] = far;
      open[count++] = near;
      continue;
    }
    const auto [begin, end] = slice(node);
    for (int i = begin; i < end; ++i) {
      if (distance_squared(boxes_[i], p) > best.distance_squared) continue;
      const double d = distance_squared_of(order_[i]);
      if (d < best.distance_squared || (d == best.distance_squared && best.box < 0)) best = {order_[i], d};
    }
  }
  if (best.box < 0) return std::nullopt;
  return best;
}

template <class Found>
void BoundsTree::own_pairs(double gap, const Found& found) const {
  require_query(gap);
  const auto say = [&](int i, int j) {
    if (within(boxes_[i], boxes_[j], gap)) found(std::min(order_[i], order_[j]), std::max(order_[i], order_[j]));
  };
  std::array<std::pair<int, int>, most_open> open;
  int count = 0;
  open[count++] = {0, 0};
  while (count > 0) {
    const auto [a, b] = open[--count];
    if (!within(nodes_[a], nodes_[b], gap)) continue;
    if (is_last(a)) {
      const auto [begin, end] = slice(a);
      const auto [other_begin, other_end] = slice(b);
      for (int i = begin; i < end; ++i)
        for (int j = a == b ? i + 1 : other_begin; j < other_end; ++j) say(i, j);
    } else if (a == b) {
      open[count++] = {2 * a + 2, 2 * a + 2};
      open[count++] = {2 * a + 1, 2 * a + 2};
      open[count++] = {2 * a + 1, 2 * a + 1};
    } else {
      // Both lie on one level: parted at once they stay so.
      for (const int i : {2, 1})
        for (const int j : {2, 1}) open[count++] = {2 * a + i, 2 * b + j};
    }
  }
}

}  // namespace toile
