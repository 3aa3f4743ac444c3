// SPDX-License-Identifier: GPL-3.0-or-later
// Runs until rest, against shapes that are known otherwise.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "geometry/error.h"
#include "pipeline/output/output.h"
#include "pipeline/panels.h"
#include "pipeline/run/checkpoint.h"
#include "pipeline/run/measures.h"
#include "pipeline/run/run.h"

namespace toile {
namespace {

using test::Folder;

struct Ended {
  RunResult run;
  std::vector<Eigen::Vector3d> points;
  nlohmann::ordered_json report;
};

Ended end_of(const Build& b) {
  Ended e{run(b), {}, {}};
  const StateMeasures m = measure(b, *e.run.system, e.run.state, e.run.dt_last);
  e.points = m.points;
  e.report = report_json(b, e.run, m, 0);
  return e;
}

Build sample(const std::string& scene, std::vector<std::string> settings) {
  for (const char* s : {"output.formats=[]", "output.preview=false"}) settings.emplace_back(s);
  return build(read_scene(std::string(TOILE_SAMPLES "/") + scene, settings));
}

// The exact tip is that of samples/studies/cantilever/elastica.csv; cubic strips are within 1 % of the length.
TEST(Rest, AClampedStripEndsAsTheHeavyElastica) {
  for (const auto& [b0, along, drop] :
       {std::tuple("7.848e-3", 0.991246, 0.123471), std::tuple("7.848e-4", 0.656354, 0.700200)}) {
    const Ended e =
        end_of(sample("studies/cantilever/scene.toml",
                      {"panel.0.refine={degree=3,spans=[8,1]}", "solver.rest.tolerance=2e-5",
                       std::string("fabric.strip.bending={kappa0=1e4,kappa_reg=1e4,twist=7.848e-4,b0=") + b0 + "}"}));
    ASSERT_EQ(e.run.exit, RunExit::ok) << e.run.reason;
    EXPECT_LT((e.points[0] - Eigen::Vector3d(0.2 * along, 0.01, -0.2 * drop)).norm(), 0.01 * 0.2);
    EXPECT_LE(e.report["rest"]["remaining"], 2e-5);
    EXPECT_EQ(e.run.energy.kinetic, 0);
  }
}

// Newton's method on the equations of equilibrium: the elastica, and the answer of relaxation.
TEST(Rest, NewtonsMethodEndsWhereRelaxationDoes) {
  const Ended strip =
      end_of(sample("studies/cantilever/scene.toml",
                    {"panel.0.refine={degree=3,spans=[8,1]}", "solver.rest={tolerance=2e-5,method='newton'}",
                     "fabric.strip.bending={kappa0=1e4,kappa_reg=1e4,twist=7.848e-4,b0=7.848e-4}"}));
  ASSERT_EQ(strip.run.exit, RunExit::ok) << strip.run.reason;
  EXPECT_LT((strip.points[0] - Eigen::Vector3d(0.2 * 0.656354, 0.01, -0.2 * 0.700200)).norm(), 0.01 * 0.2);
  EXPECT_LT(strip.run.steps, 20);
  for (const char* scene : {"kidnapped_a/scene.toml", "grid_independence/turned_30.toml"}) {
    const Ended relaxed = end_of(sample(scene, {"solver.until=rest", "solver.rest.tolerance=1e-5"}));
    const Ended newton = end_of(sample(scene, {"solver.until=rest", "solver.rest.method=newton"}));
    ASSERT_EQ(newton.run.exit, RunExit::ok) << newton.run.reason;
    EXPECT_LT(newton.run.steps, 20) << scene;
    for (const int k : {0, 1}) EXPECT_LT((newton.points[k] - relaxed.points[k]).norm(), 1e-4) << scene;
  }
}

// The same equilibria by steps of the load and of the path's length, on a net that fits and on a trimmed one.
TEST(Rest, LoadStepsEndWhereNewtonsMethodAndRelaxationDo) {
  const std::vector<std::string> linear = {
      "panel.0.refine={degree=3,spans=[8,1]}",
      "fabric.strip.bending={kappa0=1e4,kappa_reg=1e4,twist=7.848e-4,b0=7.848e-4}"};
  const auto strip = [&](const std::string& rest) {
    std::vector<std::string> settings = linear;
    settings.push_back("solver.rest=" + rest);
    return end_of(sample("studies/cantilever/scene.toml", settings));
  };
  const Ended relaxed = strip("{tolerance=1e-5}");
  for (const char* rest : {"{method='newton',load_steps=10}", "{method='newton',load_steps=10,arc_length=true}"}) {
    const Ended e = strip(rest);
    ASSERT_EQ(e.run.exit, RunExit::ok) << e.run.reason;
    EXPECT_EQ(e.report["rest"]["load_factor"], 1);
    EXPECT_EQ(e.report["rest"]["negative_eigenvalues"], 0);
    EXPECT_LT((e.points[0] - relaxed.points[0]).norm(), 1e-4) << rest;
    EXPECT_GE(e.run.steps, 8);
  }
  const std::vector<std::string> soft = {"strain_limit={mode='off'}", "pin=[{at='curve:0,0'},{at='curve:0,2'}]"};
  const auto turned = [&](const char* rest) {
    std::vector<std::string> settings = soft;
    settings.push_back(std::string("solver={until='rest',rest=") + rest + "}");
    return end_of(sample("grid_independence/turned_30.toml", settings));
  };
  const Ended swung = turned("{tolerance=1e-5}");
  for (const char* rest :
       {"{method='newton'}", "{method='newton',load_steps=5}", "{method='newton',arc_length=true}"}) {
    const Ended e = turned(rest);
    ASSERT_EQ(e.run.exit, RunExit::ok) << e.run.reason;
    for (const int k : {0, 1}) EXPECT_LT((e.points[k] - swung.points[k]).norm(), 1e-5) << rest;
  }
}

TEST(Rest, LoadStepsLandOnTheirMultiplesAndCanBeResumed) {
  const Folder folder("load_steps");
  test::write_panels(folder / "panel.igs", {test::sheet("cloth")});
  const std::vector<std::string> settings = {"solver={until='rest',rest={method='newton',load_steps=4}}",
                                             "strain_limit={mode='off'}", "panel.0.fabric=a",
                                             "fabric.a.bending={b0=0.01,kappa0=1e4,kappa_reg=1e4}"};
  const Build b = build(
      parse_scene(test::scene_text("[[pin]]\nat = \"edge:u0\"\nclamp = true\n"), folder / "scene.toml", settings));
  std::vector<double> factors;
  std::string checkpoint;
  RunHooks hooks;
  hooks.resumable = [&](const RunResult& now) {
    if (factors.empty() || factors.back() != now.path.factor) factors.push_back(now.path.factor);
    if (now.path.factor == 0.5) checkpoint = format_checkpoint(scene_mark(b), now, *now.system);
  };
  const RunResult result = run(b, hooks);
  ASSERT_EQ(result.exit, RunExit::ok) << result.reason;
  EXPECT_EQ(factors, (std::vector<double>{0, 0.25, 0.5, 0.75, 1}));
  const StateMeasures m = measure(b, *result.system, result.state, result.dt_last);
  EXPECT_NEAR(m.reactions[0].z(), 9.81 * b.model->lumped_mass().sum(), 1e-6 * m.reactions[0].z());
  const RunResult resumed = run(b, parse_checkpoint(checkpoint, "checkpoint", b));
  EXPECT_EQ(resumed.state.x, result.state.x);
  EXPECT_EQ(resumed.steps, result.steps);
}

TEST(Rest, LoadStepsSayWhatTheyCanNotFollow) {
  const Folder folder("load_steps_refused");
  test::write_panels(folder / "panel.igs", {test::sheet("cloth")});
  const auto message = [&](const std::string& pins, const std::string& rest, const char* limit) {
    try {
      parse_scene(test::scene_text(pins), folder / "scene.toml",
                  std::vector<std::string>{"solver={until='rest',rest=" + rest + "}", limit});
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  const char* off = "strain_limit={mode='off'}";
  const std::string pin = "[[pin]]\nat = \"edge:u0\"\n", steps = "{method='newton',load_steps=4}";
  EXPECT_EQ(message(pin, steps, off), "accepted");
  EXPECT_NE(message(pin, "{arc_length=true}", off).find("method = \"newton\""), std::string::npos);
  EXPECT_NE(message(pin, steps, "strain_limit={}").find("strain_limit.mode"), std::string::npos);
  EXPECT_NE(
      message(pin + "[[pin]]\nat = \"edge:u1\"\nmove = { end = 1 }\n", steps, off).find("load steps can't follow"),
      std::string::npos);
}

// Drag takes twelve seconds to stop the swing; what is left then is far below a tenth of a millimetre.
TEST(Rest, TheKidnappedClothEndsWhereDragLeavesIt) {
  const Ended still = end_of(sample("kidnapped_a/scene.toml", {"solver.until=rest"}));
  const Ended damped = end_of(sample("kidnapped_a/scene.toml", {"solver.until=12"}));
  ASSERT_EQ(still.run.exit, RunExit::ok) << still.run.reason;
  for (int k : {0, 1}) EXPECT_LT((still.points[k] - damped.points[k]).norm(), 1e-4);
}

// Frequent halts hold up the slow swing of the whole: the cloth hardly moves from window to window while its corner, by
// symmetry at y = 0 in the end, is still 30 mm away.
TEST(Rest, ASlowSwingIsNotTakenForRest) {
  for (const char* pins : {"[{at='corner:0,0'},{at='corner:1,0'}]", "[{at='corner:0,0'}]"}) {
    for (const double tolerance : {1e-2, 1e-3, 1e-4}) {
      const Ended e = end_of(sample(
          "kidnapped_a/scene.toml",
          {"solver.until=rest", "solver.rest.tolerance=" + std::to_string(tolerance), std::string("pin=") + pins}));
      ASSERT_EQ(e.run.exit, RunExit::ok) << e.run.reason;
      EXPECT_LE(e.report["rest"]["remaining"], tolerance);
      const bool one = std::string(pins).find("1,0") == std::string::npos;
      // Held at one corner the diagonal hangs in the plane x = y and swings about the pin.
      EXPECT_LT(one ? e.points[0].head<2>().norm() : std::abs(e.points[0].y()), tolerance) << pins;
    }
  }
}

const std::string hung =
    "[[pin]]\nat = \"edge:v1\"\nmove = { translate = [0, 0, 0.02], end = 0.04 }\n"
    "[[pin]]\nat = \"uv:200,100\"\nrelease = 0.03\n";

Build small(const Folder& folder, std::vector<std::string> settings = {}, const std::string& pins = hung) {
  test::write_panels(folder / "panel.igs", {test::sheet("cloth")});
  settings.insert(settings.begin(), "solver.until=rest");
  return build(parse_scene(test::scene_text(pins), folder / "scene.toml", settings));
}

TEST(Rest, IsJudgedAfterThePinsAreDone) {
  const Folder folder("rest_pins");
  const Build b = small(folder, {"output.every=0.02", "load.wind=[0,0,1]", "solver.rest.tolerance=1e-6"});
  std::vector<double> frames;
  RunHooks hooks;
  hooks.frame = [&](const RunFrame& frame) { frames.push_back(frame.time); };
  const RunResult result = run(b, hooks);
  ASSERT_EQ(result.exit, RunExit::ok) << result.reason;
  EXPECT_GT(result.time, 0.04);
  EXPECT_TRUE(result.system->place_rows == 0);
  EXPECT_EQ(frames.back(), result.time);
  EXPECT_TRUE(std::ranges::is_sorted(frames));
  // The wind pulls at cloth that stands still: the pins carry it and the weight.
  const StateMeasures m = measure(b, *result.system, result.state, result.dt_last);
  const Fabric& fabric = b.scene.panels[0].fabric;
  const double area = 0.16;
  EXPECT_NEAR(m.reactions[0].z(), area * (9.81 * fabric.density - fabric.drag), 1e-6 * area * 9.81 * fabric.density);
}

TEST(Rest, ACapOnTheStepsEndsAsAFailedCheckAndCanBeResumed) {
  const Folder folder("rest_cap");
  const Build capped = small(folder, {"solver.rest.max_steps=120"});
  std::string checkpoint;
  RunHooks hooks;
  hooks.resumable = [&](const RunResult& now) { checkpoint = format_checkpoint(scene_mark(capped), now, *now.system); };
  const RunResult first = run(capped, hooks);
  EXPECT_EQ(first.exit, RunExit::check_failed);
  EXPECT_EQ(first.relaxation.steps, 120);
  for (const char* part : {"not at rest after 120 steps", "solver.rest.max_steps"})
    EXPECT_NE(first.reason.find(part), std::string::npos) << first.reason;
  const Build b = small(folder);
  const RunResult whole = run(b), rest = run(b, parse_checkpoint(checkpoint, "checkpoint", b));
  ASSERT_EQ(whole.exit, RunExit::ok) << whole.reason;
  EXPECT_EQ(rest.exit, RunExit::ok) << rest.reason;
  EXPECT_EQ(rest.frame_times, whole.frame_times);
  EXPECT_EQ(control_points(*rest.system, rest.state), control_points(*whole.system, whole.state));
  ASSERT_TRUE(first.accepted && rest.accepted);
  EXPECT_EQ(checkpoint, format_checkpoint(scene_mark(capped), *first.accepted, *first.system));
  const RunResult again =
      run(b, parse_checkpoint(format_checkpoint(scene_mark(b), *rest.accepted, *rest.system), "checkpoint", b));
  EXPECT_EQ(again.steps, rest.steps) << "what is at rest stays";
  EXPECT_EQ(again.frame_times, rest.frame_times);
}

TEST(Rest, ADynamicRunGoesOnToRest) {
  const Folder folder("rest_after");
  const Build moving = small(folder, {"solver.until=0.05", "load.wind=[0,0,1]"});
  const RunResult first = run(moving);
  const std::string checkpoint = format_checkpoint(scene_mark(moving), first, *first.system);
  const Build b = small(folder, {"load.wind=[0,0,1]"});
  const RunResult result = run(b, parse_checkpoint(checkpoint, "checkpoint", b)), whole = run(b);
  ASSERT_EQ(result.exit, RunExit::ok) << result.reason;
  EXPECT_LT(
      (control_points(*result.system, result.state) - control_points(*whole.system, whole.state)).cwiseAbs().maxCoeff(),
      2 * rest_tolerance(b));
}

TEST(Rest, ClothThatNothingHoldsIsRefused) {
  const Folder folder("rest_refused");
  const auto refusal = [&](const std::string& pins, std::vector<std::string> settings = {}) -> std::string {
    try {
      small(folder, settings, pins);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_NE(refusal("").find("no pin holds panel 'cloth' for good"), std::string::npos) << refusal("");
  EXPECT_NE(refusal("[[pin]]\nat = \"edge:v1\"\nrelease = 3\n").find("for good"), std::string::npos);
  EXPECT_EQ(refusal("", {"load.gravity=[0,0,0]"}), "accepted");
  EXPECT_NE(refusal(hung, {"solver.rest.tolerence=1"}).find("did you mean 'tolerance'?"), std::string::npos);
  EXPECT_NE(refusal(hung, {"solver.rest.tolerance=0"}).find("must be positive"), std::string::npos);
  EXPECT_NE(refusal(hung, {"solver.rest.tolerance=1 mm", "solver.until=3"}).find("belongs to until"),
            std::string::npos);
}

TEST(Rest, NothingMovesWithoutLoads) {
  const Folder folder("rest_still");
  for (const char* pins : {"", "[[pin]]\nat = \"box:[-1,-1,-1],[1,1,1]\"\n"}) {
    const Build b = small(folder, {"load.gravity=[0,0,0]"}, pins);
    const RunResult result = run(b);
    EXPECT_EQ(result.exit, RunExit::ok) << result.reason;
    EXPECT_LT(result.steps, 1000);
    EXPECT_LT((control_points(*result.system, result.state) - b.start).cwiseAbs().maxCoeff(), 1e-12);
  }
}

}  // namespace
}  // namespace toile
