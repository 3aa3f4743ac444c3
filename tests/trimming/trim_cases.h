// SPDX-License-Identifier: GPL-3.0-or-later
// Trims that are hard to trace, drawn at random: on coarse lattices, where lines, vertices, touches and runs are hit
// all the time, and an ulp beside them; with what the tracer says of each compared to exact arithmetic.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "exact_trace.h"

namespace toile::test {

struct TrimCase {
  std::string family;
  std::vector<double> u, v;      // knot lines
  std::vector<ExactLoop> loops;  // the outer loop, then holes, each with the material on its left
  bool valid = true;             // false: loops cross or lie wrongly, which must be refused
};

// The same seed gives the same case.
TrimCase random_trim_case(std::uint64_t seed);

// Over the identity map (u, v, 0), every piece a curve of its own.
TrimmedSurface surface_of(const TrimCase& given);

// What the tracer gets wrong of the case, or of the case mirrored, turned, reversed, knot-refined, scaled and shifted;
// empty where all is right.
std::string wrong_decision(const TrimCase& given, std::uint64_t seed);

// As C++ that makes the case, to keep what was found wrong.
std::string text_of(const TrimCase& given);

}  // namespace toile::test
