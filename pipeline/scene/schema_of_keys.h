// SPDX-License-Identifier: GPL-3.0-or-later
// A JSON schema from the keys that a reader asks for.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "pipeline/scene/schema.h"
#include "pipeline/scene/toml_table.h"
#include "pipeline/scene/units.h"

namespace toile {

// What the keys don't say themselves.
struct SchemaNotes {
  std::string title, root;  // `root`: what errors call the top table
  std::span<const KeyWords> words;
  // Schemas by path: of keys whose values the reader looks at itself, and of tables whose keys are the user's own
  // names.
  std::map<std::string, nlohmann::ordered_json> values;
};

// Draft 7. Keys of the table "a row" are left out: they are scene keys.
nlohmann::ordered_json schema_of_keys(const std::vector<AskedKey>& keys, const SchemaNotes& notes);

// Parts of it.
nlohmann::ordered_json schema_of_quantity(const Dimension& dimension, Range range);
nlohmann::ordered_json schema_reference(const std::string& table);
nlohmann::ordered_json one_or_several(const nlohmann::ordered_json& entry);

// For the documents that make a reader ask for every key: files have to be there, what is in them doesn't matter.
inline constexpr const char* some_file = "/proc/version";

}  // namespace toile
