// SPDX-License-Identifier: GPL-3.0-or-later
// How often a test program has asked for memory. Takes the place of malloc, so it is linked into tests alone.
#pragma once

#include <optional>

namespace toile::test {

// Calls of malloc and its like by this thread so far, those of operator new and of Eigen among them; empty where the C
// library doesn't let a program count them.
std::optional<long> allocation_count();

}  // namespace toile::test
