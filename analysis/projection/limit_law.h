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
  // 1 / (distance to the limit): the relative change of the force per strain, near the wall.
  double steepness(double lambda) const { return (1 + compliance_ * std::abs(lambda) / width(lambda)) / width(lambda); }
  // The multiplier that belongs to a strain: 0 within the slack. From `last` of the width on it goes on straight, so
  // that it is finite beyond the limit too.
  double multiplier(double strain) const {
    const double z = share(strain), inner = std::min(z, last);
    return z > 0 ? std::copysign(width(strain) / compliance_ * (inner / (1 - inner) + (z - inner) * steepest), strain)
                 : 0;
  }
  // The same by the law itself wherever that has one.
  double force(double strain) const {
    const double z = share(strain);
    return z > last && z < 1 ? std::copysign(width(strain) / compliance_ * z / (1 - z), strain) : multiplier(strain);
  }
  // Its slope.
  double stiffness(double strain) const {
    const double z = share(strain), inner = 1 - std::min(z, last);
    return z > 0 ? 1 / (compliance_ * inner * inner) : 0;
  }
  // Its integral over the strain, in units of lambda; 0 within the slack.
  double energy(double strain) const {
    const double w = width(strain), z = share(strain), inner = std::min(z, last), beyond = z - inner;
    if (!(z > 0)) return 0;
    return w * w / compliance_ *
           (-inner - std::log1p(-inner) + beyond * (inner / (1 - inner) + 0.5 * beyond * steepest));
  }
  bool has_slack() const { return band_.slack > 0; }
  bool slack_at(double strain) const { return std::abs(strain) <= band_.slack * limit(strain); }

 private:
  static constexpr double last = 0.98, steepest = 1 / ((1 - last) * (1 - last));
  // Of the width; negative within the slack.
  double share(double strain) const { return (std::abs(strain) - band_.slack * limit(strain)) / width(strain); }
  double limit(double sign) const { return std::signbit(sign) ? band_.compress : band_.stretch; }  // of -0.0 too
  double width(double sign) const { return (1 - band_.slack) * limit(sign); }
  StrainBand band_;
  double compliance_;
};

}  // namespace toile
