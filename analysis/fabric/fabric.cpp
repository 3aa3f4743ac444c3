// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/fabric/fabric.h"

#include <cmath>
#include <string>

#include "analysis/fabric/bending_law.h"
#include "geometry/error.h"
#include "geometry/text.h"

namespace toile {

BendingResponse bending_response(const Fabric::Bending& law, double kappa) {
  if (law.b0 == 0) return {};
  const BendingTerms<double> terms = evaluate(BendingLaw(law), kappa);
  return {terms.energy, terms.moment, terms.slope};
}

Fabric isotropic(double youngs_modulus, double poissons_ratio, double thickness) {
  const double membrane = youngs_modulus * thickness / (1 - poissons_ratio * poissons_ratio);
  const double bending = membrane * thickness * thickness / 12;
  Fabric out;
  out.thickness = thickness;
  out.membrane = {membrane, membrane, 0.5 * (1 - poissons_ratio) * membrane, poissons_ratio * membrane};
  out.bending = {};
  out.bending.b0 = bending;
  out.bending.kappa0 = 0;
  out.bending.twist = (1 - poissons_ratio) * bending;
  out.bending.coupling = poissons_ratio * bending;
  return out;
}

void validate(const Fabric& fabric) {
  const auto check = [](const char* name, double value, bool positive) {
    if (std::isfinite(value) && (positive ? value > 0 : value >= 0)) return;
    throw Error(std::string("fabric: ") + name + " is " + text(value) + ", must be " +
                (positive ? "positive" : "zero or positive"));
  };
  check("density", fabric.density, true);
  check("thickness", fabric.thickness, false);
  check("membrane.weft", fabric.membrane.weft, false);
  check("membrane.warp", fabric.membrane.warp, false);
  check("membrane.shear", fabric.membrane.shear, false);
  check("bending.b0", fabric.bending.b0, false);
  // More would make some stretch or bend give energy.
  const auto check_coupling = [](const char* name, double value, double most) {
    if (std::abs(value) <= most) return;  // so is nothing that is no number
    throw Error(std::string("fabric: ") + name + " is " + text(value) + ", must lie between -" + text(most) + " and " +
                text(most));
  };
  check_coupling("membrane.coupling", fabric.membrane.coupling, std::sqrt(fabric.membrane.weft * fabric.membrane.warp));
  check_coupling("bending.coupling", fabric.bending.coupling, fabric.bending.b0);
  check("bending.kappa0", fabric.bending.kappa0, false);
  check("bending.kappa_reg", fabric.bending.kappa_reg, fabric.bending.b0 > 0);
  check("bending.twist", fabric.bending.twist, false);
  check("drag", fabric.drag, false);
  check("friction", fabric.friction, false);
}

}  // namespace toile
