// SPDX-License-Identifier: GPL-3.0-or-later
// The formats that panels and drapes are written in: one table for `toile convert`, frames, schemas and help.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/frame.h"

namespace toile {

enum class FileFormat { iges, svg, obj, ply, stl, glb, vtu, json, csv };

enum class FormatContent { faces, drawing, triangles, nets };

struct NamedFormat {
  FileFormat format;
  std::string_view name;    // "iges", as scenes call it
  std::string_view ending;  // ".igs", lower case
  FormatContent what;
  bool of_frames;  // whether frames of a run may have it
  // The file of one frame; `material_file` is for OBJ alone. Null for those that need more than a frame: faces and
  // drawings.
  std::string (*text)(const Frame& frame, std::string_view material_file);
};

// In the order of FileFormat.
std::span<const NamedFormat> file_formats();
const NamedFormat& named_format(FileFormat format);

// By its ending, of any case; ".iges" is IGES too. Nothing where no format has it.
std::optional<FileFormat> format_with_ending(std::string_view ending);

// Of formats that frames may have, as scenes call them.
std::vector<std::string> frame_format_names();

}  // namespace toile
