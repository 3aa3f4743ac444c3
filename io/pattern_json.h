// SPDX-License-Identifier: GPL-3.0-or-later
// Sewing patterns as JSON: panels of line, quadratic, cubic and circle edges, their placement, and stitches.
// Two dialects: Garment-Pattern-Generator (curvature = [x, y], origin at the body's centre of mass) and GarmentCode
// (curvature = {type, params}, soles at y = 0). y points up, z forwards.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "io/gluing.h"
#include "io/iges.h"

namespace toile {

// An edge of the pattern as a curve of its panel: `curve:LOOP,CURVE` in a scene.
struct PatternEdge {
  int panel = 0, loop = 0, curve = 0;
};

// One edge a side, or one to several: those are run one after the other in their order.
struct Stitch {
  std::vector<PatternEdge> a, b;
  bool reverse = true;  // b is run backwards: the start of one side meets the end of the other. The format says so for
                        // every stitch but those marked "right_wrong", which join right side to wrong side.
  int line = 0;
};

// x -> translate + R x with the panel in the plane z = 0; R turns about the x, then the y, then the z axis.
struct PatternPlace {
  Eigen::Vector3d translate{0, 0, 0};  // m
  Eigen::Vector3d rotate_deg{0, 0, 0};
};

struct Pattern {
  PanelFile file;                    // nets in millimetres; the parameters are the pattern's own numbers
  std::vector<PatternPlace> places;  // of file.panels
  std::vector<Stitch> stitches;
  Gluing gluing;               // of the panels by the stitches
  bool soles_at_zero = false;  // the second dialect
};

// Every edge is its trim curve: the control points are A + x (B - A) + y perp(B - A) of the file's numbers, arcs are
// rational quadratics between their own vertices. A panel's curves keep the order and direction of its edges. A panel
// that can't be (open, crossing itself, with wrong numbers) is left out and listed as refused, and so are stitches of
// its edges; an edge drawn out and back is a slit. Where the garment glued by its stitches is no surface a warning says
// so. Throws InputError `skirt.json:12: panel 'front': edge 3: ...` for what is no pattern, GeometryError where no
// panel is left.
Pattern read_pattern(const std::filesystem::path& path);
Pattern parse_pattern(std::string_view text, const std::string& name);

}  // namespace toile
