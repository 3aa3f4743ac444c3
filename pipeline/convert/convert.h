// SPDX-License-Identifier: GPL-3.0-or-later
// Panels from one file format to another: `toile convert`.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/inspect/inspect.h"

namespace toile {

struct ConvertOptions {
  InspectOptions refine;
  std::vector<std::string> only;      // names of the panels to convert; empty: all
  std::optional<Eigen::Vector3d> up;  // unit vector that points up in the input's axes; unset: as the input says, else
                                      // z in files with faces, y in patterns, which are drawn upright
};

struct Conversion {
  std::string bytes;
  std::vector<std::pair<std::filesystem::path, std::string>> beside;  // more files that belong to it
  std::size_t panels = 0;                                             // how many were converted
  std::vector<std::string> notes;                                     // what was done
  std::vector<std::string> warnings;  // of the input, and what doesn't fit into the output
  std::vector<std::string> details;   // decisions that say nothing against the input
  std::vector<std::string> refused;   // panels that can't be: left out, but for records that are replayed
};

// The file for `out`, chosen by its ending: .igs or .iges, .svg (1:1, for printing), .obj (with an .mtl beside it),
// .ply, .stl, .glb, .vtu (triangles of the material, metres), .json, .csv (control nets, metres). IGES from IGES keeps
// the unit and replays every record but the refined surfaces'; with `only`, the panels are written anew.
// A flat and a draped panel ("NAME flat", "NAME draped" on the same knots and trims) have the same triangles and the
// same texture coordinates, whether they are converted together or one by one.
// Panels without a valid trim are left out. Throws InputError for another ending and for a name in `only` that no panel
// has, GeometryError where no panel is left or one can't be refined as asked.
Conversion convert(const PanelFile& file, const std::filesystem::path& out, const ConvertOptions& options = {});

// The files that convert() makes for `out`, itself first.
std::vector<std::filesystem::path> conversion_targets(const std::filesystem::path& out);

// "x", "y", "z", with or without a sign; nothing for other words.
std::optional<Eigen::Vector3d> axis_named(std::string_view word);

// Panels laid side by side at true size (1 user unit = 1 mm): outlines, holes, marks, grain, names and a scale. Lines
// and Bezier curves of degree 2 and 3 are written as they are, others followed within 0.001 mm. Throws GeometryError
// for a panel that isn't flat.
std::string print_svg(const PanelFile& file);

}  // namespace toile
