// SPDX-License-Identifier: GPL-3.0-or-later
// Panels sewn to each other.
#include <gtest/gtest.h>

#include <cmath>
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

using Eigen::Vector3d;
using test::Folder;

const std::string soft =
    "[fabric.soft]\ndensity = 0.12\nthickness = \"1 mm\"\nmembrane = { weft = 12, warp = 12, shear = 4.8 }\n"
    "bending = { b0 = 1e-5, kappa0 = 30, kappa_reg = 0.03 }\ndrag = 0.5\n";

std::string panel(const std::string& name, const std::string& place) {
  return "[[panel]]\nname = \"" + name + "\"\nfile = \"panels.igs\"\nplace = { " + place + " }\nfabric = \"soft\"\n";
}
std::string seam(const std::string& a, const std::string& b) {
  return "[[seam]]\na = { " + a + " }\nb = { " + b + " }\n";
}
const std::string limit = "[strain_limit]\ntolerance = 0.01\n";
std::string until(double t) {
  return "[solver]\nuntil = " + std::to_string(t) + "\n[output]\nformats = []\npreview = false\n";
}

Build built(const Folder& folder, const std::string& text, const std::vector<TrimmedSurface>& faces,
            const std::vector<std::string>& settings = {}) {
  test::write_panels(folder / "panels.igs", faces);
  return build(parse_scene(text, folder / "scene.toml", settings));
}
Build two_sheets(const Folder& folder, const std::string& text, const std::vector<std::string>& settings = {}) {
  return built(folder, text, {test::sheet("left"), test::sheet("right")}, settings);
}

// Sheets span [0, 0.4]^2; the right edge of `left` is its curve 1, the left edge of `right` its curve 3, backwards.
const std::string right_to_left = seam("panel = \"left\", curve = 1", "panel = \"right\", curve = 3, reverse = true");

Vector3d at(const Build& b, const RunResult& r, int panel, double u, double v) {
  return apply(b.model->place(panel, u, v), control_points(*r.system, r.state));
}

TEST(Seams, TheOpeningClosesSmoothly) {
  constexpr double h = 1e-4;
  EXPECT_EQ(open_part(0), 1);
  EXPECT_EQ(open_part(1), 0);
  double fastest = 0, before = 0;
  for (int k = 0; k < 10000; ++k) {
    const double speed = (open_part(k * h) - open_part((k + 1) * h)) / h;
    EXPECT_GE(speed, -1e-9);
    EXPECT_LT(std::abs(speed - before), 10 * h);  // an acceleration without jumps
    fastest = std::max(fastest, speed);
    before = speed;
  }
  EXPECT_NEAR(fastest, 1.875, 1e-3);
}

TEST(Seams, TwoSheetsSewnHangAsOne) {
  const Folder folder("sewn");
  const std::string pins =
      "[[pin]]\npanel = \"left\"\nat = \"corner:0,0\"\n[[pin]]\npanel = \"left\"\nat = \"corner:0,1\"\n";
  const Build two = two_sheets(
      folder,
      panel("left", "") + panel("right", "translate = [0.4, 0, 0]") + soft + pins + right_to_left + limit + until(0.4),
      {"panel.0.refine.span=0.04", "panel.1.refine.span=0.04"});
  const AffinePatch plane{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0};
  TrimmedSurface whole = untrimmed(rebuild(plane, uniform_knots(2, 20, {0, 800}), uniform_knots(2, 10, {0, 400})));
  whole.name = "left";
  whole.metres_per_unit = 1e-3;
  const Folder other("whole");
  const Build one = built(other, panel("left", "") + soft + pins + limit + until(0.4), {whole});
  const RunResult sewn = run(two), grown = run(one);
  ASSERT_EQ(sewn.exit, RunExit::ok) << sewn.reason;
  ASSERT_EQ(grown.exit, RunExit::ok) << grown.reason;
  EXPECT_LT(at(one, grown, 0, 800, 200).z(), -0.1);
  for (const double u : {0.0, 200.0, 400.0})
    for (const double v : {0.0, 100.0, 400.0}) {
      EXPECT_LT((at(two, sewn, 0, u, v) - at(one, grown, 0, u, v)).norm(), 1e-3) << u << " " << v;
      EXPECT_LT((at(two, sewn, 1, u, v) - at(one, grown, 0, 400 + u, v)).norm(), 1e-3) << u << " " << v;
    }
  const auto m = measure(two, *sewn.system, sewn.state, sewn.dt_last);
  ASSERT_EQ(m.seams.size(), 1u);
  EXPECT_LT(m.seams[0].gap, 1e-6);
  const double weight = 0.4 * 0.12 * 9.81;  // N/m of the sheet that hangs below
  EXPECT_GT(m.seams[0].mean_force, 0.2 * weight);
  EXPECT_LT(m.seams[0].mean_force, 3 * weight);
}

TEST(Seams, AGapClosesWithoutGravityAndThenHangs) {
  const Folder folder("gap");
  const Build b =
      two_sheets(folder, panel("left", "") + panel("right", "translate = [0.5, 0, 0.02]") + soft +
                             "[[pin]]\npanel = \"left\"\nat = \"edge:u0\"\n" + right_to_left + limit + until(0.6));
  const double gap = std::hypot(0.1, 0.02);
  toile::Run steps(b);
  double lowest = 0;
  do {
    steps.step();
    lowest = std::min(lowest, at(b, steps.now(), 1, 400, 200).z());
  } while (!steps.finished() && !steps.now().sewing.done());
  const double closed_at = 1.875 * gap / 0.5;
  EXPECT_GT(steps.now().sewn, closed_at);
  EXPECT_LT(steps.now().sewn, closed_at + 0.2);
  EXPECT_GT(lowest, -0.03) << "gravity waits";
  const auto closed = measure(b, *steps.now().system, steps.now().state, steps.now().dt_last);
  EXPECT_LT(closed.seams[0].gap, 1e-6);
  while (!steps.finished()) steps.step();
  const RunResult end = steps.finish();
  ASSERT_EQ(end.exit, RunExit::ok) << end.reason;
  const auto m = measure(b, *end.system, end.state, end.dt_last);
  EXPECT_LT(m.seams[0].gap, 1e-6);
  EXPECT_LT(at(b, end, 1, 400, 200).z(), -0.05);
}

// Rows along a trim are as many as both nets can follow: the seam closes between them and doesn't lock.
TEST(Seams, CurvedTrimsMeetAndStayFree) {
  const Folder folder("waist");
  const std::string text = panel("left", "") + panel("right", "translate = [0, 0, 0.05]") + soft +
                           "[[pin]]\npanel = \"left\"\nat = \"curve:0,0\"\n" +
                           seam("panel = \"left\", curve = 2", "panel = \"right\", curve = 2") + limit + until(0.4);
  const Build b = built(folder, text, {test::trimmed_sheet("left"), test::trimmed_sheet("right")},
                        {"panel.0.refine.span=0.02", "panel.1.refine.span=0.025"});
  const RunResult end = run(b);
  ASSERT_EQ(end.exit, RunExit::ok) << end.reason;
  const auto m = measure(b, *end.system, end.state, end.dt_last);
  EXPECT_LT(m.seams[0].gap, 0.5e-3);
}

TEST(Seams, PinsOnASewnEdgeAndSeamsThatMeetInACorner) {
  const Folder folder("corner");
  // Four sheets around a point, the pin on it, and one seam sewn twice.
  const std::string text =
      panel("a", "") + panel("b", "translate = [0.4, 0, 0]") + panel("c", "translate = [0.4, 0.4, 0]") +
      panel("d", "translate = [0, 0.4, 0]") + soft +
      seam("panel = \"a\", curve = 1", "panel = \"b\", curve = 3, reverse = true") +
      seam("panel = \"b\", curve = 2", "panel = \"c\", curve = 0, reverse = true") +
      seam("panel = \"c\", curve = 3", "panel = \"d\", curve = 1, reverse = true") +
      seam("panel = \"d\", curve = 0", "panel = \"a\", curve = 2, reverse = true") +
      seam("panel = \"d\", curve = 0", "panel = \"a\", curve = 2, reverse = true") +
      "[[pin]]\npanel = \"a\"\nat = \"corner:1,1\"\n[[pin]]\npanel = \"b\"\nat = \"corner:0,1\"\n" + limit + until(0.2);
  const Build b = built(folder, text, {test::sheet("a"), test::sheet("b"), test::sheet("c"), test::sheet("d")});
  const RunResult end = run(b);
  ASSERT_EQ(end.exit, RunExit::ok) << end.reason;
  const auto m = measure(b, *end.system, end.state, end.dt_last);
  for (const SeamMeasures& s : m.seams) EXPECT_LT(s.gap, 1e-5);
  EXPECT_LT(at(b, end, 2, 400, 400).z(), -0.05);
}

TEST(Seams, AGatherPairsByLength) {
  const Folder folder("gather");
  const std::string text =
      panel("left", "") + panel("right", "translate = [0.5, 0, 0]") + soft +
      "[[pin]]\npanel = \"left\"\nat = \"edge:u0\"\n" +
      seam("panel = \"left\", curve = 1, from = 0.2, to = 0.7", "panel = \"right\", curve = 3, reverse = true") +
      limit + until(0.7);
  const Build b = two_sheets(folder, text, {"panel.1.refine.span=0.02", "panel.0.refine.span=0.02"});
  EXPECT_NEAR(b.seams[0].length_a, 0.2, 1e-9);
  EXPECT_NEAR(b.seams[0].length_b, 0.4, 1e-9);
  ASSERT_EQ(std::ranges::count_if(b.warnings, [](const std::string& w) { return w.find("gathered 2 to 1") != w.npos; }),
            1);
  for (const SeamPlace& p : b.seams[0].along) {
    EXPECT_NEAR(p.a.y(), 400 * (0.2 + 0.5 * p.fraction), 1e-6);
    EXPECT_NEAR(p.b.y(), 400 * p.fraction, 1e-6);
  }
  const RunResult end = run(b);
  ASSERT_EQ(end.exit, RunExit::ok) << end.reason;
  // Closed at the rows; between them, 40 mm apart on the longer side, it goes in waves.
  const Eigen::VectorXd q = control_points(*end.system, end.state);
  for (const SeamPlace& p : b.seams[0].rows) EXPECT_LT(apply(p.row, q).norm(), 1e-6);
  const double waves = measure(b, *end.system, end.state, end.dt_last).seams[0].gap;
  EXPECT_GT(waves, 5e-3);
  EXPECT_LT(waves, 20e-3);
}

TEST(Seams, ARunWithSeamsIsResumedToTheBit) {
  const Folder folder("resume");
  const std::string text = panel("left", "") + panel("right", "translate = [0.45, 0, 0.02]") + soft +
                           "[[pin]]\npanel = \"left\"\nat = \"edge:u0\"\n" + right_to_left + limit + until(0.6);
  const Build b = two_sheets(folder, text);
  // Before the gap is closed.
  std::string middle;
  RunHooks hooks;
  const SceneMark mark = scene_mark(b);
  hooks.resumable = [&](const RunResult& now) {
    if (middle.empty() && !now.sewing.done() && now.sewing.progress[0] > 0.5)
      middle = format_checkpoint(mark, now, *now.system);
  };
  const RunResult whole = run(b, hooks);
  write_file(folder / "checkpoint", middle);
  const RunResult resumed = run(b, read_checkpoint(folder / "checkpoint", b, nullptr), {});
  EXPECT_EQ(whole.state.x, resumed.state.x);
  EXPECT_EQ(whole.state.v, resumed.state.v);
}

// Edges that are both held can't come together: the seam pulls as hard as it may, then the run goes on without it.
TEST(Seams, ASeamThatCantCloseWaitsAndSaysSo) {
  const Folder folder("small");
  const Build b = two_sheets(folder, panel("left", "") + panel("right", "translate = [0.43, 0, 0]") + soft +
                                         "[[pin]]\npanel = \"left\"\nat = \"edge:u0\"\n"
                                         "[[pin]]\npanel = \"right\"\nat = \"edge:u1\"\n" +
                                         right_to_left + limit + until(1));
  const RunResult end = run(b);
  ASSERT_EQ(end.exit, RunExit::check_failed);
  EXPECT_NE(end.reason.find("seam 0"), std::string::npos) << end.reason;
  EXPECT_LT(end.sewing.progress[0], 1);
  EXPECT_GT(end.sewn, 0.3);
  const auto m = measure(b, *end.system, end.state, end.dt_last);
  EXPECT_GT(m.seams[0].gap, 0.02);
  EXPECT_LT(m.seams[0].mean_force, 300);
}

TEST(Seams, BadSeamsAreRefusedWithTheirPlace) {
  const Folder folder("bad");
  const auto message = [&](const std::string& seams) {
    try {
      two_sheets(folder, panel("left", "") + panel("right", "translate = [0.4, 0, 0]") + soft +
                             "[[pin]]\npanel = \"left\"\nat = \"edge:u0\"\n" + seams + limit + until(0.1));
    } catch (const std::exception& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_NE(message(seam("panel = \"left\", curve = 9", "panel = \"right\", curve = 3"))
                .find("seam 0: loop 0 of panel "
                      "'left' has curves 0 to 3"),
            std::string::npos);
  EXPECT_NE(message(seam("panel = \"left\", curve = 1", "panel = \"left\", curve = 1")).find("with itself"),
            std::string::npos);
  EXPECT_NE(message(seam("panel = \"left\", curve = 1", "panel = \"sleeve\", curve = 1")).find("no panel is called"),
            std::string::npos);
}

}  // namespace
}  // namespace toile
