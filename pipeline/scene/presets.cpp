// SPDX-License-Identifier: GPL-3.0-or-later
// Fabrics that need no table.
#include <array>

#include "pipeline/scene/scene.h"

namespace toile {

std::span<const FabricPreset> fabric_presets() {
  // k/rho, rho, eta, B0 of the examples of Peng & Zheng 2022; k h = (k/rho) rho, shear k/2.5.
  static const auto make = [](double k_over_rho, double density, double drag, double b0, double friction) {
    Fabric f;
    f.density = density;
    f.thickness = 0.001177;
    f.membrane = {k_over_rho * density, k_over_rho * density, k_over_rho * density / 2.5};
    f.bending = {b0, 30, 0.03, 0};
    f.drag = drag;
    f.friction = friction;
    return f;
  };
  static const std::array<FabricPreset, 3> presets = {
      FabricPreset{"kidnapped", "cloth of example 4.1(a), Peng & Zheng 2022", make(100, 0.117, 0.351, 3.3e-3, 0.3)},
      FabricPreset{"armor", "soft armor of example 4.2(a)", make(50, 0.1177, 0.353, 1e-4, 0.2)},
      FabricPreset{"skirt", "skirt of example 4.3(a)", make(50, 0.118, 0.354, 1e-5, 0.8)},
  };
  return presets;
}

}  // namespace toile
