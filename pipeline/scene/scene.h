// SPDX-License-Identifier: GPL-3.0-or-later
// The scene file: what is draped, of what, held where, for how long. (pipeline/scene/README.md, "The scene file")
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "analysis/constraint/point_rule.h"
#include "analysis/fabric/fabric.h"
#include "analysis/projection/limit_law.h"
#include "io/file_formats.h"
#include "io/iges.h"
#include "io/panel_file.h"
#include "pipeline/scene/addresses.h"
#include "pipeline/scene/placement.h"
#include "pipeline/scene/scene_obstacle.h"

namespace toile {

struct ScenePanel {
  std::string name;                  // a face of the file by its name, else by its order
  bool named = true;                 // false: `name` was made up, the face is taken by its order
  int order = 0;                     // of this panel among those of the scene that come from the same file
  std::filesystem::path file;        // IGES or pattern
  PanelChoice choice;                // of what the file holds: size, unit, outline
  std::optional<std::string> start;  // face of the same file and knots whose net is the initial place; else the rest
  std::optional<int> degree;
  std::optional<double> span;  // m
  std::optional<std::array<int, 2>> spans, control_points;
  std::optional<double> grain;  // rad; unset: the panel's grain line, else 0
  Placement place;              // of the rest and of the start
  Fabric fabric;
  std::string fabric_name;
  std::string where;  // "scene.toml:12", for messages
};

struct ScenePin {
  std::string panel;
  Address at;
  Eigen::Vector3d hold{1, 1, 1};  // 1: component held, 0: free
  bool clamp = false;
  std::optional<PinMotion> move;
  std::optional<double> release;  // s
  std::string where;
  bool partial() const { return hold != Eigen::Vector3d::Ones(); }
};

struct SceneTraction {
  std::string panel;
  Address along;
  Eigen::Vector3d force{0, 0, 0};  // N/m of rest length, dead
  std::string where;
};

struct SceneForce {
  std::string panel;
  Address at;
  Eigen::Vector3d force{0, 0, 0};  // N, dead
  std::string where;
};

// A side of a seam: curves of a loop, each in its own direction and one after the other, and of the line that they make
// the part between two fractions of its length; run backwards where `reverse`.
struct SeamSide {
  std::string panel;
  int loop = 0;             // the file's numbers
  std::vector<int> curves;  // at least one
  double from = 0, to = 1;
  bool reverse = false;
};
struct SceneSeam {
  SeamSide a, b;
  std::string where;
};
// How gaps between the sides of seams close.
struct SceneSewing {
  double speed = 0.5;                      // m/s, of the widest gap
  double force = 200;                      // N/m, that a seam may carry while it closes
  bool gravity = false, friction = false;  // whether they act before the seams are closed
};

// What holds the strain limit, by solver and variant of [strain_limit]: PrimalDual, Substeps, FastProjection with eqs.
// (29) to (36), LagrangeNewton.
enum class LimitSolver { newton, substeps, paper, lagrange };
const char* name(LimitSolver solver);        // "projection", "substeps" or "lagrange", as in reports
const char* setting_of(LimitSolver solver);  // what asks for it: "variant = \"paper\""
bool hard(LimitSolver solver);               // its rows have no stiffness, and no bands
bool has_law(LimitSolver solver);            // LimitLaw, an energy that other schemes can take

struct StrainLimit {
  bool on = false;
  double tolerance = 0.01;
  StrainBand weft = {}, warp = {};  // "inextensible": both tolerance, without slack
  bool stretched = false;           // whether a band limits stretch
  std::optional<double> stiffness;  // N/m of force per strain before the wall; unset: chosen by the loads
  PointRule points = PointRule::greville_derivative;  // at p = 2 the knot mesh
  LimitSolver solver = LimitSolver::newton;
  double regularisation = 1e-3;  // the default of ProjectionOptions
  int max_iterations = 50;
  double percentile = 99.9;  // of the rows' area that substeps are to keep within the limit
};

enum class ImplicitRule;  // analysis/scheme/implicit.h
enum class TimeScheme { verlet, backward_euler, bdf2, newmark };
struct NamedScheme {
  TimeScheme scheme;
  const char* name;                  // "backward-euler", as in scenes and reports
  std::optional<ImplicitRule> rule;  // its steps are ImplicitScheme's; none: they are held to the stable step
};
// In the order of TimeScheme.
std::span<const NamedScheme> time_schemes();
const NamedScheme& named_scheme(TimeScheme scheme);

// until = "rest": static equilibrium.
enum class RestMethod { relaxation, newton };
struct SceneRest {
  RestMethod method = RestMethod::relaxation;
  std::optional<double> tolerance;  // m that material points may swing when let go; unset: 1e-4 of the largest panel
  int max_steps = 1000000;
  // By Newton's method: the loads grow in so many steps, along the arc length of the path where it passes limits.
  std::optional<int> load_steps;
  bool arc_length = false;
};

struct OutputPoint {
  std::string panel;
  Eigen::Vector2d uv{0, 0};
  std::string where;
};

// The rows of history.csv.
enum class HistoryRows { off, frames, steps };

// A panel file as read_panels() gave it, and what was chosen of it.
struct ReadFile {
  PanelFile file;
  PanelChoice choice;
};

// Complete, SI, every key consumed.
struct Scene {
  std::string name;
  std::filesystem::path path;
  std::vector<ScenePanel> panels;        // empty: all panels of `panel_file`
  std::shared_ptr<const ReadFile> read;  // a panel's file that has been read already; null: none
  std::vector<ScenePin> pins;
  std::vector<SceneTraction> tractions;
  std::vector<SceneForce> forces;
  std::vector<SceneSeam> seams;
  SceneSewing sewing;
  std::vector<SceneObstacle> obstacles;
  std::vector<SceneContactPair> contact_pairs;
  SceneContact contact;
  StrainLimit strain_limit;
  Eigen::Vector3d gravity{0, 0, -9.81};  // m/s2
  Eigen::Vector3d wind{0, 0, 0};         // m/s
  std::optional<double> dt;              // s; unset: chosen from the eigenvalue bound
  TimeScheme scheme = TimeScheme::verlet;
  double energy_gain = 0.01;         // allowed unexplained growth of energy, as a share of the energy exchanged
  double until = 1;                  // s; infinite where `rest` ends the run
  std::optional<SceneRest> rest;     // set: until the cloth is at rest
  std::optional<double> time_limit;  // s of wall time for the program; unset: none
  double every = 1.0 / 30;           // s between frames
  std::vector<FileFormat> formats{FileFormat::vtu};  // of frames
  HistoryRows history = HistoryRows::frames;
  bool preview = true;
  std::vector<OutputPoint> points;
  std::vector<std::pair<std::string, std::string>> keys;  // as written: "panel.0.grain_deg", "45"
  std::vector<std::string> notes;                         // what was chosen for the user, to be said
};

// Whether steps are ImplicitScheme's.
bool implicit(const Scene& scene);
// Whether anything may touch.
bool touches(const Scene& scene);
// Unit vector against gravity; z where there is none.
Eigen::Vector3d up(const Scene& scene);

// Reads a scene; `settings` are "key.path=value" with TOML values (a value that isn't TOML is taken as a string) and
// override or add keys. Throws InputError `scene.toml:12: ...`.
Scene read_scene(const std::filesystem::path& path, std::span<const std::string> settings = {});
Scene parse_scene(std::string_view text, const std::filesystem::path& path, std::span<const std::string> settings = {});

// The scene of `toile drape panel.igs --pin ...`: every panel of the file, strain limited, each pin on every panel. A
// flat and a draped face of one name (draped.igs) make one panel that starts from the draped one.
struct QuickScene {
  std::filesystem::path file;
  PanelChoice choice;
  std::vector<std::string> pins;
  std::optional<int> degree;
  std::optional<double> span;  // m
  std::string fabric = "kidnapped";
};
Scene quick_scene(const QuickScene& request, std::span<const std::string> settings = {});
// The same of a file that has been read already, or that is nowhere on disk.
Scene quick_scene(const QuickScene& request, std::shared_ptr<const ReadFile> read,
                  std::span<const std::string> settings = {});

// Names in draped.igs: the flat face of panel "front" is "front flat", the draped one "front draped".
inline constexpr std::string_view flat_suffix = " flat";
inline constexpr std::string_view draped_suffix = " draped";

// Fabrics that need no [fabric.*] table.
struct FabricPreset {
  std::string name, about;
  Fabric fabric;
};
std::span<const FabricPreset> fabric_presets();

}  // namespace toile
