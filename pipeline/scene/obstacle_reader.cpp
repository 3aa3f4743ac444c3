// SPDX-License-Identifier: GPL-3.0-or-later
// [[obstacle]] and [[contact_pair]].
#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "pipeline/scene/readers.h"

namespace toile {

namespace {

constexpr double mesh_thickness = 0.003;  // m: covers the chords of a body's triangles and of the cloth's sampling
constexpr double default_chord_error = 0.00025;  // m

std::string lower_ending(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

std::filesystem::path existing(Table& table, const toml::node& node, const std::string& key, const std::string& file,
                               const std::filesystem::path& scene) {
  const std::filesystem::path path = beside(scene, file);
  std::error_code error;
  if (!std::filesystem::exists(path, error))
    table.fail(node, fmt::format("{} '{}' does not exist", key, path.string()));
  return path;
}

// sequence = ["a.obj", "b.obj"], times = [0, 1].
void read_sequence(Table& table, const std::filesystem::path& scene, SceneObstacle& obstacle) {
  const toml::node* files = table.find("sequence");
  const toml::node* times = table.find("times");
  if (!files) {
    if (times) table.fail(*times, "times in [[obstacle]] belong to sequence = [meshes]");
    return;
  }
  const toml::array* array = files->as_array();
  if (!array || array->size() < 2)
    table.fail(*files, "sequence in [[obstacle]] must be an array of two mesh files or more");
  for (const toml::node& entry : *array) {
    if (!entry.is_string()) table.fail(entry, "sequence in [[obstacle]] must be an array of mesh files");
    obstacle.sequence.push_back(existing(table, entry, "mesh", *entry.value<std::string>(), scene));
  }
  const toml::array* at = times ? times->as_array() : nullptr;
  if (!at || at->size() != array->size())
    table.fail(
        times ? *times : *files,
        fmt::format("sequence in [[obstacle]] has {} meshes: times must be an array of as many times", array->size()));
  for (const toml::node& entry : *at) {
    const double t = table.quantity(entry, "an entry of times in [[obstacle]]", dimension::time, Range::any);
    if (!obstacle.times.empty() && !(obstacle.times.back() < t))
      table.fail(entry, fmt::format("times in [[obstacle]] must ascend: {} s follows {} s", t, obstacle.times.back()));
    obstacle.times.push_back(t);
  }
  obstacle.mesh = obstacle.sequence[0];
}

void read_morph(Table& table, const std::filesystem::path& scene, SceneObstacle& obstacle) {
  auto morph = table.table("morph", "morph");
  if (!morph) return;
  SceneObstacle::Morph out;
  const auto to = morph->string("to");
  if (!to) morph->missing("to", "a mesh with the same triangles");
  out.to = existing(*morph, *morph->raw().get("to"), "to", *to, scene);
  morph->number(out.start, "start", dimension::time, Range::nonnegative);
  const auto end = morph->number("end", dimension::time, Range::positive);
  if (!end) morph->missing("end", "the time at which the mesh has its other shape");
  out.end = *end;
  if (!(out.start < out.end))
    morph->fail(*morph->raw().get("end"),
                fmt::format("end in morph is {} s, must come after start = {} s", out.end, out.start));
  morph->done();
  obstacle.morph = out;
}

void read_mesh_keys(Table& table, const std::filesystem::path& scene, SceneObstacle& obstacle) {
  if (const auto mesh = table.string("mesh"))
    obstacle.mesh = existing(table, *table.raw().get("mesh"), "mesh", *mesh, scene);
  read_sequence(table, scene, obstacle);
  const std::string ending = lower_ending(obstacle.mesh);
  const bool iges = ending == ".igs" || ending == ".iges";
  if (iges) obstacle.chord_error = default_chord_error;
  if (!obstacle.mesh.empty() && !iges)
    table.refuse("chord_error", "chord_error belongs to IGES bodies: a mesh has its triangles already");
  if (iges) {
    table.refuse("unit", "unit belongs to meshes: an IGES file says its own");
    for (const char* key : {"morph", "sequence"})
      table.refuse(key, fmt::format("{} belongs to meshes: triangles of IGES bodies don't match each other", key));
  }
  table.number(obstacle.chord_error, "chord_error", dimension::length, Range::positive);
  if (const auto unit = table.string("unit")) {
    try {
      obstacle.metres_per_unit = parse_quantity("1 " + *unit, dimension::length);
    } catch (const InputError&) {
      table.fail(*table.raw().get("unit"),
                 fmt::format("unit is \"{}\", must be a length unit such as \"m\" or \"cm\"", *unit));
    }
  }
  // The standard of glTF says +Y.
  if (ending == ".glb" || ending == ".gltf") obstacle.up = 'y';
  if (const auto up = table.choice("up", {"y", "z"}, {})) obstacle.up = (*up)[0];
  read_morph(table, scene, obstacle);
}

Eigen::Vector3d place_key(Table& table, const char* key, const char* what) {
  const auto value = table.vector<3>(key, dimension::length);
  if (!value) table.missing(key, what);
  return *value;
}

double radius_key(Table& table) {
  const auto value = table.number("radius", dimension::length, Range::positive);
  if (!value) table.missing("radius", "a length");
  return *value;
}

void read_shape_keys(Table& table, SceneObstacle& obstacle) {
  switch (obstacle.kind) {
    case ObstacleKind::mesh:
      return;
    case ObstacleKind::plane: {
      obstacle.point = place_key(table, "point", "a point of the plane");
      const auto normal = table.vector<3>("normal", dimension::none);
      if (!normal) table.missing("normal", "a direction away from what the plane bounds");
      if (!(normal->norm() > 0)) table.fail(*table.raw().get("normal"), "normal in [[obstacle]] must not be zero");
      obstacle.normal = normal->stableNormalized();
      return;
    }
    case ObstacleKind::sphere:
      obstacle.centre = place_key(table, "centre", "the middle of the sphere");
      obstacle.radius = radius_key(table);
      return;
    case ObstacleKind::cylinder:
    case ObstacleKind::capsule:
      obstacle.from = place_key(table, "from", "one end of the axis");
      obstacle.to = place_key(table, "to", "the other end of the axis");
      obstacle.radius = radius_key(table);
      if (obstacle.from == obstacle.to)
        table.fail(*table.raw().get("to"), "to in [[obstacle]] is where from is: the axis needs a length");
      return;
    case ObstacleKind::box:
      obstacle.centre = place_key(table, "centre", "the middle of the box");
      obstacle.size = place_key(table, "size", "the lengths of its edges along x, y and z");
      if (!(obstacle.size.minCoeff() > 0))
        table.fail(*table.raw().get("size"), "size in [[obstacle]] must be three lengths above 0");
      return;
  }
}

SceneObstacle read_obstacle(Table table, const std::filesystem::path& scene) {
  static const std::vector<std::string> shapes{"plane", "sphere", "cylinder", "capsule", "box"};
  SceneObstacle obstacle;
  obstacle.where = table.where();
  obstacle.name = table.string("name").value_or("");
  const auto shape = table.choice("shape", shapes, {});
  const int ways = table.raw().contains("mesh") + table.raw().contains("sequence") + shape.has_value();
  if (ways > 1) throw InputError(table.where() + ": an [[obstacle]] has one of mesh, sequence and shape");
  if (ways == 0)
    table.missing("mesh",
                  "a file of triangles or IGES faces, relative to the scene; or shape = \"plane\", \"sphere\", "
                  "\"cylinder\", \"capsule\" or \"box\"; or sequence = [meshes]");
  if (shape) {
    obstacle.kind = static_cast<ObstacleKind>(1 + (std::ranges::find(shapes, *shape) - shapes.begin()));
    for (const char* key : {"unit", "up", "chord_error", "times", "morph"})
      table.refuse(key, fmt::format("{} belongs to a mesh, not to a shape", key));
    read_shape_keys(table, obstacle);
  } else {
    read_mesh_keys(table, scene, obstacle);
    if (!obstacle.sequence.empty()) table.refuse("morph", "an [[obstacle]] has a sequence or a morph, not both");
  }
  if (auto place = table.table("place", "place")) obstacle.place = read_placement(*place);
  table.number(obstacle.friction, "friction", dimension::none, Range::nonnegative);
  obstacle.thickness = shape ? 0 : mesh_thickness;
  table.number(obstacle.thickness, "thickness", dimension::length, Range::nonnegative);
  if (auto move = table.table("move", "move")) obstacle.move = read_motion(*move);
  table.done();
  return obstacle;
}

// Names of panels and of obstacles.
std::vector<std::string> names_of(const Scene& scene) {
  std::vector<std::string> names;
  for (const ScenePanel& panel : scene.panels) names.push_back(panel.name);
  for (const SceneObstacle& obstacle : scene.obstacles) names.push_back(obstacle.name);
  return names;
}

}  // namespace

void read_obstacles(Table& top, Scene& scene) {
  for (Table& table : top.tables("obstacle", "[[obstacle]]")) {
    const bool says_thickness = table.raw().contains("thickness");
    SceneObstacle obstacle = read_obstacle(table, scene.path);
    if (obstacle.name.empty()) obstacle.name = fmt::format("obstacle_{}", scene.obstacles.size() + 1);
    const std::vector<std::string> names = names_of(scene);
    if (std::ranges::find(names, obstacle.name) != names.end())
      throw InputError(fmt::format("{}: a panel or another obstacle is called '{}'", obstacle.where, obstacle.name));
    if (!says_thickness && obstacle.thickness > 0)
      scene.notes.push_back(
          fmt::format("{}: obstacle '{}': the cloth keeps {} mm off its surface; thickness in its [[obstacle]] sets "
                      "another distance",
                      obstacle.where, obstacle.name, 1000 * obstacle.thickness));
    scene.obstacles.push_back(std::move(obstacle));
  }
}

void read_contact_pairs(Table& top, Scene& scene) {
  const std::vector<std::string> names = names_of(scene);
  const auto panel = [&](const std::string& name) {
    return std::ranges::find(scene.panels, name, &ScenePanel::name) != scene.panels.end();
  };
  for (Table& table : top.tables("contact_pair", "[[contact_pair]]")) {
    SceneContactPair pair;
    pair.where = table.where();
    for (const char* key : {"a", "b"}) {
      const auto name = table.string(key);
      if (!name) table.missing(key, "the name of a panel or an obstacle");
      if (std::ranges::find(names, *name) == names.end())
        table.fail(*table.raw().get(key),
                   fmt::format("no panel or obstacle is called '{}'{}", *name, suggestion(*name, names)));
      (*key == 'a' ? pair.a : pair.b) = *name;
    }
    if (!panel(pair.a) && !panel(pair.b))
      throw InputError(fmt::format("{}: '{}' and '{}' are obstacles both: one of a pair must be a panel", pair.where,
                                   pair.a, pair.b));
    const auto friction = table.number("friction", dimension::none, Range::nonnegative);
    if (!friction) table.missing("friction", "the friction coefficient between the two");
    pair.friction = *friction;
    for (const SceneContactPair& other : scene.contact_pairs)
      if ((other.a == pair.a && other.b == pair.b) || (other.a == pair.b && other.b == pair.a))
        throw InputError(
            fmt::format("{}: '{}' and '{}' are a pair already ({})", pair.where, pair.a, pair.b, other.where));
    table.done();
    scene.contact_pairs.push_back(std::move(pair));
  }
}

void read_contact(Table& table, SceneContact& contact) {
  contact.self = table.boolean("self").value_or(false);
  table.number(contact.chord, "chord", dimension::length, Range::positive);
  contact.spacing = table.number("spacing", dimension::length, Range::positive);
  table.number(contact.push_out, "push_out", dimension::velocity, Range::positive);
  table.done();
}

}  // namespace toile
