// Pattern pieces from DXF R12 in the style of AAMA and ASTM D6673, read by dxflib. Built with TOILE_DXF only.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "io/iges.h"

namespace toile {

// A block is a piece; entities outside of blocks are one more. By layer: 1 boundary, 2 turn points, 4 and 80 to 83
// notches, 7 grain line, 8 internal lines, 11 internal cutouts, 13 drill holes; texts "Piece Name: ", "Size: ", "Units:
// ".
//   (1) closed boundaries are panels, cutouts and inner boundaries their holes; numbers stay the file's, its unit is
//       millimetres (METRIC) or inches (ENGLISH);
//   (2) polylines are polylines, split into curves at the turn points, where there are none at corners of more than 20
//       degrees; bulges and arcs are exact arcs;
//   (3) a panel is called as its piece, with its size where several pieces share the name.
// Throws InputError `pattern.dxf:120: ...` for what is no DXF, and where no piece has a closed boundary.
PanelFile read_dxf(const std::filesystem::path& path);
PanelFile parse_dxf(std::string_view text, const std::string& name);

}  // namespace toile
