// SPDX-License-Identifier: GPL-3.0-or-later
// Faces: 144, 143, 510, bounded planes (108 form 1), and surfaces that bound themselves.
#pragma once

#include <vector>

#include "io/iges/reading.h"

namespace toile::iges {

// The panels of one face in its own definition space: its own 124 and its placement come later.
std::vector<TrimmedSurface> panels_of(Reading& reading, const Entry& e);

}  // namespace toile::iges
