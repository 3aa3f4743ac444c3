// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/study/schema.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <nlohmann/json.hpp>

#include "geometry/error.h"
#include "io/file_formats.h"
#include "pipeline/scene/scene.h"
#include "pipeline/scene/toml_table.h"
#include "pipeline/study/study.h"

namespace toile {
namespace {

using Json = nlohmann::ordered_json;
using Kind = AskedKey::Kind;

// Panels, meshes and scenes have to be there when a file is read; what is in them doesn't matter here.
constexpr const char* some_file = "/proc/version";

// Documents that make the scene reader ask for every key.
std::string scene_document(const std::string& mode) {
  return fmt::format(R"(
[fabric.NAME]
membrane = {{}}
bending = {{}}
[[panel]]
name = "a"
file = "{0}"
refine = {{}}
place = {{}}
[[pin]]
at = "corner:0,0"
move = {{ end = 1 }}
[[traction]]
along = "edge:u0"
force = [0, 0, 1]
[[force]]
at = "corner:0,0"
force = [0, 0, 1]
[[seam]]
a = {{ curve = 0 }}
b = {{ curve = 1 }}
[[obstacle]]
mesh = "{0}"
place = {{}}
move = {{ end = 1 }}
[strain_limit]
{1}
[load]
[solver]
until = "rest"
rest = {{}}
[output]
points = [{{ uv = [0, 0] }}]
)",
                     some_file, mode);
}

std::string study_document(const std::string& reference, const std::string& head = "") {
  return fmt::format(R"(
scene = "{0}"
{1}
[set]
[limits]
[check]
[quantity]
of = "depth"
[reference]
{2}
)",
                     some_file, head, reference);
}

std::vector<AskedKey> scene_keys() {
  const KeyRecording recording;
  for (const char* mode : {"mode = \"band\"\nstretch = [0.1, 0.1]\nstiffness = 1", "mode = \"inextensible\""})
    parse_scene(scene_document(mode), "scene.toml");
  return recording.keys();
}

std::vector<AskedKey> study_keys() {
  const KeyRecording recording;
  const std::string given = "kind = \"value\"\nvalue = 1\nuncertainty = 0\nsource = \"\"";
  parse_study(study_document(given, "rows = [{}]\nvary = {}"), "study.toml");
  parse_study(study_document("kind = \"richardson\"", "series = [{ vary = {} }]"), "study.toml");
  try {
    parse_study(study_document(fmt::format("kind = \"table\"\nfile = \"{}\"\ncolumn = \"x\"\nwhere = {{}}", some_file)),
                "study.toml");
  } catch (const InputError&) {  // that file has no such column
  }
  return recording.keys();
}

Json quantity(const Dimension& dimension, Range range) {
  Json out = {{"type", {"number", "string"}}};
  if (range == Range::positive) out["exclusiveMinimum"] = 0;
  if (range == Range::nonnegative) out["minimum"] = 0;
  out["pattern"] = "^ *[-+]?[0-9.]";
  if (!(dimension == dimension::none))
    out["description"] = fmt::format("[{}], or a string with a unit", unit_name(dimension));
  return out;
}

Json reference(const std::string& table) {
  return {{"$ref", "#/definitions/" + schema_name(table)}};
}

Json array_of(const Json& entry, int count) {
  return {{"type", "array"}, {"items", entry}, {"minItems", count}, {"maxItems", count}};
}

Json one_or_several(const Json& entry) {
  return {{"anyOf", {entry, {{"type", "array"}, {"items", entry}, {"minItems", 1}}}}};
}

// Keys whose values the readers look at themselves, and tables whose keys are the user's own names.
Json particular(const std::string& path) {
  const auto word_or = [](const char* word, const Json& other) { return Json{{"anyOf", {{{"const", word}}, other}}}; };
  const Json any_table = {{"type", "object"}}, string = {{"type", "string"}};
  const Json row = {{"type", "object"}, {"properties", {{"label", string}}}};
  const Json rows = {{"type", "array"}, {"items", row}, {"minItems", 1}};
  static const std::map<std::string, Json> values = {
      {"solver.dt", word_or("auto", quantity(dimension::time, Range::positive))},
      {"solver.until", word_or("rest", quantity(dimension::time, Range::positive))},
      {"output.formats", {{"type", "array"}, {"items", {{"enum", frame_format_names()}}}}},
      {"fabric", {{"type", "object"}, {"additionalProperties", reference("fabric_NAME")}}},
      {"columns", one_or_several(string)},
      {"set", any_table},
      {"vary", any_table},
      {"rows", rows},
      {"series.set", any_table},
      {"series.vary", any_table},
      {"series.rows", rows},
      {"quantity.of", one_or_several(string)},
      {"reference.value", one_or_several(quantity(dimension::none, Range::any))},
      {"reference.scale", one_or_several(quantity(dimension::none, Range::any))},
      {"reference.column", one_or_several(string)},
      {"reference.where", {{"type", "object"}, {"additionalProperties", quantity(dimension::none, Range::any)}}},
  };
  const auto found = values.find(path);
  return found == values.end() ? Json() : found->second;
}

Json schema_of(const AskedKey& key) {
  switch (key.kind) {
    case Kind::number:
      return quantity(key.dimension, key.range);
    case Kind::vector:
      return array_of(quantity(key.dimension, Range::any), key.count);
    case Kind::integer:
      return {{"type", "integer"}, {"minimum", key.least}, {"maximum", key.most}};
    case Kind::integers:
      return array_of({{"type", "integer"}, {"minimum", key.least}, {"maximum", key.most}}, 2);
    case Kind::string:
      return {{"type", "string"}};
    case Kind::boolean:
      return {{"type", "boolean"}};
    case Kind::choice:
      return {{"enum", key.choices}};
    case Kind::table:
      return reference(key.child);
    case Kind::tables:
      return {{"type", "array"}, {"items", reference(key.child)}};
    case Kind::any:
      break;
  }
  return Json::object();
}

Json schema_of(const std::vector<AskedKey>& keys, const std::string& root, std::span<const KeyWords> words,
               const std::string& title) {
  Json out = {{"$schema", "http://json-schema.org/draft-07/schema#"}, {"title", title}};
  std::map<std::string, Json> tables;
  std::vector<std::string> order;
  for (const AskedKey& key : keys) {
    if (key.table == "a row") continue;  // of scene keys
    const std::string table = key.table == root ? "" : schema_name(key.table);
    const std::string path = table.empty() ? key.key : table + "." + key.key;
    if (!tables.contains(table)) {
      order.push_back(table);
      tables[table] = {{"type", "object"}, {"additionalProperties", false}};
    }
    Json entry = particular(path);
    if (entry.is_null()) entry = schema_of(key);
    const auto word = std::ranges::find(words, path, &KeyWords::path);
    if (word != words.end()) {
      const std::string unit = entry.value("description", "");
      entry["description"] = std::string(word->about) + (unit.empty() ? "" : " " + unit);
      if (word->required) tables[table]["required"].push_back(key.key);
    }
    Json& properties = tables[table]["properties"];
    if (!properties.contains(key.key)) properties[key.key] = entry;
  }
  out.update(tables[""]);
  for (const std::string& table : order) {
    if (!table.empty()) out["definitions"][table] = tables[table];
  }
  return out;
}

}  // namespace

std::string schema_name(std::string_view name) {
  std::string out;
  for (const char c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_') out += c;
    if (c == ' ' || c == '.') out += '_';
  }
  return out;
}

Json scene_schema() {
  return schema_of(scene_keys(), "the scene", scene_words(), "A scene of Toile");
}

Json study_schema() {
  return schema_of(study_keys(), "the study", study_words(), "A study of Toile");
}

}  // namespace toile
