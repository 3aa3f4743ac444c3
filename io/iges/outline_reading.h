// SPDX-License-Identifier: GPL-3.0-or-later
// A drawing without any face: closed plane outlines are panels.
#pragma once

#include <vector>

#include "io/iges/reading.h"

namespace toile::iges {

bool holds_faces(const File& file);

// `refused`: outlines that were meant as panels and can't be, with entity and reason.
std::vector<TrimmedSurface> outline_panels(Reading& reading, std::vector<std::string>& refused);

}  // namespace toile::iges
