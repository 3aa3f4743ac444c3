#include "pipeline/json_text.h"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace toile {
namespace {

void make_utf8(nlohmann::ordered_json& json) {
  if (json.is_string()) json = utf8(json.get<std::string>());
  if (json.is_structured()) {
    for (auto& entry : json) make_utf8(entry);
  }
}

}  // namespace

std::string utf8(const std::string& text) {
  const auto byte = [&](std::size_t k) { return k < text.size() ? static_cast<unsigned char>(text[k]) : 0u; };
  bool valid = true;
  for (std::size_t k = 0; k < text.size() && valid;) {
    const unsigned lead = byte(k);
    const std::size_t length = lead < 0x80                   ? 1
                               : lead >= 0xc2 && lead < 0xe0 ? 2
                               : lead >= 0xe0 && lead < 0xf0 ? 3
                               : lead >= 0xf0 && lead < 0xf5 ? 4
                                                             : 0;
    valid = length > 0;
    for (std::size_t i = 1; i < length; ++i) valid = valid && (byte(k + i) & 0xc0u) == 0x80u;
    // Overlong forms, surrogates and numbers beyond the last.
    const unsigned second = byte(k + 1);
    if ((lead == 0xe0 && second < 0xa0) || (lead == 0xed && second > 0x9f) || (lead == 0xf0 && second < 0x90) ||
        (lead == 0xf4 && second > 0x8f)) {
      valid = false;
    }
    k += std::max<std::size_t>(length, 1);
  }
  if (valid) return text;
  std::string out;
  for (std::size_t k = 0; k < text.size(); ++k) {
    const unsigned c = byte(k);
    if (c < 0x80) {
      out += static_cast<char>(c);
    } else {
      out += static_cast<char>(0xc0u | (c >> 6));
      out += static_cast<char>(0x80u | (c & 0x3fu));
    }
  }
  return out;
}

std::string json_text(nlohmann::ordered_json json, int indent) {
  make_utf8(json);
  // Keys that come from names are left: replaced rather than refused.
  return json.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace toile
