// SPDX-License-Identifier: GPL-3.0-or-later
// The built program, run as a user would: exit codes, streams, files.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>

#include "io/file.h"
#include "pipeline/draped_cap.h"
#include "pipeline/panels.h"
#include "support/near.h"

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

void expect_same_results(const std::filesystem::path& a, const std::filesystem::path& b) {
  int compared = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(a)) {
    if (!entry.is_regular_file()) continue;
    const auto name = std::filesystem::relative(entry.path(), a);
    if (name == "run.log" || name == "report.json") continue;
    EXPECT_EQ(read_file(entry.path()), read_file(b / name)) << name;
    ++compared;
  }
  EXPECT_GT(compared, 20);
  const auto report = [](const std::filesystem::path& folder) {
    auto json = nlohmann::json::parse(read_file(folder / "report.json"));
    for (const char* timing : {"seconds", "counters", "wall_seconds", "wall_seconds_per_frame"}) json.erase(timing);
    return json;
  };
  EXPECT_EQ(report(a), report(b));
}

// Below the cloth, which hangs beside it.
const std::string floor_table =
    "[[obstacle]]\nshape = \"plane\"\nname = \"floor\"\npoint = [0, 0, -9]\nnormal = [0, 0, 1]\n";

TEST(Program, DrapesAClothWithAContactPair) {
  const Small folder("contact_pair");
  write_file(folder / "scene.toml",
             test::scene_text("[[pin]]\nat = \"curve:0,2\"\n",
                              floor_table + "[[contact_pair]]\na = \"cloth\"\nb = \"floor\"\nfriction = 0.7\n"));
  const Outcome check = toile(folder, "check scene.toml"), run = toile(folder, "drape scene.toml -o out");
  EXPECT_EQ(check.code, 0) << check.err;
  EXPECT_EQ(run.code, 0) << run.err;
}

int count(const std::string& text, const std::string& words) {
  int n = 0;
  for (std::size_t at = text.find(words); at != std::string::npos; at = text.find(words, at + 1)) ++n;
  return n;
}

TEST(Program, ACheckSaysEveryFaultAndWarningOfObstaclesOnce) {
  const Small folder("faulty_obstacles");
  const std::string open_mesh = "v 0 0 -9\nv 1 0 -9\nv 0 1 -9\nf 1 2 3\n";
  write_file(folder / "open.obj", open_mesh);
  write_file(folder / "nan.obj", "v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n");
  write_file(folder / "nothing.obj", "v 0 0 0\n");
  const auto mesh = [](const std::string& name) {
    return "[[obstacle]]\nname = \"" + name + "\"\nmesh = \"" + name + ".obj\"\n";
  };
  const auto write = [&](const std::string& more) {
    write_file(folder / "scene.toml", test::scene_text("[[pin]]\nat = \"curve:0,2\"\n", more));
  };
  write(mesh("open") + mesh("nan") + mesh("nothing") +
        "[[contact_pair]]\na = \"cloth\"\nb = \"nan\"\nfriction = 0.7\n");
  Outcome check = toile(folder, "check scene.toml");
  EXPECT_EQ(check.code, 3);
  EXPECT_EQ(count(check.err, "obstacle 'nan': nan.obj"), 1) << check.err;
  EXPECT_EQ(count(check.err, "obstacle 'nothing': nothing.obj"), 1) << check.err;
  EXPECT_EQ(count(check.err, "the mesh is open"), 1) << check.err;
  EXPECT_EQ(count(check.err, "panel 'cloth'"), 1) << "the panels are looked at too";
  check = toile(folder, "check scene.toml --json");
  EXPECT_EQ(check.code, 3);
  auto verdict = nlohmann::json::parse(check.out);
  EXPECT_EQ(verdict["valid"], false);
  EXPECT_EQ(verdict["errors"].size(), 2u);
  EXPECT_EQ(count(check.out, "the mesh is open"), 1) << check.out;

  write(mesh("open"));
  check = toile(folder, "check scene.toml");
  EXPECT_EQ(check.code, 0) << check.err;
  EXPECT_EQ(count(check.err, "the mesh is open"), 1) << check.err;
  check = toile(folder, "check scene.toml --json");
  verdict = nlohmann::json::parse(check.out);
  EXPECT_EQ(verdict["valid"], true);
  EXPECT_EQ(count(check.out, "the mesh is open"), 1) << check.out;
}

TEST(Program, ACheckAlwaysHasAVerdict) {
  const Small folder("verdict");
  const auto verdict = [&](const std::string& setting, int code) {
    const Outcome check = toile(folder, "check scene.toml --json --set " + setting);
    EXPECT_EQ(check.code, code) << check.err;
    return nlohmann::json::parse(check.out);
  };
  auto good = verdict("solver.until=1", 0);
  EXPECT_EQ(good["valid"], true);
  EXPECT_TRUE(good["errors"].empty());
  EXPECT_EQ(good["panels"][0]["name"], "cloth");
  const auto reason = [](const nlohmann::json& bad) {
    EXPECT_EQ(bad["valid"], false);
    EXPECT_EQ(bad["errors"].size(), 1u);
    return bad["errors"][0].get<std::string>();
  };
  EXPECT_NE(reason(verdict("panel.0.grian_deg=3", 3)).find("grian_deg"), std::string::npos);
  EXPECT_NE(reason(verdict("pin.0.at=uv:1,1", 4)).find("uv:1,1"), std::string::npos);
  const std::string side = "{panel=\"cloth\",curve=";
  EXPECT_NE(reason(verdict("'seam=[{a=" + side + "0},b=" + side + "0}}]'", 3)).find("with itself"), std::string::npos);
}

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

TEST(Program, ThreadsGiveTheSameBytes) {
  const Small folder("threads");
  const std::string large =
      "drape scene.toml --overwrite --set 'output.formats=[\"vtu\", \"iges\", \"obj\"]' --set output.every=0.0025 "
      "--until 0.005 --set panel.0.refine.control_points=[44,44] ";
  for (const std::string more : {"--set strain_limit.mode=off ", "--set load.gravity=[0,0,-981] "}) {
    for (const char* rest : {"-o one", "-o two --threads 2", "-o three --threads 3"}) {
      const Outcome run = toile(folder, large + more + rest);
      ASSERT_EQ(run.code, 0) << run.err;
    }
    expect_same_results(folder / "one", folder / "two");
    expect_same_results(folder / "one", folder / "three");
  }
  EXPECT_EQ(toile(folder, large + "-o none --threads 0").code, 2);
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
  expect(2, "check scene.toml --set solver.dt");
  expect(2, "check scene.toml --set =3");
  expect(2, "check scene.toml --set ' .[]=3'");
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

TEST(Program, AKeyOfAHundredThousandPartsIsAnError) {
  const Small folder("deep");
  std::string key = "a";
  for (int k = 0; k < 100000; ++k) key += ".a";
  write_file(folder / "deep.toml", "# 1.1.1.1.1.1.1.1.1.1.1.1.1.1.1.1.1.1.1.1\nb = [0.1, 0.2]\n" + key + " = 1\n");
  const Outcome run = toile(folder, "check deep.toml");
  EXPECT_EQ(run.code, 3);
  EXPECT_EQ(run.err, "error: deep.toml:3: a key has more than 16 parts\n");
  EXPECT_EQ(toile(folder, "check scene.toml --set " + key.substr(0, 100000) + "=1").code, 3);
  EXPECT_EQ(toile(folder, "check scene.toml --set 'x={" + key.substr(0, 100001) + "=1}'").code, 3);
}

TEST(Program, AReaderThatGoesAwayDoesNotEndTheRun) {
  const Small folder("pipe");
  const std::string command = "cd '" + folder.path().string() +
                              "' && { '" TOILE_PROGRAM
                              "' drape scene.toml -v -o result 2>&1; echo $? >code.txt; } | true";
  ASSERT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(read_file(folder / "code.txt"), "0\n");
  EXPECT_EQ(nlohmann::json::parse(read_file(folder / "result/report.json"))["exit"], "ok");
}

TEST(Program, ADirectoryThatIsGoneIsNoInternalError) {
  const Small folder("gone");
  std::filesystem::create_directory(folder / "inner");
  const std::string inner = (folder / "inner").string();
  const int status = std::system(
      ("cd '" + inner + "' && rmdir '" + inner + "' && '" TOILE_PROGRAM "' check ../scene.toml >/dev/null 2>&1")
          .c_str());
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(Program, WhenNothingMoreCanBeWrittenItIsExit8AndNoFileIsHalf) {
  const Small folder("full");
  const std::string command = "cd '" + folder.path().string() +
                              "' && ulimit -f 4 && '" TOILE_PROGRAM
                              "' drape scene.toml -o result --set 'output.formats=[\"vtu\"]' >/dev/null 2>stderr.txt";
  const int status = std::system(command.c_str());
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 8);
  EXPECT_NE(read_file(folder / "stderr.txt").find(".vtu: "), std::string::npos);
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / "result")) {
    const std::filesystem::path name = entry.path().filename();  // the last two grow, line by line
    EXPECT_TRUE(entry.is_directory() || name == "run.log" || name == "history.csv") << entry.path();
  }
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

TEST(Program, ConvertAndInspectReplaceNothingUnasked) {
  const Small folder("replace");
  write_file(folder / "page.html", "mine");
  write_file(folder / "coat.mtl", "mine");
  for (const char* arguments : {"inspect panel.igs --html page.html", "inspect panel.igs --svg page.html",
                                "convert panel.igs panel.igs", "convert panel.igs coat.obj"}) {
    const Outcome run = toile(folder, arguments);
    EXPECT_EQ(run.code, 8) << arguments;
    EXPECT_NE(run.err.find("exists; give --overwrite to replace it"), std::string::npos) << run.err;
    EXPECT_EQ(toile(folder, std::string(arguments) + " --overwrite").code, 0) << arguments;
    write_file(folder / "page.html", "mine");
    write_file(folder / "coat.mtl", "mine");
    std::filesystem::remove(folder / "coat.obj");
  }
  const Outcome run = toile(folder, "convert panel.igs coat.obj");
  EXPECT_EQ(run.code, 8);
  EXPECT_EQ(read_file(folder / "coat.mtl"), "mine");
  EXPECT_FALSE(std::filesystem::exists(folder / "coat.obj"));
}

// (shadow - support) / (cloth - support), of a cap whose shadow is a disc.
TEST(Program, MeasuresADrape) {
  const Folder folder("measure");
  const test::DrapedCap cap;
  std::filesystem::create_directories(folder / "run");
  test::write_panels(folder / "run/draped.igs", test::draped_cap(cap).panels);
  const Outcome run = toile(folder, "measure drape run --support 0.09 --json --svg outline.svg");
  ASSERT_EQ(run.code, 0) << run.err;
  const auto json = nlohmann::json::parse(run.out);
  const double held = 0.09 * 0.09;
  expect_near_rel(json.at("drape_coefficient").get<double>(),
                  100 * (cap.rim() * cap.rim() - held) / (cap.radius * cap.radius - held), 2e-3);
  EXPECT_EQ(json.at("node_count"), 0);
  EXPECT_EQ(json.at("outline").size(), 3600u);
  EXPECT_NE(read_file(folder / "outline.svg").find(">0 nodes<"), std::string::npos);
  const Outcome words = toile(folder, "measure drape run/draped.igs --support '90 mm'");
  EXPECT_EQ(words.code, 0) << words.err;
  EXPECT_NE(words.out.find(", 0 nodes; "), std::string::npos) << words.out;
  test::write_panels(folder / "panel.igs", {test::trimmed_sheet("cloth")});
  struct Wrong {
    int code;
    const char *arguments, *message;
  };
  for (const Wrong& wrong : {Wrong{2, "drape run", "--support"},
                             {2, "drape run --support wide", "--support: "},
                             {2, "drape run --support '90 kg'", "--support: "},
                             {2, "drape run --support=-1", "--support must be positive"},
                             {3, "drape run --support 0.2", "larger than the cloth"},
                             {3, "drape nowhere --support 0.09", "nowhere"},
                             {3, "drape panel.igs --support 0.09", "no pair of panels"},
                             {8, "drape run --support 0.09 --svg outline.svg", "exists; give --overwrite"}}) {
    const Outcome bad = toile(folder, std::string("measure ") + wrong.arguments);
    EXPECT_EQ(bad.code, wrong.code) << wrong.arguments << "\n" << bad.err;
    EXPECT_NE(bad.err.find(wrong.message), std::string::npos) << bad.err;
    EXPECT_TRUE(bad.out.empty()) << bad.out;
  }
}

TEST(Program, AnUnmetLimitIsExit6) {
  const Small folder("limit");
  const Outcome run =
      toile(folder,
            "drape scene.toml -o result --set strain_limit.variant=paper --set strain_limit.tolerance=1e-15 "
            "--set strain_limit.max_iterations=1");
  EXPECT_EQ(run.code, 6) << run.err;
  EXPECT_NE(run.err.find("strain limit is not met"), std::string::npos) << run.err;
  EXPECT_EQ(nlohmann::json::parse(read_file(folder / "result/report.json"))["exit"], "check");
}

TEST(Program, StrainBetweenThePointsOfTheLimitIsTold) {
  const Small folder("between");
  const std::string run = "drape scene.toml -o result --overwrite --set output.preview=false";
  EXPECT_EQ(toile(folder, run).err.find("between the points"), std::string::npos);
  const Outcome pulled = toile(folder, run + " --set 'traction=[{ along = \"curve:0,0\", force = [4, 0, 0] }]'");
  EXPECT_EQ(pulled.code, 6) << pulled.err;  // torn apart between the points
  EXPECT_NE(pulled.err.find("between the points that hold the limit of 0.01"), std::string::npos) << pulled.err;
  const Outcome pushed =
      toile(folder, run +
                        " --set 'pin=[{ at = \"curve:0,3\" }, { at = \"curve:0,1\", move = { translate = [-0.1, 0, 0], "
                        "end = 0.4 } }]' --until 0.5");
  EXPECT_EQ(pushed.code, 0) << pushed.err;
  EXPECT_NE(pushed.err.find("squeezed by"), std::string::npos) << pushed.err;
}

// Long enough to be stopped on the way, with frames of every format.
const std::string long_run =
    "drape scene.toml --set 'output.formats=[\"vtu\", \"obj\", \"iges\"]' --set output.every=0.25 --until 2";

// Starts the program, sends it a signal once one of `files` is there, and returns how it ended.
int end_by(const Folder& folder, const std::string& signal, const std::string& arguments, const std::string& files) {
  const std::string command = "cd '" + folder.path().string() + "' && { '" TOILE_PROGRAM "' " + arguments +
                              " >stdout.txt 2>stderr.txt & }; until ls " + files +
                              " >ls.txt 2>&1 || ! kill -0 $!; do sleep 0.01; done; kill -" + signal + " $!; wait $!";
  const int status = std::system(command.c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(Program, AStoppedRunResumesToTheSameBytes) {
  const Small folder("signals");
  ASSERT_EQ(toile(folder, long_run + " -o whole").code, 0);
  for (const auto& [signal, code] : {std::pair("INT", 130), std::pair("TERM", 130), std::pair("KILL", 128 + 9)}) {
    std::filesystem::remove_all(folder / "result");
    EXPECT_EQ(end_by(folder, signal, long_run + " -o result", "result/frames/frame_0001.obj"), code)
        << signal << ": " << read_file(folder / "stderr.txt");
    if (code == 130) {
      EXPECT_EQ(nlohmann::json::parse(read_file(folder / "result/report.json"))["exit"], "interrupted");
      EXPECT_EQ(toile(folder, "roundtrip result/draped.igs").code, 0);
    }
    const Outcome resumed = toile(folder, long_run + " -o result --resume result/checkpoint");
    ASSERT_EQ(resumed.code, 0) << signal << ": " << resumed.err;
    expect_same_results(folder / "whole", folder / "result");
  }
}

TEST(Program, ATimeLimitIsExit7AndEveryRunGetsAhead) {
  const Small folder("time_limit");
  Outcome run = toile(folder, "drape scene.toml -o result --time-limit 1e-9");
  EXPECT_EQ(run.code, 7) << run.err;
  EXPECT_NE(run.err.find("time limit"), std::string::npos) << run.err;
  int runs = 1;
  for (; run.code == 7 && runs < 1000; ++runs) {
    const auto report = nlohmann::json::parse(read_file(folder / "result/report.json"));
    ASSERT_EQ(report["exit"], "time_limit");
    ASSERT_EQ(report["steps"], runs);
    run = toile(folder,
                "drape scene.toml -o result --resume result/checkpoint --set solver.time_limit=1e-9 --until 0.02");
  }
  EXPECT_EQ(run.code, 0) << run.err;
  ASSERT_EQ(toile(folder, "drape scene.toml -o whole --until 0.02").code, 0);
  EXPECT_EQ(read_file(folder / "result/draped.igs"), read_file(folder / "whole/draped.igs"));
}

TEST(Program, ACheckpointThatDoesNotFitIsExit3AndLeavesNoFile) {
  const Small folder("misfit");
  ASSERT_EQ(toile(folder, "drape scene.toml -o first --until 0.05").code, 0);
  write_file(folder / "cut", read_file(folder / "first/checkpoint").substr(0, 500));
  const auto refused = [&](const std::string& arguments, const std::string& part) {
    const Outcome run = toile(folder, "drape scene.toml -o other " + arguments);
    EXPECT_EQ(run.code, 3) << arguments << ": " << run.err;
    EXPECT_NE(run.err.find(part), std::string::npos) << run.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "other"));
  };
  refused("--resume nowhere", "nowhere");
  refused("--resume cut", "cut short");
  refused("--resume scene.toml", "no checkpoint");
  refused("--resume first/checkpoint --until 0.01", "solver.until");
  refused("--resume first/checkpoint --set load.wind=[1,0,0]", "load.wind");
  EXPECT_EQ(toile(folder, "drape scene.toml --dry-run --resume first/checkpoint").code, 2);
  // Into another folder, on to a later time.
  EXPECT_EQ(toile(folder, "drape scene.toml -o other --resume first/checkpoint").code, 0);
  ASSERT_EQ(toile(folder, "drape scene.toml -o whole").code, 0);
  EXPECT_EQ(read_file(folder / "other/draped.igs"), read_file(folder / "whole/draped.igs"));
  EXPECT_EQ(read_file(folder / "other/history.csv"), read_file(folder / "whole/history.csv"));
  EXPECT_EQ(toile(folder, "drape scene.toml -o whole --resume first/checkpoint").code, 8) << "another run's folder";
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
  EXPECT_EQ(end_by(folder, "INT", "study study.toml -o result", "result/runs/*.json"), 130)
      << read_file(folder / "stderr.txt");
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
