// SPDX-License-Identifier: GPL-3.0-or-later
// The runs of a study: a process each, with a record beside it that lets a later call go on.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>

#include "geometry/error.h"
#include "io/file.h"
#include "pipeline/base/exit_code.h"
#include "pipeline/base/interrupt.h"
#include "pipeline/base/json_text.h"
#include "pipeline/base/version.h"
#include "pipeline/scene/scene.h"
#include "pipeline/scene/toml_table.h"
#include "pipeline/study/study.h"

namespace toile {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// FNV-1a, 64 bits: tells inputs apart, guards nothing.
class Hash {
 public:
  void add(std::string_view bytes) {
    for (const char c : bytes) value_ = (value_ ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
    value_ = (value_ ^ 0xffu) * 0x100000001b3u;  // "ab", "c" isn't "a", "bc"
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325u;
};

std::string slug(const std::string& text) {
  std::string out;
  for (const char c : text) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-';
    if (plain) out += c;
    if (!plain && !out.empty() && out.back() != '_') out += '_';
  }
  while (!out.empty() && (out.back() == '_' || out.back() == '.')) out.pop_back();
  return out.substr(0, 48);
}

std::string run_id(const StudySeries& series, const StudyCase& c, int repeat) {
  Hash hash;
  hash.add(series.name);
  hash.add(series.scene.string());
  for (const StudySetting& setting : c.settings) hash.add(setting.text());
  const std::string start = slug(series.name), end = slug(c.label);
  return fmt::format("{}{}{}-{:08x}-{}", start, end.empty() ? "" : "-", end, hash.value() & 0xffffffffu, repeat + 1);
}

// All that a run depends on: the program, the scene with its settings and panel files, the limits.
std::uint64_t input_of(const Study& study, const StudySeries& series, const StudyCase& c, const StudyOptions& options) {
  Hash hash;
  std::error_code error;
  hash.add(version());
  hash.add(fmt::format("{} {}", fs::file_size(options.program, error),
                       fs::last_write_time(options.program, error).time_since_epoch().count()));
  hash.add(fmt::format("{} {} {}", study.limits.seconds, study.limits.megabytes, options.threads));
  hash.add(read_file(series.scene));
  std::vector<std::string> settings;
  for (const StudySetting& setting : c.settings) {
    settings.push_back(setting.text());
    hash.add(settings.back());
  }
  try {
    for (const ScenePanel& panel : read_scene(series.scene, settings).panels) hash.add(read_file(panel.file));
  } catch (const Error&) {
    // The run will say what is wrong with the scene.
  }
  return hash.value();
}

// Number at a dotted path of the report, or of a measure of that name; an object with a value stands for it.
const Json* find(const Json& report, const std::string& path) {
  const auto walk = [&](const Json& from) -> const Json* {
    const Json* at = &from;
    std::istringstream parts(path);
    for (std::string part; at && std::getline(parts, part, '.');) {
      if (at->is_object() && at->contains(part)) {
        at = &at->at(part);
      } else if (at->is_array() && !part.empty() && part.size() < 9 && std::ranges::all_of(part, ::isdigit) &&
                 std::stoul(part) < at->size()) {
        at = &at->at(std::stoul(part));
      } else {
        at = nullptr;
      }
    }
    return at;
  };
  const Json* found = walk(report);
  if (!found && report.contains("measures")) found = walk(report["measures"]);
  return found && found->is_object() && found->contains("value") ? &found->at("value") : found;
}

std::optional<double> number(const Json& report, const std::string& path) {
  const Json* found = find(report, path);
  if (!found || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

std::string text(const Json& report, const std::string& path) {
  const Json* found = find(report, path);
  return found && found->is_string() ? found->get<std::string>() : "";
}

// The numbers at a path in order; false where there is anything else.
bool collect(const Json& json, std::vector<double>& numbers) {
  if (json.is_number()) {
    numbers.push_back(json.get<double>());
    return std::isfinite(numbers.back());
  }
  return json.is_array() && !json.empty() &&
         std::ranges::all_of(json, [&](const Json& j) { return collect(j, numbers); });
}

// Degree, spans and mesh over all panels: "2", "8x8", "uncut"; several panels joined by "+".
void read_panels(const Json& report, RunFacts& facts) {
  if (!report.contains("panels") || !report["panels"].is_array()) return;
  double elements = 0, along_u = 0, along_v = 0;
  bool cut = false;
  std::vector<std::string> degrees, spans;
  for (const Json& panel : report["panels"]) {
    std::vector<double> p, s;
    if (!collect(panel.value("degree", Json()), p) || !collect(panel.value("spans", Json()), s)) return;
    if (p.size() != 2 || s.size() != 2) return;
    degrees.push_back(p[0] == p[1] ? fmt::format("{}", p[0]) : fmt::format("{}x{}", p[0], p[1]));
    spans.push_back(fmt::format("{}x{}", s[0], s[1]));
    elements += s[0] * s[1];
    along_u += s[0];
    along_v += s[1];
    cut = cut || number(panel, "cells.cut").value_or(0) > 0;
  }
  if (std::ranges::all_of(degrees, [&](const std::string& d) { return d == degrees[0]; })) degrees.resize(1);
  facts.degree = fmt::format("{}", fmt::join(degrees, "+"));
  facts.spans = fmt::format("{}", fmt::join(spans, "+"));
  facts.mesh = cut ? "cut" : "uncut";
  facts.elements = elements;
  facts.spans_u = along_u;
  facts.spans_v = along_v;
}

// Returns what is wrong with the report; empty where it has the quantity.
std::string read_facts(const fs::path& file, const StudyQuantity& quantity, const std::vector<std::string>& columns,
                       RunFacts& facts) {
  const Json report = Json::parse(read_file(file), nullptr, false);
  if (report.is_discarded()) return "report.json is broken";
  facts.model = text(report, "model");
  facts.scheme = text(report, "scheme");
  facts.dofs = number(report, "degrees_of_freedom");
  facts.wall_seconds = number(report, "wall_seconds");
  const auto steps = number(report, "steps"), time = number(report, "simulated_seconds");
  if (steps && time && *steps > 0) facts.dt = *time / *steps;
  read_panels(report, facts);
  if (report.contains("seconds") && report["seconds"].is_object()) {
    for (const auto& [phase, seconds] : report["seconds"].items()) {
      if (seconds.is_number()) facts.seconds[phase] = seconds.get<double>();
    }
  }
  for (const std::string& column : columns) {
    const Json* found = find(report, column);
    std::vector<double> values;
    const bool numbers = found && collect(*found, values);
    facts.columns.push_back(numbers                       ? fmt::format("{}", fmt::join(values, " "))
                            : found && found->is_string() ? found->get<std::string>()
                                                          : "");
  }
  std::vector<double> values;
  for (const std::string& path : quantity.paths) {
    const Json* found = find(report, path);
    if (!found) {
      std::vector<std::string> names;
      for (const char* holder : {"", "measures"}) {
        const Json& in = *holder && report.contains(holder) ? report[holder] : report;
        if (in.is_object()) {
          for (const auto& [key, value] : in.items()) names.push_back(key);
        }
      }
      return fmt::format("report.json has no '{}'{}", path, suggestion(path, names));
    }
    if (!collect(*found, values)) return fmt::format("'{}' in report.json is no finite number", path);
    if (const Json* unit = find(report, "measures." + path + ".unit"); unit && unit->is_string()) facts.unit = *unit;
  }
  facts.value = Eigen::Map<Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  return "";
}

// What the program itself said last: the line that starts with "error:".
std::string stated_cause(const fs::path& log) {
  std::istringstream lines(read_file(log));
  std::string cause;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("error: ")) cause = line.substr(7);
  }
  return utf8(cause);
}

void classify(StudyRun& run, const fs::path& log, const ProcessLimits& limits) {
  const ProcessResult& p = run.process;
  using End = ProcessResult::End;
  if (p.end == End::stopped) return;
  run.cause = stated_cause(log);
  if (p.end == End::timed_out) {
    run.status = RunStatus::timeout;
    run.cause = fmt::format("not done after {:g} s{}{}", limits.seconds, run.cause.empty() ? "" : ": ", run.cause);
    return;
  }
  if (p.end == End::killed_by_signal) {
    run.status = RunStatus::failed;
    run.cause = fmt::format("killed by signal {} ({})", p.code, strsignal(p.code));
    return;
  }
  switch (p.code) {
    case exit_ok:
      run.status = RunStatus::ok;
      run.cause.clear();
      return;
    case exit_check:
      run.status = RunStatus::check;
      return;
    case exit_input:
    case exit_geometry:
      run.status = RunStatus::refused;
      return;
    case exit_solver:
    case exit_time_limit:
      run.status = RunStatus::stopped;
      return;
    default:
      run.status = RunStatus::failed;
      run.cause = fmt::format("exit code {}{}{}", p.code, run.cause.empty() ? "" : ": ", run.cause);
  }
}

class Runner {
 public:
  Runner(const Study& study, const StudyOptions& options, Console& console)
      : study_(study),
        options_(options),
        console_(console),
        directory_(options.directory.value_or(fs::path("out") / study.name)) {}

  StudyResult operator()() {
    prepare();
    StudyResult result;
    total_ = 0;
    for (const StudySeries& series : study_.series)
      total_ += series.cases.size() * static_cast<std::size_t>(study_.repeats);
    for (const StudySeries& series : study_.series) {
      result.series.emplace_back().cases.resize(series.cases.size());
      for (CaseResult& c : result.series.back().cases) c.runs.resize(static_cast<std::size_t>(study_.repeats));
    }
    // Repeats are the outer loop: what disturbs the machine for a while then disturbs one repeat of many cases.
    for (int repeat = 0; repeat < study_.repeats; ++repeat) {
      for (std::size_t s = 0; s < study_.series.size(); ++s) {
        for (std::size_t k = 0; k < study_.series[s].cases.size(); ++k) {
          StudyRun& run = result.series[s].cases[k].runs[static_cast<std::size_t>(repeat)];
          run.repeat = repeat;
          one(study_.series[s], study_.series[s].cases[k], run);
        }
      }
    }
    result.interrupted = guard_.asked();
    return result;
  }

  const fs::path& directory() const { return directory_; }

 private:
  // A folder that holds something else than a study is left alone.
  void prepare() const {
    std::error_code error;
    if (fs::exists(directory_, error)) {
      if (!fs::is_directory(directory_, error)) throw OutputError(directory_.string() + " is not a directory");
      if (!fs::is_empty(directory_, error) && !fs::exists(directory_ / "runs", error) && !options_.overwrite) {
        throw OutputError(
            fmt::format("{} is not empty and holds no study; give --overwrite to write into it, or another "
                        "-o DIR",
                        directory_.string()));
      }
    }
    fs::create_directories(directory_ / "runs", error);
    if (error) throw OutputError(fmt::format("{}: {}", (directory_ / "runs").string(), error.message()));
  }

  void one(const StudySeries& series, const StudyCase& c, StudyRun& run) {
    run.id = run_id(series, c, run.repeat);
    ++done_;
    if (guard_.asked()) return;
    const fs::path folder = directory_ / "runs" / run.id, log = folder.string() + ".log",
                   record = folder.string() + ".json";
    const std::string input = fmt::format("{:016x}", input_of(study_, series, c, options_));
    run.reused = !options_.overwrite && read_record(record, input, run.process);
    if (!run.reused) {
      console_.live(
          fmt::format("run {} of {}: {}{}{}", done_, total_, series.name, c.label.empty() ? "" : ", ", c.label));
      std::error_code error;
      fs::remove(record, error);
      fs::remove_all(folder, error);
      run.process = run_process(command(series, c, folder), log, study_.limits, [this] { return guard_.asked(); });
      if (run.process.end == ProcessResult::End::stopped) return;
      write_record(record, input, run.process);
    }
    classify(run, log, study_.limits);
    if (fs::exists(folder / "report.json") && (run.status == RunStatus::ok || run.status == RunStatus::check)) {
      const std::string wrong = read_facts(folder / "report.json", series.quantity, study_.columns, run.facts);
      if (!wrong.empty()) {
        run.status = RunStatus::failed;
        run.cause = wrong;
      }
    } else if (run.status == RunStatus::ok) {
      run.status = RunStatus::failed;
      run.cause = "it left no report.json";
    } else if (fs::exists(folder / "report.json")) {
      // What it says of its size is worth a place in the plots; its values are those of an unfinished run.
      read_facts(folder / "report.json", {}, study_.columns, run.facts);
      run.facts.value.resize(0);
    }
    if (!run.facts.wall_seconds) run.facts.wall_seconds = run.process.wall_seconds;
    if (study_.stability) judge(run, folder);
    console_.detail(fmt::format("run {} of {}: {}: {}{}{}", done_, total_, run.id, name(run.status),
                                run.cause.empty() ? "" : ": ", run.cause));
  }

  std::vector<std::string> command(const StudySeries& series, const StudyCase& c, const fs::path& folder) const {
    std::vector<std::string> words{options_.program.string(), "drape", series.scene.string()};
    for (const StudySetting& setting : c.settings) {
      words.push_back("--set");
      words.push_back(setting.text());
    }
    words.insert(words.end(), {"-o", folder.string(), "--threads", fmt::format("{}", options_.threads), "--no-progress",
                               "--color", "never"});
    return words;
  }

  static bool read_record(const fs::path& file, const std::string& input, ProcessResult& result) {
    std::error_code error;
    if (!fs::exists(file, error)) return false;
    const Json json = Json::parse(read_file(file), nullptr, false);
    if (!json.is_object()) return false;
    for (const char* key : {"end", "answered", "code", "wall_seconds", "cpu_seconds", "peak_megabytes"}) {
      if (!json.contains(key) || !json[key].is_number()) return false;
    }
    if (!json.contains("input") || json["input"] != input) return false;
    result.end = static_cast<ProcessResult::End>(json["end"].get<int>());
    result.answered = json["answered"].get<int>() != 0;
    result.code = json["code"];
    result.wall_seconds = json["wall_seconds"];
    result.cpu_seconds = json["cpu_seconds"];
    result.peak_megabytes = json["peak_megabytes"];
    return true;
  }

  static void write_record(const fs::path& file, const std::string& input, const ProcessResult& result) {
    const Json json = {{"input", input},
                       {"end", static_cast<int>(result.end)},
                       {"answered", result.answered ? 1 : 0},
                       {"code", result.code},
                       {"wall_seconds", result.wall_seconds},
                       {"cpu_seconds", result.cpu_seconds},
                       {"peak_megabytes", result.peak_megabytes}};
    write_file(file, json_text(json) + "\n");
  }

  const InterruptGuard guard_;  // the results are written under it too
  const Study& study_;
  const StudyOptions& options_;
  Console& console_;
  fs::path directory_;
  std::size_t total_ = 0, done_ = 0;
};

}  // namespace

const char* name(RunStatus status) {
  switch (status) {
    case RunStatus::ok:
      return "ok";
    case RunStatus::check:
      return "check";
    case RunStatus::refused:
      return "refused";
    case RunStatus::stopped:
      return "stopped";
    case RunStatus::timeout:
      return "timeout";
    case RunStatus::failed:
      return "failed";
    case RunStatus::not_run:
      return "not run";
  }
  return "";
}

const char* name(Verdict verdict) {
  switch (verdict) {
    case Verdict::none:
      return "";
    case Verdict::stable:
      return "stable";
    case Verdict::refused:
      return "refused";
    case Verdict::stopped:
      return "stopped";
    case Verdict::bad:
      return "BAD";
  }
  return "";
}

int run_study(const Study& study, const StudyOptions& options, Console& console) {
  Runner runner(study, options, console);
  StudyResult result = runner();
  console.end_live();
  evaluate(study, result);

  const fs::path& directory = runner.directory();
  const std::string json = study_json(study, result);
  write_file(directory / "study.csv", study_csv(study, result));
  write_file(directory / "study.json", json);
  for (const auto& [file, svg] : study_plots(study, result)) write_file(directory / file, svg);
  fmt::print("{}", options.json ? json : study_table(study, result));
  console.note("wrote " + directory.string());

  int runs = 0, reused = 0, values = 0;
  for (const SeriesResult& s : result.series) {
    for (const CaseResult& c : s.cases) {
      for (const StudyRun& run : c.runs) {
        ++runs;
        reused += run.reused;
        values += run.facts.value.size() > 0;
      }
    }
  }
  if (reused > 0)
    console.note(fmt::format("{} of {} runs are from an earlier call; --overwrite runs them again", reused, runs));
  if (result.interrupted) {
    console.error("interrupted; the same command goes on with the runs that are left");
    return exit_interrupted;
  }
  if (study.stability && result.count(Verdict::bad) > 0) {
    console.error(fmt::format("{} of {} runs are BAD", result.count(Verdict::bad), runs));
    return exit_check;
  }
  if (!study.stability && values == 0) {
    console.error("no run has a value");
    return exit_check;
  }
  for (const std::string& check : result.failed_checks) console.error(check);
  return result.failed_checks.empty() ? exit_ok : exit_check;
}

}  // namespace toile
