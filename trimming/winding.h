// SPDX-License-Identifier: GPL-3.0-or-later
// Exact winding numbers of points with respect to chains of Bezier spans.
#pragma once

#include <optional>
#include <span>

#include "trimming/crossings.h"

namespace toile {

// How often the closed chain of spans runs counter-clockwise around the point, each span taken in its own direction;
// nothing where the point lies on the chain. Throws GeometryError for a point that isn't finite.
std::optional<int> winding_number(std::span<const TrimSpan> spans, const Eigen::Vector2d& point,
                                  PredicateCounts& counts);

// Of one loop, given by its position, in its direction.
std::optional<int> winding_number(const std::vector<TrimLoop>& loops, const TrimSpans& spans, int loop,
                                  const Eigen::Vector2d& point, PredicateCounts& counts);

// How often `of` winds around a loop that doesn't cross it: by an end point of its spans that isn't on `of`, else by a
// point between whose rounding doesn't matter.
int winding_around(const std::vector<TrimLoop>& loops, const TrimSpans& spans, int loop, int of,
                   PredicateCounts& counts);

}  // namespace toile
