// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/contact/contact_search.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "analysis/contact/pair_geometry.h"
#include "analysis/parallel/workers.h"

namespace toile {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double spare = 0.02;      // m, that a vertex may move before it is looked at again, at least
constexpr int most_advances = 500;  // along a path

std::vector<Box> boxes(std::span<const Segment> edges) {
  std::vector<Box> out;
  for (const Segment& edge : edges) out.push_back(Box(edge.from).extend(edge.to));
  return out;
}
std::vector<Box> boxes(std::span<const Vector3d> vertices) {
  return {vertices.begin(), vertices.end()};
}

// Whether the way out from a sharp edge or vertex at `point` along `normal` is free: otherwise a face is met there.
bool leads_out(const Obstacle& obstacle, const Vector3d& point, const Vector3d& normal, double step) {
  const auto near = obstacle.nearest(point + step * normal, 2 * step);
  return near && near->distance > 0.9 * step;
}

Vector3d sum_of(const ContactRow& row, const Matrix3Xd& places) {
  Vector3d y = Vector3d::Zero();
  for (const auto& [vertex, share] : row.vertices) y += share * places.col(vertex);
  return y;
}

// Where a vertex would have started if the obstacle had always stood where it is now.
Vector3d carried_start(const Obstacle& obstacle, const StepPlaces& places, int vertex) {
  const Vector3d start = places.from.col(vertex);
  if (obstacle.still()) return start;
  const auto near = obstacle.nearest(places.at.col(vertex), HUGE_VAL);
  return near ? obstacle.carry(start, near->feature) : start;
}

}  // namespace

void set_nodes(const ContactProxy& proxy, const StepPlaces& places, ContactRow& row) {
  const ComposedRows& all = proxy.rows();
  row.nodes.clear();
  row.constant = row.fixed_velocity = Vector3d::Zero();
  for (const auto& [vertex, share] : row.vertices) {
    for (int e = all.free.start[vertex]; e < all.free.start[vertex + 1]; ++e)
      row.nodes.emplace_back(all.free.column[e], share * all.free.value[e]);
    for (int e = all.fixed.start[vertex]; e < all.fixed.start[vertex + 1]; ++e) {
      const int k = all.fixed.column[e];
      const double value = share * all.fixed.value[e];
      row.constant += value * places.fixed_now.col(k);
      row.fixed_velocity += value / places.dt * (places.fixed_now.col(k) - places.fixed_before.col(k));
    }
  }
  if (row.vertices.size() > 1 && !row.nodes.empty()) {
    std::ranges::sort(row.nodes, {}, &std::pair<int, double>::first);
    std::size_t last = 0;
    for (std::size_t k = 1; k < row.nodes.size(); ++k) {
      if (row.nodes[k].first == row.nodes[last].first)
        row.nodes[last].second += row.nodes[k].second;
      else
        row.nodes[++last] = row.nodes[k];
    }
    row.nodes.resize(last + 1);
  }
  row.weight = 0;
  for (const auto& [node, value] : row.nodes) row.weight += value * value * proxy.inverse_mass()[node];
}

std::optional<Meeting> nearest_from_side(const Obstacle& obstacle, const Vector3d& p, double reach, int side) {
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

ContactSearch::ContactSearch(const ContactProxy& proxy, const Body& body, std::vector<Obstacle*> obstacles,
                             const ContactSearchOptions& options)
    : proxy_(proxy), obstacles_(std::move(obstacles)), options_(options) {
  for (const Obstacle* obstacle : obstacles_) {
    looked_at_.emplace_back(Matrix3Xd::Zero(3, proxy.vertices()));
    clear_.emplace_back(VectorXd::Zero(proxy.vertices()));
    sharp_.push_back({BoundsTree(boxes(obstacle->sharp_edges())), BoundsTree(boxes(obstacle->sharp_vertices()))});
  }
  if (!options_.self) return;
  Matrix3Xd rest(3, proxy.vertices());
  for (int v = 0; v < proxy.vertices(); ++v) rest.col(v) = apply(proxy.points(v), body.rest());
  self_.emplace(proxy, std::move(rest), options_.largest_chord, options_.charts);
}

double ContactSearch::friction(int panel, int obstacle) const {
  return options_.friction.size() > 0 ? options_.friction(panel, obstacle)
                                      : obstacles_[static_cast<std::size_t>(obstacle)]->friction();
}

double ContactSearch::friction_between(int vertex, int other) const {
  return options_.friction_of_panels.size() > 0 ? options_.friction_of_panels(proxy_.panel(vertex), proxy_.panel(other))
                                                : 0.5 * (proxy_.friction(vertex) + proxy_.friction(other));
}

std::vector<ContactRow> ContactSearch::find(const StepPlaces& places, Workers* workers) {
  places_ = &places;
  const int count = proxy_.vertices(), obstacles = static_cast<int>(obstacles_.size());
  found_.resize(static_cast<std::size_t>(pieces(count)));
  share_pieces(workers, count, [&](int piece, int begin, int end) {
    std::vector<ContactRow>& own = found_[static_cast<std::size_t>(piece)];
    own.clear();
    for (int vertex = begin; vertex < end; ++vertex)
      for (int k = 0; k < obstacles; ++k) look(vertex, k, own);
  });
  std::vector<ContactRow> rows;
  for (std::vector<ContactRow>& own : found_)
    for (ContactRow& row : own) rows.push_back(std::move(row));
  for (int k = 0; k < obstacles; ++k) {
    if (!obstacles_[static_cast<std::size_t>(k)]->still()) {
      Sharp& sharp = sharp_[static_cast<std::size_t>(k)];
      sharp.edges.refit(boxes(obstacles_[static_cast<std::size_t>(k)]->sharp_edges()));
      sharp.vertices.refit(boxes(obstacles_[static_cast<std::size_t>(k)]->sharp_vertices()));
    }
    look_at_edges(k, rows);
    look_at_vertices(k, rows);
  }
  if (self_) look_at_cloth(rows);
  std::ranges::sort(rows, {}, &ContactRow::key);
  add_bulges(rows);
  return rows;
}

// A contact of a vertex with an obstacle.
void ContactSearch::look(int vertex, int index, std::vector<ContactRow>& out) {
  const Obstacle& obstacle = *obstacles_[static_cast<std::size_t>(index)];
  const Vector3d to = places_->at.col(vertex), start = places_->from.col(vertex);
  if (far(index, vertex, 0)) return;

  const double own = proxy_.half_thickness(vertex) + obstacle.thickness(), largest = own + options_.largest_chord;
  const double margin = std::max(largest, least_offset);  // beyond the offset: what others may push here
  Vector3d before = start;                                // as if the obstacle had stood still where it is now
  if (!obstacle.still()) {
    const auto near = obstacle.nearest(to, (to - start).norm() + largest + margin + spare);
    if (near) before = obstacle.carry(start, near->feature);
  }
  const double motion = (to - before).norm(), reach = motion + largest + margin + spare;
  const std::optional<Meeting> first = nearest_from_side(obstacle, before, reach, 0);
  double& free = clear_[static_cast<std::size_t>(index)][vertex];
  looked_at_[static_cast<std::size_t>(index)].col(vertex) = before;
  free = (first ? std::abs(first->distance) : reach) - largest - margin;
  if (!first || free > motion) return;

  const double chord = std::min(proxy_.chord_error(vertex, places_->at, first->normal), options_.largest_chord);
  const double offset = own + chord;
  std::optional<Meeting> hit;
  if (first->distance > 0 && motion > std::max(offset, least_offset)) {
    // Moves along the path by what is surely free, so that nothing thin is passed. [Hart 1996]
    const double stop = 0.5 * offset;
    double s = 0, distance = first->distance;
    std::optional<Meeting> near = first;
    for (int k = 0; near && distance > stop && s < 1 && k < most_advances; ++k) {
      s = std::min(1.0, s + (distance - 0.5 * stop) / motion);
      near = nearest_from_side(obstacle, before + s * (to - before), reach, first->side);
      if (near) distance = near->distance;
    }
    if (near && (distance <= stop || s < 1)) hit = near;  // where it got to, at the worst
  }
  if (!hit) hit = nearest_from_side(obstacle, to, reach + std::abs(first->distance), first->side);
  if (!hit || hit->normal.dot(to - hit->point) - offset > margin) return;

  ContactRow row;
  row.key = {vertex_to_face, vertex, 0, index};
  row.vertices = {{vertex, 1.0}};
  row.normal = hit->normal;
  row.target = hit->point;
  row.offset = own;
  row.chord = chord;
  row.distance = first->distance;
  row.friction = friction(proxy_.panel(vertex), index);
  row.feature = hit->feature;
  row.side = first->side;
  row.anchor = before;
  row.obstacle_move = obstacle.carry(row.target, hit->feature) - row.target;
  set_nodes(proxy_, *places_, row);
  if (row.weight > 0) out.push_back(std::move(row));
}

// Whether nothing of a still obstacle is within `distance` of where the vertex was and is.
bool ContactSearch::far(int obstacle, int vertex, double distance) const {
  const auto k = static_cast<std::size_t>(obstacle);
  const double free = clear_[k][vertex] - distance;
  const auto moved = [&](const Matrix3Xd& places) { return (places.col(vertex) - looked_at_[k].col(vertex)).norm(); };
  return obstacles_[k]->still() && moved(places_->at) < free && moved(places_->from) < free;
}

// What meets a sharp edge or vertex: its side is that of the start of the step, where the cloth has to be outside.
void ContactSearch::add_sharp(ContactRow row, const Vector3d& normal, const Vector3d& target,
                              std::vector<ContactRow>& out) const {
  const int index = row.key[3];
  const Obstacle& obstacle = *obstacles_[static_cast<std::size_t>(index)];
  Vector3d start = Vector3d::Zero();
  double cloth = 0;
  for (const auto& [vertex, share] : row.vertices) {
    start += share * carried_start(obstacle, *places_, vertex);
    cloth = std::max(cloth, proxy_.half_thickness(vertex));
  }
  row.normal = normal.dot(start - target) < 0 ? Vector3d(-normal) : normal;
  const double round = obstacle.sharp_radius();
  row.target = target + round * row.normal;
  for (const auto& [vertex, share] : row.vertices)
    row.chord = std::max(row.chord, proxy_.chord_error(vertex, places_->at, row.normal));
  row.chord = std::min(row.chord, options_.largest_chord);
  row.offset = cloth + obstacle.thickness();
  const double offset = row.offset + row.chord, step = std::max(offset, least_offset);
  if (row.normal.dot(sum_of(row, places_->at) - row.target) > offset + step) return;
  const auto before = obstacle.nearest(start, HUGE_VAL);
  if (!before || before->distance < -round || !leads_out(obstacle, row.target, row.normal, step)) return;
  row.distance = row.normal.dot(start - row.target);
  row.anchor = start;
  row.feature = before->feature;
  row.obstacle_move = obstacle.carry(row.target, row.feature) - row.target;
  row.friction = friction(proxy_.panel(row.vertices[0].first), index);
  set_nodes(proxy_, *places_, row);
  if (row.weight > 0) out.push_back(std::move(row));
}

void ContactSearch::look_at_edges(int index, std::vector<ContactRow>& out) const {
  const Obstacle& obstacle = *obstacles_[static_cast<std::size_t>(index)];
  const std::span<const Segment> sharp = obstacle.sharp_edges();
  const Matrix3Xd &at = places_->at, &from = places_->from;
  for (int e = 0; !sharp.empty() && e < static_cast<int>(proxy_.edges().size()); ++e) {
    const auto [a, b] = proxy_.edges()[static_cast<std::size_t>(e)];
    const Vector3d along = at.col(b) - at.col(a);
    if (far(index, a, along.norm())) continue;
    const double largest = std::max(proxy_.half_thickness(a), least_offset) + obstacle.thickness() +
                           obstacle.sharp_radius() + options_.largest_chord;
    Box box(at.col(a));
    box.extend(at.col(b)).extend(from.col(a)).extend(from.col(b));
    sharp_[static_cast<std::size_t>(index)].edges.meeting(box, 2 * largest, [&, a = a, b = b](int k) {
      const Segment& edge = sharp[static_cast<std::size_t>(k)];
      const Vector3d d = edge.to - edge.from;
      const auto shares = nearest_on_lines(at.col(a), along, edge.from, d);
      if (!shares) return;
      const auto [s, u] = *shares;
      if (!(s > 0 && s < 1 && u >= 0 && u <= 1)) return;
      add_sharp({.key = {edge_to_edge, e, k, index}, .vertices = {{a, 1 - s}, {b, s}}}, along.cross(d).normalized(),
                edge.from + u * d, out);
    });
  }
}

void ContactSearch::look_at_vertices(int index, std::vector<ContactRow>& out) const {
  const Obstacle& obstacle = *obstacles_[static_cast<std::size_t>(index)];
  const std::span<const Vector3d> sharp = obstacle.sharp_vertices();
  const Matrix3Xd &at = places_->at, &from = places_->from;
  for (int t = 0; !sharp.empty() && t < static_cast<int>(proxy_.triangles().size()); ++t) {
    const auto [a, b, c] = proxy_.triangles()[static_cast<std::size_t>(t)];
    const Vector3d ab = at.col(b) - at.col(a), ac = at.col(c) - at.col(a);
    if (far(index, a, std::max(ab.norm(), ac.norm()))) continue;
    const double largest = std::max(proxy_.half_thickness(a), least_offset) + obstacle.thickness() +
                           obstacle.sharp_radius() + options_.largest_chord;
    Box box(at.col(a));
    for (const int v : {a, b, c}) box.extend(at.col(v)).extend(from.col(v));
    sharp_[static_cast<std::size_t>(index)].vertices.meeting(box, 2 * largest, [&, a = a, b = b, c = c](int k) {
      const Vector3d& target = sharp[static_cast<std::size_t>(k)];
      const auto w = weights_below(at.col(a), at.col(b), at.col(c), target);
      if (!w || !(w->minCoeff() >= 0)) return;
      add_sharp({.key = {face_to_vertex, t, k, index}, .vertices = {{a, (*w)[0]}, {b, (*w)[1]}, {c, (*w)[2]}}},
                ab.cross(ac).normalized(), target, out);
    });
  }
}

void ContactSearch::look_at_cloth(std::vector<ContactRow>& out) {
  double margin = least_offset;
  for (int v = 0; v < proxy_.vertices(); ++v) margin = std::max(margin, 2 * proxy_.half_thickness(v));
  for (SelfMeeting& meeting : self_->find(places_->from, places_->at, margin)) {
    ContactRow row;
    row.key = {meeting.edges ? edge_to_cloth : vertex_to_cloth, meeting.first, meeting.second, -1};
    row.vertices = std::move(meeting.vertices);
    row.normal = meeting.normal;
    row.offset = meeting.thickness;
    row.chord = meeting.chord;
    row.distance = meeting.distance;
    row.anchor = sum_of(row, places_->from);
    row.friction = friction_between(row.vertices.front().first, row.vertices.back().first);
    set_nodes(proxy_, *places_, row);
    if (row.weight > 0) out.push_back(std::move(row));
  }
}

// Whole offsets: with chord errors, and with what a round obstacle bulges between two vertices that meet it, the length
// between them times the angle between the normals there over 8.
void ContactSearch::add_bulges(std::vector<ContactRow>& rows) {
  const auto vertices = static_cast<std::size_t>(proxy_.vertices());
  row_at_.assign(obstacles_.size() * vertices, -1);
  const auto slot = [&](int vertex, int obstacle) -> int& {
    return row_at_[static_cast<std::size_t>(obstacle) * vertices + static_cast<std::size_t>(vertex)];
  };
  for (std::size_t k = 0; k < rows.size(); ++k)
    if (rows[k].key[0] == vertex_to_face) slot(rows[k].key[1], rows[k].key[3]) = static_cast<int>(k);
  for (ContactRow& row : rows) {
    if (row.key[0] != vertex_to_face) continue;
    double bulge = 0;
    for (const int other : proxy_.neighbours(row.key[1])) {
      const int k = slot(other, row.key[3]);
      if (k < 0) continue;
      const Vector3d turn = rows[static_cast<std::size_t>(k)].normal - row.normal,
                     edge = places_->at.col(other) - places_->at.col(row.key[1]);
      if (turn.dot(edge) > 0) bulge = std::max(bulge, edge.norm() * turn.norm() / 8);
    }
    row.chord = std::min(row.chord + bulge, options_.largest_chord);
  }
  for (ContactRow& row : rows) row.offset += row.chord;
}

}  // namespace toile
