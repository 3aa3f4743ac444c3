// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/base/suggestion.h"

#include <fmt/format.h>

#include <algorithm>

namespace toile {
namespace {

int edit_distance(std::string_view a, std::string_view b) {
  std::vector<int> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = static_cast<int>(j);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    int diagonal = row[0];
    row[0] = static_cast<int>(i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const int replaced = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
    }
  }
  return row[b.size()];
}

}  // namespace

std::optional<std::string> nearest_word(std::string_view word, const std::vector<std::string>& possible) {
  const std::string* best = nullptr;
  int distance = std::max(2, static_cast<int>(word.size()) / 3);
  for (const std::string& p : possible) {
    const int d = edit_distance(word, p);
    if (d <= distance && (!best || d < distance)) {
      best = &p;
      distance = d;
    }
  }
  return best ? std::optional(*best) : std::nullopt;
}

std::string suggestion(std::string_view word, const std::vector<std::string>& possible) {
  if (const auto nearest = nearest_word(word, possible)) return fmt::format("; did you mean '{}'?", *nearest);
  return fmt::format("; possible are {}", fmt::join(possible, ", "));
}

}  // namespace toile
