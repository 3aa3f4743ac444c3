// SPDX-License-Identifier: GPL-3.0-or-later
// Directory cards and the assembly of a file from its records.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace toile::iges {

// The fields of a directory entry that we set; the others are zero or blank.
struct Card {
  int type = 0, form = 0;
  int level = 0, colour = 0, transform = 0;
  const char* label = "";           // at most 8 letters
  const char* status = "00000000";  // blank, subordinate, use, hierarchy
};
std::array<std::string, 2> make_cards(const Card& card);

// A record to be written. The two cards are 72 columns wide; their parameter pointer and line count are filled in by
// assemble(). `lines` holds the parameter lines, 64 columns each.
struct OutRecord {
  std::array<std::string, 2> cards;
  std::string lines;
};

// Label of a 124 that moves a panel aside for viewing alone.
inline constexpr const char* aside_label = "ASIDE";

// A line of the start section that says which way is up, "Up in these axes: 0 0 1", and the same read: a unit vector,
// nothing where no line says it.
std::string up_line(const Eigen::Vector3d& up);
std::optional<Eigen::Vector3d> read_up(const std::vector<std::string_view>& start);

// S, G, D, P and T sections, 80 columns a line, counters right. `global` is 72 columns a line. Throws OutputError where
// a counter would need more than seven digits.
std::string assemble(const std::vector<std::string>& start, std::string_view global,
                     const std::vector<OutRecord>& records);

}  // namespace toile::iges
