// SPDX-License-Identifier: GPL-3.0-or-later
// Building a run from a scene: files read, panels refined, trims traced, model and loads made.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "analysis/constraint/constraint_rows.h"
#include "analysis/contact/contact_proxy.h"
#include "analysis/contact/obstacle.h"
#include "analysis/map/affine_map.h"
#include "analysis/map/smooth_seam.h"
#include "analysis/model/model.h"
#include "analysis/scheme/verlet.h"
#include "geometry/trimmed_surface.h"
#include "io/iges.h"
#include "pipeline/build/seams.h"
#include "pipeline/build/trace_panel.h"
#include "pipeline/scene/scene.h"

namespace toile {

// One panel, ready. `source` has the file's own numbers and trims; `face` the refined surface and valid loops, both in
// the file's unit. Control points of `face`, of the model and of the output are the same ones, in the same order.
struct BuiltPanel : PanelTrace {  // `extra_points` with those at pinned uv points
  std::string name;
  TrimmedSurface source;
  std::vector<StrainRow> mean_rows;  // by strain_limit.points: averaged_rows()
  SmoothSeams smooth_seams;          // where the seam's control points follow those beside it
  std::vector<bool> carries_cloth;   // per control point
  std::vector<int> extended;         // control points with too little cloth that follow their neighbours
  double extension_deviation = 0;    // m, of the rest surface inside the material
};

// Everything of a run that doesn't change with pins being released.
//   (1) start satisfies `dependence`; (2) the model's points are the panels' control points, in order.
struct Build {
  Scene scene;
  std::vector<PanelFile> files;
  std::vector<BuiltPanel> panels;
  std::unique_ptr<Model> model;
  AffineMap::Matrix dependence;  // of all control points
  Eigen::VectorXd start;         // 3 n [m]
  Eigen::VectorXd mass_floor;    // n [kg]: 0.01 of density times cell area
  Loads loads;
  std::vector<std::unique_ptr<Obstacle>> obstacles;  // in the scene's order; moved by the run
  std::vector<ProxyPanel> proxies;                   // per panel; empty where nothing touches
  std::vector<BuiltSeam> seams;                      // in the scene's order
  std::vector<SewnChart> charts;                     // of the seams, where the cloth meets itself
  std::vector<std::string> warnings;
  std::vector<std::string> notes;  // decisions that say nothing against the scene or its files
  double read_seconds = 0, trim_seconds = 0;

  int panel(const std::string& name) const;  // by the scene's name; must exist
  // The rest of a panel, SI, scene axes: what the model calls unstrained.
  const NurbsSurface& rest(int panel) const { return model->panels()[static_cast<std::size_t>(panel)].rest; }
  // A panel's net out of the control points of all panels [m].
  Eigen::Matrix3Xd net(int panel, const Eigen::VectorXd& q) const { return model->net(panel, q); }
};

// `obstacles`: those of the scene where they have been built already, and what is to be said of them has been said.
// Throws InputError (files, names; all obstacles that can't be built), GeometryError (panel, loop, place; pin or
// traction on a trimmed-away place).
Build build(Scene scene, std::optional<std::vector<std::unique_ptr<Obstacle>>> obstacles = std::nullopt);

// The longest knot span of the panels at rest [m]: chords along the knot lines.
double longest_span(const Build& build);

}  // namespace toile
