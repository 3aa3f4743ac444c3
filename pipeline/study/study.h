// SPDX-License-Identifier: GPL-3.0-or-later
// A study: one scene run many times with something varied, each run a process of its own, judged against a reference
// (kind "convergence") or for being stable, refused or stopped with a cause (kind "stability").
// (pipeline/study/README.md)
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pipeline/base/console.h"
#include "pipeline/study/convergence.h"
#include "pipeline/study/process.h"

namespace toile {

// A scene key and its value as TOML text: what --set takes.
struct StudySetting {
  std::string key, value;
  std::string where;  // "study.toml:12"
  std::string text() const { return key + "=" + value; }
};

struct StudyCase {
  std::string label;                   // what is varied, for people: "control_points = [10, 10], dt = 0.001"
  std::vector<StudySetting> varied;    // by the axes, in their order
  std::vector<StudySetting> settings;  // everything that --set gets, the study's and the series' own first
  std::vector<std::size_t> at;         // entry on each axis
};

// What is looked at: entries of report.json by dotted paths ("points.0.position.2") or names of its measures. An entry
// that is an array joins with all its numbers; several numbers are compared by distance.
struct StudyQuantity {
  std::vector<std::string> paths;
  std::string name, unit;
};

struct StudyReference {
  enum class Kind { none, finest, richardson, given } kind = Kind::none;
  Eigen::VectorXd value;        // given
  double uncertainty = 0;       // given
  std::string source;           // given: where it comes from
  std::optional<double> order;  // richardson: assumed instead of observed
  std::string of;               // finest, richardson: the series that it is taken from; empty: each its own
  bool relative = false;        // errors over the norm of the reference
};

// Axis values are listed from coarse to fine; a case is one entry of each, the last axis varying fastest.
struct StudySeries {
  std::string name;
  std::filesystem::path scene;
  StudyQuantity quantity;
  StudyReference reference;
  std::vector<std::string> axes;     // names
  std::vector<std::size_t> lengths;  // entries of each axis
  std::vector<StudyCase> cases;
};

struct Study {
  std::string name, title;
  std::filesystem::path path;
  bool stability = false;
  int repeats = 1;
  ProcessLimits limits;
  std::vector<std::string> columns;     // entries of the report that study.csv holds too
  std::optional<double> largest_error;  // [check] error: of each series' finest case, or of every stable run
  std::vector<StudySeries> series;
};

// Throws InputError `study.toml:12: ...`, the nearest key named.
Study read_study(const std::filesystem::path& path);
Study parse_study(std::string_view text, const std::filesystem::path& path);

enum class RunStatus { ok, check, refused, stopped, timeout, failed, not_run };
const char* name(RunStatus status);  // as in study.csv

enum class Verdict { none, stable, refused, stopped, bad };
const char* name(Verdict verdict);

// What a run's report says, as far as it goes.
struct RunFacts {
  std::string model, scheme, mesh, degree, spans;
  std::optional<double> spans_u, spans_v, elements;  // knot spans a direction and in all, summed over panels
  std::optional<double> dofs, dt;                    // dt: mean step [s]
  std::optional<double> wall_seconds;
  std::map<std::string, double> seconds;  // by phase
  Eigen::VectorXd value;                  // empty where the quantity isn't there
  std::string unit;                       // of the quantity, where the report says one
  std::vector<std::string> columns;
};

struct StudyRun {
  std::string id;  // names runs/<id>/ and runs/<id>.log
  int repeat = 0;
  bool reused = false;  // from an earlier call with identical input
  ProcessResult process;
  RunStatus status = RunStatus::not_run;
  Verdict verdict = Verdict::none;
  std::string cause;  // why it isn't ok, or is bad
  RunFacts facts;
  std::optional<double> error;
};

struct CaseResult {
  std::vector<StudyRun> runs;                   // one per repeat
  std::optional<std::size_t> first;             // of the runs that have a value
  bool differs = false;                         // the runs' values aren't the same to the last bit
  double wall = 0, wall_min = 0, wall_max = 0;  // s: median, least, most; 0 where no run says
  const StudyRun& shown() const { return runs[first.value_or(0)]; }
};

struct AxisOrder {
  std::string axis, size;  // the axis; "dt" or "h", what the order is in
  ObservedOrder order;
};

struct SeriesResult {
  std::vector<CaseResult> cases;  // as in the series
  Eigen::VectorXd reference;      // empty: there is none, see `no_reference`
  double uncertainty = 0;         // NaN: unknown
  std::string reference_text;     // what it is, its uncertainty and where that comes from
  std::string no_reference;
  std::vector<AxisOrder> orders;  // each along one axis, the others at their last entry
};

struct StudyResult {
  std::vector<SeriesResult> series;
  std::vector<std::string> failed_checks;
  bool interrupted = false;
  int count(Verdict verdict) const;
};

// Repeats, references, errors, orders and checks, out of the facts of the runs.
void evaluate(const Study& study, StudyResult& result);

// Stable, refused, stopped or bad, with the cause, of a run that ended, whose files are in `directory`.
//   stable: exit ok, less energy injected than 1 % of the work of gravity, the strain limit kept where there is one;
//   refused: exit 3 or 4 with a cause, no files; stopped: exit 5, 6 or 7 with a cause, or out of time and
//   ending when asked to;
//   bad: everything else, and any run with a number in its files that isn't finite.
void judge(StudyRun& run, const std::filesystem::path& directory);

// The first number that isn't finite in the files of a run ("report.json: null at strain.max_weft"); empty for none.
std::string not_finite_in(const std::filesystem::path& directory);

struct StudyOptions {
  std::filesystem::path program;                   // runs as `program drape SCENE --set ... -o DIR`
  std::optional<std::filesystem::path> directory;  // unset: out/<study name>
  bool overwrite = false;                          // run again what a former call ran
  bool json = false;                               // study.json on standard output instead of the table
  int threads = 1;                                 // of each run
};

// Runs what isn't there yet and writes study.csv, study.json and the plots. Returns the exit code: 6 where a check
// failed, a run is bad or no run has a value; 130 after SIGINT or SIGTERM, with the finished runs written. Throws
// OutputError.
int run_study(const Study& study, const StudyOptions& options, Console& console);

std::string study_csv(const Study& study, const StudyResult& result);
std::string study_table(const Study& study, const StudyResult& result);
std::string study_json(const Study& study, const StudyResult& result);
// File name and SVG text.
std::vector<std::pair<std::string, std::string>> study_plots(const Study& study, const StudyResult& result);

}  // namespace toile
