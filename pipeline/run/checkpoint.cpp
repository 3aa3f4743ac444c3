// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/run/checkpoint.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <map>
#include <set>

#include "geometry/error.h"
#include "io/file.h"
#include "pipeline/base/version.h"

namespace toile {
namespace {

constexpr std::string_view first_word = "toile checkpoint ";
constexpr int format_number = 10;  // raise it when the meaning of a byte changes

// Every step can be undone, so that a change of any one word always shows in the end.
std::uint64_t checksum(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325u ^ bytes.size();
  const auto mix = [&](std::uint64_t word) {
    hash = (hash ^ word) * 0x9e3779b97f4a7c15u;
    hash ^= hash >> 32;
  };
  for (; bytes.size() >= 8; bytes.remove_prefix(8)) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data(), 8);
    mix(word);
  }
  std::uint64_t rest = 0;
  if (!bytes.empty()) std::memcpy(&rest, bytes.data(), bytes.size());
  mix(rest);
  return hash;
}

class Writer {
 public:
  std::string bytes;
  void operator()(const auto&... values) { (put(values), ...); }

 private:
  template <class T>
  requires std::is_arithmetic_v<T>
  void put(T value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); }
  void put(const std::string& text) {
    put(text.size());
    bytes += text;
  }
  void put(const Eigen::VectorXd& v) { put_numbers(v.data(), v.size()); }
  void put(const Eigen::Matrix3Xd& m) { put_numbers(m.data(), m.size()); }
  template <class T>
  void put(const std::vector<T>& list) {
    put(list.size());
    for (const T& item : list) put(item);
  }
  void put(const std::map<std::string, std::string>& table) {
    put(table.size());
    for (const auto& [key, value] : table) put(key), put(value);
  }
  void put(const EnergyParts& energies) {
    put(energies.size());
    for (const EnergyParts::Part& part : energies) put(std::string(part.name)), put(part.value);
  }
  template <class T>
  requires std::is_class_v<T>
  void put(const T& record) { fields(*this, record); }
  void put_numbers(const double* data, Eigen::Index count) {
    put(static_cast<std::size_t>(count));
    bytes.append(reinterpret_cast<const char*>(data), static_cast<std::size_t>(count) * sizeof(double));
  }
};

class Reader {
 public:
  Reader(std::string_view bytes, std::string name) : bytes_(bytes), name_(std::move(name)) {}
  void operator()(auto&... values) { (get(values), ...); }
  bool at_end() const { return bytes_.empty(); }
  [[noreturn]] void fail(const std::string& what) const { throw InputError(name_ + ": " + what); }

 private:
  void take(void* to, std::size_t size) {
    if (size > bytes_.size()) fail("a number of the checkpoint is missing");
    if (size > 0) std::memcpy(to, bytes_.data(), size);
    bytes_.remove_prefix(size);
  }
  std::size_t count(std::size_t item_size) {
    std::size_t n = 0;
    get(n);
    if (n > bytes_.size() / item_size) fail("a list of the checkpoint is longer than the file");
    return n;
  }
  void get(bool& value) {
    unsigned char byte = 0;
    take(&byte, 1);
    value = byte != 0;
  }
  template <class T>
  requires std::is_arithmetic_v<T>
  void get(T& value) { take(&value, sizeof value); }
  void get(std::string& text) {
    text.resize(count(1));
    take(text.data(), text.size());
  }
  void get(Eigen::VectorXd& v) {
    v.resize(static_cast<Eigen::Index>(count(sizeof(double))));
    take(v.data(), static_cast<std::size_t>(v.size()) * sizeof(double));
  }
  void get(Eigen::Matrix3Xd& m) {
    const std::size_t n = count(sizeof(double));
    if (n % 3 != 0) fail("a list of vectors of the checkpoint has parts of one");
    m.resize(3, static_cast<Eigen::Index>(n / 3));
    take(m.data(), n * sizeof(double));
  }
  template <class T>
  void get(std::vector<T>& list) {
    list.resize(count(1));
    for (T& item : list) get(item);
  }
  void get(std::map<std::string, std::string>& table) {
    for (std::size_t left = count(1); left > 0; --left) {
      std::string key;
      get(key);
      get(table[key]);
    }
  }
  void get(EnergyParts& energies) {
    static std::set<std::string> names;  // parts know theirs by address
    energies = {};
    const std::size_t parts = count(sizeof(double));
    if (parts > EnergyParts::capacity) fail("the checkpoint has more energies than there are");
    for (std::size_t k = 0; k < parts; ++k) {
      std::string name;
      double value = 0;
      get(name);
      get(value);
      energies.set(names.insert(name).first->c_str(), value);
    }
  }
  template <class T>
  requires std::is_class_v<T>
  void get(T& record) { fields(*this, record); }

  std::string_view bytes_;
  std::string name_;
};

std::string_view bytes_of(const Eigen::VectorXd& v) {
  return {reinterpret_cast<const char*>(v.data()), static_cast<std::size_t>(v.size()) * sizeof(double)};
}

// What differs first between the scene of a checkpoint and the one at hand; empty where nothing does.
std::string difference(const SceneMark& then, const SceneMark& now, const std::string& scene) {
  for (const auto& [key, value] : then.keys) {
    const auto it = now.keys.find(key);
    if (it == now.keys.end()) return fmt::format("was made with {} = {}, {} has no such key", key, value, scene);
    if (it->second != value) return fmt::format("was made with {} = {}, {} has {}", key, value, scene, it->second);
  }
  for (const auto& [key, value] : now.keys) {
    if (!then.keys.contains(key)) return fmt::format("was made without {}, {} has {}", key, scene, value);
  }
  if (then.control_points != now.control_points) return "was made with other control points from the same files";
  return {};
}

}  // namespace

SceneMark scene_mark(const Build& build) {
  SceneMark mark;
  for (const auto& [key, value] : build.scene.keys) {
    const bool of_the_end = key == "solver.until" || key == "solver.time_limit" || key == "solver.energy_gain" ||
                            key.starts_with("solver.rest");
    if (of_the_end || key == "output" || key.starts_with("output.")) continue;
    mark.keys[key] = value;
  }
  std::map<std::filesystem::path, std::string> contents;  // each file is read once
  for (std::size_t k = 0; k < build.scene.panels.size(); ++k) {
    std::string& content = contents[build.scene.panels[k].file];
    if (content.empty()) {
      const std::string text = read_file(build.scene.panels[k].file);
      content = fmt::format("a file of {} bytes ({:016x})", text.size(), checksum(text));
    }
    mark.keys[fmt::format("panel.{}.file", k)] = content;
  }
  mark.control_points = checksum(bytes_of(build.start)) ^ (checksum(bytes_of(build.model->lumped_mass())) << 1);
  return mark;
}

std::string format_checkpoint(const SceneMark& scene, const RunState& state, const System& system) {
  Writer body;
  body(std::string(version()), scene, state);
  if (system.projection) body(system.projection->memory());
  Writer file;
  file.bytes = fmt::format("{}{}\n", first_word, format_number);
  file(body.bytes);
  file(checksum(file.bytes));
  return std::move(file.bytes);
}

RunResult parse_checkpoint(std::string_view bytes, const std::string& name, const Build& build, Workers* workers) {
  const auto refuse = [&](const std::string& what) { throw InputError(name + ": " + what); };
  const std::size_t line = bytes.find('\n');
  if (!bytes.starts_with(first_word.substr(0, std::min(bytes.size(), first_word.size()))) || bytes.empty()) {
    refuse("is no checkpoint of toile");
  }
  const std::string head = fmt::format("{}{}", first_word, format_number);
  if (line == bytes.npos || bytes.size() < head.size() + 1 + 16) refuse("the checkpoint is cut short");
  if (bytes.substr(0, line) != head) {
    refuse(fmt::format("is '{}', this program reads '{}'", bytes.substr(0, std::min<std::size_t>(line, 40)), head));
  }
  std::uint64_t size = 0, sum = 0;
  std::memcpy(&size, bytes.data() + line + 1, 8);
  const std::string_view body = bytes.substr(line + 9, bytes.size() - line - 17);
  if (size != body.size()) {
    refuse(fmt::format("the checkpoint is cut short or damaged: {} bytes where {} belong", body.size(), size));
  }
  std::memcpy(&sum, bytes.data() + bytes.size() - 8, 8);
  if (sum != checksum(bytes.substr(0, bytes.size() - 8))) {
    refuse("the checkpoint is damaged: its checksum is another one");
  }

  Reader reader(body, name);
  std::string program;
  reader(program);
  if (program != version()) refuse(fmt::format("was made by toile {}, this is toile {}", program, version()));
  SceneMark then;
  reader(then);
  const std::string other = difference(then, scene_mark(build), build.scene.path.string());
  if (!other.empty()) refuse(other);

  RunResult result;
  RunState& state = result;
  reader(state);
  result.system = assemble(build, state.assembled, workers, &state.sewing);
  const System& system = *result.system;
  ProjectionMemory memory;
  if (system.projection) reader(memory);
  const Eigen::Index unknowns = 3 * system.map->nodes();
  const DynamicState& s = state.state;
  const Eigen::Index numbers = 3 * system.map->control_points();
  const bool fits = reader.at_end() && s.x.size() == unknowns && s.v.size() == unknowns && s.a.size() == unknowns &&
                    s.q.size() == numbers && s.f.size() == numbers && std::isfinite(s.t) && s.x.allFinite() &&
                    s.v.allFinite() && s.a.allFinite() && s.q.allFinite() && s.f.allFinite() &&
                    state.frames == static_cast<int>(state.frame_times.size()) &&
                    state.last_projection.worst_row < system.strain_rows;
  if (!fits || (system.projection && !system.projection->restore(memory))) {
    refuse("the checkpoint holds another number of unknowns or rows than the scene");
  }
  return result;
}

RunResult read_checkpoint(const std::filesystem::path& path, const Build& build, Workers* workers) {
  return parse_checkpoint(read_file(path), path.string(), build, workers);
}

}  // namespace toile
