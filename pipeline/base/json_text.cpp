// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/base/json_text.h"

#include <nlohmann/json.hpp>

#include "io/encoding.h"

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
  return to_utf8(text);
}

std::string json_text(nlohmann::ordered_json json, int indent) {
  make_utf8(json);
  // Keys that come from names are left: replaced rather than refused.
  return json.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace toile
