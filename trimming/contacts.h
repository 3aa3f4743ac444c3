// SPDX-License-Identifier: GPL-3.0-or-later
// Where trim loops meet themselves or each other.
#pragma once

#include <vector>

#include "trimming/spans.h"

namespace toile {

enum class ContactKind { crossing, touch, overlap };

struct LoopContact {
  ContactKind kind = ContactKind::crossing;
  int loop_a = 0, curve_a = 0, loop_b = 0, curve_b = 0;  // positions, as in TrimSpan
  Eigen::Vector2d uv{0, 0};
};

// Contacts other than the joints of neighbouring curves. Straight segments are compared exactly, and so are curves with
// segments along lines of constant u or v, but for contacts at such a segment's end. Other pairs are subdivided until
// their hulls part by more than rounding (8 eps of the largest coordinate), so that a distance below some 64 eps counts
// as a contact, and contacts within 1e-7 of the loops' size of one another are listed once; a cusp is looked at down to
// that size.
std::vector<LoopContact> find_contacts(const std::vector<TrimLoop>& loops, const TrimSpans& spans);

}  // namespace toile
