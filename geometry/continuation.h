// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces beyond their domain.
#pragma once

#include <optional>

#include "geometry/nurbs_surface.h"

namespace toile {

// The surface with a domain that reaches to `to` where that is larger: the functions of its outermost spans go on. It
// is the same within its own domain, but for rounding, and clamped. Nothing where a weight wouldn't stay positive.
std::optional<NurbsSurface> continued(const NurbsSurface& surface, Direction direction, Interval to);

}  // namespace toile
