// SPDX-License-Identifier: GPL-3.0-or-later
// JSON text written as it comes, without a tree of values in memory: for output as long as the files it is about.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace toile {

// Appends to a string. Strings come out as UTF-8 (see utf8()), numbers as the shortest decimal that reads back to the
// same bits, what isn't finite as null. The caller opens and closes in order, and gives a key before each value of an
// object.
class JsonWriter {
 public:
  // How the entries of an object or array stand: one a line, or all on one line.
  enum class Layout { lines, one_line };

  // `depth`: how many levels the text is nested where it will stand; a level is indented by one blank.
  explicit JsonWriter(std::string& out, int depth = 0) : out_(out), depth_(depth) {}

  JsonWriter& begin_object(Layout layout = Layout::lines) { return begin('{', layout); }
  JsonWriter& begin_array(Layout layout = Layout::lines) { return begin('[', layout); }
  JsonWriter& end_object() { return end('}'); }
  JsonWriter& end_array() { return end(']'); }
  JsonWriter& key(std::string_view name);

  JsonWriter& value(double number);
  JsonWriter& value(std::int64_t number);
  JsonWriter& value(int number) { return value(static_cast<std::int64_t>(number)); }
  JsonWriter& value(bool truth);
  JsonWriter& value(const std::string& text);
  JsonWriter& value(const char* text) { return value(std::string(text)); }
  // Anything that can be iterated, on one line.
  template <class Range>
  JsonWriter& values(const Range& range) {
    begin_array(Layout::one_line);
    for (const auto& entry : range) value(entry);
    return end_array();
  }
  template <class Value>
  JsonWriter& member(std::string_view name, const Value& what) {
    return key(name).value(what);
  }
  // A value that was written before, at this depth.
  JsonWriter& text(std::string_view json);

 private:
  struct Level {
    Layout layout;
    bool empty = true;
  };
  JsonWriter& begin(char bracket, Layout layout);
  JsonWriter& end(char bracket);
  void before_entry();
  void new_line();
  void append_string(std::string_view text);

  std::string& out_;
  int depth_;
  std::vector<Level> levels_;
  bool after_key_ = false;
};

}  // namespace toile
