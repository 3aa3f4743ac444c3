// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/contact/contact_projection.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "analysis/contact/anderson.h"
#include "analysis/contact/bounds_tree.h"
#include "analysis/contact/self_search.h"
#include "analysis/parallel/workers.h"
#include "geometry/clock.h"
#include "geometry/error.h"

namespace toile {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Nodes = Eigen::Ref<VectorXd>;

// Kinds of contact: of the cloth's vertices, edges and triangles with faces, sharp edges and vertices of an obstacle,
// of its vertices and edges with its own triangles and edges.
enum Kind { vertex_to_face, edge_to_edge, face_to_vertex, vertex_to_cloth, edge_to_cloth };

constexpr double stiffness = 100;            // a contact yields by 1 / this of its offset under its own weight
constexpr double deep = 0.1;                 // of the offset: a start nearer than this is moved off slowly
constexpr double normal_tolerance = 0.02;    // of the offset
constexpr double tangent_tolerance = 0.002;  // of acceleration dt^2, and of acceleration dt for velocities
constexpr double force_tolerance = 0.01;     // of the normal impulse, if that allows more
constexpr double slip = 5;                   // times that an anchor is left behind
constexpr double inner_tolerance = 0.1;      // of these, within a round
constexpr double least_offset = 1e-5;        // m, that displacements are compared with
constexpr double parallel = 0.05;            // sine of the angle below which edges meet nowhere in particular
constexpr double spare = 0.02;               // m, that a vertex may move before it is looked at again, at least
constexpr int most_advances = 500;           // along a path
constexpr int most_sweeps = 10, last_sweeps = 100, refreshed_rounds = 2, depth = 4;

Vector3d sum_of(const std::vector<std::pair<int, double>>& row, const Nodes& x) {
  Vector3d y = Vector3d::Zero();
  for (const auto& [node, value] : row) y += value * x.segment<3>(3 * node);
  return y;
}

std::vector<Box> boxes(std::span<const Segment> edges) {
  std::vector<Box> out;
  for (const Segment& edge : edges) out.push_back(Box(edge.from).extend(edge.to));
  return out;
}
std::vector<Box> boxes(std::span<const Vector3d> vertices) {
  return {vertices.begin(), vertices.end()};
}

Vector3d shortened(const Vector3d& v, double limit) {
  const double length = v.norm();
  return length > limit ? Vector3d(v * (limit / length)) : v;
}

Vector3d across(const Vector3d& v, const Vector3d& normal) {
  return v - normal.dot(v) * normal;
}

// The nearest point of an obstacle, seen from the side that the cloth is on.
struct Meeting : SurfacePoint {
  int side = 1;
};
// `side` 0: the side of p, of an obstacle that has two; else the outside.
std::optional<Meeting> nearest(const Obstacle& obstacle, const Vector3d& p, double reach, int side) {
  const std::optional<SurfacePoint> near = obstacle.nearest(p, reach);
  if (!near) return std::nullopt;
  Meeting out{*near, side};
  if (side == 0) out.side = obstacle.closed() || near->distance >= 0 ? 1 : -1;
  if (out.side < 0) {
    out.normal = -out.normal;
    out.distance = -out.distance;
  }
  return out;
}

}  // namespace

struct ContactProjection::Impl {
  AffineMap map;
  ContactProxy proxy;
  VectorXd drag_rate;  // 1/s, per node
  std::vector<Obstacle*> obstacles;
  std::unique_ptr<ConstraintSolver> inner;
  ContactOptions options;
  Workers* workers = nullptr;
  ConstraintRows no_rows;

  double dt = 0;
  Matrix3Xd fixed_before, fixed_now, from, at;  // from, at: of the proxy's vertices at the start, in the candidate
  VectorXd candidate, candidate_v, pushed, held;
  std::vector<ContactRow> rows;
  std::vector<std::vector<ContactRow>> found;  // per piece of vertices
  std::vector<int> row_at;                     // per obstacle and vertex, -1: none
  // Per obstacle and vertex: where it was looked at, and how far from there nothing is near.
  std::vector<Matrix3Xd> looked_at;
  std::vector<VectorXd> clear;
  struct Sharp {  // of an obstacle
    BoundsTree edges, vertices;
  };
  std::vector<Sharp> sharp;
  std::optional<SelfSearch> self;
  int worst = -1;  // row that the last sweep moved most
  ProjectionMemory memory;
  Counts counts;

  Impl(const Body& body, const AffineMap& m, const VectorXd& mass, const VectorXd& node_drag,
       std::vector<ProxyPanel> panels, const std::vector<std::unique_ptr<Obstacle>>& all,
       std::unique_ptr<ConstraintSolver> other, const ContactOptions& o)
      : map(m),
        proxy(body, m, mass, panels),
        drag_rate(node_drag.cwiseQuotient(mass)),
        inner(std::move(other)),
        options(o) {
    for (const auto& obstacle : all) {
      obstacles.push_back(obstacle.get());
      looked_at.emplace_back(Matrix3Xd::Zero(3, proxy.vertices()));
      clear.emplace_back(VectorXd::Zero(proxy.vertices()));
      sharp.push_back({BoundsTree(boxes(obstacle->sharp_edges())), BoundsTree(boxes(obstacle->sharp_vertices()))});
    }
    if (options.self) {
      Matrix3Xd rest(3, proxy.vertices());
      for (int v = 0; v < proxy.vertices(); ++v) rest.col(v) = apply(proxy.points(v), body.rest());
      self.emplace(proxy, std::move(rest), options.largest_chord);
    }
    memory = inner ? inner->memory() : no_impulses(no_rows);
    memory.contact = VectorXd::Zero(3 * map.control_points());
    memory.by_obstacle = Matrix3Xd::Zero(3, static_cast<Eigen::Index>(obstacles.size()));
  }

  double friction(int panel, int obstacle) const {
    return options.friction.size() > 0 ? options.friction(panel, obstacle)
                                       : obstacles[static_cast<std::size_t>(obstacle)]->friction();
  }
  double touch(const ContactRow& row) const { return std::max(row.offset, least_offset); }

  void push(const ContactRow& row, const Vector3d& impulse, Nodes x) const {
    for (const auto& [node, value] : row.nodes) x.segment<3>(3 * node) += value * proxy.inverse_mass()[node] * impulse;
  }
  void set_nodes(ContactRow& row) const;
  void warm(const ContactForces& kept);
  void look(int vertex, int obstacle, std::vector<ContactRow>& out);
  void look_at_sharp(int obstacle);
  void look_at_cloth();
  void search(const ContactForces& kept);
  void add_bulges();
  void take_up(ContactRow& row, const ContactForces& kept) const;
  void refresh(const Nodes& x);
  double sweep(Nodes x);
  ContactForces keep(const Nodes& x) const;
  void note_impulses();
  VectorXd impulses() const;
  void set_impulses(const VectorXd& z);
};

// Nodes and weights of a row from its vertices.
void ContactProjection::Impl::set_nodes(ContactRow& row) const {
  const ComposedRows& all = proxy.rows();
  row.nodes.clear();
  row.constant = row.fixed_velocity = Vector3d::Zero();
  for (const auto& [vertex, share] : row.vertices) {
    for (int e = all.free.start[vertex]; e < all.free.start[vertex + 1]; ++e)
      row.nodes.emplace_back(all.free.column[e], share * all.free.value[e]);
    for (int e = all.fixed.start[vertex]; e < all.fixed.start[vertex + 1]; ++e) {
      const int k = all.fixed.column[e];
      const double value = share * all.fixed.value[e];
      row.constant += value * fixed_now.col(k);
      row.fixed_velocity += value / dt * (fixed_now.col(k) - fixed_before.col(k));
    }
  }
  if (row.vertices.size() > 1) {
    std::ranges::sort(row.nodes, {}, &std::pair<int, double>::first);
    std::size_t last = 0;
    for (std::size_t k = 1; k < row.nodes.size(); ++k) {
      if (row.nodes[k].first == row.nodes[last].first)
        row.nodes[last].second += row.nodes[k].second;
      else
        row.nodes[++last] = row.nodes[k];
    }
    row.nodes.resize(std::min(row.nodes.size(), last + 1));
  }
  row.weight = 0;
  for (const auto& [node, value] : row.nodes) row.weight += value * value * proxy.inverse_mass()[node];
}

// Displacement by the forces of the step before.
void ContactProjection::Impl::warm(const ContactForces& kept) {
  pushed.setZero(3 * map.nodes());
  ContactRow row;
  for (Eigen::Index k = 0; k < kept.force.cols(); ++k) {
    const int* key = kept.key.data() + 4 * k;
    if (key[0] != vertex_to_face) continue;
    row.vertices = {{key[1], 1.0}};
    set_nodes(row);
    push(row, dt * dt * kept.force.col(k), pushed);
  }
}

// A contact of a vertex with an obstacle that may be at work in this step.
void ContactProjection::Impl::look(int vertex, int index, std::vector<ContactRow>& out) {
  const Obstacle& obstacle = *obstacles[static_cast<std::size_t>(index)];
  const Vector3d to = at.col(vertex), start = from.col(vertex);
  Matrix3Xd& seen = looked_at[static_cast<std::size_t>(index)];
  VectorXd& free = clear[static_cast<std::size_t>(index)];
  if (obstacle.still() && (to - seen.col(vertex)).norm() < free[vertex] &&
      (start - seen.col(vertex)).norm() < free[vertex])
    return;

  const double own = proxy.half_thickness(vertex) + obstacle.thickness(), largest = own + options.largest_chord;
  const double margin = std::max(largest, least_offset);  // beyond the offset: what others may push here
  Vector3d before = start;                                // as if the obstacle had stood still where it is now
  if (!obstacle.still()) {
    const auto near = obstacle.nearest(to, (to - start).norm() + largest + margin + spare);
    if (near) before = obstacle.carry(start, near->feature);
  }
  const double motion = (to - before).norm(), reach = motion + largest + margin + spare;
  const std::optional<Meeting> first = nearest(obstacle, before, reach, 0);
  seen.col(vertex) = before;
  free[vertex] = (first ? std::abs(first->distance) : reach) - largest - margin;
  if (!first || free[vertex] > motion) return;
  const int side = first->side;

  const double offset = own + std::min(proxy.chord_error(vertex, at, first->normal), options.largest_chord);
  std::optional<Meeting> hit;
  if (first->distance > 0 && motion > std::max(offset, least_offset)) {
    // Moves along the path by what is surely free, so that nothing thin is passed. [Hart 1996]
    const double stop = 0.5 * offset;
    double s = 0, distance = first->distance;
    std::optional<Meeting> near = first;
    for (int k = 0; near && distance > stop && s < 1 && k < most_advances; ++k) {
      s = std::min(1.0, s + (distance - 0.5 * stop) / motion);
      near = nearest(obstacle, before + s * (to - before), reach, side);
      if (near) distance = near->distance;
    }
    if (near && (distance <= stop || s < 1)) hit = near;  // where it got to, at the worst
  }
  if (!hit) hit = nearest(obstacle, to, reach + std::abs(first->distance), side);
  if (!hit) return;

  ContactRow row;
  row.key = {vertex_to_face, vertex, 0, index};
  row.vertices = {{vertex, 1.0}};
  row.normal = hit->normal;
  row.target = hit->point;
  row.offset = own;
  row.chord = offset - own;
  if (row.normal.dot(to - row.target) - offset > margin) return;
  row.distance = first->distance;
  row.friction = friction(proxy.panel(vertex), index);
  row.feature = hit->feature;
  row.side = side;
  row.anchor = before;
  row.obstacle_move = obstacle.carry(row.target, hit->feature) - row.target;
  set_nodes(row);
  if (row.weight > 0) out.push_back(std::move(row));
}

// Whether the way out from a sharp edge or vertex at `point` along `normal` is free: otherwise a face is met there.
bool leads_out(const Obstacle& obstacle, const Vector3d& point, const Vector3d& normal, double step) {
  const auto near = obstacle.nearest(point + step * normal, 2 * step);
  return near && near->distance > 0.9 * step;
}

// Contacts of the cloth's edges and triangles with what is sharp of an obstacle, where the cloth was outside.
void ContactProjection::Impl::look_at_sharp(int index) {
  Obstacle& obstacle = *obstacles[static_cast<std::size_t>(index)];
  const std::span<const Segment> edges = obstacle.sharp_edges();
  const std::span<const Vector3d> vertices = obstacle.sharp_vertices();
  if (edges.empty() && vertices.empty()) return;
  Sharp& features = sharp[static_cast<std::size_t>(index)];
  if (!obstacle.still()) {
    features.edges.refit(boxes(edges));
    features.vertices.refit(boxes(vertices));
  }
  const double round = obstacle.sharp_radius(), own = obstacle.thickness() + round + options.largest_chord;
  const Matrix3Xd& seen = looked_at[static_cast<std::size_t>(index)];
  const VectorXd& free = clear[static_cast<std::size_t>(index)];
  // The cloth within a distance of a vertex meets nothing.
  const auto far = [&](int vertex, double distance) {
    return obstacle.still() && free[vertex] > distance + (at.col(vertex) - seen.col(vertex)).norm() &&
           free[vertex] > distance + (from.col(vertex) - seen.col(vertex)).norm();
  };
  const auto start_of = [&](int vertex) -> Vector3d {
    if (obstacle.still()) return from.col(vertex);
    const auto near = obstacle.nearest(at.col(vertex), HUGE_VAL);
    return near ? obstacle.carry(from.col(vertex), near->feature) : Vector3d(from.col(vertex));
  };
  const auto add = [&](ContactRow row, const Vector3d& normal, const Vector3d& target, const Vector3d& start) {
    row.normal = normal;
    row.target = target;
    const Vector3d now = [&] {
      Vector3d y = Vector3d::Zero();
      for (const auto& [vertex, share] : row.vertices) y += share * at.col(vertex);
      return y;
    }();
    double cloth = 0, chord = 0;
    for (const auto& [vertex, share] : row.vertices) {
      cloth = std::max(cloth, proxy.half_thickness(vertex));
      chord = std::max(chord, proxy.chord_error(vertex, at, normal));
    }
    row.chord = std::min(chord, options.largest_chord);
    row.offset = cloth + obstacle.thickness() + round + row.chord;
    if (normal.dot(now - target) - row.offset > std::max(row.offset, least_offset)) return;
    const auto before = obstacle.nearest(start, HUGE_VAL);
    if (!before || before->distance < 0 ||
        !leads_out(obstacle, target + round * normal, normal, std::max(row.offset - round, least_offset)))
      return;
    row.distance = row.offset;  // feature contacts hold what they have
    row.anchor = start;
    row.feature = before->feature;
    row.obstacle_move = obstacle.carry(target, row.feature) - target;
    row.friction = friction(proxy.panel(row.vertices[0].first), index);
    set_nodes(row);
    if (row.weight > 0) rows.push_back(std::move(row));
  };

  for (int e = 0; !edges.empty() && e < static_cast<int>(proxy.edges().size()); ++e) {
    const auto [a, b] = proxy.edges()[static_cast<std::size_t>(e)];
    const Vector3d along = at.col(b) - at.col(a);
    if (far(a, along.norm())) continue;
    const double reach = own + std::max(proxy.half_thickness(a), least_offset);
    Box box(at.col(a));
    box.extend(at.col(b)).extend(from.col(a)).extend(from.col(b));
    features.edges.meeting(box, 2 * reach, [&, a = a, b = b](int k) {
      const Segment& edge = edges[static_cast<std::size_t>(k)];
      const Vector3d d = edge.to - edge.from;
      const Vector3d normal = along.cross(d);
      if (!(normal.norm() > parallel * along.norm() * d.norm())) return;
      // Where the two lines are nearest.
      const Vector3d between = at.col(a) - edge.from;
      const double aa = along.squaredNorm(), dd = d.squaredNorm(), ad = along.dot(d), det = aa * dd - ad * ad;
      const double s = (ad * d.dot(between) - dd * along.dot(between)) / det,
                   u = (aa * d.dot(between) - ad * along.dot(between)) / det;
      if (!(s > 0 && s < 1 && u >= 0 && u <= 1)) return;
      const Vector3d target = edge.from + u * d;
      const Vector3d start = (1 - s) * start_of(a) + s * start_of(b);
      const Vector3d n = normal.normalized(), out = n.dot(start - target) < 0 ? Vector3d(-n) : n;
      add({.key = {edge_to_edge, e, k, index}, .vertices = {{a, 1 - s}, {b, s}}}, out, target, start);
    });
  }
  for (int t = 0; !vertices.empty() && t < static_cast<int>(proxy.triangles().size()); ++t) {
    const auto [a, b, c] = proxy.triangles()[static_cast<std::size_t>(t)];
    const Vector3d ab = at.col(b) - at.col(a), ac = at.col(c) - at.col(a);
    if (far(a, std::max(ab.norm(), ac.norm()))) continue;
    const double reach = own + std::max(proxy.half_thickness(a), least_offset);
    Box box(at.col(a));
    for (const int v : {a, b, c}) box.extend(at.col(v)).extend(from.col(v));
    features.vertices.meeting(box, 2 * reach, [&, a = a, b = b, c = c](int k) {
      const Vector3d& target = vertices[static_cast<std::size_t>(k)];
      const Vector3d normal = ab.cross(ac), way = target - at.col(a);
      const double area = normal.squaredNorm();
      if (!(area > 0)) return;
      const double v = normal.dot(way.cross(ac)) / area, w = normal.dot(ab.cross(way)) / area, u = 1 - v - w;
      if (!(u >= 0 && v >= 0 && w >= 0)) return;
      const Vector3d start = u * start_of(a) + v * start_of(b) + w * start_of(c);
      const Vector3d n = normal.normalized(), out = n.dot(start - target) < 0 ? Vector3d(-n) : n;
      add({.key = {face_to_vertex, t, k, index}, .vertices = {{a, u}, {b, v}, {c, w}}}, out, target, start);
    });
  }
}

void ContactProjection::Impl::look_at_cloth() {
  double margin = least_offset;
  for (int v = 0; v < proxy.vertices(); ++v) margin = std::max(margin, 2 * proxy.half_thickness(v));
  for (SelfMeeting& meeting : self->find(from, at, margin)) {
    ContactRow row;
    row.key = {meeting.edges ? edge_to_cloth : vertex_to_cloth, meeting.first, meeting.second, -1};
    row.vertices = std::move(meeting.vertices);
    row.normal = meeting.normal;
    row.offset = meeting.offset;
    row.chord = meeting.chord;
    row.distance = meeting.distance;
    for (const auto& [vertex, share] : row.vertices) {
      row.anchor += share * from.col(vertex);
      row.friction += 0.25 * proxy.friction(vertex);
    }
    set_nodes(row);
    if (row.weight > 0) rows.push_back(std::move(row));
  }
}

void ContactProjection::Impl::search(const ContactForces& kept) {
  const Clock::time_point start = Clock::now();
  const int count = proxy.vertices();
  found.resize(static_cast<std::size_t>(pieces(count)));
  share_pieces(workers, count, [&](int piece, int begin, int end) {
    std::vector<ContactRow>& own = found[static_cast<std::size_t>(piece)];
    own.clear();
    for (int vertex = begin; vertex < end; ++vertex)
      for (int k = 0; k < static_cast<int>(obstacles.size()); ++k) look(vertex, k, own);
  });
  rows.clear();
  for (std::vector<ContactRow>& own : found)
    for (ContactRow& row : own) rows.push_back(std::move(row));
  for (int k = 0; k < static_cast<int>(obstacles.size()); ++k) look_at_sharp(k);
  if (self) look_at_cloth();
  std::ranges::sort(rows, {}, &ContactRow::key);
  add_bulges();
  for (ContactRow& row : rows) {
    const double gap = row.distance - row.offset;
    if (gap < -deep * row.offset) row.bias = std::min(0.0, gap + options.push_out * dt);
    row.compliance = row.offset * row.weight / (stiffness * options.acceleration * dt * dt);
    take_up(row, kept);
  }
  counts.search_seconds += since(start);
}

// An obstacle that is round bulges between vertices as the cloth does: length of an edge times the angle between the
// normals at its ends over 8.
void ContactProjection::Impl::add_bulges() {
  row_at.assign(obstacles.size() * static_cast<std::size_t>(proxy.vertices()), -1);
  const auto slot = [&](int vertex, int obstacle) -> int& {
    return row_at[static_cast<std::size_t>(obstacle) * static_cast<std::size_t>(proxy.vertices()) +
                  static_cast<std::size_t>(vertex)];
  };
  for (std::size_t k = 0; k < rows.size(); ++k)
    if (rows[k].key[0] == vertex_to_face) slot(rows[k].key[1], rows[k].key[3]) = static_cast<int>(k);
  for (ContactRow& row : rows) {
    if (row.key[0] != vertex_to_face) continue;
    double bulge = 0;
    for (const int other : proxy.neighbours(row.key[1])) {
      const int k = slot(other, row.key[3]);
      if (k < 0) continue;
      const Vector3d turn = rows[static_cast<std::size_t>(k)].normal - row.normal,
                     edge = at.col(other) - at.col(row.key[1]);
      if (turn.dot(edge) > 0) bulge = std::max(bulge, edge.norm() * turn.norm() / 8);
    }
    row.chord = std::min(row.chord + bulge, options.largest_chord);
  }
  for (ContactRow& row : rows) row.offset += row.chord;
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
  const Vector3d force = dt * dt * kept.force.col(k);
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
    const auto near = nearest(obstacle, y, 2 * row.offset + std::abs(row.bias), row.side);
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
  const double least_slip = tangent_tolerance * options.acceleration * dt * dt;
  double largest = 0;
  for (ContactRow& row : rows) {
    const Vector3d y = sum_of(row.nodes, x) + row.constant;
    const double gap = row.normal.dot(y - row.target) - row.offset - row.bias;
    const double push_before = row.push;
    row.push = std::max(0.0, row.push - (gap + row.compliance * row.push) / (row.weight + row.compliance));
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
    largest = std::max({largest, std::abs(more) * row.weight / (normal_tolerance * touch(row)),
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
    out.force.col(k) = (row.push * row.normal + row.drag) / (dt * dt);
    const Vector3d y = sum_of(row.nodes, x) + row.constant;
    const bool slides =
        row.drag.norm() >= row.friction * row.push * (1 - 1e-9) &&
        across(y - row.anchor, row.normal).norm() > slip * tangent_tolerance * options.acceleration * dt * dt;
    out.anchor.col(k++) = slides ? y : row.anchor;
  }
  return out;
}

ProjectionReport ContactProjection::step(Nodes x, Nodes v, double t, const Eigen::Ref<const VectorXd>& start, double dt,
                                         ConstraintForces& forces) {
  Impl& s = *impl_;
  s.dt = dt;
  for (Obstacle* obstacle : s.obstacles) obstacle->move(t - dt, t);
  s.map.fixed_places(t - dt, s.fixed_before);
  s.map.fixed_places(t, s.fixed_now);
  s.proxy.positions(start, s.fixed_before, s.from, s.workers);
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
    if (round == 0) {
      s.proxy.positions(x, s.fixed_now, s.at, s.workers);
      s.search(at_start.contact);
      s.pushed.setZero();
      for (const ContactRow& row : s.rows) s.push(row, row.push * row.normal + row.drag, s.pushed);
      x += s.pushed - s.held;
    } else if (round <= refreshed_rounds) {
      s.refresh(x);
    }
    z = s.impulses();
    const Clock::time_point sweeping = Clock::now();
    const double first = s.sweep(x);
    settled = first <= 1;
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
    report.contact_work += (row.push * row.normal + row.drag).dot(row.obstacle_move) / (dt * dt);
  }
  return report;
}

double ContactProjection::settle(Nodes v, double t) {
  Impl& s = *impl_;
  double work = s.inner ? s.inner->settle(v, t) : 0;
  const double tolerance = tangent_tolerance * s.options.acceleration * s.dt;
  for (int k = 0; k < last_sweeps; ++k) {
    double largest = 0;
    for (ContactRow& row : s.rows) {
      if (row.push == 0) continue;
      const Vector3d u = sum_of(row.nodes, v) + row.fixed_velocity - row.obstacle_move / s.dt;
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
    if (row.push > 0) work += (row.velocity_push * row.normal + row.velocity_drag).dot(row.obstacle_move) / s.dt;
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
    const Vector3d impulse = (1 + 0.5 * dt * rate / all) * (row.push * row.normal + row.drag +
                                                            dt * (row.velocity_push * row.normal + row.velocity_drag));
    for (const auto& [vertex, share] : row.vertices) {
      const ScalarRow& points = proxy.points(vertex);
      for (std::size_t k = 0; k < points.index.size(); ++k)
        memory.contact.segment<3>(3 * points.index[k]) += share * points.value[k] * impulse;
    }
    if (row.key[3] >= 0) memory.by_obstacle.col(row.key[3]) += impulse;
  }
}

ContactProjection::ContactProjection(const Body& body, const AffineMap& map, const VectorXd& node_mass,
                                     const VectorXd& node_drag, std::vector<ProxyPanel> panels,
                                     const std::vector<std::unique_ptr<Obstacle>>& obstacles,
                                     std::unique_ptr<ConstraintSolver> inner, const ContactOptions& options)
    : impl_(std::make_unique<Impl>(body, map, node_mass, node_drag, std::move(panels), obstacles, std::move(inner),
                                   options)) {}
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
const ContactProxy& ContactProjection::proxy() const {
  return impl_->proxy;
}
const ContactProjection::Counts& ContactProjection::counts() const {
  return impl_->counts;
}

}  // namespace toile
