// SPDX-License-Identifier: GPL-3.0-or-later
// Scenes whose cloth meets something.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "geometry/error.h"
#include "pipeline/output/output.h"
#include "pipeline/panels.h"
#include "pipeline/run/checkpoint.h"
#include "pipeline/run/measures.h"
#include "pipeline/run/run.h"

namespace toile {
namespace {

using test::Folder;

// A sheet of 0.4 m just above what it meets.
std::string scene_over(const std::string& obstacle, const std::string& more = "") {
  return "[[panel]]\nfile = \"panel.igs\"\nplace = { translate = [-0.2, -0.2, 0.002] }\nfabric = \"soft\"\n"
         "[fabric.soft]\ndensity = 0.12\nthickness = \"1 mm\"\nmembrane = { weft = 12, warp = 12, shear = 4.8 }\n"
         "bending = { b0 = 1e-5, kappa0 = 30, kappa_reg = 0.03 }\ndrag = 0.5\n"
         "[strain_limit]\ntolerance = 0.01\n[[obstacle]]\n" +
         obstacle + "\n[solver]\nuntil = 0.3\n[output]\nformats = []\npreview = false\n" + more;
}

Build built(const Folder& folder, const std::string& text, const std::vector<std::string>& settings = {}) {
  test::write_panels(folder / "panel.igs", {test::sheet("cloth")});
  return build(parse_scene(text, folder / "scene.toml", settings));
}

nlohmann::ordered_json report_of(const Build& b, const RunResult& result) {
  return report_json(b, result, measure(b, *result.system, result.state, result.dt_last), 0);
}

const std::string ball =
    "shape = \"sphere\"\nname = \"ball\"\ncentre = [0, 0, -0.1]\nradius = \"0.1 m\"\nfriction = 0.5";
const std::string table = "shape = \"plane\"\nname = \"table\"\npoint = [0, 0, 0]\nnormal = [0, 0, 1]";

TEST(ContactScene, ATableCarriesTheCloth) {
  const Folder folder("table");
  const Build b = built(folder, scene_over(table), {"solver.until=0.8"});
  const RunResult result = run(b);
  ASSERT_EQ(result.exit, RunExit::ok) << result.reason;
  const auto report = report_of(b, result);
  const double weight = 0.4 * 0.4 * 0.12 * 9.81;
  EXPECT_NEAR(report["contact"]["obstacles"][0]["force"][2], weight, 1e-3 * weight);
  EXPECT_EQ(report["contact"]["obstacles"][0]["name"], "table");
  EXPECT_GT(report["contact"]["contacts"], 100);
  EXPECT_LT(report["contact"]["max_penetration"], 1e-4);
  EXPECT_NEAR(report["contact"]["min_distance"], 0.5e-3, 1e-4);
  EXPECT_EQ(report["stages"], nlohmann::ordered_json({"shell", "projection", "contact"}));
  // Fallen 2 mm less half its thickness: nothing of that is gained.
  EXPECT_LT(report["energy"]["injected"], 1e-4 * report["energy"]["loads_work"].get<double>());
}

// What starts inside is moved off, against the cloth's own forces: that is work, not energy from nowhere.
TEST(ContactScene, AStartInsideIsPushedOutWithAnAccountOfItsWork) {
  const Folder folder("inside");
  const Build b =
      built(folder, scene_over(ball), {"panel.0.place.translate=[-0.2, -0.2, -0.008]", "load.gravity=[0,0,0]"});
  const RunResult result = run(b);
  ASSERT_EQ(result.exit, RunExit::ok) << result.reason;
  EXPECT_LT(report_of(b, result)["contact"]["max_penetration"], 2e-4);
  EXPECT_GT(result.energy.motion_work, 0);
  EXPECT_LT(result.energy.injected, 0.01 * result.energy.motion_work);
}

TEST(ContactScene, ASceneWithoutObstaclesHasNoContact) {
  const Folder folder("nothing");
  std::string text = scene_over(table);
  text.replace(text.find("[[obstacle]]\n" + table), std::string("[[obstacle]]\n" + table).size(), "");
  const Build b = built(folder, text);
  const RunResult result = run(b);
  EXPECT_EQ(result.system->contact, nullptr);
  const auto report = report_of(b, result);
  EXPECT_TRUE(report["contact"]["max_penetration"].is_null());
  EXPECT_FALSE(report["counters"].contains("contact"));
}

TEST(ContactScene, AMovedBallLiftsTheClothAndDoesTheWork) {
  const Folder folder("lift");
  const Build b = built(folder, scene_over(ball + "\nmove = { translate = [0, 0, 0.1], end = 0.3 }"));
  const RunResult result = run(b);
  ASSERT_EQ(result.exit, RunExit::ok) << result.reason;
  const auto report = report_of(b, result);
  EXPECT_GT(report["energy"]["motion_work"], 1e-3);
  EXPECT_LT(report["contact"]["max_penetration"], 1e-4);
}

TEST(ContactScene, AStoppedRunGoesOnToTheSameBits) {
  const Folder folder("resume");
  const Build b = built(folder, scene_over(ball, "[contact]\nself = true\n"));
  std::string middle;
  RunHooks hooks;
  const SceneMark mark = scene_mark(b);
  hooks.resumable = [&](const RunResult& now) {
    if (middle.empty() && now.state.t > 0.15) middle = format_checkpoint(mark, now, *now.system);
  };
  const RunResult whole = run(b, hooks);
  write_file(folder / "checkpoint", middle);
  const RunResult resumed = run(b, read_checkpoint(folder / "checkpoint", b, nullptr), {});
  EXPECT_EQ(whole.state.x, resumed.state.x);
  auto one = report_of(b, whole), other = report_of(b, resumed);
  EXPECT_EQ(one["contact"], other["contact"]);
  EXPECT_EQ(one["energy"], other["energy"]);
}

TEST(ContactScene, PairsHaveFrictionOfTheirOwn) {
  const Folder folder("pair");
  const std::string tilted =
      "shape = \"plane\"\nname = \"slope\"\npoint = [0, 0, 0]\nnormal = [-0.3, 0, 1]\nfriction = 0.1";
  const std::string text = scene_over(tilted);
  const auto moved = [&](const std::string& more) {
    std::string at = text + more;
    at.replace(at.find("translate = [-0.2, -0.2, 0.002]"), 31,
               "translate = [-0.2, -0.2, -0.058], rotate_deg = [0, -16.7, 0]");
    const Build b = built(folder, at);
    const RunResult result = run(b);
    EXPECT_EQ(result.exit, RunExit::ok) << result.reason;
    return measure(b, *result.system, result.state, result.dt_last).largest_deflection;
  };
  const double slides = moved(""), sticks = moved("[[contact_pair]]\na = \"panel_1\"\nb = \"slope\"\nfriction = 0.6\n");
  EXPECT_GT(slides, 0.05);
  EXPECT_LT(sticks, 0.01);
}

TEST(ContactScene, ImplicitSchemesRefuseContact) {
  const Folder folder("implicit");
  test::write_panels(folder / "panel.igs", {test::sheet("cloth")});
  const std::vector<std::string> settings{"solver.scheme=bdf2"};
  EXPECT_THROW(parse_scene(scene_over(table), folder / "scene.toml", settings), InputError);
}

TEST(ContactScene, ClothMayRestOnATableWithoutPins) {
  const Folder folder("rest");
  const Build b = built(folder, scene_over(table), {"solver.until=rest", "solver.rest={tolerance=1e-3}"});
  const RunResult result = run(b);
  EXPECT_EQ(result.exit, RunExit::ok) << result.reason;
}

}  // namespace
}  // namespace toile
