// SPDX-License-Identifier: GPL-3.0-or-later
// What the program says on the screen: help, suggestions, what to do next.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "io/file.h"
#include "pipeline/panels.h"

namespace toile {
namespace {

using test::Folder;

struct Outcome {
  int code = -1;
  std::string out, err;
};

Outcome shell(const Folder& folder, const std::string& command) {
  const int status =
      std::system(("cd '" + folder.path().string() + "' && " + command + " >stdout.txt 2>stderr.txt").c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_file(folder / "stdout.txt"),
          read_file(folder / "stderr.txt")};
}

Outcome toile(const Folder& folder, const std::string& arguments) {
  return shell(folder, "'" TOILE_PROGRAM "' " + arguments);
}

struct Small : Folder {
  explicit Small(const std::string& name) : Folder(name) {
    test::write_panels(*this / "panel.igs", {test::trimmed_sheet("cloth")});
    write_file(*this / "scene.toml", test::scene_text("[[pin]]\nat = \"curve:0,2\"\n"));
  }
};

bool says(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

// The commands that `toile help` lists.
std::vector<std::string> commands(const Folder& folder) {
  const std::string help = toile(folder, "help").out;
  std::istringstream lines(help.substr(help.find("Commands:\n") + 10));
  std::vector<std::string> names;
  for (std::string line, name; std::getline(lines, line) && line.starts_with("  ");) {
    std::istringstream(line) >> name;
    names.push_back(name);
  }
  return names;
}

// The long options that a command's help shows.
std::set<std::string> shown_options(const std::string& help) {
  std::set<std::string> options;
  const std::regex option("\n  (?:-\\w,)?(--[a-z-]+)");
  for (std::sregex_iterator it(help.begin(), help.end(), option), end; it != end; ++it) options.insert((*it)[1]);
  return options;
}

TEST(Words, TheProgramAloneShowsItsHelpAndIsExit2) {
  const Folder folder("alone");
  const Outcome alone = toile(folder, ""), help = toile(folder, "help"), flag = toile(folder, "--help");
  EXPECT_EQ(alone.code, 2);
  EXPECT_EQ(help.code, 0);
  EXPECT_EQ(flag.code, 0);
  EXPECT_EQ(alone.out, "");
  EXPECT_EQ(alone.err, help.out);
  EXPECT_EQ(flag.out, help.out);
}

TEST(Words, EveryCommandHasHelpWithExamplesAndExitCodes) {
  const Folder folder("help");
  const auto names = commands(folder);
  EXPECT_GE(names.size(), 11u);
  for (const std::string& name : names) {
    const Outcome help = toile(folder, "help " + name), flag = toile(folder, name + " --help");
    EXPECT_EQ(help.code, 0) << help.err;
    EXPECT_EQ(help.out, flag.out);
    for (const std::string& part :
         {"Usage: toile " + name, std::string("Examples:\n  toile "), std::string("Exit codes:\n  0 ")})
      EXPECT_TRUE(says(help.out, part)) << name << " lacks " << part << "\n" << help.out;
  }
}

TEST(Words, AWrongWordNamesTheNearest) {
  const Small folder("nearest");
  const std::pair<const char*, const char*> cases[] = {
      {"drpe scene.toml", "toile has no command 'drpe'; did you mean 'drape'?"},
      {"drape scene.toml --overwirte", "toile drape has no option '--overwirte'; did you mean '--overwrite'?"},
      {"convert panel.igs a.svg --degre=2", "no option '--degre'; did you mean '--degree'?"},
      {"init hnag", "did you mean 'hang'?"},
      {"help inspcet", "did you mean 'inspect'?"},
      {"schema sceen", "did you mean 'scene'?"},
      {"drape panel.igs --pin curve:0,2 --fabric armour", "did you mean 'armor'?"},
      {"scene.toml", "toile drape scene.toml"},
      {"panel.igs", "toile inspect panel.igs"},
      {"drape scene.toml more", "no use for 'more'"},
      {"drape", "SCENE is required"},
  };
  for (const auto& [arguments, part] : cases) {
    const Outcome run = toile(folder, arguments);
    EXPECT_EQ(run.code, 2) << arguments;
    EXPECT_TRUE(says(run.err, part)) << arguments << ": " << run.err;
    EXPECT_EQ(run.out, "") << arguments;
  }
}

TEST(Words, AFileOfAnotherKindIsSentToItsCommand) {
  const Small folder("kinds");
  write_file(folder / "study.toml", "scene = \"scene.toml\"\nvary.solver.dt = [0.1]\n");
  for (const char* command : {"inspect scene.toml", "convert scene.toml a.svg", "roundtrip scene.toml"}) {
    const Outcome run = toile(folder, command);
    EXPECT_EQ(run.code, 3) << command;
    EXPECT_TRUE(says(run.err, "scene.toml is a scene") && says(run.err, "toile drape scene.toml")) << run.err;
  }
  EXPECT_TRUE(says(toile(folder, "inspect study.toml").err, "toile study study.toml"));
  EXPECT_TRUE(says(toile(folder, "drape study.toml").err, "toile study study.toml"));
  EXPECT_TRUE(says(toile(folder, "study scene.toml").err, "toile drape scene.toml"));
  EXPECT_TRUE(says(toile(folder, "check panel.igs").err, "toile inspect panel.igs"));
}

TEST(Words, HelpShowsOnlyFlagsThatAct) {
  const Folder folder("flags");
  const auto shows = [&](const std::string& command, const std::string& option) {
    return shown_options(toile(folder, "help " + command).out).contains(option);
  };
  for (const char* command : {"drape", "inspect", "study"}) EXPECT_TRUE(shows(command, "--threads")) << command;
  for (const char* command : {"presets", "convert", "check", "init"})
    EXPECT_FALSE(shows(command, "--threads")) << command;
  for (const char* command : {"drape", "study"}) EXPECT_TRUE(shows(command, "--no-progress")) << command;
  for (const char* command : {"inspect", "roundtrip", "schema"})
    EXPECT_FALSE(shows(command, "--no-progress")) << command;
  EXPECT_EQ(toile(folder, "presets --threads 2 --no-progress").code, 0) << "common options are taken by every command";
}

TEST(Words, QuietSaysErrorsOnly) {
  const Small folder("quiet");
  const Outcome run = toile(folder, "drape scene.toml -q -o result");
  EXPECT_EQ(run.code, 0);
  EXPECT_EQ(run.out + run.err, "");
  const Outcome failed = toile(folder, "drape scene.toml -q -o result");
  EXPECT_EQ(failed.code, 8);
  EXPECT_TRUE(failed.err.starts_with("error: ") && failed.err.find('\n') + 1 == failed.err.size()) << failed.err;
}

TEST(Words, TheEndOfADrapeNamesStrainsAndWhatToOpen) {
  const Small folder("end");
  const Outcome run = toile(folder, "drape scene.toml -o result --set 'output.formats=[\"vtu\"]'");
  ASSERT_EQ(run.code, 0) << run.err;
  const auto strain = nlohmann::json::parse(read_file(folder / "result/report.json"))["strain"];
  EXPECT_LT(strain["min_shear"], strain["max_shear"]);
  EXPECT_LE(std::abs(strain["mean_abs_shear"].get<double>()),
            std::max(-strain["min_shear"].get<double>(), strain["max_shear"].get<double>()));
  std::smatch found;
  ASSERT_TRUE(std::regex_search(
      run.err, found, std::regex("strain (\\S+) to (\\S+) weft, (\\S+) to (\\S+) warp, (\\S+) to (\\S+) shear")))
      << run.err;
  const char* keys[] = {"min_weft", "max_weft", "min_warp", "max_warp", "min_shear", "max_shear"};
  for (std::size_t k = 0; k < 6; ++k) {
    const double said = std::stod(found[k + 1]), value = strain[keys[k]];
    EXPECT_NEAR(said, value, 0.06 * std::abs(value)) << keys[k];
  }
  std::istringstream lines(run.err.substr(run.err.find("wrote result; open\n") + 19));
  int files = 0;
  for (std::string line, file; std::getline(lines, line); ++files) {
    std::istringstream(line) >> file;
    EXPECT_TRUE(std::filesystem::exists(folder / file)) << line;
  }
  EXPECT_GE(files, 3);
}

TEST(Words, TheWallTimeIncludesFiles) {
  const Small folder("wall");
  const Outcome run =
      toile(folder, "drape scene.toml -o result --set output.every=0.01 --set 'output.formats=[\"vtu\"]'");
  std::smatch found;
  ASSERT_TRUE(std::regex_search(run.err, found, std::regex("; (\\S+) s of wall time, files included"))) << run.err;
  const auto report = nlohmann::json::parse(read_file(folder / "result/report.json"));
  const double whole = std::stod(found[1]), files = report["seconds"]["write"];
  EXPECT_GE(whole + 0.005, report["wall_seconds"].get<double>() + files);
}

// The command that a stopped run shows is copied into a shell as it stands, but for the time limit.
Outcome go_on(const Folder& folder, const Outcome& stopped) {
  const std::size_t at = stopped.err.find("to go on from here:\n");
  if (at == std::string::npos) return stopped;
  std::string command = stopped.err.substr(at + 20);
  command.pop_back();
  return shell(folder, std::regex_replace(command, std::regex("--time-limit 1e-9"), "--time-limit 600"));
}

TEST(Words, AStoppedRunSaysHowToGoOn) {
  const Small folder("go_on");
  const std::string options = "drape scene.toml --set 'pin.0.at=\"curve:0,2\"' --until 0.05 ";
  const Outcome stopped = toile(folder, options + "-o 'the result' --time-limit 1e-9");
  ASSERT_EQ(stopped.code, 7) << stopped.err;
  const Outcome resumed = go_on(folder, stopped);
  ASSERT_EQ(resumed.code, 0) << stopped.err << resumed.err;
  ASSERT_EQ(toile(folder, options + "-o whole").code, 0);
  EXPECT_EQ(read_file(folder / "the result/draped.igs"), read_file(folder / "whole/draped.igs"));
}

TEST(Words, TheCommandToGoOnHasEveryOptionThatMadeTheRun) {
  const Folder folder("go_on_all");
  const std::string file = std::string(TOILE_SAMPLES) + "/dxf_pieces/apron.dxf";
  const Outcome stopped = toile(
      folder, "drape '" + file +
                  "' --pin curve:0,0 --pin curve:0,2 --set output.preview=false --until 0.001 "
                  "--size all --unit inch --outline sew --span '9 m' --degree 3 --fabric armor --threads 2 --json "
                  "-o first --overwrite --time-limit 1e-9");
  if (stopped.code == 3) GTEST_SKIP() << "built without dxflib";
  ASSERT_EQ(stopped.code, 7) << stopped.err;
  const Outcome resumed = go_on(folder, stopped);
  ASSERT_EQ(resumed.code, 0) << stopped.err << resumed.err;
  EXPECT_TRUE(nlohmann::json::accept(resumed.out)) << "--json";
}

TEST(Words, TheWarningOfStrainBetweenPointsNamesASpanThatHelps) {
  const Small folder("span");
  const Outcome quick =
      toile(folder,
            "drape panel.igs --pin curve:0,2 --span '80 mm' --until 0.1 -o quick --set 'load.gravity=[200, -200, 0]' "
            "--set output.preview=false");
  std::smatch span;
  ASSERT_TRUE(std::regex_search(quick.err, span, std::regex("--span \"([0-9.]+) mm\""))) << quick.err;
  EXPECT_NEAR(std::stod(span[1]), 40, 1) << "half of 80 mm";
  const Outcome scene =
      toile(folder, "drape scene.toml -o result --set 'traction=[{ along = \"curve:0,0\", force = [4, 0, 0] }]'");
  EXPECT_TRUE(says(scene.err, "refine = { span = \"40 mm\" }")) << scene.err;
}

TEST(Words, InitSaysWhatItWroteAsJson) {
  const Folder folder("init_json");
  const Outcome list = toile(folder, "init --json"), written = toile(folder, "init hang --json");
  EXPECT_EQ(nlohmann::json::parse(list.out)[0]["name"], "hang");
  const auto json = nlohmann::json::parse(written.out);
  EXPECT_EQ(json["written"].size(), 2u);
  for (const auto& file : json["written"]) EXPECT_TRUE(std::filesystem::exists(folder / file.get<std::string>()));
}

// In bash itself, where there is one.
TEST(Words, BashCompletesCommandsOptionsAndFiles) {
  const Small folder("bash");
  if (shell(folder, "bash -c true").code != 0) GTEST_SKIP() << "no bash here";
  write_file(folder / "completion.bash", toile(folder, "completion bash").out);
  std::filesystem::create_directory(folder / "results");
  const auto completed =
      [&](const std::string& words) {
        std::ofstream(folder / "ask.bash")
            << "source completion.bash\nCOMP_WORDS=(" << words
            << ")\nCOMP_CWORD=$((${#COMP_WORDS[@]} - 1))\n_toile\nprintf '%s\\n' \"${COMPREPLY[@]}\"\n";
        const Outcome run = shell(folder, "bash ask.bash");
        std::istringstream lines(run.out);
        std::set<std::string> out;
        for (std::string line; std::getline(lines, line);) out.insert(line);
        return out;
      };
  using Set = std::set<std::string>;
  EXPECT_EQ(completed("toile dr"), Set{"drape"});
  const auto all = completed("toile ''");
  for (const std::string& name : commands(folder)) {
    EXPECT_TRUE(all.contains(name)) << name;
    const std::string help = toile(folder, "help " + name).out;
    const auto options = completed("toile " + name + " --");
    EXPECT_EQ(options, shown_options(help)) << name;
  }
  EXPECT_EQ(completed("toile drape sc"), Set{"scene.toml"});
  EXPECT_EQ(completed("toile drape scene.toml -o res"), Set{"results"});
  EXPECT_EQ(completed("toile schema s"), (Set{"scene", "study"}));
  EXPECT_EQ(completed("toile init s"), Set{"skirt"});
  EXPECT_EQ(completed("toile drape --color n"), Set{"never"});
}

}  // namespace
}  // namespace toile
