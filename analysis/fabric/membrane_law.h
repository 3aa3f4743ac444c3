// SPDX-License-Identifier: GPL-3.0-or-later
// The membrane law, for one number or for a pack of them. [Peng & Zheng 2022, eq. 8]
#pragma once

#include "analysis/fabric/fabric.h"

namespace toile {

// Stress resultants in weft, warp and shear [N/m].
template <class Real>
struct MembraneStress {
  Real S11, S22, S12;
};

// Of the strains E11, E22 and g12 = 2 E12. The law is linear, so that changes of the strains give those of the stress.
template <class Real>
inline MembraneStress<Real> membrane_stress(const Fabric::Membrane& law, Real E11, Real E22, Real g12) {
  MembraneStress<Real> s{law.weft * E11, law.warp * E22, law.shear * g12};
  if (law.coupling != 0) s.S11 = s.S11 + law.coupling * E22, s.S22 = s.S22 + law.coupling * E11;
  return s;
}

}  // namespace toile
