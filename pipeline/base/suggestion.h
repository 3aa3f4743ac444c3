// SPDX-License-Identifier: GPL-3.0-or-later
// "Did you mean ...?": the nearest of the words that would have been right.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace toile {

// The possible word with the fewest changed letters; nothing where more than a third of the letters (two at least)
// would have to change.
std::optional<std::string> nearest_word(std::string_view word, const std::vector<std::string>& possible);

// "; did you mean 'grain_deg'?", or the list of what is possible.
std::string suggestion(std::string_view word, const std::vector<std::string>& possible);

}  // namespace toile
