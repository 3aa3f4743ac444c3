// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/contact/contact_projection.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "analysis/contact/anderson.h"
#include "analysis/parallel/workers.h"
#include "geometry/clock.h"

namespace toile {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Nodes = Eigen::Ref<VectorXd>;

constexpr double stiffness = 100;            // a contact yields by 1 / this of its offset under its own weight
constexpr double most_yielded = 0.3;         // of the offset, whatever the force
constexpr double deep = 0.1;                 // of the offset: a start nearer than this is moved off slowly
constexpr double normal_tolerance = 0.02;    // of the offset
constexpr double tangent_tolerance = 0.002;  // of acceleration dt^2, and of acceleration dt for velocities
constexpr double force_tolerance = 0.01;     // of the normal impulse, if that allows more
constexpr double slip = 5;                   // times tangent_tolerance, that an anchor is left behind
constexpr double inner_tolerance = 0.1;      // of these, within a round
constexpr int most_sweeps = 10, last_sweeps = 100, refreshed_rounds = 2, depth = 4;

Vector3d sum_of(const std::vector<std::pair<int, double>>& row, const Nodes& x) {
  Vector3d y = Vector3d::Zero();
  for (const auto& [node, value] : row) y += value * x.segment<3>(3 * node);
  return y;
}

Vector3d shortened(const Vector3d& v, double limit) {
  const double length = v.norm();
  return length > limit ? Vector3d(v * (limit / length)) : v;
}

Vector3d across(const Vector3d& v, const Vector3d& normal) {
  return v - normal.dot(v) * normal;
}

// How much a contact has yielded per impulse under the present one.
double yielding(const ContactRow& row) {
  return row.compliance / (1 + row.compliance * row.push / (most_yielded * std::max(row.offset, least_offset)));
}

std::vector<Obstacle*> pointers(const std::vector<std::unique_ptr<Obstacle>>& all) {
  std::vector<Obstacle*> out;
  for (const auto& obstacle : all) out.push_back(obstacle.get());
  return out;
}

}  // namespace

struct ContactProjection::Impl {
  AffineMap map;
  ContactProxy proxy;
  VectorXd drag_rate;  // 1/s, per node
  std::vector<Obstacle*> obstacles;
  ContactSearch search;
  std::unique_ptr<ConstraintSolver> inner;
  ContactOptions options;
  Workers* workers = nullptr;
  ConstraintRows no_rows;

  StepPlaces places;
  VectorXd candidate, candidate_v, pushed, held;
  std::vector<ContactRow> rows;
  int worst = -1;  // row that the last sweep moved most
  ProjectionMemory memory;
  Counts counts;

  Impl(const Body& body, const AffineMap& m, const VectorXd& mass, const VectorXd& node_drag,
       const std::vector<ProxyPanel>& panels, const std::vector<std::unique_ptr<Obstacle>>& all,
       std::unique_ptr<ConstraintSolver> other, const ContactOptions& o)
      : map(m),
        proxy(body, m, mass, panels),
        drag_rate(node_drag.cwiseQuotient(mass)),
        obstacles(pointers(all)),
        search(proxy, body, obstacles, o.search),
        inner(std::move(other)),
        options(o) {
    memory = inner ? inner->memory() : no_impulses(no_rows);
    memory.contact = VectorXd::Zero(3 * map.control_points());
    memory.by_obstacle = Matrix3Xd::Zero(3, static_cast<Eigen::Index>(obstacles.size()));
  }

  void push(const ContactRow& row, const Vector3d& impulse, Nodes x) const {
    for (const auto& [node, value] : row.nodes) x.segment<3>(3 * node) += value * proxy.inverse_mass()[node] * impulse;
  }
  void warm(const ContactForces& kept);
  void find(const ContactForces& kept);
  void take_up(ContactRow& row, const ContactForces& kept) const;
  void refresh(const Nodes& x);
  double sweep(Nodes x);
  ContactForces keep(const Nodes& x) const;
  void note_impulses();
  VectorXd impulses() const;
  void set_impulses(const VectorXd& z);
};

// Displacement by the forces of the step before.
void ContactProjection::Impl::warm(const ContactForces& kept) {
  pushed.setZero(3 * map.nodes());
  ContactRow row;
  for (Eigen::Index k = 0; k < kept.force.cols(); ++k) {
    const int* key = kept.key.data() + 4 * k;
    if (key[0] != vertex_to_face) continue;
    row.vertices = {{key[1], 1.0}};
    set_nodes(proxy, places, row);
    push(row, places.dt * places.dt * kept.force.col(k), pushed);
  }
}

// The contacts of the candidate, with the forces that they had in the step before.
void ContactProjection::Impl::find(const ContactForces& kept) {
  const Clock::time_point start = Clock::now();
  rows = search.find(places, workers);
  pushed.setZero();
  for (ContactRow& row : rows) {
    row.compliance = row.offset * row.weight / (stiffness * options.acceleration * places.dt * places.dt);
    take_up(row, kept);
    // As far as it would be without the force that it yields to: under a lasting one it would sink in, step by step.
    const double gap = row.distance - row.offset + yielding(row) * row.push;
    if (gap < -deep * row.offset) row.bias = std::min(0.0, gap + options.push_out * places.dt);
    row.advance = std::max(0.0, row.bias - gap);
    push(row, row.push * row.normal + row.drag, pushed);
  }
  counts.search_seconds += since(start);
}

// Forces and anchor of the same contact in the step before.
void ContactProjection::Impl::take_up(ContactRow& row, const ContactForces& kept) const {
  const auto number = [&](std::size_t k) {
    return std::array<int, 4>{kept.key[4 * k], kept.key[4 * k + 1], kept.key[4 * k + 2], kept.key[4 * k + 3]};
  };
  const std::size_t all = kept.key.size() / 4;
  std::size_t low = 0, high = all;  // the first that isn't less
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (number(middle) < row.key)
      low = middle + 1;
    else
      high = middle;
  }
  if (low == all || number(low) != row.key) return;
  const auto k = static_cast<Eigen::Index>(low);
  const Vector3d force = places.dt * places.dt * kept.force.col(k);
  row.push = std::max(0.0, row.normal.dot(force));
  row.drag = shortened(across(force, row.normal), row.friction * row.push);
  // Edges meet in another place of both in each step.
  if (row.key[0] == vertex_to_face)
    row.anchor = obstacles[static_cast<std::size_t>(row.key[3])]->carry(kept.anchor.col(k), row.feature);
}

// Normals where the contacts are now.
void ContactProjection::Impl::refresh(const Nodes& x) {
  for (ContactRow& row : rows) {
    if (row.push == 0 || row.key[0] != vertex_to_face) continue;
    const Obstacle& obstacle = *obstacles[static_cast<std::size_t>(row.key[3])];
    const Vector3d y = sum_of(row.nodes, x) + row.constant;
    const auto near = nearest_from_side(obstacle, y, 2 * row.offset + std::abs(row.bias), row.side);
    // Not where it went through something thin: there the plane that it met stays.
    if (!near || near->normal.dot(row.normal) < 0.7) continue;
    row.normal = near->normal;
    row.target = near->point;
    row.feature = near->feature;
    row.drag = across(row.drag, row.normal);
  }
}

// One pass over all contacts; the largest change over what is allowed.
double ContactProjection::Impl::sweep(Nodes x) {
  ++counts.sweeps;
  const double least_slip = tangent_tolerance * options.acceleration * places.dt * places.dt;
  double largest = 0;
  for (ContactRow& row : rows) {
    const Vector3d y = sum_of(row.nodes, x) + row.constant;
    const double gap = row.normal.dot(y - row.target) - row.offset - row.bias;
    const double push_before = row.push, yields = yielding(row);
    row.push = std::max(0.0, row.push - (gap + yields * row.push) / (row.weight + yields));
    const double more = row.push - push_before;
    const Vector3d drag_before = row.drag;
    if (row.push > 0)
      row.drag = shortened(row.drag - across(y - row.anchor, row.normal) / row.weight, row.friction * row.push);
    else
      row.drag.setZero();
    const Vector3d change = more * row.normal + row.drag - drag_before;
    if (change.isZero(0)) continue;
    push(row, change, x);
    push(row, change, pushed);
    const double before = largest;
    const double slip_allowed = std::max(least_slip, force_tolerance * row.weight * row.push);
    largest = std::max({largest, std::abs(more) * row.weight / (normal_tolerance * std::max(row.offset, least_offset)),
                        (row.drag - drag_before).norm() * row.weight / slip_allowed});
    if (largest > before) worst = static_cast<int>(&row - rows.data());
  }
  return largest;
}

// Of all contacts, in the metric of the masses.
VectorXd ContactProjection::Impl::impulses() const {
  VectorXd z(3 * static_cast<Eigen::Index>(rows.size()));
  for (std::size_t k = 0; k < rows.size(); ++k)
    z.segment<3>(3 * static_cast<Eigen::Index>(k)) =
        std::sqrt(rows[k].weight) * (rows[k].push * rows[k].normal + rows[k].drag);
  return z;
}
// Within the cones of friction.
void ContactProjection::Impl::set_impulses(const VectorXd& z) {
  pushed.setZero();
  for (std::size_t k = 0; k < rows.size(); ++k) {
    ContactRow& row = rows[k];
    const Vector3d impulse = z.segment<3>(3 * static_cast<Eigen::Index>(k)) / std::sqrt(row.weight);
    row.push = std::max(0.0, row.normal.dot(impulse));
    row.drag = shortened(across(impulse, row.normal), row.friction * row.push);
    push(row, row.push * row.normal + row.drag, pushed);
  }
}

ContactForces ContactProjection::Impl::keep(const Nodes& x) const {
  ContactForces out;
  const auto at_work = [](const ContactRow& row) { return row.push > 0; };
  const auto count = std::ranges::count_if(rows, at_work);
  out.force.resize(3, count);
  out.anchor.resize(3, count);
  Eigen::Index k = 0;
  for (const ContactRow& row : rows) {
    if (!at_work(row)) continue;
    out.key.insert(out.key.end(), row.key.begin(), row.key.end());
    out.force.col(k) = (row.push * row.normal + row.drag) / (places.dt * places.dt);
    const Vector3d y = sum_of(row.nodes, x) + row.constant;
    const bool slides = row.drag.norm() >= row.friction * row.push * (1 - 1e-9) &&
                        across(y - row.anchor, row.normal).norm() >
                            slip * tangent_tolerance * options.acceleration * places.dt * places.dt;
    out.anchor.col(k++) = slides ? y : row.anchor;
  }
  return out;
}

ProjectionReport ContactProjection::step(Nodes x, Nodes v, double t, const Eigen::Ref<const VectorXd>& start, double dt,
                                         ConstraintForces& forces) {
  Impl& s = *impl_;
  s.places.dt = dt;
  for (Obstacle* obstacle : s.obstacles) obstacle->move(t - dt, t);
  s.map.fixed_places(t - dt, s.places.fixed_before);
  s.map.fixed_places(t, s.places.fixed_now);
  s.proxy.positions(start, s.places.fixed_before, s.places.from, s.workers);
  s.candidate = x;
  s.candidate_v = v;
  const ConstraintForces at_start = forces;
  s.warm(at_start.contact);

  ProjectionReport report;
  ++s.counts.steps;
  bool settled = false;
  Anderson faster(depth);
  VectorXd z;
  for (int round = 0; round < s.options.max_rounds && !settled; ++round) {
    ++s.counts.rounds;
    x = s.candidate + s.pushed;
    v = s.candidate_v + s.pushed / dt;
    s.held = s.pushed;
    forces = at_start;
    if (s.inner) {
      const ProjectionReport one =
          round == 0 ? s.inner->step(x, v, t, start, dt, forces) : s.inner->again(x, v, t, start, dt, forces);
      const ProjectionReport before = std::exchange(report, one);
      report.iterations += before.iterations;
      report.factor_seconds += before.factor_seconds;
      report.solve_seconds += before.solve_seconds;
      if (!s.inner->end_velocity()) v += (x - s.candidate - s.pushed) / dt;
    } else {
      report.converged = true;
    }
    if (!x.allFinite()) {  // the step is refused
      s.rows.clear();
      report.contact_met = report.converged = false;
      return report;
    }
    if (round == 0) {
      s.proxy.positions(x, s.places.fixed_now, s.places.at, s.workers);
      s.find(at_start.contact);
      x += s.pushed - s.held;
    } else if (round <= refreshed_rounds) {
      s.refresh(x);
    }
    z = s.impulses();
    const Clock::time_point sweeping = Clock::now();
    settled = s.sweep(x) <= 1;
    const bool once = s.inner && !s.inner->follows();
    for (int k = 0; k < (once ? last_sweeps : most_sweeps) && !settled; ++k)
      if (s.sweep(x) <= inner_tolerance) break;
    s.counts.sweep_seconds += since(sweeping);
    if (s.rows.empty() || once) settled = true;
    if (!settled) s.set_impulses(faster.next(z, s.impulses()));
  }
  v += (s.pushed - s.held) / dt;
  report.contact_met = settled;
  report.converged = report.converged && settled;
  forces.contact = s.keep(x);
  s.note_impulses();
  for (const ContactRow& row : s.rows) {
    if (row.push == 0) continue;
    ++report.contacts;
    report.contact_work +=
        ((row.push * row.normal + row.drag).dot(row.obstacle_move) + row.push * row.advance) / (dt * dt);
  }
  return report;
}

double ContactProjection::settle(Nodes v, double t) {
  Impl& s = *impl_;
  double work = s.inner ? s.inner->settle(v, t) : 0;
  const double tolerance = tangent_tolerance * s.options.acceleration * s.places.dt;
  for (int k = 0; k < last_sweeps; ++k) {
    double largest = 0;
    for (ContactRow& row : s.rows) {
      if (row.push == 0) continue;
      const Vector3d u = sum_of(row.nodes, v) + row.fixed_velocity - row.obstacle_move / s.places.dt;
      const double push_before = row.velocity_push, apart = row.normal.dot(u);
      row.velocity_push -= apart / row.weight;
      // What is pushed out keeps nothing of that velocity.
      if (row.bias == 0 || apart > 2 * s.options.push_out) row.velocity_push = std::max(0.0, row.velocity_push);
      const Vector3d drag_before = row.velocity_drag;
      row.velocity_drag = shortened(row.velocity_drag - across(u, row.normal) / row.weight,
                                    row.friction * std::max(0.0, row.velocity_push));
      const Vector3d change = (row.velocity_push - push_before) * row.normal + row.velocity_drag - drag_before;
      s.push(row, change, v);
      largest = std::max(largest, change.norm() * row.weight);
    }
    ++s.counts.sweeps;
    if (largest <= inner_tolerance * tolerance) break;
  }
  for (const ContactRow& row : s.rows)
    if (row.push > 0) work += (row.velocity_push * row.normal + row.velocity_drag).dot(row.obstacle_move) / s.places.dt;
  s.note_impulses();
  return work;
}

// The whole step's, as if they had all moved the candidate.
void ContactProjection::Impl::note_impulses() {
  if (inner) {
    memory.strain_multipliers = inner->memory().strain_multipliers;
    memory.place_multipliers = inner->memory().place_multipliers;
    memory.strain_impulses = inner->memory().strain_impulses;
  }
  memory.contact.setZero();
  memory.by_obstacle.setZero();
  for (const ContactRow& row : rows) {
    if (row.push == 0) continue;
    // Accelerations are those of cloth that moves on, slowed down by drag; held cloth has no drag. [1 + c dt/2]
    double rate = 0, all = 0;
    for (const auto& [node, value] : row.nodes) {
      rate += std::abs(value) * drag_rate[node];
      all += std::abs(value);
    }
    const Vector3d impulse =
        (1 + 0.5 * places.dt * rate / all) *
        (row.push * row.normal + row.drag + places.dt * (row.velocity_push * row.normal + row.velocity_drag));
    for (const auto& [vertex, share] : row.vertices) {
      const ScalarRow& points = proxy.points(vertex);
      for (std::size_t k = 0; k < points.index.size(); ++k)
        memory.contact.segment<3>(3 * points.index[k]) += share * points.value[k] * impulse;
    }
    if (row.key[3] >= 0) memory.by_obstacle.col(row.key[3]) += impulse;
  }
}

ContactProjection::ContactProjection(const Body& body, const AffineMap& map, const VectorXd& node_mass,
                                     const VectorXd& node_drag, const std::vector<ProxyPanel>& panels,
                                     const std::vector<std::unique_ptr<Obstacle>>& obstacles,
                                     std::unique_ptr<ConstraintSolver> inner, const ContactOptions& options)
    : impl_(std::make_unique<Impl>(body, map, node_mass, node_drag, panels, obstacles, std::move(inner), options)) {}
ContactProjection::~ContactProjection() = default;

ProjectionReport ContactProjection::project(Nodes x, double t) {
  Impl& s = *impl_;
  if (!s.inner) return measure(x, t);
  const ProjectionReport report = s.inner->project(x, t);
  s.rows.clear();
  s.note_impulses();
  return report;
}
double ContactProjection::step_share() const {
  return impl_->inner ? impl_->inner->step_share() : 1;
}
ProjectionReport ContactProjection::measure(const Eigen::Ref<const VectorXd>& x, double t) {
  if (impl_->inner) return impl_->inner->measure(x, t);
  ProjectionReport report;
  report.converged = true;
  return report;
}
double ContactProjection::energy(const Eigen::Ref<const VectorXd>& x, double t) {
  return impl_->inner ? impl_->inner->energy(x, t) : 0;
}
const ProjectionMemory& ContactProjection::memory() const {
  return impl_->memory;
}
void ContactProjection::set_memory(const ProjectionMemory& memory) {
  impl_->memory = memory;
  if (!impl_->inner) return;
  ProjectionMemory other = memory;
  other.contact.resize(0);
  other.by_obstacle.resize(3, 0);
  impl_->inner->restore(other);
}
void ContactProjection::use_threads(Workers* workers) {
  impl_->workers = workers;
  if (impl_->inner) impl_->inner->use_threads(workers);
}
const ConstraintRows& ContactProjection::rows() const {
  return impl_->inner ? impl_->inner->rows() : impl_->no_rows;
}
std::size_t ContactProjection::factor_nonzeros() const {
  return impl_->inner ? impl_->inner->factor_nonzeros() : 0;
}
std::size_t ContactProjection::gram_nonzeros() const {
  return impl_->inner ? impl_->inner->gram_nonzeros() : 0;
}
const std::vector<ContactRow>& ContactProjection::contacts() const {
  return impl_->rows;
}
const ContactRow* ContactProjection::worst() const {
  return impl_->worst >= 0 && impl_->worst < static_cast<int>(impl_->rows.size())
             ? &impl_->rows[static_cast<std::size_t>(impl_->worst)]
             : nullptr;
}
ContactProjection::Counts& ContactProjection::Counts::operator+=(const Counts& more) {
  steps += more.steps;
  rounds += more.rounds;
  sweeps += more.sweeps;
  search_seconds += more.search_seconds;
  sweep_seconds += more.sweep_seconds;
  return *this;
}
const ContactProxy& ContactProjection::proxy() const {
  return impl_->proxy;
}
const ContactProjection::Counts& ContactProjection::counts() const {
  return impl_->counts;
}

}  // namespace toile
