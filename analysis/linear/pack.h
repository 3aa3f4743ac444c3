// Eight numbers that one instruction takes together, where the machine has such.
#pragma once

#include <cstring>

namespace toile {

constexpr int pack_lanes = 8;

// Within a struct, as calls pass bare vectors in ways that depend on the machine.
struct Pack {
  double __attribute__((vector_size(pack_lanes * sizeof(double)))) v;
};

inline Pack load_pack(const double* p) {
  Pack out;
  std::memcpy(&out, p, sizeof(out));
  return out;
}

// In a fixed order.
inline double sum(const Pack& p) {
  return ((p.v[0] + p.v[1]) + (p.v[2] + p.v[3])) + ((p.v[4] + p.v[5]) + (p.v[6] + p.v[7]));
}

}  // namespace toile
