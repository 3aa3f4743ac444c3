// A drawing without any face: closed plane outlines are panels. (iges.md, 12)
#pragma once

#include <vector>

#include "io/iges/reading.h"

namespace toile::iges {

bool holds_faces(const File& file);

std::vector<TrimmedSurface> outline_panels(Reading& reading);

}  // namespace toile::iges
