// SPDX-License-Identifier: GPL-3.0-or-later
// The material of panels as triangles, in formats that other programs read. (Wavefront OBJ stands in obj.h.)
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "io/frame.h"

namespace toile {

// Metres; vertices in the order of TrimmedTriangles, triangles counter-clockwise seen from S_u x S_v; texture
// coordinates of pattern_coordinates(). The axes are the scene's, but for glTF, whose standard says +Y up.
// PLY, binary little endian: double positions, texture coordinates as s and t, and each vertex with its panel's number;
// the names stand in comments.
std::string format_ply(const Frame& frame);
// STL, binary: single precision, no names.
std::string format_stl(const Frame& frame);
// glTF 2.0, binary: a node and a mesh a panel, named; turned so that `frame.up` becomes +Y (of a scene with z upwards:
// x, z, -y); single precision, smooth normals, texture coordinates from the upper left corner.
std::string format_glb(const Frame& frame);

// Writes FOLDER/frame_0000.ENDING and so on. `next`: number of the first frame (a resumed run starts later).
class FileSink : public FrameSink {
 public:
  using Format = std::function<std::string(const Frame&)>;
  FileSink(std::filesystem::path folder, std::string ending, Format format, int next = 0);
  void write(const Frame& frame) override;

 private:
  std::filesystem::path folder_;
  std::string ending_;
  Format format_;
  int next_;
};

}  // namespace toile
