// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/scene/templates.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "geometry/error.h"
#include "geometry/refine.h"
#include "io/iges.h"

namespace toile {
namespace {

using Eigen::Vector2d;

NurbsSurface sheet(Interval x, Interval y, int spans_x, int spans_y) {
  const AffinePatch plane{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0};
  return rebuild(plane, uniform_knots(2, spans_x, x), uniform_knots(2, spans_y, y));
}

std::string panel_file(TrimmedSurface face) {
  face.metres_per_unit = 1e-3;
  face.resolution = 1e-6;
  IgesHeader header;
  header.product = face.name;
  const std::string name = face.name;
  const OutputFace output{std::move(face), name, 0, std::nullopt};
  return format_iges(std::span(&output, 1), header).text;
}

std::string scene_text(const std::string& about, const std::string& panel, const std::string& pins) {
  return "# " + about + R"(
# toile drape scene.toml          lengths in metres, or with units: "20 mm", "120 g/m2", "30 deg"
# toile inspect )" +
         panel + R"(.igs --svg panel.svg     shows the loop and curve numbers that addresses use

[[panel]]
name = ")" +
         panel + R"("
file = ")" +
         panel + R"(.igs"
refine = { degree = 2, span = "40 mm" }
grain_deg = 0                                 # weft against the u direction
fabric = "cotton"

)" + fabric_tables() +
         "\n" + pins +
         R"(
[load]
gravity = [0, 0, -9.81]

[solver]
until = "0.8 s"

[output]
every = "1/30 s"
formats = ["vtu"]                             # also "iges", "obj", "glb", ...
)";
}

TrimmedSurface hang() {
  TrimmedSurface face = untrimmed(sheet({0, 600}, {0, 600}, 8, 8));
  face.name = "cloth";
  return face;
}

// A skirt panel: waist on a circular arc, straight side seams, a hem that is a parabola.
TrimmedSurface skirt() {
  TrimmedSurface face;
  face.name = "front";
  face.surface = sheet({0, 600}, {0, 600}, 8, 8);
  const Vector2d hem_left(30, 60), hem_right(570, 60), waist_left(180, 540), waist_right(420, 540);
  Eigen::Matrix2Xd hem(2, 3), waist(2, 3);
  hem << hem_left, Vector2d(300, 0), hem_right;
  waist << waist_right, Vector2d(300, 490), waist_left;
  const double w = std::cos(std::atan2(50.0, 120.0));  // half the angle that the arc turns
  TrimLoop loop;
  for (const Curve2& curve : {Curve2(uniform_knots(2, 1), hem), line_segment<2>(hem_right, waist_right),
                              Curve2(uniform_knots(2, 1), waist, {1, w, 1}), line_segment<2>(waist_left, hem_left)}) {
    TrimCurve trim;
    trim.curve = curve;
    trim.index = static_cast<int>(loop.curves.size());
    loop.curves.push_back(trim);
  }
  face.loops = {loop};
  return face;
}

}  // namespace

std::string fabric_tables() {
  return R"([fabric.cotton]
density = "120 g/m2"
thickness = "0.4 mm"
membrane = { weft = 12, warp = 12, shear = 4.8 }         # N/m; the strain limit does the rest
bending = { b0 = 5e-5, kappa0 = 30, kappa_reg = 0.03 }   # N m, 1/m, 1/m
drag = 0.25                                              # kg/(m2 s)

[strain_limit]
mode = "inextensible"                         # or "off"
tolerance = 0.01
)";
}

std::span<const SceneTemplate> scene_templates() {
  static const std::array<SceneTemplate, 2> templates = {
      SceneTemplate{"hang", "a square cloth held at two corners"},
      SceneTemplate{"skirt", "a trimmed skirt panel hung from its waist curve"},
  };
  return templates;
}

std::vector<TemplateFile> scene_template(const std::string& name) {
  if (name == "hang") {
    return {{"scene.toml", scene_text("A square cloth held at two corners.", "cloth", R"([[pin]]
panel = "cloth"
at = "corner:0,1"

[[pin]]
panel = "cloth"
at = "corner:1,1"
)")},
            {"cloth.igs", panel_file(hang())}};
  }
  if (name == "skirt") {
    return {{"scene.toml", scene_text("A skirt panel hung from its waist.", "front", R"([[pin]]
panel = "front"
at = "curve:0,2"                              # loop 0, curve 2: the waist
)")},
            {"front.igs", panel_file(skirt())}};
  }
  std::string names;
  for (const SceneTemplate& t : scene_templates()) names += (names.empty() ? "" : ", ") + t.name;
  throw InputError(fmt::format("no template is called '{}'; there are {}", name, names));
}

}  // namespace toile
