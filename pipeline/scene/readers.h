// SPDX-License-Identifier: GPL-3.0-or-later
// The readers of a scene's tables; internal to this room.
#pragma once

#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include "pipeline/scene/scene.h"
#include "pipeline/scene/toml_table.h"

namespace toile {

inline constexpr double degree_in_radians = std::numbers::pi / 180;

// A file that a scene names, relative to the scene.
std::filesystem::path beside(const std::filesystem::path& scene, const std::string& file);

Placement read_placement(Table table);
PinMotion read_motion(Table& move);
// The panel that a table names, or the scene's only one.
std::string panel_key(Table& table, const std::vector<ScenePanel>& panels);
// Once panels are read: [[seam]] and [sewing].
void read_seams(Table& top, Scene& scene);

// [[obstacle]] and, once panels and obstacles are read, [[contact_pair]].
void read_obstacles(Table& top, Scene& scene);
void read_contact_pairs(Table& top, Scene& scene);
void read_contact(Table& table, SceneContact& contact);
// [strain_limit] and, once that is read, [solver].
void read_limit(Table table, Scene& scene);
void read_solver(Table table, Scene& scene);

}  // namespace toile
