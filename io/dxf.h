// SPDX-License-Identifier: GPL-3.0-or-later
// Pattern pieces from DXF in the style of AAMA and ASTM D6673, and plain drawings, read by dxflib. Built with TOILE_DXF
// only.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "io/panel_file.h"

namespace toile {

// A block is a piece, mapped as it is inserted; entities outside of blocks are one more. By layer: 1 boundary, 2 turn
// points, 4 and 80 to 83 notches, 6 mirror lines, 7 grain line, 8 internal lines, 11 internal cutouts, 13 drill holes,
// 14 sew line; 84 to 87 repeat 1, 8, 11 and 14 as curves and are read only where those aren't there. Texts "Piece Name:
// ", "Size: ", "Quantity: ", "Paired: "; of the file "Sample Size: " and "Units: ".
//   (1) closed boundaries are panels, cutouts and inner boundaries their holes; numbers stay the file's, in the unit
//       that it says (text, $INSUNITS, $MEASUREMENT) or the options do;
//   (2) of a piece in several sizes one is read: the asked one, else the sample size; "all" reads them all;
//   (3) a boundary of several polylines is cut into curves at their ends, a closed polyline at its turn points, or
//       where there are none at corners of more than 20 degrees; where sizes then differ in their number of curves, at
//       sharper corners only, so that curve K is the same edge in each size. Bulges, arcs, ellipses and splines are
//       exact;
//   (4) a piece with an edge on its mirror line is unfolded, at each of its mirror lines; a paired piece is two panels,
//       the second mirrored;
//   (5) a panel is called as its piece, in UTF-8; with its size where several sizes are read, with a number where names
//       repeat;
//   (6) where nothing lies on layer 1 every closed outline is a panel (io/outlines.h).
// Pieces that can't be panels are listed as refused with line, place and gap. Throws InputError `pattern.dxf:120: ...`
// for what is no DXF, no known size or unit, GeometryError where no piece is left.
PanelFile read_dxf(const std::filesystem::path& path, const PanelChoice& choice = {});
PanelFile parse_dxf(std::string_view text, const std::string& name, const PanelChoice& choice = {});

}  // namespace toile
