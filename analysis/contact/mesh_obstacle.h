// SPDX-License-Identifier: GPL-3.0-or-later
// A body of triangles.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "analysis/contact/bounds_tree.h"
#include "analysis/contact/obstacle.h"
#include "geometry/triangle_mesh.h"

namespace toile {

// How a mesh moves: its shape in axes of its own, and these axes in the scene's.
struct MeshMotion {
  std::function<Eigen::Isometry3d(double t)> place = {};  // unset: the scene's axes
  // Shapes at times, ascending, 3 x n [m]; before the first and after the last the mesh keeps that shape. Empty: it
  // keeps the shape that it is given with.
  std::vector<Eigen::Matrix3Xd> shapes = {};
  std::vector<double> times = {};  // s
  // Between two shapes: in proportion to time, or by a quintic that starts and ends without velocity and acceleration.
  bool smooth = false;
};

// Triangles counter-clockwise from the outside, edges of two faces at most that run along them in opposite ways.
//   (1) the sign of a distance is that of the angle-weighted normal (Baerentzen & Aanaes 2005) of the face, edge or
//       vertex that is nearest: of a closed mesh that doesn't pass through itself it is the side;
//   (2) a mesh with a border is a surface with two sides, and the sign says on which of them a place is;
//   (3) carry() is exact where the mesh moves as a rigid body; else it takes a place along with the triangle at its
//       feature, by barycentric coordinates and the distance from its plane;
//   (4) `feature` counts faces, then edges, then vertices;
//   (5) beside the edges sharper than 25 degrees and their ends, tips are sharp vertices: where a face turns more than
//       that away from the mean of those around. Of a mesh with a border, edges are sharp from both sides, and the
//       border is.
class MeshObstacle : public Obstacle {
 public:
  // Throws GeometryError where the mesh is not as above, has a triangle without area or a number that isn't finite.
  MeshObstacle(TriangleMesh mesh, MeshMotion motion, ObstacleOptions options);

  void move(double before, double now) override;
  bool still() const override { return !motion_.place && motion_.shapes.empty(); }
  std::optional<SurfacePoint> nearest(const Eigen::Vector3d& p, double reach) const override;
  Eigen::Vector3d carry(const Eigen::Vector3d& p, int feature) const override;
  std::span<const Segment> sharp_edges() const override { return sharp_edges_; }
  std::span<const Eigen::Vector3d> sharp_vertices() const override { return sharp_vertices_; }

  TriangleMesh picture(const Eigen::AlignedBox3d&) const override {
    return {(place_.linear() * now_).colwise() + place_.translation(), triangles_};
  }
  // Whether no edge has one face only.
  bool closed() const override { return closed_; }

 private:
  // A place in the sequence of shapes: between number `shape` and the next, at a share of the way.
  struct ShapeTime {
    int shape = 0;
    double share = 0;
    bool operator==(const ShapeTime&) const = default;
  };

  ShapeTime shape_time(double t) const;
  Eigen::Matrix3Xd shape(const ShapeTime& at) const;
  Eigen::Isometry3d place_at(double t) const;
  void take_shape();
  void find_sharp();
  void place_sharp();
  int face_of(int feature) const;
  Eigen::Vector3d feature_normal(int feature) const;

  std::vector<Triangle> triangles_;
  MeshTopology topology_;
  MeshMotion motion_;
  bool closed_ = true;
  // In the mesh's own axes.
  Eigen::Matrix3Xd before_, now_;              // vertices
  Eigen::Matrix3Xd normals_before_, normals_;  // of faces
  ShapeTime shape_before_, shape_now_;
  BoundsTree tree_;  // of faces, now
  std::vector<Box> boxes_;
  std::vector<int> sharp_edge_, sharp_vertex_;
  // From there to the scene's.
  Eigen::Isometry3d place_ = Eigen::Isometry3d::Identity(), to_own_axes_ = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d to_own_axes_before_ = Eigen::Isometry3d::Identity();
  bool turned_ = false;  // place_ differs from that of the time before
  std::vector<Segment> sharp_edges_;
  std::vector<Eigen::Vector3d> sharp_vertices_;
};

}  // namespace toile
