// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/mesh_repair.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <numeric>
#include <set>
#include <tuple>

#include "geometry/error.h"
#include "geometry/finite.h"
#include "geometry/text.h"

namespace toile {

namespace {

using Eigen::Vector3d;

// Vertices nearer than this are one, as a share of the mesh's size: some ten steps of the single precision that most
// files have.
constexpr double merging_share = 1e-6;
// A triangle lower than this has no area, as a share of the size.
constexpr double flat_share = 1e-9;

std::string at(const Vector3d& x) {
  const auto short_text = [](double value) { return text(std::round(value * 1e6) / 1e6 + 0.0); };
  std::string out = "(";
  for (int k = 0; k < 3; ++k) out.append(k == 0 ? "" : ", ").append(short_text(x[k]));
  return out.append(")");
}

std::string count_of(std::size_t count, const std::string& what) {
  if (count != 1 && what == "vertex") return std::to_string(count) + " vertices";
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

struct Repair {
  explicit Repair(const TriangleMesh& given) { out.mesh = given; }

  RepairedMesh out;
  double size = 0;

  Vector3d vertex(int v) const { return out.mesh.vertices.col(v); }
  std::vector<Triangle>& triangles() { return out.mesh.triangles; }
  MeshTopology topology() const { return MeshTopology(out.mesh.triangles, static_cast<int>(out.mesh.vertices.cols())); }
  Vector3d middle(const Triangle& t) const { return (vertex(t[0]) + vertex(t[1]) + vertex(t[2])) / 3; }
  void say(std::size_t count, const std::string& what, const std::string& done, const Vector3d& place) {
    if (count > 0) out.repairs.push_back(count_of(count, what) + " " + done + ", the first at " + at(place));
  }

  void require_numbers();
  void merge_vertices();
  void drop_twins();
  void turn_minorities();
  void flip_flat();
  std::map<std::pair<int, int>, int> partners(const MeshTopology& topology);
  void part_sheets();
  void turn_outwards();
  void tell_holes();
};

void Repair::require_numbers() {
  const TriangleMesh& mesh = out.mesh;
  if (mesh.triangles.empty()) throw GeometryError("the mesh has no triangle");
  const int count = static_cast<int>(mesh.vertices.cols());
  Eigen::AlignedBox3d box;
  for (const Triangle& t : mesh.triangles)
    for (const int v : t) {
      if (v < 0 || v >= count)
        throw GeometryError("a triangle has vertex " + std::to_string(v) + " of " + std::to_string(count));
      require_finite(vertex(v), ("vertex " + std::to_string(v) + " of the mesh").c_str());
      box.extend(vertex(v));
    }
  size = box.diagonal().norm();
  require_finite(size, "the size of the mesh");
  if (!(size > 0)) throw GeometryError("all of the mesh is at one place, " + at(box.min()));
  out.vertex_of.resize(count);
  std::iota(out.vertex_of.begin(), out.vertex_of.end(), 0);
}

// The lowest number within reach stands for a place.
void Repair::merge_vertices() {
  const double near = merging_share * size, cell = 4 * near;
  std::map<std::array<std::int64_t, 3>, std::vector<int>> cells;
  const auto range = [&](double x) {
    return std::pair(static_cast<std::int64_t>(std::floor((x - near) / cell)),
                     static_cast<std::int64_t>(std::floor((x + near) / cell)));
  };
  const Vector3d origin = vertex(triangles()[0][0]);
  std::vector<int> stands(out.mesh.vertices.cols(), -1);
  std::size_t gone = 0;
  Vector3d first = Vector3d::Zero();
  for (Triangle& t : triangles())
    for (int& v : t) {
      if (stands[v] < 0) {
        const Vector3d x = vertex(v) - origin;
        const auto [i0, i1] = range(x.x());
        const auto [j0, j1] = range(x.y());
        const auto [k0, k1] = range(x.z());
        for (auto i = i0; i <= i1 && stands[v] < 0; ++i)
          for (auto j = j0; j <= j1 && stands[v] < 0; ++j)
            for (auto k = k0; k <= k1 && stands[v] < 0; ++k)
              if (const auto found = cells.find({i, j, k}); found != cells.end())
                for (const int w : found->second)
                  if ((vertex(w) - vertex(v)).norm() <= near) stands[v] = w;
        if (stands[v] < 0) {
          stands[v] = v;
          const auto own = [&](double value) { return static_cast<std::int64_t>(std::floor(value / cell)); };
          cells[{own(x.x()), own(x.y()), own(x.z())}].push_back(v);
        } else if (gone++ == 0) {
          first = vertex(v);
        }
      }
      v = stands[v];
    }
  say(gone, "vertex", "merged with one at the same place", first);
}

void Repair::drop_twins() {
  std::vector<Triangle> kept;
  std::set<Triangle> seen;
  std::size_t pointed = 0, twins = 0;
  Vector3d first_pointed = Vector3d::Zero(), first_twin = Vector3d::Zero();
  for (const Triangle& t : triangles()) {
    Triangle sorted = t;
    std::ranges::sort(sorted);
    if (sorted[0] == sorted[1] || sorted[1] == sorted[2]) {
      if (pointed++ == 0) first_pointed = vertex(t[0]);
    } else if (!seen.insert(sorted).second) {
      if (twins++ == 0) first_twin = middle(t);
    } else {
      kept.push_back(t);
    }
  }
  triangles() = std::move(kept);
  say(pointed, "triangle", "without area taken out", first_pointed);
  say(twins, "triangle", "that had a twin taken out", first_twin);
  if (triangles().empty()) throw GeometryError("no triangle of the mesh has an area");
}

// Over edges with two faces; of each part the fewer are turned. Where a part can't be turned to one side, partners()
// cuts it.
void Repair::turn_minorities() {
  const MeshTopology top = topology();
  const int count = static_cast<int>(triangles().size());
  std::vector<int> sign(count, 0);  // against the first face of the part
  std::size_t turned = 0;
  Vector3d first = Vector3d::Zero();
  for (int start = 0; start < count; ++start) {
    if (sign[start] != 0) continue;
    std::vector<int> part{start};
    sign[start] = 1;
    for (std::size_t k = 0; k < part.size(); ++k)
      for (const int e : top.edges_of_face(part[k])) {
        const auto faces = top.faces_of_edge(e);
        if (faces.size() != 2) continue;
        const int other = faces[0] == part[k] ? faces[1] : faces[0];
        const int should = top.runs_along(faces[0], e) != top.runs_along(faces[1], e) ? sign[part[k]] : -sign[part[k]];
        if (sign[other] == 0) {
          sign[other] = should;
          part.push_back(other);
        }
      }
    const auto against = std::ranges::count_if(part, [&](int f) { return sign[f] < 0; });
    const int wrong = 2 * against <= static_cast<std::ptrdiff_t>(part.size()) ? -1 : 1;
    for (const int f : part)
      if (sign[f] == wrong) {
        if (turned++ == 0) first = middle(triangles()[f]);
        std::swap(triangles()[f][1], triangles()[f][2]);
      }
  }
  say(turned, "triangle", "turned that faced against the neighbours", first);
}

// A triangle with its corners on one line gives its long edge to the neighbour there: no gap opens. Where that leads to
// others without end, they are taken out.
void Repair::flip_flat() {
  const auto height = [&](const Triangle& t) {
    const Vector3d a = vertex(t[0]), b = vertex(t[1]), c = vertex(t[2]);
    return (b - a).cross(c - a).norm() /
           std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}));
  };
  std::size_t gone = 0;
  Vector3d first = Vector3d::Zero();
  constexpr int most_idle_passes = 10;  // that leave no fewer of them
  std::size_t fewest = triangles().size() + 1;
  for (int idle = 0;;) {
    std::vector<int> bad;
    for (int f = 0; f < static_cast<int>(triangles().size()); ++f)
      if (height(triangles()[f]) <= flat_share * size) bad.push_back(f);
    if (bad.empty()) break;
    idle = bad.size() < fewest ? 0 : idle + 1;
    fewest = std::min(fewest, bad.size());
    if (gone == 0) first = middle(triangles()[bad[0]]);
    const MeshTopology top = topology();
    std::vector<char> touched(triangles().size(), 0), dead(triangles().size(), 0);
    for (const int f : bad) {
      if (idle == most_idle_passes) {
        dead[f] = 1;
        ++gone;
        continue;
      }
      if (touched[f]) continue;
      Triangle& t = triangles()[f];
      int k = 0;  // of the longest edge
      for (int l = 1; l < 3; ++l)
        if ((vertex(t[(l + 1) % 3]) - vertex(t[l])).norm() > (vertex(t[(k + 1) % 3]) - vertex(t[k])).norm()) k = l;
      const int p = t[k], q = t[(k + 1) % 3], c = t[(k + 2) % 3];
      const auto faces = top.faces_of_edge(top.edges_of_face(f)[k]);
      const int g = faces.size() != 2 ? -1 : faces[0] == f ? faces[1] : faces[0];
      if (g >= 0 && touched[g]) continue;
      touched[f] = 1;
      ++gone;
      int d = c;
      if (g >= 0)
        for (const int v : triangles()[g])
          if (v != p && v != q) d = v;
      if (d == c) {
        dead[f] = 1;
        continue;
      }
      touched[g] = 1;
      t = {p, d, c};
      triangles()[g] = {d, q, c};
    }
    std::vector<Triangle> kept;
    for (std::size_t f = 0; f < triangles().size(); ++f)
      if (!dead[f]) kept.push_back(triangles()[f]);
    triangles() = std::move(kept);
    if (triangles().empty()) throw GeometryError("no triangle of the mesh has an area");
  }
  say(gone, "triangle", "with all corners on one line joined with a neighbour", first);
}

// Of each face and edge the face that goes on there. Around an edge with more than two faces those are neighbours that
// have the inside of the body between them.
std::map<std::pair<int, int>, int> Repair::partners(const MeshTopology& top) {
  std::map<std::pair<int, int>, int> of;
  std::size_t cuts = 0;
  std::string first;
  for (int e = 0; e < top.edge_count(); ++e) {
    const auto faces = top.faces_of_edge(e);
    if (faces.size() < 2) continue;
    const auto [a, b] = top.edge(e);
    const Vector3d d = (vertex(b) - vertex(a)).normalized();
    const Vector3d x = d.unitOrthogonal(), y = d.cross(x);
    std::vector<std::pair<double, int>> around;
    for (const int f : faces) {
      const Triangle& t = triangles()[f];
      const int c = *std::ranges::find_if(t, [v = a, w = b](int k) { return k != v && k != w; });
      const Vector3d w = vertex(c) - vertex(a);
      around.emplace_back(std::atan2(y.dot(w), x.dot(w)), f);
    }
    std::ranges::sort(around);
    // A face that runs against the edge has the inside after it, the other kind before.
    const std::size_t n = around.size(), start = top.runs_along(around[0].second, e) ? 1 : 0;
    bool alternate = n % 2 == 0;
    for (std::size_t k = 0; k < n; ++k)
      alternate = alternate && top.runs_along(around[(start + k) % n].second, e) == (k % 2 == 1);
    if (!alternate) {
      if (cuts++ == 0) first = std::to_string(n) + " meet from " + at(vertex(a)) + " to " + at(vertex(b));
      continue;
    }
    for (std::size_t k = start; k < start + n; k += 2) {
      const int f = around[k % n].second, g = around[(k + 1) % n].second;
      of[{f, e}] = g;
      of[{g, e}] = f;
    }
  }
  if (cuts > 0)
    out.warnings.push_back("at " + count_of(cuts, "edge") + " no two triangles go on in each other, the first where " +
                           first + ": the mesh is cut there; take out what isn't the body's surface");
  return of;
}

// One vertex for each fan of faces.
void Repair::part_sheets() {
  const MeshTopology top = topology();
  const auto partner = partners(top);
  const int count = static_cast<int>(triangles().size());
  std::vector<int> fan(3 * count);
  std::iota(fan.begin(), fan.end(), 0);
  const auto root = [&](int k) {
    while (fan[k] != k) k = fan[k] = fan[fan[k]];
    return k;
  };
  const auto corner = [&](int f, int v) {
    return 3 * f + static_cast<int>(std::ranges::find(triangles()[f], v) - triangles()[f].begin());
  };
  for (const auto& [side, g] : partner) {
    for (const int v : top.edge(side.second)) {
      const int r = root(corner(side.first, v)), s = root(corner(g, v));
      fan[std::max(r, s)] = std::min(r, s);
    }
  }
  std::vector<int> number(3 * count, -1), from;
  std::set<int> used, twice;
  for (int k = 0; k < 3 * count; ++k) {
    const int v = triangles()[k / 3][k % 3], r = root(k);
    if (number[r] >= 0) continue;
    number[r] = static_cast<int>(from.size());
    from.push_back(v);
    if (!used.insert(v).second) twice.insert(v);
  }
  if (!twice.empty()) say(twice.size(), "place", "where parts touch taken apart", vertex(*twice.begin()));
  for (int f = 0; f < count; ++f) {
    Triangle t;
    for (int k = 0; k < 3; ++k) t[k] = number[root(3 * f + k)];
    triangles()[f] = t;
  }
  Eigen::Matrix3Xd vertices(3, static_cast<Eigen::Index>(from.size()));
  std::vector<int> vertex_of;
  for (std::size_t k = 0; k < from.size(); ++k) {
    vertices.col(static_cast<Eigen::Index>(k)) = vertex(from[k]);
    vertex_of.push_back(out.vertex_of[from[k]]);
  }
  out.mesh.vertices = std::move(vertices);
  out.vertex_of = std::move(vertex_of);
}

void Repair::turn_outwards() {
  struct Part {
    std::vector<Triangle> triangles;
    Eigen::AlignedBox3d box;
    double volume = 0;
    bool closed = true, turned = false;
  };
  const MeshTopology top = topology();
  const int count = static_cast<int>(triangles().size());
  int part_count = 0;
  const std::vector<int> part = connected_parts(top, count, part_count);
  std::vector<Part> parts(part_count);
  const Vector3d origin = vertex(0);
  for (int f = 0; f < count; ++f) {
    const Triangle& t = triangles()[f];
    Part& own = parts[part[f]];
    own.triangles.push_back(t);
    for (const int e : top.edges_of_face(f)) own.closed = own.closed && top.faces_of_edge(e).size() == 2;
    for (const int v : t) own.box.extend(vertex(v));
    own.volume += (vertex(t[0]) - origin).dot((vertex(t[1]) - origin).cross(vertex(t[2]) - origin)) / 6;
  }
  std::vector<Part*> order;  // the largest first
  for (Part& p : parts)
    if (p.closed) order.push_back(&p);
  std::ranges::stable_sort(order, std::greater(), [](const Part* p) { return std::abs(p->volume); });
  std::size_t bodies = 0, faces = 0;
  Vector3d first = Vector3d::Zero();
  for (std::size_t k = 0; k < order.size(); ++k) {
    Part& own = *order[k];
    const Vector3d inside = middle(own.triangles[0]);
    const Part* outer = nullptr;  // the smallest around it
    for (std::size_t j = 0; j < k; ++j)
      if (order[j]->box.contains(inside) &&
          std::abs(winding_number(out.mesh.vertices, order[j]->triangles, inside)) > 0.5)
        outer = order[j];
    own.turned = outer ? outer->turned : own.volume < 0;
    if (!own.turned) continue;
    if (bodies++ == 0) first = inside;
    faces += own.triangles.size();
  }
  for (int f = 0; f < count; ++f)
    if (parts[part[f]].turned) std::swap(triangles()[f][1], triangles()[f][2]);
  if (bodies > 0)
    out.repairs.push_back(count_of(faces, "triangle") + " turned: " + count_of(bodies, "closed surface") +
                          (bodies == 1 ? " was" : " were") + " inside out, the first at " + at(first));
}

void Repair::tell_holes() {
  const MeshTopology top = topology();
  std::map<int, int> next;  // along the border
  for (int e = 0; e < top.edge_count(); ++e) {
    const auto faces = top.faces_of_edge(e);
    if (faces.size() != 1) continue;
    const auto [a, b] = top.edge(e);
    if (top.runs_along(faces[0], e))
      next[b] = a;
    else
      next[a] = b;
  }
  out.closed = next.empty();
  std::size_t holes = 0;
  double longest = 0;
  Vector3d place = Vector3d::Zero();
  while (!next.empty()) {
    double length = 0;
    int points = 0;
    Vector3d mean = Vector3d::Zero();
    for (auto it = next.begin(); it != next.end();) {
      const auto [a, b] = *it;
      length += (vertex(b) - vertex(a)).norm();
      mean += vertex(a);
      ++points;
      next.erase(it);
      it = next.find(b);
    }
    ++holes;
    if (length > longest) {
      longest = length;
      place = mean / points;
    }
  }
  if (holes > 0)
    out.warnings.push_back("the mesh is open: " + count_of(holes, "border") + ", the longest " +
                           text(std::round(longest / size * 1e4) / 100) + " % of the mesh's size around " + at(place) +
                           "; cloth meets both its sides and can't be told that it is inside");
}

}  // namespace

RepairedMesh repair_mesh(const TriangleMesh& mesh) {
  Repair repair(mesh);
  repair.require_numbers();
  repair.merge_vertices();
  repair.drop_twins();
  repair.turn_minorities();
  repair.flip_flat();
  repair.part_sheets();
  repair.turn_outwards();
  repair.tell_holes();
  return std::move(repair.out);
}

double winding_number(const Eigen::Matrix3Xd& vertices, std::span<const Triangle> triangles, const Vector3d& p) {
  // Solid angles: van Oosterom & Strackee 1983.
  double sum = 0;
  for (const Triangle& t : triangles) {
    const Vector3d a = vertices.col(t[0]) - p, b = vertices.col(t[1]) - p, c = vertices.col(t[2]) - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    sum += std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return sum / (2 * std::numbers::pi);
}

}  // namespace toile
