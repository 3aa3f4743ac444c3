// SPDX-License-Identifier: GPL-3.0-or-later
// Strain rows as springs that act on nodes while the rest pushes them evenly: what Substeps spends its time in.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "analysis/constraint/composed_rows.h"
#include "analysis/parallel/workers.h"

namespace toile {

// Strains from `low` to `high` meet no force.
struct Slack {
  double low = 0, high = 0;
  double excess(double strain) const {
    const double above = strain < low ? low : strain;  // no branches: signs of strain are hard to predict
    return strain - (above > high ? high : above);
  }
};

// One node's or fixed control point's numbers within a kernel: components `stride` apart.
struct KernelPoint {
  double* x = nullptr;
  double* v = nullptr;
  double* a = nullptr;
  std::ptrdiff_t stride = 0;
};

// Rows r of a kernel: y = D x, C = (y.y - 1) / 2, e = excess(C), force -D^T y k (e + damping (e - e of the last
// advance)).
class RowKernel {
 public:
  virtual ~RowKernel() = default;
  // Where the kernel keeps the position, velocity and acceleration by all other forces, of a node and of a fixed
  // control point, whose v and a must stay 0. x null: not in this kernel.
  virtual KernelPoint node(int k) = 0;
  virtual KernelPoint fixed(int k) = 0;
  virtual void set_stiffness(const Eigen::VectorXd& per_row) = 0;  // N m, of all strain rows
  // v += kick (a + M^-1 force at x), then x += drift v. The same bits for any number of threads.
  virtual void advance(double kick, double drift, double damping, Workers* workers) = 0;
};

// What kernels are made of. Rows 0 to `strains` of `rows` are strain rows.
struct KernelInput {
  const ComposedRows* rows = nullptr;
  int strains = 0;
  const Eigen::VectorXd* mass = nullptr;  // per node
  std::vector<Slack> slack;               // per strain row
  int fixed = 0;                          // control points
};

// For any rows: those of `which`, on the nodes of `nodes`.
std::unique_ptr<RowKernel> general_kernel(const KernelInput& input, std::vector<int> which, std::vector<int> nodes);

// Control points of a tensor net, u fastest, and where its rows stand.
struct NetRows {
  int count_u = 0, count_v = 0;
  std::vector<int> node, fixed;  // of each control point: the node, or the fixed control point, that it is; else -1
  struct Row {
    int row = 0;
    bool second = false;  // direction
    Eigen::Vector2d uv{0, 0};
  };
  std::vector<Row> rows;
};
// Null where the rows of a direction are not products f(u) g(v) on a grid of points.
std::unique_ptr<RowKernel> net_kernel(const KernelInput& input, const NetRows& net);

}  // namespace toile
