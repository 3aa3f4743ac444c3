// SPDX-License-Identifier: GPL-3.0-or-later
// Marks of panels (notches, grain lines, drill holes, lines, texts) as records: a group (402 form 7) holds a face and
// its marks. A curve is a curve on the surface (142), a point a 116, a text a 212; a name (406 form 15) says the kind:
// "notch", or "notch: V2" where the mark has words.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "geometry/trimmed_surface.h"
#include "io/iges/reading.h"

namespace toile::iges {

std::string label_of(const PanelMark& mark);

// The marks of every group that holds one face, given to the panel that this face became first. Also plain curves of
// such a group, where they lie on a flat panel. `faces`: the entry of each panel.
void read_marks(Reading& reading, std::span<const Entry* const> faces, std::span<TrimmedSurface> panels);

}  // namespace toile::iges
