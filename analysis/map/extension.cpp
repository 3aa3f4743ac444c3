// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/map/extension.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "analysis/map/nearest_cells.h"
#include "geometry/basis.h"
#include "geometry/error.h"

namespace toile {
namespace {

// One direction of the surface as cells between distinct knots.
struct Line {
  const KnotVector* knots;
  std::vector<double> breaks;
  std::vector<int> spans;                   // knot index of each cell
  std::vector<std::array<int, 2>> support;  // per function: cells [first, last) inside the domain
  std::vector<double> centre;               // per function: Greville abscissa in cells, clamped to the domain

  explicit Line(const KnotVector& k) : knots(&k), breaks(k.breaks()), spans(k.spans()) {
    const int p = k.degree();
    for (int i = 0; i < k.control_point_count(); ++i) {
      std::array<int, 2> range{cells(), 0};
      const auto first = std::ranges::lower_bound(spans, i), last = std::ranges::upper_bound(spans, i + p);
      if (first < last) range = {static_cast<int>(first - spans.begin()), static_cast<int>(last - spans.begin())};
      support.push_back(range);
      const double g = std::clamp(k.greville(i), breaks.front(), breaks.back());
      const auto above = std::upper_bound(breaks.begin() + 1, breaks.end() - 1, g);
      const int c = static_cast<int>(above - breaks.begin()) - 1;
      centre.push_back(c + (g - breaks[c]) / (breaks[c + 1] - breaks[c]));
    }
  }
  int cells() const { return static_cast<int>(breaks.size()) - 1; }
  int first(int cell) const { return spans[cell] - knots->degree(); }  // its first function
  double middle(int cell) const { return 0.5 * (breaks[cell] + breaks[cell + 1]); }
  double length(int cell) const { return breaks[cell + 1] - breaks[cell]; }
};

// How far, in functions, `function` lies outside those of the cell.
int outside(const Line& line, int cell, int function) {
  const int first = line.first(cell);
  return std::max({first - function, function - first - line.knots->degree(), 0});
}

struct Entry {
  int control_point;
  double value;
};
using Row = std::vector<Entry>;

class Extender {
 public:
  Extender(const NurbsSurface& rest, const CutQuadrature& quadrature, const Eigen::VectorXd& mass,
           const ExtensionOptions& options, const std::vector<int>& leader)
      : rest_(rest), quadrature_(quadrature), options_(options), u_(rest.u()), v_(rest.v()), leader_(leader) {
    if (leader_.empty()) {
      leader_.resize(size());
      std::iota(leader_.begin(), leader_.end(), 0);
    }
    mass_ = Eigen::VectorXd::Zero(size());
    members_.resize(size());
    for (int k = 0; k < size(); ++k) {
      mass_[leader_[k]] += mass[k];
      members_[leader_[k]].push_back(k);
    }
  }

  Extension run();

 private:
  enum class Role { own, extended, bare };
  struct Host {
    int i = -1, j = -1;
  };

  int size() const { return rest_.count_u() * rest_.count_v(); }
  void weigh();
  void find_hosts();
  struct Nearest {
    Host host;
    int control_point;  // the member of a seam that this host is near
  };
  Nearest nearest_host(int leader) const;
  Row polynomial_row(int control_point, Host host) const;
  Row tangent_row(int control_point, Host host) const;
  Eigen::Vector3d follow(const Row& row) const;
  double cell_size(Host host) const;
  void keep_what_moves_the_rest();
  void keep_what_takes_mass();

  const NurbsSurface& rest_;
  const CutQuadrature& quadrature_;
  const ExtensionOptions& options_;
  Line u_, v_;
  std::vector<int> leader_;
  std::vector<std::vector<int>> members_;  // of each leader, itself first
  Eigen::VectorXd mass_;                   // of leaders, their members' together
  std::vector<double> area_;               // of material per cell
  std::vector<double> support_;            // part of each leader's support in the material
  std::vector<Role> role_;                 // members have their leader's
  std::vector<char> host_;                 // cells all of whose functions stand on their own
  std::vector<NearestCell> nearest_;       // of those, to each control point
  std::vector<Row> rows_;                  // of extended and bare leaders, over leaders
};

void Extender::weigh() {
  area_.assign(u_.cells() * v_.cells(), 0.0);
  for (const CellRule& cell : quadrature_.cells) area_[cell.i + u_.cells() * cell.j] += cell.area;
  support_.resize(size());
  role_.resize(size());
  std::vector<double> material(size(), 0.0), whole(size(), 0.0);
  for (int j = 0; j < rest_.count_v(); ++j)
    for (int i = 0; i < rest_.count_u(); ++i) {
      const int k = leader_[rest_.index(i, j)];
      for (int b = v_.support[j][0]; b < v_.support[j][1]; ++b)
        for (int a = u_.support[i][0]; a < u_.support[i][1]; ++a) {
          material[k] += area_[a + u_.cells() * b];
          whole[k] += u_.length(a) * v_.length(b);
        }
    }
  for (int i = 0; i < size(); ++i) {
    const int k = leader_[i];
    support_[i] = whole[k] > 0 ? material[k] / whole[k] : 0;
    role_[i] = material[k] <= 0 ? Role::bare : support_[i] < options_.smallest_support ? Role::extended : Role::own;
  }
}

void Extender::find_hosts() {
  host_.assign(area_.size(), 0);
  for (int b = 0; b < v_.cells(); ++b)
    for (int a = 0; a < u_.cells(); ++a) {
      bool good = area_[a + u_.cells() * b] > 0;
      for (int j = v_.first(b); good && j <= v_.spans[b]; ++j)
        for (int i = u_.first(a); good && i <= u_.spans[a]; ++i) good = role_[rest_.index(i, j)] == Role::own;
      host_[a + u_.cells() * b] = good;
    }
}

Extender::Nearest Extender::nearest_host(int leader) const {
  Nearest nearest{{}, leader};
  double best_squared = std::numeric_limits<double>::infinity();
  for (const int member : members_[leader]) {
    const NearestCell& cell = nearest_[member];
    if (cell.distance_squared < best_squared)
      nearest = {{cell.i, cell.j}, member}, best_squared = cell.distance_squared;
  }
  return nearest;
}

Row Extender::polynomial_row(int control_point, Host host) const {
  const auto eu = extension_coefficients(rest_.u(), u_.spans[host.i], control_point % rest_.count_u());
  const auto ev = extension_coefficients(rest_.v(), v_.spans[host.j], control_point / rest_.count_u());
  Row row;
  for (std::size_t b = 0; b < ev.size(); ++b)
    for (std::size_t a = 0; a < eu.size(); ++a)
      if (const double e = eu[a] * ev[b]; e != 0)
        row.push_back(
            {leader_[rest_.index(u_.first(host.i) + static_cast<int>(a), v_.first(host.j) + static_cast<int>(b))], e});
  return row;
}

// Coefficients of an affine map are its values at the Greville abscissae.
Row Extender::tangent_row(int control_point, Host host) const {
  const double mu = u_.middle(host.i), mv = v_.middle(host.j);
  const double du = rest_.u().greville(control_point % rest_.count_u()) - mu;
  const double dv = rest_.v().greville(control_point / rest_.count_u()) - mv;
  BasisValues bu, bv;
  evaluate_basis_on_span(rest_.u(), u_.spans[host.i], mu, 1, bu);
  evaluate_basis_on_span(rest_.v(), v_.spans[host.j], mv, 1, bv);
  Row row;
  for (int b = 0; b <= bv.degree; ++b)
    for (int a = 0; a <= bu.degree; ++a)
      row.push_back({leader_[rest_.index(bu.first + a, bv.first + b)], bu.value[0][a] * bv.value[0][b] +
                                                                           du * bu.value[1][a] * bv.value[0][b] +
                                                                           dv * bu.value[0][a] * bv.value[1][b]});
  return row;
}

Eigen::Vector3d Extender::follow(const Row& row) const {
  Eigen::Vector3d q = Eigen::Vector3d::Zero();
  for (const Entry& e : row) q += e.value * rest_.points().col(e.control_point);
  return q;
}

double Extender::cell_size(Host host) const {
  const SurfaceJet s = evaluate(rest_, u_.middle(host.i), v_.middle(host.j));
  return std::sqrt(s.area_scale() * u_.length(host.i) * v_.length(host.j));
}

void Extender::keep_what_moves_the_rest() {
  // Largest value of every function within the material, at the quadrature points.
  std::vector<double> largest(size(), 0.0);
  SurfaceBasis basis;
  for (const CellRule& cell : quadrature_.cells) {
    bool needed = false;
    for (int j = v_.first(cell.j); j <= v_.spans[cell.j]; ++j)
      for (int i = u_.first(cell.i); i <= u_.spans[cell.i]; ++i)
        needed = needed || role_[rest_.index(i, j)] == Role::extended;
    if (!needed) continue;
    for (int q = cell.first; q < cell.first + cell.count; ++q) {
      evaluate_basis_on_span(rest_, u_.spans[cell.i], v_.spans[cell.j], quadrature_.points[q][0],
                             quadrature_.points[q][1], basis);
      for (int b = 0; b < basis.count_v; ++b)
        for (int a = 0; a < basis.count_u; ++a) {
          double& value = largest[leader_[rest_.index(basis.first_u + a, basis.first_v + b)]];
          value = std::max(value, basis.value[0][a + basis.count_u * b]);
        }
    }
  }
  for (int k = 0; k < size(); ++k) {
    if (role_[k] != Role::extended || leader_[k] != k) continue;
    const double move = (follow(rows_[k]) - rest_.points().col(k)).norm() * largest[k];
    if (move > options_.largest_deviation * cell_size(nearest_host(k).host)) role_[k] = Role::own;
  }
}

void Extender::keep_what_takes_mass() {
  // Takers by what they take of the function that ends lowest; one is given back at a time, so that no more are kept
  // than must be.
  std::vector<std::vector<Entry>> takers(size());
  Eigen::VectorXd reduced = mass_;
  for (int k = 0; k < size(); ++k) {
    if (role_[k] != Role::extended || leader_[k] != k) continue;
    for (const Entry& e : rows_[k]) {
      takers[e.control_point].push_back({k, e.value * mass_[k]});
      reduced[e.control_point] += e.value * mass_[k];
    }
  }
  for (int j = 0; j < size(); ++j) {
    if (role_[j] != Role::own || leader_[j] != j) continue;
    std::sort(takers[j].begin(), takers[j].end(), [](const Entry& a, const Entry& b) {
      return a.value != b.value ? a.value < b.value : a.control_point < b.control_point;
    });
    for (const Entry& taker : takers[j]) {
      if (reduced[j] >= options_.smallest_mass * mass_[j] || taker.value >= 0) break;
      const int k = taker.control_point;
      if (role_[k] != Role::extended) continue;
      role_[k] = Role::own;
      for (const Entry& e : rows_[k]) reduced[e.control_point] -= e.value * mass_[k];
    }
  }
}

Extension Extender::run() {
  weigh();
  find_hosts();
  if (quadrature_.cells.empty()) throw GeometryError("no material lies inside the trims");
  const std::vector<Role> wanted = role_;
  const bool any_host = std::find(host_.begin(), host_.end(), 1) != host_.end();
  if (!any_host) {
    // A panel smaller than its cells: every function with cloth stands on its own, so that its best cell can host.
    for (Role& role : role_)
      if (role == Role::extended) role = Role::own;
    find_hosts();
  }

  nearest_ = nearest_cells(u_.cells(), v_.cells(), host_, u_.centre, v_.centre);
  rows_.resize(size());
  for (int k = 0; k < size(); ++k) {
    if (role_[k] == Role::own || leader_[k] != k) continue;
    const auto [host, member] = nearest_host(k);
    if (role_[k] == Role::bare) {
      rows_[k] = tangent_row(member, host);
      continue;
    }
    // Further out than the degree the coefficients grow without bound: a thin part far from any good cell.
    const int p = std::max(rest_.u().degree(), rest_.v().degree());
    if (outside(u_, host.i, member % rest_.count_u()) > p || outside(v_, host.j, member / rest_.count_u()) > p)
      role_[k] = Role::own;
    else
      rows_[k] = polynomial_row(member, host);
  }
  keep_what_moves_the_rest();
  // Giving a function back returns what it added elsewhere, so a second look may be needed; each keeps at least one.
  for (std::vector<Role> before; before != role_;) {
    before = role_;
    keep_what_takes_mass();
  }

  Extension out;
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::Matrix3Xd net = rest_.points();
  for (int k = 0; k < size(); ++k) role_[k] = role_[leader_[k]];  // decided for leaders only
  for (int k = 0; k < size(); ++k) {
    out.carries_cloth.push_back(role_[k] != Role::bare);
    if (role_[k] == Role::own) {
      entries.emplace_back(k, leader_[k], 1.0);
      if (wanted[k] == Role::extended) out.kept.push_back(k);
      continue;
    }
    if (role_[k] == Role::extended) out.extended.push_back(k);
    const Row& row = rows_[leader_[k]];
    for (const Entry& e : row) entries.emplace_back(k, e.control_point, e.value);
    net.col(k) = follow(row);
  }
  out.dependence.resize(size(), size());
  out.dependence.setFromTriplets(entries.begin(), entries.end());
  out.rest = rest_.with_points(net);

  SurfaceBasis basis;
  const Eigen::Matrix3Xd moves = net - rest_.points();
  for (const CellRule& cell : quadrature_.cells)
    for (int q = cell.first; q < cell.first + cell.count; ++q) {
      evaluate_basis_on_span(rest_, u_.spans[cell.i], v_.spans[cell.j], quadrature_.points[q][0],
                             quadrature_.points[q][1], basis);
      Eigen::Vector3d move = Eigen::Vector3d::Zero();
      for (int b = 0; b < basis.count_v; ++b)
        for (int a = 0; a < basis.count_u; ++a)
          move += basis.value[0][a + basis.count_u * b] * moves.col(rest_.index(basis.first_u + a, basis.first_v + b));
      out.deviation = std::max(out.deviation, move.norm());
    }
  return out;
}

}  // namespace

std::vector<double> extension_coefficients(const KnotVector& knots, int span, int function) {
  const int p = knots.degree();
  const int first = span - p;
  std::vector<double> unit(p + 1, 0.0);
  if (function >= first && function <= span) {
    unit[function - first] = 1;  // without rounding
    return unit;
  }
  // de Boor's recursion with another argument in every level, on all coefficients at once: row j holds how d_j depends
  // on the span's p + 1 coefficients.
  std::vector<std::vector<double>> d(p + 1, unit);
  for (int j = 0; j <= p; ++j) d[j][j] = 1;
  for (int r = 1; r <= p; ++r) {
    const double t = knots[function + r];
    for (int j = p; j >= r; --j) {
      const double left = knots[first + j], right = knots[span + j + 1 - r];
      const double alpha = (t - left) / (right - left);
      for (int k = 0; k <= p; ++k) d[j][k] = (1 - alpha) * d[j - 1][k] + alpha * d[j][k];
    }
  }
  return d[p];
}

Extension extend(const NurbsSurface& rest, const CutQuadrature& quadrature, const Eigen::VectorXd& lumped_mass,
                 const ExtensionOptions& options, const std::vector<int>& leader) {
  return Extender(rest, quadrature, lumped_mass, options, leader).run();
}

Eigen::VectorXd mass_floor(const NurbsSurface& rest, double density, double fraction) {
  const Line u(rest.u()), v(rest.v());
  const auto mean_span = [](const Line& line, int i) {
    const auto [first, last] = line.support[i];
    return (line.breaks[last] - line.breaks[first]) / (last - first);
  };
  Eigen::VectorXd floor(rest.count_u() * rest.count_v());
  for (int j = 0; j < rest.count_v(); ++j)
    for (int i = 0; i < rest.count_u(); ++i) {
      const auto inside = [](const Line& line, double g) {
        return std::clamp(g, line.breaks.front(), line.breaks.back());
      };
      const SurfaceJet s = evaluate(rest, inside(u, rest.u().greville(i)), inside(v, rest.v().greville(j)));
      floor[rest.index(i, j)] = fraction * density * s.area_scale() * mean_span(u, i) * mean_span(v, j);
    }
  return floor;
}

Eigen::VectorXd floored_node_mass(const AffineMap& map, const Eigen::VectorXd& lumped_mass,
                                  const Eigen::VectorXd& floor) {
  Eigen::VectorXd mass = map.reduce_scalar(lumped_mass);
  for (int k = 0; k < map.nodes(); ++k) mass[k] = std::max(mass[k], floor[map.node_control_point()[k]]);
  return mass;
}

}  // namespace toile
