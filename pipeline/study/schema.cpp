// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/study/schema.h"

#include <fmt/format.h>

#include "geometry/error.h"
#include "pipeline/scene/schema_of_keys.h"
#include "pipeline/study/study.h"

namespace toile {
namespace {

using Json = nlohmann::ordered_json;

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

std::map<std::string, Json> study_values() {
  const Json any_table = {{"type", "object"}}, string = {{"type", "string"}};
  const Json row = {{"type", "object"}, {"properties", {{"label", string}}}};
  const Json rows = {{"type", "array"}, {"items", row}, {"minItems", 1}};
  const Json number = schema_of_quantity(dimension::none, Range::any);
  return {
      {"columns", one_or_several(string)},
      {"set", any_table},
      {"vary", any_table},
      {"rows", rows},
      {"series.set", any_table},
      {"series.vary", any_table},
      {"series.rows", rows},
      {"quantity.of", one_or_several(string)},
      {"reference.value", one_or_several(number)},
      {"reference.scale", one_or_several(number)},
      {"reference.column", one_or_several(string)},
      {"reference.where", {{"type", "object"}, {"additionalProperties", number}}},
  };
}

}  // namespace

Json study_schema() {
  return schema_of_keys(study_keys(), {"A study of Toile", "the study", study_words(), study_values()});
}

}  // namespace toile
