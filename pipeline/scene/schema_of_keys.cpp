// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/scene/schema_of_keys.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace toile {
namespace {

using Json = nlohmann::ordered_json;
using Kind = AskedKey::Kind;

Json array_of(const Json& entry, int count) {
  return {{"type", "array"}, {"items", entry}, {"minItems", count}, {"maxItems", count}};
}

Json schema_of(const AskedKey& key) {
  switch (key.kind) {
    case Kind::number:
      return schema_of_quantity(key.dimension, key.range);
    case Kind::vector:
      return array_of(schema_of_quantity(key.dimension, Range::any), key.count);
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
      return schema_reference(key.child);
    case Kind::tables:
      return {{"type", "array"}, {"items", schema_reference(key.child)}};
    case Kind::any:
      break;
  }
  return Json::object();
}

}  // namespace

Json schema_of_quantity(const Dimension& dimension, Range range) {
  Json out = {{"type", {"number", "string"}}};
  if (range == Range::positive) out["exclusiveMinimum"] = 0;
  if (range == Range::nonnegative) out["minimum"] = 0;
  out["pattern"] = "^ *[-+]?[0-9.]";
  if (!(dimension == dimension::none))
    out["description"] = fmt::format("[{}], or a string with a unit", unit_name(dimension));
  return out;
}

Json schema_reference(const std::string& table) {
  return {{"$ref", "#/definitions/" + schema_name(table)}};
}

Json one_or_several(const Json& entry) {
  return {{"anyOf", {entry, {{"type", "array"}, {"items", entry}, {"minItems", 1}}}}};
}

Json schema_of_keys(const std::vector<AskedKey>& keys, const SchemaNotes& notes) {
  Json out = {{"$schema", "http://json-schema.org/draft-07/schema#"}, {"title", notes.title}};
  std::map<std::string, Json> tables;
  std::vector<std::string> order;
  for (const AskedKey& key : keys) {
    if (key.table == "a row") continue;  // of scene keys
    const std::string table = key.table == notes.root ? "" : schema_name(key.table);
    const std::string path = table.empty() ? key.key : table + "." + key.key;
    if (!tables.contains(table)) {
      order.push_back(table);
      tables[table] = {{"type", "object"}, {"additionalProperties", false}};
    }
    const auto own = notes.values.find(path);
    Json entry = own == notes.values.end() ? schema_of(key) : own->second;
    const auto word = std::ranges::find(notes.words, path, &KeyWords::path);
    if (word != notes.words.end()) {
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

std::string schema_name(std::string_view name) {
  std::string out;
  for (const char c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_') out += c;
    if (c == ' ' || c == '.') out += '_';
  }
  return out;
}

}  // namespace toile
