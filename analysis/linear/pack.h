// SPDX-License-Identifier: GPL-3.0-or-later
// Eight numbers in as many of the machine's registers as hold them. (A vector of eight that no register holds goes
// through memory at each operation.)
#pragma once

#include <cstring>

#include "analysis/parallel/lanes.h"

namespace toile {

constexpr int pack_lanes = 8;

// Within a struct, as calls pass bare vectors in ways that depend on the machine.
struct Pack {
  static constexpr int parts = pack_lanes / lane_count;
  Lanes part[parts];

  double operator[](int l) const { return part[l / lane_count][l % lane_count]; }
  void set(int l, double value) { part[l / lane_count][l % lane_count] = value; }

  Pack& operator+=(const Pack& other) {
    for (int k = 0; k < parts; ++k) part[k] += other.part[k];
    return *this;
  }
  Pack& operator-=(const Pack& other) {
    for (int k = 0; k < parts; ++k) part[k] -= other.part[k];
    return *this;
  }
  Pack& operator*=(double s) {
    for (int k = 0; k < parts; ++k) part[k] *= s;
    return *this;
  }
  // this += a b.
  void add_product(const Pack& a, double b) {
    for (int k = 0; k < parts; ++k) part[k] += a.part[k] * b;
  }
  void add_product(const Pack& a, const Pack& b) {
    for (int k = 0; k < parts; ++k) part[k] += a.part[k] * b.part[k];
  }
};

inline Pack load_pack(const double* p) {
  Pack out;
  std::memcpy(&out, p, sizeof(out));
  return out;
}

// In a fixed order.
inline double sum(const Pack& p) {
  return ((p[0] + p[1]) + (p[2] + p[3])) + ((p[4] + p[5]) + (p[6] + p[7]));
}

}  // namespace toile
