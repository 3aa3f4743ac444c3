// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces of every pair of degrees, whole and trimmed, through all that reads a panel file.
#include <gtest/gtest.h>

#include <array>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "pipeline/build/build.h"
#include "pipeline/convert/convert.h"
#include "pipeline/inspect/inspect.h"
#include "pipeline/panels.h"
#include "support/near.h"

namespace toile {
namespace {

using Eigen::Vector2d;

enum class Trim { none, rectangle, circle, triangle };
constexpr std::array trims{Trim::none, Trim::rectangle, Trim::circle, Trim::triangle};

TrimLoop polygon(const std::vector<Vector2d>& corners) {
  TrimLoop loop;
  for (std::size_t k = 0; k < corners.size(); ++k)
    loop.curves.push_back(
        {line_segment<2>(corners[k], corners[(k + 1) % corners.size()]), static_cast<int>(k), false, {}});
  return loop;
}

// Half a metre wide, flat and skew in space; with the area of its material [m2].
struct Panel {
  TrimmedSurface face;
  double area = 0;
};
Panel panel(int degree_u, int degree_v, int spans, Trim trim) {
  const AffinePatch plane{{3, 5, 7}, {1, 0, 0.5}, {0.2, 1, 0}, 0};
  const KnotVector u = uniform_knots(degree_u, spans, {0, 500}), v = uniform_knots(degree_v, spans, {0, 300});
  Panel out;
  out.face = untrimmed(rebuild(plane, u, v));
  out.face.name = "cloth";
  out.face.metres_per_unit = 1e-3;
  double in_plane = 500 * 300;
  switch (trim) {
    case Trim::none:
      break;
    case Trim::rectangle:
      out.face.loops = {polygon({{40, 30}, {460, 30}, {460, 270}, {40, 270}})};
      in_plane = 420 * 240;
      break;
    case Trim::circle:
      out.face.loops[0].curves = {
          {circular_arc({250, 150}, 120, 0, 2 * std::numbers::pi), 0, false, {}},
      };
      in_plane = std::numbers::pi * 120 * 120;
      break;
    case Trim::triangle:
      out.face.loops = {polygon({{20, 10}, {480, 60}, {130, 280}})};
      in_plane = (460.0 * 270 - 50 * 110) / 2;
      break;
  }
  out.face.natural_bounds = trim == Trim::none;
  out.area = in_plane * 1e-6 * plane.du.cross(plane.dv).norm();
  return out;
}

PanelFile read_back(const Panel& p) {
  const std::vector<OutputFace> faces{{p.face, p.face.name, 0, std::nullopt}};
  return parse_iges(format_iges(faces, {}).text, "panel.igs");
}

template <class Check>
void for_every_panel(Check&& check) {
  for (int degree_u = 1; degree_u <= 5; ++degree_u)
    for (int degree_v = 1; degree_v <= 5; ++degree_v)
      for (const int spans : {1, 3})
        for (const Trim trim : trims) {
          SCOPED_TRACE(testing::Message() << "degrees " << degree_u << " x " << degree_v << ", " << spans
                                          << " spans, trim " << static_cast<int>(trim));
          check(panel(degree_u, degree_v, spans, trim));
        }
}

TEST(Degrees, EveryPairIsInspectedWithItsArea) {
  for_every_panel([](const Panel& p) {
    const nlohmann::ordered_json json = inspect_json(inspect(read_back(p)));
    ASSERT_EQ(json.at("panels").size(), 1u);
    expect_near_rel(json.at("panels")[0].at("area"), p.area, 1e-9);
    EXPECT_FALSE(json.at("panels")[0].at("constraint_points").empty() && p.face.natural_bounds);
  });
}

TEST(Degrees, EveryPairGoesRoundAndIntoOtherFormats) {
  for_every_panel([](const Panel& p) {
    const PanelFile file = read_back(p);
    for (const IgesMode mode : {IgesMode::replay, IgesMode::rewrite}) EXPECT_TRUE(roundtrip(file, mode).exact());
    for (const char* out : {"out.igs", "out.obj"}) EXPECT_FALSE(convert(file, out, {}).bytes.empty()) << out;
    InspectOptions finer;
    finer.degree = std::max(p.face.surface.u().degree(), p.face.surface.v().degree());
    finer.spans = 3;
    const PanelFile again =
        parse_iges(convert(file, "out.igs", {.refine = finer, .only = {}, .up = {}}).bytes, "out.igs");
    expect_near_rel(inspect_json(inspect(again)).at("panels")[0].at("area"), p.area, 1e-9);
  });
}

TEST(Degrees, EveryPairIsBuilt) {
  const test::Folder folder("degrees");
  for_every_panel([&](const Panel& p) {
    test::write_panels(folder / "panel.igs", {p.face});
    for (const char* refinement : {"", "refine = { degree = 5 }\n"}) {
      const Build built = build(parse_scene(
          std::string("[[panel]]\nname = \"cloth\"\nfile = \"panel.igs\"\n") + refinement, folder / "scene.toml"));
      expect_near_rel(built.model->lumped_mass().sum(), built.model->panels()[0].fabric.density * p.area, 1e-9);
    }
  });
}

}  // namespace
}  // namespace toile
