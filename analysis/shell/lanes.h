// Eight numbers at once, one for each of eight cells: the compiler turns these operations into the widest instructions
// that the machine has. The same kernels run on plain doubles.
#pragma once

#include <cmath>

namespace toile {

inline constexpr int lane_count = 8;
using Lanes = double __attribute__((vector_size(lane_count * sizeof(double))));
using LaneMask = decltype(Lanes{} < Lanes{});

inline double sqrt(double a) { return std::sqrt(a); }
inline Lanes sqrt(Lanes a) {
  Lanes root;
  for (int l = 0; l < lane_count; ++l) root[l] = std::sqrt(a[l]);
  return root;
}

inline double select(bool which, double a, double b) { return which ? a : b; }
inline Lanes select(LaneMask which, Lanes a, Lanes b) { return which ? a : b; }

template <class Real>
inline Real broadcast(double a) {
  return Real{} + a;
}

// Sum in a fixed order.
inline double sum(Lanes a) { return ((a[0] + a[1]) + (a[2] + a[3])) + ((a[4] + a[5]) + (a[6] + a[7])); }

}  // namespace toile
