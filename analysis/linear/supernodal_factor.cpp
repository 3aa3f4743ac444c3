// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/linear/supernodal_factor.h"

#include <algorithm>
#include <queue>
#include <utility>

#include "analysis/linear/dense_kernels.h"
#include "analysis/linear/pack.h"

namespace toile {
namespace {

constexpr int group_count = 4;
constexpr int together = 4;  // columns of a supernode in a solve, so that its rows are read a quarter as often
constexpr int wide = 64;     // updates from here on are shared out

// Which group each supernode belongs to, -1: the top. Heavy subtrees are parted into their root, which goes to the top,
// and what hangs on it; then the heaviest goes to the group that has least.
std::vector<int> group(const std::vector<int>& parent, const std::vector<double>& weight) {
  const int n = static_cast<int>(parent.size());
  std::vector<double> subtree = weight;
  std::vector<std::vector<int>> children(static_cast<std::size_t>(n));
  std::priority_queue<std::pair<double, int>> open;
  double total = 0;
  for (int s = 0; s < n; ++s) {
    total += weight[s];
    if (parent[s] >= 0) {
      subtree[parent[s]] += subtree[s];
      children[parent[s]].push_back(s);
    } else {
      open.emplace(subtree[s], s);
    }
  }
  std::vector<int> out(static_cast<std::size_t>(n), -1);
  while (!open.empty() && open.top().first > total / (2 * group_count)) {
    const int root = open.top().second;
    open.pop();
    for (const int child : children[root]) open.emplace(subtree[child], child);
  }
  std::vector<double> load(group_count, 0.0);
  for (; !open.empty(); open.pop()) {
    const auto least = std::min_element(load.begin(), load.end());
    out[open.top().second] = static_cast<int>(least - load.begin());
    *least += open.top().first;
  }
  for (int s = n - 1; s >= 0; --s)
    if (out[s] < 0 && parent[s] >= 0) out[s] = out[parent[s]];
  return out;
}

}  // namespace

SupernodalFactor::SupernodalFactor(const SupernodalShape& shape, std::span<const int> column_start,
                                   std::span<const int> row)
    : groups_(group_count), row_(shape.row), order_(shape.order) {
  const int n = static_cast<int>(order_.size()), count = static_cast<int>(shape.first_column.size()) - 1;
  std::vector<int> node_of(static_cast<std::size_t>(n)), parent;
  std::vector<double> weight;
  std::ptrdiff_t size = 0;
  for (int s = 0; s < count; ++s) {
    Node node;
    node.column = shape.first_column[s];
    node.columns = shape.first_column[s + 1] - node.column;
    node.first_row = shape.row_start[s];
    node.rows = shape.row_start[s + 1] - shape.row_start[s];
    node.values = size;
    size += static_cast<std::ptrdiff_t>(node.columns) * node.rows;
    std::fill_n(node_of.begin() + node.column, node.columns, s);
    weight.push_back(static_cast<double>(node.columns) * node.rows);
    nodes_.push_back(std::move(node));
  }
  factor_.resize(static_cast<std::size_t>(size) + overread);
  const auto rows_of = [&](const Node& node) {
    return std::span<const int>(row_).subspan(static_cast<std::size_t>(node.first_row), node.rows);
  };
  const auto place_in = [&](const Node& node, int r) {
    const auto rows = rows_of(node);
    return static_cast<int>(std::lower_bound(rows.begin(), rows.end(), r) - rows.begin());
  };
  relative_.assign(row_.size(), 0);
  for (int s = 0; s < count; ++s) {
    Node& node = nodes_[s];
    if (node.below() > 0) node.parent = node_of[rows_of(node)[node.columns]];
    parent.push_back(node.parent);
    if (node.parent < 0) continue;
    nodes_[node.parent].children.push_back(s);
    for (int i = node.columns; i < node.rows; ++i)
      relative_[node.first_row + i] = place_in(nodes_[node.parent], row_[node.first_row + i]);
  }

  // Entries of A by the node that takes them.
  std::vector<int> place(static_cast<std::size_t>(n));
  for (int k = 0; k < n; ++k) place[order_[k]] = k;
  const auto column_of = [&](int e, int c) { return std::minmax(place[c], place[row[e]]); };
  for (int c = 0; c < n; ++c)
    for (int e = column_start[c]; e < column_start[c + 1]; ++e) ++nodes_[node_of[column_of(e, c).first]].entries;
  std::ptrdiff_t entries = 0;
  for (Node& node : nodes_) {
    node.first_entry = entries;
    entries += std::exchange(node.entries, 0);
  }
  entries_.resize(static_cast<std::size_t>(entries));
  for (int c = 0; c < n; ++c)
    for (int e = column_start[c]; e < column_start[c + 1]; ++e) {
      const auto [column, r] = column_of(e, c);
      Node& node = nodes_[node_of[column]];
      const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(column - node.column) * node.rows + place_in(node, r);
      entries_[node.first_entry + node.entries++] = {e, node.values + at};
    }

  const std::vector<int> group_of = group(parent, weight);
  std::vector<int> top_index(static_cast<std::size_t>(n), -1);
  for (int s = 0; s < count; ++s) {
    Node& node = nodes_[s];
    node.group = group_of[s];
    part_of(node).nodes.push_back(s);
    for (int c = node.column; node.group < 0 && c < node.column + node.columns; ++c) {
      top_index[c] = static_cast<int>(top_columns_.size());
      top_columns_.push_back(c);
    }
  }
  target_ = row_;
  for (const Node& node : nodes_)
    for (std::ptrdiff_t k = node.first_row; node.group >= 0 && k < node.first_row + node.rows; ++k)
      if (const int index = top_index[row_[k]]; index >= 0)
        target_[k] = n + node.group * static_cast<int>(top_columns_.size()) + index;
  work_.resize(static_cast<std::size_t>(n) + group_count * top_columns_.size());
  for (Part& part : groups_) lay_out_stack(part);
  lay_out_stack(top_);
}

// Updates live on a stack from their node to its parent. Those that the top takes from a group stay there.
void SupernodalFactor::lay_out_stack(Part& part) {
  std::ptrdiff_t used = 0, most = 0;
  std::size_t largest = 0, longest = 0;
  for (const int s : part.nodes) {
    Node& node = nodes_[s];
    const auto size = [](const Node& x) { return static_cast<std::ptrdiff_t>(x.below()) * x.below(); };
    for (const int child : node.children)
      if (nodes_[child].group == node.group) used -= size(nodes_[child]);
    node.update = used;
    used += size(node);
    most = std::max(most, used);
    largest = std::max(largest, static_cast<std::size_t>(size(node)));
    longest = std::max(longest, static_cast<std::size_t>(node.rows));
  }
  part.stack.resize(static_cast<std::size_t>(most) + overread);
  part.front.resize(largest + overread);
  part.column.resize(longest);
}

// Adds a child's update to the node's columns and to its own update.
void SupernodalFactor::add_update(const Node& child, const Node& node, double* front) {
  const int m = child.below(), below = node.below();
  const double* update = part_of(child).stack.data() + child.update;
  const int* const to = relative_.data() + child.first_row + child.columns;
  for (int c = 0; c < m; ++c, update += m) {
    double* const into = to[c] < node.columns
                             ? factor_.data() + node.values + static_cast<std::ptrdiff_t>(to[c]) * node.rows
                             : front + static_cast<std::ptrdiff_t>(to[c] - node.columns) * below - node.columns;
    for (int r = c; r < m; ++r) into[to[r]] += update[r];
  }
}

bool SupernodalFactor::eliminate(Part& part, Node& node, std::span<const double> values, Workers* workers) {
  const int below = node.below();
  double* const own = factor_.data() + node.values;
  std::fill_n(own, static_cast<std::ptrdiff_t>(node.columns) * node.rows, 0.0);
  for (std::ptrdiff_t k = node.first_entry; k < node.first_entry + node.entries; ++k)
    factor_[entries_[k].place] += values[entries_[k].value];
  for (int c = 0; c < below; ++c)  // the lower triangle
    std::fill_n(part.front.data() + static_cast<std::ptrdiff_t>(c) * below + c, below - c, 0.0);
  for (const int child : node.children) add_update(nodes_[child], node, part.front.data());

  if (!factorise_columns(own, node.rows, node.rows, node.columns)) return false;
  const double* const under = own + node.columns;
  double* const update = part.stack.data() + node.update;
  const int blocks = (below + tile_columns - 1) / tile_columns;
  share_out(below >= wide ? workers : nullptr, blocks, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const int from = tile_columns * k;
      const std::ptrdiff_t corner = static_cast<std::ptrdiff_t>(from) * below + from;
      minus_product(part.front.data() + corner, update + corner, below, below, under + from, under + from, node.rows,
                    node.columns, below - from, std::min(tile_columns, below - from));
    }
  });
  return true;
}

bool SupernodalFactor::factorise(std::span<const double> values, Workers* workers) {
  const auto eliminate_all = [&](Part& part, Workers* within) {
    part.positive = true;
    for (const int s : part.nodes)
      if (!eliminate(part, nodes_[s], values, within)) {
        part.positive = false;
        return;
      }
  };
  share_out(workers, group_count, [&](int begin, int end) {
    for (int g = begin; g < end; ++g) eliminate_all(groups_[g], nullptr);
  });
  for (const Part& part : groups_)
    if (!part.positive) return false;
  eliminate_all(top_, workers);
  return top_.positive;
}

// x = L_ss^-1 of the node's part of the vector; the rows below take L x from theirs.
void SupernodalFactor::forward(const Node& node, double* scratch) {
  const int rows = node.rows;
  double* const own = work_.data() + node.column;
  std::copy_n(own, node.columns, scratch);
  std::fill(scratch + node.columns, scratch + rows, 0.0);
  const auto column = [&](int j) { return factor_.data() + node.values + static_cast<std::ptrdiff_t>(j) * rows; };
  for (int j = 0; j < node.columns; j += together) {
    const int end = std::min(j + together, node.columns);
    for (int a = j; a < end; ++a) {
      for (int b = j; b < a; ++b) scratch[a] -= column(b)[a] * scratch[b];
      scratch[a] /= column(a)[a];
    }
    if (end - j == together) {
      const double *l0 = column(j), *l1 = column(j + 1), *l2 = column(j + 2), *l3 = column(j + 3);
      const double x0 = scratch[j], x1 = scratch[j + 1], x2 = scratch[j + 2], x3 = scratch[j + 3];
      for (int i = end; i < rows; ++i) scratch[i] -= (l0[i] * x0 + l1[i] * x1) + (l2[i] * x2 + l3[i] * x3);
    } else {
      for (int a = j; a < end; ++a) {
        const double* const l = column(a);
        for (int i = end; i < rows; ++i) scratch[i] -= l[i] * scratch[a];
      }
    }
  }
  std::copy_n(scratch, node.columns, own);
  const int* const target = target_.data() + node.first_row;
  for (int i = node.columns; i < rows; ++i) work_[target[i]] += scratch[i];
}

// The node's part of the vector, once that of the rows below is known.
void SupernodalFactor::backward(const Node& node, double* scratch) {
  const int rows = node.rows;
  double* const own = work_.data() + node.column;
  const int* const row = row_.data() + node.first_row;
  std::copy_n(own, node.columns, scratch);
  for (int i = node.columns; i < rows; ++i) scratch[i] = work_[row[i]];
  const auto column = [&](int j) { return factor_.data() + node.values + static_cast<std::ptrdiff_t>(j) * rows; };
  for (int j = (node.columns - 1) / together * together; j >= 0; j -= together) {
    const int end = std::min(j + together, node.columns);
    if (end - j == together) {
      const double *l0 = column(j), *l1 = column(j + 1), *l2 = column(j + 2), *l3 = column(j + 3);
      Pack s0{}, s1{}, s2{}, s3{};
      int i = end;
      for (; i + pack_lanes <= rows; i += pack_lanes) {
        const Pack x = load_pack(scratch + i);
        s0.add_product(x, load_pack(l0 + i)), s1.add_product(x, load_pack(l1 + i));
        s2.add_product(x, load_pack(l2 + i)), s3.add_product(x, load_pack(l3 + i));
      }
      double t0 = sum(s0), t1 = sum(s1), t2 = sum(s2), t3 = sum(s3);
      for (; i < rows; ++i) {
        const double x = scratch[i];
        t0 += l0[i] * x, t1 += l1[i] * x, t2 += l2[i] * x, t3 += l3[i] * x;
      }
      scratch[j] -= t0, scratch[j + 1] -= t1, scratch[j + 2] -= t2, scratch[j + 3] -= t3;
    } else {
      for (int a = j; a < end; ++a)
        for (int i = end; i < rows; ++i) scratch[a] -= column(a)[i] * scratch[i];
    }
    for (int a = end - 1; a >= j; --a) {
      for (int b = a + 1; b < end; ++b) scratch[a] -= column(a)[b] * scratch[b];
      scratch[a] /= column(a)[a];
    }
  }
  std::copy_n(scratch, node.columns, own);
}

void SupernodalFactor::solve(const Eigen::Ref<const Eigen::VectorXd>& rhs, Eigen::Ref<Eigen::VectorXd> x,
                             Workers* workers) {
  const std::size_t n = order_.size(), top = top_columns_.size();
  for (std::size_t k = 0; k < n; ++k) work_[k] = rhs[order_[k]];
  std::fill(work_.begin() + static_cast<std::ptrdiff_t>(n), work_.end(), 0.0);
  share_out(workers, group_count, [&](int begin, int end) {
    for (int g = begin; g < end; ++g)
      for (const int s : groups_[g].nodes) forward(nodes_[s], groups_[g].column.data());
  });
  for (std::size_t g = 0; g < group_count; ++g)
    for (std::size_t k = 0; k < top; ++k) work_[top_columns_[k]] += work_[n + g * top + k];
  for (const int s : top_.nodes) forward(nodes_[s], top_.column.data());
  for (std::size_t k = top_.nodes.size(); k-- > 0;) backward(nodes_[top_.nodes[k]], top_.column.data());
  share_out(workers, group_count, [&](int begin, int end) {
    for (int g = begin; g < end; ++g)
      for (std::size_t k = groups_[g].nodes.size(); k-- > 0;)
        backward(nodes_[groups_[g].nodes[k]], groups_[g].column.data());
  });
  for (std::size_t k = 0; k < n; ++k) x[order_[k]] = work_[k];
}

}  // namespace toile
