// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/base/json_writer.h"

#include <array>
#include <charconv>
#include <cmath>

#include "pipeline/base/json_text.h"

namespace toile {

JsonWriter& JsonWriter::begin(char bracket, Layout layout) {
  before_entry();
  out_ += bracket;
  // What stands in a line stays there.
  if (!levels_.empty() && levels_.back().layout == Layout::one_line) layout = Layout::one_line;
  levels_.push_back({layout});
  ++depth_;
  return *this;
}

JsonWriter& JsonWriter::end(char bracket) {
  const Level level = levels_.back();
  levels_.pop_back();
  --depth_;
  if (!level.empty && level.layout == Layout::lines) new_line();
  out_ += bracket;
  return *this;
}

void JsonWriter::new_line() {
  out_ += '\n';
  out_.append(static_cast<std::size_t>(depth_), ' ');
}

void JsonWriter::before_entry() {
  if (after_key_) {
    after_key_ = false;
    return;
  }
  if (levels_.empty()) return;
  Level& level = levels_.back();
  if (!level.empty) out_ += ',';
  level.empty = false;
  if (level.layout == Layout::lines) new_line();
}

JsonWriter& JsonWriter::key(std::string_view name) {
  before_entry();
  append_string(name);
  out_ += levels_.back().layout == Layout::lines ? ": " : ":";
  after_key_ = true;
  return *this;
}

JsonWriter& JsonWriter::value(double number) {
  before_entry();
  if (!std::isfinite(number)) {
    out_ += "null";
    return *this;
  }
  std::array<char, 32> buffer;
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), number).ptr;
  const std::string_view digits(buffer.data(), static_cast<std::size_t>(end - buffer.data()));
  out_ += digits;
  if (digits.find_first_of(".e") == std::string_view::npos) out_ += ".0";  // for readers that tell integers apart
  return *this;
}

JsonWriter& JsonWriter::value(std::int64_t number) {
  before_entry();
  std::array<char, 24> buffer;
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), number).ptr;
  out_.append(buffer.data(), end);
  return *this;
}

JsonWriter& JsonWriter::value(bool truth) {
  before_entry();
  out_ += truth ? "true" : "false";
  return *this;
}

JsonWriter& JsonWriter::value(const std::string& text) {
  before_entry();
  append_string(utf8(text));
  return *this;
}

JsonWriter& JsonWriter::text(std::string_view json) {
  before_entry();
  out_ += json;
  return *this;
}

void JsonWriter::append_string(std::string_view text) {
  constexpr std::string_view hex = "0123456789abcdef";
  out_ += '"';
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out_ += '\\';
      out_ += c;
    } else if (c == '\n') {
      out_ += "\\n";
    } else if (c == '\t') {
      out_ += "\\t";
    } else if (code < 0x20 || code == 0x7f) {
      out_ += "\\u00";
      out_ += hex[code >> 4u];
      out_ += hex[code & 0xfu];
    } else {
      out_ += c;
    }
  }
  out_ += '"';
}

}  // namespace toile
