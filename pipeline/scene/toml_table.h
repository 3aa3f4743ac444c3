// SPDX-License-Identifier: GPL-3.0-or-later
// TOML tables as this program reads them: every key is asked for by name, and what nobody asked for is an error that
// names file, line and the nearest key.
#pragma once

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#include <toml++/toml.h>
#pragma GCC diagnostic pop

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/error.h"
#include "pipeline/base/suggestion.h"
#include "pipeline/scene/units.h"

namespace toile {

struct UnknownKeyError : InputError {
  using InputError::InputError;
};

// toml++ bounds how deep values nest, not how many parts a dotted key has, and it frees tables by recursion: longer
// keys throw InputError `file:line: what` before it reads them.
constexpr int deepest_key = 16;
void refuse_deep_keys(std::string_view text, const std::string& file);

// Throws InputError `file:line: what` where the text is no TOML.
toml::table parse_toml(std::string_view text, const std::filesystem::path& path);

// "a table", "a string", ...
const char* type_name(const toml::node& node);

// A value as TOML reads it, on one line.
std::string toml_text(const toml::node& node);

// The keys of a table as the file has them; where it has no lines, by name.
std::vector<std::pair<std::string, const toml::node*>> in_file_order(const toml::table& table);

enum class Range { any, nonnegative, positive };

// What a reader asks of a key: the description that a schema is made of.
struct AskedKey {
  enum class Kind { any, number, vector, integer, integers, string, boolean, choice, table, tables };
  Kind kind = Kind::any;
  std::string table = {};  // its name, as errors give it ("[[panel]]")
  std::string key = {};
  Dimension dimension = dimension::none;
  Range range = Range::any;
  int count = 0;            // entries of a vector
  int least = 0, most = 0;  // whole numbers
  std::vector<std::string> choices = {};
  std::string child = {};  // name of the table or of each of the tables
};

// While one lives, every key that a Table of this thread is asked for is listed, in order and once.
class KeyRecording {
 public:
  KeyRecording();
  ~KeyRecording();
  KeyRecording(const KeyRecording&) = delete;
  KeyRecording& operator=(const KeyRecording&) = delete;
  const std::vector<AskedKey>& keys() const { return keys_; }

 private:
  friend class Table;
  void take(const AskedKey& key);
  std::vector<AskedKey> keys_;
};

// Keys of one table, each asked for by name. Getters return nothing (or leave the target) where the key is missing and
// throw InputError `file:line: ...` where its value is of another kind; `done` throws UnknownKeyError for a key that
// nobody asked for.
class Table {
 public:
  Table(const toml::table& table, std::string name, std::string file)
      : table_(table), name_(std::move(name)), file_(std::move(file)) {}

  const toml::node* find(const std::string& key) { return ask({.key = key}); }

  std::string place(const toml::node& node) const;  // "scene.toml:12"
  std::string where() const { return place(table_); }
  [[noreturn]] void fail(const toml::node& node, const std::string& what) const;
  [[noreturn]] void missing(const std::string& key, const std::string& what) const;
  std::string label(const std::string& key) const;

  // `bare_unit`: SI value of 1 where the text says no unit.
  double quantity(const toml::node& node, const std::string& what, const Dimension& dimension, Range range,
                  double bare_unit = 1);
  std::optional<double> number(const std::string& key, const Dimension& dimension, Range range, double bare_unit = 1);
  void number(double& target, const std::string& key, const Dimension& dimension, Range range, double bare_unit = 1) {
    if (const auto value = number(key, dimension, range, bare_unit)) target = *value;
  }
  template <int N>
  std::optional<Eigen::Matrix<double, N, 1>> vector(const std::string& key, const Dimension& dimension,
                                                    double bare_unit = 1) {
    const std::optional<std::vector<double>> values = numbers(key, N, dimension, bare_unit);
    if (!values) return std::nullopt;
    return Eigen::Map<const Eigen::Matrix<double, N, 1>>(values->data());
  }
  std::optional<int> integer(const std::string& key, int least, int most);
  int integer(const toml::node& node, const std::string& what, int least, int most);
  std::optional<std::array<int, 2>> integers(const std::string& key, int least, int most);
  std::optional<std::string> string(const std::string& key);
  std::optional<bool> boolean(const std::string& key);
  // One of `now`; those of `later` are refused with a reason of their own.
  std::optional<std::string> choice(const std::string& key, const std::vector<std::string>& now,
                                    const std::vector<std::string>& later);
  std::optional<Table> table(const std::string& key, const std::string& name);
  Table as_table(const toml::node& node, const std::string& name) const;
  std::vector<Table> tables(const std::string& key, const std::string& name);  // of an array of tables
  void refuse(const std::string& key, const std::string& why);

  const toml::table& raw() const { return table_; }
  void done() const;

 private:
  const toml::node* ask(AskedKey key);
  std::optional<std::vector<double>> numbers(const std::string& key, std::size_t count, const Dimension& dimension,
                                             double bare_unit);

  const toml::table& table_;
  std::string name_, file_;
  std::vector<std::string> known_;
};

}  // namespace toile
