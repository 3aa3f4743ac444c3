// SPDX-License-Identifier: GPL-3.0-or-later
// Colours of strain scales: light, evenly spaced to the eye.
#pragma once

#include <Eigen/Core>

namespace toile {

// Colour of s in [0, 1] (clamped), linear rgb in 0..1: lightness rises evenly from a deep blue violet over teal to
// yellow, so that it also reads in grey and for colour-blind eyes. Defined in OKLCh. [Ottosson 2020, oklab]
Eigen::Vector3f strain_colour(double s);

// Colour of s in [-1, 1] (clamped), linear rgb: blue for negative, orange for positive values, pale grey at zero;
// lightness falls evenly and alike on both sides. The two hues differ for colour-blind eyes too.
Eigen::Vector3f signed_colour(double s);

// sRGB transfer function, linear 0..1 to 0..255 rounded.
int to_srgb(float linear);

}  // namespace toile
