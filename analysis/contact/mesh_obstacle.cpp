// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/contact/mesh_obstacle.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "geometry/error.h"
#include "geometry/finite.h"
#include "geometry/smooth_step.h"
#include "geometry/text.h"
#include "geometry/triangle.h"

namespace toile {

namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

const double sharp_cosine = std::cos(25 * std::numbers::pi / 180);
// Nearer than this the way to an edge or a vertex is rounding [m]; its own normal is taken.
constexpr double no_way = 1e-10;

std::string at(const Vector3d& x) {
  return "(" + text(x.x()) + ", " + text(x.y()) + ", " + text(x.z()) + ")";
}

// Unit; zero where the triangle has no area.
Vector3d normal(const Matrix3Xd& vertices, const Triangle& t) {
  const Vector3d a = vertices.col(t[0]), b = vertices.col(t[1]), c = vertices.col(t[2]);
  const Vector3d n = (b - a).cross(c - a);
  const double length = n.norm();
  return length > 0 ? Vector3d(n / length) : Vector3d::Zero();
}

double angle_between(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

void require_shape(const Matrix3Xd& vertices, Eigen::Index count) {
  if (vertices.cols() != count)
    throw GeometryError("a shape of the mesh has " + std::to_string(vertices.cols()) + " vertices, the mesh " +
                        std::to_string(count));
  if (vertices.allFinite()) return;
  for (Eigen::Index k = 0; k < count; ++k)
    require_finite(Vector3d(vertices.col(k)), ("vertex " + std::to_string(k)).c_str());
}

void require_motion(const MeshMotion& motion, Eigen::Index count) {
  if (motion.shapes.size() != motion.times.size())
    throw GeometryError("a mesh has " + std::to_string(motion.shapes.size()) + " shapes at " +
                        std::to_string(motion.times.size()) + " times");
  for (const Matrix3Xd& shape : motion.shapes) require_shape(shape, count);
  for (std::size_t k = 0; k < motion.times.size(); ++k) {
    require_finite(motion.times[k], "the time of a mesh's shape");
    if (k > 0 && !(motion.times[k - 1] < motion.times[k]))
      throw GeometryError("the times of a mesh's shapes must ascend: " + text(motion.times[k]) + " s follows " +
                          text(motion.times[k - 1]) + " s");
  }
}

}  // namespace

MeshObstacle::MeshObstacle(TriangleMesh mesh, MeshMotion motion, ObstacleOptions options)
    : Obstacle(std::move(options)),
      triangles_(std::move(mesh.triangles)),
      topology_(triangles_, static_cast<int>(mesh.vertices.cols())),
      motion_(std::move(motion)),
      now_(std::move(mesh.vertices)) {
  if (triangles_.empty()) throw GeometryError("a mesh has no triangle");
  require_shape(now_, now_.cols());
  require_motion(motion_, now_.cols());
  for (int e = 0; e < topology_.edge_count(); ++e) {
    const auto faces = topology_.faces_of_edge(e);
    closed_ = closed_ && faces.size() == 2;
    if (faces.size() > 2)
      throw GeometryError(std::to_string(faces.size()) + " triangles meet in one edge at " +
                          at(now_.col(topology_.edge(e)[0])));
    if (faces.size() == 2 && topology_.runs_along(faces[0], e) == topology_.runs_along(faces[1], e))
      throw GeometryError("two neighbouring triangles face opposite ways at " + at(now_.col(topology_.edge(e)[0])));
  }
  for (const Triangle& t : triangles_)
    if (normal(now_, t).isZero(0)) throw GeometryError("a triangle has no area at " + at(now_.col(t[0])));

  shape_now_ = shape_time(0);
  if (!motion_.shapes.empty()) now_ = shape(shape_now_);
  boxes_.resize(triangles_.size());
  take_shape();
  before_ = now_;
  normals_before_ = normals_;
  move(0, 0);
}

MeshObstacle::ShapeTime MeshObstacle::shape_time(double t) const {
  const std::vector<double>& times = motion_.times;
  if (times.size() < 2 || t <= times.front()) return {};
  if (t >= times.back()) return {static_cast<int>(times.size()) - 2, 1};
  const int k = static_cast<int>(std::ranges::upper_bound(times, t) - times.begin()) - 1;
  const double s = (t - times[k]) / (times[k + 1] - times[k]);
  return {k, motion_.smooth ? smooth_step(s) : s};
}

Matrix3Xd MeshObstacle::shape(const ShapeTime& time) const {
  if (time.share == 0) return motion_.shapes[time.shape];
  return (1 - time.share) * motion_.shapes[time.shape] + time.share * motion_.shapes[time.shape + 1];
}

Isometry3d MeshObstacle::place_at(double t) const {
  return motion_.place ? motion_.place(t) : Isometry3d::Identity();
}

void MeshObstacle::move(double before, double now) {
  require_finite(before, "the time of an obstacle");
  require_finite(now, "the time of an obstacle");
  const Isometry3d place_before = place_at(before), place_now = place_at(now);
  require_finite(Vector3d(place_now * Vector3d::Ones()), "a corner of a moved obstacle");
  if (!motion_.shapes.empty()) {
    // One step's end is the next one's beginning.
    if (const ShapeTime time = shape_time(before); time != shape_before_) {
      shape_before_ = time;
      if (time == shape_now_) {
        before_ = now_;
        normals_before_ = normals_;
      } else {
        before_ = shape(time);
        for (std::size_t f = 0; f < triangles_.size(); ++f) normals_before_.col(f) = normal(before_, triangles_[f]);
      }
    }
    if (const ShapeTime time = shape_time(now); time != shape_now_) {
      shape_now_ = time;
      now_ = shape(time);
      take_shape();
    }
  }
  to_own_axes_before_ = place_before.inverse();
  turned_ = place_before.matrix() != place_now.matrix();
  place_ = place_now;
  to_own_axes_ = place_.inverse();
  place_sharp();
}

void MeshObstacle::take_shape() {
  normals_.resize(3, static_cast<Eigen::Index>(triangles_.size()));
  for (std::size_t f = 0; f < triangles_.size(); ++f) {
    const Triangle& t = triangles_[f];
    const auto a = now_.col(t[0]), b = now_.col(t[1]), c = now_.col(t[2]);
    boxes_[f] = Box(a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c));
    normals_.col(f) = normal(now_, t);
  }
  if (tree_.size() == 0)
    tree_ = BoundsTree(boxes_);
  else
    tree_.refit(boxes_);
  find_sharp();
}

void MeshObstacle::find_sharp() {
  const auto opposite = [&](int f, int e) {
    const auto [a, b] = topology_.edge(e);
    for (const int v : triangles_[f])
      if (v != a && v != b) return v;
    return a;
  };
  std::vector<char> sharp(now_.cols(), 0);
  sharp_edge_.clear();
  for (int e = 0; e < topology_.edge_count(); ++e) {
    const auto faces = topology_.faces_of_edge(e);
    const auto [a, b] = topology_.edge(e);
    bool is = faces.size() == 1;
    if (!is) {
      const Vector3d n = normals_.col(faces[0]), m = normals_.col(faces[1]);
      const bool convex = n.dot(now_.col(opposite(faces[1], e)) - now_.col(a)) < 0;
      is = n.dot(m) < sharp_cosine && (convex || !closed_) && !n.isZero(0) && !m.isZero(0);
    }
    if (!is) continue;
    sharp_edge_.push_back(e);
    sharp[a] = sharp[b] = 1;
  }
  sharp_vertex_.clear();
  for (int v = 0; v < now_.cols(); ++v) {
    if (!sharp[v]) {
      const auto faces = topology_.faces_of_vertex(v);
      Vector3d mean = Vector3d::Zero(), around = Vector3d::Zero();
      for (const int f : faces) mean += normals_.col(f);
      const double least = sharp_cosine * mean.norm();
      if (std::ranges::none_of(faces, [&](int f) { return normals_.col(f).dot(mean) < least; })) continue;
      for (const int f : faces)
        for (const int w : triangles_[f]) around += now_.col(w) - now_.col(v);
      sharp[v] = !closed_ || around.dot(mean) < 0;
    }
    if (sharp[v]) sharp_vertex_.push_back(v);
  }
}

void MeshObstacle::place_sharp() {
  const auto placed = [&](int v) -> Vector3d {
    return motion_.place ? Vector3d(place_ * now_.col(v)) : Vector3d(now_.col(v));
  };
  sharp_edges_.clear();
  sharp_vertices_.clear();
  for (const int e : sharp_edge_) sharp_edges_.push_back({placed(topology_.edge(e)[0]), placed(topology_.edge(e)[1])});
  for (const int v : sharp_vertex_) sharp_vertices_.push_back(placed(v));
}

int MeshObstacle::face_of(int feature) const {
  const int faces = static_cast<int>(triangles_.size()), edges = topology_.edge_count();
  if (feature < faces) return feature;
  if (feature < faces + edges) return topology_.faces_of_edge(feature - faces)[0];
  return topology_.faces_of_vertex(feature - faces - edges)[0];
}

Vector3d MeshObstacle::feature_normal(int feature) const {
  const int faces = static_cast<int>(triangles_.size()), edges = topology_.edge_count();
  if (feature < faces) return normals_.col(feature);
  Vector3d sum = Vector3d::Zero();
  if (feature < faces + edges) {
    for (const int f : topology_.faces_of_edge(feature - faces)) sum += normals_.col(f);
    return sum.stableNormalized();
  }
  const int v = feature - faces - edges;
  for (const int f : topology_.faces_of_vertex(v)) {
    const Triangle& t = triangles_[f];
    const int k = static_cast<int>(std::ranges::find(t, v) - t.begin());
    const Vector3d x = now_.col(v);
    sum += angle_between(now_.col(t[(k + 1) % 3]) - x, now_.col(t[(k + 2) % 3]) - x) * normals_.col(f);
  }
  return sum.stableNormalized();
}

std::optional<SurfacePoint> MeshObstacle::nearest(const Vector3d& p, double reach) const {
  const Vector3d q = motion_.place ? Vector3d(to_own_axes_ * p) : p;
  const auto closest = [&](int f) {
    const Triangle& t = triangles_[f];
    return closest_on_triangle(now_.col(t[0]), now_.col(t[1]), now_.col(t[2]), q);
  };
  const auto found = tree_.nearest(q, reach, [&](int f) { return (closest(f).point - q).squaredNorm(); });
  if (!found) return std::nullopt;
  const int faces = static_cast<int>(triangles_.size());
  const TrianglePoint on = closest(found->box);
  SurfacePoint out;
  if (on.part == 0)
    out.feature = found->box;
  else if (on.part <= 3)
    out.feature = faces + topology_.edges_of_face(found->box)[on.part - 1];
  else
    out.feature = faces + topology_.edge_count() + triangles_[found->box][on.part - 4];

  const Vector3d way = q - on.point;
  const double distance = way.norm();
  out.normal = feature_normal(out.feature);
  out.distance = out.normal.dot(way) < 0 ? -distance : distance;
  if (on.part != 0 && distance > no_way) out.normal = way / out.distance;
  out.point = on.point;
  if (motion_.place) {
    out.point = place_ * out.point;
    out.normal = place_.linear() * out.normal;
  }
  return out;
}

Vector3d MeshObstacle::carry(const Vector3d& p, int feature) const {
  const bool deformed = shape_before_ != shape_now_;
  if (!deformed && !turned_) return p;
  Vector3d q = to_own_axes_before_ * p;
  if (deformed) {
    const int f = face_of(feature);
    const Triangle& t = triangles_[f];
    Eigen::Matrix<double, 3, 3> frame, now;
    frame << before_.col(t[1]) - before_.col(t[0]), before_.col(t[2]) - before_.col(t[0]), normals_before_.col(f);
    now << now_.col(t[1]) - now_.col(t[0]), now_.col(t[2]) - now_.col(t[0]), normals_.col(f);
    const Vector3d from = q - before_.col(t[0]);
    const Eigen::FullPivLU<Eigen::Matrix3d> lu(frame);
    // A triangle that has lost its area takes places along by its corner.
    q = now_.col(t[0]) + (lu.isInvertible() ? Vector3d(now * lu.solve(from)) : from);
  }
  return place_ * q;
}

}  // namespace toile
