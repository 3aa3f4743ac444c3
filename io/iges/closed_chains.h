// SPDX-License-Identifier: GPL-3.0-or-later
// One boundary record that holds several closed chains: both end circles of a tube, an outline with its holes.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

namespace toile::iges {

// Where each chain begins, the first at 0, for curves that are given by their ends in space and follow each other
// within `reach`, each running either way. One chain where any of several would stay open.
std::vector<std::size_t> closed_chains(const std::vector<std::array<Eigen::Vector3d, 2>>& ends, double reach);

}  // namespace toile::iges
