// SPDX-License-Identifier: GPL-3.0-or-later
// A text with one to three bytes changed: what transfers and editors do to files.
#pragma once

#include <random>
#include <string>

namespace toile::test {

// `likely`: characters that mean something in such files.
inline std::string flipped(std::string text, const std::string& likely, std::mt19937& random) {
  const int flips = 1 + static_cast<int>(random() % 3);
  for (int i = 0; i < flips; ++i) {
    const std::size_t at = random() % text.size();
    text[at] =
        random() % 2 == 0 ? static_cast<char>(text[at] ^ (1 << (random() % 8))) : likely[random() % likely.size()];
  }
  return text;
}

}  // namespace toile::test
