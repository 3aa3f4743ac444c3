// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/contact/shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "geometry/error.h"

namespace toile {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int rim_chords = 128;
constexpr double thin = 0.02;  // m: what is rounder than this passes between the cloth's sampled points

struct Local {  // a SurfacePoint in the shape's own axes
  Vector3d point, normal;
  double distance = 0;
  int feature = 0;
};

// A shape in axes of its own, where its formula is simple; `own` leads from there to the shape as described.
class RigidObstacle : public Obstacle {
 public:
  RigidObstacle(ObstacleOptions options, const Isometry3d& own, RigidMotion motion)
      : Obstacle(std::move(options)), own_(own), motion_(std::move(motion)), pose_(own), before_(own) {
    if (motion_) pose_ = before_ = motion_(0) * own_;
  }

  void move(double before, double now) override {
    if (!motion_) return;
    before_ = motion_(before) * own_;
    pose_ = motion_(now) * own_;
    place_features();
  }
  bool still() const override { return !motion_; }
  std::optional<SurfacePoint> nearest(const Vector3d& p, double reach) const override {
    const Local near = local_nearest(pose_.inverse() * p);
    if (!(std::abs(near.distance) <= reach)) return std::nullopt;
    return SurfacePoint{pose_ * near.point, pose_.linear() * near.normal, near.distance, near.feature};
  }
  Vector3d carry(const Vector3d& p, int) const override {
    return motion_ ? Vector3d(pose_ * (before_.inverse() * p)) : p;
  }
  TriangleMesh picture(const Eigen::AlignedBox3d& around) const override {
    TriangleMesh mesh = own_picture(pose_.inverse() * around.center(), around.diagonal().norm());
    mesh.vertices = (pose_.linear() * mesh.vertices).colwise() + pose_.translation();
    return mesh;
  }
  std::span<const Segment> sharp_edges() const override { return edges_; }
  std::span<const Vector3d> sharp_vertices() const override { return vertices_; }

 protected:
  void set_features(std::vector<Segment> edges, std::vector<Vector3d> vertices) {
    own_edges_ = std::move(edges);
    own_vertices_ = std::move(vertices);
    place_features();
  }

 private:
  virtual Local local_nearest(const Vector3d& p) const = 0;
  // In its own axes; the scene lies around `middle`, no larger than `size`.
  virtual TriangleMesh own_picture(const Vector3d& middle, double size) const = 0;
  void place_features() {
    edges_.clear();
    vertices_.clear();
    for (const Segment& e : own_edges_) edges_.push_back({pose_ * e.from, pose_ * e.to});
    for (const Vector3d& v : own_vertices_) vertices_.push_back(pose_ * v);
  }

  Isometry3d own_;
  RigidMotion motion_;
  Isometry3d pose_, before_;
  std::vector<Segment> own_edges_, edges_;
  std::vector<Vector3d> own_vertices_, vertices_;
};

// Axes with their origin at `from`, z along `direction`.
Isometry3d along(const Vector3d& from, const Vector3d& direction) {
  Isometry3d axes = Isometry3d::Identity();
  axes.linear() = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), direction).toRotationMatrix();
  axes.translation() = from;
  return axes;
}

Vector3d unit_or(const Vector3d& d, const Vector3d& otherwise) {
  const double length = d.norm();
  return length > 0 ? Vector3d(d / length) : otherwise;
}

// A grid of points, closed around in its first direction where `round`, as triangles that turn left seen along
// du x dv.
TriangleMesh grid_mesh(int around, int along, bool round, const std::function<Vector3d(int, int)>& at) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, around * along);
  for (int j = 0; j < along; ++j)
    for (int i = 0; i < around; ++i) mesh.vertices.col(i + around * j) = at(i, j);
  for (int j = 0; j + 1 < along; ++j)
    for (int i = 0; i < (round ? around : around - 1); ++i) {
      const int a = i + around * j, b = (i + 1) % around + around * j;
      mesh.triangles.push_back({a, b, b + around});
      mesh.triangles.push_back({a, b + around, a + around});
    }
  return mesh;
}
// A meridian (r, z), from below to above, turned about z.
TriangleMesh revolved_mesh(const std::vector<Vector2d>& meridian) {
  constexpr int around = 64;
  return grid_mesh(around, static_cast<int>(meridian.size()), true, [&](int i, int j) -> Vector3d {
    const double angle = 2 * std::numbers::pi * i / around;
    const Vector2d& m = meridian[static_cast<std::size_t>(j)];
    return {m.x() * std::cos(angle), m.x() * std::sin(angle), m.y()};
  });
}

class PlaneObstacle final : public RigidObstacle {
 public:
  PlaneObstacle(const PlaneShape& s, ObstacleOptions o, RigidMotion m)
      : RigidObstacle(std::move(o), along(s.point, s.normal), std::move(m)) {}

 private:
  Local local_nearest(const Vector3d& p) const override { return {{p.x(), p.y(), 0}, Vector3d::UnitZ(), p.z(), 0}; }
  TriangleMesh own_picture(const Vector3d& middle, double size) const override {
    constexpr int points = 33;
    return grid_mesh(points, points, false, [&](int i, int j) -> Vector3d {
      const auto place = [&](int k) { return size * (2.0 * k / (points - 1) - 1); };
      return {middle.x() + place(i), middle.y() + place(j), 0};
    });
  }
};

// All that is within a radius of a line from the origin up to `length`; a sphere where that is 0.
class CapsuleObstacle final : public RigidObstacle {
 public:
  CapsuleObstacle(const CapsuleShape& s, ObstacleOptions o, RigidMotion m)
      : RigidObstacle(std::move(o), along(s.from, s.to - s.from), std::move(m)),
        length_((s.to - s.from).norm()),
        r_(s.radius) {
    if (r_ > thin) return;
    const Vector3d end(0, 0, length_);
    if (length_ > 0)
      set_features({{Vector3d::Zero(), end}}, {Vector3d::Zero(), end});
    else
      set_features({}, {end});
  }
  double sharp_radius() const override { return r_; }

 private:
  Local local_nearest(const Vector3d& p) const override {
    const Vector3d axis(0, 0, std::clamp(p.z(), 0.0, length_));
    const Vector3d n = unit_or(p - axis, Vector3d::UnitX());
    return {axis + r_ * n, n, (p - axis).norm() - r_, p.z() < 0 ? 1 : p.z() > length_ ? 2 : 0};
  }
  TriangleMesh own_picture(const Vector3d&, double) const override {
    constexpr int parts = 16;  // of each half of the meridian
    std::vector<Vector2d> meridian;
    for (int j = 0; j <= 2 * parts + 1; ++j) {
      const bool lower = j <= parts;
      const double angle = std::numbers::pi / 2 * ((lower ? j : j - 1) / static_cast<double>(parts) - 1);
      meridian.emplace_back(r_ * std::cos(angle), r_ * std::sin(angle) + (lower ? 0 : length_));
    }
    return revolved_mesh(meridian);
  }
  double length_, r_;
};

// The meridian (r, z) of a body of revolution: a convex polygon with its first and last vertex on the axis, that turns
// left seen with r to the right.
class RevolvedObstacle final : public RigidObstacle {
 public:
  RevolvedObstacle(std::vector<Vector2d> meridian, const Isometry3d& own, ObstacleOptions o, RigidMotion m)
      : RigidObstacle(std::move(o), own, std::move(m)), meridian_(std::move(meridian)) {
    std::vector<Segment> edges;
    std::vector<Vector3d> vertices;
    const auto raised = [](const Vector2d& profile, int k, int parts) -> Vector3d {
      const double angle = 2 * std::numbers::pi * (k % parts) / parts;
      return {profile.x() * std::cos(angle), profile.x() * std::sin(angle), profile.y()};
    };
    for (const Vector2d& at : meridian_)
      for (int k = 0; at.x() > 0 && k < rim_chords; ++k)
        edges.push_back({raised(at, k, rim_chords), raised(at, k + 1, rim_chords)});
    // A thin mantle passes between the cloth's sampled points.
    double widest = 0;
    for (const Vector2d& at : meridian_) widest = std::max(widest, at.x());
    constexpr int lines = 8;
    for (int k = 0; widest <= thin && k < lines; ++k) {
      for (std::size_t i = 0; i + 1 < meridian_.size(); ++i)
        edges.push_back({raised(meridian_[i], k, lines), raised(meridian_[i + 1], k, lines)});
    }
    // An end on the axis is sharp unless a flat face lies around it.
    const std::size_t n = meridian_.size();
    if (meridian_[0].y() != meridian_[1].y()) vertices.push_back({0, 0, meridian_[0].y()});
    if (meridian_[n - 1].y() != meridian_[n - 2].y()) vertices.push_back({0, 0, meridian_[n - 1].y()});
    set_features(std::move(edges), std::move(vertices));
  }

 private:
  Local local_nearest(const Vector3d& p) const override {
    const double radius = std::hypot(p.x(), p.y());
    const Vector2d at(radius, p.z());
    const Vector3d out = radius > 0 ? Vector3d(p.x() / radius, p.y() / radius, 0) : Vector3d::UnitX();
    double best = HUGE_VAL;
    bool inside = true;
    Vector2d point, face;
    int feature = 0;
    for (std::size_t k = 0; k + 1 < meridian_.size(); ++k) {
      const Vector2d a = meridian_[k], d = meridian_[k + 1] - a, n = Vector2d(d.y(), -d.x()).normalized();
      inside = inside && n.dot(at - a) <= 0;
      const double share = std::clamp(d.dot(at - a) / d.squaredNorm(), 0.0, 1.0);
      const Vector2d near = a + share * d;
      const double distance = (at - near).norm();
      if (!(distance < best)) continue;
      best = distance;
      point = near;
      face = n;
      feature = static_cast<int>(3 * k) + (share == 0 ? 0 : share == 1 ? 2 : 1);
    }
    const Vector2d n = inside || best == 0 ? face : Vector2d((at - point) / best);
    const auto raise = [&](const Vector2d& m) -> Vector3d { return m.x() * out + m.y() * Vector3d::UnitZ(); };
    return {raise(point), raise(n), inside ? -best : best, feature};
  }
  TriangleMesh own_picture(const Vector3d&, double) const override {
    // Corners twice, so that light doesn't round them off.
    std::vector<Vector2d> meridian;
    for (const Vector2d& corner : meridian_) meridian.insert(meridian.end(), 2, corner);
    return revolved_mesh(meridian);
  }
  std::vector<Vector2d> meridian_;
};

class BoxObstacle final : public RigidObstacle {
 public:
  BoxObstacle(const BoxShape& s, ObstacleOptions o, RigidMotion m)
      : RigidObstacle(std::move(o), axes(s), std::move(m)), half_(s.size / 2) {
    std::vector<Segment> edges;
    std::vector<Vector3d> vertices;
    const auto corner = [&](int k) -> Vector3d {
      return {k & 1 ? half_.x() : -half_.x(), k & 2 ? half_.y() : -half_.y(), k & 4 ? half_.z() : -half_.z()};
    };
    for (int k = 0; k < 8; ++k) {
      vertices.push_back(corner(k));
      for (const int bit : {1, 2, 4})
        if (!(k & bit)) edges.push_back({corner(k), corner(k | bit)});
    }
    set_features(std::move(edges), std::move(vertices));
  }

 private:
  static Isometry3d axes(const BoxShape& s) {
    Isometry3d own = Isometry3d::Identity();
    own.linear() = s.turned;
    own.translation() = s.centre;
    return own;
  }
  Local local_nearest(const Vector3d& p) const override {
    const Vector3d within = p.cwiseMax(-half_).cwiseMin(half_), away = p - within;
    int feature = 0;
    if (away.isZero(0)) {
      int axis = 0;
      const double depth = (half_ - p.cwiseAbs()).minCoeff(&axis);
      const double side = p[axis] < 0 ? -1 : 1;
      Vector3d point = p;
      point[axis] = side * half_[axis];
      return {point, side * Vector3d::Unit(axis), -depth, axis_feature(axis, side)};
    }
    for (int axis = 0; axis < 3; ++axis)
      if (away[axis] != 0) feature += axis_feature(axis, away[axis]);
    return {within, away.normalized(), away.norm(), feature};
  }
  TriangleMesh own_picture(const Vector3d&, double) const override {
    TriangleMesh mesh;
    mesh.vertices.resize(3, 24);
    for (int face = 0; face < 6; ++face) {
      const int axis = face % 3;
      const double side = face < 3 ? -1 : 1;
      for (int k = 0; k < 4; ++k) {
        const int u = k == 1 || k == 2 ? 1 : -1, v = k >= 2 ? 1 : -1;
        Vector3d corner;
        corner[axis] = side * half_[axis];
        corner[(axis + 1) % 3] = u * half_[(axis + 1) % 3];
        corner[(axis + 2) % 3] = side * v * half_[(axis + 2) % 3];
        mesh.vertices.col(4 * face + k) = corner;
      }
      mesh.triangles.push_back({4 * face, 4 * face + 1, 4 * face + 2});
      mesh.triangles.push_back({4 * face, 4 * face + 2, 4 * face + 3});
    }
    return mesh;
  }
  // Faces, edges and vertices by the sides that they lie on.
  static int axis_feature(int axis, double side) {
    constexpr std::array<int, 3> weight{1, 3, 9};
    return weight[static_cast<std::size_t>(axis)] * (side < 0 ? 1 : 2);
  }
  Vector3d half_;
};

void require_size(const ObstacleOptions& options, const char* what, double length, const Vector3d& a,
                  const Vector3d& b) {
  if (!a.allFinite() || !b.allFinite() || !std::isfinite(length))
    throw GeometryError("obstacle '" + options.name + "': a number isn't finite");
  if (!(length > 0)) throw GeometryError("obstacle '" + options.name + "': its " + what + " must be positive");
}

}  // namespace

std::unique_ptr<Obstacle> make_obstacle(const PlaneShape& s, ObstacleOptions o, RigidMotion m) {
  require_size(o, "normal's length", s.normal.norm(), s.point, s.normal);
  return std::make_unique<PlaneObstacle>(s, std::move(o), std::move(m));
}
std::unique_ptr<Obstacle> make_obstacle(const SphereShape& s, ObstacleOptions o, RigidMotion m) {
  require_size(o, "radius", s.radius, s.centre, s.centre);
  return std::make_unique<CapsuleObstacle>(CapsuleShape{s.centre, s.centre, s.radius}, std::move(o), std::move(m));
}
std::unique_ptr<Obstacle> make_obstacle(const CapsuleShape& s, ObstacleOptions o, RigidMotion m) {
  require_size(o, "radius", s.radius, s.from, s.to);
  return std::make_unique<CapsuleObstacle>(s, std::move(o), std::move(m));
}
std::unique_ptr<Obstacle> make_obstacle(const CylinderShape& s, ObstacleOptions o, RigidMotion m) {
  require_size(o, "radius", s.radius, s.from, s.to);
  require_size(o, "length", (s.to - s.from).norm(), s.from, s.to);
  const double length = (s.to - s.from).norm();
  return std::make_unique<RevolvedObstacle>(
      std::vector<Vector2d>{{0, 0}, {s.radius, 0}, {s.radius, length}, {0, length}}, along(s.from, s.to - s.from),
      std::move(o), std::move(m));
}
std::unique_ptr<Obstacle> make_obstacle(const ConeShape& s, ObstacleOptions o, RigidMotion m) {
  require_size(o, "radius", s.radius, s.base, s.tip);
  require_size(o, "height", (s.tip - s.base).norm(), s.base, s.tip);
  return std::make_unique<RevolvedObstacle>(std::vector<Vector2d>{{0, 0}, {s.radius, 0}, {0, (s.tip - s.base).norm()}},
                                            along(s.base, s.tip - s.base), std::move(o), std::move(m));
}
std::unique_ptr<Obstacle> make_obstacle(const BoxShape& s, ObstacleOptions o, RigidMotion m) {
  require_size(o, "size", s.size.minCoeff(), s.centre, s.size);
  if (!s.turned.allFinite() || !s.turned.isUnitary(1e-9))
    throw GeometryError("obstacle '" + o.name + "': its axes aren't at right angles");
  return std::make_unique<BoxObstacle>(s, std::move(o), std::move(m));
}

}  // namespace toile
