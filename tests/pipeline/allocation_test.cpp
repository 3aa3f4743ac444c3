// SPDX-License-Identifier: GPL-3.0-or-later
// What the step loop asks of the heap.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "pipeline/panels.h"
#include "pipeline/run/run.h"
#include "support/allocation_count.h"

namespace toile {
namespace {

using test::allocation_count;
using test::Folder;

// Allocations of each step of a run without frames on the way, with a step that needs no bound.
std::vector<long> allocations_by_step(const std::string& name, const std::string& pins, const std::string& more,
                                      const std::vector<std::string>& settings) {
  const Folder folder(name);
  test::write_panels(folder / "panel.igs", {test::sheet("cloth")});
  std::vector<std::string> all = settings;
  all.insert(all.begin(), {"solver.dt=5e-4", "solver.until=0.05", "output.every=1000"});
  const Build b = build(parse_scene(test::scene_text(pins, more), folder / "scene.toml", all));
  std::vector<long> counts;
  counts.reserve(100000);
  RunHooks hooks;
  hooks.progress = [&](const RunProgress&) { counts.push_back(*allocation_count()); };
  EXPECT_EQ(run(b, hooks).exit, RunExit::ok);
  for (std::size_t k = counts.size() - 1; k > 0; --k) counts[k] -= counts[k - 1];
  counts.front() = 0;
  return counts;
}

// What evaluating the step bound asks for is left out: `dt` is given, and no cloth stretches so far that it needs one.
TEST(Allocations, AStepMakesNone) {
  if (!allocation_count()) GTEST_SKIP() << "this C library doesn't count";
  const std::string pins = "[[pin]]\nat = \"corner:0,0\"\n[[pin]]\nat = \"corner:1,0\"\n";
  const std::string point = "[[pin]]\nat = \"uv:200,200\"\nmove = { translate = [0, 0, 0.01], end = 0.05 }\n";
  const std::string bare = "[fabric.kidnapped]\ndrag = 0\nbending = { b0 = 0 }\n";
  const std::string edge = "[[pin]]\nat = \"edge:v1\"\nmove = { translate = [0, 0, 0.01], end = 0.05 }\n";
  const std::vector<std::pair<std::string, std::vector<long>>> runs = {
      {"bare", allocations_by_step("bare", "", bare, {"strain_limit.mode=off"})},
      {"pins, bending and drag", allocations_by_step("bending", pins, "", {"strain_limit.mode=off"})},
      {"moved pins and wind",
       allocations_by_step("moved", edge, "[load]\nwind = [0, 0, 1]\n", {"strain_limit.mode=off"})},
      {"a limit, pins and a moved point", allocations_by_step("limit", pins + point, "", {})},
      {"until rest", allocations_by_step("rest", pins, "[load]\ngravity = [0, 0, -1]\n",
                                         {"strain_limit.mode=off", "solver.until=rest"})}};
  for (const auto& [name, counts] : runs) {
    ASSERT_GT(counts.size(), 50u) << name;
    long sum = 0;
    for (std::size_t k = 2; k < counts.size(); ++k) sum += counts[k];
    EXPECT_EQ(sum, 0) << name << ", in " << counts.size() << " steps";
  }
}

}  // namespace
}  // namespace toile
