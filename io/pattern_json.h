// Sewing patterns as JSON: panels of line, quadratic, cubic and circle edges, their placement, and stitches.
// Two dialects: Garment-Pattern-Generator (curvature = [x, y], origin at the body's centre of mass) and GarmentCode
// (curvature = {type, params}, soles at y = 0). y points up, z forwards.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "io/iges.h"

namespace toile {

// An edge of the pattern as a curve of its panel: `curve:LOOP,CURVE` in a scene.
struct PatternEdge {
  int panel = 0, loop = 0, curve = 0;
};

struct Stitch {
  PatternEdge a, b;
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
  bool soles_at_zero = false;  // the second dialect
};

// Every edge is its trim curve: the control points are A + x (B - A) + y perp(B - A) of the file's numbers, arcs are
// rational quadratics between their own vertices. A panel's curves keep the order and direction of its edges. Throws
// InputError `skirt.json:12: panel 'front': edge 3: ...`.
Pattern read_pattern(const std::filesystem::path& path);
Pattern parse_pattern(std::string_view text, const std::string& name);

}  // namespace toile
