// SPDX-License-Identifier: GPL-3.0-or-later
// What tests of panel readers ask of a face.
#pragma once

#include <algorithm>

#include "trimming/loops.h"
#include "trimming/quadrature.h"

namespace toile::test {

// Of the material, unit of the net squared.
inline double area(TrimmedSurface face) {
  validate_loops(face);
  return measure(face, trace_trims(face)).area;
}

inline int count(const TrimmedSurface& face, MarkKind kind) {
  return static_cast<int>(std::ranges::count(face.marks, kind, &PanelMark::kind));
}

}  // namespace toile::test
