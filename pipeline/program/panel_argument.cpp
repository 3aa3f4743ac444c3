// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/program/panel_argument.h"

#include <fmt/format.h>

#include <filesystem>
#include <sstream>

#include "geometry/error.h"
#include "io/file.h"

namespace toile {

TomlKind toml_kind(const std::string& path) {
  std::istringstream text(read_file(path));
  for (std::string line; std::getline(text, line);) {
    const std::size_t start = line.find_first_not_of(" \t");
    if (start == std::string::npos) continue;
    const std::string_view words = std::string_view(line).substr(start);
    if (words.starts_with("[[panel]]")) return TomlKind::scene;
    if (words.starts_with("[[series]]") || words.starts_with("[quantity]") || words.starts_with("[reference]"))
      return TomlKind::study;
    const std::string_view key = words.substr(0, words.find_first_of(" =\t"));
    if (key == "scene" || key == "quantity.of") return TomlKind::study;
  }
  return TomlKind::other;
}

PanelFile read_panel_argument(const std::string& path, const PanelChoice& choice) {
  if (std::filesystem::path(path).extension() != ".toml") return read_panels(path, choice);
  switch (toml_kind(path)) {
    case TomlKind::scene:
      throw InputError(
          fmt::format("{0} is a scene, not a panel file: `toile check {0}` looks at it, `toile drape {0}` runs it; the "
                      "panel files stand under its [[panel]] keys",
                      path));
    case TomlKind::study:
      throw InputError(fmt::format("{0} is a study, not a panel file: `toile study {0}` runs it", path));
    case TomlKind::other:
      break;
  }
  throw InputError(fmt::format("{} is no panel file (IGES, pattern JSON or DXF), nor a scene", path));
}

}  // namespace toile
