// SPDX-License-Identifier: GPL-3.0-or-later
// What files may hold, in their own units. Derivatives are lengths over spans times ratios of weights; within these
// bounds their products and the squares of these stay finite.
#pragma once

namespace toile {

inline constexpr double largest_number = 1e25, smallest_span = 1e-25, largest_weight_ratio = 1e15;

}  // namespace toile
