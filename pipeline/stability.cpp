// The verdict on a run: stable, refused, stopped or bad.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>

#include "geometry/error.h"
#include "io/file.h"
#include "pipeline/study.h"

namespace toile {
namespace {

using Json = nlohmann::json;

constexpr double largest_injection = 0.01;  // of the work of gravity
// Where gravity does next to no work (everything is held), the fall of the cloth by this share of its size counts.
constexpr double smallest_fall = 1e-6;
constexpr double standard_gravity = 9.81;

// Where a JSON value holds null, the way in which a number that isn't finite is written.
std::string null_in(const Json& json, const std::string& path) {
  if (json.is_null()) return path == "contact.min_distance" ? "" : path;  // null: nothing is near
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

std::string attribute(std::string_view tag, std::string_view name) {
  const std::size_t at = tag.find(std::string(" ") + std::string(name) + "=\"");
  if (at == std::string_view::npos) return "";
  const std::size_t from = at + name.size() + 3;
  return std::string(tag.substr(from, tag.find('"', from) - from));
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

// The name of an appended array of a VTU file that isn't finite; raw little-endian data after "_", as VtuSink writes
// it.
std::string vtu_array(std::string_view text) {
  const std::size_t head = text.find("<AppendedData");
  const std::size_t data = head == std::string_view::npos ? head : text.find('_', head);
  if (data == std::string_view::npos) return word_in(text).empty() ? "" : "its text";
  const bool wide = text.substr(0, head).find("header_type=\"UInt64\"") != std::string_view::npos;
  for (std::size_t at = 0; (at = text.find("<DataArray", at)) < head; ++at) {
    const std::string_view tag = text.substr(at, text.find('>', at) - at);
    const std::string type = attribute(tag, "type"), offset = attribute(tag, "offset");
    if (offset.empty() || !type.starts_with("Float")) continue;
    std::uint64_t length = 0, start = 0;
    std::from_chars(offset.data(), offset.data() + offset.size(), start);
    const std::size_t from = data + 1 + start, length_bytes = wide ? 8 : 4;
    if (from + length_bytes > text.size()) return attribute(tag, "Name") + " (cut short)";
    std::memcpy(&length, text.data() + from, length_bytes);
    const std::string_view bytes = text.substr(from + length_bytes, length);
    if (bytes.size() < length) return attribute(tag, "Name") + " (cut short)";
    if (!(type == "Float64" ? all_finite<double>(bytes) : all_finite<float>(bytes))) return attribute(tag, "Name");
  }
  return "";
}

std::optional<double> number(const Json& report, const char* path) {
  const Json::json_pointer pointer(path);
  if (!report.contains(pointer) || !report.at(pointer).is_number()) return std::nullopt;
  return report.at(pointer).get<double>();
}

// Why a run that ended well isn't stable.
std::string instability(const Json& report) {
  const auto injected = number(report, "/energy/injected"), gravity = number(report, "/energy/gravity");
  if (!injected || !gravity) return "report.json says nothing of the energy";
  const double mass = number(report, "/measures/mass/value").value_or(0);
  const double area = number(report, "/measures/area/value").value_or(0);
  const double work = std::max(-*gravity, smallest_fall * mass * standard_gravity * std::sqrt(std::max(area, 0.0)));
  if (*injected > largest_injection * work) {
    return fmt::format("{:.3g} J appeared from nowhere, {:.3g} times the work of gravity", *injected, *injected / work);
  }
  const auto limit = number(report, "/strain/limit"), reached = number(report, "/strain/at_constraints_max");
  if (limit && (!reached || *reached > *limit)) {
    return fmt::format("the strain reaches {:.3g}, its limit is {:.3g}", reached.value_or(NAN), *limit);
  }
  return "";
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
      const std::string array = vtu_array(read_file(file));
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
