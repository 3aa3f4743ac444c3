// Panels from one file format to another: `toile convert`.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/inspect.h"

namespace toile {

struct Conversion {
  std::string bytes;
  std::vector<std::string> notes;     // what was done
  std::vector<std::string> warnings;  // of the input, and what doesn't fit into the output
};

// The file for `out`, chosen by its ending: .igs or .iges, .svg (1:1, for printing), .obj, .ply, .stl, .glb, .vtu
// (triangles of the material, metres). IGES from IGES keeps the unit and replays every record but the refined
// surfaces'. Throws InputError for another ending, GeometryError where a panel has no valid trim or can't be refined as
// asked.
Conversion convert(const PanelFile& file, const std::filesystem::path& out, const InspectOptions& options);

// Panels laid side by side at true size (1 user unit = 1 mm): outlines, holes, marks, grain, names and a scale. Lines
// and Bezier curves of degree 2 and 3 are written as they are, others followed within 0.001 mm. Throws GeometryError
// for a panel that isn't flat.
std::string print_svg(const PanelFile& file);

}  // namespace toile
