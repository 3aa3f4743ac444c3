// SPDX-License-Identifier: GPL-3.0-or-later
// Loops on closed surfaces: around them, across their seams, and beyond their domain by whole periods.
#pragma once

#include "io/iges/face_plane.h"

namespace toile::iges {

// Loops that wind around a closed surface bound a band, or the region about a pole: cut open along a seam.
void join_across_seams(const FacePlane& plane, std::vector<BoundaryCurves>& boundaries, std::vector<TrimLoop>& loops);

// Loops of a closed surface brought beside each other: moved by whole periods to where the largest of them begins, and
// repeated a period before where they reach over its end.
void gather(const FacePlane& plane, std::vector<TrimLoop>& loops);

// A panel's loops moved by whole periods into the domain; the surface unrolled over its seam where a loop crosses it.
void fit_into_domain(const FacePlane& plane, std::vector<BoundaryCurves>& boundaries, TrimmedSurface& face);

// The surface over a window of a closed direction that may reach over its seam, up to two periods wide, beginning at or
// after the domain's begin. Bitwise the old net but for what the cuts add.
NurbsSurface unrolled(const NurbsSurface& surface, Direction direction, Interval window);

}  // namespace toile::iges
