// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/fabric/fabric.h"

#include <cmath>
#include <string>

#include "analysis/fabric/bending_law.h"
#include "geometry/error.h"

namespace toile {

BendingResponse bending_response(const Fabric::Bending& law, double kappa) {
  if (law.b0 == 0) return {};
  const BendingTerms<double> terms = evaluate(BendingLaw(law), kappa);
  return {terms.energy, terms.moment, terms.slope};
}

void validate(const Fabric& fabric) {
  const auto check = [](const char* name, double value, bool positive) {
    if (std::isfinite(value) && (positive ? value > 0 : value >= 0)) return;
    throw Error(std::string("fabric: ") + name + " is " + std::to_string(value) + ", must be " +
                (positive ? "positive" : "zero or positive"));
  };
  check("density", fabric.density, true);
  check("thickness", fabric.thickness, false);
  check("membrane.weft", fabric.membrane.weft, false);
  check("membrane.warp", fabric.membrane.warp, false);
  check("membrane.shear", fabric.membrane.shear, false);
  check("bending.b0", fabric.bending.b0, false);
  check("bending.kappa0", fabric.bending.kappa0, false);
  check("bending.kappa_reg", fabric.bending.kappa_reg, fabric.bending.b0 > 0);
  check("bending.twist", fabric.bending.twist, false);
  check("drag", fabric.drag, false);
  check("friction", fabric.friction, false);
}

}  // namespace toile
