// SPDX-License-Identifier: GPL-3.0-or-later
// The one draped panel of a run's file, seen from above.
#pragma once

#include "io/panel_file.h"
#include "pipeline/measure/shadow.h"

namespace toile {

struct DrapedPanel {
  Eigen::Matrix2Xd points;  // m, in the level plane
  std::vector<Triangle> triangles;
  Eigen::Vector2d centre{0, 0};  // where the middle of the flat panel has come to
  double flat_area = 0;          // m2
};

// Of a file that `toile drape` wrote: "NAME flat" and "NAME draped". Triangles are within 0.1 mm of the cloth; up is
// what the file says, else z. Throws InputError where the file holds no such pair, or several; GeometryError for trims
// that aren't valid.
DrapedPanel draped_panel(const PanelFile& file);

}  // namespace toile
