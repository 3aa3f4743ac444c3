// SPDX-License-Identifier: GPL-3.0-or-later
// Speed of evaluation: surface points a second with first and second derivatives, one core. Basis tables are made
// outside the loop for the grid (they are made once for a run), inside for the other two.
#include <benchmark/benchmark.h>

#include <random>

#include "geometry/grid_evaluation.h"
#include "geometry/measure.h"

namespace toile {
namespace {

NurbsSurface wavy(int degree, int spans, bool rational) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const KnotVector knots = uniform_knots(degree, spans);
  const int n = knots.control_point_count();
  Eigen::Matrix3Xd points(3, n * n);
  std::vector<double> weights;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      points.col(i + n * j) << knots.greville(i), knots.greville(j), 0.1 * uniform(random);
      if (rational) weights.push_back(1.5 + uniform(random));
    }
  return {knots, knots, points, weights};
}

// Gauss-like points: `per_span` in every span of the domain.
std::vector<double> parameters(const KnotVector& knots, int per_span) {
  std::vector<double> result;
  for (int s : knots.spans())
    for (int k = 0; k < per_span; ++k) result.push_back(knots[s] + (knots[s + 1] - knots[s]) * (k + 0.5) / per_span);
  return result;
}

void grid(benchmark::State& state) {
  const int degree = static_cast<int>(state.range(0));
  const NurbsSurface surface = wavy(degree, 10, state.range(1) != 0);
  const auto u = tabulate_basis(surface.u(), parameters(surface.u(), degree + 1));
  std::vector<SurfaceJet> jets(u.size() * u.size());
  for (auto _ : state) {
    evaluate_grid(surface, u, u, jets);
    benchmark::DoNotOptimize(jets.data());
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(jets.size()));
}
BENCHMARK(grid)->ArgNames({"p", "rational"})->ArgsProduct({{2, 3, 5}, {0, 1}});

void grouped_by_span(benchmark::State& state) {
  const int degree = static_cast<int>(state.range(0));
  const NurbsSurface surface = wavy(degree, 10, state.range(1) != 0);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0, 0.1);
  std::vector<Eigen::Vector2d> points(16);
  std::vector<SurfaceJet> jets(points.size());
  for (auto& point : points) point << uniform(random), uniform(random);
  const auto spans = surface.u().spans();
  for (auto _ : state)
    for (int su : spans)
      for (int sv : spans) {
        evaluate_on_span(surface, su, sv, points, jets);
        benchmark::DoNotOptimize(jets.data());
        benchmark::ClobberMemory();
      }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(points.size() * spans.size() * spans.size()));
}
BENCHMARK(grouped_by_span)->ArgNames({"p", "rational"})->ArgsProduct({{2, 3, 5}, {0, 1}});

void single_point(benchmark::State& state) {
  const NurbsSurface surface = wavy(static_cast<int>(state.range(0)), 10, state.range(1) != 0);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Eigen::Vector2d> points(1000);
  for (auto& point : points) point << uniform(random), uniform(random);
  for (auto _ : state)
    for (const auto& point : points) benchmark::DoNotOptimize(evaluate(surface, point.x(), point.y()));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(points.size()));
}
BENCHMARK(single_point)->ArgNames({"p", "rational"})->ArgsProduct({{2, 3, 5}, {0, 1}});

// One query with the search of the whole surface (30 x 30 spans), and one that starts near the answer.
void closest(benchmark::State& state) {
  const NurbsSurface surface = wavy(static_cast<int>(state.range(0)), 30, false);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  ClosestPointOptions options;
  for (auto _ : state) {
    const double u = uniform(random), v = uniform(random);
    const Eigen::Vector3d target = surface(u, v) + Eigen::Vector3d(0.001, 0.002, 0.03);
    if (state.range(1)) options.start = Eigen::Vector2d(u, v);
    benchmark::DoNotOptimize(closest_point(surface, target, options));
  }
}
BENCHMARK(closest)->ArgNames({"p", "start"})->ArgsProduct({{2, 3}, {0, 1}});

}  // namespace
}  // namespace toile
