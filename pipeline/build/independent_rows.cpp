// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/build/independent_rows.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <queue>

namespace toile {
namespace {

// Part of a row's inertia that rows before it must leave free for the row to be taken: less would hold little that
// others don't, and solve badly. What the scene asks for by name is held down to what can be solved at all.
constexpr double smallest_place_pivot = 1e-3, smallest_curve_pivot = 0.2;

struct Entry {
  int index;
  double value;
};
using Entries = std::vector<Entry>;

// L of the rows taken so far, G = L L^T, grown row by row.
class TakenRows {
 public:
  explicit TakenRows(Eigen::Index nodes) : by_node_(static_cast<std::size_t>(nodes)) {}

  // A row of unit length, by node: taken where at least `least` of its square is left.
  bool take(const Entries& row, double least) {
    for (const Entry& at : row) {
      for (const Entry& other : by_node_[static_cast<std::size_t>(at.index)]) add(other.index, at.value * other.value);
    }
    // L y = g, ascending.
    double left = 1;
    solved_.clear();
    while (!next_.empty()) {
      const int j = next_.top();
      next_.pop();
      const auto& column = columns_[static_cast<std::size_t>(j)];
      const double y = work_[static_cast<std::size_t>(j)] / diagonal_[static_cast<std::size_t>(j)];
      work_[static_cast<std::size_t>(j)] = 0;
      waits_[static_cast<std::size_t>(j)] = false;
      if (left < least) continue;  // what others have only grows
      left -= y * y;
      solved_.push_back({j, y});
      for (const Entry& below : column) add(below.index, -below.value * y);
    }
    if (left < least) return false;
    const int own = static_cast<int>(columns_.size());
    for (const Entry& y : solved_) columns_[static_cast<std::size_t>(y.index)].push_back({own, y.value});
    for (const Entry& at : row) by_node_[static_cast<std::size_t>(at.index)].push_back({own, at.value});
    columns_.emplace_back();
    diagonal_.push_back(std::sqrt(left));
    work_.push_back(0);
    waits_.push_back(false);
    return true;
  }
  bool full() const { return columns_.size() == by_node_.size(); }

 private:
  void add(int j, double value) {
    work_[static_cast<std::size_t>(j)] += value;
    if (waits_[static_cast<std::size_t>(j)]) return;
    waits_[static_cast<std::size_t>(j)] = true;
    next_.push(j);
  }

  std::vector<Entries> by_node_;  // of each node the taken rows
  std::vector<Entries> columns_;  // of L, below the diagonal
  std::vector<double> diagonal_;
  // Working memory.
  std::vector<double> work_;
  std::vector<bool> waits_;
  std::priority_queue<int, std::vector<int>, std::greater<>> next_;
  Entries solved_;
};

}  // namespace

std::vector<bool> independent(const std::vector<Candidate>& candidates, const AffineMap& map,
                              const Eigen::VectorXd& mass, int axis) {
  std::vector<bool> taken(candidates.size(), false);
  if (candidates.empty() || mass.size() == 0) return taken;  // no place, or nothing left free
  const Eigen::VectorXd weight = mass.cwiseInverse().cwiseSqrt();
  // A row that touches fixed control points only holds nothing new.
  const double least_length = 1e-9 * weight.minCoeff();
  TakenRows rows(mass.size());
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(mass.size());
  Entries row;
  for (const bool required : {true, false}) {
    for (std::size_t k = 0; k < candidates.size() && !rows.full(); ++k) {
      if (candidates[k].required != required || candidates[k].axes[axis] == 0) continue;
      const ScalarRow& places = candidates[k].row;
      row.clear();
      for (std::size_t a = 0; a < places.index.size(); ++a) {
        for (AffineMap::Matrix::InnerIterator it(map.free_part(), places.index[a]); it; ++it) {
          if (sum[it.col()] == 0) row.push_back({static_cast<int>(it.col()), 0});
          sum[it.col()] += places.value[a] * it.value() * weight[it.col()];
        }
      }
      double squared = 0;
      for (Entry& at : row) {
        at.value = sum[at.index];  // 0 where it is listed twice
        sum[at.index] = 0;
        squared += at.value * at.value;
      }
      const double length = std::sqrt(squared);
      if (!(length > least_length)) continue;
      for (Entry& at : row) at.value /= length;
      taken[k] = rows.take(row, required ? smallest_place_pivot : smallest_curve_pivot);
    }
  }
  return taken;
}

std::vector<Eigen::Vector3d> independent_axes(const std::vector<Candidate>& candidates, const AffineMap& map,
                                              const Eigen::VectorXd& mass) {
  const bool alike =
      std::ranges::all_of(candidates, [](const Candidate& c) { return c.axes == c.axes[0] * Eigen::Vector3d::Ones(); });
  std::vector<Eigen::Vector3d> out(candidates.size(), Eigen::Vector3d::Zero());
  for (int axis = 0; axis < (alike ? 1 : 3); ++axis) {
    const std::vector<bool> taken = independent(candidates, map, mass, axis);
    for (std::size_t k = 0; k < out.size(); ++k) {
      if (taken[k] && alike) out[k].setOnes();
      if (taken[k]) out[k][axis] = 1;
    }
  }
  return out;
}

}  // namespace toile
