// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/grid_evaluation.h"

#include <cassert>

#include "geometry/rational_jet.h"

namespace toile {
namespace {

// Value, first and second derivative of one line of control points.
struct LineJet {
  Eigen::Vector4d d0, d1, d2;
};

template <class Points>
inline LineJet contract(const BasisValues& basis, int count, Points&& points) {
  LineJet line{Eigen::Vector4d::Zero(), Eigen::Vector4d::Zero(), Eigen::Vector4d::Zero()};
  for (int j = 0; j < count; ++j) {
    const Eigen::Vector4d point = points(j);
    line.d0 += basis.value[0][j] * point;
    line.d1 += basis.value[1][j] * point;
    line.d2 += basis.value[2][j] * point;
  }
  return line;
}

inline detail::HomogeneousJet contract_lines(const BasisValues& basis, int count, const LineJet* lines) {
  detail::HomogeneousJet h;
  h.fill(Eigen::Vector4d::Zero());
  for (int a = 0; a < count; ++a) {
    const LineJet& line = lines[a];
    h[0] += basis.value[0][a] * line.d0;
    h[1] += basis.value[1][a] * line.d0;
    h[2] += basis.value[0][a] * line.d1;
    h[3] += basis.value[2][a] * line.d0;
    h[4] += basis.value[1][a] * line.d1;
    h[5] += basis.value[0][a] * line.d2;
  }
  return h;
}

// Loops over a known number of points unroll: Pu, Pv are the degrees, or -1 for any.
template <int Pu, int Pv>
void grid(const NurbsSurface& surface, std::span<const BasisValues> u, std::span<const BasisValues> v,
          std::span<SurfaceJet> jets) {
  const int count_u = Pu >= 0 ? Pu + 1 : surface.u().degree() + 1;
  const int count_v = Pv >= 0 ? Pv + 1 : surface.v().degree() + 1;
  const bool rational = surface.rational();
  std::array<LineJet, max_degree + 1> lines;
  for (std::size_t begin = 0, end; begin < u.size(); begin = end) {
    const int first_u = u[begin].first;
    for (end = begin + 1; end < u.size() && u[end].first == first_u;) ++end;
    for (std::size_t j = 0; j < v.size(); ++j) {
      for (int a = 0; a < count_u; ++a)
        lines[static_cast<std::size_t>(a)] = contract(v[j], count_v, [&](int b) {
          return detail::homogeneous_point(surface, surface.index(first_u + a, v[j].first + b));
        });
      for (std::size_t i = begin; i < end; ++i)
        jets[i + u.size() * j] = detail::to_jet(contract_lines(u[i], count_u, lines.data()), rational);
    }
  }
}

template <int Pu, int Pv>
void cell(const NurbsSurface& surface, int span_u, int span_v, std::span<const Eigen::Vector2d> parameters,
          std::span<SurfaceJet> jets) {
  const int count_u = Pu >= 0 ? Pu + 1 : surface.u().degree() + 1;
  const int count_v = Pv >= 0 ? Pv + 1 : surface.v().degree() + 1;
  const bool rational = surface.rational();
  std::array<Eigen::Vector4d, (Pu >= 0 ? Pu + 1 : max_degree + 1) * (Pv >= 0 ? Pv + 1 : max_degree + 1)> net;
  for (int b = 0; b < count_v; ++b)
    for (int a = 0; a < count_u; ++a)
      net[static_cast<std::size_t>(a + count_u * b)] =
          detail::homogeneous_point(surface, surface.index(span_u - count_u + 1 + a, span_v - count_v + 1 + b));
  std::array<LineJet, max_degree + 1> lines;
  BasisValues bu, bv;
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    evaluate_basis_on_span(surface.u(), span_u, parameters[k].x(), 2, bu);
    evaluate_basis_on_span(surface.v(), span_v, parameters[k].y(), 2, bv);
    for (int b = 0; b < count_v; ++b)
      lines[static_cast<std::size_t>(b)] =
          contract(bu, count_u, [&](int a) { return net[static_cast<std::size_t>(a + count_u * b)]; });
    detail::HomogeneousJet h = contract_lines(bv, count_v, lines.data());
    // The lines run along u here: first and second direction change places.
    std::swap(h[1], h[2]);
    std::swap(h[3], h[5]);
    jets[k] = detail::to_jet(h, rational);
  }
}

}  // namespace

std::vector<BasisValues> tabulate_basis(const KnotVector& knots, std::span<const double> parameters) {
  std::vector<BasisValues> table(parameters.size());
  for (std::size_t i = 0; i < parameters.size(); ++i) evaluate_basis(knots, parameters[i], 2, table[i]);
  return table;
}

void evaluate_grid(const NurbsSurface& surface, std::span<const BasisValues> u, std::span<const BasisValues> v,
                   std::span<SurfaceJet> jets) {
  assert(jets.size() == u.size() * v.size());
  const int pu = surface.u().degree(), pv = surface.v().degree();
  if (pu == 2 && pv == 2) return grid<2, 2>(surface, u, v, jets);
  if (pu == 3 && pv == 3) return grid<3, 3>(surface, u, v, jets);
  grid<-1, -1>(surface, u, v, jets);
}

void evaluate_on_span(const NurbsSurface& surface, int span_u, int span_v, std::span<const Eigen::Vector2d> parameters,
                      std::span<SurfaceJet> jets) {
  assert(jets.size() == parameters.size());
  const int pu = surface.u().degree(), pv = surface.v().degree();
  if (pu == 2 && pv == 2) return cell<2, 2>(surface, span_u, span_v, parameters, jets);
  if (pu == 3 && pv == 3) return cell<3, 3>(surface, span_u, span_v, parameters, jets);
  cell<-1, -1>(surface, span_u, span_v, parameters, jets);
}

}  // namespace toile
