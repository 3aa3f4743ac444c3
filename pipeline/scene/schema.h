// SPDX-License-Identifier: GPL-3.0-or-later
// The JSON schema of scenes, for editors that complete and check TOML. (pipeline/scene/README.md)
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>

namespace toile {

// Draft 7. Keys, kinds, units, ranges and choices are what the reader itself asks for while it reads a document that
// has every table; scene_words() adds meaning and defaults.
//   (1) a key is in the schema if and only if the reader knows it;
//   (2) a file that the reader takes fits the schema. The converse doesn't hold: files, names, addresses and what
//       depends on several keys only the reader checks.
nlohmann::ordered_json scene_schema();

// What a key means. `path`: the table's name in the schema and the key ("panel.grain_deg"); top-level keys have no dot.
struct KeyWords {
  std::string_view path, about;
  bool required = false;
};
std::span<const KeyWords> scene_words();

// The name in a schema of a table that errors call `name`: "[[panel]]" is "panel".
std::string schema_name(std::string_view name);

}  // namespace toile
