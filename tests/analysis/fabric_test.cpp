// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/fabric/fabric.h"

#include <cmath>
#include <limits>

#include "analysis/fabric/membrane_law.h"
#include "geometry/error.h"
#include "support/near.h"

namespace toile {
namespace {

const Fabric::Bending law{.b0 = 3.3e-3, .kappa0 = 30, .kappa_reg = 0.03, .twist = 0};

// Pulled one way, free sheets of the classical shell carry E t per strain and narrow by Poisson's ratio.
TEST(MembraneStress, OfAnIsotropicSheetPulledOneWayIsYoungsModulusTimesThickness) {
  const double E = 3e6, nu = 0.3, t = 0.002, strain = 0.01;
  const Fabric::Membrane sheet = isotropic(E, nu, t).membrane;
  const MembraneStress<double> along = membrane_stress(sheet, strain, -nu * strain, 0.0);
  expect_near_rel(along.S11, E * t * strain, 1e-13);
  expect_near_rel(along.S22, 0, 0, 1e-13 * E * t * strain);
  const MembraneStress<double> sheared = membrane_stress(sheet, 0.0, 0.0, strain);
  expect_near_rel(sheared.S12, E * t / (2 * (1 + nu)) * strain, 1e-13);
}

TEST(BendingResponse, MomentIsTheDerivativeOfTheEnergyAndSlopeThatOfTheMoment) {
  for (const double kappa : {-400.0, -31.0, -12.0, -0.1, -0.02, 0.0, 1e-3, 0.03, 0.7, 29.0, 35.0, 1000.0}) {
    const double h = 1e-5 * std::max(std::abs(kappa), law.kappa_reg);
    const BendingResponse at = bending_response(law, kappa), plus = bending_response(law, kappa + h),
                          minus = bending_response(law, kappa - h);
    expect_near_rel(at.moment, (plus.energy - minus.energy) / (2 * h), 1e-7, 1e-9);
    expect_near_rel(at.slope, (plus.moment - minus.moment) / (2 * h), 1e-7);
  }
}

TEST(BendingResponse, IsOddAndItsSlopeIsPositive) {
  double last = -std::numeric_limits<double>::infinity();
  for (int k = -500; k <= 500; ++k) {
    const double kappa = 0.12 * k;
    const BendingResponse plus = bending_response(law, kappa), minus = bending_response(law, -kappa);
    EXPECT_EQ(plus.moment, -minus.moment);
    EXPECT_EQ(plus.energy, minus.energy);
    EXPECT_GT(plus.slope, 0);
    EXPECT_GT(plus.moment, last);
    last = plus.moment;
  }
}

TEST(BendingResponse, BranchesMeetInEnergyAndMoment) {
  for (const double reg : {0.03, 3.0, 100.0}) {
    Fabric::Bending l = law;
    l.kappa_reg = reg;
    const BendingResponse below = bending_response(l, std::nextafter(l.kappa0, 0.0)),
                          at = bending_response(l, l.kappa0);
    expect_near_rel(below.energy, at.energy, 1e-14);
    expect_near_rel(below.moment, at.moment, 1e-14);
    EXPECT_EQ(at.slope, l.b0);
  }
}

TEST(BendingResponse, SlopeAtZeroIsThatOfTheRegularisation) {
  expect_near_rel(bending_response(law, 0).slope, 2 * law.b0 * std::sqrt(law.kappa0 / law.kappa_reg), 1e-14);
}

TEST(BendingResponse, TendsToThePublishedLaw) {
  Fabric::Bending l = law;
  l.kappa_reg = 1e-9;
  for (const double kappa : {0.5, 10.0, 29.9, 30.1, 200.0}) {
    const bool root = kappa <= l.kappa0;
    const double moment = root ? 2 * l.b0 * std::sqrt(l.kappa0 * kappa) : l.b0 * kappa + l.b0 * l.kappa0;
    const double energy = root ? 4.0 / 3.0 * l.b0 * std::sqrt(l.kappa0) * std::pow(kappa, 1.5)
                               : l.b0 * kappa * kappa / 2 + l.b0 * l.kappa0 * kappa - l.b0 * l.kappa0 * l.kappa0 / 6;
    expect_near_rel(bending_response(l, kappa).moment, moment, 1e-12);
    expect_near_rel(bending_response(l, kappa).energy, energy, 1e-9);
  }
}

TEST(BendingResponse, SmallCurvaturesKeepTheirDigits) {
  Fabric::Bending l = law;
  l.kappa_reg = 100;
  const double kappa = 1e-5;
  expect_near_rel(bending_response(l, kappa).energy, 0.5 * bending_response(l, 0).slope * kappa * kappa, 1e-12);
}

TEST(BendingResponse, IsLinearWithoutARootBranch) {
  const Fabric::Bending linear{.b0 = 2, .kappa0 = 0, .kappa_reg = 0.03, .twist = 0};
  for (const double kappa : {-3.0, 0.0, 1e-4, 0.5, 70.0}) {
    const BendingResponse r = bending_response(linear, kappa);
    EXPECT_DOUBLE_EQ(r.moment, 2 * kappa);
    EXPECT_DOUBLE_EQ(r.energy, kappa * kappa);
    EXPECT_DOUBLE_EQ(r.slope, 2);
  }
}

TEST(Fabric, ImpossibleNumbersAreNamed) {
  const auto message = [](auto change) {
    Fabric fabric;
    change(fabric);
    try {
      validate(fabric);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(message([](Fabric&) {}), "");
  EXPECT_NE(message([](Fabric& f) { f.density = 0; }).find("density"), std::string::npos);
  EXPECT_NE(message([](Fabric& f) { f.membrane.shear = -1; }).find("membrane.shear"), std::string::npos);
  EXPECT_NE(message([](Fabric& f) { f.bending.kappa_reg = 0; }).find("kappa_reg"), std::string::npos);
  EXPECT_NE(message([](Fabric& f) { f.membrane.weft = -2.5e-9; }).find("is -2.5e-09,"), std::string::npos);
  EXPECT_NE(message([](Fabric& f) {
              f.bending.b0 = 1e-9, f.bending.coupling = 2e-9;
            }).find("is 2e-09, must lie between -1e-09 and 1e-09"),
            std::string::npos);
  EXPECT_NE(message([](Fabric& f) { f.drag = std::nan(""); }).find("drag"), std::string::npos);
  EXPECT_EQ(message([](Fabric& f) { f.bending = {.b0 = 0, .kappa0 = 0, .kappa_reg = 0, .twist = 0}; }), "");
}

}  // namespace
}  // namespace toile
