// SPDX-License-Identifier: GPL-3.0-or-later
// study.toml read and unfolded into its cases.
#include "io/file.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <sstream>

#include "geometry/error.h"
#include "pipeline/scene/scene.h"
#include "pipeline/scene/toml_table.h"
#include "pipeline/study/study.h"

namespace toile {
namespace {

constexpr std::size_t most_cases = 10000;

struct Leaf {
  std::string key;
  const toml::node* node;
};

// The keys of a table of scene keys, nested tables and dotted keys as dotted paths. An inline table is a value.
std::vector<Leaf> leaves(const toml::table& table, const std::string& prefix = "") {
  std::vector<Leaf> result;
  for (const auto& [key, node] : in_file_order(table)) {
    const std::string path = prefix.empty() ? key : prefix + "." + key;
    const toml::table* inner = node->as_table();
    if (inner && !inner->is_inline()) {
      for (Leaf& leaf : leaves(*inner, path)) result.push_back(std::move(leaf));
    } else {
      result.push_back({path, node});
    }
  }
  return result;
}

std::vector<StudySetting> read_set(Table& table, const std::string& name) {
  std::vector<StudySetting> result;
  const auto set = table.table("set", name);
  if (!set) return result;
  for (const Leaf& leaf : leaves(set->raw()))
    result.push_back({leaf.key, toml_text(*leaf.node), set->place(*leaf.node)});
  return result;
}

std::vector<std::string> strings(Table& table, const std::string& key) {
  const toml::node* node = table.find(key);
  if (!node) return {};
  std::vector<std::string> result;
  const auto take = [&](const toml::node& entry) {
    const auto text = entry.is_string() ? entry.value<std::string>() : std::nullopt;
    if (!text || text->empty()) table.fail(entry, table.label(key) + " must be a string or an array of strings");
    result.push_back(*text);
  };
  if (const toml::array* array = node->as_array()) {
    for (const toml::node& entry : *array) take(entry);
    if (result.empty()) table.fail(*node, table.label(key) + " is empty");
  } else {
    take(*node);
  }
  return result;
}

std::vector<double> numbers(Table& table, const std::string& key) {
  const toml::node* node = table.find(key);
  if (!node) return {};
  std::vector<double> result;
  if (const toml::array* array = node->as_array()) {
    for (const toml::node& entry : *array)
      result.push_back(table.quantity(entry, table.label(key), dimension::none, Range::any));
    if (result.empty()) table.fail(*node, table.label(key) + " is empty");
  } else {
    result.push_back(table.quantity(*node, table.label(key), dimension::none, Range::any));
  }
  return result;
}

StudyQuantity read_quantity(Table table) {
  StudyQuantity quantity;
  quantity.paths = strings(table, "of");
  if (quantity.paths.empty()) table.missing("of", "a measure or an entry of report.json such as points.0.position");
  quantity.name = table.string("name").value_or(fmt::format("{}", fmt::join(quantity.paths, ", ")));
  quantity.unit = table.string("unit").value_or("");
  table.done();
  return quantity;
}

// A CSV file without quotes: a head of names, then numbers; lines that start with # are comments.
struct NumberTable {
  std::filesystem::path path;
  std::vector<std::string> names;
  std::vector<std::vector<double>> rows;

  explicit NumberTable(const std::filesystem::path& file) : path(file) {
    std::istringstream text(read_file(file));
    std::string line;
    for (int number = 1; std::getline(text, line); ++number) {
      if (!line.empty() && line.back() == '\r') line.pop_back();
      if (line.empty() || line[0] == '#') continue;
      std::vector<std::string> cells;
      std::istringstream words(line);
      for (std::string cell; std::getline(words, cell, ',');) cells.push_back(cell);
      if (names.empty()) {
        names = cells;
        continue;
      }
      if (cells.size() != names.size()) {
        throw InputError(
            fmt::format("{}:{}: {} cells, the head has {}", file.string(), number, cells.size(), names.size()));
      }
      std::vector<double> row;
      for (const std::string& cell : cells) {
        double value = 0;
        const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
        if (error != std::errc() || end != cell.data() + cell.size()) {
          throw InputError(fmt::format("{}:{}: '{}' is no number", file.string(), number, cell));
        }
        row.push_back(value);
      }
      rows.push_back(std::move(row));
    }
  }
  std::size_t column(const std::string& name) const {
    const auto it = std::ranges::find(names, name);
    if (it == names.end()) {
      throw InputError(fmt::format("{}: no column is called '{}'{}", path.string(), name, suggestion(name, names)));
    }
    return static_cast<std::size_t>(it - names.begin());
  }
};

// The entries of the one row in which the columns of `where` have the values asked for.
std::vector<double> look_up(Table& reference, const std::filesystem::path& study) {
  const auto file = reference.string("file");
  if (!file) reference.missing("file", "a CSV file, relative to the study");
  const NumberTable table(study.parent_path() / *file);
  const std::vector<std::string> columns = strings(reference, "column");
  if (columns.empty()) reference.missing("column", "a column of the CSV file or several");
  std::vector<std::pair<std::size_t, double>> wanted;
  if (auto where = reference.table("where", "where")) {
    for (const auto& [key, node] : in_file_order(where->raw())) {
      wanted.emplace_back(table.column(key), where->quantity(*node, key + " in where", dimension::none, Range::any));
    }
  }
  const std::vector<double>* found = nullptr;
  for (const std::vector<double>& row : table.rows) {
    const bool fits = std::ranges::all_of(
        wanted, [&](const auto& w) { return std::abs(row[w.first] - w.second) <= 1e-12 * std::abs(w.second); });
    if (fits && found)
      reference.fail(reference.raw(), fmt::format("where fits several rows of {}", table.path.string()));
    if (fits) found = &row;
  }
  if (!found) reference.fail(reference.raw(), fmt::format("where fits no row of {}", table.path.string()));
  std::vector<double> values;
  for (const std::string& name : columns) values.push_back((*found)[table.column(name)]);
  return values;
}

StudyReference read_reference(Table table, const std::filesystem::path& study) {
  using Kind = StudyReference::Kind;
  StudyReference reference;
  const auto kind = table.choice("kind", {"finest", "richardson", "value", "table"}, {});
  if (!kind) table.missing("kind", "finest, richardson, value or table");
  reference.relative = table.boolean("relative").value_or(false);
  if (*kind == "finest" || *kind == "richardson") {
    reference.kind = *kind == "finest" ? Kind::finest : Kind::richardson;
    reference.of = table.string("of").value_or("");
    if (reference.kind == Kind::richardson) {
      reference.order = table.number("order", dimension::none, Range::positive);
    }
    table.done();
    return reference;
  }
  reference.kind = Kind::given;
  std::vector<double> value;
  if (*kind == "value") {
    value = numbers(table, "value");
    if (value.empty()) table.missing("value", "a number or a vector");
  } else {
    value = look_up(table, study);
  }
  if (const std::vector<double> scale = numbers(table, "scale"); !scale.empty()) {
    if (scale.size() != 1 && scale.size() != value.size()) {
      table.fail(*table.raw().get("scale"), fmt::format("scale must be 1 or {} numbers", value.size()));
    }
    for (std::size_t k = 0; k < value.size(); ++k) value[k] *= scale[scale.size() == 1 ? 0 : k];
  }
  reference.value = Eigen::Map<Eigen::VectorXd>(value.data(), static_cast<Eigen::Index>(value.size()));
  const auto uncertainty = table.number("uncertainty", dimension::none, Range::nonnegative);
  if (!uncertainty) table.missing("uncertainty", "how far the reference may be off, in the quantity's own unit");
  reference.uncertainty = *uncertainty;
  const auto source = table.string("source");
  if (!source) table.missing("source", "where the reference comes from");
  reference.source = *source;
  table.done();
  return reference;
}

// One axis: entries of settings that are varied together, each with its label.
struct Axis {
  std::string name;
  std::vector<std::pair<std::string, std::vector<StudySetting>>> entries;
};

std::string tail(const std::string& key) {
  return key.substr(key.rfind('.') + 1);
}

std::vector<Axis> read_axes(Table& table) {
  std::vector<Axis> axes;
  if (const toml::node* rows = table.find("rows")) {
    const toml::array* array = rows->as_array();
    if (!array || array->empty()) table.fail(*rows, "rows must be an array of tables of scene keys");
    Axis axis{"rows", {}};
    for (const toml::node& node : *array) {
      Table row = table.as_table(node, "a row");
      std::vector<StudySetting> settings;
      std::string label = row.string("label").value_or(""), made;
      for (const Leaf& leaf : leaves(row.raw())) {
        if (leaf.key == "label") continue;
        settings.push_back({leaf.key, toml_text(*leaf.node), row.place(*leaf.node)});
        made += (made.empty() ? "" : ", ") + tail(leaf.key) + " = " + settings.back().value;
      }
      if (made.empty()) made = "as it is";
      axis.entries.emplace_back(label.empty() ? made : label, settings);
    }
    axes.push_back(std::move(axis));
  }
  if (const auto vary = table.table("vary", "vary")) {
    for (const Leaf& leaf : leaves(vary->raw())) {
      const toml::array* values = leaf.node->as_array();
      if (!values || values->empty()) {
        table.fail(*leaf.node, fmt::format("{} in vary must be an array of the values that it takes", leaf.key));
      }
      Axis axis{tail(leaf.key), {}};
      for (const toml::node& value : *values) {
        const std::string text = toml_text(value);
        axis.entries.push_back({axis.name + " = " + text, {{leaf.key, text, table.place(value)}}});
      }
      axes.push_back(std::move(axis));
    }
  }
  return axes;
}

// A key that the scene doesn't know spoils every run: better said at once, with the setting that brings it. What else
// is wrong with a scene is a result.
void require_known_keys(const StudySeries& series) {
  const auto unknown = [&](const std::vector<std::string>& settings) -> std::string {
    try {
      read_scene(series.scene, settings);
    } catch (const UnknownKeyError& error) {
      return error.what();
    } catch (const InputError&) {
    }
    return "";
  };
  for (const StudyCase& c : series.cases) {
    std::vector<std::string> settings;
    for (const StudySetting& setting : c.settings) settings.push_back(setting.text());
    const std::string trouble = unknown(settings);
    if (trouble.empty()) continue;
    settings.clear();
    if (!unknown(settings).empty()) throw InputError(trouble);
    for (const StudySetting& setting : c.settings) {
      settings.push_back(setting.text());
      if (!unknown(settings).empty()) throw InputError(fmt::format("{}: {}: {}", setting.where, setting.key, trouble));
    }
  }
}

std::filesystem::path scene_path(Table& table, const std::filesystem::path& study) {
  const auto scene = table.string("scene");
  if (!scene) return {};
  const std::filesystem::path path = (study.parent_path() / *scene).lexically_normal();
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    table.fail(*table.raw().get("scene"), fmt::format("scene '{}' does not exist", path.string()));
  }
  return path;
}

// The axes of a series unfolded; `fixed` holds for all of its cases.
void unfold(Table& table, StudySeries& series, const std::vector<StudySetting>& fixed) {
  const std::vector<Axis> axes = read_axes(table);
  std::size_t count = 1;
  for (const Axis& axis : axes) {
    series.axes.push_back(axis.name);
    series.lengths.push_back(axis.entries.size());
    count *= axis.entries.size();
    if (count > most_cases) table.fail(table.raw(), fmt::format("more than {} cases", most_cases));
  }
  for (std::size_t k = 0; k < count; ++k) {
    StudyCase c;
    c.settings = fixed;
    c.at.resize(axes.size());
    std::size_t rest = k;
    for (std::size_t a = axes.size(); a-- > 0;) {
      c.at[a] = rest % axes[a].entries.size();
      rest /= axes[a].entries.size();
    }
    for (std::size_t a = 0; a < axes.size(); ++a) {
      const auto& [label, settings] = axes[a].entries[c.at[a]];
      c.label += (c.label.empty() ? "" : ", ") + label;
      for (const StudySetting& setting : settings) {
        c.varied.push_back(setting);
        c.settings.push_back(setting);
      }
    }
    series.cases.push_back(std::move(c));
  }
}

void require_complete(Table& table, const StudySeries& series, const Study& study) {
  table.done();
  if (series.scene.empty()) table.missing("scene", "the scene file, relative to the study");
  if (series.quantity.paths.empty() && !study.stability) table.missing("quantity", "what is looked at");
  if (series.reference.kind == StudyReference::Kind::none && !study.stability) {
    table.missing("reference", "what errors are measured against");
  }
  if (series.quantity.paths.empty() && series.reference.kind != StudyReference::Kind::none) {
    table.missing("quantity", "what is compared with the reference");
  }
  require_known_keys(series);
}

// `base` has what the study says for all series.
StudySeries read_series(Table& table, StudySeries base, const std::vector<StudySetting>& common, const Study& study) {
  StudySeries series = std::move(base);
  if (const auto name = table.string("name")) series.name = *name;
  if (const auto scene = scene_path(table, study.path); !scene.empty()) series.scene = scene;
  std::vector<StudySetting> fixed = common;
  for (StudySetting& setting : read_set(table, "set")) fixed.push_back(std::move(setting));
  if (auto quantity = table.table("quantity", "quantity")) series.quantity = read_quantity(*quantity);
  if (auto reference = table.table("reference", "reference")) {
    series.reference = read_reference(*reference, study.path);
  }
  unfold(table, series, fixed);
  require_complete(table, series, study);
  return series;
}

void require_series(const Study& study, Table& top) {
  std::vector<std::string> names;
  for (const StudySeries& s : study.series) {
    if (std::ranges::find(names, s.name) != names.end()) {
      top.fail(top.raw(), fmt::format("two series are called '{}'", s.name));
    }
    names.push_back(s.name);
  }
  for (const StudySeries& s : study.series) {
    if (!s.reference.of.empty() && std::ranges::find(names, s.reference.of) == names.end()) {
      top.fail(top.raw(), fmt::format("the reference of series '{}': no series is called '{}'{}", s.name,
                                      s.reference.of, suggestion(s.reference.of, names)));
    }
  }
}

std::string study_name(const std::filesystem::path& path) {
  const std::string stem = path.stem().string();
  if (stem != "study") return stem;
  return std::filesystem::absolute(path).lexically_normal().parent_path().filename().string();
}

}  // namespace

Study read_study(const std::filesystem::path& path) {
  return parse_study(read_file(path), path);
}

Study parse_study(std::string_view text, const std::filesystem::path& path) {
  const toml::table root = parse_toml(text, path);
  Table top(root, "the study", path.string());
  Study study;
  study.path = path;
  study.name = study_name(path);
  study.title = top.string("title").value_or(study.name);
  study.stability = top.choice("kind", {"convergence", "stability"}, {}).value_or("convergence") == "stability";
  study.repeats = top.integer("repeats", 1, 1000).value_or(1);
  study.columns = strings(top, "columns");
  if (auto limits = top.table("limits", "[limits]")) {
    limits->number(study.limits.seconds, "seconds", dimension::time, Range::positive);
    limits->number(study.limits.megabytes, "megabytes", dimension::none, Range::positive);
    limits->done();
  }
  if (auto check = top.table("check", "[check]")) {
    study.largest_error = check->number("error", dimension::none, Range::positive);
    check->done();
  }
  StudySeries base;
  base.name = study.name;
  base.scene = scene_path(top, path);
  const std::vector<StudySetting> common = read_set(top, "[set]");
  if (auto quantity = top.table("quantity", "[quantity]")) base.quantity = read_quantity(*quantity);
  if (auto reference = top.table("reference", "[reference]")) base.reference = read_reference(*reference, path);
  std::vector<Table> series = top.tables("series", "[[series]]");
  if (series.empty()) {
    unfold(top, base, common);
    require_complete(top, base, study);
    study.series.push_back(std::move(base));
  } else {
    for (const char* key : {"vary", "rows"}) top.refuse(key, fmt::format("with [[series]], {} belongs into each", key));
    top.done();
    for (std::size_t k = 0; k < series.size(); ++k) {
      base.name = fmt::format("series {}", k + 1);
      study.series.push_back(read_series(series[k], base, common, study));
    }
  }
  require_series(study, top);
  return study;
}

}  // namespace toile
