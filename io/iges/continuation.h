// SPDX-License-Identifier: GPL-3.0-or-later
// Faces whose curves go on a little beyond the surface that the file gives.
#pragma once

#include <optional>

#include "io/iges/face.h"

namespace toile::iges {

// The surface continued (geometry/continuation.h) to where the outer boundary's parameter curves reach, by a tenth of
// its domain at most; by a thousandth where no model curves bear witness: those must lie where the parameter curves are
// on the continued surface. Nothing where the curves stay within it but for rounding. `by` takes how much further it
// goes, as a part of the domain.
std::optional<FileSurface> continued_surface(const FileSurface& surface, const std::vector<BoundaryCurves>& boundaries,
                                             const FaceOptions& options, double& by);

}  // namespace toile::iges
