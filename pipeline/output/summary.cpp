// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/output/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

namespace toile {
namespace {

// Half of it, as one would type it: two digits, in mm.
std::string smaller_span(const Build& build) {
  const double mm = 500 * longest_span(build), digit = std::pow(10, std::floor(std::log10(mm)) - 1);
  const std::string span = fmt::format("{:.12g} mm", std::floor(mm / digit) * digit);
  if (build.scene.path.extension() != ".toml") return fmt::format("--span \"{}\"", span);
  return fmt::format("refine = {{ span = \"{}\" }}", span);
}

}  // namespace

BetweenPoints strained_between_points(const Build& build, const StateMeasures& measures) {
  constexpr double much = 3, far = 10;
  constexpr double fold = 10;  // a fold within a span looks squeezed, and is no worse than the span
  const StrainLimit& limit = build.scene.strain_limit;
  if (!limit.on) return {};
  for (int d : {0, 1}) {
    const StrainBand& band = d == 0 ? limit.weft : limit.warp;
    const double most = measures.strain.p999[d], least = measures.strain.p001[d];
    const bool stretched = most > much * band.stretch;
    if (!stretched && !(-least > fold * band.compress)) continue;
    const std::string what = fmt::format(
        "between the points that hold the limit of {:.2g}, the {} is {} by {:.2g} and more on a thousandth of the "
        "cloth "
        "(strain from {:.2g} to {:.2g}); a smaller span holds it at more points: {}",
        stretched ? band.stretch : band.compress, d == 0 ? "weft" : "warp", stretched ? "strained" : "squeezed",
        stretched ? most : -least, measures.strain.min[d], measures.strain.max[d], smaller_span(build));
    return {what, most > far * band.stretch};
  }
  return {};
}

std::vector<std::string> summary(const Build& build, const RunResult& result, const StateMeasures& m,
                                 double wall_seconds) {
  std::vector<std::string> lines;
  lines.push_back(fmt::format(
      "{}: {:.3g} s in {} frames, {} steps of {:.2g} to {:.2g} s; {:.2f} s of wall time, files "
      "included",
      build.scene.name, result.time, result.frames, result.steps, result.dt_min, result.dt_max, wall_seconds));
  if (build.scene.rest && result.exit == RunExit::ok) {
    lines.push_back(fmt::format("  at rest after {} steps: released, no point would move by more than {:.2g} m",
                                result.relaxation.steps, result.relaxation.remaining));
  }
  lines.push_back(fmt::format("  strain {:.2g} to {:.2g} weft, {:.2g} to {:.2g} warp, {:.2g} to {:.2g} shear",
                              m.strain.min[0], m.strain.max[0], m.strain.min[1], m.strain.max[1], m.shear.min,
                              m.shear.max));
  lines.push_back(fmt::format("  mean strain {:.2g} weft, {:.2g} warp; at most {:.2g} at constraint points",
                              m.strain.mean_abs[0], m.strain.mean_abs[1], m.at_constraints_max));
  if (result.system->contact) {
    std::string line = fmt::format("  {} contacts", result.last_projection.contacts);
    if (m.contact && m.contact->penetration > 0)
      line += fmt::format(", the cloth up to {:.2g} mm nearer than its thickness and the skin",
                          1e3 * m.contact->penetration);
    for (std::size_t k = 0; m.contact && k < m.contact->forces.size(); ++k)
      line += fmt::format("; obstacle '{}' carries {:.3g} N", build.obstacles[k]->name(), m.contact->forces[k].norm());
    lines.push_back(line);
  }
  if (!m.seams.empty()) {
    const auto widest = std::ranges::max_element(m.seams, {}, &SeamMeasures::gap);
    const auto strongest = std::ranges::max_element(m.seams, {}, &SeamMeasures::force);
    lines.push_back(fmt::format("  {} seams, open by {:.2g} mm at most (seam {}); seam {} carries up to {:.3g} N/m",
                                m.seams.size(), 1e3 * widest->gap, widest - m.seams.begin(),
                                strongest - m.seams.begin(), strongest->force));
  }
  return lines;
}

std::vector<std::string> results_to_open(const std::filesystem::path& directory, const std::string& scene) {
  const std::pair<std::filesystem::path, const char*> results[] = {
      {directory / "preview.png", "a picture of the last state"},
      {directory / "frames" / (scene + ".pvd"), "ParaView: all frames, with strain and stress"},
      {directory / "frames" / "frame_0000.obj", "Blender: frame after frame"},
      {directory / "draped.igs", "CAD: the flat panels beside the draped ones"},
      {directory / "report.json", "the numbers"},
  };
  std::vector<std::string> lines;
  std::error_code error;
  for (const auto& [path, program] : results) {
    if (std::filesystem::exists(path, error)) lines.push_back(fmt::format("  {:<44} {}", path.string(), program));
  }
  return lines;
}

std::string shell_word(const std::string& word) {
  const auto plain = [](unsigned char c) {
    return std::isalnum(c) != 0 || std::string_view("_-./:=,+%@").find(static_cast<char>(c)) != std::string_view::npos;
  };
  if (!word.empty() && std::ranges::all_of(word, plain)) return word;
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

std::string resume_command(const std::string& command, const std::filesystem::path& directory) {
  return fmt::format("{} --resume {} -o {}", command, shell_word((directory / "checkpoint").string()),
                     shell_word(directory.string()));
}

}  // namespace toile
