// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/run/run.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <string>

#include "geometry/error.h"
#include "pipeline/output/output.h"
#include "pipeline/panels.h"
#include "pipeline/run/measures.h"
#include "support/near.h"

namespace toile {
namespace {

using test::Folder;

Build built(const Folder& folder, const TrimmedSurface& face, const std::string& scene) {
  test::write_panels(folder / "panel.igs", {face});
  return build(parse_scene(scene, folder / "scene.toml"));
}

const std::string corner_pins = "[[pin]]\nat = \"corner:0,0\"\n[[pin]]\nat = \"corner:1,0\"\n";

TEST(Run, StepsLandOnFrames) {
  const Folder folder("frames");
  const Build b = built(folder, test::sheet("cloth"), test::scene_text(corner_pins, "") + "[load]\nwind = [0, 0, 1]\n");
  std::vector<double> times;
  RunHooks hooks;
  hooks.frame = [&](const RunFrame& frame) { times.push_back(frame.time); };
  const RunResult result = run(b, hooks);
  EXPECT_EQ(result.exit, RunExit::ok) << result.reason;
  EXPECT_EQ(times, (std::vector<double>{0, 0.05, 0.1}));
  EXPECT_EQ(result.time, 0.1);
  EXPECT_EQ(result.energy.injected, 0) << "an undriven run gains no energy";
}

TEST(Run, TheStepBoundIsAskedForLessOftenWhereItHolds) {
  const Folder folder("bounds");
  Build quiet = built(folder, test::sheet("cloth"), test::scene_text("", "[load]\ngravity = [0, 0, 0]\n"));
  Build falling =
      built(folder, test::sheet("cloth"), test::scene_text(corner_pins, "[load]\ngravity = [0, 0, -300]\n"));
  quiet.scene.until = falling.scene.until = 1.2;
  falling.scene.strain_limit.on = false;
  const RunResult at_rest = run(quiet);
  ASSERT_GT(at_rest.steps, 700);
  EXPECT_EQ(at_rest.control.bound_every, 400);

  // Cloth that stretches and folds changes its stiffness.
  double bound = 0;
  int changes = 0;
  RunHooks hooks;
  hooks.resumable = [&](const RunResult& r) {
    if (bound > 0 && std::abs(r.bound.dt / bound - 1) > 0.01) {
      ++changes;
      EXPECT_EQ(r.control.bound_every, 100);
    }
    bound = r.bound.dt;
  };
  ASSERT_EQ(run(falling, hooks).exit, RunExit::ok);
  EXPECT_GE(changes, 3);
}

// A step far above the bound: the bound holds from the start.
TEST(Run, AStepOfTheSceneThatIsUnstableIsHeldToTheBound) {
  const Folder folder("held");
  const std::string scene = test::scene_text(corner_pins);
  Build b = built(folder, test::sheet("cloth"), scene);
  for (const bool limited : {true, false}) {
    b.scene.strain_limit.on = limited;
    b.scene.until = 0.4;
    b.scene.dt = 1.0 / 30;
    const RunResult result = run(b);
    EXPECT_EQ(result.exit, RunExit::ok) << result.reason;
    EXPECT_LE(result.redone_steps, 2);
    EXPECT_GT(result.bound.dt, 0);
    EXPECT_LT(result.dt_last, result.bound.dt);
    EXPECT_LT(result.energy.injected, 0.005 * result.energy.load_work);
    ASSERT_FALSE(result.warnings.empty());
    EXPECT_NE(result.warnings.back().find("more than is stable"), std::string::npos) << result.warnings.back();
  }
  b.scene.dt = 1e-4;
  const RunResult small = run(b);
  EXPECT_EQ(small.bound.dt, 0) << "a step that is stable asks for no bound";
  expect_near_rel(small.dt_max, 1e-4, 1e-9);
  EXPECT_TRUE(small.warnings.empty());
}

// Cloth that stiffens manifold on its way: stretched to several times its length, and a gutter that springs flat.
TEST(Run, TheStepFollowsClothThatStiffens) {
  const Folder folder("stiffens");
  Build falling =
      built(folder, test::sheet("cloth"), test::scene_text(corner_pins, "[load]\ngravity = [0, 0, -300]\n"));
  falling.scene.strain_limit.on = false;
  falling.scene.until = 1.2;
  const RunResult fallen = run(falling);
  EXPECT_EQ(fallen.exit, RunExit::ok) << fallen.reason;
  EXPECT_LT(fallen.dt_min, 0.5 * fallen.dt_max);

  const KnotVector along = uniform_knots(2, 3, {0, 500}), around = uniform_knots(2, 24);
  Eigen::Matrix3Xd net(3, around.control_point_count() * along.control_point_count());
  for (int j = 0; j < along.control_point_count(); ++j)
    for (int i = 0; i < around.control_point_count(); ++i) {
      const double angle = std::numbers::pi * around.greville(i);
      net.col(i + around.control_point_count() * j) << -300 * std::cos(angle), along.greville(j),
          -300 * std::sin(angle);
    }
  TrimmedSurface gutter = untrimmed(NurbsSurface(around, along, net));
  gutter.name = "cloth";
  gutter.metres_per_unit = 1e-3;
  Build springing =
      built(folder, gutter, test::scene_text("", "[fabric.kidnapped]\nrest_curvature = \"zero\"\ndrag = 0\n"));
  springing.scene.strain_limit.on = false;
  springing.scene.until = 0.3;
  const RunResult sprung = run(springing);
  EXPECT_EQ(sprung.exit, RunExit::ok) << sprung.reason;
  EXPECT_LT(sprung.redone_steps, 10);
  const EnergyBalance& e = sprung.energy;
  expect_near_rel(e.now(), e.start + e.load_work, 0.01);
}

// Stable at the start, not where the cloth is stretched.
TEST(Run, AStepOfTheSceneIsHeldToTheBoundOfClothThatStiffens) {
  const Folder folder("named");
  Build b = built(folder, test::sheet("cloth"), test::scene_text(corner_pins, "[load]\ngravity = [0, 0, -100]\n"));
  b.scene.strain_limit.on = false;
  b.scene.until = 0.6;
  const RunResult automatic = run(b);
  ASSERT_EQ(automatic.exit, RunExit::ok) << automatic.reason;
  b.scene.dt = 0.8 * automatic.dt_max;
  const RunResult named = run(b);
  EXPECT_EQ(named.exit, RunExit::ok) << named.reason;
  EXPECT_LE(named.redone_steps, automatic.redone_steps + 1);
}

// Work of wind is energy exchanged too: a gain is compared with it where there is no other work.
TEST(Run, TheWorkOfWindIsWork) {
  const Folder folder("wind");
  Build b = built(folder, test::sheet("cloth"),
                  test::scene_text(corner_pins, "[load]\ngravity = [0, 0, 0]\nwind = [0, 0, 6]\n"));
  b.scene.strain_limit.on = false;
  b.scene.until = 1;
  const RunResult blown = run(b);
  EXPECT_EQ(blown.exit, RunExit::ok) << blown.reason;
  EXPECT_GT(blown.energy.drag_work, 0);
  EXPECT_EQ(blown.energy.load_work, 0);
  EXPECT_GT(blown.energy.injected, blown.watch.rounding) << "or nothing is judged";
}

TEST(Run, EnergyFromNowhereFailsACheck) {
  const Folder folder("gain");
  Build b = built(folder, test::sheet("cloth"), test::scene_text(corner_pins));
  b.scene.strain_limit.on = false;
  b.scene.dt = 1.0 / 30;
  b.scene.until = 0.2;
  const RunResult allowed = run(b);
  ASSERT_EQ(allowed.exit, RunExit::ok) << allowed.reason;
  const double gained = allowed.energy.injected / allowed.watch.exchanged;
  ASSERT_GT(gained, 0);
  b.scene.energy_gain = 0.9 * gained;
  const RunResult refused = run(b);
  EXPECT_EQ(refused.exit, RunExit::check_failed);
  EXPECT_NE(refused.reason.find("solver.energy_gain"), std::string::npos) << refused.reason;
  EXPECT_EQ(refused.state.x, allowed.state.x) << "the drape is the same";
}

TEST(Run, TheSameSceneGivesTheSameBytes) {
  const Folder folder("bytes");
  const Build b = built(folder, test::trimmed_sheet("cloth"), test::scene_text("[[pin]]\nat = \"curve:0,2\"\n"));
  const RunResult first = run(b), second = run(b);
  const Eigen::VectorXd q = control_points(*first.system, first.state);
  EXPECT_GT((q - b.start).norm(), 1e-3);
  EXPECT_EQ(q, control_points(*second.system, second.state));
  EXPECT_EQ(draped_file(b, q).text, draped_file(b, control_points(*second.system, second.state)).text);
}

TEST(Run, ABuildDoesNotDependOnTheHeap) {
  const Folder folder("heap");
  const std::string scene = test::scene_text("[[pin]]\nat = \"curve:0,2\"\n");
  const Build first = built(folder, test::trimmed_sheet("cloth"), scene);
  const std::vector<double>& weights = first.model->panels()[0].quadrature.weights;
  std::mt19937 random(3);
  for (int k = 0; k < 8; ++k) {
    std::vector<std::vector<char>> holes;
    for (int n = 0; n < 200; ++n) holes.emplace_back(random() % 400);
    for (int n = 0; n < 200; n += 2) holes[static_cast<std::size_t>(n)] = {};
    const Build again = built(folder, test::trimmed_sheet("cloth"), scene);
    EXPECT_EQ(again.model->panels()[0].quadrature.weights, weights);
    EXPECT_EQ(again.model->lumped_mass(), first.model->lumped_mass());
  }
}

TEST(Run, DrapedFileIsTheLastState) {
  const Folder folder("draped");
  const Build b = built(folder, test::trimmed_sheet("cloth"), test::scene_text("[[pin]]\nat = \"curve:0,2\"\n"));
  const RunResult result = run(b);
  const Eigen::VectorXd q = control_points(*result.system, result.state);
  const PanelFile file = parse_iges(draped_file(b, q).text, "draped.igs");
  ASSERT_EQ(file.panels.size(), 2u);
  const TrimmedSurface& flat = file.panels[0];
  const TrimmedSurface& draped = file.panels[1];
  EXPECT_EQ(flat.name, "cloth flat");
  EXPECT_EQ(draped.name, "cloth draped");
  EXPECT_EQ(file.metres_per_unit, 1e-3);
  ASSERT_EQ(draped.loops.size(), 1u);
  ASSERT_EQ(draped.loops[0].curves.size(), 4u);
  for (std::size_t c = 0; c < 4; ++c) {
    EXPECT_EQ(draped.loops[0].curves[c].curve.points(), b.panels[0].source.loops[0].curves[c].curve.points());
  }
  std::mt19937 random(7);
  std::uniform_real_distribution<double> in(0, 400);
  int inside = 0;
  double worst = 0, worst_flat = 0;
  while (inside < 1000) {
    const Eigen::Vector2d uv(in(random), in(random));
    if (!contains(b.panels[0].face, b.panels[0].topology, uv)) continue;
    ++inside;
    const Eigen::Vector3d x = file.metres_per_unit * draped.surface(uv.x(), uv.y());
    worst = std::max(worst, (x - b.model->state(0, uv.x(), uv.y(), q).position).norm());
    const Eigen::Vector3d f = file.metres_per_unit * flat.surface(uv.x(), uv.y());
    worst_flat = std::max(worst_flat, (f - 1e-3 * Eigen::Vector3d(uv.x(), uv.y(), 0)).norm());
  }
  EXPECT_LT(worst, 1e-12);
  EXPECT_LT(worst_flat, 1e-12);

  // Other programs see the flat panel beside the drape.
  const std::string text_of_file = draped_file(b, q).text;
  const std::size_t matrix = text_of_file.find("124,1.,0.,0.,");
  ASSERT_NE(matrix, std::string::npos);
  const double moved = std::stod(text_of_file.substr(matrix + 13));
  EXPECT_LT((flat.surface.points().row(0).maxCoeff() + moved), draped.surface.points().row(0).minCoeff());

  // It can start a new drape from where it ended.
  const Folder next("restart");
  write_file(next / "panel.igs", draped_file(b, q).text);
  std::string text = test::scene_text("[[pin]]\nat = \"curve:0,2\"\n");
  text.replace(text.find("name = \"cloth\""), 14, "name = \"cloth flat\"\nstart = \"cloth draped\"");
  const Build again = build(parse_scene(text, next / "scene.toml"));
  EXPECT_LT((again.start - q).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(run(again).exit, RunExit::ok);
}

TEST(Run, ReactionsCarryTheWeightAtRest) {
  const Folder folder("weight");
  // Hung by its top edge in its own plane, soon at rest: no swing, strong drag.
  std::string text = test::scene_text("[[pin]]\nat = \"edge:v1\"\n", "[load]\ngravity = [0, -9.81, 0]\n");
  text += "[fabric.heavy]\ndrag = 20\ndensity = 0.2\n";
  text.replace(text.find("file ="), 6, "fabric = \"heavy\"\nfile =");
  text.replace(text.find("until = 0.1"), 11, "until = 3.0");
  const Build b = built(folder, test::sheet("cloth"), text);
  const RunResult result = run(b);
  EXPECT_EQ(result.exit, RunExit::ok) << result.reason;
  const StateMeasures m = measure(b, *result.system, result.state, result.dt_last);
  expect_near_rel(m.mass, 0.2 * 0.16, 1e-12);
  expect_near_rel(m.reactions[0].y(), m.mass * 9.81, 1e-3);
  EXPECT_LT(std::abs(m.reactions[0].z()), 1e-6);
}

TEST(Run, APinMovesWhatItHoldsAndLetsItGo) {
  const Folder folder("motion");
  const std::string pins =
      "[[pin]]\nat = \"edge:v1\"\nmove = { translate = [0, 0, 0.02], end = 0.05 }\n"
      "[[pin]]\nat = \"uv:200,40\"\nrelease = 0.05\n";
  const Build b = built(folder, test::sheet("cloth"), test::scene_text(pins));
  std::vector<Eigen::Vector3d> held, edge;
  RunHooks hooks;
  hooks.frame = [&](const RunFrame& frame) {
    held.push_back(b.model->state(0, 200, 40, frame.q).position);
    edge.push_back(b.model->state(0, 130, 400, frame.q).position);
  };
  const RunResult result = run(b, hooks);
  ASSERT_EQ(result.exit, RunExit::ok) << result.reason;
  ASSERT_EQ(held.size(), 3u);
  EXPECT_LT((edge[1] - edge[0] - Eigen::Vector3d(0, 0, 0.02)).norm(), 1e-12);
  EXPECT_LT((edge[2] - edge[1]).norm(), 1e-12);
  EXPECT_LT((held[1] - held[0]).norm(), 1e-8) << "held until the release";
  EXPECT_GT((held[2] - held[1]).norm(), 1e-4) << "falls after it";
  EXPECT_EQ(result.system->place_rows, 0);
}

// Implicit steps need no bound, and end where small explicit ones do.
TEST(Run, ImplicitStepsOfAFrameEachEndWhereExplicitOnesDo) {
  const Folder folder("implicit");
  test::write_panels(folder / "panel.igs", {test::trimmed_sheet("cloth")});
  const auto end = [&](const std::string& scheme, const std::string& dt) {
    const std::vector<std::string> settings{"solver.scheme=" + scheme, "solver.dt=" + dt, "solver.until=0.2",
                                            "output.every=1/30 s", "output.points=[{ uv = [200, 100] }]"};
    const Build b =
        build(parse_scene(test::scene_text("[[pin]]\nat = \"curve:0,2\"\n"), folder / "scene.toml", settings));
    const RunResult result = run(b);
    EXPECT_EQ(result.exit, RunExit::ok) << scheme << ": " << result.reason;
    EXPECT_LE(result.last_projection.strain_violation, 0.01);
    return std::pair(b.model->state(0, 200, 100, control_points(*result.system, result.state)).position, result.steps);
  };
  const auto [exact, many] = end("verlet", "1e-4");
  for (const auto& [scheme, off] : {std::pair("backward-euler", 0.02), {"bdf2", 0.002}, {"newmark", 0.004}}) {
    const auto [place, steps] = end(scheme, "1/30 s");
    EXPECT_LT(steps, 12) << scheme;
    EXPECT_LT((place - exact).norm(), off) << scheme;
  }
}

TEST(Run, StepsAreSmallWherePinsGoFast) {
  const Folder folder("run_fast_pins");
  test::write_panels(folder / "panel.igs", {test::sheet("cloth")});
  const auto smallest = [&](const std::string& move) {
    const std::string pins = "[[pin]]\nat = \"edge:v1\"\n" + move;
    const std::vector<std::string> until{"solver.until=0.05"};
    const Build b = build(parse_scene(test::scene_text(pins), folder / "scene.toml", until));
    const RunResult result = run(b);
    EXPECT_EQ(result.exit, RunExit::ok) << result.reason;
    return std::pair(result.dt_min, longest_span(b));
  };
  const double speed = 20;  // m/s, in the mean
  const auto [still, same] = smallest("");
  const auto [moved, span] = smallest("move = { translate = [0, 0, 1], end = 0.05 }\n");
  EXPECT_GT(still, 2 * moved);
  EXPECT_LE(moved, 1.001 * 0.1 * span / speed);
}

TEST(Run, NothingMovesWithoutLoads) {
  const Folder folder("no_loads");
  for (const std::string& pins : {std::string(), corner_pins}) {
    const Build b = built(folder, test::sheet("cloth"), test::scene_text(pins, "[load]\ngravity = [0, 0, 0]\n"));
    const RunResult result = run(b);
    ASSERT_EQ(result.exit, RunExit::ok) << result.reason;
    EXPECT_LT((control_points(*result.system, result.state) - b.start).cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(Run, ClothThatIsHeldEverywhereStays) {
  const Folder folder("all_held");
  const std::string all = "[[pin]]\nat = \"box:[-1, -1, -1],[1, 1, 1]\"\n";
  for (const std::string& more : {std::string(), std::string("[[pin]]\nat = \"uv:133, 133\"\n")}) {
    const Build b = built(folder, test::sheet("cloth"), test::scene_text(all + more));
    const RunResult result = run(b);
    ASSERT_EQ(result.exit, RunExit::ok) << result.reason;
    EXPECT_EQ(control_points(*result.system, result.state), b.start);
  }
}

TEST(Run, AReleaseBesideAFrameIsAtTheFrame) {
  const Folder folder("release");
  for (const char* release : {"1e-300", "0.05000000000000001", "0.04999999999999999", "0.0999999999999999"}) {
    const Build b = built(folder, test::sheet("cloth"),
                          test::scene_text(std::string("[[pin]]\nat = \"edge:v1\"\nrelease = ") + release + "\n"));
    const RunResult result = run(b);
    ASSERT_EQ(result.exit, RunExit::ok) << release << ": " << result.reason;
    EXPECT_GT(result.dt_min, 0.1 * result.dt_max) << release;
    EXPECT_TRUE(result.system->map->fixed().empty()) << release;
  }
}

// A hard limit, and a pin that comes nearer faster than cloth can buckle.
TEST(Run, AHopelessStepEndsWithTheReason) {
  const Folder folder("hopeless");
  std::string text = test::scene_text(
      "[[pin]]\nat = \"corner:0,0\"\n[[pin]]\nat = \"corner:1,0\"\nmove = { translate = [-0.3, 0, 0], end = 0.01 }\n");
  text.replace(text.find("tolerance = 0.01"), 16, "solver = \"lagrange\"");
  text.replace(text.find("until = 0.1"), 11, "until = 0.1\ndt = 1e-4");
  const Build b = built(folder, test::sheet("cloth"), text);
  const RunResult result = run(b);
  EXPECT_EQ(result.exit, RunExit::solver_failed);
  EXPECT_TRUE(control_points(*result.system, result.state).allFinite());
  for (const char* part : {"panel 'cloth'", "cell (", "default solver", "pull too hard"}) {
    EXPECT_NE(result.reason.find(part), std::string::npos) << result.reason;
  }
}

// Gravity for ever strains what is too soft: a percentile is held or the run says that it isn't.
TEST(Run, SubstepsHoldThePercentileOrEndAsAFailedCheck) {
  const Folder folder("percentile");
  const std::string pins = "[[pin]]\nat = \"corner:0,0\"\n[[pin]]\nat = \"corner:1,0\"\n";
  const auto ended = [&](const std::string& limit) {
    std::string text = test::scene_text(pins);
    text.replace(text.find("tolerance = 0.01"), 16, "solver = \"substeps\"\n" + limit);
    const Build b = built(folder, test::sheet("cloth"), text);
    RunResult result = run(b);
    return std::pair(std::move(result.reason),
                     report_json(b, result, measure(b, *result.system, result.state, result.dt_last), 0));
  };
  const auto [fine, held] = ended("");
  EXPECT_EQ(held["exit"], "ok") << fine;
  EXPECT_EQ(held["projection"]["solver"], "substeps");
  EXPECT_EQ(held["projection"]["percentile"], 99.9);
  EXPECT_GE(held["projection"]["percentile_held"], 99.9);
  EXPECT_GT(held["projection"]["iterations_mean"], 1) << "substeps a step";
  EXPECT_LT(held["projection"]["worst_row"], 0.02);
  EXPECT_NEAR(held["projection"]["worst_row"], held["strain"]["at_constraints_max"], 1e-12);
  EXPECT_EQ(held["redone_steps"], 0);

  const auto [why, broken] = ended("stiffness = 20");
  EXPECT_EQ(broken["exit"], "check");
  EXPECT_LT(broken["projection"]["percentile_held"], 99.9);
  EXPECT_NE(why.find("strain_limit.percentile asks for 99.9 %"), std::string::npos) << why;
  const auto [none, enough] = ended("stiffness = 20\npercentile = 5");
  EXPECT_EQ(enough["exit"], "ok") << none;
}

// What moves a pin works on the cloth, by the mean of its force over the substeps.
TEST(Run, SubstepsKnowTheWorkOfMovedPins) {
  const Folder folder("substeps_moved");
  for (const char* at : {"edge:v0", "curve:0,1"}) {
    std::string text = test::scene_text(std::string("[[pin]]\nat = \"") + at +
                                        "\"\nmove = { translate = [0, 0, 0.3], start = 0, end = 0.1 }\n");
    text.replace(text.find("tolerance = 0.01"), 16, "solver = \"substeps\"\npercentile = 50");
    const RunResult result = run(built(folder, test::sheet("cloth"), text));
    ASSERT_EQ(result.exit, RunExit::ok) << at << ": " << result.reason;
    EXPECT_GT(result.energy.motion_work, 0.01) << at;
    EXPECT_LT(std::abs(result.energy.numerical()), 0.02 * result.energy.motion_work) << at;
    EXPECT_LT(result.energy.injected, 0.005 * result.energy.motion_work) << at;
  }
}

TEST(Run, StoppingLeavesAWholeResult) {
  const Folder folder("stop");
  const Build b = built(folder, test::sheet("cloth"), test::scene_text(corner_pins));
  int steps = 0;
  RunHooks hooks;
  hooks.stop = [&] { return ++steps == 3 ? RunExit::interrupted : RunExit::ok; };
  const RunResult result = run(b, hooks);
  EXPECT_EQ(result.exit, RunExit::interrupted);
  EXPECT_EQ(result.steps, 3);
  EXPECT_EQ(result.time, result.state.t);
  EXPECT_GE(result.time, 3 * result.dt_min * (1 - 1e-12));
  EXPECT_LE(result.time, 3 * result.dt_max * (1 + 1e-12));
}

// The cloth as a whole moved by d: -m g d.
TEST(Run, TheGravityPotentialIsThatOfTheMassMoved) {
  const Folder folder("potential");
  const Build b =
      built(folder, test::trimmed_sheet("cloth"), test::scene_text(corner_pins, "[load]\ngravity = [1, -2, -9]\n"));
  EXPECT_EQ(gravity_potential(b, b.start), 0);
  const Eigen::Vector3d moved(0.3, -0.2, 0.7);
  const Eigen::VectorXd q = b.start + moved.replicate(b.start.size() / 3, 1);
  const double mass = b.model->lumped_mass().sum();
  expect_near_rel(gravity_potential(b, q), -mass * Eigen::Vector3d(1, -2, -9).dot(moved), 1e-12);
}

}  // namespace
}  // namespace toile
