// SPDX-License-Identifier: GPL-3.0-or-later
// Which entities are faces, and where instances and solids put them.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "io/iges/reading.h"

namespace toile::iges {

// A face-bearing entity and its place.
struct PlacedFace {
  const Entry* entry;
  Eigen::Affine3d placement;
};

// Every face once for each place, in the file's order; surfaces that nobody uses are faces too. What can't be followed
// is quarantined.
std::vector<PlacedFace> find_faces(Reading& reading);

}  // namespace toile::iges
