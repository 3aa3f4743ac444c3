// SPDX-License-Identifier: GPL-3.0-or-later
// The schemas of scenes and studies against the readers, the samples and wrong files.
#include "pipeline/study/schema.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "geometry/error.h"
#include "io/file.h"
#include "io/file_formats.h"
#include "pipeline/scene/scene.h"
#include "pipeline/scene/toml_table.h"
#include "pipeline/study/study.h"

namespace toile {
namespace {

using Json = nlohmann::ordered_json;

// What draft 7 says of the words that our schemas use; any other word fails the test.
class Validator {
 public:
  explicit Validator(const Json& schema) : root_(schema) {}

  // The first complaint, with the path; empty where the value fits.
  std::string check(const Json& value) const { return check(value, root_, ""); }

 private:
  static bool is(const Json& value, const std::string& type) {
    if (type == "object") return value.is_object();
    if (type == "array") return value.is_array();
    if (type == "string") return value.is_string();
    if (type == "boolean") return value.is_boolean();
    if (type == "integer") return value.is_number_integer();
    if (type == "number") return value.is_number();
    throw std::runtime_error("unknown type " + type);
  }

  std::string check(const Json& value, const Json& schema, const std::string& path) const {
    for (const auto& [word, argument] : schema.items()) {
      const std::string trouble = check(word, argument, value, schema, path);
      if (!trouble.empty()) return trouble;
    }
    return "";
  }

  std::string check(const std::string& word, const Json& argument, const Json& value, const Json& schema,
                    const std::string& path) const {
    const auto complaint = [&] { return path + ": " + word + " " + argument.dump() + " against " + value.dump(); };
    const auto when = [&](bool right) { return right ? "" : complaint(); };
    static const std::set<std::string> silent{"$schema", "title", "description", "definitions"};
    if (silent.contains(word)) return "";
    if (word == "$ref") return check(value, root_.at("definitions").at(argument.get<std::string>().substr(14)), path);
    if (word == "type") {
      const std::vector<std::string> types =
          argument.is_array() ? argument.get<std::vector<std::string>>() : std::vector{argument.get<std::string>()};
      return when(std::ranges::any_of(types, [&](const std::string& type) { return is(value, type); }));
    }
    if (word == "enum") return when(std::ranges::find(argument, value) != argument.end());
    if (word == "const") return when(value == argument);
    if (word == "anyOf") {
      return when(
          std::ranges::any_of(argument, [&](const Json& choice) { return check(value, choice, path).empty(); }));
    }
    if (word == "pattern")
      return when(!value.is_string() ||
                  std::regex_search(value.get<std::string>(), std::regex(argument.get<std::string>())));
    if (word == "minimum") return when(!value.is_number() || value >= argument);
    if (word == "maximum") return when(!value.is_number() || value <= argument);
    if (word == "exclusiveMinimum") return when(!value.is_number() || value > argument);
    if (word == "minItems") return when(!value.is_array() || value.size() >= argument.get<std::size_t>());
    if (word == "maxItems") return when(!value.is_array() || value.size() <= argument.get<std::size_t>());
    if (word == "items") {
      for (std::size_t k = 0; value.is_array() && k < value.size(); ++k) {
        const std::string trouble = check(value[k], argument, path + "/" + std::to_string(k));
        if (!trouble.empty()) return trouble;
      }
      return "";
    }
    if (word == "required") {
      return when(!value.is_object() || std::ranges::all_of(argument, [&](const Json& key) {
        return value.contains(key.get<std::string>());
      }));
    }
    if (word == "properties") {
      for (const auto& [key, inner] : argument.items()) {
        if (!value.is_object() || !value.contains(key)) continue;
        const std::string trouble = check(value[key], inner, path + "/" + key);
        if (!trouble.empty()) return trouble;
      }
      return "";
    }
    if (word == "additionalProperties") {
      for (const auto& [key, inner] : value.items()) {
        if (!value.is_object() || schema.value("properties", Json::object()).contains(key)) continue;
        if (argument == false) return path + ": unknown key " + key;
        const std::string trouble = check(inner, argument, path + "/" + key);
        if (!trouble.empty()) return trouble;
      }
      return "";
    }
    throw std::runtime_error("the validator doesn't know " + word);
  }

  const Json root_;
};

Json json_of(const std::string& text, const std::filesystem::path& path) {
  std::ostringstream out;
  out << toml::json_formatter(parse_toml(text, path));
  return Json::parse(out.str());
}

std::vector<std::filesystem::path> samples(const std::string& name) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(TOILE_SAMPLES))
    if (entry.path().filename().string().ends_with(name)) files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

// "panel.grain_deg" of every key, with its schema.
std::map<std::string, Json> keys_of(const Json& schema) {
  std::map<std::string, Json> keys;
  for (const auto& [key, inner] : schema["properties"].items()) keys[key] = inner;
  for (const auto& [table, definition] : schema["definitions"].items()) {
    const Json properties = definition.value("properties", Json::object());
    for (const auto& [key, inner] : properties.items()) keys[table + "." + key] = inner;
  }
  return keys;
}

TEST(Schema, EverySampleFits) {
  const Validator scenes(scene_schema()), studies(study_schema());
  int count = 0;
  for (const auto& file : samples(".toml")) {
    const Json json = json_of(read_file(file), file);
    if (json.contains("panel")) {
      EXPECT_EQ(scenes.check(json), "") << file;
      ++count;
    } else if (json.contains("scene") || json.contains("series")) {
      EXPECT_EQ(studies.check(json), "") << file;
      ++count;
    }
  }
  EXPECT_GT(count, 15);
}

// What the reader asks for while it reads the samples is in the schema, and asked for as the schema says.
TEST(Schema, KnowsEveryKeyThatTheReadersAskFor) {
  const auto scene_keys = keys_of(scene_schema()), study_keys = keys_of(study_schema());
  int asked = 0;
  for (const auto& file : samples(".toml")) {
    const KeyRecording recording;
    const bool scene = json_of(read_file(file), file).contains("panel");
    try {
      scene ? void(read_scene(file)) : void(read_study(file));
    } catch (const InputError&) {
      continue;  // a file that isn't committed, or no scene at all
    }
    for (const AskedKey& key : recording.keys()) {
      if (key.table.starts_with("[fabric.") || key.table == "a row") continue;
      const bool top = key.table == "the scene" || key.table == "the study";
      const std::string path = (top ? "" : schema_name(key.table) + ".") + key.key;
      EXPECT_TRUE((key.table == "the study" || !scene ? study_keys : scene_keys).contains(path) ||
                  scene_keys.contains(path))
          << file << ": " << path;
      ++asked;
    }
  }
  EXPECT_GT(asked, 300);
}

TEST(Schema, TakesTheFrameFormatsThatTheReaderTakes) {
  const Validator scenes(scene_schema());
  for (const NamedFormat& format : file_formats()) {
    const std::string text = std::string("[[panel]]\nfile = \"/proc/version\"\n[output]\nformats = [\"") +
                             std::string(format.name) + "\"]\n";
    EXPECT_EQ(scenes.check(json_of(text, "scene.toml")).empty(), format.of_frames) << format.name;
    if (format.of_frames) {
      EXPECT_EQ(parse_scene(text, "scene.toml").formats, std::vector{format.format});
    } else {
      EXPECT_THROW(parse_scene(text, "scene.toml"), InputError) << format.name;
    }
  }
}

TEST(Schema, EveryKeyHasItsWordsAndEveryWordAKey) {
  for (const bool scene : {true, false}) {
    const auto words = scene ? scene_words() : study_words();
    const auto keys = keys_of(scene ? scene_schema() : study_schema());
    for (const auto& [path, inner] : keys)
      EXPECT_NE(std::ranges::find(words, path, &KeyWords::path), words.end()) << path << " has no words";
    for (const KeyWords& w : words) EXPECT_TRUE(keys.contains(std::string(w.path))) << w.path << " is no key";
  }
}

TEST(Schema, EveryReferenceHasItsDefinition) {
  for (const Json& schema : {scene_schema(), study_schema()}) {
    const std::string text = schema.dump();
    const std::regex reference("#/definitions/(\\w+)");
    int count = 0;
    for (std::sregex_iterator it(text.begin(), text.end(), reference), end; it != end; ++it, ++count)
      EXPECT_TRUE(schema["definitions"].contains((*it)[1].str())) << (*it)[1];
    EXPECT_GE(count, 4);
  }
}

// A value that the reader refuses by its kind or range, the schema refuses too.
TEST(Schema, RefusesWhatTheReaderRefuses) {
  const Validator scenes(scene_schema());
  const std::string panel = "[[panel]]\nfile = \"/proc/version\"\n";
  const auto reader_takes = [](const std::string& text) {
    try {
      parse_scene(text, "scene.toml");
      return true;
    } catch (const InputError&) {
      return false;
    }
  };
  for (const char* good :
       {"", "grain_deg = \"30 deg\"\n", "refine = { span = \"20 mm\" }\n", "[solver]\ndt = \"auto\"\n",
        "[solver]\ndt = 0.001\n", "[output]\nformats = [\"vtu\", \"obj\"]\n", "[fabric.a]\ndrag = 1\n"}) {
    EXPECT_TRUE(reader_takes(panel + good)) << good;
    EXPECT_EQ(scenes.check(json_of(panel + good, "scene.toml")), "") << good;
  }
  for (const char* bad :
       {"grian_deg = 3\n", "grain_deg = true\n", "refine = { degree = 9 }\n", "refine = { spans = [3] }\n",
        "refine = { span = -1 }\n", "place = { translate = [0, 0] }\n", "name = 3\n", "[solver]\nscheme = \"euler\"\n",
        "[solver]\nmax = 1\n", "[output]\nformats = [\"step\"]\n", "[output]\npreview = 1\n", "[fabric.a]\ndrag = -1\n",
        "[fabric.a]\nbending = { b = 1 }\n", "[load]\ngravity = 9.81\n", "[[pin]]\nclamp = true\n", "pins = 1\n"}) {
    EXPECT_FALSE(reader_takes(panel + bad)) << bad;
    EXPECT_NE(scenes.check(json_of(panel + bad, "scene.toml")), "") << bad;
  }
}

}  // namespace
}  // namespace toile
