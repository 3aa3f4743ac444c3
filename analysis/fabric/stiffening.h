// SPDX-License-Identifier: GPL-3.0-or-later
// How strain changes the stiffness of cloth under laws (8) and (9).
#pragma once

#include "geometry/fields.h"

namespace toile {

struct StrainRange {
  double least = 0, largest = 0;  // of E11, E22 and 0
};
void fields(auto& archive, Like<StrainRange> auto& r) {
  archive(r.least, r.largest);
}

// Is the cloth stiffer by more than `share` than it was? The membrane's tangent grows like 1 + 3 E in tension; squeezed
// cloth bends more stiffly, per length like 1 / (1 + 2 E).
inline bool stiffer(const StrainRange& now, const StrainRange& before, double share) {
  return 1 + 3 * now.largest > (1 + share) * (1 + 3 * before.largest) ||
         1 + 2 * now.least < (1 - share) * (1 + 2 * before.least);
}

}  // namespace toile
