// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of a run, each by itself, and a run that is stepped from outside.
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "pipeline/panels.h"
#include "pipeline/run/energy_watch.h"
#include "pipeline/run/run.h"
#include "pipeline/run/schedule.h"
#include "pipeline/run/step_control.h"

namespace toile {
namespace {

using test::Folder;

std::vector<double> targets(const Scene& scene) {
  std::vector<double> out;
  for (double t = 0, done = -1;;) {
    const auto next = Schedule{scene, t, done}.next_target();
    if (!next) break;
    out.push_back(*next);
    t = done = *next;
  }
  return out;
}

TEST(Schedule, StepsLandOnFramesAndReleasesAndOnTheEndLast) {
  Scene scene;
  scene.until = 1;
  scene.every = 0.375;
  EXPECT_EQ(targets(scene), (std::vector<double>{0, 0.375, 0.75, 1}));
  EXPECT_EQ(frame_times(scene), targets(scene));
  scene.pins.resize(2);
  scene.pins[0].release = 0.5;
  scene.pins[1].release = 0.75;
  EXPECT_EQ(targets(scene), (std::vector<double>{0, 0.375, 0.5, 0.75, 1}));
  EXPECT_EQ((Schedule{scene, 0.4, 0.375}.next_frame()), 0.75);
  EXPECT_EQ(motion_done(scene), 0.75);
  scene.pins[1].release = 2;  // after the end
  EXPECT_EQ(targets(scene), (std::vector<double>{0, 0.375, 0.5, 0.75, 1}));
}

StrainRange strained(double by) {
  return {0, by};
}

TEST(StepControl, HalvesTenTimesAndGrowsAgainLaterEachTime) {
  StepControl control;
  int halvings = 0;
  for (control.refuse(true); !control.exhausted(); control.refuse(false), ++halvings) control.scale /= 2;
  EXPECT_EQ(halvings, 10);
  const auto steps_to_double = [&] {
    const double before = control.scale;
    int steps = 0;
    for (; control.scale == before; ++steps) control.accept({}, false);
    EXPECT_EQ(control.scale, 2 * before);
    return steps;
  };
  EXPECT_EQ(steps_to_double(), 200);
  EXPECT_EQ(steps_to_double(), 200);
  control.refuse(true);
  control.refuse(false);  // the same step again
  EXPECT_EQ(steps_to_double(), 400);
}

TEST(StepControl, DampedStepsShrinkByAFifthDownToAQuarter) {
  StepControl control;
  control.accept({}, true);
  EXPECT_DOUBLE_EQ(control.scale, 0.8);
  for (int k = 0; k < 20; ++k) control.accept({}, true);
  EXPECT_EQ(control.scale, 0.25);
}

TEST(StepControl, TheBoundIsDueRarelyWhereItHoldsAndAtOnceWhereClothStiffens) {
  StepControl control;
  EXPECT_TRUE(control.bound_is_due());
  std::vector<int> waited;
  for (int k = 0; k < 4; ++k) {
    const int interval = control.bound_every;
    EXPECT_TRUE(control.begin_bound());
    control.settle_interval(interval, 1e-3, k == 0 ? 2e-3 : 1.005e-3);
    waited.push_back(0);
    for (; !control.bound_is_due(); ++waited.back()) control.accept(strained(0.01), false);
  }
  EXPECT_EQ(waited, (std::vector<int>{100, 200, 400, 400}));
  control.begin_bound();
  control.strain_at_bound = control.strain;
  control.accept(strained(0.07), false);  // 1 + 3 E: 1.21 against 1.03
  EXPECT_FALSE(control.bound_is_due());
  control.accept(strained(0.08), false);  // 1.24
  EXPECT_TRUE(control.bound_is_due());
  EXPECT_TRUE(control.stiffened());
}

// One joule at work, and a step that ends with `gained` more.
std::string judged(EnergyWatch& watch, double gained, bool careful, double dt = 1e-3) {
  EnergyBalance before;
  before.start = 1;
  before.stored.set("membrane", 1);
  StepReport report;
  report.dt = dt;
  report.kinetic = gained;
  report.elastic.energy.add("membrane", 1);
  return why_refused(watch, before, report, 1e-3, careful);
}

TEST(EnergyWatch, RefusesWhatNoWorkExplains) {
  for (const auto& [careful, allowed] : {std::pair(false, 0.05), {true, 0.005}}) {
    EnergyWatch watch;
    EXPECT_EQ(judged(watch, 0.96 * allowed, careful), "");
    EXPECT_NEAR(watch.balance, 0.96 * allowed, 1e-15);
    EnergyWatch other;
    EXPECT_NE(judged(other, 1.1 * allowed, careful).find("no matching work"), std::string::npos);
    EXPECT_EQ(other.balance, 0) << "a refused step moves nothing";
  }
  EnergyWatch watch;
  watch.balance = watch.trough = 0.18;  // gained before, in steps that passed
  EXPECT_EQ(judged(watch, 0.19, false), "");
  EXPECT_NE(judged(watch, 0.22, false).find("has grown"), std::string::npos) << "a fifth in all";
}

TEST(EnergyWatch, ASmallerStepMaySeemToGainItsKick) {
  EnergyWatch watch;
  watch.kick = 0.1;
  EXPECT_NE(judged(watch, 0.14, false), "");
  EXPECT_EQ(judged(watch, 0.14, false, 0.5e-3), "");
}

TEST(EnergyWatch, NumbersThatAreNotFiniteAreRefused) {
  StepReport report;
  report.finite = false;
  EnergyWatch watch;
  EXPECT_NE(why_refused(watch, {}, report, 0, false).find("finite"), std::string::npos);
}

Build hanging_sheet(const Folder& folder) {
  test::write_panels(folder / "panel.igs", {test::sheet("cloth")});
  return build(parse_scene(test::scene_text("[[pin]]\nat = \"corner:0,0\"\n[[pin]]\nat = \"corner:1,0\"\nrelease = "
                                            "0.02\n"),
                           folder / "scene.toml"));
}

TEST(Run, SteppedFromOutsideItEndsInTheSameBits) {
  const Folder folder("stepped");
  const Build b = hanging_sheet(folder);
  const RunResult whole = run(b);
  std::vector<double> frames;
  RunHooks hooks;
  hooks.frame = [&](const RunFrame& frame) { frames.push_back(frame.time); };
  toile::Run stepped(b, hooks);
  int calls = 0;
  for (; !stepped.finished(); ++calls) {
    const int before = stepped.now().steps;
    stepped.step();
    EXPECT_LE(stepped.now().steps, before + 1);
  }
  EXPECT_GE(calls, whole.steps);
  const RunResult end = stepped.finish();
  EXPECT_EQ(end.exit, whole.exit);
  EXPECT_EQ(end.steps, whole.steps);
  EXPECT_EQ(frames, whole.frame_times);
  EXPECT_EQ(end.state.x, whole.state.x);
  EXPECT_EQ(end.state.v, whole.state.v);
}

TEST(Run, MayBeEndedEarlyWithWhatItHas) {
  const Folder folder("ended");
  const Build b = hanging_sheet(folder);
  toile::Run early(b);
  for (int k = 0; k < 5; ++k) early.step();
  const double reached = early.now().state.t;
  EXPECT_GT(reached, 0);
  const RunResult end = early.finish();
  EXPECT_EQ(end.exit, RunExit::ok);
  EXPECT_EQ(end.time, reached);
  EXPECT_LT(end.time, b.scene.until);
  EXPECT_TRUE(early.finished());
}

}  // namespace
}  // namespace toile
