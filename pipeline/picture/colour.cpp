// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/picture/colour.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace toile {

namespace {

// [Ottosson 2020, "A perceptual color space for image processing"]
Eigen::Vector3d oklab_to_linear(const Eigen::Vector3d& lab) {
  const double l = lab[0] + 0.3963377774 * lab[1] + 0.2158037573 * lab[2];
  const double m = lab[0] - 0.1055613458 * lab[1] - 0.0638541728 * lab[2];
  const double s = lab[0] - 0.0894841775 * lab[1] - 1.2914855480 * lab[2];
  const Eigen::Vector3d lms(l * l * l, m * m * m, s * s * s);
  Eigen::Matrix3d to_rgb;
  to_rgb << 4.0767416621, -3.3077115913, 0.2309699292,  //
      -1.2684380046, 2.6097574011, -0.3413193965,       //
      -0.0041960863, -0.7034186147, 1.7076147010;
  return to_rgb * lms;
}

constexpr std::size_t steps = 256;

// Where sRGB can't hold the chroma, the largest that it holds is taken, then evened out along the scale.
std::array<Eigen::Vector3f, steps + 1> colour_table() {
  const auto lab = [](double s, double chroma) {
    const double hue = (288 - 183 * s) * std::numbers::pi / 180;
    return Eigen::Vector3d(0.36 + 0.54 * s, chroma * std::cos(hue), chroma * std::sin(hue));
  };
  const auto position = [](std::size_t k) { return static_cast<double>(k) / steps; };
  std::array<double, steps + 1> chroma;
  for (std::size_t k = 0; k <= steps; ++k) {
    double low = 0, high = 0.16;
    for (int pass = 0; pass < 40; ++pass) {
      const double middle = (low + high) / 2;
      const Eigen::Vector3d rgb = oklab_to_linear(lab(position(k), middle));
      (rgb.minCoeff() >= 0 && rgb.maxCoeff() <= 1 ? low : high) = middle;
    }
    chroma[k] = low;
  }
  std::array<Eigen::Vector3f, steps + 1> table;
  constexpr std::size_t reach = 24;
  for (std::size_t k = 0; k <= steps; ++k) {
    double least = chroma[k], sum = 0;
    const std::size_t first = k < reach ? 0 : k - reach, last = std::min(k + reach, steps);
    for (std::size_t i = first; i <= last; ++i) sum += chroma[i];
    least = std::min(least, sum / static_cast<double>(last - first + 1));
    table[k] = oklab_to_linear(lab(position(k), least)).cast<float>();
  }
  return table;
}

}  // namespace

Eigen::Vector3f strain_colour(double s) {
  static const auto table = colour_table();
  const double x = std::clamp(s, 0.0, 1.0) * steps;
  const std::size_t k = std::min(static_cast<std::size_t>(x), steps - 1);
  const auto t = static_cast<float>(x - static_cast<double>(k));
  return (1 - t) * table[k] + t * table[k + 1];
}

Eigen::Vector3f signed_colour(double s) {
  const double amount = std::clamp(std::abs(s), 0.0, 1.0);
  const double hue = (s < 0 ? 258 : 52) * std::numbers::pi / 180;
  // The chroma that sRGB holds at every lightness on the way.
  const double lightness = 0.95 - 0.45 * amount, chroma = 0.125 * amount;
  const Eigen::Vector3d lab(lightness, chroma * std::cos(hue), chroma * std::sin(hue));
  return oklab_to_linear(lab).cwiseMax(0).cwiseMin(1).cast<float>();
}

int to_srgb(float linear) {
  const float x = std::clamp(linear, 0.0f, 1.0f);
  const float y = x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1 / 2.4f) - 0.055f;
  return static_cast<int>(std::lround(255 * y));
}

}  // namespace toile
