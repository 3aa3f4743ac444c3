// The samples, run: each against the number that its README promises and where that number comes from.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/build.h"
#include "pipeline/measures.h"
#include "pipeline/panels.h"
#include "pipeline/run.h"
#include "pipeline/scene.h"
#include "pipeline/study.h"
#include "support/near.h"

namespace toile {
namespace {

struct Ran {
  RunExit exit = RunExit::ok;
  EnergyBalance energy;
  StateMeasures measures;
};

Ran run_sample(const std::string& scene, const std::vector<std::string>& settings = {}) {
  const Build built = build(read_scene(std::string(TOILE_SAMPLES "/") + scene, settings));
  const RunResult result = run(built);
  return {result.exit, result.energy, measure(built, *result.system, result.state, result.dt_last)};
}

TEST(Samples, PanelsAreWhatTheDrafterWrites) {
  const test::Folder folder("panels");
  ASSERT_EQ(std::system(("'" TOILE_MAKE_PANELS "' '" + folder.path().string() + "'").c_str()), 0);
  int files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder.path())) {
    if (!entry.is_regular_file()) continue;
    const auto name = std::filesystem::relative(entry.path(), folder.path());
    EXPECT_EQ(read_file(entry.path()), read_file(std::filesystem::path(TOILE_SAMPLES) / name)) << name;
    ++files;
  }
  EXPECT_EQ(files, 33);
}

// Example 4.4: the load per length is the nominal stress.
TEST(Samples, PatchTestCarriesOneNewtonPerMetre) {
  const Ran ran = run_sample("patch_test/scene.toml");
  EXPECT_EQ(ran.exit, RunExit::ok);
  expect_near_rel(ran.measures.nominal.min[1], 1, 1e-6);
  expect_near_rel(ran.measures.nominal.max[1], 1, 1e-6);
  expect_near_rel(ran.measures.nominal.max[0], 0, 0, 1e-6);
}

// Table 1, case (a): a strain limit of 1 % and mean strains of 9.6e-4 and 1.3e-3 are the paper's; ours stay below them.
TEST(Samples, KidnappedClothKeepsItsStrainBelowThePapers) {
  const Ran ran = run_sample("kidnapped_a/scene.toml");
  EXPECT_EQ(ran.exit, RunExit::ok);
  EXPECT_LE(ran.measures.strain.max[0], 0.015);
  EXPECT_LE(ran.measures.strain.max[1], 0.013);
  EXPECT_LE(ran.measures.strain.mean_abs[0], 9.61e-4);
  EXPECT_LE(ran.measures.strain.mean_abs[1], 1.30e-3);
}

// Without drag, at the step that "auto" takes.
TEST(Samples, KidnappedClothGainsNoEnergy) {
  const std::vector<std::string> undamped{"fabric.paper.drag=0"};
  const Ran ran = run_sample("kidnapped_a/scene.toml", undamped);
  EXPECT_EQ(ran.exit, RunExit::ok);
  EXPECT_LE(ran.energy.injected, 1e-9);
  EXPECT_GT(ran.energy.load_work, 0.4);
}

// Softly held rows leave a rest of strain that a smaller step alone would turn into a larger velocity: before the rest
// was settled first, this run ended as solver_failed.
TEST(Samples, ARefusedStepIsRedoneFromASettledState) {
  const std::vector<std::string> soft{"fabric.paper.drag=0", "strain_limit.regularisation=2e-4", "solver.dt=2e-3"};
  const Ran ran = run_sample("kidnapped_a/scene.toml", soft);
  EXPECT_EQ(ran.exit, RunExit::ok);
  EXPECT_LE(ran.energy.injected, 0.02 * ran.energy.load_work);
}

// The mechanics don't know the net: 125 mm elements, grain and pins fixed.
TEST(Samples, TurnedNetsDrapeLikeTheFittedOne) {
  const std::vector<std::string> step{"solver.dt=2e-4"};
  const Ran fitted = run_sample("grid_independence/fitted.toml", step);
  for (const char* name : {"skewed", "turned_0", "turned_15", "turned_30", "turned_45", "parallelogram"}) {
    const Ran other = run_sample("grid_independence/" + std::string(name) + ".toml", step);
    EXPECT_EQ(other.exit, RunExit::ok) << name;
    // 10 mm is the goal; nets turned by 30 and 45 degrees miss it (samples/grid_independence/README.md).
    const bool oblique = std::string(name) == "turned_30" || std::string(name) == "turned_45";
    const double corner = oblique ? 0.030 : 0.010;
    EXPECT_LE((other.measures.points[0] - fitted.measures.points[0]).norm(), corner) << name;
    EXPECT_LE((other.measures.points[1] - fitted.measures.points[1]).norm(), 0.010) << name;
  }
}

// Runs a study with its results in `folder`; returns the exit code and what it prints.
std::pair<int, std::string> run_sample_study(Study study, const std::filesystem::path& folder) {
  study.limits.megabytes = 1e9;  // sanitizers reserve address space
  StudyOptions options;
  options.program = TOILE_PROGRAM;
  options.directory = folder;
  Console console;
  console.quiet = true;
  ::testing::internal::CaptureStdout();
  const int code = run_study(study, options, console);
  return {code, ::testing::internal::GetCapturedStdout()};
}

// The short part of samples/stability: every row stable, refused or stopped with its cause.
TEST(Samples, ExtremesAreStableOrSayWhyNot) {
  const test::Folder folder("stability");
  const auto [code, table] = run_sample_study(read_study(TOILE_SAMPLES "/stability/short.toml"), folder / "out");
  EXPECT_EQ(code, 0) << table;
}

// What runs for minutes is at least read: keys, panels and references.
TEST(Samples, EveryStudyFileIsValid) {
  int studies = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(TOILE_SAMPLES)) {
    if (entry.path().extension() != ".toml") continue;
    const std::string text = read_file(entry.path());
    if (text.find("[[series]]") == std::string::npos) continue;
    const Study study = read_study(entry.path());
    for (const StudySeries& series : study.series) EXPECT_FALSE(series.cases.empty()) << entry.path();
    ++studies;
  }
  EXPECT_EQ(studies, 11);
}

// Refinement brings the cantilever to the elastica: sixteen elements leave 3e-4 of its length, stretch included.
TEST(Samples, CantileverTendsToTheElastica) {
  const test::Folder folder("cantilever");
  Study study = read_study(TOILE_SAMPLES "/studies/cantilever/study.toml");
  study.series.resize(1);
  study.series[0].cases.resize(3);
  study.series[0].lengths = {3};
  const auto [code, table] = run_sample_study(study, folder / "out");
  ASSERT_EQ(code, 0) << table;
  const auto cases = nlohmann::json::parse(read_file(folder / "out/study.json"))["series"][0]["cases"];
  EXPECT_LE(cases[1]["error"], 0.25 * cases[0]["error"].get<double>());
  EXPECT_LE(cases[2]["error"], 0.3e-3 * 0.2);
}

}  // namespace
}  // namespace toile
