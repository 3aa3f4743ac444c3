// SPDX-License-Identifier: GPL-3.0-or-later
// Frames for ParaView: rational Bezier cells, trimmed triangles, control net, trims and constraint points.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "io/frame.h"
#include "io/pvd_index.h"

namespace toile {

// The five blocks of a frame, each a VTK XML unstructured grid (appended, zlib, little endian). Positions, weights and
// parameters are doubles; strain, stress, curvature, normals and velocities have single precision.
//   surface:   one quadrilateral of type 77 per Bezier patch of each panel, the whole untrimmed net; velocity
//   triangles: the material; strain (the larger of weft and warp: the active scalars), fields of FrameFields, uv,
//              velocity, panel
//   net:       control polygons as lines; carries_cloth, weight, and (i, j) of each control point
//   trims:     every trim curve as a polyline; panel, loop and curve numbers of the file
//   points:    constraint points; kind (value of PointKind), used, strain, uv, loop, curve
// Same frame, same bytes.
struct VtuBlocks {
  std::string surface, triangles, net, trims, points;
};
VtuBlocks format_vtu(const Frame& frame);

// Writes the blocks of a frame to FOLDER/NAME_0000/ and two indices of all frames with their times: FOLDER/NAME.pvd
// names the triangles alone, the cloth as one sees it, coloured by strain; FOLDER/NAME_parts.pvd all blocks, by way of
// FOLDER/NAME_0000.vtm. Both are whole at any time (PvdIndex). `written`: times of frames that a resumed run has made
// before; those that are not in FOLDER stay out of the indices.
class VtuSink : public FrameSink {
 public:
  VtuSink(std::filesystem::path folder, std::string name, const std::vector<double>& written = {});
  void write(const Frame& frame) override;

 private:
  std::filesystem::path folder_;
  std::string name_;
  int next_;
  PvdIndex cloth_, parts_;
};

}  // namespace toile
