// SPDX-License-Identifier: GPL-3.0-or-later
// Constraint points of a 200 x 200-span face with a trim of 500 spans: validation, tracing and listing, one core.
// Making the face is excluded.
#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>

#include "trimming/constraint_points.h"
#include "trimming/loops.h"
#include "trimming/quadrature.h"
#include "trimming/triangulation.h"

namespace {

using namespace toile;

// A wavy closed cubic B-spline of 500 spans, one curve, around the middle of the unit square.
TrimmedSurface wavy_face(int spans, int trim_spans) {
  std::vector<double> breaks;
  for (int k = 0; k <= spans; ++k) breaks.push_back(static_cast<double>(k) / spans);
  const KnotVector knots = clamped_knots(3, breaks);
  const int n = knots.control_point_count();
  Eigen::Matrix3Xd net(3, n * n);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) net.col(i + n * j) << knots.greville(i), knots.greville(j), 0;
  TrimmedSurface face;
  face.name = "bench";
  face.surface = NurbsSurface(knots, knots, net);

  std::vector<double> trim_breaks;
  for (int k = 0; k <= trim_spans; ++k) trim_breaks.push_back(k);
  const KnotVector trim_knots = clamped_knots(3, trim_breaks);
  const int m = trim_knots.control_point_count();
  Curve2::Points points(2, m);
  for (int k = 0; k < m; ++k) {
    const double a = 2 * std::numbers::pi * k / (m - 1), r = 0.35 + 0.1 * std::sin(12 * a);
    points.col(k) << 0.5 + r * std::cos(a), 0.5 + r * std::sin(a);
  }
  points.col(m - 1) = points.col(0);
  TrimLoop loop;
  TrimCurve curve;
  curve.curve = Curve2(trim_knots, points);
  loop.curves.push_back(curve);
  face.loops.push_back(loop);
  return face;
}

void constraint_points_of_a_large_face(benchmark::State& state) {
  const TrimmedSurface given = wavy_face(200, 500);
  std::size_t count = 0;
  for (auto _ : state) {
    TrimmedSurface face = given;
    validate_loops(face);
    const TrimTopology topology = trace_trims(face);
    count = constraint_points(face, topology).size();
    benchmark::DoNotOptimize(count);
  }
  state.counters["points"] = static_cast<double>(count);
}
BENCHMARK(constraint_points_of_a_large_face)->Unit(benchmark::kMillisecond);

void loop_validation(benchmark::State& state) {
  const TrimmedSurface given = wavy_face(200, 500);
  for (auto _ : state) {
    TrimmedSurface face = given;
    benchmark::DoNotOptimize(validate_loops(face).size());
  }
}
BENCHMARK(loop_validation)->Unit(benchmark::kMillisecond);

void tracing(benchmark::State& state) {
  TrimmedSurface face = wavy_face(200, 500);
  validate_loops(face);
  for (auto _ : state) {
    const TrimTopology topology = trace_trims(face);
    state.counters["signs"] = static_cast<double>(topology.counts.coefficient_signs);
    state.counters["interval"] = static_cast<double>(topology.counts.interval);
    state.counters["exact"] = static_cast<double>(topology.counts.exact);
    state.counters["algebraic"] = static_cast<double>(topology.counts.algebraic);
  }
}
BENCHMARK(tracing)->Unit(benchmark::kMillisecond);

void point_in_material(benchmark::State& state) {
  TrimmedSurface face = wavy_face(200, 500);
  validate_loops(face);
  const TrimTopology topology = trace_trims(face);
  int inside = 0, k = 0;
  for (auto _ : state) {
    k = (k + 7919) % 1000003;
    inside += contains(face, topology, {(k % 1009) / 1009.0, (k % 997) / 997.0});
  }
  benchmark::DoNotOptimize(inside);
}
BENCHMARK(point_in_material);

// Rules of the same face, degree 4 x 4 (p = 2) or 6 x 6 (p = 3) on cut cells; tracing is excluded. `per_cut_cell`
// counts the uncut cells' Gauss points too.
void cut_quadrature(benchmark::State& state) {
  TrimmedSurface face = wavy_face(40, 500);
  validate_loops(face);
  const TrimTopology topology = trace_trims(face);
  const int p = static_cast<int>(state.range(0));
  for (auto _ : state)
    benchmark::DoNotOptimize(
        quadrature(face, topology, {.degree_u = 2 * p, .degree_v = 2 * p, .gauss_u = p + 1, .gauss_v = p + 1}));
  state.counters["cut_cells"] = static_cast<double>(topology.cut_cells.size());
  state.counters["per_cut_cell"] =
      benchmark::Counter(static_cast<double>(topology.cut_cells.size()),
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(cut_quadrature)->Arg(2)->Arg(3)->Unit(benchmark::kMillisecond);

void triangulation(benchmark::State& state) {
  TrimmedSurface face = wavy_face(40, 500);
  validate_loops(face);
  const TrimTopology topology = trace_trims(face);
  for (auto _ : state) benchmark::DoNotOptimize(triangulate(face, topology));
}
BENCHMARK(triangulation)->Unit(benchmark::kMillisecond);

}  // namespace
