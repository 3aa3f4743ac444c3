// SPDX-License-Identifier: GPL-3.0-or-later
// One picture of a run in time, as plain data, and where pictures go.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "geometry/nurbs_surface.h"
#include "geometry/triangle_mesh.h"
#include "geometry/trimmed_surface.h"
#include "trimming/constraint_points.h"
#include "trimming/triangulation.h"

namespace toile {

// Fields on the vertices of a panel's triangles, in their order; an empty array means "not known".
struct FrameFields {
  std::vector<Eigen::Vector3d> strain;     // E_weft, E_warp, 2 E_weft,warp
  std::vector<Eigen::Vector3d> curvature;  // change from rest: weft, warp, twist [1/m]
  std::vector<Eigen::Vector3d> second_pk;  // weft, warp, shear [N/m]
  std::vector<Eigen::Vector2d> nominal;    // weft, warp [N/m]
};

// A panel at one instant, SI, scene axes. Pointers and spans live as long as the call that takes the frame.
struct FramePanel {
  std::string name;
  const NurbsSurface* surface = nullptr;        // the deformed net [m]
  const NurbsSurface* flat = nullptr;           // its pattern [m], which textures follow; null: `surface`
  const TrimmedSurface* face = nullptr;         // its loops; parameters agree with `surface`
  const TrimmedTriangles* triangles = nullptr;  // parameters agree with `surface`
  FrameFields fields;
  Eigen::Matrix3Xd velocity;        // of the control points [m/s], as the net; empty: not known
  std::vector<bool> carries_cloth;  // per control point; empty: all do
  std::span<const ConstraintPoint> points;
  std::vector<Eigen::Vector2d> point_strain;  // weft, warp at `points`; empty: not known
  // Nominal stress at `points` [N/m]: smoothed weft, warp, then as it is at the point itself; empty: not known.
  std::vector<Eigen::Vector4d> point_stress;
};

// What the cloth meets, SI, scene axes.
struct FrameBody {
  std::string name;
  TriangleMesh mesh;
};

struct Frame {
  int number = 0;   // 0, 1, 2, ...
  double time = 0;  // s
  std::span<const FramePanel> panels;
  Eigen::Vector3d up{0, 0, 1};  // unit vector
  std::span<const FrameBody> bodies = {};
};

// Frames arrive once, in order (std::logic_error otherwise). A failed write throws OutputError; files appear whole or
// not at all, and an index never names a file that is not there.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  virtual void write(const Frame& frame) = 0;
};

}  // namespace toile
