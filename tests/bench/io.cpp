// SPDX-License-Identifier: GPL-3.0-or-later
// Speed of IGES: 100 trimmed faces with bicubic nets and four-curve loops, about 10 MB, one core. Reading starts from
// the bytes in memory (a cold disk is not our speed) and ends with panels; limit 0.3 s, that is 33 MB/s.
#include <benchmark/benchmark.h>

#include "bench/wavy_surface.h"
#include "io/iges.h"

namespace toile {
namespace {

TrimmedSurface face(int number) {
  TrimmedSurface out;
  out.surface = bench::wavy_surface(34, number);
  out.metres_per_unit = 0.001;
  TrimLoop loop;
  const Eigen::Vector2d corners[] = {{0.1, 0.1}, {0.9, 0.15}, {0.85, 0.9}, {0.1, 0.8}};
  for (int k = 0; k < 4; ++k) {
    TrimCurve curve;
    curve.curve = line_segment<2>(corners[k], corners[(k + 1) % 4]);
    curve.index = k;
    loop.curves.push_back(curve);
  }
  out.loops.push_back(loop);
  return out;
}

std::vector<OutputFace> hundred_faces() {
  std::vector<OutputFace> faces;
  for (int i = 0; i < 100; ++i) faces.push_back({face(i), "face " + std::to_string(i), 0, {}});
  return faces;
}

const std::string& text_of_hundred_faces() {
  static const std::string text = format_iges(hundred_faces(), IgesHeader{}).text;
  return text;
}

void read_100_faces(benchmark::State& state) {
  const std::string& text = text_of_hundred_faces();
  for (auto _ : state) {
    const PanelFile file = parse_iges(text, "hundred.igs");
    if (file.panels.size() != 100) state.SkipWithError("faces lost");
    benchmark::DoNotOptimize(file.panels.data());
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) * static_cast<std::int64_t>(text.size()));
  state.counters["MB"] = static_cast<double>(text.size()) / 1e6;
}
BENCHMARK(read_100_faces)->Unit(benchmark::kMillisecond);

// Fitting the model curves included.
void write_100_faces(benchmark::State& state) {
  const std::vector<OutputFace> faces = hundred_faces();
  for (auto _ : state) benchmark::DoNotOptimize(format_iges(faces, IgesHeader{}).text.data());
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) *
                          static_cast<std::int64_t>(text_of_hundred_faces().size()));
}
BENCHMARK(write_100_faces)->Unit(benchmark::kMillisecond);

void rewrite_100_faces(benchmark::State& state) {
  const PanelFile file = parse_iges(text_of_hundred_faces(), "hundred.igs");
  for (auto _ : state) benchmark::DoNotOptimize(format_iges(file, IgesMode::rewrite).data());
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) *
                          static_cast<std::int64_t>(text_of_hundred_faces().size()));
}
BENCHMARK(rewrite_100_faces)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace toile
