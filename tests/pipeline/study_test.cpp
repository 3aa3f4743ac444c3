// SPDX-License-Identifier: GPL-3.0-or-later
// Studies of a program that the tests write themselves: a shell script that takes toile's options and leaves a report.
#include "pipeline/study/study.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <exception>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "geometry/error.h"
#include "io/file.h"
#include "io/vtu.h"
#include "pipeline/panels.h"
#include "support/draped.h"
#include "support/near.h"

namespace toile {
namespace {

using nlohmann::json;
using test::Folder;

// `drape SCENE --set KEY=VALUE ... -o DIR ...`: value = 3 + dt^2; panel.0.name says what else it does.
constexpr const char* fake_program = R"(#!/bin/sh
dir= dt=0.5 mode= size=4,5
while [ $# -gt 0 ]; do
  case $1 in
    -o) dir=$2; shift ;;
    --set)
      case $2 in
        solver.dt=*) dt=${2#solver.dt=} ;;
        panel.0.name=*) mode=$(echo "${2#panel.0.name=}" | tr -d '"') ;;
        panel.0.refine.spans=*) size=$(echo "${2#*=}" | tr -dc '0-9,') ;;
      esac
      shift ;;
  esac
  shift
done
here=$(dirname "$0")
echo "$dt $mode" >> "$here/calls"
injected=0 gravity=-1 exit=0 strain=0.001 seed=0 limit=0.01 least=-0.001 most=0.001
band='{"compress": [0.05, 0.05], "stretch": [0.02, 0.03], "tolerance": 2e-4}'
case $mode in
  refuse) echo "note: about to fail" >&2; echo "error: scene.toml:3: nonsense" >&2; exit 3 ;;
  silent) exit 4 ;;
  solver) echo "error: diverged" >&2; exit 5 ;;
  crash) kill -SEGV $$ ;;
  slow) trap 'echo "error: interrupted at t = 0.1 s" >&2; exit 130' INT; sleep 1000 & wait ;;
  hang) trap '' INT; sleep 1000 & echo $! > "$here/sleeper"; wait; wait ;;
  nothing) exit 0 ;;
  gains) injected=0.02 ;;
  overstrained) strain=0.02 ;;
  band) limit=$band ;;
  stretched) limit=$band; most=0.0303 ;;
  squeezed) limit=$band; least=-0.0505 ;;
  unsaid) limit=$band; least='"?"' ;;
  null) strain=null ;;
  limit) echo "error: the limit is not met" >&2; exit=6 ;;
  random) seed=$(wc -l < "$here/calls") ;;
esac
mkdir -p "$dir"
[ "$mode" = word ] && echo "x -nan y" > "$dir/draped.igs"
[ "$mode" = mesh ] && dt=$(awk "BEGIN { print 1 / ${size%,*} }")
value=$(awk "BEGIN { printf \"%.17g\", 3 + $dt * $dt + $seed }")
cat > "$dir/report.json" <<END
{"model": "shell", "scheme": "verlet", "degrees_of_freedom": 12, "steps": 1, "simulated_seconds": $dt,
 "panels": [{"degree": [2, 3], "spans": [$size], "cells": {"cut": 1}}],
 "wall_seconds": 0.25, "seconds": {"force": 0.2, "write": 0.1},
 "strain": {"at_constraints_max": $strain, "limit": $limit,
            "at_constraints": {"min_weft": -0.0499, "max_weft": 0.0199, "min_warp": $least, "max_warp": $most}}, "energy": {"injected": $injected, "gravity": $gravity},
 "points": [{"position": [1, 2, $value]}], "memory": $(ulimit -v),
 "measures": {"depth": {"value": $value, "unit": "m"}, "mass": {"value": 1, "unit": "kg"}}}
END
exit $exit
)";

std::string study_text(const std::string& more) {
  return "scene = \"scene.toml\"\n" + more;
}
const std::string depth = "quantity = { of = \"depth\", name = \"depth\" }\n";
const std::string three = "reference = { kind = \"value\", value = 3, uncertainty = 1e-6, source = \"by hand\" }\n";

struct Lab : Folder {
  explicit Lab(const std::string& name) : Folder("study_" + name) {
    write_file(*this / "program", fake_program);
    std::filesystem::permissions(*this / "program", std::filesystem::perms::owner_all);
    write_file(*this / "scene.toml", "[[panel]]\nfile = \"nowhere.igs\"\n");
  }
  int run(const std::string& text, const std::string& out = "out", bool overwrite = false) {
    write_file(*this / "study.toml", study_text(text));
    StudyOptions options;
    options.program = *this / "program";
    options.directory = *this / out;
    options.overwrite = overwrite;
    Console console;
    console.quiet = true;
    ::testing::internal::CaptureStdout();
    int code = -1;
    std::exception_ptr trouble;
    try {
      Study study = read_study(*this / "study.toml");
      study.limits.grace_seconds = 2;
      code = run_study(study, options, console);
    } catch (...) {
      trouble = std::current_exception();
    }
    table = ::testing::internal::GetCapturedStdout();
    if (trouble) std::rethrow_exception(trouble);
    return code;
  }
  json result(const std::string& out = "out") const { return json::parse(read_file(*this / (out + "/study.json"))); }
  std::size_t calls() const {
    if (!std::filesystem::exists(*this / "calls")) return 0;
    const std::string text = read_file(*this / "calls");
    return static_cast<std::size_t>(std::ranges::count(text, '\n'));
  }
  std::string table;
};

// Rows of cells; the cells here hold no quotes unless they hold commas.
std::vector<std::vector<std::string>> csv(const std::string& text) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string> cells(1);
    bool quoted = false;
    for (const char c : line) {
      if (c == '"') quoted = !quoted;
      if (c == ',' && !quoted) cells.emplace_back();
      if (c != '"' && (c != ',' || quoted)) cells.back() += c;
    }
    rows.push_back(cells);
  }
  return rows;
}
std::vector<std::string> column(const std::vector<std::vector<std::string>>& rows, const std::string& name) {
  const auto k = static_cast<std::size_t>(std::ranges::find(rows.at(0), name) - rows.at(0).begin());
  std::vector<std::string> result;
  for (std::size_t r = 1; r < rows.size(); ++r) result.push_back(rows[r].at(k));
  return result;
}

TEST(Study, FindsTheOrderOfItsRuns) {
  Lab lab("order");
  ASSERT_EQ(lab.run(depth + three + "vary.solver.dt = [0.4, 0.2, 0.1]\n"), 0);
  const json series = lab.result()["series"][0];
  ASSERT_EQ(series["orders"].size(), 1u);
  EXPECT_EQ(series["orders"][0]["in"], "dt");
  EXPECT_NEAR(series["orders"][0]["slope"], 2, 1e-9);
  EXPECT_NEAR(series["orders"][0]["last_pair"], 2, 1e-9);
  EXPECT_NEAR(series["cases"][1]["error"], 0.04, 1e-12);
  EXPECT_EQ(series["reference"]["uncertainty"], 1e-6);
  EXPECT_NE(lab.table.find("dt: order 2.00 in dt, last pair 2.00 (3 points)"), std::string::npos) << lab.table;
  EXPECT_NE(lab.table.find("by hand, uncertainty 1e-06"), std::string::npos) << lab.table;
  for (const char* plot : {"error_over_time.svg", "error_over_dt.svg", "time_by_phase.svg"}) {
    EXPECT_TRUE(std::filesystem::exists(lab / "out" / plot)) << plot;
  }
  EXPECT_FALSE(std::filesystem::exists(lab / "out/error_over_dofs.svg")) << "all runs have the same mesh";
  EXPECT_NE(read_file(lab / "out/error_over_dt.svg").find("order 2.00 in dt"), std::string::npos);
}

TEST(Study, OrdersInTheMeshCountTheRefinedDirection) {
  Lab lab("mesh");
  const std::string mesh = depth + three + "set.panel.0.name = \"mesh\"\nset.solver.dt = 0.1\n";
  for (const char* spans : {"[[2, 3], [4, 3], [8, 3]]", "[[2, 4], [4, 8], [8, 16]]"}) {
    ASSERT_EQ(lab.run(mesh + "vary.panel.0.refine.spans = " + spans + "\n"), 0);
    const json orders = lab.result()["series"][0]["orders"];
    ASSERT_EQ(orders.size(), 1u);
    EXPECT_EQ(orders[0]["in"], "h");
    EXPECT_NEAR(orders[0]["slope"], 2, 1e-9) << spans;
  }
}

TEST(Study, TheFinestRunAndRichardsonStateTheirUncertainty) {
  Lab lab("references");
  ASSERT_EQ(lab.run(depth + "reference.kind = \"finest\"\nvary.solver.dt = [0.4, 0.2, 0.1]\n"), 0);
  json series = lab.result()["series"][0];
  EXPECT_NEAR(series["reference"]["value"][0], 3.01, 1e-12);
  EXPECT_NEAR(series["reference"]["uncertainty"], 0.03, 1e-12);
  ASSERT_EQ(lab.run(depth + "reference.kind = \"finest\"\nvary.solver.dt = [0.4]\n"), 0);
  EXPECT_EQ(lab.result()["series"][0]["reference"]["uncertainty"], nullptr) << "unknown is not zero";
  ASSERT_EQ(lab.run(depth + "reference.kind = \"richardson\"\nvary.solver.dt = [0.4, 0.2, 0.1, 0.05]\n"), 0);
  series = lab.result()["series"][0];
  EXPECT_NEAR(series["reference"]["value"][0], 3, 1e-9);
  EXPECT_NEAR(series["reference"]["uncertainty"], 0, 1e-8);
  ASSERT_EQ(lab.run(depth + "reference.kind = \"richardson\"\nvary.solver.dt = [0.4, 0.2, 0.1]\n"), 0);
  series = lab.result()["series"][0];
  EXPECT_EQ(series["reference"]["value"], nullptr);
  EXPECT_NE(series["reference"]["text"].get<std::string>().find("3 finished runs are too few"), std::string::npos)
      << series["reference"]["text"];
}

TEST(Study, ReferencesMayComeFromATableAndFromAnotherSeries) {
  Lab lab("table");
  write_file(lab / "exact.csv", "# by hand\nload,depth\n1,5\n2,30\n");
  const std::string table =
      "kind = \"table\", file = \"exact.csv\", where = { load = 2 }, column = \"depth\", "
      "scale = 0.1, uncertainty = 0, source = \"s\"";
  ASSERT_EQ(lab.run(depth + "[[series]]\nname = \"a\"\nreference = { " + table +
                    " }\nvary.solver.dt = [0.2, 0.1]\n[[series]]\nname = \"b\"\nreference = { kind = \"finest\", of = "
                    "\"a\", relative = true }\nvary.solver.dt = [0.3]\n"),
            0);
  const json result = lab.result();
  EXPECT_NEAR(result["series"][0]["cases"][0]["error"], 0.04, 1e-12);
  EXPECT_NEAR(result["series"][1]["cases"][0]["error"], 0.08 / 3.01, 1e-12);
}

TEST(Study, VectorsCompareByDistance) {
  Lab lab("vector");
  ASSERT_EQ(lab.run("quantity.of = \"points.0.position\"\nreference = { kind = \"value\", value = [1, 5, 7.25], "
                    "uncertainty = 0, source = \"s\" }\n"),
            0);
  EXPECT_NEAR(lab.result()["series"][0]["cases"][0]["error"], 5, 1e-12);
  // A number a cell.
  const auto rows = csv(read_file(lab / "out/study.csv"));
  EXPECT_EQ(column(rows, "reference.0"), std::vector<std::string>{"1"});
  EXPECT_EQ(column(rows, "reference.2"), std::vector<std::string>{"7.25"});
  EXPECT_FALSE(column(rows, "value.2")[0].empty());
}

TEST(Study, FailedRunsAreRowsWithTheirCause) {
  Lab lab("failed");
  ASSERT_EQ(
      lab.run(depth + three +
              "limits.seconds = 2\n"
              "vary.panel.0.name = [\"fine\", \"refuse\", \"solver\", \"crash\", \"hang\", \"nothing\", \"limit\"]\n"),
      0);
  const auto rows = csv(read_file(lab / "out/study.csv"));
  EXPECT_EQ(column(rows, "status"),
            (std::vector<std::string>{"ok", "refused", "stopped", "failed", "timeout", "failed", "check"}));
  const auto causes = column(rows, "cause");
  EXPECT_EQ(causes[1], "scene.toml:3: nonsense");
  EXPECT_EQ(causes[2], "diverged");
  EXPECT_NE(causes[3].find("signal 11"), std::string::npos) << causes[3];
  EXPECT_EQ(causes[4], "not done after 2 s");
  EXPECT_EQ(causes[5], "it left no report.json");
  EXPECT_EQ(causes[6], "the limit is not met");
  EXPECT_EQ(column(rows, "error")[1], "");
  EXPECT_NE(column(rows, "error")[6], "") << "a check that isn't met leaves a value";
  // What it started is gone, or at least dead.
  const std::string pid = read_file(lab / "sleeper").substr(0, read_file(lab / "sleeper").find('\n'));
  std::string state = "gone";
  if (std::filesystem::exists("/proc/" + pid + "/stat")) {
    const std::string stat = read_file("/proc/" + pid + "/stat");
    state = stat.substr(stat.find(") ") + 2, 1);
  }
  EXPECT_TRUE(state == "gone" || state == "Z" || state == "X") << state;
  // Each failure has a point in the plots.
  const std::string svg = read_file(lab / "out/error_over_time.svg");
  for (const char* name : {"refuse", "solver", "crash", "hang", "nothing", "limit"}) {
    EXPECT_NE(svg.find("name = &quot;" + std::string(name)), std::string::npos) << name;
  }
}

TEST(Study, AStudyWithoutAnyValueIsExit6) {
  Lab lab("empty");
  EXPECT_EQ(lab.run(depth + three + "set.panel.0.name = \"solver\"\n"), 6);
  EXPECT_TRUE(std::filesystem::exists(lab / "out/study.csv"));
  EXPECT_EQ(lab.run(depth + three + "check.error = 0.01\nvary.solver.dt = [0.4, 0.2]\n"), 6);
  EXPECT_EQ(lab.run(depth + three + "check.error = 0.05\nvary.solver.dt = [0.4, 0.2]\n"), 0);
}

TEST(Study, MemoryIsLimited) {
  Lab lab("memory");
  ASSERT_EQ(lab.run("limits.megabytes = 512\nquantity.of = \"memory\"\nreference = { kind = \"value\", value = 500000, "
                    "uncertainty = 0, source = \"512e6 / 1024\" }\n"),
            0);
  EXPECT_EQ(lab.result()["series"][0]["cases"][0]["error"], 0);
}

TEST(Study, EveryRowHasTheColumnsOfTheContract) {
  Lab lab("columns");
  ASSERT_EQ(lab.run(depth + three +
                    "columns = [\"degrees_of_freedom\", \"strain.limit\"]\nrepeats = 2\n"
                    "vary.solver.dt = [0.5, 0.25]\nvary.panel.0.refine.spans = [[4, 5]]\n"),
            0);
  const auto rows = csv(read_file(lab / "out/study.csv"));
  const std::vector<std::string> contract{"model",    "scheme", "mesh",      "degree", "spans",        "dofs",  "dt",
                                          "quantity", "value",  "reference", "error",  "wall_seconds", "status"};
  ASSERT_GE(rows.at(0).size(), contract.size());
  EXPECT_TRUE(std::equal(contract.begin(), contract.end(), rows[0].begin()));
  ASSERT_EQ(rows.size(), 5u) << "one row a run";
  EXPECT_EQ((std::vector<std::string>(rows[1].begin(), rows[1].begin() + 13)),
            (std::vector<std::string>{"shell", "verlet", "cut", "2x3", "4x5", "12", "0.5", "depth", "3.25", "3", "0.25",
                                      "0.25", "ok"}));
  EXPECT_EQ(column(rows, "strain.limit")[0], "0.01");
  EXPECT_EQ(column(rows, "panel.0.refine.spans.0")[0], "4");
  EXPECT_EQ(column(rows, "panel.0.refine.spans.1")[0], "5");
  EXPECT_EQ(column(rows, "spans_v")[0], "5");
  EXPECT_EQ(column(rows, "repeat"), (std::vector<std::string>{"1", "2", "1", "2"}));
}

TEST(Study, FinishedRunsAreNotRunAgain) {
  Lab lab("resume");
  const std::string common = depth + three;
  ASSERT_EQ(lab.run(common + "vary.solver.dt = [0.4, 0.2]\n"), 0);
  EXPECT_EQ(lab.calls(), 2u);
  const std::string first = read_file(lab / "out/study.csv");
  ASSERT_EQ(lab.run(common + "vary.solver.dt = [0.4, 0.2]\n"), 0);
  EXPECT_EQ(lab.calls(), 2u);
  EXPECT_EQ(read_file(lab / "out/study.csv"), first);
  ASSERT_EQ(lab.run(common + "vary.solver.dt = [0.4, 0.3, 0.2]\n"), 0);
  EXPECT_EQ(lab.calls(), 3u) << "only the new one";
  ASSERT_EQ(lab.run(common + "vary.solver.dt = [0.4]\n", "out", true), 0);
  EXPECT_EQ(lab.calls(), 4u) << "--overwrite";
  write_file(lab / "scene.toml", "[[panel]]\nfile = \"elsewhere.igs\"\n");
  ASSERT_EQ(lab.run(common + "vary.solver.dt = [0.4]\n"), 0);
  EXPECT_EQ(lab.calls(), 5u) << "another scene";
  // A record that was cut short counts for nothing.
  for (const auto& entry : std::filesystem::directory_iterator(lab / "out/runs")) {
    if (entry.path().extension() == ".json") write_file(entry.path(), "{\"input\": ");
  }
  ASSERT_EQ(lab.run(common + "vary.solver.dt = [0.4]\n"), 0);
  EXPECT_EQ(lab.calls(), 6u);
}

TEST(Study, AFolderOfSomethingElseIsLeftAlone) {
  Lab lab("foreign");
  write_file(lab / "out/mine.txt", "mine");
  EXPECT_THROW(lab.run(depth + three), OutputError);
  EXPECT_EQ(lab.calls(), 0u);
  EXPECT_EQ(lab.run(depth + three, "out", true), 0);
  EXPECT_EQ(read_file(lab / "out/mine.txt"), "mine");
}

TEST(Study, TheSameStudyWritesTheSameBytes) {
  Lab lab("bytes");
  const std::string text = depth + three + "vary.solver.dt = [0.4, 0.2]\nvary.panel.0.name = [\"fine\", \"refuse\"]\n";
  ASSERT_EQ(lab.run(text, "a"), 0);
  ASSERT_EQ(lab.run(text, "b"), 0);
  EXPECT_EQ(read_file(lab / "a/error_over_dt.svg"), read_file(lab / "b/error_over_dt.svg"));
  EXPECT_EQ(read_file(lab / "a/time_by_phase.svg"), read_file(lab / "b/time_by_phase.svg"));
  json a = lab.result("a"), b = lab.result("b");
  for (json* result : {&a, &b}) {
    for (json& c : (*result)["series"][0]["cases"]) c.erase("timing");
  }
  EXPECT_EQ(a, b);
}

TEST(Study, RepeatsThatDisagreeAreTold) {
  Lab lab("repeats");
  ASSERT_EQ(lab.run(depth + three + "repeats = 3\nvary.panel.0.name = [\"fine\", \"random\"]\n"), 0);
  const json cases = lab.result()["series"][0]["cases"];
  EXPECT_EQ(cases[0]["repeats_agree"], true);
  EXPECT_EQ(cases[1]["repeats_agree"], false);
  EXPECT_NE(lab.table.find("repeats differ"), std::string::npos) << lab.table;
}

TEST(Study, AMissingQuantityNamesTheNearest) {
  Lab lab("quantity");
  EXPECT_EQ(lab.run("quantity.of = \"dept\"\n" + three), 6);
  EXPECT_EQ(lab.result()["series"][0]["cases"][0]["cause"], "report.json has no 'dept'; did you mean 'depth'?");
}

TEST(Study, StabilityIsAVerdictOnEachRun) {
  Lab lab("stability");
  const std::string head = "kind = \"stability\"\nlimits.seconds = 2\n";
  EXPECT_EQ(lab.run(head + "vary.panel.0.name = [\"fine\", \"refuse\", \"solver\", \"limit\", \"slow\"]\n"), 0);
  auto rows = csv(read_file(lab / "out/study.csv"));
  EXPECT_EQ(column(rows, "verdict"), (std::vector<std::string>{"stable", "refused", "stopped", "stopped", "stopped"}));
  EXPECT_NE(lab.table.find("1 stable, 1 refused, 3 stopped, 0 BAD"), std::string::npos) << lab.table;
  for (const char* mode : {"silent", "crash", "hang", "nothing", "gains", "overstrained", "null", "word"}) {
    EXPECT_EQ(lab.run(head + "set.panel.0.name = \"" + std::string(mode) + "\"\n"), 6) << mode;
    rows = csv(read_file(lab / "out/study.csv"));
    EXPECT_EQ(column(rows, "verdict"), std::vector<std::string>{"BAD"}) << mode;
    EXPECT_NE(column(rows, "cause")[0], "") << mode;
  }
  // A run that is well behaved and wrong.
  const std::string wrong = head + depth + three + "set.solver.dt = 0.1\ncheck.error = ";
  EXPECT_EQ(lab.run(wrong + "0.02\n"), 0);
  EXPECT_EQ(lab.run(wrong + "0.005\n"), 6);
}

// Frames as the run's own sink writes them, one number replaced.
TEST(Study, NumbersThatAreNotFiniteAreFoundInFrames) {
  const auto judged = [](const auto& change) {
    Folder folder("study_vtu");
    test::Draped draped(true);
    change(draped);
    VtuSink(folder / "run/frames", "cloth").write(draped.frame());
    return not_finite_in(folder / "run");
  };
  const auto replace = [](auto member, double value) {
    return [=](test::Draped& draped) { (draped.panel.fields.*member).back()[0] = value; };
  };
  EXPECT_EQ(judged([](test::Draped&) {}), "");
  EXPECT_EQ(judged(replace(&FrameFields::strain, std::nan(""))), "frames/cloth_0000/triangles.vtu: strain");
  EXPECT_EQ(judged(replace(&FrameFields::nominal, -INFINITY)), "frames/cloth_0000/triangles.vtu: nominal_stress_weft");
  EXPECT_EQ(judged([](test::Draped& d) { d.panel.fields.curvature.back()[2] = INFINITY; }),
            "frames/cloth_0000/triangles.vtu: curvature_twist");
  EXPECT_EQ(judged([](test::Draped& d) { d.panel.point_stress.back()[3] = std::nan(""); }),
            "frames/cloth_0000/points.vtu: raw_nominal_stress_warp");
}

TEST(Study, AFrameThatCantBeReadIsNotFinite) {
  Folder folder("study_vtu_cut");
  const test::Draped draped;
  VtuSink(folder / "frames", "cloth").write(draped.frame());
  const auto file = folder / "frames/cloth_0000/net.vtu";
  const std::string whole = read_file(file);
  write_file(file, whole.substr(0, whole.size() / 2));
  EXPECT_NE(not_finite_in(folder.path()).find("net.vtu: array "), std::string::npos) << not_finite_in(folder.path());
  write_file(file, "<VTKFile><DataArray format=\"ascii\">1 2</DataArray></VTKFile>");
  EXPECT_NE(not_finite_in(folder.path()).find("net.vtu: no VTU file"), std::string::npos);
}

TEST(Study, WhatARunHasntGotMayBeNull) {
  Folder folder("study_null");
  write_file(folder / "report.json", R"({"contact": {"max_penetration": null}, "seams": null, "mass": 1})");
  EXPECT_EQ(not_finite_in(folder.path()), "");
  write_file(folder / "report.json", R"({"contact": {"max_penetration": null}, "measures": {"seams": null}})");
  EXPECT_EQ(not_finite_in(folder.path()), "report.json: null at measures.seams");
}

TEST(Study, ABandIsJudgedByDirectionAndSign) {
  Lab lab("band");
  const std::string head = "kind = \"stability\"\nset.panel.0.name = ";
  const auto cause = [&](const std::string& mode) {
    lab.run(head + "\"" + mode + "\"\n");
    return column(csv(read_file(lab / "out/study.csv")), "cause")[0];
  };
  EXPECT_EQ(cause("band"), "");
  EXPECT_EQ(cause("stretched"), "the warp is stretched by 0.0303, its limit is 0.03");
  EXPECT_EQ(cause("squeezed"), "the warp is compressed by 0.0505, its limit is 0.05");
  EXPECT_EQ(cause("unsaid"), "the warp is compressed by nan, its limit is 0.05");
}

TEST(Study, WrongFilesAreRefusedWithLineAndNearestKey) {
  const struct {
    std::string text, message;
  } cases[] = {
      {"repaets = 2\n", ":2: unknown key 'repaets' in the study; did you mean 'repeats'?"},
      {"repeats = 0\n", ":2: repeats in the study is 0, must be 1 to 1000"},
      {"kind = \"stabilty\"\n", ":2: unknown kind in the study \"stabilty\"; did you mean 'stability'?"},
      {depth, ": the study needs reference"},
      {three, ": the study needs quantity"},
      {depth + "reference.kind = \"fine\"\n", "did you mean 'finest'?"},
      {depth + "reference = { kind = \"value\", value = 3, source = \"s\" }\n", ":3: [reference] needs uncertainty"},
      {depth + "reference = { kind = \"finest\", of = \"nobody\" }\n", "no series is called 'nobody'"},
      {depth + three + "vary.solver.dt = 0.1\n", ":4: solver.dt in vary must be an array"},
      {depth + three + "vary.solver.dt = []\n", ":4: solver.dt in vary must be an array"},
      {depth + three + "rows = [1]\n", "a row must be a table"},
      {depth + three + "limits.seconds = -1\n", ":4: seconds in [limits] is -1, must be positive"},
      {depth + three + "vary.a.b = [1]\n[[series]]\n", "with [[series]], vary belongs into each"},
      {depth + three + "[[series]]\nname = \"a\"\n[[series]]\nname = \"a\"\n", "two series are called 'a'"},
      {depth + three + "[[series]]\nscene = \"none.toml\"\n", "none.toml' does not exist"},
      {depth + "reference = { kind = \"table\", file = \"exact.csv\", column = \"dpth\", uncertainty = 0, source = "
               "\"s\" }\n",
       "exact.csv: no column is called 'dpth'; did you mean 'depth'?"},
      {depth + "reference = { kind = \"table\", file = \"exact.csv\", column = \"depth\", where = { load = 3 }, "
               "uncertainty "
               "= 0, source = \"s\" }\n",
       ":3: where fits no row"},
      {depth + "reference = { kind = \"table\", file = \"broken.csv\", column = \"depth\", uncertainty = 0, source = "
               "\"s\" }\n",
       "broken.csv:2: 'x' is no number"},
      {"x = [\n", "study.toml:"},
  };
  Folder folder("study_wrong");
  write_file(folder / "scene.toml", "[[panel]]\nfile = \"nowhere.igs\"\n");
  write_file(folder / "exact.csv", "load,depth\n1,2\n");
  write_file(folder / "broken.csv", "load,depth\n1,x\n");
  for (const auto& c : cases) {
    write_file(folder / "study.toml", study_text(c.text));
    try {
      read_study(folder / "study.toml");
      ADD_FAILURE() << c.text;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(c.message), std::string::npos) << error.what();
    }
  }
  EXPECT_THROW(read_study(folder / "none.toml"), InputError);
}

// A misspelt scene key would spoil every run.
TEST(Study, UnknownSceneKeysAreRefusedAtOnce) {
  Folder folder("study_key");
  test::write_panels(folder / "panel.igs", {test::sheet("cloth")});
  write_file(folder / "scene.toml", test::scene_text("[[pin]]\nat = \"corner:0,0\"\n"));
  write_file(folder / "study.toml", study_text(depth + three + "vary.solver.dtt = [1e-3]\n"));
  try {
    read_study(folder / "study.toml");
    ADD_FAILURE();
  } catch (const InputError& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("did you mean 'dt'?"), std::string::npos) << what;
    EXPECT_NE(what.find("study.toml:4: solver.dtt: "), std::string::npos) << what;
  }
  // A value that a scene refuses is a result.
  write_file(folder / "study.toml", study_text(depth + three + "vary.solver.dt = [-1]\n"));
  EXPECT_EQ(read_study(folder / "study.toml").series[0].cases.size(), 1u);
}

TEST(Study, AxesMakeAProductAndSettingsKeepTheirOrder) {
  Folder folder("study_axes");
  write_file(folder / "scene.toml", "[[panel]]\nfile = \"nowhere.igs\"\n");
  write_file(
      folder / "study.toml",
      study_text(
          depth + three +
          "rows = [{ label = \"coarse\", panel.0.refine = { degree = 2, spans = [2, 2] } }, { solver.until = 1.0, "
          "\"solver.dt\" = \"1 ms\" }]\n[vary]\nz.z = [true, false]\na.a = [[1, 2], [3.5, 4]]\n[set]\nb = 1e-7\n"));
  const StudySeries series = read_study(folder / "study.toml").series[0];
  EXPECT_EQ(series.axes, (std::vector<std::string>{"rows", "z", "a"}));
  ASSERT_EQ(series.cases.size(), 8u);
  EXPECT_EQ(series.cases[0].label, "coarse, z = true, a = [1, 2]");
  EXPECT_EQ(series.cases[1].label, "coarse, z = true, a = [3.5, 4]");
  const auto texts = [&](std::size_t k) {
    std::vector<std::string> result;
    for (const StudySetting& s : series.cases[k].settings) result.push_back(s.text());
    return result;
  };
  EXPECT_EQ(texts(0), (std::vector<std::string>{"b=1e-07", "panel.0.refine={ degree = 2, spans = [2, 2] }", "z.z=true",
                                                "a.a=[1, 2]"}));
  EXPECT_EQ(texts(7), (std::vector<std::string>{"b=1e-07", "solver.until=1.0", "solver.dt=\"1 ms\"", "z.z=false",
                                                "a.a=[3.5, 4]"}));
}

}  // namespace
}  // namespace toile
