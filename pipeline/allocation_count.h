// How often this program has asked for memory. Linked into programs, never into the library.
#pragma once

#include <optional>

namespace toile {

// Calls of malloc and its like by this thread so far, those of operator new and of Eigen among them; empty where the C
// library doesn't let a program count them.
std::optional<long> allocation_count();

}  // namespace toile
