// SPDX-License-Identifier: GPL-3.0-or-later
// Sparse Cholesky by supernodes, multifrontal, factor and solves on several threads: subtrees of the elimination tree
// don't meet before their common ancestors. [Duff & Reid 1983; Liu 1992]
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "analysis/parallel/workers.h"

namespace toile {

// Where L of P A P^T = L L^T has entries. Supernode s: columns first_column[s] to first_column[s+1]; its rows
// row[row_start[s]] to row[row_start[s+1]], ascending, its own columns first. Row k of the factor is row order[k] of A.
// Supernodes in postorder of their tree, in which a parent holds the first row below a node's own columns.
struct SupernodalShape {
  std::vector<int> first_column, row_start, row, order;
};

// What is done together, and in which order, follows from the shape alone: no bit depends on the number of threads.
class SupernodalFactor {
 public:
  // `column_start`, `row`: the lower triangle of A, compressed columns.
  SupernodalFactor(const SupernodalShape& shape, std::span<const int> column_start, std::span<const int> row);

  // False where a pivot is not positive.
  bool factorise(std::span<const double> values, Workers* workers);
  void solve(const Eigen::Ref<const Eigen::VectorXd>& rhs, Eigen::Ref<Eigen::VectorXd> x, Workers* workers);

 private:
  struct Node {
    int column = 0, columns = 0, rows = 0;  // first, how many
    int parent = -1, group = -1;            // -1: a root; common ancestors of the groups, the top
    std::ptrdiff_t first_row = 0;           // in row_, target_, relative_
    std::ptrdiff_t values = 0;              // in factor_: dense, column by column, all rows of a column
    std::ptrdiff_t first_entry = 0, entries = 0;
    std::ptrdiff_t update = 0;  // in its group's stack: what it takes from the rows below, dense, lower triangle
    std::vector<int> children;
    int below() const { return rows - columns; }
  };
  // An entry of A and its place in factor_.
  struct Entry {
    int value = 0;
    std::ptrdiff_t place = 0;
  };
  // Of a group or the top.
  struct Part {
    std::vector<int> nodes;
    std::vector<double> stack, front, column;
    bool positive = true;
  };

  void lay_out_stack(Part& part);
  bool eliminate(Part& part, Node& node, std::span<const double> values, Workers* workers);
  void add_update(const Node& child, const Node& node, double* front);
  void forward(const Node& node, double* scratch);
  void backward(const Node& node, double* scratch);
  Part& part_of(const Node& node) { return node.group < 0 ? top_ : groups_[static_cast<std::size_t>(node.group)]; }

  std::vector<Node> nodes_;
  std::vector<Part> groups_;  // of whole subtrees
  Part top_;
  std::vector<int> top_columns_;
  std::vector<int> row_, relative_;  // relative_: which row of the parent it is
  std::vector<int> target_;          // where in work_ what a row takes is summed
  std::vector<int> order_;
  std::vector<Entry> entries_;
  std::vector<double> factor_;
  std::vector<double> work_;  // the vector, then what each group takes from the top's columns
};

}  // namespace toile
