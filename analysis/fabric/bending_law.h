// SPDX-License-Identifier: GPL-3.0-or-later
// The bending law as the kernels evaluate it: for one number or for a pack of them. [Peng & Zheng 2022, eq. 9]
#pragma once

#include <cmath>

#include "analysis/fabric/fabric.h"
#include "analysis/parallel/lanes.h"

namespace toile {

// Constants of bending_response, made once.
struct BendingLaw {
  explicit BendingLaw(const Fabric::Bending& law)
      : b0(law.b0),
        kappa0(law.kappa0),
        kappa_reg(law.kappa_reg),
        root_reg(std::sqrt(law.kappa_reg)),
        scale(2 * law.b0 * std::sqrt(law.kappa0)) {
    const double t = std::sqrt(kappa0 * kappa0 + kappa_reg * kappa_reg), r = std::sqrt(t);
    moment0 = scale * kappa0 / r;
    energy0 = 2.0 / 3.0 * scale * kappa0 * kappa0 * (t + r * root_reg + kappa_reg) / ((t + kappa_reg) * (r + root_reg));
  }
  double b0, kappa0, kappa_reg, root_reg;
  double scale;             // 2 b0 sqrt(kappa0)
  double moment0, energy0;  // at kappa0
};

template <class Real>
struct BendingTerms {
  Real energy, moment, slope;
};

// kappa_reg > 0. The difference (k^2 + kr^2)^(3/4) - kr^(3/2) is factored so that it doesn't cancel for k << kr.
template <class Real>
inline BendingTerms<Real> evaluate(const BendingLaw& law, Real kappa) {
  const Real zero = broadcast<Real>(0);
  const auto negative = kappa < zero;
  const Real magnitude = select(negative, -kappa, kappa);
  const auto root_branch = magnitude < law.kappa0;

  const Real k2 = kappa * kappa;
  const Real s = k2 + law.kappa_reg * law.kappa_reg;
  const Real t = sqrt(s), r = sqrt(t);
  const Real root_moment = law.scale * magnitude / r;
  const Real root_energy = (2.0 / 3.0 * law.scale) * k2 * (t + r * law.root_reg + law.kappa_reg) /
                           ((t + law.kappa_reg) * (r + law.root_reg));
  const Real root_slope = law.scale * (1.0 - 0.5 * k2 / s) / r;

  const Real beyond = magnitude - law.kappa0;
  const Real line_moment = law.moment0 + law.b0 * beyond;
  const Real line_energy = law.energy0 + (law.moment0 + 0.5 * law.b0 * beyond) * beyond;

  const Real moment = select(root_branch, root_moment, line_moment);
  return {select(root_branch, root_energy, line_energy), select(negative, -moment, moment),
          select(root_branch, root_slope, zero + law.b0)};
}

}  // namespace toile
