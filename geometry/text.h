// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers in messages.
#pragma once

#include <charconv>
#include <string>

namespace toile {

// Shortest decimal text that reads back as the same double.
inline std::string text(double x) {
  char buffer[32];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, x);
  return {buffer, end.ptr};
}

}  // namespace toile
