// SPDX-License-Identifier: GPL-3.0-or-later
// Quantities of a scene file: "2 mm", "120 g/m2", "1/30 s", "30 deg", "0.351 kg/(m2 s)".
#pragma once

#include <string>
#include <string_view>

namespace toile {

// Exponents of metre, kilogram, second and radian.
struct Dimension {
  int length = 0, mass = 0, time = 0, angle = 0;
  bool operator==(const Dimension&) const = default;
};

namespace dimension {
inline constexpr Dimension none{};
inline constexpr Dimension length{1, 0, 0, 0};
inline constexpr Dimension time{0, 0, 1, 0};
inline constexpr Dimension angle{0, 0, 0, 1};
inline constexpr Dimension velocity{1, 0, -1, 0};
inline constexpr Dimension acceleration{1, 0, -2, 0};
inline constexpr Dimension area_density{-2, 1, 0, 0};      // kg/m2
inline constexpr Dimension force{1, 1, -2, 0};             // N
inline constexpr Dimension force_per_length{0, 1, -2, 0};  // N/m
inline constexpr Dimension pressure{-1, 1, -2, 0};         // Pa
inline constexpr Dimension moment{2, 1, -2, 0};            // N m
inline constexpr Dimension curvature{-1, 0, 0, 0};         // 1/m
inline constexpr Dimension area_drag{-2, 1, -1, 0};        // kg/(m2 s)
}  // namespace dimension

// The quantity in SI (radians for angles). The text is a number or a fraction of two, then a product of units with
// optional powers ("m2", "m^2", "m^-1"), one "/" before a factor or a parenthesis. A number without a unit is SI.
// Throws InputError (without a place) for text that isn't a quantity, unknown units, two readings ("kg/m2 s"), or a
// dimension other than the expected one.
double parse_quantity(std::string_view text, const Dimension& expected);

// "kg/m2", "m", "1/s", "a number": the SI unit of a dimension, for messages.
std::string unit_name(const Dimension& dimension);

// The angle in degrees, to a millionth of one, for messages: a quarter turn is "90", a rounding error "0".
std::string degrees_text(double radians);

}  // namespace toile
