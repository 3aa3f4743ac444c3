// SPDX-License-Identifier: GPL-3.0-or-later
// What the shell works out once and its forces and tangents read: groups of cells that share the lanes of a pack, their
// tables of functions, and how threads share the groups. Private to this room.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "analysis/parallel/lanes.h"
#include "analysis/shell/kink_kernel.h"
#include "analysis/shell/material_basis.h"
#include "analysis/shell/point_kernel.h"
#include "analysis/shell/shell_model.h"

namespace toile {

struct LanePack {
  Lanes v;
};

// Cells of one panel with alike numbers of quadrature points, one cell per lane. Unused lanes repeat the last cell, and
// cells with fewer points than `points` their last point, with weight 0.
struct CellGroup {
  int panel = 0;
  int lanes = 0;  // in use
  int points = 0;
  std::array<int, lane_count> cell{};   // in the panel's quadrature
  std::array<int, lane_count> first{};  // lowest control point of the cell's functions, global
  int gauss_u = 0, gauss_v = 0;         // points per direction where the cells keep 1-D tables, else 0
  // First LanePack. Full tables: for each point its header (weight, rest curvatures), then the rows of each function.
  // 1-D tables: N, N', N'' of each function at each Gauss abscissa along u, then along v; then for each point its
  // header and d xi / dX (eq. 5 inverted).
  std::size_t table = 0;
};

// What the cells of a panel share.
struct PanelLayout {
  explicit PanelLayout(const ClothPanel& panel) : law(panel.fabric) {
    const int count_u = panel.rest.u().degree() + 1, count_v = panel.rest.v().degree() + 1;
    for (int b = 0; b < count_v; ++b)
      for (int a = 0; a < count_u; ++a) offset.push_back(panel.rest.index(a, b));
    functions_u = count_u;
    functions_v = count_v;
    rows = law.twists() ? 5 : law.bends() ? 4 : 2;
    header = 1 + (law.twists() ? 3 : law.bends() ? 2 : 0);
  }
  int functions() const { return functions_u * functions_v; }
  std::size_t packs(const CellGroup& group) const {
    if (group.gauss_u == 0) return static_cast<std::size_t>(group.points) * (header + rows * functions());
    return static_cast<std::size_t>(3 * (group.gauss_u * functions_u + group.gauss_v * functions_v)) +
           static_cast<std::size_t>(group.points) * (header + 4);
  }

  PointLaw law;
  std::vector<int> offset;  // control point of a function relative to the cell's lowest
  int functions_u = 0, functions_v = 0;
  int rows = 0;    // N_,1 N_,2 [N_,11 N_,22 [N_,12]]
  int header = 1;  // weight [kappa11 kappa22 [kappa12]]
};

using LaneVec = Vec3<Lanes>;
using LocalNet = std::array<LaneVec, SurfaceBasis::capacity>;

inline void gather(const CellGroup& group, const PanelLayout& layout, int functions, const double* q, LocalNet& net) {
  for (int k = 0; k < functions; ++k) {
    const double* base = q + 3 * static_cast<std::ptrdiff_t>(layout.offset[k]);
    for (int l = 0; l < lane_count; ++l) {
      const double* point = base + 3 * static_cast<std::ptrdiff_t>(group.first[l]);
      net[k].x[l] = point[0];
      net[k].y[l] = point[1];
      net[k].z[l] = point[2];
    }
  }
}

// Hands every lane's every function on: put(control point, its row of `net`). Lane by lane: lanes may share control
// points, and the order of the sums must not depend on anything but the groups.
template <class Put>
inline void scatter(const CellGroup& group, const PanelLayout& layout, const LocalNet& net, Put&& put) {
  for (int l = 0; l < group.lanes; ++l)
    for (int k = 0; k < layout.functions(); ++k)
      put(group.first[l] + layout.offset[k], net[k].x[l], net[k].y[l], net[k].z[l]);
}

inline void subtract(double* force, int control_point, double x, double y, double z) {
  double* point = force + 3 * static_cast<std::ptrdiff_t>(control_point);
  point[0] -= x;
  point[1] -= y;
  point[2] -= z;
}

inline void add_scaled(LaneVec& sum, Lanes s, const LaneVec& a) {
  sum.x += s * a.x;
  sum.y += s * a.y;
  sum.z += s * a.z;
}

struct PointHeader {
  Lanes weight;
  Curvature<Lanes> rest;
};
inline PointHeader point_header(const LanePack* table, int size) {
  PointHeader header{table[0].v, {}};
  if (size > 1) header.rest.k11 = table[1].v, header.rest.k22 = table[2].v;
  if (size > 3) header.rest.k12 = table[3].v;
  return header;
}

// d xi / dX and its products that second derivatives need.
struct Chain {
  explicit Chain(const LanePack* d) : u1(d[0].v), v1(d[1].v), u2(d[2].v), v2(d[3].v) {}
  Lanes u1, v1, u2, v2;  // d u / dX1, d v / dX1, d u / dX2, d v / dX2
};

// Groups shared by threads, in parts of consecutive groups. Control points of one part's groups alone are summed in
// place; for the others every addend is kept, and added after all are there, in the order of the groups. So each sum is
// that of one thread going through all groups.
struct SharedWork {
  // A thread that comes late still finds work; with more parts, more control points are touched by two.
  static constexpr int parts_per_thread = 2;
  struct Part {
    std::size_t begin = 0, end = 0;  // groups
    std::vector<int> point;          // control point of each addend that is kept, in order
    std::vector<double> addend;      // 3 each
  };
  explicit SharedWork(int threads_) : threads(threads_), parts(static_cast<std::size_t>(parts_per_thread * threads_)) {}
  int threads = 0;
  std::vector<Part> parts;
  std::vector<char> shared;                // per control point
  std::vector<PointEnergy<Lanes>> energy;  // per group
};

// Below this many quadrature points starting the threads costs what they save. (analysis/shell/README.md, "Threads")
inline constexpr std::size_t least_quadrature_points_for_threads = 8000;

struct ShellModel::Impl {
  explicit Impl(Data& of) : data(of), panels(of.panels), first(of.first) {}

  Data& data;
  const std::vector<ClothPanel>& panels;
  const std::vector<int>& first;
  std::vector<PanelLayout> layouts;
  std::vector<CellGroup> groups;
  std::vector<LanePack> tables;
  std::vector<KinkStrip> kinks;
  std::size_t point_count = 0;
  mutable std::unique_ptr<SharedWork> work;  // for the number of threads that came last

  void add_panel(int index);
  void fill(CellGroup& group);
  int span(int panel, Direction direction, double u) const { return panels[panel].rest.knots(direction).find_span(u); }
  MaterialBasis basis_at(int panel, double u, double v) const {
    MaterialBasis basis;
    evaluate_material_basis(panels[panel], span(panel, Direction::u, u), span(panel, Direction::v, v), u, v, basis);
    return basis;
  }

  // Subtracts each group's image(group, layout, table, local) from `out`; returns what the images return, summed.
  template <class Image>
  PointEnergy<Lanes> subtract_images(double* out, Workers* workers, const Image& image) const;
  SharedWork& shared_by(int threads) const;
  ShellEnergy subtract_gradient(const double* q, double* out, Workers* workers) const;

  // Calls body(group, layout, table) for every group in order.
  template <class Body>
  void for_each_group(Body&& body) const {
    for (const CellGroup& group : groups) body(group, layouts[group.panel], tables.data() + group.table);
  }
};

}  // namespace toile
