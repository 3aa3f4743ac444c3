// SPDX-License-Identifier: GPL-3.0-or-later
// A number that counts the floating-point operations done on its kind, for kernels that run on any kind of number.
#pragma once

#include <cmath>

namespace toile {

struct Counted {
  double value = 0;
  static inline long operations = 0;

  Counted() = default;
  Counted(double v) : value(v) {}  // NOLINT(google-explicit-constructor): as doubles convert
};

inline Counted counted(double value) {
  ++Counted::operations;
  return value;
}
inline Counted operator+(Counted a, Counted b) {
  return counted(a.value + b.value);
}
inline Counted operator-(Counted a, Counted b) {
  return counted(a.value - b.value);
}
inline Counted operator*(Counted a, Counted b) {
  return counted(a.value * b.value);
}
inline Counted operator/(Counted a, Counted b) {
  return counted(a.value / b.value);
}
inline Counted& operator+=(Counted& a, Counted b) {
  return a = a + b;
}
inline Counted operator-(Counted a) {
  return {-a.value};
}
inline bool operator<(Counted a, Counted b) {
  return a.value < b.value;
}
inline bool operator>(Counted a, Counted b) {
  return a.value > b.value;
}
inline Counted sqrt(Counted a) {
  return counted(std::sqrt(a.value));
}
inline Counted select(bool which, Counted a, Counted b) {
  return which ? a : b;
}

}  // namespace toile
