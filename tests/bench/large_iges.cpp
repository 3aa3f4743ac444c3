// SPDX-License-Identifier: GPL-3.0-or-later
// bench_large_iges WORK TOILE: IGES at size, each in a process of its own so that its peak memory is its own.
//   parse: 200 MB of text (2,000 trimmed bicubic faces on 37 x 37 nets), from disk to panels, one core;
//   inspect: 10,000 trimmed faces through `toile inspect --json`, the loops lines and curves, every other face with a
//   hole.
// A target that is missed is printed as such and is no error: machines differ.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <numbers>

#include "bench/wavy_surface.h"
#include "io/file.h"
#include "io/iges.h"
#include "pipeline/study/process.h"

namespace {

using namespace toile;
using Eigen::Vector2d;

TrimLoop closed_loop(std::vector<Curve2> curves, LoopKind kind, int index) {
  TrimLoop loop;
  loop.kind = kind;
  loop.index = index;
  for (Curve2& c : curves) {
    TrimCurve curve;
    curve.curve = std::move(c);
    curve.index = static_cast<int>(loop.curves.size());
    loop.curves.push_back(std::move(curve));
  }
  return loop;
}

// A panel's outline: three lines and, as an armhole has it, a cubic of four spans.
TrimLoop outline(int number) {
  const double shift = 0.02 * std::sin(number);
  const Vector2d a{0.1 + shift, 0.1}, b{0.9, 0.15 + shift}, c{0.85, 0.9}, d{0.1, 0.8};
  const KnotVector knots = uniform_knots(3, 4, {0, 1});
  Curve2::Points points(2, knots.control_point_count());
  for (int i = 0; i < knots.control_point_count(); ++i) {
    const double t = knots.greville(i);
    points.col(i) = (1 - t) * c + t * d - Vector2d(0, 0.3 * t * (1 - t));
  }
  return closed_loop({line_segment<2>(a, b), line_segment<2>(b, c), Curve2(knots, points), line_segment<2>(d, a)},
                     LoopKind::outer, 0);
}

TrimLoop circle(const Vector2d& centre, double radius) {
  const double w = std::numbers::sqrt2 / 2;
  const Vector2d corners[] = {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}, {1, 0}};
  Curve2::Points points(2, 9);
  for (int i = 0; i < 9; ++i) points.col(i) = centre + radius * corners[i];
  return closed_loop({Curve2(KnotVector(2, {0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4}), points, {1, w, 1, w, 1, w, 1, w, 1})},
                     LoopKind::hole, 1);
}

OutputFace face(int number, int spans, bool hole) {
  OutputFace out;
  out.name = "face " + std::to_string(number);
  out.face.surface = bench::wavy_surface(spans, number);
  out.face.metres_per_unit = 0.001;
  out.face.loops.push_back(outline(number));
  if (hole) out.face.loops.push_back(circle({0.45, 0.4}, 0.1));
  return out;
}

void write_faces(const std::filesystem::path& path, int count, int spans, bool holes) {
  std::vector<OutputFace> faces;
  for (int i = 0; i < count; ++i) faces.push_back(face(i, spans, holes && i % 2 == 1));
  write_file(path, format_iges(faces, IgesHeader{}).text, Flush::no);
}

ProcessResult timed(const std::vector<std::string>& command, const std::filesystem::path& log) {
  const ProcessResult result = run_process(command, log, {.seconds = 600, .megabytes = 16384}, [] { return false; });
  if (result.end != ProcessResult::End::exited || result.code != 0)
    throw std::runtime_error(fmt::format("{} {}: exit {}, see {}", command[0], command[1], result.code, log.string()));
  return result;
}

void row(const std::string& what, const std::string& value, const std::string& target, bool met,
         const std::string& how) {
  fmt::print("{:<50} {:>16}  {:<22} {:<7} {}\n", what, value, target, met ? "met" : "MISSED", how);
}

void parse(const std::filesystem::path& work, const std::string& self) {
  const std::filesystem::path path = work / "large.igs";
  if (!std::filesystem::exists(path)) write_faces(path, 2000, 34, false);
  const double megabytes = static_cast<double>(std::filesystem::file_size(path)) / 1e6;
  const ProcessResult result = timed({self, "parse", path.string()}, work / "parse.log");
  const double rate = megabytes / result.cpu_seconds, memory = result.peak_megabytes / megabytes;
  const std::string how = fmt::format("1 core; {:.0f} MB, disk to panels, in {:.2f} s", megabytes, result.cpu_seconds);
  row("IGES text to panels", fmt::format("{:.0f} MB/s", rate), ">= 100 MB/s", rate >= 100, how);
  row("  peak resident memory over file size", fmt::format("{:.2f}", memory), "< 4", memory < 4, how);
}

void inspect(const std::filesystem::path& work, const std::string& toile) {
  const std::filesystem::path path = work / "faces.igs";
  if (!std::filesystem::exists(path)) write_faces(path, 10000, 8, true);
  const ProcessResult all = timed({toile, "inspect", path.string(), "--json"}, work / "inspect.json");
  const ProcessResult one = timed({toile, "inspect", path.string(), "--json", "--threads", "1"}, work / "inspect.json");
  row("10,000 trimmed faces inspected", fmt::format("{:.1f} s", all.wall_seconds), "< 20 s", all.wall_seconds < 20,
      fmt::format("every core; {:.1f} s on one; {:.0f} MB file, {:.0f} MB at most", one.wall_seconds,
                  static_cast<double>(std::filesystem::file_size(path)) / 1e6, all.peak_megabytes));
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 3) {
    std::fprintf(stderr, "usage: bench_large_iges WORK TOILE\n");
    return 2;
  }
  try {
    if (std::strcmp(arguments[1], "parse") == 0) return toile::read_iges(arguments[2]).panels.size() == 2000 ? 0 : 1;
    std::filesystem::create_directories(arguments[1]);
    parse(arguments[1], arguments[0]);
    inspect(arguments[1], arguments[2]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
