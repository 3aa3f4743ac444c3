// The built program, run as a user would: exit codes, streams, files.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>

#include "io/file.h"
#include "pipeline/panels.h"

namespace toile {
namespace {

using test::Folder;

struct Outcome {
  int code = -1;
  std::string out, err;
};

Outcome toile(const Folder& folder, const std::string& arguments) {
  const std::string command =
      "cd '" + folder.path().string() + "' && '" TOILE_PROGRAM "' " + arguments + " >stdout.txt 2>stderr.txt";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_file(folder / "stdout.txt"),
          read_file(folder / "stderr.txt")};
}

// A folder with a panel and a scene that runs in a moment.
struct Small : Folder {
  explicit Small(const std::string& name, const std::string& pins = "[[pin]]\nat = \"curve:0,2\"\n") : Folder(name) {
    test::write_panels(*this / "panel.igs", {test::trimmed_sheet("cloth")});
    write_file(*this / "scene.toml", test::scene_text(pins));
  }
};

TEST(Program, DrapesAndReports) {
  const Small folder("drape");
  const Outcome run = toile(
      folder, "drape scene.toml -o result --json --set 'output.formats=[\"vtu\", \"iges\"]' --set output.preview=true");
  ASSERT_EQ(run.code, 0) << run.err;
  for (const char* name : {"draped.igs", "report.json", "run.log", "frames/frame_0002.igs"}) {
    EXPECT_TRUE(std::filesystem::exists(folder / "result" / name)) << name;
  }
  const auto report = nlohmann::json::parse(run.out);
  EXPECT_EQ(report, nlohmann::json::parse(read_file(folder / "result/report.json")));
  EXPECT_EQ(report["exit"], "ok");
  EXPECT_EQ(report["frames"], 3);
  EXPECT_EQ(report["simulated_seconds"], 0.1);
  EXPECT_EQ(report["stages"], (nlohmann::json{"shell", "projection"}));
  EXPECT_LE(report["strain"]["at_constraints_max"], 0.01);
  EXPECT_EQ(report["reactions"].size(), 1u);
}

TEST(Program, TheSameSceneWritesTheSameFiles) {
  const Small folder("same");
  ASSERT_EQ(toile(folder, "drape scene.toml -o a --set 'output.formats=[\"vtu\"]'").code, 0);
  ASSERT_EQ(toile(folder, "drape scene.toml -o b --set 'output.formats=[\"vtu\"]'").code, 0);
  int compared = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / "a")) {
    if (!entry.is_regular_file()) continue;
    const auto name = std::filesystem::relative(entry.path(), folder / "a");
    if (name == "report.json" || name == "run.log") continue;
    EXPECT_EQ(read_file(entry.path()), read_file(folder / "b" / name)) << name;
    ++compared;
  }
  EXPECT_GT(compared, 5);
}

TEST(Program, APanelFileNeedsNoScene) {
  const Small folder("quick");
  const Outcome run = toile(folder, "drape panel.igs --pin curve:0,2 --until 0.05 -o result");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_TRUE(std::filesystem::exists(folder / "result/draped.igs"));
  EXPECT_EQ(toile(folder, "drape result/draped.igs --pin curve:0,2 --until 0.05 -o again").code, 0);
}

TEST(Program, ExitCodesTellWhatIsWrong) {
  const Small folder("codes");
  write_file(folder / "broken.igs", "this is no IGES file\n");
  const auto expect = [&](int code, const std::string& arguments) {
    const Outcome run = toile(folder, arguments);
    EXPECT_EQ(run.code, code) << arguments << "\n" << run.err;
    if (code != 0) {
      EXPECT_FALSE(run.err.empty()) << arguments;
      EXPECT_TRUE(run.out.empty()) << arguments << "\n" << run.out;
    }
  };
  expect(0, "--version");
  expect(0, "--help");
  expect(0, "check scene.toml");
  expect(0, "drape scene.toml --dry-run");
  expect(2, "");
  expect(2, "drap scene.toml");
  expect(2, "drape scene.toml --no-such-flag");
  expect(2, "drape panel.igs -o result");
  expect(2, "drape panel.igs --pin corner:7,7 -o result");
  expect(2, "init no_such_template");
  expect(3, "drape nowhere.toml -o result");
  expect(3, "drape nowhere.igs --pin curve:0,0 -o result");
  expect(3, "drape broken.igs --pin curve:0,0 -o result");
  expect(3, "check scene.toml --set panel.0.grian_deg=3");
  expect(3, "drape scene.toml -o result --set panel.0.file=nowhere.igs");
  expect(4, "drape scene.toml -o result --set pin.0.at=corner:0,0");
  expect(4, "check scene.toml --set pin.0.at=uv:1,1");
  EXPECT_FALSE(std::filesystem::exists(folder / "result")) << "a refused run leaves no file";
}

TEST(Program, JsonIsValidWhateverANameHolds) {
  const Small folder("names");
  test::write_panels(folder / "panel.igs", {test::trimmed_sheet("T\xfcr<&>\"\x01")});
  for (const char* arguments :
       {"inspect panel.igs --json", "roundtrip panel.igs --json", "drape panel.igs --pin curve:0,2 --dry-run --json",
        "drape panel.igs --pin curve:0,2 --until 0.01 -o result --json"}) {
    const Outcome run = toile(folder, arguments);
    EXPECT_EQ(run.code, 0) << arguments << "\n" << run.err;
    EXPECT_TRUE(nlohmann::json::accept(run.out)) << arguments;
  }
  const auto report = nlohmann::json::parse(read_file(folder / "result/report.json"));
  EXPECT_EQ(report["reactions"][0]["panel"], "T\xc3\xbcr<&>\"\x01");
}

TEST(Program, DataThatCantBePrintedIsExit8) {
  const Small folder("stdout");
  const auto run = [&](const std::string& arguments) {
    const int status = std::system(("cd '" + folder.path().string() + "' && '" TOILE_PROGRAM "' " + arguments).c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  };
  EXPECT_EQ(run("inspect panel.igs --json >&- 2>stderr.txt"), 8);
  EXPECT_NE(read_file(folder / "stderr.txt").find("standard output"), std::string::npos);
  if (!std::filesystem::is_character_file("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  EXPECT_EQ(run("inspect panel.igs >/dev/full 2>stderr.txt"), 8);
  EXPECT_EQ(run("drape scene.toml --dry-run >/dev/full 2>stderr.txt"), 8);
}

TEST(Program, AnErrorNamesFileLineAndKey) {
  const Small folder("line");
  std::string text = read_file(folder / "scene.toml");
  write_file(folder / "scene.toml", text.insert(text.find("file ="), "grian_deg = 3\n"));
  const Outcome run = toile(folder, "drape scene.toml");
  EXPECT_EQ(run.code, 3);
  EXPECT_EQ(run.err, "error: scene.toml:3: unknown key 'grian_deg' in [[panel]]; did you mean 'grain_deg'?\n");
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

TEST(Program, AUsedDirectoryIsKeptUnlessOverwritten) {
  const Small folder("overwrite");
  write_file(folder / "result/mine.txt", "mine");
  const Outcome refused = toile(folder, "drape scene.toml -o result");
  EXPECT_EQ(refused.code, 8);
  EXPECT_FALSE(std::filesystem::exists(folder / "result/draped.igs"));
  EXPECT_EQ(toile(folder, "drape scene.toml -o result --overwrite").code, 0);
  EXPECT_EQ(read_file(folder / "result/mine.txt"), "mine");
}

TEST(Program, AnUnmetLimitIsExit6) {
  const Small folder("limit");
  const Outcome run = toile(
      folder, "drape scene.toml -o result --set strain_limit.tolerance=1e-15 --set strain_limit.max_iterations=1");
  EXPECT_EQ(run.code, 6) << run.err;
  EXPECT_NE(run.err.find("strain limit is not met"), std::string::npos) << run.err;
  EXPECT_EQ(nlohmann::json::parse(read_file(folder / "result/report.json"))["exit"], "check");
}

TEST(Program, AnInterruptLeavesWholeFiles) {
  const Small folder("interrupt");
  const std::string command = "cd '" + folder.path().string() +
                              "' && timeout --preserve-status -s INT 1 '" TOILE_PROGRAM
                              "' drape scene.toml -o result --until 100000 --set output.every=1 2>stderr.txt";
  const int status = std::system(command.c_str());
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 130) << read_file(folder / "stderr.txt");
  EXPECT_EQ(nlohmann::json::parse(read_file(folder / "result/report.json"))["exit"], "interrupted");
  EXPECT_EQ(toile(folder, "roundtrip result/draped.igs").code, 0);
}

TEST(Program, AStudyRunsThisProgram) {
  const Small folder("study");
  write_file(folder / "study.toml",
             "scene = \"scene.toml\"\nquantity.of = \"lowest\"\nreference.kind = \"finest\"\n"
             "limits.megabytes = 1e9  # sanitizers reserve address space\n"
             "vary.panel.0.refine.spans = [[5, 5], [10, 10]]\n");
  const Outcome run = toile(folder, "study study.toml -o result");
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_NE(run.out.find("reference of"), std::string::npos) << run.out;
  const std::string csv = read_file(folder / "result/study.csv");
  EXPECT_NE(csv.find("\nshell,verlet,cut,2,5x5,"), std::string::npos) << csv;
  EXPECT_NE(csv.find("\nshell,verlet,cut,2,10x10,"), std::string::npos) << csv;
  const Outcome again = toile(folder, "study study.toml -o result --json");
  EXPECT_EQ(nlohmann::json::parse(again.out)["series"][0]["cases"].size(), 2u);
  EXPECT_NE(again.err.find("2 of 2 runs are from an earlier call"), std::string::npos) << again.err;
  EXPECT_EQ(toile(folder, "study none.toml").code, 3);
}

TEST(Program, AnInterruptedStudyGoesOnLater) {
  const Small folder("study_interrupt");
  write_file(folder / "study.toml",
             "scene = \"scene.toml\"\nquantity.of = \"lowest\"\nreference.kind = \"finest\"\n"
             "limits.megabytes = 1e9\nvary.solver.until = [0.01, 100000]\n[set]\noutput.every = 1\n");
  const std::string command = "cd '" + folder.path().string() +
                              "' && timeout --preserve-status -s INT 2 '" TOILE_PROGRAM
                              "' study study.toml -o result >stdout.txt 2>stderr.txt";
  const int status = std::system(command.c_str());
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 130) << read_file(folder / "stderr.txt");
  const std::string csv = read_file(folder / "result/study.csv");
  EXPECT_NE(csv.find(",ok,"), std::string::npos) << csv;
  EXPECT_NE(csv.find(",not run,"), std::string::npos) << csv;
}

TEST(Program, TemplatesRunAtOnce) {
  const Small folder("init");
  for (const std::string name : {"hang", "skirt"}) {
    ASSERT_EQ(toile(folder, "init " + name).code, 0);
    EXPECT_EQ(toile(folder, "init " + name).code, 8) << "it overwrites nothing";
    const Outcome run = toile(folder, "drape " + name + "/scene.toml --until 0.05 --set output.preview=false");
    EXPECT_EQ(run.code, 0) << run.err;
  }
}

}  // namespace
}  // namespace toile
