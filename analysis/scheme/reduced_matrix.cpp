// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/scheme/reduced_matrix.h"

#include <algorithm>
#include <utility>

namespace toile {
namespace {

// Nodes and weights of a point.
std::vector<std::pair<int, double>> nodes_of(const AffineMap& map, int point) {
  std::vector<std::pair<int, double>> out;
  for (AffineMap::Matrix::InnerIterator e(map.free_part(), point); e; ++e)
    out.emplace_back(static_cast<int>(e.col()), e.value());
  return out;
}

BlockPattern over_nodes(const BlockPattern& points, const AffineMap& map) {
  std::vector<std::vector<int>> groups;
  for (int column = 0; column < points.points(); ++column)
    for (const int row : points.rows(column)) {
      std::vector<int> group;
      for (const int p : {column, row})
        for (const auto& [node, weight] : nodes_of(map, p)) group.push_back(node);
      if (group.size() > 1) groups.push_back(std::move(group));
    }
  return BlockPattern(map.nodes(), groups);
}

}  // namespace

ReducedMatrix::ReducedMatrix(const BlockPattern& points, const AffineMap& map) : pattern_(over_nodes(points, map)) {
  for (int column = 0; column < points.points(); ++column)
    for (const int row : points.rows(column)) {
      const int slot = points.slot(row, column);
      for (const auto& [a, weight_a] : nodes_of(map, row))
        for (const auto& [b, weight_b] : nodes_of(map, column)) {
          // The block of (row, column) goes to (a, b), that of (column, row), its transpose, to (b, a).
          if (row == column && a < b) continue;
          Term term{slot, pattern_.slot(std::max(a, b), std::min(a, b)), weight_a * weight_b, a < b};
          term.both = row != column && a == b;
          term.own = row == column;
          terms_.push_back(term);
        }
    }
}

void ReducedMatrix::reduce(const BlockMatrix& points, BlockMatrix& out) const {
  out.set_zero();
  for (const Term& term : terms_) {
    const double* const from = points.block(term.from);
    double* const to = out.block(term.to);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) {
        const double straight = from[3 * r + c], across = from[3 * c + r];
        const double value = term.own          ? (r < c ? across : straight)
                             : term.both       ? straight + across
                             : term.transposed ? across
                                               : straight;
        to[3 * r + c] += term.weight * value;
      }
  }
}

}  // namespace toile
