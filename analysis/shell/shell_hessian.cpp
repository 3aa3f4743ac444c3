// SPDX-License-Identifier: GPL-3.0-or-later
// The shell's consistent tangent, assembled: at each point the second derivative of the energy with respect to the
// derivatives of the place (point_kernel.h), carried to the functions of the cell by their rows. Cells share lanes as
// they do for forces.
#include <algorithm>
#include <array>
#include <cassert>

#include "analysis/linear/block_matrix.h"
#include "analysis/parallel/workers.h"
#include "analysis/shell/shell_tables.h"

namespace toile {
namespace {

using Block = std::array<Lanes, 9>;  // row by row

constexpr int most_rows = 5;  // N_,1 N_,2 [N_,11 N_,22 [N_,12]]

// One group's blocks of functions I >= J: pair (I, J) at I (I + 1) / 2 + J.
using LocalMatrix = std::vector<Block>;

constexpr int pairs(int functions) {
  return functions * (functions + 1) / 2;
}

using FunctionRows = std::array<std::array<Lanes, most_rows>, SurfaceBasis::capacity>;

// Rows of every function at a point of a group whose cells keep 1-D tables.
void rows_of_product(const PanelLayout& layout, const LanePack* along_u, const LanePack* along_v, const Chain& c,
                     FunctionRows& rows) {
  for (int b = 0; b < layout.functions_v; ++b)
    for (int a = 0; a < layout.functions_u; ++a) {
      const Lanes nu = along_u[3 * a].v, du = along_u[3 * a + 1].v, nv = along_v[3 * b].v, dv = along_v[3 * b + 1].v;
      std::array<Lanes, most_rows>& row = rows[static_cast<std::size_t>(a + layout.functions_u * b)];
      const Lanes u = du * nv, v = nu * dv;
      row[0] = c.u1 * u + c.v1 * v;
      row[1] = c.u2 * u + c.v2 * v;
      if (layout.rows < 4) continue;
      const Lanes uu = along_u[3 * a + 2].v * nv, uv = du * dv, vv = nu * along_v[3 * b + 2].v;
      row[2] = (c.u1 * c.u1) * uu + (2.0 * c.u1 * c.v1) * uv + (c.v1 * c.v1) * vv;
      row[3] = (c.u2 * c.u2) * uu + (2.0 * c.u2 * c.v2) * uv + (c.v2 * c.v2) * vv;
      if (layout.rows == 5) row[4] = (c.u1 * c.u2) * uu + (c.u1 * c.v2 + c.u2 * c.v1) * uv + (c.v1 * c.v2) * vv;
    }
}

Vec3<Lanes>& component(PointJet<Lanes>& jet, int row) {
  Vec3<Lanes>* const of[] = {&jet.x1, &jet.x2, &jet.x11, &jet.x22, &jet.x12};
  return *of[row];
}

// The second derivative at a point: block (r, s) couples rows r and s of the functions.
template <int Rows>
void point_hessian(const PanelLayout& layout, TangentKind kind, const PointHeader& header, const PointJet<Lanes>& x,
                   std::array<std::array<Block, Rows>, Rows>& h) {
  for (int s = 0; s < Rows; ++s)
    for (int b = 0; b < 3; ++b) {
      PointJet<Lanes> dx{}, dg{};
      Vec3<Lanes>& unit = component(dx, s);
      (b == 0 ? unit.x : b == 1 ? unit.y : unit.z) = header.weight;
      if (kind == TangentKind::positive) {
        positive_hessian(layout.law, x, header.rest, dx, dg);
      } else {
        energy_hessian(layout.law, kind, x, header.rest, dx, dg);
      }
      for (int r = 0; r < Rows; ++r) {
        const Vec3<Lanes>& g = component(dg, r);
        h[r][s][b] = g.x, h[r][s][3 + b] = g.y, h[r][s][6 + b] = g.z;
      }
    }
}

// local(I, J) += sum over r, s of N_I^r h(r, s) N_J^s.
template <int Rows>
void add_products(int functions, const FunctionRows& rows, const std::array<std::array<Block, Rows>, Rows>& h,
                  LocalMatrix& local) {
  for (int j = 0; j < functions; ++j) {
    std::array<Block, Rows> image;  // sum over s of h(r, s) N_J^s
    for (int r = 0; r < Rows; ++r)
      for (int e = 0; e < 9; ++e) {
        Lanes sum = h[r][0][e] * rows[static_cast<std::size_t>(j)][0];
        for (int s = 1; s < Rows; ++s) sum += h[r][s][e] * rows[static_cast<std::size_t>(j)][s];
        image[r][e] = sum;
      }
    for (int i = j; i < functions; ++i) {
      Block& to = local[static_cast<std::size_t>(pairs(i) + j)];
      for (int e = 0; e < 9; ++e) {
        Lanes sum = to[e];
        for (int r = 0; r < Rows; ++r) sum += image[r][e] * rows[static_cast<std::size_t>(i)][r];
        to[e] = sum;
      }
    }
  }
}

template <int Rows>
void group_hessian(const CellGroup& group, const PanelLayout& layout, TangentKind kind, const LanePack* table,
                   const double* q, LocalMatrix& local) {
  const int functions = layout.functions();
  local.assign(static_cast<std::size_t>(pairs(functions)), Block{});
  LocalNet net;
  gather(group, layout, functions, q, net);
  FunctionRows rows;
  std::array<std::array<Block, Rows>, Rows> h;
  const auto add_point = [&](const PointHeader& header) {
    PointJet<Lanes> x{};
    for (int k = 0; k < functions; ++k)
      for (int r = 0; r < Rows; ++r)
        add_scaled(component(x, r), rows[static_cast<std::size_t>(k)][r], net[static_cast<std::size_t>(k)]);
    point_hessian<Rows>(layout, kind, header, x, h);
    add_products<Rows>(functions, rows, h, local);
  };
  if (group.gauss_u == 0) {
    for (int i = 0; i < group.points; ++i) {
      const PointHeader header = point_header(table, layout.header);
      table += layout.header;
      for (int k = 0; k < functions; ++k)
        for (int r = 0; r < Rows; ++r) rows[static_cast<std::size_t>(k)][r] = (table++)->v;
      add_point(header);
    }
    return;
  }
  const LanePack* along_u = table;
  const LanePack* along_v = along_u + 3 * group.gauss_u * layout.functions_u;
  const LanePack* point = along_v + 3 * group.gauss_v * layout.functions_v;
  for (int j = 0; j < group.gauss_v; ++j)
    for (int i = 0; i < group.gauss_u; ++i, point += layout.header + 4) {
      rows_of_product(layout, along_u + 3 * i * layout.functions_u, along_v + 3 * j * layout.functions_v,
                      Chain(point + layout.header), rows);
      add_point(point_header(point, layout.header));
    }
}

[[gnu::noinline]] void group_hessian(const CellGroup& group, const PanelLayout& layout, TangentKind kind,
                                     const LanePack* table, const double* q, LocalMatrix& local) {
  if (layout.rows == 2) group_hessian<2>(group, layout, kind, table, q, local);
  if (layout.rows == 4) group_hessian<4>(group, layout, kind, table, q, local);
  if (layout.rows == 5) group_hessian<5>(group, layout, kind, table, q, local);
}

// A slot, or ~slot where the block is to be transposed.
int slot_of(const BlockPattern& pattern, int row, int column) {
  return row >= column ? pattern.slot(row, column) : ~pattern.slot(column, row);
}

template <class Value>
void add_block(BlockMatrix& matrix, int slot, const Value& value) {  // value(row, column)
  double* to = matrix.block(slot >= 0 ? slot : ~slot);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) to[3 * r + c] += slot >= 0 ? value(r, c) : value(c, r);
}

std::vector<int> points_of(const CellGroup& group, const PanelLayout& layout, int lane) {
  std::vector<int> points;
  for (const int offset : layout.offset) points.push_back(group.first[static_cast<std::size_t>(lane)] + offset);
  return points;
}

}  // namespace

std::vector<std::vector<int>> ShellModel::couplings() const {
  std::vector<std::vector<int>> out;
  for (const CellGroup& group : impl_->groups)
    for (int l = 0; l < group.lanes; ++l) out.push_back(points_of(group, impl_->layouts[group.panel], l));
  for (const KinkStrip& strip : impl_->kinks) out.push_back(strip.index);
  return out;
}

std::vector<int> ShellModel::slots(const BlockPattern& pattern) const {
  std::vector<int> out;
  for (const std::vector<int>& points : couplings())
    for (std::size_t i = 0; i < points.size(); ++i)
      for (std::size_t j = 0; j <= i; ++j) out.push_back(slot_of(pattern, points[i], points[j]));
  return out;
}

void ShellModel::add_hessian(const Eigen::Ref<const Eigen::VectorXd>& q, TangentKind kind, std::span<const int> slots,
                             BlockMatrix& matrix, Workers* workers) const {
  assert(q.size() == rest().size());
  const std::vector<CellGroup>& groups = impl_->groups;
  const int threads = workers && impl_->point_count >= least_quadrature_points_for_threads ? workers->count() : 1;
  constexpr int groups_per_thread = 8;
  const std::size_t batch = static_cast<std::size_t>(threads == 1 ? 1 : groups_per_thread * threads);
  std::vector<LocalMatrix> local(batch);
  const int* slot = slots.data();
  // Blocks are worked out by all threads, a batch at a time, and added by one in the order of the groups.
  for (std::size_t begin = 0; begin < groups.size(); begin += batch) {
    const std::size_t count = std::min(batch, groups.size() - begin);
    const auto body = [&](int k) {
      const CellGroup& group = groups[begin + static_cast<std::size_t>(k)];
      group_hessian(group, impl_->layouts[group.panel], kind, impl_->tables.data() + group.table, q.data(),
                    local[static_cast<std::size_t>(k)]);
    };
    if (threads == 1) {
      body(0);
    } else {
      workers->run(static_cast<int>(count), body);
    }
    for (std::size_t k = 0; k < count; ++k) {
      const int lanes = groups[begin + k].lanes;
      for (int l = 0; l < lanes; ++l)
        for (const Block& block : local[k])
          add_block(matrix, *slot++, [&](int r, int c) { return block[static_cast<std::size_t>(3 * r + c)][l]; });
    }
  }
  for (const KinkStrip& strip : impl_->kinks) {
    const KinkHessian h = kink_hessian(strip, impl_->layouts[strip.panel].law, q.data(), kind);
    for (std::size_t i = 0; i < strip.index.size(); ++i)
      for (std::size_t j = 0; j <= i; ++j) {
        const Eigen::Matrix3d block = kink_block(strip, h, i, j);
        add_block(matrix, *slot++, [&](int r, int c) { return block(r, c); });
      }
  }
}

}  // namespace toile
