// SPDX-License-Identifier: GPL-3.0-or-later
// Rows of a comma-separated table. [RFC 4180, with \n]
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace toile {

// A line with its end; cells with commas, quotes or line breaks are quoted.
std::string csv_row(const std::vector<std::string>& cells);

}  // namespace toile
