// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/scene/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "geometry/error.h"
#include "geometry/measure.h"
#include "io/file.h"
#include "io/panel_file.h"
#include "pipeline/scene/readers.h"
#include "pipeline/scene/toml_table.h"
#include "pipeline/scene/units.h"

namespace toile {
namespace {

std::string stem_of(const std::string& name, std::string_view suffix) {
  return name.substr(0, name.size() - suffix.size());
}

std::vector<std::string> split_path(const std::string& path, const std::string& setting) {
  std::vector<std::string> parts;
  std::string part;
  for (const char c : path) {
    if (c == '.' || c == '[' || c == ']') {
      if (!part.empty()) parts.push_back(std::exchange(part, {}));
    } else {
      part += c;
    }
  }
  if (!part.empty()) parts.push_back(part);
  if (parts.empty()) throw InputError(fmt::format("--set {}: expected key=value", setting));
  return parts;
}

void assign(toml::table& root, const std::string& setting) {
  const std::size_t equals = setting.find('=');
  if (equals == std::string::npos) throw InputError(fmt::format("--set {}: expected key=value", setting));
  std::string key = setting.substr(0, equals);
  while (!key.empty() && key.back() == ' ') key.pop_back();
  const std::vector<std::string> parts = split_path(key, setting);
  const std::string value = setting.substr(equals + 1);
  if (parts.size() > deepest_key) throw InputError(fmt::format("--set: a key has more than {} parts", deepest_key));
  refuse_deep_keys(value, "--set");
  toml::table parsed;
  try {
    parsed = toml::parse("x = " + value);
    if (parsed.size() != 1) throw InputError(fmt::format("--set {}: expected one value", setting));
  } catch (const toml::parse_error&) {
    // Shells eat quotes: what isn't TOML is a string.
    parsed.insert_or_assign("x", value);
  }
  toml::node& fresh = *parsed.get("x");

  toml::node* node = &root;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const bool last = k + 1 == parts.size();
    if (toml::table* table = node->as_table()) {
      if (last) {
        table->insert_or_assign(parts[k], fresh);
        return;
      }
      toml::node* next = table->get(parts[k]);
      if (!next) {
        const bool index = parts[k + 1].find_first_not_of("0123456789") == std::string::npos;
        if (index) {
          table->insert_or_assign(parts[k], toml::array{});
        } else {
          table->insert_or_assign(parts[k], toml::table{});
        }
        next = table->get(parts[k]);
      }
      node = next;
    } else if (toml::array* array = node->as_array()) {
      std::size_t index = 0;
      const auto [end, error] = std::from_chars(parts[k].data(), parts[k].data() + parts[k].size(), index);
      if (error != std::errc() || end != parts[k].data() + parts[k].size() || index > array->size()) {
        throw InputError(fmt::format("--set {}: '{}' must be an index from 0 to {}", setting, parts[k], array->size()));
      }
      if (last) {
        if (index == array->size()) {
          array->push_back(fresh);
        } else {
          array->replace(array->cbegin() + static_cast<std::ptrdiff_t>(index), fresh);
        }
        return;
      }
      if (index == array->size()) array->push_back(toml::table{});
      node = array->get(index);
    } else {
      throw InputError(
          fmt::format("--set {}: '{}' is {}, which holds no keys", setting, parts[k - 1], type_name(*node)));
    }
  }
}

// Appends every value below a node, and empty tables and arrays, which may mean something.
void list_keys(const toml::node& node, const std::string& path,
               std::vector<std::pair<std::string, std::string>>& keys) {
  const auto below = [&](const auto& key) {
    return path.empty() ? fmt::format("{}", key) : fmt::format("{}.{}", path, key);
  };
  if (const toml::table* table = node.as_table(); table && !table->empty()) {
    for (const auto& [key, value] : *table) list_keys(value, below(key.str()), keys);
  } else if (const toml::array* array = node.as_array(); array && !array->empty()) {
    for (std::size_t k = 0; k < array->size(); ++k) list_keys((*array)[k], below(k), keys);
  } else if (node.is_string()) {
    keys.emplace_back(path, fmt::format("\"{}\"", *node.value<std::string>()));
  } else if (node.is_boolean()) {
    keys.emplace_back(path, *node.value<bool>() ? "true" : "false");
  } else if (node.is_number()) {
    keys.emplace_back(path, fmt::format("{}", *node.value<double>()));
  } else {
    keys.emplace_back(path, type_name(node));
  }
}

Fabric read_fabric(Table table) {
  Fabric fabric;
  if (const auto base = table.string("like")) {
    const auto presets = fabric_presets();
    const auto it = std::ranges::find(presets, *base, &FabricPreset::name);
    if (it == presets.end()) {
      std::vector<std::string> names;
      for (const FabricPreset& p : presets) names.push_back(p.name);
      table.fail(*table.raw().get("like"), fmt::format("unknown fabric '{}'{}", *base, suggestion(*base, names)));
    }
    fabric = it->fabric;
  }
  table.number(fabric.density, "density", dimension::area_density, Range::positive);
  table.number(fabric.thickness, "thickness", dimension::length, Range::positive);
  if (auto membrane = table.table("membrane", "membrane")) {
    membrane->number(fabric.membrane.weft, "weft", dimension::force_per_length, Range::nonnegative);
    membrane->number(fabric.membrane.warp, "warp", dimension::force_per_length, Range::nonnegative);
    membrane->number(fabric.membrane.shear, "shear", dimension::force_per_length, Range::nonnegative);
    membrane->number(fabric.membrane.coupling, "coupling", dimension::force_per_length, Range::any);
    membrane->done();
  }
  if (auto bending = table.table("bending", "bending")) {
    Fabric::Bending& law = fabric.bending;
    bending->number(law.b0, "b0", dimension::moment, Range::nonnegative);
    bending->number(law.kappa0, "kappa0", dimension::curvature, Range::positive);
    law.kappa_reg = bending->number("kappa_reg", dimension::curvature, Range::positive).value_or(law.kappa0 / 1000);
    bending->number(law.twist, "twist", dimension::moment, Range::nonnegative);
    bending->number(law.coupling, "coupling", dimension::moment, Range::any);
    if (law.kappa_reg > law.kappa0) {
      const toml::node* node = bending->raw().get("kappa_reg");
      throw InputError(fmt::format("{}: kappa_reg in bending is {} 1/m, must not exceed kappa0 = {} 1/m",
                                   node ? bending->place(*node) : bending->where(), law.kappa_reg, law.kappa0));
    }
    bending->done();
  }
  table.number(fabric.drag, "drag", dimension::area_drag, Range::nonnegative);
  table.number(fabric.friction, "friction", dimension::none, Range::nonnegative);
  if (const auto curvature = table.choice("rest_curvature", {"panel", "zero"}, {})) {
    fabric.rest_curvature = *curvature == "zero" ? RestCurvature::zero : RestCurvature::panel;
  }
  const bool isotropic_law = table.choice("law", {"weft-warp", "isotropic"}, {"orthotropic-3d"}) == "isotropic";
  const auto youngs_modulus = table.number("youngs_modulus", dimension::pressure, Range::positive);
  const auto poissons_ratio = table.number("poissons_ratio", dimension::none, Range::any);
  for (const char* key : {"youngs_modulus", "poissons_ratio"}) {
    const toml::node* node = table.raw().get(key);
    if (!isotropic_law && node) table.fail(*node, fmt::format("{} belongs to law = \"isotropic\"", key));
    if (isotropic_law && !node) table.missing(key, "law = \"isotropic\" asks for it");
  }
  if (isotropic_law) {
    for (const char* key : {"membrane", "bending"}) {
      if (const toml::node* node = table.raw().get(key))
        table.fail(
            *node,
            fmt::format("{}: law = \"isotropic\" has its stiffness from youngs_modulus, poissons_ratio and thickness",
                        key));
    }
    if (!(*poissons_ratio > -1 && *poissons_ratio <= 0.5))
      table.fail(*table.raw().get("poissons_ratio"),
                 fmt::format("poissons_ratio is {}, must be above -1 and at most 0.5", *poissons_ratio));
    const Fabric classical = isotropic(*youngs_modulus, *poissons_ratio, fabric.thickness);
    fabric.membrane = classical.membrane;
    fabric.bending = classical.bending;
  }
  table.done();
  return fabric;
}

struct Fabrics {
  std::vector<std::pair<std::string, Fabric>> named;
  std::vector<std::string> names() const {
    std::vector<std::string> result;
    for (const auto& [name, fabric] : named) result.push_back(name);
    for (const FabricPreset& preset : fabric_presets()) result.push_back(preset.name);
    return result;
  }
  const Fabric* find(const std::string& name) const {
    for (const auto& [n, fabric] : named) {
      if (n == name) return &fabric;
    }
    for (const FabricPreset& preset : fabric_presets()) {
      if (preset.name == name) return &preset.fabric;
    }
    return nullptr;
  }
};

ScenePanel read_panel(Table table, const std::filesystem::path& scene, const Fabrics& fabrics) {
  ScenePanel panel;
  panel.where = table.where();
  panel.name = table.string("name").value_or("");
  const char* key = "file";
  auto file = table.string(key);
  if (const auto pattern = table.string("pattern")) {
    if (file) table.fail(*table.raw().get("pattern"), "a panel has a file or a pattern, not both");
    file = pattern;
    key = "pattern";
  }
  if (!file)
    table.missing("file", "the IGES file (or pattern = a sewing pattern) that holds the panel, relative to the scene");
  panel.file = beside(scene, *file);
  std::error_code error;
  if (!std::filesystem::exists(panel.file, error)) {
    table.fail(*table.raw().get(key), fmt::format("{} '{}' does not exist", key, panel.file.string()));
  }
  panel.choice.size = table.string("size").value_or("");
  panel.choice.unit = table.string("unit").value_or("");
  if (const auto outline = table.choice("outline", {"cut", "sew"}, {})) panel.choice.outline = *outline;
  panel.start = table.string("start");
  if (auto refine = table.table("refine", "refine")) {
    panel.degree = refine->integer("degree", 2, 5);
    panel.span = refine->number("span", dimension::length, Range::positive);
    panel.spans = refine->integers("spans", 1, 10000);
    panel.control_points = refine->integers("control_points", 2, 10000);
    if (panel.span.has_value() + panel.spans.has_value() + panel.control_points.has_value() > 1) {
      throw InputError(refine->where() + ": refine takes one of span, spans and control_points");
    }
    refine->done();
  }
  panel.grain = table.number("grain_deg", dimension::angle, Range::any, degree_in_radians);
  if (auto place = table.table("place", "place")) panel.place = read_placement(*place);
  panel.fabric_name = table.string("fabric").value_or("kidnapped");
  const Fabric* fabric = fabrics.find(panel.fabric_name);
  if (!fabric) {
    table.fail(*table.raw().get("fabric"),
               fmt::format("unknown fabric '{}'{}", panel.fabric_name, suggestion(panel.fabric_name, fabrics.names())));
  }
  panel.fabric = *fabric;
  table.done();
  return panel;
}

// The panel that a pin, traction or output point names; may be left out where there is only one.

Address address(Table& table, const std::string& key) {
  const auto text = table.string(key);
  if (!text) table.missing(key, "an address such as corner:0,0");
  try {
    return parse_address(*text);
  } catch (const InputError& error) {
    table.fail(*table.raw().get(key), error.what());
  }
}

// 1 for each of x, y and z that is named; unset where something else is, or one twice, or nothing.
std::optional<Eigen::Vector3d> held_components(const std::string& text) {
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  for (const char c : text) {
    if (c < 'x' || c > 'z' || out[c - 'x'] != 0) return std::nullopt;
    out[c - 'x'] = 1;
  }
  return text.empty() ? std::nullopt : std::optional(out);
}

ScenePin read_pin(Table table, const std::vector<ScenePanel>& panels) {
  ScenePin pin;
  pin.where = table.where();
  pin.panel = panel_key(table, panels);
  pin.at = address(table, "at");
  if (const auto hold = table.string("hold")) {
    const auto components = held_components(*hold);
    if (!components)
      table.fail(
          *table.raw().get("hold"),
          fmt::format("hold = \"{}\": expected the components that are held, each once, such as \"xz\" or \"y\"; "
                      "leave hold out to hold all",
                      *hold));
    pin.hold = *components;
  }
  pin.clamp = table.boolean("clamp").value_or(false);
  if (auto move = table.table("move", "move")) pin.move = read_motion(*move);
  if (pin.move && pin.clamp && pin.partial()) {
    table.fail(*table.raw().get("hold"), "hold: a clamp that leaves components free can't move in this version");
  }
  pin.release = table.number("release", dimension::time, Range::nonnegative);
  table.done();
  return pin;
}

SceneTraction read_traction(Table table, const std::vector<ScenePanel>& panels) {
  SceneTraction traction;
  traction.where = table.where();
  traction.panel = panel_key(table, panels);
  traction.along = address(table, "along");
  if (traction.along.kind != Address::Kind::edge && traction.along.kind != Address::Kind::curve) {
    table.fail(*table.raw().get("along"),
               fmt::format("along = \"{}\": expected edge:... or curve:...", traction.along.text));
  }
  const auto force = table.vector<3>("force", dimension::force_per_length);
  if (!force) table.missing("force", "a vector in N/m");
  traction.force = *force;
  table.done();
  return traction;
}

SceneForce read_force(Table table, const std::vector<ScenePanel>& panels) {
  SceneForce load;
  load.where = table.where();
  load.panel = panel_key(table, panels);
  load.at = address(table, "at");
  if (load.at.kind != Address::Kind::corner && load.at.kind != Address::Kind::uv) {
    table.fail(*table.raw().get("at"), fmt::format("at = \"{}\": expected corner:... or uv:...", load.at.text));
  }
  const auto force = table.vector<3>("force", dimension::force);
  if (!force) table.missing("force", "a vector in N");
  load.force = *force;
  table.done();
  return load;
}

FileFormat frame_format(Table& table, const toml::node& entry) {
  const std::string name = entry.value<std::string>().value_or("");
  for (const NamedFormat& format : file_formats())
    if (format.of_frames && format.name == name) return format.format;
  table.fail(entry, fmt::format("unknown frame format '{}'{}", name, suggestion(name, frame_format_names())));
}

void read_output(Table table, Scene& scene) {
  table.number(scene.every, "every", dimension::time, Range::positive);
  if (const toml::node* node = table.find("formats")) {
    const toml::array* array = node->as_array();
    if (!array) table.fail(*node, "formats in [output] must be an array such as [\"iges\", \"vtu\"]");
    scene.formats.clear();
    for (const toml::node& entry : *array) scene.formats.push_back(frame_format(table, entry));
  }
  if (const auto rows = table.choice("history", {"frame", "step", "off"}, {})) {
    scene.history = *rows == "off" ? HistoryRows::off : *rows == "step" ? HistoryRows::steps : HistoryRows::frames;
  }
  if (const auto preview = table.boolean("preview")) scene.preview = *preview;
  for (Table& point : table.tables("points", "points")) {
    OutputPoint p;
    p.where = point.where();
    p.panel = panel_key(point, scene.panels);
    const auto uv = point.vector<2>("uv", dimension::none);
    if (!uv) point.missing("uv", "parameters on the panel");
    p.uv = *uv;
    point.done();
    scene.points.push_back(p);
  }
  table.done();
}

std::string scene_name(const std::filesystem::path& path) {
  const std::string stem = path.stem().string();
  if (stem != "scene") return stem;
  std::error_code gone;  // the current directory may be
  const std::string folder = std::filesystem::absolute(path, gone).lexically_normal().parent_path().filename().string();
  return folder.empty() ? stem : folder;
}

void read_settings(Table& top, Scene& scene) {
  if (auto table = top.table("strain_limit", "[strain_limit]")) read_limit(*table, scene);
  if (auto table = top.table("load", "[load]")) {
    if (const auto v = table->vector<3>("gravity", dimension::acceleration)) scene.gravity = *v;
    if (const auto v = table->vector<3>("wind", dimension::velocity)) scene.wind = *v;
    // Beyond any cloth; far beyond, energies overflow.
    constexpr double most = 1e6;
    if (scene.gravity.norm() > most || scene.wind.norm() > most)
      throw InputError(
          fmt::format("{}: gravity and wind in [load] must be below {} m/s2 and m/s", table->where(), most));
    table->done();
  }
  if (auto table = top.table("contact", "[contact]")) read_contact(*table, scene.contact);
  if (auto table = top.table("solver", "[solver]")) read_solver(*table, scene);
  if (auto table = top.table("output", "[output]")) read_output(*table, scene);
  if (!scene.rest && scene.until / scene.every > 1e6) {
    throw InputError(fmt::format("{}: until = {} s with a frame every {} s would be more than a million frames",
                                 scene.path.string(), scene.until, scene.every));
  }
  if (!scene.rest && scene.dt && scene.until / *scene.dt > 1e9) {
    throw InputError(fmt::format("{}: dt = {} s up to until = {} s would be more than a thousand million steps",
                                 scene.path.string(), *scene.dt, scene.until));
  }
}

// A release that misses a frame, another release or the end by rounding is meant to be there; the step between them
// would have no length.
void snap_releases(Scene& scene) {
  const double near = 1e-6 * std::min(scene.every, scene.until);
  std::vector<double> releases;
  for (ScenePin& pin : scene.pins) {
    if (!pin.release) continue;
    double& t = *pin.release;
    if (t < scene.until + near) {
      std::vector<double> meant = releases;
      meant.push_back(std::round(t / scene.every) * scene.every);
      meant.push_back(scene.until);
      for (const double m : meant) {
        if (std::abs(t - m) < near) t = m;
      }
    }
    releases.push_back(t);
  }
}

// A panel and all that seams join to it.
std::vector<std::string> sewn_to(const Scene& scene, const std::string& panel) {
  std::vector<std::string> out{panel};
  for (std::size_t k = 0; k < out.size(); ++k) {
    for (const SceneSeam& seam : scene.seams) {
      for (const auto& [one, other] : {std::pair(&seam.a, &seam.b), std::pair(&seam.b, &seam.a)}) {
        if (one->panel == out[k] && std::ranges::find(out, other->panel) == out.end()) out.push_back(other->panel);
      }
    }
  }
  return out;
}

// Cloth that falls for ever has no rest.
void require_pins_for_rest(const Scene& scene) {
  if (!scene.rest) return;
  for (const ScenePanel& panel : scene.panels) {
    const std::vector<std::string> garment = sewn_to(scene, panel.name);
    const auto holds = [&](const ScenePin& pin) {
      return !pin.release && std::ranges::find(garment, pin.panel) != garment.end();
    };
    const auto pulls = [&](const auto& load) { return load.panel == panel.name; };
    if (std::ranges::any_of(scene.pins, holds) || !scene.obstacles.empty()) continue;
    if (scene.gravity.isZero(0) && scene.wind.isZero(0) && std::ranges::none_of(scene.tractions, pulls) &&
        std::ranges::none_of(scene.forces, pulls))
      continue;
    throw InputError(
        fmt::format("{}: until = \"rest\", but no pin holds panel '{}' for good", panel.where, panel.name));
  }
}

Scene read_tables(toml::table& root, const std::filesystem::path& path, std::span<const std::string> settings) {
  for (const std::string& setting : settings) assign(root, setting);
  Scene scene;
  scene.path = path;
  scene.name = scene_name(path);
  Table top(root, "the scene", path.string());
  Fabrics fabrics;
  if (auto table = top.table("fabric", "[fabric]")) {
    for (const auto& [name, node] : table->raw()) {
      fabrics.named.emplace_back(name.str(),
                                 read_fabric(table->as_table(node, fmt::format("[fabric.{}]", name.str()))));
    }
  }
  for (Table& table : top.tables("panel", "[[panel]]")) {
    scene.panels.push_back(read_panel(table, path, fabrics));
    ScenePanel& panel = scene.panels.back();
    for (std::size_t k = 0; k + 1 < scene.panels.size(); ++k) {
      if (scene.panels[k].file == panel.file && scene.panels[k].choice == panel.choice) ++panel.order;
      if (!panel.name.empty() && scene.panels[k].name == panel.name) {
        throw InputError(fmt::format("{}: two panels are called '{}'", panel.where, panel.name));
      }
    }
    if (panel.name.empty()) {
      panel.named = false;
      panel.name = fmt::format("panel_{}", scene.panels.size());
    }
  }
  if (scene.panels.empty()) throw InputError(fmt::format("{}: the scene has no [[panel]]", path.string()));
  for (Table& table : top.tables("pin", "[[pin]]")) scene.pins.push_back(read_pin(table, scene.panels));
  for (Table& table : top.tables("traction", "[[traction]]")) {
    scene.tractions.push_back(read_traction(table, scene.panels));
  }
  for (Table& table : top.tables("force", "[[force]]")) scene.forces.push_back(read_force(table, scene.panels));
  read_seams(top, scene);
  read_obstacles(top, scene);
  read_contact_pairs(top, scene);
  read_settings(top, scene);
  if (touches(scene) && implicit(scene))
    throw InputError(fmt::format(
        "{}: contact goes with solver.scheme = \"verlet\" and rest.method = \"relaxation\" alone in this version",
        path.string()));
  snap_releases(scene);
  require_pins_for_rest(scene);
  top.done();
  list_keys(root, "", scene.keys);
  return scene;
}

}  // namespace

std::string panel_key(Table& table, const std::vector<ScenePanel>& panels) {
  const auto name = table.string("panel");
  if (!name) {
    if (panels.size() == 1) return panels[0].name;
    table.missing("panel", "the scene has several");
  }
  std::vector<std::string> names;
  for (const ScenePanel& panel : panels) names.push_back(panel.name);
  if (std::ranges::find(names, *name) == names.end()) {
    table.fail(*table.raw().get("panel"), fmt::format("no panel is called '{}'{}", *name, suggestion(*name, names)));
  }
  return *name;
}

Scene parse_scene(std::string_view text, const std::filesystem::path& path, std::span<const std::string> settings) {
  toml::table root = parse_toml(text, path);
  return read_tables(root, path, settings);
}

Scene read_scene(const std::filesystem::path& path, std::span<const std::string> settings) {
  return parse_scene(read_file(path), path, settings);
}

namespace {

// A span that shows how a panel of this size drapes, some 24 along its longer side, in whole millimetres; nothing where
// the file's own knots are that fine already.
std::optional<double> draping_span(const TrimmedSurface& face) {
  constexpr double spans = 24;
  const double size = bounding_box(face.surface).diagonal().maxCoeff() * face.metres_per_unit;
  const auto count = std::max(face.surface.u().spans().size(), face.surface.v().spans().size());
  if (!(size > 0) || static_cast<double>(count) >= spans / 2) return std::nullopt;
  const double millimetres = std::ceil(1000 * size / spans);
  return std::max(1.0, millimetres) / 1000;
}

}  // namespace

Scene quick_scene(const QuickScene& request, std::span<const std::string> settings) {
  return quick_scene(
      request, std::make_shared<const ReadFile>(ReadFile{read_panels(request.file, request.choice), request.choice}),
      settings);
}

Scene quick_scene(const QuickScene& request, std::shared_ptr<const ReadFile> read,
                  std::span<const std::string> settings) {
  const PanelFile& file = read->file;
  const auto has = [&](const std::string& name) {
    return std::ranges::any_of(file.panels, [&](const TrimmedSurface& face) { return face.name == name; });
  };
  const auto ends = [](const std::string& name, std::string_view suffix) {
    return name.size() > suffix.size() && std::string_view(name).substr(name.size() - suffix.size()) == suffix;
  };
  Scene scene;
  scene.read = read;
  scene.path = request.file;
  scene.name = request.file.stem().string();
  scene.strain_limit.on = true;
  for (std::size_t k = 0; k < file.panels.size(); ++k) {
    ScenePanel panel;
    panel.name = file.panels[k].name;
    panel.where = request.file.string();
    panel.file = request.file;
    panel.choice = request.choice;
    if (ends(panel.name, draped_suffix) && has(stem_of(panel.name, draped_suffix) + std::string(flat_suffix))) continue;
    if (ends(panel.name, flat_suffix) && has(stem_of(panel.name, flat_suffix) + std::string(draped_suffix))) {
      panel.start = stem_of(panel.name, flat_suffix) + std::string(draped_suffix);
    }
    const bool taken = std::ranges::any_of(scene.panels, [&](const ScenePanel& p) { return p.name == panel.name; });
    panel.named = !panel.name.empty() && !taken;
    panel.order = static_cast<int>(k);
    if (!panel.named) panel.name = fmt::format("panel_{}", k + 1);
    if (!panel.start) {
      panel.degree = request.degree;
      panel.span = request.span;
      if (!request.span) {
        if (const auto chosen = draping_span(file.panels[k])) {
          panel.span = chosen;
          scene.notes.push_back(
              fmt::format("panel '{}': refined to spans of {} mm (--span chooses others)", panel.name, 1000 * *chosen));
        }
      }
    }
    panel.fabric_name = request.fabric;
    const auto presets = fabric_presets();
    const auto preset = std::ranges::find(presets, request.fabric, &FabricPreset::name);
    if (preset == presets.end()) throw InputError(fmt::format("--fabric: unknown fabric '{}'", request.fabric));
    panel.fabric = preset->fabric;
    scene.panels.push_back(std::move(panel));
  }
  if (scene.panels.empty()) throw InputError(fmt::format("{}: holds no panel", request.file.string()));
  for (const std::string& text : request.pins) {
    for (const ScenePanel& panel : scene.panels) {
      ScenePin pin;
      pin.panel = panel.name;
      pin.at = parse_address(text);
      pin.where = "--pin " + text;
      scene.pins.push_back(std::move(pin));
    }
  }
  // The settings of a scene file's own tables apply here too.
  toml::table root;
  for (const std::string& setting : settings) assign(root, setting);
  Table top(root, "the scene", "--set");
  read_settings(top, scene);
  require_pins_for_rest(scene);
  top.done();
  for (std::size_t k = 0; k < request.pins.size(); ++k) {
    scene.keys.emplace_back(fmt::format("--pin {}", k), request.pins[k]);
  }
  scene.keys.emplace_back("--fabric", request.fabric);
  if (!request.choice.size.empty()) scene.keys.emplace_back("--size", request.choice.size);
  if (!request.choice.unit.empty()) scene.keys.emplace_back("--unit", request.choice.unit);
  if (!request.choice.outline.empty()) scene.keys.emplace_back("--outline", request.choice.outline);
  if (request.degree) scene.keys.emplace_back("--degree", fmt::format("{}", *request.degree));
  if (request.span) scene.keys.emplace_back("--span", fmt::format("{} m", *request.span));
  list_keys(root, "", scene.keys);
  return scene;
}

bool touches(const Scene& scene) {
  return scene.contact.self || !scene.obstacles.empty();
}

}  // namespace toile
