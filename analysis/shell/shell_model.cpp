#include "analysis/shell/shell_model.h"

#include <algorithm>
#include <cassert>
#include <numeric>
#include <utility>

#include "analysis/shell/lanes.h"
#include "analysis/shell/material_basis.h"
#include "analysis/shell/point_kernel.h"
#include "geometry/error.h"

namespace toile {
namespace {

struct Pack {
  Lanes v;
};

// Cells of one panel with alike numbers of quadrature points, one cell per lane. Unused lanes repeat the last cell, and
// cells with fewer points than `points` their last point, with weight 0.
struct CellGroup {
  int panel = 0;
  int lanes = 0;                          // in use
  int points = 0;
  std::array<int, lane_count> cell{};     // in the panel's quadrature
  std::array<int, lane_count> first{};    // lowest control point of the cell's functions, global
  std::size_t table = 0;                  // first Pack: for each point the weight, the rest curvatures, then the rows of
                                          // each function
};

// What the cells of a panel share.
struct PanelLayout {
  explicit PanelLayout(const ShellPanel& panel) : law(panel.fabric) {
    const int count_u = panel.rest.u().degree() + 1, count_v = panel.rest.v().degree() + 1;
    for (int b = 0; b < count_v; ++b)
      for (int a = 0; a < count_u; ++a) offset.push_back(panel.rest.index(a, b));
    rows = law.twists() ? 5 : law.bends() ? 4 : 2;
    curvatures = law.twists() ? 3 : law.bends() ? 2 : 0;
  }
  int functions() const { return static_cast<int>(offset.size()); }
  int stride() const { return 1 + curvatures + rows * functions(); }

  PointLaw law;
  std::vector<int> offset;  // control point of a function relative to the cell's lowest
  int rows = 0;             // N_,1 N_,2 [N_,11 N_,22 [N_,12]]
  int curvatures = 0;
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

// Lane by lane: lanes may share control points, and the order of the sums must not depend on anything but the groups.
inline void scatter_subtract(const CellGroup& group, const PanelLayout& layout, int functions, const LocalNet& net,
                             double* force) {
  for (int l = 0; l < group.lanes; ++l)
    for (int k = 0; k < functions; ++k) {
      double* point = force + 3 * static_cast<std::ptrdiff_t>(group.first[l] + layout.offset[k]);
      point[0] -= net[k].x[l];
      point[1] -= net[k].y[l];
      point[2] -= net[k].z[l];
    }
}

inline void add_scaled(LaneVec& sum, Lanes s, const LaneVec& a) {
  sum.x += s * a.x;
  sum.y += s * a.y;
  sum.z += s * a.z;
}

inline PointJet<Lanes> interpolate(const Pack* table, int rows, int functions, const LocalNet& net) {
  PointJet<Lanes> jet{};
  switch (rows) {
    case 2:
      for (int k = 0; k < functions; ++k, table += 2) {
        add_scaled(jet.x1, table[0].v, net[k]);
        add_scaled(jet.x2, table[1].v, net[k]);
      }
      break;
    default:
      for (int k = 0; k < functions; ++k, table += rows) {
        add_scaled(jet.x1, table[0].v, net[k]);
        add_scaled(jet.x2, table[1].v, net[k]);
        add_scaled(jet.x11, table[2].v, net[k]);
        add_scaled(jet.x22, table[3].v, net[k]);
        if (rows == 5) add_scaled(jet.x12, table[4].v, net[k]);
      }
  }
  return jet;
}

// net += weight * sum of rows times gradients.
inline void accumulate(const Pack* table, int rows, int functions, Lanes weight, PointJet<Lanes>& g, LocalNet& net) {
  g.x1 = weight * g.x1;
  g.x2 = weight * g.x2;
  if (rows == 2) {
    for (int k = 0; k < functions; ++k, table += 2) {
      add_scaled(net[k], table[0].v, g.x1);
      add_scaled(net[k], table[1].v, g.x2);
    }
    return;
  }
  g.x11 = weight * g.x11;
  g.x22 = weight * g.x22;
  if (rows == 5) g.x12 = weight * g.x12;
  for (int k = 0; k < functions; ++k, table += rows) {
    LaneVec sum = net[k];
    add_scaled(sum, table[0].v, g.x1);
    add_scaled(sum, table[1].v, g.x2);
    add_scaled(sum, table[2].v, g.x11);
    add_scaled(sum, table[3].v, g.x22);
    if (rows == 5) add_scaled(sum, table[4].v, g.x12);
    net[k] = sum;
  }
}

inline Curvature<Lanes> rest_curvature(const Pack* point, int curvatures) {
  Curvature<Lanes> rest{};
  if (curvatures > 0) rest.k11 = point[1].v, rest.k22 = point[2].v;
  if (curvatures > 2) rest.k12 = point[3].v;
  return rest;
}

// Functions > 0 is the number of functions per cell known to the compiler; 0 takes it from the layout.
template <int Functions>
PointEnergy<Lanes> add_group_force(const CellGroup& group, const PanelLayout& layout, const Pack* table, const double* q,
                                   double* force) {
  const int functions = Functions > 0 ? Functions : layout.functions();
  LocalNet net, local;
  gather(group, layout, functions, q, net);
  for (int k = 0; k < functions; ++k) local[k] = LaneVec{};
  PointEnergy<Lanes> total{};
  const int header = 1 + layout.curvatures, stride = layout.stride();
  for (int i = 0; i < group.points; ++i, table += stride) {
    const Lanes weight = table[0].v;
    const PointJet<Lanes> x = interpolate(table + header, layout.rows, functions, net);
    PointJet<Lanes> g;
    const PointEnergy<Lanes> energy = energy_gradient(layout.law, x, rest_curvature(table, layout.curvatures), g);
    total.membrane += weight * energy.membrane;
    total.bending += weight * energy.bending;
    accumulate(table + header, layout.rows, functions, weight, g, local);
  }
  scatter_subtract(group, layout, functions, local, force);
  return total;
}

// Like add_group_force for minus the tangent; the parts of dq . K dq of every lane are returned. `minus_df` may be null.
template <int Functions>
PointEnergy<Lanes> add_group_tangent(const CellGroup& group, const PanelLayout& layout, TangentKind kind,
                                     const Pack* table, const double* q, const double* dq, double* minus_df) {
  const int functions = Functions > 0 ? Functions : layout.functions();
  LocalNet net, dnet, local;
  gather(group, layout, functions, q, net);
  gather(group, layout, functions, dq, dnet);
  for (int k = 0; k < functions; ++k) local[k] = LaneVec{};
  PointEnergy<Lanes> total{};
  const int header = 1 + layout.curvatures, stride = layout.stride();
  for (int i = 0; i < group.points; ++i, table += stride) {
    const Lanes weight = table[0].v;
    const PointJet<Lanes> x = interpolate(table + header, layout.rows, functions, net);
    const PointJet<Lanes> dx = interpolate(table + header, layout.rows, functions, dnet);
    PointJet<Lanes> dg;
    const PointEnergy<Lanes> work =
        energy_hessian(layout.law, kind, x, rest_curvature(table, layout.curvatures), dx, dg);
    total.membrane += weight * work.membrane;
    total.bending += weight * work.bending;
    accumulate(table + header, layout.rows, functions, weight, dg, local);
  }
  if (minus_df != nullptr) scatter_subtract(group, layout, functions, local, minus_df);
  return total;
}

PointJet<double> jet_at(const MaterialBasis& basis, const NurbsSurface& rest, const double* panel_q) {
  PointJet<double> jet{};
  const std::array<Vec3<double>*, 5> rows{&jet.x1, &jet.x2, &jet.x11, &jet.x22, &jet.x12};
  for (int b = 0; b < basis.count_v; ++b)
    for (int a = 0; a < basis.count_u; ++a) {
      const int k = a + basis.count_u * b;
      const double* p = panel_q + 3 * static_cast<std::ptrdiff_t>(rest.index(basis.first_u + a, basis.first_v + b));
      for (int r = 0; r < 5; ++r) *rows[r] = *rows[r] + basis.value[r + 1][k] * Vec3<double>{p[0], p[1], p[2]};
    }
  return jet;
}

Curvature<double> curvature(const PointJet<double>& x) {
  const Vec3<double> a3 = surface_normal(x).a3;
  return {dot(a3, x.x11), dot(a3, x.x22), dot(a3, x.x12)};
}

// What counts as unbent.
Curvature<double> natural_curvature(const ShellPanel& panel, const MaterialBasis& basis) {
  if (panel.fabric.rest_curvature == RestCurvature::zero) return {0, 0, 0};
  return curvature(jet_at(basis, panel.rest, panel.rest.points().data()));
}

}  // namespace

struct ShellModel::Impl {
  std::vector<ShellPanel> panels;
  std::vector<PanelLayout> layouts;
  std::vector<int> first;  // control point of each panel, and the total
  std::vector<CellGroup> groups;
  std::vector<Pack> tables;
  Eigen::VectorXd rest, lumped_mass, lumped_drag;
  std::size_t point_count = 0;

  void add_panel(int index);
  void fill(CellGroup& group);
  int span(int panel, Direction direction, double u) const { return panels[panel].rest.knots(direction).find_span(u); }
  MaterialBasis basis_at(int panel, double u, double v) const {
    MaterialBasis basis;
    evaluate_material_basis(panels[panel], span(panel, Direction::u, u), span(panel, Direction::v, v), u, v, basis);
    return basis;
  }

  // Calls body(group, layout, table, std::integral_constant<int, Functions>) for every group in order.
  template <class Body>
  void for_each_group(Body&& body) const {
    for (const CellGroup& group : groups) {
      const PanelLayout& layout = layouts[group.panel];
      const Pack* table = tables.data() + group.table;
      switch (layout.functions()) {
        case 9: body(group, layout, table, std::integral_constant<int, 9>()); break;
        case 16: body(group, layout, table, std::integral_constant<int, 16>()); break;
        default: body(group, layout, table, std::integral_constant<int, 0>());
      }
    }
  }
};

void ShellModel::Impl::add_panel(int index) {
  const std::vector<CellRule>& cells = panels[index].quadrature.cells;
  std::vector<int> order(cells.size());
  std::iota(order.begin(), order.end(), 0);
  std::erase_if(order, [&](int c) { return cells[c].count == 0; });
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return cells[a].count < cells[b].count; });
  for (std::size_t begin = 0; begin < order.size(); begin += lane_count) {
    CellGroup group;
    group.panel = index;
    group.lanes = static_cast<int>(std::min<std::size_t>(lane_count, order.size() - begin));
    for (int l = 0; l < lane_count; ++l) group.cell[l] = order[begin + std::min(l, group.lanes - 1)];
    group.points = cells[group.cell[group.lanes - 1]].count;
    group.table = tables.size();
    tables.resize(tables.size() + static_cast<std::size_t>(group.points) * layouts[index].stride());
    fill(group);
    groups.push_back(group);
  }
}

void ShellModel::Impl::fill(CellGroup& group) {
  const ShellPanel& panel = panels[group.panel];
  const PanelLayout& layout = layouts[group.panel];
  const std::vector<int> spans_u = panel.rest.u().spans(), spans_v = panel.rest.v().spans();
  MaterialBasis basis;
  for (int l = 0; l < lane_count; ++l) {
    const CellRule& cell = panel.quadrature.cells[group.cell[l]];
    for (int i = 0; i < group.points; ++i) {
      const bool real = l < group.lanes && i < cell.count;
      const int point = cell.first + std::min(i, cell.count - 1);
      const Eigen::Vector2d& uv = panel.quadrature.points[point];
      evaluate_material_basis(panel, spans_u[cell.i], spans_v[cell.j], uv[0], uv[1], basis);
      const double area = real ? panel.quadrature.weights[point] * basis.jacobian : 0.0;
      group.first[l] = first[group.panel] + panel.rest.index(basis.first_u, basis.first_v);

      Pack* table = tables.data() + group.table + static_cast<std::size_t>(i) * layout.stride();
      (table++)->v[l] = area;
      const Curvature<double> rest_kappa = natural_curvature(panel, basis);
      const std::array<double, 3> kappa{rest_kappa.k11, rest_kappa.k22, rest_kappa.k12};
      for (int c = 0; c < layout.curvatures; ++c) (table++)->v[l] = kappa[c];
      for (int k = 0; k < layout.functions(); ++k)
        for (int r = 0; r < layout.rows; ++r) (table++)->v[l] = basis.value[r + 1][k];

      if (!real) continue;
      ++point_count;
      for (int k = 0; k < layout.functions(); ++k) {
        const double share = area * basis.value[0][k];
        lumped_mass[group.first[l] + layout.offset[k]] += panel.fabric.density * share;
        lumped_drag[group.first[l] + layout.offset[k]] += panel.fabric.drag * share;
      }
    }
  }
}

ShellModel::ShellModel(std::vector<ShellPanel> panels) : impl_(std::make_unique<Impl>()) {
  impl_->panels = std::move(panels);
  impl_->first.push_back(0);
  for (const ShellPanel& panel : impl_->panels) {
    validate(panel.fabric);
    const int functions = (panel.rest.u().degree() + 1) * (panel.rest.v().degree() + 1);
    if (functions > SurfaceBasis::capacity)
      throw GeometryError("panel " + panel.name + ": degrees above 7 can't be simulated");
    impl_->layouts.emplace_back(panel);
    impl_->first.push_back(impl_->first.back() + static_cast<int>(panel.rest.points().cols()));
  }
  const int n = impl_->first.back();
  impl_->rest.resize(3 * n);
  impl_->lumped_mass = Eigen::VectorXd::Zero(n);
  impl_->lumped_drag = Eigen::VectorXd::Zero(n);
  for (int k = 0; k < static_cast<int>(impl_->panels.size()); ++k) {
    const Eigen::Matrix3Xd& points = impl_->panels[k].rest.points();
    impl_->rest.segment(3 * impl_->first[k], points.size()) = points.reshaped();
    impl_->add_panel(k);
  }
}

ShellModel::~ShellModel() = default;
ShellModel::ShellModel(ShellModel&&) noexcept = default;
ShellModel& ShellModel::operator=(ShellModel&&) noexcept = default;

int ShellModel::control_point_count() const { return impl_->first.back(); }
const std::vector<ShellPanel>& ShellModel::panels() const { return impl_->panels; }
int ShellModel::first_control_point(int panel) const { return impl_->first[panel]; }
const Eigen::VectorXd& ShellModel::rest() const { return impl_->rest; }
const Eigen::VectorXd& ShellModel::lumped_mass() const { return impl_->lumped_mass; }
const Eigen::VectorXd& ShellModel::lumped_drag() const { return impl_->lumped_drag; }
std::size_t ShellModel::quadrature_points() const { return impl_->point_count; }
std::size_t ShellModel::table_bytes() const { return impl_->tables.size() * sizeof(Pack); }

ShellEnergy ShellModel::internal_force(const Eigen::Ref<const Eigen::VectorXd>& q,
                                       Eigen::Ref<Eigen::VectorXd> force) const {
  assert(q.size() == impl_->rest.size() && force.size() == q.size());
  force.setZero();
  PointEnergy<Lanes> total{};
  impl_->for_each_group([&](const CellGroup& group, const PanelLayout& layout, const Pack* table, auto functions) {
    const auto part = add_group_force<functions>(group, layout, table, q.data(), force.data());
    total.membrane += part.membrane;
    total.bending += part.bending;
  });
  return {sum(total.membrane), sum(total.bending)};
}

void ShellModel::apply_tangent(const Eigen::Ref<const Eigen::VectorXd>& q, const Eigen::Ref<const Eigen::VectorXd>& dq,
                               Eigen::Ref<Eigen::VectorXd> df, TangentKind kind) const {
  assert(q.size() == impl_->rest.size() && dq.size() == q.size() && df.size() == q.size());
  df.setZero();
  impl_->for_each_group([&](const CellGroup& group, const PanelLayout& layout, const Pack* table, auto functions) {
    add_group_tangent<functions>(group, layout, kind, table, q.data(), dq.data(), df.data());
  });
  df = -df;
}

ShellModel::CellShare ShellModel::stiffest_cell(const Eigen::Ref<const Eigen::VectorXd>& q,
                                                const Eigen::Ref<const Eigen::VectorXd>& dq) const {
  CellShare best;
  double largest = -1;
  impl_->for_each_group([&](const CellGroup& group, const PanelLayout& layout, const Pack* table, auto functions) {
    const auto work =
        add_group_tangent<functions>(group, layout, TangentKind::upper, table, q.data(), dq.data(), nullptr);
    for (int l = 0; l < group.lanes; ++l) {
      if (!(work.membrane[l] + work.bending[l] > largest)) continue;
      largest = work.membrane[l] + work.bending[l];
      const CellRule& cell = impl_->panels[group.panel].quadrature.cells[group.cell[l]];
      best = {{group.panel, cell.i, cell.j}, work.membrane[l], work.bending[l]};
    }
  });
  return best;
}

MaterialPoint ShellModel::material_point(int panel, double u, double v) const {
  const MaterialBasis basis = impl_->basis_at(panel, u, v);
  const int base = impl_->first[panel] + impl_->panels[panel].rest.index(basis.first_u, basis.first_v);
  MaterialPoint point;
  for (int k = 0; k < basis.size(); ++k) point.index.push_back(base + impl_->layouts[panel].offset[k]);
  for (int r = 0; r < 6; ++r) point.value[r].assign(basis.value[r].begin(), basis.value[r].begin() + basis.size());
  return point;
}

ShellState ShellModel::state(int panel, double u, double v, const Eigen::Ref<const Eigen::VectorXd>& q) const {
  const ShellPanel& p = impl_->panels[panel];
  const MaterialBasis basis = impl_->basis_at(panel, u, v);
  const double* panel_q = q.data() + 3 * static_cast<std::ptrdiff_t>(impl_->first[panel]);
  const PointJet<double> x = jet_at(basis, p.rest, panel_q);
  const Curvature<double> kappa = curvature(x), natural = natural_curvature(p, basis);

  ShellState state;
  state.position.setZero();
  for (int k = 0; k < basis.size(); ++k) {
    const int index = p.rest.index(basis.first_u, basis.first_v) + impl_->layouts[panel].offset[k];
    state.position += basis.value[0][k] * Eigen::Map<const Eigen::Vector3d>(panel_q + 3 * index);
  }
  state.strain << 0.5 * (dot(x.x1, x.x1) - 1), 0.5 * (dot(x.x2, x.x2) - 1), dot(x.x1, x.x2);
  state.curvature << kappa.k11 - natural.k11, kappa.k22 - natural.k22, kappa.k12 - natural.k12;
  const PointLaw& law = impl_->layouts[panel].law;
  state.second_pk << law.weft * state.strain[0], law.warp * state.strain[1], law.shear * state.strain[2];
  state.nominal << std::sqrt(dot(x.x1, x.x1)) * state.second_pk[0], std::sqrt(dot(x.x2, x.x2)) * state.second_pk[1];
  return state;
}

}  // namespace toile
