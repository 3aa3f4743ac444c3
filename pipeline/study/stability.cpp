// SPDX-License-Identifier: GPL-3.0-or-later
// The verdict on a run: stable, refused, stopped or bad.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>

#include "geometry/error.h"
#include "io/file.h"
#include "io/vtu_arrays.h"
#include "pipeline/study/study.h"

namespace toile {
namespace {

using Json = nlohmann::json;

constexpr double largest_injection = 0.01;  // of the work of gravity
// Where gravity does next to no work (everything is held), the fall of the cloth by this share of its size counts.
constexpr double smallest_fall = 1e-6;
constexpr double standard_gravity = 9.81;

// Where a JSON value holds null, the way in which a number that isn't finite is written. What contact and seams say is
// null in a run that has none.
std::string null_in(const Json& json, const std::string& path) {
  if (path == "contact" || path == "seams") return "";
  if (json.is_null()) return path;
  if (!json.is_structured()) return "";
  for (const auto& [key, value] : json.items()) {
    const std::string found = null_in(value, path.empty() ? key : path + "." + key);
    if (!found.empty()) return found;
  }
  return "";
}

// A word "nan" or "inf" in a text.
std::string word_in(std::string_view text) {
  const auto letter = [&](std::size_t k) {
    return k < text.size() && std::isalnum(static_cast<unsigned char>(text[k])) != 0;
  };
  for (std::size_t k = 0; k < text.size();) {
    if (!letter(k)) {
      ++k;
      continue;
    }
    std::size_t end = k;
    std::string word;
    for (; letter(end); ++end) {
      if (end - k < 9) word += static_cast<char>(std::tolower(static_cast<unsigned char>(text[end])));
    }
    if (word == "nan" || word == "inf" || word == "infinity") return word;
    k = end;
  }
  return "";
}

template <class Number>
bool all_finite(std::string_view bytes) {
  for (std::size_t k = 0; k + sizeof(Number) <= bytes.size(); k += sizeof(Number)) {
    Number value;
    std::memcpy(&value, bytes.data() + k, sizeof value);
    if (!std::isfinite(value)) return false;
  }
  return true;
}

// The first array of a VTU file that holds a number that isn't finite, or what is wrong with the file.
std::string not_finite_in_vtu(std::string_view file) {
  const std::string word = word_in(file.substr(0, file.find(vtu_data_mark)));
  if (!word.empty()) return word;
  try {
    for (const VtuArray& array : read_vtu_arrays(file)) {
      if (array.type == "Float64" && !all_finite<double>(array.bytes)) return array.name;
      if (array.type == "Float32" && !all_finite<float>(array.bytes)) return array.name;
    }
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

std::optional<double> number(const Json& report, const std::string& path) {
  const Json::json_pointer pointer(path);
  if (!report.contains(pointer) || !report.at(pointer).is_number()) return std::nullopt;
  return report.at(pointer).get<double>();
}

// Where the strain of the limit's rows lies beyond the limit: one number for both directions and signs, or a band with
// a range for each direction.
std::string over_limit(const Json& report) {
  const Json strain = report.value("strain", Json::object());
  if (!strain.contains("limit")) return "";
  if (const auto limit = number(report, "/strain/limit")) {
    const double reached = number(report, "/strain/at_constraints_max").value_or(NAN);
    if (reached <= *limit) return "";
    return fmt::format("the strain reaches {:.3g}, its limit is {:.3g}", reached, *limit);
  }
  const double tolerance = number(report, "/strain/limit/tolerance").value_or(0);
  for (const auto& [d, thread] : {std::pair(0, "weft"), std::pair(1, "warp")}) {
    const auto end = [&, at = d, name = thread](const char* sign, const char* extreme, double unlimited) {
      const double allowed = number(report, fmt::format("/strain/limit/{}/{}", sign, at)).value_or(unlimited);
      const double reached = number(report, fmt::format("/strain/at_constraints/{}_{}", extreme, name)).value_or(NAN);
      return std::pair(reached, allowed);
    };
    const auto [most, stretch] = end("stretch", "max", INFINITY);
    if (!(most <= stretch + tolerance))
      return fmt::format("the {} is stretched by {:.3g}, its limit is {:.3g}", thread, most, stretch);
    const auto [least, compress] = end("compress", "min", INFINITY);
    if (!(-least <= compress + tolerance))
      return fmt::format("the {} is compressed by {:.3g}, its limit is {:.3g}", thread, std::abs(least), compress);
  }
  return "";
}

// Why a run that ended well isn't stable.
std::string instability(const Json& report) {
  const auto injected = number(report, "/energy/injected"), gravity = number(report, "/energy/gravity");
  if (!injected || !gravity) return "report.json says nothing of the energy";
  const double mass = number(report, "/measures/mass/value").value_or(0);
  const double area = number(report, "/measures/area/value").value_or(0);
  const double work = std::max(-*gravity, smallest_fall * mass * standard_gravity * std::sqrt(std::max(area, 0.0)));
  if (*injected > largest_injection * work) {
    return fmt::format("energy grew by {:.3g} J with no matching work, {:.3g} times the work of gravity", *injected,
                       *injected / work);
  }
  return over_limit(report);
}

}  // namespace

std::string not_finite_in(const std::filesystem::path& directory) {
  static const std::set<std::string> texts{".igs", ".obj", ".json", ".log", ".pvd", ".svg", ".csv", ".toml", ".html"};
  std::error_code error;
  if (!std::filesystem::is_directory(directory, error)) return "";
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(directory)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  for (const std::filesystem::path& file : files) {
    const std::string extension = file.extension().string(), shown = file.lexically_relative(directory).string();
    if (extension == ".vtu") {
      const std::string array = not_finite_in_vtu(read_file(file));
      if (!array.empty()) return fmt::format("{}: {}", shown, array);
    }
    if (!texts.contains(extension)) continue;
    const std::string text = read_file(file);
    const std::string word = word_in(text);
    if (!word.empty()) return fmt::format("{}: {}", shown, word);
    if (extension != ".json") continue;
    const Json json = Json::parse(text, nullptr, false);
    if (json.is_discarded()) return shown + ": broken JSON";
    const std::string null = null_in(json, "");
    if (!null.empty()) return fmt::format("{}: null at {}", shown, null);
  }
  return "";
}

void judge(StudyRun& run, const std::filesystem::path& directory) {
  const auto bad = [&](const std::string& why) {
    run.verdict = Verdict::bad;
    run.cause = why;
  };
  const std::string broken = not_finite_in(directory);
  if (!broken.empty()) return bad("not finite: " + broken);
  switch (run.status) {
    case RunStatus::ok: {
      const Json report = Json::parse(read_file(directory / "report.json"), nullptr, false);
      const std::string why = report.is_discarded() ? "report.json is broken" : instability(report);
      if (!why.empty()) return bad(why);
      run.verdict = Verdict::stable;
      return;
    }
    case RunStatus::refused:
      if (run.cause.empty()) return bad("refused without a cause");
      if (std::filesystem::exists(directory)) return bad("refused, but it left files: " + run.cause);
      run.verdict = Verdict::refused;
      return;
    case RunStatus::check:
    case RunStatus::stopped:
      if (run.cause.empty()) return bad("stopped without a cause");
      run.verdict = Verdict::stopped;
      return;
    case RunStatus::timeout:
      if (!run.process.answered) return bad("it hangs: " + run.cause);
      run.verdict = Verdict::stopped;
      return;
    case RunStatus::failed:
      return bad(run.cause);
    case RunStatus::not_run:
      return;
  }
}

}  // namespace toile
