// SPDX-License-Identifier: GPL-3.0-or-later
// Scenes to start from: `toile init`.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace toile {

struct SceneTemplate {
  std::string name, about;
};
std::span<const SceneTemplate> scene_templates();

// Files of a template (name inside the folder, bytes); the scene runs as it is. Throws InputError for an unknown name.
struct TemplateFile {
  std::string name, bytes;
};
std::vector<TemplateFile> scene_template(const std::string& name);

// [fabric.cotton] and [strain_limit], with comments.
std::string fabric_tables();

}  // namespace toile
