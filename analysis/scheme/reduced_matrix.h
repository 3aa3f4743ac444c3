// SPDX-License-Identifier: GPL-3.0-or-later
// T^T K T: a matrix of 3 x 3 blocks over all points, as the nodes of a map feel it.
#pragma once

#include <vector>

#include "analysis/linear/block_matrix.h"
#include "analysis/map/affine_map.h"

namespace toile {

// Made once for a pattern and a map; both must outlive it.
class ReducedMatrix {
 public:
  ReducedMatrix(const BlockPattern& points, const AffineMap& map);

  const BlockPattern& pattern() const { return pattern_; }  // over nodes
  // `out` on pattern(): overwritten.
  void reduce(const BlockMatrix& points, BlockMatrix& out) const;

 private:
  struct Term {
    int from = 0, to = 0;  // slots of the two patterns
    double weight = 0;
    bool transposed = false, both = false;  // both: the block and its transpose
    bool own = false;                       // of a point with itself: of such blocks the lower triangle counts
  };
  BlockPattern pattern_;
  std::vector<Term> terms_;
};

}  // namespace toile
