// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/json_document.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <nlohmann/json.hpp>

#include "geometry/error.h"
#include "io/encoding.h"

namespace toile {

namespace {

constexpr std::size_t max_depth = 64, max_values = 2'000'000;

// Counts the lines that the parser has taken. It reads one character ahead of a number's end, so that the newest
// character, which may be a line break, doesn't count yet.
struct Position {
  int line = 1;
  char newest = 0;
};

class CountingIterator {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  CountingIterator(const char* at, Position* position) : at_(at), position_(position) {}
  reference operator*() const { return *at_; }
  CountingIterator& operator++() {
    if (position_->newest == '\n') ++position_->line;
    position_->newest = *at_++;
    return *this;
  }
  CountingIterator operator++(int) {
    CountingIterator old = *this;
    ++*this;
    return old;
  }
  bool operator==(const CountingIterator& other) const { return at_ == other.at_; }
  bool operator!=(const CountingIterator& other) const { return at_ != other.at_; }

 private:
  const char* at_;
  Position* position_;
};

class Builder {
 public:
  using number_integer_t = nlohmann::json::number_integer_t;
  using number_unsigned_t = nlohmann::json::number_unsigned_t;
  using number_float_t = nlohmann::json::number_float_t;
  using string_t = nlohmann::json::string_t;
  using binary_t = nlohmann::json::binary_t;

  Builder(const std::string& name, const Position& position) : name_(name), position_(position) {}
  JsonValue root;

  bool null() { return add(JsonValue::Kind::null) != nullptr; }
  bool boolean(bool value) { return add(JsonValue::Kind::boolean)->number = value, true; }
  bool number_integer(number_integer_t value) { return number(static_cast<double>(value)); }
  bool number_unsigned(number_unsigned_t value) { return number(static_cast<double>(value)); }
  bool number_float(number_float_t value, const string_t&) { return number(value); }
  bool string(string_t& value) { return add(JsonValue::Kind::string)->text = std::move(value), true; }
  bool binary(binary_t&) { return false; }
  bool start_object(std::size_t) { return open(JsonValue::Kind::object); }
  bool start_array(std::size_t) { return open(JsonValue::Kind::array); }
  bool end_object() { return open_.pop_back(), true; }
  bool end_array() { return open_.pop_back(), true; }
  bool key(string_t& key) {
    JsonValue& object = *open_.back();
    // Many keys in one object are looked up once each; patterns have tens, an attack has many.
    if (object.members.size() > 10'000) fail("an object has more than 10000 keys");
    if (object.find(key)) fail("key '" + key + "' stands twice in one object");
    object.members.push_back({std::move(key), {}});
    return true;
  }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception& error) {
    // "[json.exception.parse_error.101] parse error at line 3, column 7: what": the place is said in our way.
    std::string what = error.what();
    if (const std::size_t end = what.find("] "); what.starts_with('[') && end != std::string::npos)
      what = what.substr(end + 2);
    const std::size_t colon = what.find(": ");
    if (colon != std::string::npos) what = what.substr(colon + 2);
    // It quotes the file: whole, however long a number is.
    constexpr std::size_t longest = 160;
    if (what.size() > longest) what.replace(longest, std::string::npos, "...");
    for (char& c : what)
      if (static_cast<unsigned char>(c) < ' ' || c == 0x7f) c = '?';
    fail("no valid JSON: " + to_utf8(what));
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(name_ + ":" + std::to_string(position_.line) + ": " + what);
  }

 private:
  bool number(double value) { return add(JsonValue::Kind::number)->number = value, true; }
  bool open(JsonValue::Kind kind) {
    if (open_.size() == max_depth) fail("nested more than " + std::to_string(max_depth) + " levels deep");
    open_.push_back(add(kind));
    return true;
  }
  JsonValue* add(JsonValue::Kind kind) {
    if (++count_ > max_values) fail("more than " + std::to_string(max_values) + " values");
    JsonValue* value = &root;
    if (!open_.empty()) {
      JsonValue& parent = *open_.back();
      value = parent.kind == JsonValue::Kind::array ? &parent.items.emplace_back() : &parent.members.back().value;
    }
    value->kind = kind;
    value->line = position_.line;
    return value;
  }

  const std::string& name_;
  const Position& position_;
  std::vector<JsonValue*> open_;  // stays valid: only the innermost one grows
  std::size_t count_ = 0;
};

}  // namespace

const JsonValue* JsonValue::find(std::string_view key) const {
  const auto found = std::ranges::find(members, key, &JsonMember::key);
  return found == members.end() ? nullptr : &found->value;
}

const char* JsonValue::kind_name() const {
  static constexpr std::array<const char*, 6> names{"null",     "true or false", "a number",
                                                    "a string", "an array",      "an object"};
  return names[static_cast<std::size_t>(kind)];
}

JsonValue parse_json(std::string_view text, const std::string& name) {
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  Position position;
  Builder builder(name, position);
  const CountingIterator begin(text.data(), &position), end(text.data() + text.size(), &position);
  nlohmann::json::sax_parse(begin, end, &builder, nlohmann::json::input_format_t::json, true, true);
  return std::move(builder.root);
}

}  // namespace toile
