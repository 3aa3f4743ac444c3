// SPDX-License-Identifier: GPL-3.0-or-later
// What a cloth is made of: one table of numbers, and the two laws of the paper as functions of strain and curvature.
#pragma once

namespace toile {

enum class RestCurvature { zero, panel };

// Defaults: the cloth of example 4.1(a). [Peng & Zheng 2022, 4.1]
struct Fabric {
  double density = 0.117;       // kg/m2, of the rest area
  double thickness = 0.001177;  // m
  struct Membrane {             // S = k E, eq. (8), as resultants
    double weft = 11.7;         // N/m
    double warp = 11.7;         // N/m
    double shear = 4.68;        // N/m, on 2 E12
    double coupling = 0;        // N/m, of weft's stress on warp's strain and the other way; the paper's law has none
  } membrane;
  struct Bending {            // eq. (9), regularised
    double b0 = 3.3e-3;       // N m (moment per length over curvature)
    double kappa0 = 30;       // 1/m, where the square-root branch ends; 0 makes the law linear, m = b0 kappa
    double kappa_reg = 0.03;  // 1/m, below which the moment becomes linear; makes the slope at 0 finite
    double twist = 0;         // N m, energy twist * kappa12^2 per area; the paper's law has none. A linear law with
                              // twist = b0 is the isotropic plate without lateral contraction
    double coupling = 0;      // N m, of weft's moment on warp's curvature and the other way
  } bending;
  double drag = 0.351;    // kg/(m2 s), force per area against the velocity relative to the wind
  double friction = 0.3;  // of cloth on cloth
  RestCurvature rest_curvature = RestCurvature::panel;
};

// The classical isotropic shell of Young's modulus E [Pa], Poisson's ratio nu and a thickness [m], linear in strain and
// curvature: E t / (1 - nu^2) and E t^3 / 12 (1 - nu^2), nu times that across.
Fabric isotropic(double youngs_modulus, double poissons_ratio, double thickness);

// Energy per area, moment per length and slope of eq. (9), regularised: the square-root branch uses
// (kappa^2 + kappa_reg^2)^(1/4), the linear branch continues it with the same energy and moment at kappa0.
//   (1) moment = d energy / d kappa, odd in kappa; (2) slope = d moment / d kappa, positive, largest at 0 as long as
//       kappa_reg < 4 kappa0, where it is 2 b0 sqrt(kappa0 / kappa_reg); (3) energy and moment are continuous, the
//       slope jumps to b0 at kappa0 (which itself counts to the linear branch).
struct BendingResponse {
  double energy = 0;  // N/m
  double moment = 0;  // N
  double slope = 0;   // N m
};
BendingResponse bending_response(const Fabric::Bending& law, double kappa);

// Throws Error naming the entry of the table that is negative, not finite, or (kappa_reg where there is bending,
// density) not positive.
void validate(const Fabric& fabric);

}  // namespace toile
