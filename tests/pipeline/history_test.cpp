// SPDX-License-Identifier: GPL-3.0-or-later
// history.csv, row by row.
#include "pipeline/output/history.h"

#include <gtest/gtest.h>

#include <map>
#include <sstream>

#include "pipeline/panels.h"
#include "pipeline/run/checkpoint.h"
#include "pipeline/run/measures.h"

namespace toile {
namespace {

using test::Folder;

const std::string output = "points = [{ panel = \"cloth\", uv = [200, 100] }]\n";

Build built(const Folder& folder, const std::vector<std::string>& settings = {}) {
  test::write_panels(folder / "panel.igs", {test::trimmed_sheet("cloth")});
  const std::string scene =
      test::scene_text("[[pin]]\nat = \"curve:0,2\"\n[[pin]]\nat = \"uv:200,100\"\nrelease = 0.03\n", output);
  return build(parse_scene(scene, folder / "scene.toml", settings));
}

struct Table {
  std::vector<std::string> names;
  std::vector<std::map<std::string, std::string>> rows;
  explicit Table(const std::string& text) {
    std::istringstream lines(text);
    std::string line, cell;
    std::getline(lines, line);
    for (std::istringstream cells(line); std::getline(cells, cell, ',');) names.push_back(cell);
    while (std::getline(lines, line)) {
      std::size_t k = 0;
      auto& row = rows.emplace_back();
      for (std::istringstream cells(line); std::getline(cells, cell, ',');) row[names.at(k++)] = cell;
    }
  }
  double number(std::size_t row, const std::string& name) const { return std::stod(rows.at(row).at(name)); }
};

TEST(History, NamesTheLoadOfEveryStepWhereLoadsGrow) {
  const Folder folder("history_load");
  const Build b =
      built(folder, {"strain_limit={mode='off'}", "output.history=step", "pin=[{at='curve:0,2'},{at='curve:0,0'}]",
                     "solver={until='rest',rest={method='newton',load_steps=2}}"});
  History history(b, folder / "history.csv", {}, RunState{});
  RunHooks hooks;
  hooks.resumable = [&](const RunResult& now) { history.add(now); };
  ASSERT_EQ(run(b, hooks).exit, RunExit::ok);
  const Table table(read_file(folder / "history.csv"));
  ASSERT_EQ(table.rows.size(), 3u);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(table.number(k, "load_factor"), 0.5 * static_cast<double>(k));
}

TEST(History, HasARowAFrameWithTheNumbersOfTheReport) {
  const Folder folder("history");
  const Build b = built(folder);
  std::vector<double> times;
  RunHooks hooks;
  History history(b, folder / "history.csv", {}, RunState{});
  hooks.frame = [&](const RunFrame& frame) { times.push_back(frame.time); };
  hooks.resumable = [&](const RunResult& now) { history.add(now); };
  const RunResult result = run(b, hooks);
  const Table table(read_file(folder / "history.csv"));
  ASSERT_EQ(table.rows.size(), times.size());
  for (std::size_t k = 0; k < times.size(); ++k) {
    EXPECT_EQ(table.number(k, "frame"), double(k));
    EXPECT_EQ(table.number(k, "t"), times[k]);
    EXPECT_EQ(table.rows[k].at("contacts"), "");
  }
  const StateMeasures m = measure(b, *result.system, result.state, result.dt_last);
  const std::size_t last = times.size() - 1;
  EXPECT_EQ(table.number(last, "step"), result.steps);
  EXPECT_EQ(table.number(last, "dt"), result.dt_last);
  EXPECT_EQ(table.number(last, "kinetic"), result.energy.kinetic);
  EXPECT_EQ(table.number(last, "gravity"), result.energy.gravity);
  EXPECT_EQ(table.number(last, "strain_max_weft"), m.strain.max[0]);
  EXPECT_EQ(table.number(last, "strain_min_warp"), m.strain.min[1]);
  EXPECT_EQ(table.number(last, "iterations_total"), result.iterations_sum);
  EXPECT_EQ(table.number(last, "reaction_0_z"), m.reactions[0].z());
  EXPECT_EQ(table.number(last, "point_0_y"), m.points[0].y());
  EXPECT_LT(table.number(last, "gravity"), 0);
  EXPECT_EQ(table.number(0, "kinetic"), 0);
}

TEST(History, HasARowAStepOnRequestOrNone) {
  const Folder folder("history_steps");
  const Build b = built(folder, {"output.history=step"});
  History history(b, folder / "history.csv", {}, RunState{});
  RunHooks hooks;
  hooks.resumable = [&](const RunResult& now) { history.add(now); };
  const RunResult result = run(b, hooks);
  const Table table(read_file(folder / "history.csv"));
  ASSERT_EQ(table.rows.size(), static_cast<std::size_t>(result.steps) + 1);
  double t = -1;
  for (std::size_t k = 0; k < table.rows.size(); ++k) {
    EXPECT_EQ(table.number(k, "step"), double(k));
    EXPECT_GT(table.number(k, "t"), t);
    t = table.number(k, "t");
  }
  const Build none = built(folder, {"output.history=off"});
  History off(none, folder / "none.csv", {}, RunState{});
  EXPECT_FALSE(std::filesystem::exists(folder / "none.csv"));
}

TEST(History, OfAResumedRunHasTheSameBytes) {
  for (const char* rows : {"frame", "step"}) {
    SCOPED_TRACE(rows);
    const Folder folder("history_resumed");
    const Build b = built(folder, {std::string("output.history=") + rows});
    const SceneMark mark = scene_mark(b);
    std::vector<std::string> checkpoints, histories;
    {
      History history(b, folder / "whole.csv", {}, RunState{});
      RunHooks hooks;
      hooks.resumable = [&](const RunResult& now) {
        history.add(now);
        checkpoints.push_back(format_checkpoint(mark, now, *now.system));
      };
      run(b, hooks);
    }
    const std::string whole = read_file(folder / "whole.csv");
    const std::size_t count = checkpoints.size();
    for (const std::size_t place : {std::size_t{0}, count / 3, count / 2, count - 2, count - 1}) {
      RunResult state = parse_checkpoint(checkpoints[place], "checkpoint", b);
      // The stopped run had got further than its checkpoint, and its last line is torn.
      const bool further = place + 2 < count;
      write_file(folder / "former.csv", whole.substr(0, whole.size() - (further ? 5 : 0)));
      History history(b, folder / "resumed.csv", folder / "former.csv", state);
      RunHooks hooks;
      hooks.resumable = [&](const RunResult& now) { history.add(now); };
      run(b, std::move(state), hooks);
      EXPECT_EQ(read_file(folder / "resumed.csv"), whole) << place << " of " << count;
    }
  }
}

}  // namespace
}  // namespace toile
