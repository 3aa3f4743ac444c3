// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/scene/schema.h"

#include <fmt/format.h>

#include "io/file_formats.h"
#include "pipeline/scene/scene.h"
#include "pipeline/scene/schema_of_keys.h"

namespace toile {
namespace {

using Json = nlohmann::ordered_json;

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
[sewing]
[[obstacle]]
name = "body"
mesh = "{0}"
morph = {{ to = "{0}", end = 1 }}
place = {{}}
move = {{ end = 1 }}
[[obstacle]]
shape = "plane"
point = [0, 0, 0]
normal = [0, 0, 1]
[[obstacle]]
shape = "sphere"
centre = [0, 0, 0]
radius = 1
[[obstacle]]
shape = "capsule"
from = [0, 0, 0]
to = [0, 0, 1]
radius = 1
[[obstacle]]
shape = "box"
centre = [0, 0, 0]
size = [1, 1, 1]
[[contact_pair]]
a = "a"
b = "body"
friction = 0.3
[contact]
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

std::vector<AskedKey> scene_keys() {
  const KeyRecording recording;
  for (const char* mode : {"mode = \"band\"\nstretch = [0.1, 0.1]\nstiffness = 1", "mode = \"inextensible\""})
    parse_scene(scene_document(mode), "scene.toml");
  return recording.keys();
}

std::map<std::string, Json> scene_values() {
  const auto time_or = [](const char* word) {
    return Json{{"anyOf", {{{"const", word}}, schema_of_quantity(dimension::time, Range::positive)}}};
  };
  const auto several = [](const Json& entry) { return Json{{"type", "array"}, {"items", entry}, {"minItems", 2}}; };
  return {
      {"obstacle.sequence", several({{"type", "string"}})},
      {"obstacle.times", several(schema_of_quantity(dimension::time, Range::any))},
      {"solver.dt", time_or("auto")},
      {"solver.until", time_or("rest")},
      {"output.formats", {{"type", "array"}, {"items", {{"enum", frame_format_names()}}}}},
      {"fabric", {{"type", "object"}, {"additionalProperties", schema_reference("fabric_NAME")}}},
  };
}

}  // namespace

Json scene_schema() {
  return schema_of_keys(scene_keys(), {"A scene of Toile", "the scene", scene_words(), scene_values()});
}

}  // namespace toile
