// What 126 and 128 share.
#pragma once

#include <string>
#include <vector>

#include "geometry/knot_vector.h"
#include "io/iges/parameters.h"

namespace toile::iges {

std::vector<double> read_knots(Parameters& in, int count);

// Empty where every weight is 1; others are kept as they stand. A defaulted weight is 1.
std::vector<double> read_weights(Parameters& in, int count);

// The stated range where it is a true part of the domain, else the domain: stated ends within 1e-9 of the domain's
// length of its ends are those ends; ranges that are empty or reach outside mean the domain (noted).
Interval read_range(Parameters& in, const char* what, const KnotVector& knots);

}  // namespace toile::iges
