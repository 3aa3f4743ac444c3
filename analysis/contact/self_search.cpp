// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/contact/self_search.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "analysis/contact/pair_geometry.h"

namespace toile {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector2d;
using Eigen::Vector3d;

// In a chart, below which sewn cloth may touch, and from which it keeps its whole thickness.
constexpr double free_offsets = 3, whole_offsets = 12;
constexpr double beyond = 0.05;  // of an edge or triangle: so far outside of it something may pass through it

bool inside(double share, double slack) {
  return share >= -slack && share <= 1 + slack;
}

}  // namespace

SelfSearch::SelfSearch(const ContactProxy& proxy, Matrix3Xd rest, double largest_chord,
                       const std::vector<SewnChart>& charts)
    : proxy_(proxy),
      rest_(std::move(rest)),
      largest_chord_(largest_chord),
      charts_(charts.empty() ? 0 : static_cast<std::size_t>(proxy.vertices())) {
  for (std::size_t c = 0; c < charts.size(); ++c)
    for (const auto& [vertex, place] : charts[c].places)
      charts_[static_cast<std::size_t>(vertex)].push_back({static_cast<int>(c), place});
  std::map<std::pair<int, int>, int> number;  // of panel and knot cell
  std::vector<int> cell_of_vertex(static_cast<std::size_t>(proxy.vertices()), -1);
  std::vector<std::vector<int>> around(static_cast<std::size_t>(proxy.vertices()));  // cells
  for (std::size_t t = 0; t < proxy.triangles().size(); ++t) {
    const auto& triangle = proxy.triangles()[t];
    const auto [at, added] =
        number.try_emplace({proxy.panel(triangle[0]), proxy.cells()[t]}, static_cast<int>(cells_.size()));
    if (added) cells_.emplace_back();
    const int cell = at->second;
    cells_[static_cast<std::size_t>(cell)].triangles.push_back(static_cast<int>(t));
    for (const int v : triangle) {
      std::vector<int>& there = around[static_cast<std::size_t>(v)];
      if (std::ranges::find(there, cell) == there.end()) there.push_back(cell);
      int& own = cell_of_vertex[static_cast<std::size_t>(v)];
      if (own >= 0) continue;
      own = cell;
      cells_[static_cast<std::size_t>(cell)].vertices.push_back(v);
    }
    thickest_ = std::max(thickest_, proxy.half_thickness(triangle[0]));
  }
  for (std::size_t e = 0; e < proxy.edges().size(); ++e) {
    const auto& [a, b] = proxy.edges()[e];
    for (const int cell : around[static_cast<std::size_t>(a)])
      if (std::ranges::find(around[static_cast<std::size_t>(b)], cell) != around[static_cast<std::size_t>(b)].end()) {
        cells_[static_cast<std::size_t>(cell)].edges.push_back(static_cast<int>(e));
        break;
      }
  }
  beside_.resize(cells_.size());
  for (const std::vector<int>& there : around)
    for (const int a : there)
      beside_[static_cast<std::size_t>(a)].insert(beside_[static_cast<std::size_t>(a)].end(), there.begin(),
                                                  there.end());
  for (std::vector<int>& list : beside_) {
    std::ranges::sort(list);
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  boxes_.resize(cells_.size());
  cones_.resize(cells_.size());
  triangle_boxes_.resize(proxy.triangles().size());
  edge_boxes_.resize(proxy.edges().size());
}

// Boxes of where the cells' vertices go, and how much their triangles turn.
void SelfSearch::set_cells(const Moved& m) {
  const auto around = [&](std::span<const int> vertices) {
    Box box;
    for (const int v : vertices) box.extend(m.from.col(v)).extend(m.at.col(v));
    return box;
  };
  for (std::size_t t = 0; t < triangle_boxes_.size(); ++t) triangle_boxes_[t] = around(proxy_.triangles()[t]);
  for (std::size_t e = 0; e < edge_boxes_.size(); ++e) edge_boxes_[e] = around(proxy_.edges()[e]);
  std::vector<Vector3d> normals;
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    boxes_[c].setEmpty();
    normals.clear();
    Vector3d mean = Vector3d::Zero();
    for (const int t : cells_[c].triangles) {
      boxes_[c].extend(triangle_boxes_[static_cast<std::size_t>(t)]);
      const auto& [i, j, k] = proxy_.triangles()[static_cast<std::size_t>(t)];
      for (const Matrix3Xd* places : {&m.from, &m.at}) {
        const Vector3d normal = (places->col(j) - places->col(i)).cross(places->col(k) - places->col(i));
        normals.push_back(normal.normalized());
        mean += normals.back();
      }
    }
    Cone& cone = cones_[c];
    cone.axis = mean.normalized();
    cone.cosine = 1;
    for (const Vector3d& normal : normals) cone.cosine = std::min(cone.cosine, normal.dot(cone.axis));
  }
}

// Whether all triangles of two cells face within a right angle of each other.
bool SelfSearch::flat(int a, int b) const {
  const Cone &one = cones_[static_cast<std::size_t>(a)], &other = cones_[static_cast<std::size_t>(b)];
  const auto angle = [](double cosine) { return std::acos(std::clamp(cosine, -1.0, 1.0)); };
  return angle(one.cosine) + angle(other.cosine) + angle(one.axis.dot(other.axis)) < std::acos(0.0);
}

bool SelfSearch::neighbours(int a, int b) const {
  return std::ranges::binary_search(beside_[static_cast<std::size_t>(a)], b);
}

std::vector<SelfMeeting> SelfSearch::find(const Matrix3Xd& from, const Matrix3Xd& at, double margin) {
  const Moved moved{from, at, margin};
  set_cells(moved);
  if (tree_.size() == 0)
    tree_ = BoundsTree(boxes_);
  else
    tree_.refit(boxes_);
  std::vector<SelfMeeting> out;
  const auto look = [&](int a, int b) {
    if (neighbours(a, b) && flat(a, b)) return;
    vertices_to_triangles(moved, a, b, out);
    if (a != b) vertices_to_triangles(moved, b, a, out);
    edges_to_edges(moved, a, b, out);
  };
  const double reach = 2 * (thickest_ + largest_chord_) + margin;
  for (int c = 0; c < static_cast<int>(cells_.size()); ++c) look(c, c);
  tree_.own_pairs(reach, look);
  std::ranges::sort(out, {}, [](const SelfMeeting& m) { return std::array{int(m.edges), m.first, m.second}; });
  return out;
}

void SelfSearch::vertices_to_triangles(const Moved& m, int a, int b, std::vector<SelfMeeting>& out) const {
  const double reach = 2 * (thickest_ + largest_chord_) + m.margin;
  for (const int v : cells_[static_cast<std::size_t>(a)].vertices) {
    Box way(m.at.col(v));
    way.extend(m.from.col(v));
    if (!within(way, boxes_[static_cast<std::size_t>(b)], reach)) continue;
    for (const int t : cells_[static_cast<std::size_t>(b)].triangles) {
      if (!within(way, triangle_boxes_[static_cast<std::size_t>(t)], reach)) continue;
      const std::array<int, 3>& corners = proxy_.triangles()[static_cast<std::size_t>(t)];
      const int i = corners[0], j = corners[1], k = corners[2];
      if (v == i || v == j || v == k) continue;
      const auto height = [&](const Matrix3Xd& x) {
        const Vector3d normal = (x.col(j) - x.col(i)).cross(x.col(k) - x.col(i)).normalized();
        return normal.dot(x.col(v) - x.col(i));
      };
      const double before = height(m.from), after = height(m.at);
      double side = before < 0 ? -1 : 1;
      std::optional<Vector3d> w;
      if (before * after < 0) {
        // Through the triangle: held where it passed, wherever it ends. Past it: on the side where it ends.
        const double part = before / (before - after);
        const auto there = [&](int n) -> Vector3d { return (1 - part) * m.from.col(n) + part * m.at.col(n); };
        w = weights_below(there(i), there(j), there(k), there(v));
        if (w && w->minCoeff() < -beyond) w.reset();
        if (!w) side = -side;
      }
      if (!w) {
        w = weights_below(m.at.col(i), m.at.col(j), m.at.col(k), m.at.col(v));
        if (!w || w->minCoeff() < 0) continue;
      }
      SelfMeeting meeting;
      meeting.first = v;
      meeting.second = t;
      meeting.vertices = {{v, 1.0}, {i, -(*w)[0]}, {j, -(*w)[1]}, {k, -(*w)[2]}};
      meeting.normal = side * (m.at.col(j) - m.at.col(i)).cross(m.at.col(k) - m.at.col(i)).normalized();
      add(m, std::move(meeting), out);
    }
  }
}

void SelfSearch::edges_to_edges(const Moved& m, int a, int b, std::vector<SelfMeeting>& out) const {
  const double reach = 2 * (thickest_ + largest_chord_) + m.margin;
  for (const int e : cells_[static_cast<std::size_t>(a)].edges) {
    const Box& box = edge_boxes_[static_cast<std::size_t>(e)];
    if (!within(box, boxes_[static_cast<std::size_t>(b)], reach)) continue;
    const auto [p, q] = proxy_.edges()[static_cast<std::size_t>(e)];
    for (const int f : cells_[static_cast<std::size_t>(b)].edges) {
      if ((a == b && f <= e) || !within(box, edge_boxes_[static_cast<std::size_t>(f)], reach)) continue;
      const auto [r, s] = proxy_.edges()[static_cast<std::size_t>(f)];
      if (p == r || p == s || q == r || q == s) continue;
      const Vector3d along = m.at.col(q) - m.at.col(p), other = m.at.col(s) - m.at.col(r);
      auto shares = nearest_on_lines(m.at.col(p), along, m.at.col(r), other);
      if (!shares) continue;
      const auto apart = [&, p = p, q = q, r = r, s = s](const Matrix3Xd& x) -> Vector3d {
        const auto [u, v] = *shares;
        return (1 - u) * x.col(p) + u * x.col(q) - (1 - v) * x.col(r) - v * x.col(s);
      };
      Vector3d normal = along.cross(other).normalized();
      const double before = normal.dot(apart(m.from)), after = normal.dot(apart(m.at));
      if (before < 0) normal = -normal;
      double slack = 0;
      if (before * after < 0) {
        const double part = before / (before - after);
        const auto there = [&](int n) -> Vector3d { return (1 - part) * m.from.col(n) + part * m.at.col(n); };
        const auto then = nearest_on_lines(there(p), there(q) - there(p), there(r), there(s) - there(r));
        if (then && inside((*then)[0], beyond) && inside((*then)[1], beyond)) {
          shares = then;
          slack = beyond;
        } else {
          normal = -normal;
        }
      }
      const auto [u, v] = *shares;
      if (!inside(u, slack) || !inside(v, slack)) continue;
      SelfMeeting meeting;
      meeting.edges = true;
      meeting.first = e;
      meeting.second = f;
      meeting.vertices = {{p, 1 - u}, {q, u}, {r, v - 1}, {s, -v}};
      meeting.normal = normal;
      add(m, std::move(meeting), out);
    }
  }
}

// The least that its two places are from each other in any chart that has both; infinite where none has.
double SelfSearch::chart_distance(const SelfMeeting& meeting) const {
  double least = HUGE_VAL;
  if (charts_.empty()) return least;
  const auto of = [&](int vertex) -> const std::vector<OnChart>& { return charts_[static_cast<std::size_t>(vertex)]; };
  for (const OnChart& on : of(meeting.vertices.front().first)) {
    Vector2d apart = Vector2d::Zero();
    const bool all = std::ranges::all_of(meeting.vertices, [&](const auto& entry) {
      const auto& list = of(entry.first);
      const auto there = std::ranges::find(list, on.chart, &OnChart::chart);
      if (there == list.end()) return false;
      apart += entry.second * there->place;
      return true;
    });
    if (all) least = std::min(least, apart.lpNorm<1>());
  }
  return least;
}

// With its thickness and chord errors, if that may be touched.
void SelfSearch::add(const Moved& m, SelfMeeting meeting, std::vector<SelfMeeting>& out) const {
  const std::size_t of_first = meeting.edges ? 2 : 1;  // entries of `vertices`
  Vector3d now = Vector3d::Zero(), before = now, rest = now;
  std::array<double, 2> half{}, chord{};
  for (std::size_t k = 0; k < meeting.vertices.size(); ++k) {
    const auto& [vertex, share] = meeting.vertices[k];
    now += share * m.at.col(vertex);
    before += share * m.from.col(vertex);
    rest += share * rest_.col(vertex);
    double& own = half[k < of_first ? 0 : 1];
    own = std::max(own, proxy_.half_thickness(vertex));
  }
  meeting.thickness = half[0] + half[1];
  const double gap = meeting.normal.dot(now);
  if (gap > meeting.thickness + 2 * largest_chord_ + m.margin) return;
  for (std::size_t k = 0; k < meeting.vertices.size(); ++k) {
    const bool first = k < of_first;
    double& own = chord[first ? 0 : 1];
    const Vector3d out_of_cloth = first ? meeting.normal : Vector3d(-meeting.normal);
    own = std::max(own, proxy_.chord_error(meeting.vertices[k].first, m.at, out_of_cloth));
  }
  meeting.chord = std::min(chord[0], largest_chord_) + std::min(chord[1], largest_chord_);
  meeting.distance = meeting.normal.dot(before);
  const double offset = meeting.thickness + meeting.chord;
  const bool one_panel = proxy_.panel(meeting.vertices.front().first) == proxy_.panel(meeting.vertices.back().first);
  if (gap > offset + m.margin || (one_panel && rest.norm() < offset)) return;
  const double sewn = chart_distance(meeting) / offset;
  if (sewn < free_offsets) return;
  if (sewn < whole_offsets) {
    const double part = (sewn - free_offsets) / (whole_offsets - free_offsets);
    meeting.thickness *= part;
    meeting.chord *= part;
    if (gap > part * offset + m.margin) return;
  }
  out.push_back(std::move(meeting));
}

}  // namespace toile
