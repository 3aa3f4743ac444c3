// SPDX-License-Identifier: GPL-3.0-or-later
// Several numbers at once, one for each of several cells: as many as the machine's registers hold. The same kernels run
// on plain doubles.
#pragma once

#include <cmath>

namespace toile {

#if defined(__AVX512F__)
inline constexpr int lane_count = 8;
#elif defined(__AVX__)
inline constexpr int lane_count = 4;
#else
inline constexpr int lane_count = 2;
#endif
using Lanes = double __attribute__((vector_size(lane_count * sizeof(double))));
using LaneMask = decltype(Lanes{} < Lanes{});

inline double sqrt(double a) {
  return std::sqrt(a);
}
inline Lanes sqrt(Lanes a) {
  Lanes root;
  for (int l = 0; l < lane_count; ++l) root[l] = std::sqrt(a[l]);
  return root;
}

inline double select(bool which, double a, double b) {
  return which ? a : b;
}
inline Lanes select(LaneMask which, Lanes a, Lanes b) {
  return which ? a : b;
}

template <class Real>
inline Real broadcast(double a) {
  return Real{} + a;
}

// Sum in a fixed order.
inline double sum(Lanes a) {
  double total = 0;
  for (int l = 0; l < lane_count; ++l) total += a[l];
  return total;
}

}  // namespace toile
