// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/program/scene_arguments.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "geometry/error.h"
#include "pipeline/base/suggestion.h"
#include "pipeline/program/panel_argument.h"
#include "pipeline/program/refinement.h"
#include "pipeline/scene/addresses.h"

namespace toile {
namespace {

std::vector<std::string> settings_of(const SceneArguments& a) {
  std::vector<std::string> settings = a.settings;
  for (const std::string& s : settings) {
    const std::size_t equals = s.find('=');
    if (equals == std::string::npos || s.find_first_not_of(" .[]") == equals)
      throw UsageError(fmt::format("--set {}: expected key=value", s));
  }
  if (!a.until.empty()) settings.push_back("solver.until=" + a.until);
  if (!a.time_limit.empty()) settings.push_back("solver.time_limit=" + a.time_limit);
  return settings;
}

QuickScene quick_request(const SceneArguments& a) {
  QuickScene quick;
  quick.file = a.input;
  quick.choice = a.choice;
  quick.pins = a.pins;
  if (a.pins.empty()) {
    throw UsageError(fmt::format(
        "a panel file needs at least one --pin, such as --pin curve:0,2 (loop 0, curve 2); `toile inspect {} "
        "--svg panel.svg` shows the numbers",
        a.input));
  }
  for (const std::string& pin : a.pins) {
    try {
      parse_address(pin);
    } catch (const InputError& error) {
      throw UsageError(fmt::format("--pin: {}", error.what()));
    }
  }
  if (!a.fabric.empty()) {
    const auto presets = fabric_presets();
    if (std::ranges::find(presets, a.fabric, &FabricPreset::name) == presets.end()) {
      std::vector<std::string> names;
      for (const FabricPreset& preset : presets) names.push_back(preset.name);
      throw UsageError(fmt::format("--fabric: no preset is called '{}'{}", a.fabric, suggestion(a.fabric, names)));
    }
    quick.fabric = a.fabric;
  }
  if (a.degree > 0) quick.degree = a.degree;
  if (!a.span.empty()) quick.span = length_option(a.span, "--span");
  return quick;
}

}  // namespace

Scene scene_of(const SceneArguments& a) {
  const std::vector<std::string> settings = settings_of(a);
  if (std::filesystem::path(a.input).extension() != ".toml") return quick_scene(quick_request(a), settings);
  if (!a.pins.empty() || !a.fabric.empty() || !a.span.empty() || a.degree > 0 || a.choice != PanelChoice()) {
    throw UsageError(
        "--pin, --fabric, --span, --degree, --size, --unit and --outline are for panel files; in a scene use its keys "
        "or "
        "--set");
  }
  if (toml_kind(a.input) == TomlKind::study)
    throw InputError(fmt::format("{0} is a study: `toile study {0}` runs it", a.input));
  return read_scene(a.input, settings);
}

}  // namespace toile
