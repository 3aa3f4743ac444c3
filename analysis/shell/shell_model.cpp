// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/shell/shell_model.h"

#include <algorithm>
#include <cassert>
#include <tuple>
#include <utility>

#include "analysis/parallel/workers.h"
#include "analysis/shell/shell_tables.h"
#include "geometry/error.h"

namespace toile {
namespace {

inline PointJet<Lanes> interpolate(const LanePack* table, int rows, int functions, const LocalNet& net) {
  PointJet<Lanes> jet{};
  for (int k = 0; k < functions; ++k, table += rows) {
    add_scaled(jet.x1, table[0].v, net[k]);
    add_scaled(jet.x2, table[1].v, net[k]);
    if (rows < 4) continue;
    add_scaled(jet.x11, table[2].v, net[k]);
    add_scaled(jet.x22, table[3].v, net[k]);
    if (rows == 5) add_scaled(jet.x12, table[4].v, net[k]);
  }
  return jet;
}

// net += sum of rows times gradients.
inline void accumulate(const LanePack* table, int rows, int functions, const PointJet<Lanes>& g, LocalNet& net) {
  for (int k = 0; k < functions; ++k, table += rows) {
    LaneVec sum = net[k];
    add_scaled(sum, table[0].v, g.x1);
    add_scaled(sum, table[1].v, g.x2);
    if (rows >= 4) {
      add_scaled(sum, table[2].v, g.x11);
      add_scaled(sum, table[3].v, g.x22);
      if (rows == 5) add_scaled(sum, table[4].v, g.x12);
    }
    net[k] = sum;
  }
}

inline void scale(PointJet<Lanes>& g, Lanes s) {
  g.x1 = s * g.x1;
  g.x2 = s * g.x2;
  g.x11 = s * g.x11;
  g.x22 = s * g.x22;
  g.x12 = s * g.x12;
}

// At every point: jets of the nets, point(header, jets) -> gradient per area, and its weighted image added to `out`.
// Functions: their number where the compiler shall know it, else 0.
template <int Functions, std::size_t Nets, class Point>
void sweep_full(const CellGroup& group, const PanelLayout& layout, const LanePack* table,
                const std::array<LocalNet, Nets>& nets, LocalNet& out, Point&& point) {
  const int functions = Functions > 0 ? Functions : layout.functions(), rows = layout.rows;
  const auto sweep = [&](auto fixed_rows) {
    const int r = fixed_rows;
    for (int i = 0; i < group.points; ++i) {
      const PointHeader header = point_header(table, layout.header);
      table += layout.header;
      std::array<PointJet<Lanes>, Nets> jets;
      for (std::size_t f = 0; f < Nets; ++f) jets[f] = interpolate(table, r, functions, nets[f]);
      PointJet<Lanes> g = point(header, jets);
      scale(g, header.weight);
      accumulate(table, r, functions, g, out);
      table += r * functions;
    }
  };
  if (rows == 2) sweep(std::integral_constant<int, 2>());
  if (rows == 4) sweep(std::integral_constant<int, 4>());
  if (rows == 5) sweep(std::integral_constant<int, 5>());
}

// Derivatives along the parameters; also gradients with respect to them.
struct ParameterJet {
  LaneVec u{}, v{}, uu{}, uv{}, vv{};
};

inline PointJet<Lanes> to_material(const Chain& c, const PanelLayout& layout, const ParameterJet& x) {
  PointJet<Lanes> jet{};
  jet.x1 = c.u1 * x.u + c.v1 * x.v;
  jet.x2 = c.u2 * x.u + c.v2 * x.v;
  if (!layout.law.bends()) return jet;
  jet.x11 = (c.u1 * c.u1) * x.uu + (2.0 * c.u1 * c.v1) * x.uv + (c.v1 * c.v1) * x.vv;
  jet.x22 = (c.u2 * c.u2) * x.uu + (2.0 * c.u2 * c.v2) * x.uv + (c.v2 * c.v2) * x.vv;
  if (layout.law.twists()) jet.x12 = (c.u1 * c.u2) * x.uu + (c.u1 * c.v2 + c.u2 * c.v1) * x.uv + (c.v1 * c.v2) * x.vv;
  return jet;
}

// The transpose of to_material.
inline ParameterJet to_parameters(const Chain& c, const PanelLayout& layout, const PointJet<Lanes>& g) {
  ParameterJet jet{};
  jet.u = c.u1 * g.x1 + c.u2 * g.x2;
  jet.v = c.v1 * g.x1 + c.v2 * g.x2;
  if (!layout.law.bends()) return jet;
  jet.uu = (c.u1 * c.u1) * g.x11 + (c.u2 * c.u2) * g.x22;
  jet.uv = (2.0 * c.u1 * c.v1) * g.x11 + (2.0 * c.u2 * c.v2) * g.x22;
  jet.vv = (c.v1 * c.v1) * g.x11 + (c.v2 * c.v2) * g.x22;
  if (layout.law.twists()) {
    jet.uu = jet.uu + (c.u1 * c.u2) * g.x12;
    jet.uv = jet.uv + (c.u1 * c.v2 + c.u2 * c.v1) * g.x12;
    jet.vv = jet.vv + (c.v1 * c.v2) * g.x12;
  }
  return jet;
}

// Nets contracted along v at one Gauss line: with N, N' and N''.
struct LineNet {
  std::array<LaneVec, 8> n0, n1, n2;
};

// sweep_full from 1-D tables, contracting along v first: fewer operations from p = 3 on, a third of the memory.
// Side: functions per direction where the compiler shall know it, else 0.
template <int Side, std::size_t Nets, class Point>
void sweep_tensor(const CellGroup& group, const PanelLayout& layout, const LanePack* table,
                  const std::array<LocalNet, Nets>& nets, LocalNet& out, Point&& point) {
  const int nu = Side > 0 ? Side : layout.functions_u, nv = Side > 0 ? Side : layout.functions_v;
  const LanePack* along_u = table;
  const LanePack* along_v = along_u + 3 * group.gauss_u * nu;
  const LanePack* points = along_v + 3 * group.gauss_v * nv;
  const bool bends = layout.law.bends();
  for (int j = 0; j < group.gauss_v; ++j, along_v += 3 * nv) {
    std::array<LineNet, Nets> lines;
    for (std::size_t f = 0; f < Nets; ++f)
      for (int a = 0; a < nu; ++a) {
        LaneVec n0{}, n1{}, n2{};
        for (int b = 0; b < nv; ++b) {
          const LaneVec& p = nets[f][a + nu * b];
          add_scaled(n0, along_v[3 * b].v, p);
          add_scaled(n1, along_v[3 * b + 1].v, p);
          if (bends) add_scaled(n2, along_v[3 * b + 2].v, p);
        }
        lines[f].n0[a] = n0;
        lines[f].n1[a] = n1;
        lines[f].n2[a] = n2;
      }
    LineNet sums;
    for (int a = 0; a < nu; ++a) sums.n0[a] = sums.n1[a] = sums.n2[a] = LaneVec{};
    const LanePack* at = along_u;
    for (int i = 0; i < group.gauss_u; ++i, at += 3 * nu) {
      const PointHeader header = point_header(points, layout.header);
      const Chain chain(points + layout.header);
      points += layout.header + 4;
      std::array<PointJet<Lanes>, Nets> jets;
      for (std::size_t f = 0; f < Nets; ++f) {
        ParameterJet x;
        for (int a = 0; a < nu; ++a) {
          const Lanes n = at[3 * a].v, d = at[3 * a + 1].v, dd = at[3 * a + 2].v;
          add_scaled(x.u, d, lines[f].n0[a]);
          add_scaled(x.v, n, lines[f].n1[a]);
          if (!bends) continue;
          add_scaled(x.uu, dd, lines[f].n0[a]);
          add_scaled(x.uv, d, lines[f].n1[a]);
          add_scaled(x.vv, n, lines[f].n2[a]);
        }
        jets[f] = to_material(chain, layout, x);
      }
      PointJet<Lanes> g = point(header, jets);
      scale(g, header.weight);
      const ParameterJet h = to_parameters(chain, layout, g);
      for (int a = 0; a < nu; ++a) {
        const Lanes n = at[3 * a].v, d = at[3 * a + 1].v, dd = at[3 * a + 2].v;
        add_scaled(sums.n0[a], d, h.u);
        add_scaled(sums.n1[a], n, h.v);
        if (!bends) continue;
        add_scaled(sums.n0[a], dd, h.uu);
        add_scaled(sums.n1[a], d, h.uv);
        add_scaled(sums.n2[a], n, h.vv);
      }
    }
    for (int b = 0; b < nv; ++b)
      for (int a = 0; a < nu; ++a) {
        LaneVec& p = out[a + nu * b];
        add_scaled(p, along_v[3 * b].v, sums.n0[a]);
        add_scaled(p, along_v[3 * b + 1].v, sums.n1[a]);
        if (bends) add_scaled(p, along_v[3 * b + 2].v, sums.n2[a]);
      }
  }
}

template <std::size_t Nets, class Point>
void sweep(const CellGroup& group, const PanelLayout& layout, const LanePack* table,
           const std::array<LocalNet, Nets>& nets, LocalNet& out, Point&& point) {
  const bool square = layout.functions_u == layout.functions_v, tensor = group.gauss_u > 0;
  for (int k = 0; k < layout.functions(); ++k) out[k] = LaneVec{};
  if (square && layout.functions_u == 3)
    return tensor ? sweep_tensor<3>(group, layout, table, nets, out, point)
                  : sweep_full<9>(group, layout, table, nets, out, point);
  if (square && layout.functions_u == 4)
    return tensor ? sweep_tensor<4>(group, layout, table, nets, out, point)
                  : sweep_full<16>(group, layout, table, nets, out, point);
  return tensor ? sweep_tensor<0>(group, layout, table, nets, out, point)
                : sweep_full<0>(group, layout, table, nets, out, point);
}

// Compiled once: a second copy might round otherwise.
[[gnu::noinline]] PointEnergy<Lanes> group_gradient(const CellGroup& group, const PanelLayout& layout,
                                                    const LanePack* table, const double* q, LocalNet& gradient) {
  std::array<LocalNet, 1> net;
  gather(group, layout, layout.functions(), q, net[0]);
  PointEnergy<Lanes> total{};
  sweep(group, layout, table, net, gradient, [&](const PointHeader& header, const auto& jets) {
    PointJet<Lanes> g;
    const PointEnergy<Lanes> energy = energy_gradient(layout.law, jets[0], header.rest, g);
    total.membrane += header.weight * energy.membrane;
    total.bending += header.weight * energy.bending;
    total.least = smaller(total.least, energy.least);
    total.most = larger(total.most, energy.most);
    return g;
  });
  return total;
}

// K dq of a group; the parts of dq . K dq of every lane are returned.
[[gnu::noinline]] PointEnergy<Lanes> group_tangent(const CellGroup& group, const PanelLayout& layout, TangentKind kind,
                                                   const LanePack* table, const double* q, const double* dq,
                                                   LocalNet& image) {
  std::array<LocalNet, 2> nets;
  gather(group, layout, layout.functions(), q, nets[0]);
  gather(group, layout, layout.functions(), dq, nets[1]);
  PointEnergy<Lanes> total{};
  sweep(group, layout, table, nets, image, [&](const PointHeader& header, const auto& jets) {
    PointJet<Lanes> g;
    const PointEnergy<Lanes> work = energy_hessian(layout.law, kind, jets[0], header.rest, jets[1], g);
    total.membrane += header.weight * work.membrane;
    total.bending += header.weight * work.bending;
    return g;
  });
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
Curvature<double> natural_curvature(const ClothPanel& panel, const MaterialBasis& basis) {
  if (panel.fabric.rest_curvature == RestCurvature::zero) return {0, 0, 0};
  return curvature(jet_at(basis, panel.rest, panel.rest.points().data()));
}

// Points per direction of an uncut cell of polynomial functions, whose points are a grid; else 0 x 0.
std::pair<int, int> tensor_shape(const ClothPanel& panel, const CellRule& cell) {
  if (!cell.tensor || panel.rest.rational()) return {0, 0};
  const Eigen::Vector2d* points = panel.quadrature.points.data() + cell.first;
  int along_u = 1;
  while (along_u < cell.count && points[along_u][1] == points[0][1]) ++along_u;
  const int along_v = cell.count / along_u;
  for (int i = 0; i < cell.count; ++i)
    if (points[i][0] != points[i % along_u][0] || points[i][1] != points[i / along_u * along_u][1]) return {0, 0};
  return along_u * along_v == cell.count ? std::pair(along_u, along_v) : std::pair(0, 0);
}

}  // namespace

template <class Image>
PointEnergy<Lanes> ShellModel::Impl::subtract_images(double* out, Workers* workers, const Image& image) const {
  PointEnergy<Lanes> total{};
  const auto add = [&](const PointEnergy<Lanes>& part) {
    total.membrane += part.membrane;
    total.bending += part.bending;
    total.least = smaller(total.least, part.least);
    total.most = larger(total.most, part.most);
  };
  if (!workers || workers->count() < 2 || point_count < least_quadrature_points_for_threads) {
    for_each_group([&](const CellGroup& group, const PanelLayout& layout, const LanePack* table) {
      LocalNet local;
      add(image(group, layout, table, local));
      scatter(group, layout, local, [&](int point, double x, double y, double z) { subtract(out, point, x, y, z); });
    });
    return total;
  }
  SharedWork& w = shared_by(workers->count());
  const auto body = [&](int index) {
    SharedWork::Part& part = w.parts[static_cast<std::size_t>(index)];
    double* kept = part.addend.data();
    for (std::size_t g = part.begin; g < part.end; ++g) {
      const CellGroup& group = groups[g];
      LocalNet local;
      w.energy[g] = image(group, layouts[group.panel], tables.data() + group.table, local);
      scatter(group, layouts[group.panel], local, [&](int point, double x, double y, double z) {
        if (!w.shared[point]) return subtract(out, point, x, y, z);
        kept[0] = x, kept[1] = y, kept[2] = z;
        kept += 3;
      });
    }
  };
  workers->run(static_cast<int>(w.parts.size()), body);
  for (const SharedWork::Part& part : w.parts)
    for (std::size_t k = 0; k < part.point.size(); ++k)
      subtract(out, part.point[k], part.addend[3 * k], part.addend[3 * k + 1], part.addend[3 * k + 2]);
  for (const PointEnergy<Lanes>& energy : w.energy) add(energy);
  return total;
}

SharedWork& ShellModel::Impl::shared_by(int threads) const {
  if (work && work->threads == threads) return *work;
  work = std::make_unique<SharedWork>(threads);
  const int parts = static_cast<int>(work->parts.size());
  work->energy.resize(groups.size());
  const auto cost = [&](const CellGroup& group) {
    return static_cast<double>(group.points) * layouts[group.panel].functions();
  };
  double total = 0, before = 0;
  for (const CellGroup& group : groups) total += cost(group);
  std::size_t next = 0;
  std::vector<int> owner(static_cast<std::size_t>(first.back()), -1);
  work->shared.assign(owner.size(), 0);
  const LocalNet none{};
  for (int p = 0; p < parts; ++p) {
    SharedWork::Part& part = work->parts[static_cast<std::size_t>(p)];
    part.begin = next;
    for (; next < groups.size() && (p + 1 == parts || before < total * (p + 1) / parts); ++next) {
      before += cost(groups[next]);
      scatter(groups[next], layouts[groups[next].panel], none, [&](int point, double, double, double) {
        if (owner[point] >= 0 && owner[point] != p) work->shared[point] = 1;
        owner[point] = p;
      });
    }
    part.end = next;
  }
  for (SharedWork::Part& part : work->parts) {
    for (std::size_t g = part.begin; g < part.end; ++g)
      scatter(groups[g], layouts[groups[g].panel], none, [&](int point, double, double, double) {
        if (work->shared[point]) part.point.push_back(point);
      });
    part.addend.resize(3 * part.point.size());
  }
  return *work;
}

void ShellModel::Impl::add_panel(int index) {
  const std::vector<CellRule>& cells = panels[index].quadrature.cells;
  struct Entry {
    std::pair<int, int> shape;
    int count, cell;
    bool alike(const Entry& other) const { return shape == other.shape; }
  };
  std::vector<Entry> order;
  for (int c = 0; c < static_cast<int>(cells.size()); ++c)
    if (cells[c].count > 0) order.push_back({tensor_shape(panels[index], cells[c]), cells[c].count, c});
  std::stable_sort(order.begin(), order.end(), [](const Entry& a, const Entry& b) {
    return std::tie(a.shape, a.count) < std::tie(b.shape, b.count);
  });
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    while (end < order.size() && end < begin + lane_count && order[end].alike(order[begin])) ++end;
    CellGroup group;
    group.panel = index;
    group.lanes = static_cast<int>(end - begin);
    for (int l = 0; l < lane_count; ++l) group.cell[l] = order[begin + std::min(l, group.lanes - 1)].cell;
    group.points = order[end - 1].count;
    std::tie(group.gauss_u, group.gauss_v) = order[begin].shape;
    group.table = tables.size();
    tables.resize(tables.size() + layouts[index].packs(group));
    fill(group);
    groups.push_back(group);
  }
}

void ShellModel::Impl::fill(CellGroup& group) {
  const ClothPanel& panel = panels[group.panel];
  const PanelLayout& layout = layouts[group.panel];
  const std::vector<int> spans_u = panel.rest.u().spans(), spans_v = panel.rest.v().spans();
  MaterialBasis basis;
  for (int l = 0; l < lane_count; ++l) {
    const CellRule& cell = panel.quadrature.cells[group.cell[l]];
    const Eigen::Vector2d* points = panel.quadrature.points.data() + cell.first;
    LanePack* table = tables.data() + group.table;
    const auto put = [&](double value) { (table++)->v[l] = value; };
    const auto put_line = [&](const KnotVector& knots, int span, double parameter) {
      BasisValues line;
      evaluate_basis_on_span(knots, span, parameter, 2, line);
      for (int k = 0; k <= knots.degree(); ++k)
        for (int r = 0; r < 3; ++r) put(line.value[r][k]);
    };
    for (int i = 0; i < group.gauss_u; ++i) put_line(panel.rest.u(), spans_u[cell.i], points[i][0]);
    for (int j = 0; j < group.gauss_v; ++j) put_line(panel.rest.v(), spans_v[cell.j], points[j * group.gauss_u][1]);

    for (int i = 0; i < group.points; ++i) {
      const bool real = l < group.lanes && i < cell.count;
      const int point = std::min(i, cell.count - 1);
      evaluate_material_basis(panel, spans_u[cell.i], spans_v[cell.j], points[point][0], points[point][1], basis);
      const double area = real ? panel.quadrature.weights[cell.first + point] * basis.jacobian : 0.0;
      group.first[l] = first[group.panel] + panel.rest.index(basis.first_u, basis.first_v);

      put(area);
      const Curvature<double> rest_kappa = natural_curvature(panel, basis);
      if (layout.header > 1) put(rest_kappa.k11), put(rest_kappa.k22);
      if (layout.header > 3) put(rest_kappa.k12);
      if (group.gauss_u > 0) {
        for (const double d : basis.chain.reshaped()) put(d);
      } else {
        for (int k = 0; k < layout.functions(); ++k)
          for (int r = 0; r < layout.rows; ++r) put(basis.value[r + 1][k]);
      }

      if (!real) continue;
      ++point_count;
      for (int k = 0; k < layout.functions(); ++k) {
        const double share = area * basis.value[0][k];
        data.lumped_mass[group.first[l] + layout.offset[k]] += panel.fabric.density * share;
        data.lumped_drag[group.first[l] + layout.offset[k]] += panel.fabric.drag * share;
      }
    }
  }
}

QuadratureOptions shell_quadrature(const NurbsSurface& surface) {
  QuadratureOptions options;
  options.one_less = !surface.rational();
  options.degree_u = 2 * surface.u().degree() - options.one_less;
  options.degree_v = 2 * surface.v().degree() - options.one_less;
  return options;
}

ShellModel::ShellModel(std::vector<ClothPanel> panels)
    : Model(std::make_unique<Data>()), impl_(std::make_unique<Impl>(*data_)) {
  data_->panels = std::move(panels);
  data_->first.push_back(0);
  for (const ClothPanel& panel : data_->panels) {
    validate(panel.fabric);
    const int functions = (panel.rest.u().degree() + 1) * (panel.rest.v().degree() + 1);
    if (functions > SurfaceBasis::capacity)
      throw GeometryError("panel " + panel.name + ": degrees above 7 can't be simulated");
    impl_->layouts.emplace_back(panel);
    data_->first.push_back(data_->first.back() + static_cast<int>(panel.rest.points().cols()));
  }
  const int n = point_count();
  data_->rest.resize(3 * n);
  data_->lumped_mass = Eigen::VectorXd::Zero(n);
  data_->lumped_drag = Eigen::VectorXd::Zero(n);
  for (int k = 0; k < static_cast<int>(data_->panels.size()); ++k) {
    const ClothPanel& panel = data_->panels[k];
    data_->rest.segment(3 * first_point(k), panel.rest.points().size()) = panel.rest.points().reshaped();
    impl_->add_panel(k);
    if (!impl_->layouts[k].law.bends()) continue;
    for (const KinkPoint& point : panel.kinks) impl_->kinks.push_back(make_kink_strip(panel, k, first_point(k), point));
  }
}

ShellModel::~ShellModel() = default;
ShellModel::ShellModel(ShellModel&&) noexcept = default;
ShellModel& ShellModel::operator=(ShellModel&&) noexcept = default;

std::size_t ShellModel::quadrature_points() const {
  return impl_->point_count;
}
std::size_t ShellModel::table_bytes() const {
  return impl_->tables.size() * sizeof(LanePack);
}

ShellEnergy ShellModel::Impl::subtract_gradient(const double* q, double* out, Workers* workers) const {
  const PointEnergy<Lanes> total = subtract_images(
      out, workers, [&](const CellGroup& group, const PanelLayout& layout, const LanePack* table, LocalNet& local) {
        return group_gradient(group, layout, table, q, local);
      });
  double strips = 0;
  for (const KinkStrip& strip : kinks) strips += add_kink_force(strip, layouts[strip.panel].law, q, out);
  ShellEnergy energy{sum(total.membrane), sum(total.bending) + strips};
  for (int l = 0; l < lane_count; ++l) {
    energy.least_strain = std::min(energy.least_strain, total.least[l]);
    energy.largest_strain = std::max(energy.largest_strain, total.most[l]);
  }
  return energy;
}

ShellEnergy ShellModel::internal_force(const Eigen::Ref<const Eigen::VectorXd>& q, Eigen::Ref<Eigen::VectorXd> force,
                                       Workers* workers) const {
  assert(q.size() == rest().size() && force.size() == q.size());
  force.setZero();
  return impl_->subtract_gradient(q.data(), force.data(), workers);
}

void ShellModel::add_force(const Eigen::Ref<const Eigen::VectorXd>& q, Eigen::Ref<Eigen::VectorXd> force,
                           Elastic& elastic, Workers* workers) const {
  assert(q.size() == rest().size() && force.size() == q.size());
  const ShellEnergy energy = impl_->subtract_gradient(q.data(), force.data(), workers);
  elastic.energy.add("membrane", energy.membrane);
  elastic.energy.add("bending", energy.bending);
  elastic.strain.least = std::min(elastic.strain.least, energy.least_strain);
  elastic.strain.largest = std::max(elastic.strain.largest, energy.largest_strain);
}

void ShellModel::add_force_change(const Eigen::Ref<const Eigen::VectorXd>& q,
                                  const Eigen::Ref<const Eigen::VectorXd>& dq, Eigen::Ref<Eigen::VectorXd> df,
                                  TangentKind kind, Workers* workers) const {
  assert(q.size() == rest().size() && dq.size() == q.size() && df.size() == q.size());
  impl_->subtract_images(
      df.data(), workers,
      [&](const CellGroup& group, const PanelLayout& layout, const LanePack* table, LocalNet& local) {
        return group_tangent(group, layout, kind, table, q.data(), dq.data(), local);
      });
  for (const KinkStrip& strip : impl_->kinks)
    add_kink_tangent(strip, impl_->layouts[strip.panel].law, q.data(), dq.data(), df.data());
}

void ShellModel::apply_tangent(const Eigen::Ref<const Eigen::VectorXd>& q, const Eigen::Ref<const Eigen::VectorXd>& dq,
                               Eigen::Ref<Eigen::VectorXd> df, TangentKind kind, Workers* workers) const {
  df.setZero();
  add_force_change(q, dq, df, kind, workers);
  df = -df;
}

CellShare ShellModel::stiffest_cell(const Eigen::Ref<const Eigen::VectorXd>& q,
                                    const Eigen::Ref<const Eigen::VectorXd>& dq) const {
  CellShare best;
  double largest = -1;
  impl_->for_each_group([&](const CellGroup& group, const PanelLayout& layout, const LanePack* table) {
    LocalNet ignored;
    const auto work = group_tangent(group, layout, TangentKind::upper, table, q.data(), dq.data(), ignored);
    for (int l = 0; l < group.lanes; ++l) {
      if (!(work.membrane[l] + work.bending[l] > largest)) continue;
      largest = work.membrane[l] + work.bending[l];
      const CellRule& cell = impl_->panels[group.panel].quadrature.cells[group.cell[l]];
      best = {{group.panel, cell.i, cell.j}, work.membrane[l], work.bending[l]};
    }
  });
  // A strip counts to the cell after it, all its points there together; they follow each other.
  for (std::size_t begin = 0, end = 0; begin < impl_->kinks.size(); begin = end) {
    const KinkStrip& first = impl_->kinks[begin];
    double work = 0;
    for (; end < impl_->kinks.size(); ++end) {
      const KinkStrip& strip = impl_->kinks[end];
      if (std::tie(strip.panel, strip.cell_i, strip.cell_j) != std::tie(first.panel, first.cell_i, first.cell_j)) break;
      work += add_kink_tangent(strip, impl_->layouts[strip.panel].law, q.data(), dq.data(), nullptr);
    }
    if (!(work > largest)) continue;
    largest = work;
    best = {{first.panel, first.cell_i, first.cell_j}, 0, work};
  }
  return best;
}

ScalarRow ShellModel::place(int panel, double u, double v) const {
  const NurbsSurface& surface = panels()[panel].rest;
  SurfaceBasis basis;
  evaluate_basis(surface, u, v, basis);
  ScalarRow row;
  for (int b = 0; b < basis.count_v; ++b)
    for (int a = 0; a < basis.count_u; ++a) {
      const double value = basis.value[0][a + basis.count_u * b];
      if (value == 0) continue;
      row.index.push_back(first_point(panel) + surface.index(basis.first_u + a, basis.first_v + b));
      row.value.push_back(value);
    }
  return row;
}

Eigen::Matrix3Xd ShellModel::net(int panel, const Eigen::Ref<const Eigen::VectorXd>& q) const {
  const Eigen::Index count = panels()[panel].rest.points().cols();
  return q.segment(3 * first_point(panel), 3 * count).reshaped(3, count);
}

MaterialPoint ShellModel::material_point(int panel, double u, double v) const {
  const MaterialBasis basis = impl_->basis_at(panel, u, v);
  const int base = impl_->first[panel] + impl_->panels[panel].rest.index(basis.first_u, basis.first_v);
  MaterialPoint point;
  for (int k = 0; k < basis.size(); ++k) point.index.push_back(base + impl_->layouts[panel].offset[k]);
  for (int r = 0; r < 6; ++r) point.value[r].assign(basis.value[r].begin(), basis.value[r].begin() + basis.size());
  return point;
}

MaterialState ShellModel::state(int panel, double u, double v, const Eigen::Ref<const Eigen::VectorXd>& q) const {
  const ClothPanel& p = impl_->panels[panel];
  const MaterialBasis basis = impl_->basis_at(panel, u, v);
  const double* panel_q = q.data() + 3 * static_cast<std::ptrdiff_t>(impl_->first[panel]);
  const PointJet<double> x = jet_at(basis, p.rest, panel_q);
  const Curvature<double> kappa = curvature(x), natural = natural_curvature(p, basis);

  MaterialState state;
  state.position.setZero();
  for (int k = 0; k < basis.size(); ++k) {
    const int index = p.rest.index(basis.first_u, basis.first_v) + impl_->layouts[panel].offset[k];
    state.position += basis.value[0][k] * Eigen::Map<const Eigen::Vector3d>(panel_q + 3 * index);
  }
  state.strain << 0.5 * (dot(x.x1, x.x1) - 1), 0.5 * (dot(x.x2, x.x2) - 1), dot(x.x1, x.x2);
  state.curvature << kappa.k11 - natural.k11, kappa.k22 - natural.k22, kappa.k12 - natural.k12;
  const auto [S11, S22, S12] = membrane_stress(p.fabric.membrane, state.strain[0], state.strain[1], state.strain[2]);
  state.second_pk << S11, S22, S12;
  state.nominal << std::sqrt(dot(x.x1, x.x1)) * state.second_pk[0], std::sqrt(dot(x.x2, x.x2)) * state.second_pk[1];
  return state;
}

}  // namespace toile
