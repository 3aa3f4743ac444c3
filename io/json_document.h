// SPDX-License-Identifier: GPL-3.0-or-later
// JSON as a tree that knows its lines, so that what is wrong in a file can be found.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace toile {

struct JsonMember;

struct JsonValue {
  enum class Kind { null, boolean, number, string, array, object };
  Kind kind = Kind::null;
  int line = 0;       // where the value begins
  double number = 0;  // 0 or 1 for a boolean
  std::string text;
  std::vector<JsonValue> items;     // of an array
  std::vector<JsonMember> members;  // of an object, in the file's order

  const JsonValue* find(std::string_view key) const;  // null where this is no object or has no such key
  const char* kind_name() const;                      // "a number", "an array", ...
};

struct JsonMember {
  std::string key;
  JsonValue value;
};

// Comments are allowed. Throws InputError `name:line: ...` for what is no JSON, for a key that stands twice in an
// object, for more than 64 levels and for more than two million values.
JsonValue parse_json(std::string_view text, const std::string& name);

}  // namespace toile
