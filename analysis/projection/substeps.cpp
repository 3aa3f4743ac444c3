// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/projection/substeps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "analysis/constraint/composed_rows.h"
#include "analysis/linear/cholesky.h"
#include "analysis/parallel/workers.h"
#include "analysis/projection/fast_projection.h"
#include "analysis/projection/row_kernels.h"
#include "geometry/error.h"

namespace toile {
namespace {

// Of the largest stable substep, which for lagging damping is 2 / sqrt((1 + 2 damping) eigenvalue).
constexpr double substep_safety = 0.98;
constexpr double stiffest = 16;
constexpr double most_substeps = 1e6;  // in a step

}  // namespace

struct Substeps::Impl {
  AffineMap map;
  ConstraintRows rows;
  SubstepsOptions options;
  ComposedRows composed;
  Eigen::VectorXd mass;
  CompressedRows at_node;      // M^-1 D^T of the strain rows
  std::vector<double> reach;   // per strain row: sum of |d| over nodes; 0: takes no part
  std::vector<char> warp;      // per strain row, beside all else that a row has
  std::vector<int> partner;    // strain row of the other direction at its point; -1
  std::vector<double> weight;  // per strain row: its part of the whole area
  std::vector<Slack> slack;
  std::vector<int> held;  // strain rows at fixed control points
  Workers* workers = nullptr;

  std::vector<std::unique_ptr<RowKernel>> kernels;
  int nets = 0;
  std::vector<KernelPoint> node;
  std::vector<std::pair<int, KernelPoint>> fixed;  // fixed control point, and each kernel's copy

  CompressedRows place_rows, place_nodes;  // N on nodes, M^-1 N^T
  std::unique_ptr<Cholesky> place_factor;  // of N M^-1 N^T

  Eigen::Matrix3Xd y, targets, fixed_places, gap, mu;
  Eigen::VectorXd strain, stiffness, stiff_row, skews, stiffening;
  Eigen::VectorXd places_of_y;
  double time_of_y = 0;
  // Forces at the start and the end of the last step: of what memory() shows when asked.
  struct Ends {
    double dt = 0;
    Eigen::Matrix3Xd y_start, y_end;
    Eigen::VectorXd start, end;
    Eigen::Matrix3Xd held;  // sum over substeps, of the held rows
    bool shown = true;
  } ends;
  Eigen::VectorXd before, push, rhs, solution;
  std::vector<double> held_before;
  ProjectionMemory memory;
  std::unique_ptr<FastProjection> projection;  // made where a start breaks the limits

  Impl(const AffineMap& m, const Eigen::VectorXd& node_mass, ConstraintRows r, const SubstepsOptions& o);

  int strains() const { return static_cast<int>(rows.strain.size()); }
  int places() const { return static_cast<int>(rows.place.size()); }
  const StrainBand& band(int r) const { return warp[r] ? options.warp : options.weft; }
  double excess(int r, double c) const { return slack[static_cast<std::size_t>(r)].excess(c); }

  void check_rows();
  void make_kernels();
  std::optional<NetRows> net_rows(const TensorNet& net, const std::vector<int>& node_of,
                                  const std::vector<int>& fixed_of) const;
  void make_place_factor();

  void at(double t) {
    map.fixed_places(t, fixed_places);
    for (int p = 0; p < places(); ++p) targets.col(p) = rows.place[static_cast<std::size_t>(p)].target(t);
  }
  void move_fixed() {
    for (const auto& [k, point] : fixed)
      for (int c = 0; c < 3; ++c) point.x[c * point.stride] = fixed_places(c, k);
  }
  void find_strains(const Eigen::Ref<const Eigen::VectorXd>& x, double t);
  void measure(const Eigen::Ref<const Eigen::VectorXd>& x, double t, ProjectionReport& report);
  void load(const Eigen::Ref<const Eigen::VectorXd>& start);
  void store(Eigen::Ref<Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> v) const;
  void flow(double t, double h, int count, double damping);
  double violation(int r) const {
    const StrainBand& b = band(r);
    const double c = strain[r];
    return b.slack > 0 ? std::max({c - b.stretch, -b.compress - c, 0.0}) : std::abs(c);
  }
  double bound();
  void meet_places(double h);
  void add_held(double kick, double damping);
  Eigen::Vector3d direction(int r) const;
  double energy() const;
  void forces(Eigen::VectorXd& lambda) const;
  void show_impulses();
  void stiffen(double within, double dt, ConstraintForces& forces) const;
  void set_stiffness(const Eigen::VectorXd& stiffening);
};

Substeps::Impl::Impl(const AffineMap& m, const Eigen::VectorXd& node_mass, ConstraintRows r, const SubstepsOptions& o)
    : map(m),
      rows(std::move(r)),
      options(o),
      composed(compose(map, rows)),
      mass(node_mass),
      reach(rows.strain.size(), 0),
      partner(rows.strain.size(), -1),
      weight(rows.strain.size(), 0),
      y(3, strains() + places()),
      targets(3, places()),
      gap(3, places()),
      mu(3, places()),
      strain(strains()),
      stiffness(Eigen::VectorXd::Zero(strains())),
      stiff_row(strains()),
      skews(strains()),
      memory(no_impulses(rows)) {
  require_whole_places(rows);
  check_rows();
  make_kernels();
  make_place_factor();
  set_stiffness({});
}

void Substeps::Impl::check_rows() {
  const Eigen::VectorXd gram = gram_diagonal(map, rows, composed, mass);
  const CompressedRows &d = composed.free, &g = composed.fixed;
  CompressedRows of_strain;
  double total = 0;
  for (int r = 0; r < strains(); ++r) {
    const StrainRow& row = rows.strain[static_cast<std::size_t>(r)];
    if (!(row.stiffness > 0)) throw SolverError("strain limit: a row has no stiffness");
    for (int e = d.start[r]; e < d.start[r + 1]; ++e) reach[r] += std::abs(d.value[e]);
    if (g.start[r] < g.start[r + 1] && gram[r] > 0) held.push_back(r);
    warp.push_back(row.warp);
    const StrainBand& b = band(r);
    slack.push_back({-b.slack * b.compress, b.slack * b.stretch});
    weight[r] = gram[r] > 0 ? row.area : 0;
    total += weight[r];
    if (r > 0) {
      const StrainRow& last = rows.strain[static_cast<std::size_t>(r - 1)];
      if (last.panel == row.panel && last.point == row.point && last.uv == row.uv && last.warp != row.warp)
        partner[r] = r - 1, partner[r - 1] = r;
    }
  }
  for (int r = 0; r < strains(); ++r) weight[r] = total > 0 ? weight[r] / total : 1.0 / strains();
  of_strain.start.assign(d.start.begin(), d.start.begin() + strains() + 1);
  of_strain.column.assign(d.column.begin(), d.column.begin() + d.start[strains()]);
  of_strain.value.assign(d.value.begin(), d.value.begin() + d.start[strains()]);
  at_node = transposed_by_mass(of_strain, mass);
  held_before.assign(held.size(), 0);
  ends.held.resize(3, static_cast<Eigen::Index>(held.size()));
}

// The net's control points as nodes and fixed ones, with its rows; nothing where points of it follow others.
std::optional<NetRows> Substeps::Impl::net_rows(const TensorNet& net, const std::vector<int>& node_of,
                                                const std::vector<int>& fixed_of) const {
  NetRows out;
  out.count_u = net.count_u;
  out.count_v = net.count_v;
  const int count = net.count_u * net.count_v;
  for (int i = net.first; i < net.first + count; ++i) {
    out.node.push_back(node_of[static_cast<std::size_t>(i)]);
    out.fixed.push_back(fixed_of[static_cast<std::size_t>(i)]);
    if (out.node.back() < 0 && out.fixed.back() < 0) return std::nullopt;
  }
  for (int r = 0; r < strains(); ++r) {
    const StrainRow& row = rows.strain[static_cast<std::size_t>(r)];
    const auto inside = [&](int i) { return i >= net.first && i < net.first + count; };
    if (row.row.index.empty() || !inside(row.row.index[0])) continue;
    if (!std::ranges::all_of(row.row.index, inside)) return std::nullopt;
    out.rows.push_back({r, row.warp, row.uv});
  }
  return out;
}

void Substeps::Impl::make_kernels() {
  KernelInput input{&composed, strains(), &mass, slack, static_cast<int>(map.fixed().size())};
  // Control points that are a node or a fixed control point, and no other follows either.
  const auto points = static_cast<std::size_t>(map.control_points());
  std::vector<int> node_of(points, -1), fixed_of(points, -1);
  for (std::size_t k = 0; k < map.node_control_point().size(); ++k)
    node_of[static_cast<std::size_t>(map.node_control_point()[k])] = static_cast<int>(k);
  for (std::size_t k = 0; k < map.fixed().size(); ++k)
    fixed_of[static_cast<std::size_t>(map.fixed()[k])] = static_cast<int>(k);

  std::vector<bool> row_taken(rows.strain.size(), false), node_taken(static_cast<std::size_t>(mass.size()), false);
  for (const TensorNet& net : options.nets) {
    const std::optional<NetRows> its = net_rows(net, node_of, fixed_of);
    std::unique_ptr<RowKernel> kernel = its ? net_kernel(input, *its) : nullptr;
    if (!kernel) continue;
    kernels.push_back(std::move(kernel));
    ++nets;
    for (const NetRows::Row& r : its->rows) row_taken[static_cast<std::size_t>(r.row)] = true;
    for (const int k : its->node)
      if (k >= 0) node_taken[static_cast<std::size_t>(k)] = true;
  }
  std::vector<int> which, nodes;
  for (int r = 0; r < strains(); ++r)
    if (!row_taken[static_cast<std::size_t>(r)] && reach[r] > 0) which.push_back(r);
  for (int k = 0; k < mass.size(); ++k)
    if (!node_taken[static_cast<std::size_t>(k)]) nodes.push_back(k);
  if (!nodes.empty()) kernels.push_back(general_kernel(input, std::move(which), std::move(nodes)));

  node.resize(static_cast<std::size_t>(mass.size()));
  for (const auto& kernel : kernels) {
    for (int k = 0; k < mass.size(); ++k)
      if (const KernelPoint point = kernel->node(k); point.x) node[static_cast<std::size_t>(k)] = point;
    for (int k = 0; k < input.fixed; ++k)
      if (const KernelPoint point = kernel->fixed(k); point.x) fixed.emplace_back(k, point);
  }
}

void Substeps::Impl::make_place_factor() {
  if (places() == 0) return;
  const CompressedRows& d = composed.free;
  for (int r = strains(); r < d.size(); ++r) {
    for (int e = d.start[r]; e < d.start[r + 1]; ++e) {
      place_rows.column.push_back(d.column[e]);
      place_rows.value.push_back(d.value[e]);
    }
    place_rows.start.push_back(static_cast<int>(place_rows.column.size()));
  }
  place_nodes = transposed_by_mass(place_rows, mass);
  GramMatrix gram = gram_matrix(place_rows, mass);
  place_factor = std::make_unique<Cholesky>(std::move(gram.pattern));
  if (!place_factor->factorise(gram.value))
    throw SolverError("pins hold the same points twice: the rows of their places depend on each other");
  rhs.resize(places());
  solution.resize(places());
}

void Substeps::Impl::set_stiffness(const Eigen::VectorXd& factors) {
  if (stiffening.size() == strains() && (factors.size() > 0 ? factors == stiffening : (stiffening.array() == 1).all()))
    return;
  stiffening = factors.size() > 0 ? factors : Eigen::VectorXd::Ones(strains());
  for (int r = 0; r < strains(); ++r) stiffness[r] = rows.strain[static_cast<std::size_t>(r)].stiffness * stiffening[r];
  for (const auto& kernel : kernels) kernel->set_stiffness(stiffness);
}

// y and C, unless they are those of these places already.
void Substeps::Impl::find_strains(const Eigen::Ref<const Eigen::VectorXd>& x, double t) {
  if (t == time_of_y && x.size() == places_of_y.size() && x == places_of_y) return;
  share_out(workers, strains() + places(),
            [&](int begin, int end) { evaluate(composed, x, fixed_places, begin, end, y); });
  for (int r = 0; r < strains(); ++r) strain[r] = reach[r] > 0 ? 0.5 * (y.col(r).squaredNorm() - 1) : 0;
  places_of_y = x;
  time_of_y = t;
}

// And how far from limits and pins they are.
void Substeps::Impl::measure(const Eigen::Ref<const Eigen::VectorXd>& x, double t, ProjectionReport& report) {
  find_strains(x, t);
  report.strain_violation = report.place_violation = 0;
  report.worst_row = -1;
  double beyond = 0;
  for (int r = 0; r < strains(); ++r) {
    const double off = violation(r);
    if (!(off <= options.tolerance)) beyond += weight[r];  // NaN too
    if (off <= report.strain_violation || std::isnan(report.strain_violation)) continue;
    report.strain_violation = off;
    report.worst_row = r;
  }
  report.within = 1 - beyond;
  gap = y.rightCols(places()) - targets;
  for (int p = 0; p < places(); ++p)
    if (!(gap.col(p).norm() <= report.place_violation) && !std::isnan(report.place_violation))
      report.place_violation = gap.col(p).norm();
  report.converged = 100 * report.within >= options.percentile && report.place_violation <= options.place_tolerance &&
                     std::isfinite(report.strain_violation);
}

// G: no eigenvalue of M^-1 J^T k J is larger, by sums of absolute values. Of the two directions, which are nearly
// perpendicular, the larger counts, and more by what they are not; tension adds its own stiffness.
double Substeps::Impl::bound() {
  for (int r = 0; r < strains(); ++r) {
    const int p = partner[r];
    double skew = p > r || p < 0 ? 0 : skews[p];
    if (p > r)
      skew = std::abs(y.col(r).dot(y.col(p))) / std::sqrt(std::max((1 + 2 * strain[r]) * (1 + 2 * strain[p]), 1e-300));
    skews[r] = skew;
    stiff_row[r] = stiffness[r] * reach[r] * ((1 + 2 * strain[r]) * (1 + skew) + std::max(excess(r, strain[r]), 0.0));
  }
  double largest = 0;
  for (int k = 0; k < mass.size(); ++k) {
    std::array<double, 2> sum{};
    for (int e = at_node.start[k]; e < at_node.start[k + 1]; ++e) {
      const int r = at_node.column[e];
      sum[warp[r]] += std::abs(at_node.value[e]) * stiff_row[r];
    }
    largest = std::max({largest, sum[0], sum[1]});
  }
  return largest;
}

// Moves nodes onto the place rows, and what moved them so into their velocity.
void Substeps::Impl::meet_places(double h) {
  const CompressedRows& g = composed.fixed;
  for (int p = 0; p < places(); ++p) {
    Eigen::Vector3d at = -targets.col(p);
    for (int e = place_rows.start[p]; e < place_rows.start[p + 1]; ++e) {
      const KernelPoint& point = node[static_cast<std::size_t>(place_rows.column[e])];
      for (int c = 0; c < 3; ++c) at[c] += place_rows.value[e] * point.x[c * point.stride];
    }
    for (int e = g.start[strains() + p]; e < g.start[strains() + p + 1]; ++e)
      at += g.value[e] * fixed_places.col(g.column[e]);
    gap.col(p) = at;
  }
  for (int c = 0; c < 3; ++c) {
    rhs = gap.row(c);
    place_factor->solve(rhs, solution);
    mu.row(c) = solution;
  }
  for (int k = 0; k < mass.size(); ++k) {
    if (place_nodes.start[k] == place_nodes.start[k + 1]) continue;
    Eigen::Vector3d move = Eigen::Vector3d::Zero();
    for (int e = place_nodes.start[k]; e < place_nodes.start[k + 1]; ++e)
      move += place_nodes.value[e] * mu.col(place_nodes.column[e]);
    const KernelPoint& point = node[static_cast<std::size_t>(k)];
    for (int c = 0; c < 3; ++c) {
      point.x[c * point.stride] -= move[c];
      point.v[c * point.stride] -= move[c] / h;
    }
  }
  memory.place_multipliers += mu / h;
}

Eigen::Vector3d Substeps::Impl::direction(int r) const {
  const CompressedRows &d = composed.free, &g = composed.fixed;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int e = d.start[r]; e < d.start[r + 1]; ++e) {
    const KernelPoint& point = node[static_cast<std::size_t>(d.column[e])];
    for (int c = 0; c < 3; ++c) sum[c] += d.value[e] * point.x[c * point.stride];
  }
  for (int e = g.start[r]; e < g.start[r + 1]; ++e) sum += g.value[e] * fixed_places.col(g.column[e]);
  return sum;
}

void Substeps::Impl::add_held(double kick, double damping) {
  for (std::size_t k = 0; k < held.size(); ++k) {
    const int r = held[k];
    const Eigen::Vector3d along = direction(r);
    const double now = excess(r, 0.5 * (along.squaredNorm() - 1));
    ends.held.col(static_cast<Eigen::Index>(k)) +=
        kick * stiffness[r] * (now + damping * (now - held_before[k])) * along;
    held_before[k] = now;
  }
}

double Substeps::Impl::energy() const {
  double sum = 0;
  for (int r = 0; r < strains(); ++r) {
    const double e = excess(r, strain[r]);
    sum += 0.5 * stiffness[r] * e * e;
  }
  return sum;
}

void Substeps::Impl::forces(Eigen::VectorXd& lambda) const {
  lambda.resize(strains());
  for (int r = 0; r < strains(); ++r) lambda[r] = stiffness[r] * excess(r, strain[r]);
}

void Substeps::Impl::show_impulses() {
  if (ends.shown) return;
  ends.shown = true;
  memory.strain_multipliers = ends.dt * ends.dt * ends.end;
  memory.strain_impulses =
      (0.5 * ends.dt * ends.dt) * (ends.y_start * ends.start.asDiagonal() + ends.y_end * ends.end.asDiagonal());
  for (std::size_t k = 0; k < held.size(); ++k)
    memory.strain_impulses.col(held[k]) = ends.dt * ends.held.col(static_cast<Eigen::Index>(k));
}

void Substeps::Impl::stiffen(double within, double dt, ConstraintForces& forces) const {
  if (forces.stiffening.size() != strains()) forces.stiffening.setOnes(strains());
  if (forces.beyond.size() != strains()) forces.beyond.setZero(strains());
  const double more = std::exp2(dt / options.doubling);
  const bool held_all = 100 * within >= options.percentile;
  for (int r = 0; r < strains(); ++r) {
    if (!(violation(r) > options.tolerance)) {
      forces.beyond[r] = 0;
      continue;
    }
    forces.beyond[r] += dt;
    if (!held_all && forces.beyond[r] > options.doubling)
      forces.stiffening[r] = std::min(stiffest, more * forces.stiffening[r]);
  }
}

void Substeps::Impl::load(const Eigen::Ref<const Eigen::VectorXd>& start) {
  for (std::size_t k = 0; k < node.size(); ++k)
    for (std::size_t c = 0; c < 3; ++c) {
      const KernelPoint& point = node[k];
      const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(c) * point.stride;
      const auto i = static_cast<Eigen::Index>(3 * k + c);
      point.x[at] = start[i];
      point.v[at] = before[i];
      point.a[at] = push[i];
    }
  move_fixed();
}

void Substeps::Impl::store(Eigen::Ref<Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> v) const {
  for (std::size_t k = 0; k < node.size(); ++k)
    for (std::size_t c = 0; c < 3; ++c) {
      const KernelPoint& point = node[k];
      const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(c) * point.stride;
      const auto i = static_cast<Eigen::Index>(3 * k + c);
      x[i] = point.x[at];
      v[i] = point.v[at];
    }
}

// `count` substeps of h that end at t; the damping of the first half kick would need a substep before it.
void Substeps::Impl::flow(double t, double h, int count, double damping) {
  for (int k = 0; k <= count; ++k) {
    const bool first = k == 0, last = k == count;
    const double kick = first || last ? 0.5 * h : h;
    if (!held.empty()) add_held(kick, first ? 0 : damping);
    for (const auto& kernel : kernels) kernel->advance(kick, last ? 0 : h, first ? 0 : damping, workers);
    if (last) break;
    if (fixed.empty() && places() == 0) continue;
    at(t - (count - k - 1) * h);
    move_fixed();
    if (places() > 0) meet_places(h);
  }
}

ProjectionReport Substeps::step(Eigen::Ref<Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> v, double t,
                                const Eigen::Ref<const Eigen::VectorXd>& start, double dt, ConstraintForces& forces) {
  Impl& s = *impl_;
  ProjectionReport report;
  s.before = 2 * (x - start) / dt - v;
  s.push = (v - s.before) / dt;
  s.set_stiffness(forces.stiffening);
  s.at(t - dt);
  s.find_strains(start, t - dt);
  const double largest = substep_safety * 2 / std::sqrt((1 + 2 * s.options.damping) * s.bound());
  const double count = std::max(1.0, std::ceil(dt / largest));
  if (!(count <= most_substeps) || !(s.before.allFinite() && s.push.allFinite())) {
    x.setConstant(std::numeric_limits<double>::quiet_NaN());
    return report;
  }
  s.ends.dt = dt;
  s.ends.shown = false;
  s.ends.held.setZero();
  s.ends.y_start = s.y.leftCols(s.strains());
  s.forces(s.ends.start);
  s.memory.place_multipliers.setZero();

  const double h = dt / count;
  s.load(start);
  s.flow(t, h, static_cast<int>(count), s.options.damping * std::min(1.0, h / largest));
  s.store(x, v);

  s.at(t);
  s.measure(x, t, report);
  report.iterations = static_cast<int>(count);
  s.ends.y_end = s.y.leftCols(s.strains());
  s.forces(s.ends.end);
  forces.strain = s.ends.end;
  forces.place = s.memory.place_multipliers / dt;
  s.memory.place_multipliers *= dt;
  const double loose = s.energy();
  s.stiffen(report.within, dt, forces);
  s.set_stiffness(forces.stiffening);
  report.energy = s.energy();
  report.tightened = report.energy - loose;
  return report;
}

Substeps::Substeps(const AffineMap& map, const Eigen::VectorXd& node_mass, ConstraintRows rows,
                   const SubstepsOptions& options)
    : impl_(std::make_unique<Impl>(map, node_mass, std::move(rows), options)) {}
Substeps::~Substeps() = default;

ProjectionReport Substeps::project(Eigen::Ref<Eigen::VectorXd> x, double t) {
  Impl& s = *impl_;
  if (!s.projection) {
    s.projection = std::make_unique<FastProjection>(
        s.map, s.mass, s.rows,
        ProjectionOptions{.tolerance = s.options.tolerance, .place_tolerance = s.options.place_tolerance});
    s.projection->use_threads(s.workers);
  }
  const ProjectionReport report = s.projection->project(x, t);
  s.memory = s.projection->memory();
  s.ends.shown = true;
  return report;
}

ProjectionReport Substeps::measure(const Eigen::Ref<const Eigen::VectorXd>& x, double t) {
  ProjectionReport report;
  impl_->at(t);
  impl_->measure(x, t, report);
  return report;
}

double Substeps::energy(const Eigen::Ref<const Eigen::VectorXd>& x, double t) {
  measure(x, t);
  return impl_->energy();
}
const ProjectionMemory& Substeps::memory() const {
  impl_->show_impulses();
  return impl_->memory;
}
void Substeps::set_memory(const ProjectionMemory& memory) {
  impl_->memory = memory;
  impl_->ends.shown = true;
}
void Substeps::use_threads(Workers* workers) {
  if (impl_->projection) impl_->projection->use_threads(workers);
  impl_->workers = workers;
}
const ConstraintRows& Substeps::rows() const {
  return impl_->rows;
}
std::size_t Substeps::factor_nonzeros() const {
  return impl_->place_factor ? impl_->place_factor->factor_nonzeros() : 0;
}
int Substeps::nets() const {
  return impl_->nets;
}

}  // namespace toile
