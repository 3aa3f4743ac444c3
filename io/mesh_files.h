// The material of panels as triangles, in formats that other programs read. (Wavefront OBJ stands in obj.h.)
#pragma once

#include <string>

#include "io/frame.h"

namespace toile {

// Metres, scene axes, vertices in the order of TrimmedTriangles, triangles counter-clockwise seen from S_u x S_v.
// PLY, binary little endian: double positions, the parameters as s and t, each face with its panel's number; the names
// stand in comments.
std::string format_ply(const Frame& frame);
// STL, binary: single precision, no names.
std::string format_stl(const Frame& frame);
// glTF 2.0, binary: a node and a mesh a panel, named; single precision, texture coordinates = parameters, smooth
// normals.
std::string format_glb(const Frame& frame);

}  // namespace toile
