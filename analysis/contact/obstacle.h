// SPDX-License-Identifier: GPL-3.0-or-later
// What cloth meets: bodies, tables, walls. Contact knows an Obstacle, never a shape.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "geometry/triangle_mesh.h"

namespace toile {

// The point of an obstacle's surface nearest to a place.
struct SurfacePoint {
  Eigen::Vector3d point;
  Eigen::Vector3d normal;  // unit, in which the signed distance grows: away from the obstacle
  double distance = 0;     // m, negative inside a closed obstacle
  int feature = 0;         // face, edge or vertex: the same while the place stays near it
};

struct Segment {
  Eigen::Vector3d from, to;
};

struct ObstacleOptions {
  std::string name;
  double friction = 0.3;
  double thickness = 0;  // m, offset of the surface that the cloth rests on
};

// Positions in the scene's axes [m].
//   (1) nearest() finds the nearest point of the surface wherever it is within reach, and the sign of its distance is
//       right wherever the obstacle is closed;
//   (2) edges and vertices that faces within a step of the cloth's sampling could pass are listed as sharp.
class Obstacle {
 public:
  explicit Obstacle(ObstacleOptions options) : options_(std::move(options)) {}
  virtual ~Obstacle() = default;

  const std::string& name() const { return options_.name; }
  double friction() const { return options_.friction; }
  double thickness() const { return options_.thickness; }

  // Takes the shape of time `now`; carry() then leads from the shape of time `before` to it.
  virtual void move(double before, double now) = 0;
  // Whether it has an inside, which nothing may enter; else it is a surface that is met from either side.
  virtual bool closed() const { return true; }
  // Whether every time has the same shape.
  virtual bool still() const = 0;
  // Unset where the surface is farther than `reach` from p on either side. Calls may come from several threads.
  virtual std::optional<SurfacePoint> nearest(const Eigen::Vector3d& p, double reach) const = 0;
  // Where the obstacle's material near `feature` that was at p at time `before` is now.
  virtual Eigen::Vector3d carry(const Eigen::Vector3d& p, int feature) const = 0;

  // Of the present shape: where two faces meet at more than 25 degrees from the outside, and where such edges end.
  virtual std::span<const Segment> sharp_edges() const = 0;
  virtual std::span<const Eigen::Vector3d> sharp_vertices() const = 0;

  // Of round features, whose surface is this far from the listed lines and points [m].
  virtual double sharp_radius() const { return 0; }

  // The present shape, for pictures: round shapes by chords, endless ones as far as `around`.
  virtual TriangleMesh picture(const Eigen::AlignedBox3d& around) const = 0;

 private:
  ObstacleOptions options_;
};

}  // namespace toile
