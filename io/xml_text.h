// SPDX-License-Identifier: GPL-3.0-or-later
// Text inside XML.
#pragma once

#include <string>
#include <string_view>

namespace toile {

// &, <, > and double quotes escaped; other bytes as they are.
inline std::string xml_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else if (c == '>') {
      out += "&gt;";
    } else if (c == '"') {
      out += "&quot;";
    } else {
      out += c;
    }
  }
  return out;
}

}  // namespace toile
