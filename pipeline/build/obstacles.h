// SPDX-License-Identifier: GPL-3.0-or-later
// Obstacles out of a scene: files read, checked, repaired, placed.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "analysis/contact/obstacle.h"
#include "pipeline/scene/scene.h"

namespace toile {

struct BuiltObstacle {
  std::unique_ptr<Obstacle> obstacle;
  std::string about;                  // "obstacle 'body': 26756 triangles, closed, 0.94 x 1.67 x 0.31 m"
  std::vector<std::string> warnings;  // faults that were left, each with the scene's line
  std::vector<std::string> notes;     // repairs and choices
};

// In its place of time 0. Throws InputError where no surface can be made of what the scene names: line, obstacle, file,
// place of the file and remedy.
BuiltObstacle build_obstacle(const Scene& scene, const SceneObstacle& obstacle);

// All of a scene, in its order, as far as they can be built.
struct BuiltObstacles {
  std::vector<std::unique_ptr<Obstacle>> obstacles;
  std::vector<std::string> about, warnings, notes;
  std::vector<std::string> faults;  // why one can't be
};
BuiltObstacles build_obstacles(const Scene& scene);

}  // namespace toile
