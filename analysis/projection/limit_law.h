// SPDX-License-Identifier: GPL-3.0-or-later
// The strain limit as a law: which strain a constraint force leaves. One row, local numbers.
#pragma once

#include <algorithm>
#include <cmath>

namespace toile {

// Admissible strains of one direction: C in (-compress, stretch). Up to `slack` of either end nothing resists; an
// equality (slack 0) resists from C = 0 on.
struct StrainBand {
  double stretch = 0.01, compress = 0.01;
  double slack = 0;
};

// With compliance a (strain per multiplier) and the width w = (1 - slack) limit of the side that lambda pulls to,
//   C(lambda) = slack limit + w s / (1 + s),  s = a |lambda| / w,   and the mirror image for lambda < 0.
//   (1) a is the slope at lambda = 0; (2) |C| stays below the limit for every force; (3) C grows with lambda.
// A stiff spring at small strains that becomes a wall at the limit: unlike a hard equality it has one answer where rows
// depend on each other, and the answer converges as the time step vanishes.
class LimitLaw {
 public:
  LimitLaw(const StrainBand& band, double compliance) : band_(band), compliance_(compliance) {}

  double strain(double lambda) const {
    const double s = compliance_ * std::abs(lambda) / width(lambda);
    return std::copysign(band_.slack * limit(lambda) + width(lambda) * s / (1 + s), lambda);
  }
  // dC / dlambda.
  double slope(double lambda) const {
    const double s = 1 + compliance_ * std::abs(lambda) / width(lambda);
    return compliance_ / (s * s);
  }
  // The multiplier that belongs to a strain: 0 within the slack, finite beyond the limit too (as at 98 % of the width).
  double multiplier(double strain) const {
    const double z = std::min((std::abs(strain) - band_.slack * limit(strain)) / width(strain), 0.98);
    return z > 0 ? std::copysign(width(strain) * z / (1 - z) / compliance_, strain) : 0;
  }
  // Integral of the multiplier over the strain, in units of lambda; 0 within the slack.
  double energy(double strain) const {
    const double w = width(strain), z = std::min((std::abs(strain) - band_.slack * limit(strain)) / w, 0.98);
    return z > 0 ? w * w / compliance_ * (-z - std::log1p(-z)) : 0;
  }
  bool slack_at(double strain) const { return std::abs(strain) <= band_.slack * limit(strain); }

 private:
  double limit(double sign) const { return std::signbit(sign) ? band_.compress : band_.stretch; }  // of -0.0 too
  double width(double sign) const { return (1 - band_.slack) * limit(sign); }
  StrainBand band_;
  double compliance_;
};

}  // namespace toile
