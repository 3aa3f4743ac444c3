// SPDX-License-Identifier: GPL-3.0-or-later
// What the colours of a field mean: the map, the bar beside a picture.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "geometry/knot_vector.h"
#include "pipeline/picture/image.h"

namespace toile {

// Colours from `low` to `high`; values beyond have the colours of the ends.
//   (1) of values without negative ones, low = 0 has the darkest and high the lightest colour of
//       strain_colour();
//   (2) where values are negative too, zero is the pale middle of signed_colour() and both signs count by one measure:
//       equal amounts are equally far from it;
//   (3) zero lies on the scale, unless the range was given.
struct ColourScale {
  double low = 0, high = 1;
  bool both_signs = false;
  double least = 0, most = 1;  // of all values: what lies beyond an end is clipped, and the bar says so

  Eigen::Vector3f colour(double value) const;
};

// A scale for values seen in a picture. Its ends leave out half a percent of them, which would be a point at a pin.
ColourScale scale_of(std::vector<float> values, const std::optional<Interval>& range = std::nullopt);

// Multiples of 1, 2 or 5 times a power of ten in [low, high], at most `most` of them.
std::vector<double> round_ticks(double low, double high, int most = 8);

// The bar at the right edge of a picture, in percent: round ticks, zero the longest; arrows with the extreme value
// where the field goes beyond the scale. `unit`: pixels of a 700th of the picture.
void draw_strain_bar(Image& image, const ColourScale& scale, float unit);

}  // namespace toile
