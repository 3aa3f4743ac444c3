// SPDX-License-Identifier: GPL-3.0-or-later
// A study's results as CSV, as a table, as JSON and as plots.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "geometry/text.h"
#include "io/csv.h"
#include "pipeline/base/json_text.h"
#include "pipeline/base/version.h"
#include "pipeline/picture/plot.h"
#include "pipeline/study/study.h"

namespace toile {
namespace {

using Json = nlohmann::ordered_json;

std::string exact(std::optional<double> value) {
  return value ? text(*value) : "";
}
std::string rounded(std::optional<double> value, int digits = 3) {
  return value ? fmt::format("{:.{}g}", *value, digits) : "";
}

std::string unit_of(const StudySeries& series, const RunFacts& facts) {
  return series.quantity.unit.empty() ? facts.unit : series.quantity.unit;
}
std::string unit_of(const StudySeries& series, const SeriesResult& result) {
  for (const CaseResult& c : result.cases) {
    if (const std::string unit = unit_of(series, c.shown().facts); !unit.empty()) return unit;
  }
  return series.quantity.unit;
}

// Every key that any series varies, in the order in which they appear.
std::vector<std::string> varied_keys(const Study& study) {
  std::vector<std::string> keys;
  for (const StudySeries& s : study.series) {
    for (const StudyCase& c : s.cases) {
      for (const StudySetting& setting : c.varied) {
        if (std::ranges::find(keys, setting.key) == keys.end()) keys.push_back(setting.key);
      }
    }
  }
  return keys;
}

std::string value_of(const StudyCase& c, const std::string& key) {
  for (const StudySetting& setting : c.varied) {
    if (setting.key == key) return setting.value;
  }
  return "";
}

// Columns as wide as their widest cell; numbers to the right.
std::string aligned(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> width(rows[0].size());
  for (const auto& row : rows) {
    for (std::size_t k = 0; k < row.size(); ++k) width[k] = std::max(width[k], row[k].size());
  }
  std::string out;
  for (const auto& row : rows) {
    std::string text;
    for (std::size_t k = 0; k < row.size(); ++k) {
      const bool number = !row[k].empty() && row[k].find_first_not_of("0123456789.e+-") == std::string::npos;
      text += number ? fmt::format("{:>{}}", row[k], width[k]) : fmt::format("{:<{}}", row[k], width[k]);
      text += "  ";
    }
    text.erase(text.find_last_not_of(' ') + 1);
    out += text + "\n";
  }
  return out;
}

// Some series has a reference.
bool compared(const Study& study) {
  return std::ranges::any_of(study.series,
                             [](const StudySeries& s) { return s.reference.kind != StudyReference::Kind::none; });
}

std::string wall_text(const CaseResult& c) {
  if (!(c.wall > 0)) return "";
  if (c.runs.size() == 1) return fmt::format("{:.3g}", c.wall);
  return fmt::format("{:.3g} ({:.3g} to {:.3g})", c.wall, c.wall_min, c.wall_max);
}

std::string order_text(const AxisOrder& o) {
  return fmt::format("{}: order {:.2f} in {}, last pair {:.2f}", o.axis, o.order.slope, o.size, o.order.last);
}

std::string cause_of(const CaseResult& c) {
  const StudyRun& run = c.shown();
  if (!c.differs) return run.cause;
  return fmt::format("repeats differ{}{}", run.cause.empty() ? "" : "; ", run.cause);
}

bool failed(const CaseResult& c) {
  return !c.first || c.shown().status != RunStatus::ok;
}

std::string title_of(const StudySeries& series, const StudyCase& c, const CaseResult& r) {
  const StudyRun& run = r.shown();
  std::string text = fmt::format("{}{}{}", series.name, c.label.empty() ? "" : ": ", c.label);
  if (run.error) text += fmt::format("; error {:.3g}", *run.error);
  if (failed(r)) text += fmt::format("; {}{}{}", name(run.status), run.cause.empty() ? "" : ": ", run.cause);
  return text;
}

// Cases joined by a line: those that differ along `axis` only; along the last axis without one.
std::vector<std::vector<std::size_t>> lines_along(const StudySeries& series, std::size_t axis) {
  std::vector<std::vector<std::size_t>> lines;
  std::vector<std::vector<std::size_t>> keys;
  for (std::size_t k = 0; k < series.cases.size(); ++k) {
    std::vector<std::size_t> key = series.cases[k].at;
    if (axis < key.size()) key[axis] = 0;
    const auto it = std::ranges::find(keys, key);
    if (it == keys.end()) {
      keys.push_back(key);
      lines.push_back({k});
    } else {
      lines[static_cast<std::size_t>(it - keys.begin())].push_back(k);
    }
  }
  return lines;
}

// The axis whose entries change `x`; the last one where none does.
template <class X>
std::size_t axis_of(const StudySeries& series, const SeriesResult& result, const X& x) {
  for (std::size_t a = 0; a < series.axes.size(); ++a) {
    for (const auto& cases : lines_along(series, a)) {
      const auto first = x(result.cases[cases[0]]);
      for (const std::size_t k : cases) {
        const auto other = x(result.cases[k]);
        if (first && other && *first != *other) return a;
      }
    }
  }
  return series.axes.empty() ? 0 : series.axes.size() - 1;
}

std::string error_name(const Study& study, const StudyResult& result) {
  const StudySeries& s = study.series[0];
  const std::string unit = unit_of(s, result.series[0]);
  if (s.reference.relative) return fmt::format("error of {}, relative", s.quantity.name);
  return unit.empty() ? fmt::format("error of {}", s.quantity.name)
                      : fmt::format("error of {} [{}]", s.quantity.name, unit);
}

template <class X>
LogPlot error_plot(const Study& study, const StudyResult& result, const std::string& x_name, bool spread,
                   const X& x_of) {
  LogPlot plot{study.title, x_name, error_name(study, result), "uncertainty of the reference", {}};
  for (std::size_t s = 0; s < study.series.size(); ++s) {
    const StudySeries& series = study.series[s];
    const SeriesResult& r = result.series[s];
    PlotSeries line{series.name, {}, {}, std::nullopt};
    for (const AxisOrder& order : r.orders) line.notes.push_back(order_text(order));
    if (r.uncertainty > 0) line.level = r.uncertainty;
    const std::size_t axis = spread ? (series.axes.empty() ? 0 : series.axes.size() - 1) : axis_of(series, r, x_of);
    for (const auto& cases : lines_along(series, axis)) {
      std::vector<PlotPoint>& points = line.lines.emplace_back();
      for (const std::size_t k : cases) {
        const CaseResult& c = r.cases[k];
        const StudyRun& run = c.shown();
        if (run.status == RunStatus::not_run) continue;
        PlotPoint p;
        p.failed = failed(c);
        p.title = title_of(series, series.cases[k], c);
        if (const auto x = x_of(c); x && *x > 0) p.x = *x;
        if (run.error && *run.error > 0) p.y = *run.error;
        // The run that is the reference has no error, and no place on a logarithmic axis.
        if (!p.y && !p.failed) continue;
        if (spread && c.runs.size() > 1) {
          p.x_low = c.wall_min;
          p.x_high = c.wall_max;
        }
        points.push_back(std::move(p));
      }
    }
    plot.series.push_back(std::move(line));
  }
  return plot;
}

std::vector<std::string> phases(const StudyResult& result) {
  std::vector<std::string> names;
  for (const SeriesResult& s : result.series) {
    for (const CaseResult& c : s.cases) {
      for (const auto& [phase, seconds] : c.shown().facts.seconds) {
        if (seconds > 0 && std::ranges::find(names, phase) == names.end()) names.push_back(phase);
      }
    }
  }
  std::ranges::sort(names);
  return names;
}

double phase_median(const CaseResult& c, const std::string& phase) {
  std::vector<double> seconds;
  for (const StudyRun& run : c.runs) {
    const auto it = run.facts.seconds.find(phase);
    if (it != run.facts.seconds.end()) seconds.push_back(it->second);
  }
  return seconds.empty() ? 0 : median(std::move(seconds));
}

BarPlot phase_plot(const Study& study, const StudyResult& result) {
  BarPlot plot{study.title + ": time by phase", "seconds of wall time, median of repeats", phases(result), {}};
  for (std::size_t s = 0; s < study.series.size(); ++s) {
    for (std::size_t k = 0; k < study.series[s].cases.size(); ++k) {
      const CaseResult& c = result.series[s].cases[k];
      std::vector<double> lengths;
      for (const std::string& phase : plot.parts) lengths.push_back(phase_median(c, phase));
      const std::string& label = study.series[s].cases[k].label;
      const std::string row = fmt::format("{}{}{}", study.series[s].name, label.empty() ? "" : ": ", label);
      plot.rows.emplace_back(failed(c) ? fmt::format("[{}] {}", name(c.shown().status), row) : row, std::move(lengths));
    }
  }
  return plot;
}

// Several different values of something over all runs.
template <class X>
bool varies(const StudyResult& result, const X& x_of) {
  std::set<double> values;
  for (const SeriesResult& s : result.series) {
    for (const CaseResult& c : s.cases) {
      if (const auto x = x_of(c)) values.insert(*x);
    }
  }
  return values.size() > 1;
}

}  // namespace

namespace {

// The parts of what may be several numbers: a varied array "[4, 5]", an entry of the report "1 2 3".
std::vector<std::string> parts_of(const std::string& cell) {
  std::string text = cell;
  if (text.starts_with('[') && text.ends_with(']')) text = text.substr(1, text.size() - 2);
  std::ranges::replace(text, ',', ' ');
  std::vector<std::string> parts;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) return {cell};
    parts.push_back(word);
  }
  return parts.empty() ? std::vector<std::string>{cell} : parts;
}

std::vector<std::string> parts_of(const Eigen::VectorXd& value) {
  std::vector<std::string> parts;
  for (const double x : value) parts.push_back(text(x));
  return parts;
}

// Columns of one name: NAME where no run has more than one part, else NAME.0, NAME.1, ...; a number a cell.
struct Column {
  std::string name;
  std::vector<std::vector<std::string>> rows;  // parts, a row a run

  std::size_t width() const {
    std::size_t most = 1;
    for (const auto& parts : rows) most = std::max(most, parts.size());
    return most;
  }
  void add_names(std::vector<std::string>& to) const {
    const std::size_t n = width();
    for (std::size_t k = 0; k < n; ++k) to.push_back(n == 1 ? name : fmt::format("{}.{}", name, k));
  }
  void add_cells(std::vector<std::string>& to, std::size_t row) const {
    const std::size_t n = width();
    for (std::size_t k = 0; k < n; ++k) to.push_back(k < rows[row].size() ? rows[row][k] : "");
  }
};

class RunTable {
 public:
  void add(const std::string& name, std::vector<std::string> parts) {
    if (rows_ == 0) columns_.push_back({name, {}});
    columns_.at(next_++).rows.push_back(std::move(parts));
  }
  void add(const std::string& name, const std::string& cell) { add(name, std::vector<std::string>{cell}); }
  void end_row() {
    ++rows_;
    next_ = 0;
  }
  std::string csv() const {
    std::vector<std::string> cells;
    for (const Column& column : columns_) column.add_names(cells);
    std::string out = csv_row(cells);
    for (std::size_t row = 0; row < rows_; ++row) {
      cells.clear();
      for (const Column& column : columns_) column.add_cells(cells, row);
      out += csv_row(cells);
    }
    return out;
  }

 private:
  std::vector<Column> columns_;
  std::size_t rows_ = 0, next_ = 0;
};

// The number, or the length of several.
std::string one_number(const Eigen::VectorXd& value) {
  if (value.size() == 0) return "";
  return text(value.size() == 1 ? value[0] : value.norm());
}

bool of_several_numbers(const StudyResult& result) {
  return std::ranges::any_of(result.series, [](const SeriesResult& s) {
    return s.reference.size() > 1 || std::ranges::any_of(s.cases, [](const CaseResult& c) {
             return std::ranges::any_of(c.runs, [](const StudyRun& run) { return run.facts.value.size() > 1; });
           });
  });
}

std::string exit_text(const StudyRun& run) {
  if (run.process.end != ProcessResult::End::exited || run.status == RunStatus::not_run) return "";
  return fmt::format("{}", run.process.code);
}

}  // namespace

std::string study_csv(const Study& study, const StudyResult& result) {
  const std::vector<std::string> keys = varied_keys(study);
  const bool several = of_several_numbers(result);
  RunTable table;
  for (std::size_t s = 0; s < study.series.size(); ++s) {
    const StudySeries& series = study.series[s];
    const SeriesResult& r = result.series[s];
    for (std::size_t k = 0; k < series.cases.size(); ++k) {
      for (const StudyRun& run : r.cases[k].runs) {
        const RunFacts& f = run.facts;
        table.add("model", f.model);
        table.add("scheme", f.scheme);
        table.add("mesh", f.mesh);
        table.add("degree", f.degree);
        table.add("spans", f.spans);
        table.add("dofs", exact(f.dofs));
        table.add("dt", exact(f.dt));
        table.add("quantity", series.quantity.name);
        table.add("value", one_number(f.value));
        table.add("reference", one_number(r.reference));
        table.add("error", exact(run.error));
        table.add("wall_seconds", exact(f.wall_seconds));
        table.add("status", name(run.status));
        table.add("unit", unit_of(series, f));
        table.add("reference_uncertainty", r.reference.size() > 0 && r.uncertainty >= 0 ? text(r.uncertainty) : "");
        table.add("study", study.name);
        table.add("series", series.name);
        table.add("case", series.cases[k].label);
        table.add("repeat", fmt::format("{}", run.repeat + 1));
        table.add("exit", exit_text(run));
        table.add("verdict", name(run.verdict));
        table.add("cause", run.cause);
        table.add("run", run.id);
        table.add("spans_u", exact(f.spans_u));
        table.add("spans_v", exact(f.spans_v));
        if (several) table.add("value", parts_of(f.value));
        if (several) table.add("reference", parts_of(r.reference));
        for (std::size_t i = 0; i < study.columns.size(); ++i)
          table.add(study.columns[i], i < f.columns.size() ? parts_of(f.columns[i]) : std::vector<std::string>{});
        for (const std::string& key : keys) table.add(key, parts_of(value_of(series.cases[k], key)));
        table.end_row();
      }
    }
  }
  return table.csv();
}

std::string study_table(const Study& study, const StudyResult& result) {
  std::string out = study.title + "\n";
  const bool errors = compared(study);
  std::vector<std::vector<std::string>> rows{{"series", "case", "dofs", "dt [s]"}};
  if (errors) rows[0].push_back("error");
  rows[0].push_back("wall [s]");
  for (const std::string& column : study.columns) rows[0].push_back(column);
  rows[0].push_back(study.stability ? "verdict" : "status");
  rows[0].push_back("cause");
  for (std::size_t s = 0; s < study.series.size(); ++s) {
    for (std::size_t k = 0; k < study.series[s].cases.size(); ++k) {
      const CaseResult& c = result.series[s].cases[k];
      const StudyRun& run = c.shown();
      std::vector<std::string> row{study.series[s].name, study.series[s].cases[k].label,
                                   run.facts.dofs ? fmt::format("{:g}", *run.facts.dofs) : "", rounded(run.facts.dt)};
      if (errors) row.push_back(rounded(run.error));
      row.push_back(wall_text(c));
      for (std::size_t i = 0; i < study.columns.size(); ++i) {
        const std::string& cell = i < run.facts.columns.size() ? run.facts.columns[i] : "";
        char* end = nullptr;
        const double value = std::strtod(cell.c_str(), &end);
        row.push_back(!cell.empty() && *end == '\0' ? rounded(value) : cell);
      }
      row.push_back(study.stability && run.verdict != Verdict::none ? name(run.verdict) : name(run.status));
      row.push_back(cause_of(c));
      rows.push_back(std::move(row));
    }
  }
  out += aligned(rows);
  std::string last;
  for (std::size_t s = 0; s < study.series.size(); ++s) {
    const SeriesResult& r = result.series[s];
    const std::string reference = r.no_reference.empty() ? r.reference_text : "none: " + r.no_reference;
    if (!reference.empty() && reference != last) {
      out += fmt::format("reference of {}: {}\n", study.series[s].name, reference);
    }
    last = reference;
    for (const AxisOrder& o : r.orders) {
      out += fmt::format("{}: {} ({} points)\n", study.series[s].name, order_text(o), o.order.points);
    }
  }
  if (study.stability) {
    out += fmt::format("{} stable, {} refused, {} stopped, {} BAD\n", result.count(Verdict::stable),
                       result.count(Verdict::refused), result.count(Verdict::stopped), result.count(Verdict::bad));
  }
  return out;
}

std::string study_json(const Study& study, const StudyResult& result) {
  const auto list = [](const Eigen::VectorXd& v) {
    return v.size() == 0 ? Json() : Json(std::vector<double>(v.data(), v.data() + v.size()));
  };
  const auto maybe = [](const std::optional<double>& v) { return v ? Json(*v) : Json(); };
  Json out;
  out["study"] = study.name;
  out["title"] = study.title;
  out["version"] = version();
  out["kind"] = study.stability ? "stability" : "convergence";
  out["repeats"] = study.repeats;
  out["limits"] = {{"seconds", study.limits.seconds}, {"megabytes", study.limits.megabytes}};
  out["interrupted"] = result.interrupted;
  if (study.stability) {
    out["verdicts"] = {{"stable", result.count(Verdict::stable)},
                       {"refused", result.count(Verdict::refused)},
                       {"stopped", result.count(Verdict::stopped)},
                       {"BAD", result.count(Verdict::bad)}};
  }
  out["failed_checks"] = result.failed_checks;
  out["series"] = Json::array();
  for (std::size_t s = 0; s < study.series.size(); ++s) {
    const StudySeries& series = study.series[s];
    const SeriesResult& r = result.series[s];
    Json one;
    one["name"] = series.name;
    one["scene"] = series.scene.string();
    one["quantity"] = {{"of", series.quantity.paths}, {"name", series.quantity.name}, {"unit", unit_of(series, r)}};
    one["reference"] = {{"value", list(r.reference)},
                        {"uncertainty", r.reference.size() > 0 ? Json(r.uncertainty) : Json()},
                        {"relative", series.reference.relative},
                        {"text", r.no_reference.empty() ? r.reference_text : "none: " + r.no_reference}};
    one["orders"] = Json::array();
    for (const AxisOrder& o : r.orders) {
      one["orders"].push_back({{"axis", o.axis},
                               {"in", o.size},
                               {"slope", o.order.slope},
                               {"last_pair", o.order.last},
                               {"points", o.order.points}});
    }
    one["cases"] = Json::array();
    for (std::size_t k = 0; k < series.cases.size(); ++k) {
      const CaseResult& c = r.cases[k];
      const StudyRun& run = c.shown();
      Json entry;
      entry["case"] = series.cases[k].label;
      Json settings = Json::array();
      for (const StudySetting& setting : series.cases[k].settings) settings.push_back(setting.text());
      entry["settings"] = settings;
      entry["status"] = name(run.status);
      if (study.stability) entry["verdict"] = name(run.verdict);
      entry["cause"] = cause_of(c);
      entry["dofs"] = maybe(run.facts.dofs);
      entry["dt"] = maybe(run.facts.dt);
      entry["value"] = list(run.facts.value);
      entry["error"] = maybe(run.error);
      entry["repeats_agree"] = !c.differs;
      Json ids = Json::array();
      for (const StudyRun& each : c.runs) ids.push_back(each.id);
      entry["runs"] = ids;
      // All that changes from one call to the next.
      Json timing = {{"wall_seconds", c.wall}, {"wall_min", c.wall_min}, {"wall_max", c.wall_max}};
      Json by_phase = Json::object();
      for (const auto& [phase, seconds] : run.facts.seconds) by_phase[phase] = phase_median(c, phase);
      timing["phases"] = by_phase;
      timing["process"] = {{"wall_seconds", run.process.wall_seconds},
                           {"cpu_seconds", run.process.cpu_seconds},
                           {"peak_megabytes", run.process.peak_megabytes}};
      entry["timing"] = timing;
      one["cases"].push_back(entry);
    }
    out["series"].push_back(one);
  }
  return json_text(out) + "\n";
}

std::vector<std::pair<std::string, std::string>> study_plots(const Study& study, const StudyResult& result) {
  std::vector<std::pair<std::string, std::string>> plots;
  const auto dofs = [](const CaseResult& c) { return c.shown().facts.dofs; };
  const auto dt = [](const CaseResult& c) { return c.shown().facts.dt; };
  const auto wall = [](const CaseResult& c) { return c.wall > 0 ? std::optional(c.wall) : std::nullopt; };
  if (compared(study)) {
    plots.emplace_back("error_over_time.svg",
                       log_plot_svg(error_plot(study, result, "wall time [s], median and spread", true, wall)));
    if (varies(result, dofs)) {
      plots.emplace_back("error_over_dofs.svg",
                         log_plot_svg(error_plot(study, result, "degrees of freedom", false, dofs)));
    }
    if (varies(result, dt)) {
      plots.emplace_back("error_over_dt.svg", log_plot_svg(error_plot(study, result, "time step [s]", false, dt)));
    }
  }
  plots.emplace_back("time_by_phase.svg", bar_plot_svg(phase_plot(study, result)));
  return plots;
}

}  // namespace toile
