// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/scene/toml_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <tuple>

#include "geometry/error.h"

namespace toile {
namespace {

std::string expected(const Dimension& dimension) {
  return dimension == dimension::none ? "a number" : fmt::format("a number in {}", unit_name(dimension));
}

}  // namespace

void refuse_deep_keys(std::string_view text, const std::string& file) {
  int line = 1, dots = 0;
  char quote = 0, previous = 0;
  for (const char c : text) {
    if (c == '\n') {
      ++line;
      dots = quote = previous = 0;
    } else if (quote != 0) {
      if (c == quote && quote != '#') quote = 0;
    } else if (c == '.' && previous != 0) {
      if (++dots >= deepest_key)
        throw InputError(fmt::format("{}:{}: a key has more than {} parts", file, line, deepest_key));
      previous = 0;
    } else if (c == '"' || c == '\'' || c == '#') {
      quote = previous = c;
    } else if (c != ' ' && c != '\t') {
      const bool in_key = std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-';
      previous = in_key ? c : '\0';
      if (!in_key) dots = 0;
    }
  }
}

toml::table parse_toml(std::string_view text, const std::filesystem::path& path) {
  refuse_deep_keys(text, path.string());
  try {
    return toml::parse(text, path.string());
  } catch (const toml::parse_error& error) {
    throw InputError(fmt::format("{}:{}: {}", path.string(), error.source().begin.line, error.description()));
  }
}

const char* type_name(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "an array";
    case toml::node_type::string:
      return "a string";
    case toml::node_type::integer:
      return "a whole number";
    case toml::node_type::floating_point:
      return "a number";
    case toml::node_type::boolean:
      return "true or false";
    default:
      return "a date or time";
  }
}

std::string toml_text(const toml::node& node) {
  const auto quoted = [](const std::string& text) { return nlohmann::json(text).dump(); };
  const auto key_text = [&](const std::string& key) {
    const auto bare = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '-'; };
    return !key.empty() && std::ranges::all_of(key, bare) ? key : quoted(key);
  };
  if (const toml::table* table = node.as_table()) {
    std::string out;
    for (const auto& [key, value] : in_file_order(*table)) {
      out += (out.empty() ? " " : ", ") + key_text(key) + " = " + toml_text(*value);
    }
    return "{" + out + " }";
  }
  if (const toml::array* array = node.as_array()) {
    std::string out;
    for (const toml::node& value : *array) out += (out.empty() ? "" : ", ") + toml_text(value);
    return "[" + out + "]";
  }
  if (node.is_string()) return quoted(*node.value<std::string>());
  if (node.is_boolean()) return *node.value<bool>() ? "true" : "false";
  if (node.is_integer()) return fmt::format("{}", *node.value<std::int64_t>());
  if (node.is_floating_point()) {
    const std::string text = fmt::format("{}", *node.value<double>());
    return text.find_first_of(".einf") == std::string::npos ? text + ".0" : text;
  }
  std::ostringstream date;
  node.visit([&](const auto& value) {
    if constexpr (toml::is_date<decltype(value)> || toml::is_time<decltype(value)> ||
                  toml::is_date_time<decltype(value)>) {
      date << value;
    }
  });
  return date.str();
}

std::vector<std::pair<std::string, const toml::node*>> in_file_order(const toml::table& table) {
  std::vector<std::tuple<toml::source_index, toml::source_index, std::string, const toml::node*>> keys;
  for (const auto& [key, node] : table) {
    keys.emplace_back(key.source().begin.line, key.source().begin.column, std::string(key.str()), &node);
  }
  std::ranges::sort(keys);
  std::vector<std::pair<std::string, const toml::node*>> result;
  for (const auto& [line, column, key, node] : keys) result.emplace_back(key, node);
  return result;
}

namespace {
thread_local KeyRecording* recording = nullptr;
}

KeyRecording::KeyRecording() {
  recording = this;
}

KeyRecording::~KeyRecording() {
  recording = nullptr;
}

void KeyRecording::take(const AskedKey& key) {
  const auto same = [&](const AskedKey& k) { return k.table == key.table && k.key == key.key; };
  const auto known = std::ranges::find_if(keys_, same);
  if (known == keys_.end()) {
    keys_.push_back(key);
  } else if (known->kind == AskedKey::Kind::any) {
    *known = key;
  }
}

const toml::node* Table::ask(AskedKey key) {
  if (std::ranges::find(known_, key.key) == known_.end()) known_.push_back(key.key);
  const toml::node* node = table_.get(key.key);
  key.table = name_;
  if (recording) recording->take(key);
  return node;
}

std::string Table::place(const toml::node& node) const {
  const auto line = node.source().begin.line;
  return line > 0 ? fmt::format("{}:{}", file_, line) : file_ + " (--set)";
}

void Table::fail(const toml::node& node, const std::string& what) const {
  throw InputError(place(node) + ": " + what);
}

void Table::missing(const std::string& key, const std::string& what) const {
  throw InputError(fmt::format("{}: {} needs {} ({})", where(), name_, key, what));
}

std::string Table::label(const std::string& key) const {
  return fmt::format("{} in {}", key, name_);
}

double Table::quantity(const toml::node& node, const std::string& what, const Dimension& dimension, Range range,
                       double bare_unit) {
  double value = 0;
  if (node.is_integer() || node.is_floating_point()) {
    value = bare_unit * *node.value<double>();
  } else if (const auto text = node.value<std::string>(); text && node.is_string()) {
    try {
      value = parse_quantity(*text, dimension);
    } catch (const InputError& error) {
      fail(node, fmt::format("{}: {}", what, error.what()));
    }
  } else {
    fail(node,
         fmt::format("{} must be {} or a string with a unit, not {}", what, expected(dimension), type_name(node)));
  }
  if (!std::isfinite(value)) fail(node, fmt::format("{} must be finite", what));
  if (range == Range::positive && !(value > 0)) fail(node, fmt::format("{} is {}, must be positive", what, value));
  if (range == Range::nonnegative && value < 0) fail(node, fmt::format("{} is {}, must not be negative", what, value));
  return value;
}

std::optional<double> Table::number(const std::string& key, const Dimension& dimension, Range range, double bare_unit) {
  const toml::node* node = ask({.kind = AskedKey::Kind::number, .key = key, .dimension = dimension, .range = range});
  if (!node) return std::nullopt;
  return quantity(*node, label(key), dimension, range, bare_unit);
}

std::optional<std::vector<double>> Table::numbers(const std::string& key, std::size_t count, const Dimension& dimension,
                                                  double bare_unit) {
  const toml::node* node =
      ask({.kind = AskedKey::Kind::vector, .key = key, .dimension = dimension, .count = static_cast<int>(count)});
  if (!node) return std::nullopt;
  const toml::array* array = node->as_array();
  if (!array || array->size() != count) {
    fail(*node, fmt::format("{} must be an array of {} numbers ({})", label(key), count, unit_name(dimension)));
  }
  std::vector<double> result;
  for (std::size_t i = 0; i < count; ++i) {
    result.push_back(
        quantity((*array)[i], fmt::format("entry {} of {}", i, label(key)), dimension, Range::any, bare_unit));
  }
  return result;
}

std::optional<int> Table::integer(const std::string& key, int least, int most) {
  const toml::node* node = ask({.kind = AskedKey::Kind::integer, .key = key, .least = least, .most = most});
  if (!node) return std::nullopt;
  return integer(*node, label(key), least, most);
}

int Table::integer(const toml::node& node, const std::string& what, int least, int most) {
  const auto value = node.is_integer() ? node.value<std::int64_t>() : std::nullopt;
  if (!value) fail(node, fmt::format("{} must be a whole number, not {}", what, type_name(node)));
  if (*value < least || *value > most) fail(node, fmt::format("{} is {}, must be {} to {}", what, *value, least, most));
  return static_cast<int>(*value);
}

std::optional<std::array<int, 2>> Table::integers(const std::string& key, int least, int most) {
  const toml::node* node = ask({.kind = AskedKey::Kind::integers, .key = key, .least = least, .most = most});
  if (!node) return std::nullopt;
  const toml::array* array = node->as_array();
  if (!array || array->size() != 2) fail(*node, fmt::format("{} must be two whole numbers [u, v]", label(key)));
  return std::array<int, 2>{integer((*array)[0], label(key), least, most),
                            integer((*array)[1], label(key), least, most)};
}

std::optional<std::string> Table::string(const std::string& key) {
  const toml::node* node = ask({.kind = AskedKey::Kind::string, .key = key});
  if (!node) return std::nullopt;
  if (!node->is_string()) fail(*node, fmt::format("{} must be a string, not {}", label(key), type_name(*node)));
  return *node->value<std::string>();
}

std::optional<bool> Table::boolean(const std::string& key) {
  const toml::node* node = ask({.kind = AskedKey::Kind::boolean, .key = key});
  if (!node) return std::nullopt;
  if (!node->is_boolean()) fail(*node, fmt::format("{} must be true or false, not {}", label(key), type_name(*node)));
  return *node->value<bool>();
}

std::optional<std::string> Table::choice(const std::string& key, const std::vector<std::string>& now,
                                         const std::vector<std::string>& later) {
  ask({.kind = AskedKey::Kind::choice, .key = key, .choices = now});
  const auto value = string(key);
  if (!value) return std::nullopt;
  const toml::node& node = *table_.get(key);
  if (std::ranges::find(later, *value) != later.end()) {
    fail(node, fmt::format("{} = \"{}\" is not supported by this version; use {}", label(key), *value,
                           fmt::join(now, " or ")));
  }
  if (std::ranges::find(now, *value) == now.end()) {
    fail(node, fmt::format("unknown {} \"{}\"{}", label(key), *value, suggestion(*value, now)));
  }
  return value;
}

std::optional<Table> Table::table(const std::string& key, const std::string& name) {
  const toml::node* node = ask({.kind = AskedKey::Kind::table, .key = key, .child = name});
  if (!node) return std::nullopt;
  return as_table(*node, name);
}

Table Table::as_table(const toml::node& node, const std::string& name) const {
  if (!node.is_table()) fail(node, fmt::format("{} must be a table, not {}", name, type_name(node)));
  return Table(*node.as_table(), name, file_);
}

std::vector<Table> Table::tables(const std::string& key, const std::string& name) {
  const toml::node* node = ask({.kind = AskedKey::Kind::tables, .key = key, .child = name});
  if (!node) return {};
  const toml::array* array = node->as_array();
  if (!array) fail(*node, fmt::format("{} must be an array of tables: write {}", key, name));
  std::vector<Table> result;
  for (const toml::node& entry : *array) result.push_back(as_table(entry, name));
  return result;
}

void Table::refuse(const std::string& key, const std::string& why) {
  if (const toml::node* node = table_.get(key)) fail(*node, why);
}

void Table::done() const {
  for (const auto& [key, node] : table_) {
    const std::string_view name = key.str();
    if (std::ranges::find(known_, name) != known_.end()) continue;
    const auto line = key.source().begin.line;
    const std::string at = line > 0 ? fmt::format("{}:{}", file_, line) : file_ + " (--set)";
    throw UnknownKeyError(fmt::format("{}: unknown key '{}' in {}{}", at, name, name_, suggestion(name, known_)));
  }
}

}  // namespace toile
