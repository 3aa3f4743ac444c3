// SPDX-License-Identifier: GPL-3.0-or-later
// Curves by pointer: composites flattened, matrices applied.
#pragma once

#include <vector>

#include "io/iges/reading.h"
#include "io/iges/surfaces.h"

namespace toile::iges {

// The curves of a boundary, in order. InputError where the pointer leads to no curve.
std::vector<Curve3> curves_of(Reading& reading, int sequence, const Entry& from, const char* role);

// One curve with the file's own parameter along it, which a surface's parameters are made of.
NaturalCurve natural_curve_of(Reading& reading, const Entry& e);

}  // namespace toile::iges
