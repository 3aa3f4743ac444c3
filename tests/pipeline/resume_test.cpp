// SPDX-License-Identifier: GPL-3.0-or-later
// Runs that are stopped and taken up again.
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "geometry/error.h"
#include "pipeline/output/output.h"
#include "pipeline/panels.h"
#include "pipeline/run/checkpoint.h"
#include "pipeline/run/measures.h"

namespace toile {
namespace {

using test::Folder;

// A released pin between frames, a moved one, rows of a curve pin; the step bound is evaluated anew every 100 steps or
// more.
const std::string busy_pins =
    "[[pin]]\nat = \"curve:0,2\"\nmove = { translate = [0, 0, 0.02], end = 0.04 }\n"
    "[[pin]]\nat = \"uv:200,100\"\nrelease = 0.03\n";

std::string busy_scene() {
  std::string text = test::scene_text(busy_pins, "[load]\nwind = [0.3, 0, 1]\n");
  return text.replace(text.find("until = 0.1"), 11, "until = 0.15");
}

Build built(const Folder& folder, const std::string& scene, const TrimmedSurface& face = test::trimmed_sheet("cloth"),
            const std::vector<std::string>& settings = {}) {
  test::write_panels(folder / "panel.igs", {face});
  return build(parse_scene(scene, folder / "scene.toml", settings));
}

// Everything that a run leaves, without timings.
struct Left {
  std::string draped, checkpoint;
  nlohmann::ordered_json report;
  std::map<int, std::pair<double, Eigen::VectorXd>> frames;
};

Left left_by(const Build& b, const RunResult& result, std::map<int, std::pair<double, Eigen::VectorXd>> frames) {
  const Eigen::VectorXd q = control_points(*result.system, result.state);
  Left left{draped_file(b, q).text, format_checkpoint(scene_mark(b), result, *result.system),
            report_json(b, result, measure(b, *result.system, result.state, result.dt_last), 0), std::move(frames)};
  for (const char* timing : {"seconds", "counters", "wall_seconds", "wall_seconds_per_frame"})
    left.report.erase(timing);
  return left;
}

struct Whole {
  Left left;
  RunResult result;
  std::vector<std::string> checkpoints;  // of every place where a run can be taken up
  std::vector<std::size_t> after_frames;
};

Whole whole_run(const Build& b) {
  Whole whole;
  const SceneMark mark = scene_mark(b);
  std::map<int, std::pair<double, Eigen::VectorXd>> frames;
  RunHooks hooks;
  hooks.frame = [&](const RunFrame& frame) {
    frames[frame.number] = {frame.time, frame.q};
    whole.after_frames.push_back(whole.checkpoints.size());
  };
  hooks.resumable = [&](const RunResult& now) {
    whole.checkpoints.push_back(format_checkpoint(mark, now, *now.system));
  };
  whole.result = run(b, hooks);
  whole.left = left_by(b, whole.result, std::move(frames));
  return whole;
}

Left resumed_run(const Build& b, const std::string& checkpoint) {
  std::map<int, std::pair<double, Eigen::VectorXd>> frames;
  RunHooks hooks;
  hooks.frame = [&](const RunFrame& frame) { frames[frame.number] = {frame.time, frame.q}; };
  const RunResult result = run(b, parse_checkpoint(checkpoint, "checkpoint", b), hooks);
  return left_by(b, result, std::move(frames));
}

void expect_same_end(const Left& resumed, const Left& whole, const std::string& where) {
  EXPECT_EQ(resumed.report, whole.report) << where;
  EXPECT_TRUE(resumed.draped == whole.draped) << where;
  EXPECT_TRUE(resumed.checkpoint == whole.checkpoint) << where;
  for (const auto& [number, frame] : resumed.frames) {
    ASSERT_TRUE(whole.frames.contains(number)) << where;
    EXPECT_EQ(frame, whole.frames.at(number)) << where << ", frame " << number;
  }
}

TEST(Resume, EveryPlaceLeadsToTheSameBytes) {
  const Folder folder("resume");
  const Build b = built(folder, busy_scene());
  const Whole whole = whole_run(b);
  ASSERT_EQ(whole.result.exit, RunExit::ok) << whole.result.reason;
  ASSERT_GT(whole.result.steps, 120) << "the bound must be evaluated on the way";
  ASSERT_EQ(whole.after_frames.size(), 4u);
  const std::size_t count = whole.checkpoints.size();
  std::vector<std::size_t> places{0, 1, 2, 99, 100, 101, count - 2, count - 1};
  for (const std::size_t k : whole.after_frames) {
    for (std::size_t near = k < 3 ? 0 : k - 3; near < std::min(k + 3, count); ++near) places.push_back(near);
  }
  for (std::size_t k = 0; k < count; k += 1 + count / 25) places.push_back(k);
  for (std::size_t k = 1; k < count; ++k) {  // beside the release
    const RunResult before = parse_checkpoint(whole.checkpoints[k - 1], "a", b),
                    at = parse_checkpoint(whole.checkpoints[k], "b", b);
    if (before.assembled != at.assembled) places.insert(places.end(), {k - 2, k - 1, k, k + 1});
  }
  for (const std::size_t k : places) {
    const Left resumed = resumed_run(b, whole.checkpoints[k]);
    expect_same_end(resumed, whole.left, "place " + std::to_string(k));
    EXPECT_EQ(resumed.frames.count(3), k + 1 < count ? 1u : 0u) << "place " << k << ": the last frame is made once";
  }
}

TEST(Resume, TheLagrangeNewtonEndsWithTheSameBytes) {
  const Folder folder("resume_lagrange");
  const Build b = built(folder, busy_scene(), test::trimmed_sheet("cloth"), {"strain_limit.solver=lagrange"});
  const Whole whole = whole_run(b);
  ASSERT_EQ(whole.result.exit, RunExit::ok) << whole.result.reason;
  EXPECT_EQ(whole.result.unconverged_steps, 0);
  const std::size_t count = whole.checkpoints.size();
  for (std::size_t k = 0; k < count; k += 1 + count / 10) {
    expect_same_end(resumed_run(b, whole.checkpoints[k]), whole.left, "place " + std::to_string(k));
  }
}

// Rows beyond the limit grow stiffer on the way, which the checkpoint must know.
TEST(Resume, SubstepsEndWithTheSameBytes) {
  const Folder folder("resume_substeps");
  for (const TrimmedSurface& face : {test::sheet("cloth"), test::trimmed_sheet("cloth")}) {
    const Build b = built(folder, busy_scene(), face,
                          {"strain_limit.solver=substeps", "strain_limit.stiffness=15", "solver.until=0.3"});
    const Whole whole = whole_run(b);
    ASSERT_NE(whole.result.exit, RunExit::solver_failed) << whole.result.reason;
    EXPECT_GT(whole.result.state.constraint.stiffening.maxCoeff(), 1);
    const std::size_t count = whole.checkpoints.size();
    for (std::size_t k = 0; k < count; k += 1 + count / 10)
      expect_same_end(resumed_run(b, whole.checkpoints[k]), whole.left, "place " + std::to_string(k));
  }
}

// Cloth that stiffens as it is stretched manifold, so that steps are refused.
TEST(Resume, ImplicitStepsEndWithTheSameBytes) {
  const Folder folder("resume_implicit");
  for (const std::string scheme : {"backward-euler", "bdf2", "newmark"}) {
    const Build b = built(folder, busy_scene(), test::trimmed_sheet("cloth"), {"solver.scheme=" + scheme});
    const Whole whole = whole_run(b);
    ASSERT_EQ(whole.result.exit, RunExit::ok) << whole.result.reason;
    const std::size_t count = whole.checkpoints.size();
    for (std::size_t k = 0; k < count; k += 1 + count / 5)
      expect_same_end(resumed_run(b, whole.checkpoints[k]), whole.left, scheme + ", place " + std::to_string(k));
  }
}

TEST(Resume, AHalvedStepIsTakenUpAsItWas) {
  const Folder folder("resume_halved");
  const Build b = built(folder, test::scene_text("[[pin]]\nat = \"corner:0,0\"\n[[pin]]\nat = \"corner:1,0\"\n"),
                        test::sheet("cloth"),
                        {"strain_limit.mode=off", "load.gravity=[0,0,-300]", "solver.until=1.2", "output.every=0.6"});
  const Whole whole = whole_run(b);
  ASSERT_GT(whole.result.redone_steps, 0);
  for (std::size_t k = 0; k < whole.checkpoints.size(); ++k) {
    expect_same_end(resumed_run(b, whole.checkpoints[k]), whole.left, "place " + std::to_string(k));
  }
}

// Halts, trials and the windows in between.
TEST(Resume, ARunUntilRestEndsWithTheSameBytes) {
  const Folder folder("resume_rest");
  const Build b = built(folder, busy_scene(), test::trimmed_sheet("cloth"),
                        {"solver.until=rest", "solver.rest.tolerance=1 mm", "output.every=0.1"});
  const Whole whole = whole_run(b);
  ASSERT_EQ(whole.result.exit, RunExit::ok) << whole.result.reason;
  const std::size_t count = whole.checkpoints.size();
  ASSERT_GT(whole.result.relaxation.trials, 0);
  for (std::size_t k = 0; k < count; k += 1 + count / 12)
    expect_same_end(resumed_run(b, whole.checkpoints[k]), whole.left, "place " + std::to_string(k));
  for (const std::size_t k : {count - 3, count - 2, count - 1})
    expect_same_end(resumed_run(b, whole.checkpoints[k]), whole.left, "place " + std::to_string(k));
}

TEST(Resume, AFailedRunFailsAgainFromItsLastGoodState) {
  const Folder folder("resume_failed");
  const Build b = built(folder,
                        test::scene_text("[[pin]]\nat = \"corner:0,0\"\n[[pin]]\nat = \"corner:1,0\"\n"
                                         "move = { translate = [-0.3, 0, 0], end = 0.01 }\n"),
                        test::sheet("cloth"), {"strain_limit.solver=lagrange", "solver.dt=1e-4"});
  const Whole whole = whole_run(b);
  ASSERT_EQ(whole.result.exit, RunExit::solver_failed);
  ASSERT_TRUE(whole.result.accepted);
  const std::string checkpoint = format_checkpoint(scene_mark(b), *whole.result.accepted, *whole.result.system);
  expect_same_end(resumed_run(b, checkpoint), whole.left, "after the failure");
}

TEST(Resume, ALaterUntilGoesOn) {
  const Folder folder("resume_later");
  const Build half = built(folder, busy_scene(), test::trimmed_sheet("cloth"), {"solver.until=0.05"});
  const Whole first = whole_run(half);
  const Build b =
      built(folder, busy_scene(), test::trimmed_sheet("cloth"), {"solver.time_limit=1000", "output.every=0.05"});
  expect_same_end(resumed_run(b, first.checkpoints.back()), whole_run(b).left, "from the end of a shorter run");
}

std::string refusal(const std::string& checkpoint, const Build& b) {
  try {
    run(b, parse_checkpoint(checkpoint, "old/checkpoint", b));
  } catch (const InputError& error) {
    EXPECT_TRUE(std::string(error.what()).find("old/checkpoint: ") == 0 ||
                std::string(error.what()).find("scene.toml") != std::string::npos)
        << error.what();
    return error.what();
  }
  return "accepted";
}

TEST(Resume, AnotherSceneIsRefusedWithItsKey) {
  const Folder folder("resume_other");
  const std::string checkpoint = whole_run(built(folder, busy_scene())).checkpoints[5];
  const auto with = [&](const std::string& setting) {
    return refusal(checkpoint, built(folder, busy_scene(), test::trimmed_sheet("cloth"), {setting}));
  };
  for (const char* setting :
       {"solver.until=0.2", "solver.time_limit=3", "output.every=0.02", "output.formats=[\"obj\"]"}) {
    EXPECT_EQ(with(setting), "accepted") << setting;
  }
  for (const char* setting : {"pin.0.move.end=0.05", "load.gravity=[0,0,-9.8]", "strain_limit.tolerance=0.02",
                              "panel.0.grain_deg=10", "solver.dt=1e-4", "pin.1.release=0.04"}) {
    const std::string message = with(setting), key = std::string(setting).substr(0, std::string(setting).find('='));
    EXPECT_NE(message.find(key), std::string::npos) << setting << ": " << message;
  }
  EXPECT_NE(with("solver.until=0.0001").find("solver.until"), std::string::npos);
  TrimmedSurface face = test::trimmed_sheet("cloth");
  face.loops[0].curves[0].curve = line_segment<2>({30, 20}, {370, 20.5});
  face.loops[0].curves[1].curve = line_segment<2>({370, 20.5}, {310, 380});
  const std::string message = refusal(checkpoint, built(folder, busy_scene(), face));
  EXPECT_NE(message.find("panel.0.file"), std::string::npos) << message;
}

TEST(Resume, ADamagedCheckpointIsRefused) {
  const Folder folder("resume_damaged");
  const Build b = built(folder, busy_scene());
  const std::string good = whole_run(b).checkpoints[5];
  EXPECT_EQ(refusal(good, b), "accepted");
  EXPECT_NE(refusal("", b), "accepted");
  for (std::size_t k = 0; k < good.size(); k += 1 + k / 100) {
    EXPECT_NE(refusal(good.substr(0, k), b), "accepted") << "cut after " << k;
    std::string flipped = good;
    flipped[k] = static_cast<char>(flipped[k] ^ (1 << (k % 8)));
    EXPECT_NE(refusal(flipped, b), "accepted") << "a bit of byte " << k;
  }
  EXPECT_NE(refusal(good + "x", b), "accepted");
  EXPECT_NE(refusal("toile checkpoint 8" + good.substr(good.find('\n')), b).find("'toile checkpoint 8'"),
            std::string::npos);
  EXPECT_NE(refusal("[solver]\nuntil = 3\n", b).find("no checkpoint"), std::string::npos);
}

}  // namespace
}  // namespace toile
