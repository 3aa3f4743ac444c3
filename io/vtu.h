// Frames for ParaView: rational Bezier cells, trimmed triangles, control net, trims and constraint points.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "io/frame.h"

namespace toile {

// The five blocks of a frame, each a VTK XML unstructured grid (appended, zlib, little endian). Positions, weights and
// parameters are doubles; strain, stress, curvature, normals and velocities have single precision.
//   surface:   one quadrilateral of type 77 per Bezier patch of each panel, the whole untrimmed net; velocity
//   triangles: the material; fields of FrameFields, uv, velocity, panel
//   net:       control polygons as lines; carries_cloth, weight, and (i, j) of each control point
//   trims:     every trim curve as a polyline; panel, loop and curve numbers of the file
//   points:    constraint points; kind (value of PointKind), used, strain, uv, loop, curve
// Same frame, same bytes.
struct VtuBlocks {
  std::string surface, triangles, net, trims, points;
};
VtuBlocks format_vtu(const Frame& frame);

// Writes FOLDER/NAME_0000.vtm, its blocks in FOLDER/NAME_0000/, and FOLDER/NAME.pvd, which names all frames with their
// times and is replaced after each frame. `written`: times of frames that a resumed run has made before; those that are
// not in FOLDER stay out of the index.
class VtuSink : public FrameSink {
 public:
  VtuSink(std::filesystem::path folder, std::string name, std::vector<double> written = {});
  void write(const Frame& frame) override;

 private:
  std::filesystem::path folder_;
  std::string name_;
  std::vector<double> times_;
};

}  // namespace toile
