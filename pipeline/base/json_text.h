// SPDX-License-Identifier: GPL-3.0-or-later
// JSON for files and pipes: valid whatever names the input has.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace toile {

// JSON and XML hold UTF-8 only; names in IGES files come in any encoding. What isn't UTF-8 is read as Latin-1.
std::string utf8(const std::string& text);

// With every string as UTF-8, and null for a number that isn't finite. Ends without a line break.
std::string json_text(nlohmann::ordered_json json, int indent = 2);

}  // namespace toile
