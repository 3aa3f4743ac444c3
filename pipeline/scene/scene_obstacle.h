// SPDX-License-Identifier: GPL-3.0-or-later
// What the cloth of a scene meets, as a scene says it.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/scene/placement.h"

namespace toile {

enum class ObstacleKind { mesh, plane, sphere, cylinder, capsule, box };

// Lengths in metres, places in the scene's axes before `place`.
struct SceneObstacle {
  std::string name;
  ObstacleKind kind = ObstacleKind::mesh;

  // A mesh, or an IGES file whose faces are its surface.
  std::filesystem::path mesh;  // of several the first
  double metres_per_unit = 1;  // of a mesh; an IGES file says its own
  std::optional<char> up;      // 'y' or 'z': the file's axis that the scene's way up is put on; unset: no turn
  double chord_error = 0;      // of the triangles that an IGES file becomes; 0: it is a mesh
  struct Morph {
    std::filesystem::path to;  // the same triangles, other places
    double start = 0, end = 1;
  };
  std::optional<Morph> morph;
  std::vector<std::filesystem::path> sequence;  // of meshes with the same triangles, the first one too
  std::vector<double> times;                    // s, ascending

  // Shapes.
  Eigen::Vector3d point{0, 0, 0}, normal{0, 0, 1};  // a plane
  Eigen::Vector3d centre{0, 0, 0}, size{0, 0, 0};   // a sphere; a box, whose edges lie along the axes
  Eigen::Vector3d from{0, 0, 0}, to{0, 0, 0};       // the axis of a cylinder or a capsule
  double radius = 0;

  Placement place;
  std::optional<PinMotion> move;
  double friction = 0.3;
  double thickness = 0;  // m
  std::string where;
};

// [contact]: how the cloth is sampled and what it meets besides obstacles.
struct SceneContact {
  bool self = false;              // the cloth meets itself
  double chord = 0.25e-3;         // m, of flat triangles from cloth that is folded to a radius of 50 mm
  std::optional<double> spacing;  // m between sampled points; unset: by `chord`
  double push_out = 0.2;          // m/s, at which cloth that starts too near is moved off
};

// The friction between two panels, or a panel and an obstacle, by their names.
struct SceneContactPair {
  std::string a, b;
  double friction = 0;
  std::string where;
};

}  // namespace toile
