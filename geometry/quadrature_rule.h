// SPDX-License-Identifier: GPL-3.0-or-later
// The Gauss-Legendre rule that lengths and areas of geometry/ are integrated with.
#pragma once

#include <array>

namespace toile {

// Eight points on [-1, 1], exact to degree 15: abscissae +-gauss8_x[i] with weight gauss8_w[i].
inline constexpr std::array<double, 4> gauss8_x = {0.18343464249564980494, 0.52553240991632898582,
                                                   0.79666647741362673959, 0.96028985649753623168};
inline constexpr std::array<double, 4> gauss8_w = {0.36268378337836198297, 0.31370664587788728734,
                                                   0.22238103445337447054, 0.10122853629037625915};

// Integral of f over [a, b] by that rule.
template <class Function>
double gauss8(Function&& f, double a, double b) {
  const double middle = a + (b - a) / 2, half = (b - a) / 2;
  double sum = 0;
  for (int i = 0; i < 4; ++i) sum += gauss8_w[i] * (f(middle - half * gauss8_x[i]) + f(middle + half * gauss8_x[i]));
  return sum * half;
}

}  // namespace toile
