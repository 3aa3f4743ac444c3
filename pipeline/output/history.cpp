// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/output/history.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <string_view>

#include "geometry/error.h"
#include "geometry/text.h"
#include "io/csv.h"
#include "io/file.h"
#include "pipeline/output/output.h"

namespace toile {
namespace {

// The number that a cell begins with.
int number_at(std::string_view text) {
  int value = -1;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

void add_vectors(std::vector<std::string>& cells, const std::vector<Eigen::Vector3d>& vectors) {
  for (const Eigen::Vector3d& x : vectors)
    for (const double value : x) cells.push_back(text(value));
}

bool by_load_steps(const Scene& scene) {
  return scene.rest && scene.rest->load_steps;
}

void add_names(std::vector<std::string>& cells, const char* what, std::size_t count) {
  for (std::size_t k = 0; k < count; ++k)
    for (const char* axis : {"_x", "_y", "_z"}) cells.push_back(what + std::to_string(k) + axis);
}

}  // namespace

History::History(const Build& build, std::filesystem::path path, const std::filesystem::path& former,
                 const RunState& state)
    : build_(build), path_(std::move(path)) {
  if (build.scene.history == HistoryRows::off) return;
  samples_ = grid_samples(build);
  const bool by_step = build.scene.history == HistoryRows::steps;
  std::string kept = header();
  if (!former.empty() && std::filesystem::exists(former)) {
    const std::string text = read_file(former);
    std::string_view rest = text;
    if (!rest.starts_with(kept)) rest = {};  // of another scene's output: the columns differ
    rest.remove_prefix(std::min(rest.size(), kept.size()));
    while (true) {
      const std::size_t end = rest.find('\n');
      if (end == std::string_view::npos) break;
      const std::string_view line = rest.substr(0, end + 1);
      const int frame = number_at(line), step = number_at(line.substr(std::min(line.find(',') + 1, line.size())));
      if (by_step ? step > state.steps : frame >= state.frames) break;
      kept += line;
      frame_ = frame, step_ = step;
      rest.remove_prefix(end + 1);
    }
  }
  write_file(path_, kept, Flush::no);
  out_.open(path_, std::ios::app | std::ios::binary);
  append("");
}

void History::append(const std::string& text) {
  out_ << text << std::flush;
  if (!out_) throw OutputError(path_.string() + ": can't be written");
}

void History::add(const RunResult& now) {
  const bool by_step = build_.scene.history == HistoryRows::steps;
  const int frame = now.frames - 1;
  if (build_.scene.history == HistoryRows::off || (by_step ? now.steps <= step_ : frame <= frame_)) return;
  append(row(now));
  frame_ = frame, step_ = now.steps;
}

std::string History::header() const {
  std::vector<std::string> cells{"frame", "step", "t", "dt"};
  EnergyBalance energy;  // for the names of its parts
  Eigen::VectorXd force(build_.start.size());
  energy.stored = internal_force(build_.model->potentials(), build_.start, force).energy;
  energy.stored.set("limit", 0);
  for (const auto& [what, joule] : energy_entries(energy)) cells.emplace_back(what);
  for (const char* name : {"strain_max_weft", "strain_min_weft", "strain_max_warp", "strain_min_warp", "iterations",
                           "iterations_total", "redone_steps", "contacts"})
    cells.emplace_back(name);
  add_names(cells, "reaction_", build_.scene.pins.size());
  add_names(cells, "point_", build_.scene.points.size());
  if (by_load_steps(build_.scene)) cells.emplace_back("load_factor");
  return csv_row(cells);
}

std::string History::row(const RunResult& now) const {
  const Eigen::VectorXd q = control_points(*now.system, now.state);
  Eigen::Array2d least = Eigen::Array2d::Constant(std::numeric_limits<double>::infinity()), largest = -least;
  for (const GridSample& s : samples_) {
    const Eigen::Array2d strain = build_.model->state(s.panel, s.uv.x(), s.uv.y(), q).strain.head<2>().array();
    least = least.min(strain), largest = largest.max(strain);
  }
  const bool stepped = now.steps > 0;
  EnergyBalance energy = now.energy;
  energy.gravity = gravity_potential(build_, q);
  std::vector<std::string> cells{std::to_string(now.frames - 1), std::to_string(now.steps), text(now.state.t),
                                 text(stepped ? now.dt_last : 0)};
  for (const auto& [what, joule] : energy_entries(energy)) cells.push_back(text(joule));
  for (const int c : {0, 1}) {
    cells.push_back(text(largest[c]));
    cells.push_back(text(least[c]));
  }
  cells.push_back(std::to_string(stepped ? now.last_projection.iterations : 0));
  cells.push_back(text(now.iterations_sum));
  cells.push_back(std::to_string(now.redone_steps));
  cells.push_back(now.system->contact ? std::to_string(stepped ? now.last_projection.contacts : 0) : "");
  add_vectors(cells, pin_reactions(build_, *now.system, now.state, stepped ? now.dt_last : 0));
  add_vectors(cells, output_points(build_, q));
  if (by_load_steps(build_.scene)) cells.push_back(text(now.path.factor));
  return csv_row(cells);
}

}  // namespace toile
