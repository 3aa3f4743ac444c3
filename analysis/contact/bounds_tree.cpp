// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/contact/bounds_tree.h"

#include <numeric>
#include <string>

#include "geometry/error.h"
#include "geometry/finite.h"

namespace toile {

namespace {

void require_boxes(std::span<const Box> boxes) {
  bool good = true;  // which one isn't is asked only then
  for (const Box& box : boxes) good = good && box.min().allFinite() && box.max().allFinite() && !box.isEmpty();
  if (good) return;
  for (std::size_t k = 0; k < boxes.size(); ++k) {
    const std::string what = "a corner of box " + std::to_string(k);
    require_finite(boxes[k].min(), what.c_str());
    require_finite(boxes[k].max(), what.c_str());
    if (boxes[k].isEmpty()) throw GeometryError("box " + std::to_string(k) + " is inside out");
  }
}

}  // namespace

BoundsTree::BoundsTree(std::span<const Box> boxes) {
  require_boxes(boxes);
  order_.resize(boxes.size());
  std::iota(order_.begin(), order_.end(), 0);
  while ((static_cast<std::size_t>(most_in_slice) << depth_) < boxes.size()) ++depth_;
  // Each node of a level is parted at the middle, by place along the longest way between centres.
  for (int level = 0; level < depth_; ++level)
    for (int k = 0; k < 1 << level; ++k) {
      const auto begin = order_.begin() + at(level, k), end = order_.begin() + at(level, k + 1);
      Box centres;
      for (auto i = begin; i != end; ++i) centres.extend(boxes[*i].center());
      Eigen::Index axis = 0;
      centres.diagonal().maxCoeff(&axis);
      std::nth_element(begin, order_.begin() + at(level + 1, 2 * k + 1), end, [&](int a, int b) {
        return std::pair(boxes[a].center()[axis], a) < std::pair(boxes[b].center()[axis], b);
      });
    }
  boxes_.resize(boxes.size());
  nodes_.resize((std::size_t{2} << depth_) - 1);
  refit(boxes);
}

void BoundsTree::refit(std::span<const Box> boxes) {
  if (boxes.size() != order_.size())
    throw GeometryError("a tree of " + std::to_string(order_.size()) + " boxes can't take " +
                        std::to_string(boxes.size()));
  require_boxes(boxes);
  for (std::size_t i = 0; i < order_.size(); ++i) boxes_[i] = boxes[order_[i]];
  for (int node = static_cast<int>(nodes_.size()) - 1; node >= 0; --node) {
    if (!is_last(node)) {
      nodes_[node] = nodes_[2 * node + 1].merged(nodes_[2 * node + 2]);
      continue;
    }
    const auto [begin, end] = slice(node);
    Box box;
    for (int i = begin; i < end; ++i) box.extend(boxes_[i]);
    nodes_[node] = box;
  }
}

void BoundsTree::require_query(const Eigen::Vector3d& p, double reach) {
  require_finite(p, "the place asked about");
  if (std::isnan(reach)) require_finite(reach, "the reach of a query");
}

void BoundsTree::require_query(const Box& box, double gap) {
  require_boxes({&box, 1});
  require_finite(gap, "the gap of a query");
}

void BoundsTree::require_query(double gap) {
  require_finite(gap, "the gap of a query");
}

}  // namespace toile
