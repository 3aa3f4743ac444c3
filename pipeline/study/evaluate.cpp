// SPDX-License-Identifier: GPL-3.0-or-later
// What the runs of a study say together: references, errors, orders, checks.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "pipeline/study/study.h"

namespace toile {
namespace {

bool usable(const CaseResult& c) {
  return c.first && c.shown().status == RunStatus::ok;
}

void collect_repeats(CaseResult& c) {
  std::vector<double> wall;
  for (std::size_t k = 0; k < c.runs.size(); ++k) {
    const StudyRun& run = c.runs[k];
    if (run.facts.wall_seconds) wall.push_back(*run.facts.wall_seconds);
    if (run.facts.value.size() == 0) continue;
    if (!c.first) c.first = k;
    const Eigen::VectorXd& first = c.shown().facts.value;
    c.differs = c.differs || run.facts.value.size() != first.size() || run.facts.value != first;
  }
  if (wall.empty()) return;
  c.wall = median(wall);
  c.wall_min = *std::ranges::min_element(wall);
  c.wall_max = *std::ranges::max_element(wall);
}

// The cases that differ from the one at `at` along one axis only, in the axis' order.
std::vector<std::size_t> along(const StudySeries& series, const std::vector<std::size_t>& at, std::size_t axis) {
  std::vector<std::size_t> result;
  for (std::size_t k = 0; k < series.cases.size(); ++k) {
    bool same = true;
    for (std::size_t a = 0; a < at.size(); ++a) same = same && (a == axis || series.cases[k].at[a] == at[a]);
    if (same) result.push_back(k);
  }
  return result;
}

// What shrinks along some cases: mesh size h or the step. Without a name where nothing does, where the degree changes,
// or where it doesn't fall from each case to the next.
struct Size {
  std::string name;
  std::vector<double> h;
};
Size size_along(const SeriesResult& result, const std::vector<std::size_t>& cases) {
  const auto facts = [&](std::size_t k) -> const RunFacts& { return result.cases[k].shown().facts; };
  for (const std::size_t k : cases) {
    if (facts(k).degree != facts(cases[0]).degree) return {};
  }
  const auto falling = [&](std::string name, auto value) -> Size {
    Size size{std::move(name), {}};
    for (const std::size_t k : cases) {
      const std::optional<double> h = value(facts(k));
      if (!h || !(*h > 0) || (!size.h.empty() && !(*h < size.h.back()))) return {};
      size.h.push_back(*h);
    }
    return size;
  };
  // Where one direction keeps its spans, the other one's count.
  const auto kept = [&](std::optional<double> RunFacts::*count) {
    return std::ranges::all_of(cases, [&](std::size_t k) { return facts(k).*count == facts(cases[0]).*count; });
  };
  const bool only_u = kept(&RunFacts::spans_v), only_v = kept(&RunFacts::spans_u);
  Size size = falling("h", [&](const RunFacts& f) -> std::optional<double> {
    if (!f.elements) return f.dofs ? std::optional(1 / std::sqrt(*f.dofs)) : std::nullopt;
    return only_u ? 1 / *f.spans_u : only_v ? 1 / *f.spans_v : 1 / std::sqrt(*f.elements);
  });
  if (size.name.empty()) size = falling("dt", [](const RunFacts& f) { return f.dt; });
  return size;
}

struct Reference {
  Eigen::VectorXd value;
  double uncertainty = 0;
  std::string text, missing;
};

Reference finest(const StudySeries& series, const SeriesResult& result) {
  Reference r;
  std::size_t best = series.cases.size();
  for (std::size_t k = 0; k < series.cases.size(); ++k) {
    if (usable(result.cases[k])) best = k;
  }
  if (best == series.cases.size()) {
    r.missing = fmt::format("no run of '{}' finished", series.name);
    return r;
  }
  r.value = result.cases[best].shown().facts.value;
  std::string neighbours;
  for (std::size_t a = 0; a < series.axes.size(); ++a) {
    const std::vector<std::size_t> line = along(series, series.cases[best].at, a);
    for (std::size_t k = line.size(); k-- > 0;) {
      if (line[k] >= best || !usable(result.cases[line[k]])) continue;
      const Eigen::VectorXd& other = result.cases[line[k]].shown().facts.value;
      if (other.size() != r.value.size()) continue;
      r.uncertainty = std::max(r.uncertainty, (other - r.value).norm());
      neighbours += (neighbours.empty() ? "" : " and ") + series.cases[line[k]].label;
      break;
    }
  }
  const bool last = best + 1 == series.cases.size();
  const std::string& label = series.cases[best].label;
  if (neighbours.empty()) r.uncertainty = std::numeric_limits<double>::quiet_NaN();
  r.text = fmt::format("the finest run{} of {}{}{}, uncertainty {}", last ? "" : " that finished", series.name,
                       label.empty() ? "" : ": ", label,
                       neighbours.empty() ? "unknown, no other run finished"
                                          : fmt::format("{:.3g}: distance to {}", r.uncertainty, neighbours));
  return r;
}

Reference extrapolated(const StudySeries& series, const SeriesResult& result, std::optional<double> order) {
  Reference r;
  std::size_t axis = series.axes.size();
  for (std::size_t a = 0; a < series.axes.size(); ++a) {
    if (series.lengths[a] < 2) continue;
    if (axis < series.axes.size()) {
      r.missing = fmt::format("Richardson's extrapolation takes one axis, '{}' has several", series.name);
      return r;
    }
    axis = a;
  }
  std::vector<std::size_t> cases;
  for (std::size_t k = 0; k < series.cases.size(); ++k) {
    if (usable(result.cases[k])) cases.push_back(k);
  }
  const Size size = cases.empty() ? Size{} : size_along(result, cases);
  if (size.name.empty()) {
    r.missing =
        fmt::format("nothing shrinks along the finished runs of '{}' that an order could be taken of", series.name);
    return r;
  }
  std::vector<Eigen::VectorXd> values;
  for (const std::size_t k : cases) values.push_back(result.cases[k].shown().facts.value);
  if (std::ranges::any_of(values, [&](const Eigen::VectorXd& v) { return v.size() != values[0].size(); })) {
    r.missing = fmt::format("the runs of '{}' have quantities of several sizes", series.name);
    return r;
  }
  const auto limit = richardson(size.h, values, order);
  if (!limit) {
    r.missing = fmt::format("no extrapolation of '{}': {}", series.name,
                            cases.size() < (order ? 3 : 4) ? fmt::format("{} finished runs are too few", cases.size())
                                                           : "the differences don't shrink");
    return r;
  }
  r.value = limit->value;
  r.uncertainty = limit->uncertainty;
  r.text = fmt::format(
      "Richardson's extrapolation of {} with {} order {:.2f} in {}, uncertainty {:.3g}: distance to the "
      "one without the finest run",
      series.name, order ? "the given" : "the observed", limit->order, size.name, limit->uncertainty);
  return r;
}

Reference reference_of(const Study& study, const StudyResult& result, std::size_t s) {
  const StudyReference& wanted = study.series[s].reference;
  std::size_t from = s;
  for (std::size_t k = 0; k < study.series.size(); ++k) {
    if (study.series[k].name == wanted.of) from = k;
  }
  switch (wanted.kind) {
    case StudyReference::Kind::finest:
      return finest(study.series[from], result.series[from]);
    case StudyReference::Kind::richardson:
      return extrapolated(study.series[from], result.series[from], wanted.order);
    case StudyReference::Kind::given:
      return {wanted.value, wanted.uncertainty,
              fmt::format("{}, uncertainty {:.3g}", wanted.source, wanted.uncertainty), ""};
    case StudyReference::Kind::none:
      break;
  }
  return {};
}

void take_errors(const StudySeries& series, SeriesResult& result) {
  const double scale = series.reference.relative ? result.reference.norm() : 1;
  if (result.reference.size() == 0) return;
  if (!(scale > 0)) {
    result.no_reference = "the reference is zero, errors relative to it don't exist";
    return;
  }
  result.uncertainty /= scale;
  for (CaseResult& c : result.cases) {
    for (StudyRun& run : c.runs) {
      if (run.facts.value.size() == 0) continue;
      if (run.facts.value.size() != result.reference.size()) {
        result.no_reference = fmt::format("the reference has {} numbers, the quantity {}", result.reference.size(),
                                          run.facts.value.size());
        continue;
      }
      run.error = (run.facts.value - result.reference).norm() / scale;
    }
  }
}

void take_orders(const StudySeries& series, SeriesResult& result) {
  if (series.cases.empty()) return;
  for (std::size_t a = 0; a < series.axes.size(); ++a) {
    if (series.lengths[a] < 2) continue;
    std::vector<std::size_t> cases;
    for (const std::size_t k : along(series, series.cases.back().at, a)) {
      if (usable(result.cases[k]) && result.cases[k].shown().error) cases.push_back(k);
    }
    if (cases.size() < 2) continue;
    const Size size = size_along(result, cases);
    if (size.name.empty()) continue;
    std::vector<double> errors;
    for (const std::size_t k : cases) errors.push_back(*result.cases[k].shown().error);
    // The second finest run is as far from the finest as its uncertainty says.
    const double floor = series.reference.kind == StudyReference::Kind::finest ? 0 : result.uncertainty;
    if (const auto order = observed_order(size.h, errors, floor)) {
      result.orders.push_back({series.axes[a], size.name, *order});
    }
  }
}

void check_errors(const Study& study, StudyResult& result) {
  if (!study.largest_error) return;
  for (std::size_t s = 0; s < study.series.size(); ++s) {
    const StudySeries& series = study.series[s];
    SeriesResult& r = result.series[s];
    for (std::size_t k = 0; k < r.cases.size(); ++k) {
      StudyRun& run = r.cases[k].runs[r.cases[k].first.value_or(0)];
      const bool reached = run.error && *run.error <= *study.largest_error;
      if (study.stability) {
        // A missing reference is an error in the study, not in the run.
        if (run.verdict != Verdict::stable || series.reference.kind == StudyReference::Kind::none || reached) continue;
        run.verdict = Verdict::bad;
        run.cause = run.error ? fmt::format("the {} is off by {:.3g}, allowed {:.3g}", series.quantity.name, *run.error,
                                            *study.largest_error)
                              : "no error: " + r.no_reference;
      } else if (k + 1 == r.cases.size() && !reached && run.status != RunStatus::not_run) {
        result.failed_checks.push_back(
            fmt::format("'{}': the error of the finest case is {}, allowed {:.3g}", series.name,
                        run.error ? fmt::format("{:.3g}", *run.error) : "unknown", *study.largest_error));
      }
    }
  }
}

}  // namespace

int StudyResult::count(Verdict verdict) const {
  std::ptrdiff_t sum = 0;
  for (const SeriesResult& s : series) {
    for (const CaseResult& c : s.cases) sum += std::ranges::count(c.runs, verdict, &StudyRun::verdict);
  }
  return static_cast<int>(sum);
}

void evaluate(const Study& study, StudyResult& result) {
  for (SeriesResult& s : result.series) {
    for (CaseResult& c : s.cases) collect_repeats(c);
  }
  for (std::size_t s = 0; s < study.series.size(); ++s) {
    SeriesResult& r = result.series[s];
    Reference reference = reference_of(study, result, s);
    r.reference = std::move(reference.value);
    r.uncertainty = reference.uncertainty;
    r.reference_text = std::move(reference.text);
    r.no_reference = std::move(reference.missing);
    take_errors(study.series[s], r);
    take_orders(study.series[s], r);
  }
  check_errors(study, result);
}

}  // namespace toile
