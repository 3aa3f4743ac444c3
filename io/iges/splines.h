// SPDX-License-Identifier: GPL-3.0-or-later
// What 126 and 128 share.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "geometry/knot_vector.h"
#include "io/iges/parameters.h"

namespace toile::iges {

std::vector<double> read_knots(Parameters& in, int count);

// Refuses a span too short to divide by, and a whole domain that is all rounding of its own ends.
void require_spans(const Parameters& in, const std::vector<double>& breaks, const char* what);

// Knots that occur too often: control points that no span sees (knots more than degree + 1 times), and the second of
// two equal ones at a knot that occurs degree + 1 times inside. `same(i, j)` says whether control points i and j are
// equal. Returns those to leave out, ascending; their knots are taken out of `knots`.
template <class Same>
std::vector<int> drop_surplus(int degree, std::vector<double>& knots, Same&& same) {
  std::vector<int> dropped;
  std::vector<double> kept;
  const std::size_t p = static_cast<std::size_t>(degree), n = knots.size();
  for (std::size_t i = 0; i < n;) {
    std::size_t end = i;
    while (end < n && knots[end] == knots[i]) ++end;
    const std::size_t m = end - i;
    std::size_t most = m;
    if (i == 0 || end == n) {
      most = p + 1;
      for (std::size_t k = most; k < m; ++k) dropped.push_back(static_cast<int>(i == 0 ? k - most : i + k - p - 1));
    } else if (m > p) {
      most = p + 1;
      for (std::size_t k = most; k < m; ++k) dropped.push_back(static_cast<int>(i + k - most));
      const int right = static_cast<int>(i + m - most);
      if (same(static_cast<int>(i) - 1, right)) {
        dropped.push_back(right);
        most = p;
      }
    }
    kept.insert(kept.end(), std::min(m, most), knots[i]);
    i = end;
  }
  if (!dropped.empty()) knots = std::move(kept);
  return dropped;
}

// Empty where every weight is 1; others are kept as they stand. A defaulted weight is 1.
std::vector<double> read_weights(Parameters& in, int count);

// The stated range where it is a true part of the domain, else the domain: stated ends within 1e-9 of the domain's
// length of its ends are those ends; ranges that are empty or reach outside mean the domain (noted).
Interval read_range(Parameters& in, const char* what, const KnotVector& knots);

}  // namespace toile::iges
