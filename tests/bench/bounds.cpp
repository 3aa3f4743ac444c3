// SPDX-License-Identifier: GPL-3.0-or-later
// What the machine can do at most, and what kernels ask of it: floating-point operations (those of the laws counted
// as they run, those of the sums over functions by hand) and bytes. bench_report divides one by the other.
#include <benchmark/benchmark.h>

#include <Eigen/Core>
#include <array>

#include "analysis/shell/point_kernel.h"
#include "bench/counted.h"

namespace toile {
namespace {

// One core: chains of multiplications and additions in registers, as many as hide their latency.
void machine_operations(benchmark::State& state) {
  constexpr int chains = 12, rounds = 1000;
  std::array<Lanes, chains> x;
  for (int c = 0; c < chains; ++c) x[c] = broadcast<Lanes>(1 + 0.01 * c);
  Lanes a = broadcast<Lanes>(0.999), b = broadcast<Lanes>(1e-3);
  benchmark::DoNotOptimize(a);
  benchmark::DoNotOptimize(b);
  for (auto _ : state) {
    for (int k = 0; k < rounds; ++k)
      for (int c = 0; c < chains; ++c) x[c] = a * x[c] + b;
    benchmark::DoNotOptimize(x);
  }
  state.SetItemsProcessed(state.iterations() * 2L * chains * rounds * lane_count);
}
BENCHMARK(machine_operations);

// One core: the sum of 256 MB.
void machine_reading(benchmark::State& state) {
  const Eigen::VectorXd numbers = Eigen::VectorXd::Ones(1 << 25);
  for (auto _ : state) benchmark::DoNotOptimize(numbers.sum());
  state.SetBytesProcessed(state.iterations() * numbers.size() * static_cast<std::int64_t>(sizeof(double)));
}
BENCHMARK(machine_reading)->Unit(benchmark::kMillisecond);

// Operations of the force at a quadrature point of an uncut cell with (p+1)^2 of them: the laws counted as they run,
// the sums over the functions as sweep_tensor (analysis/shell/shell_model.cpp) writes them.
double force_operations(int degree) {
  const double side = degree + 1;
  const auto vector = [](double x, double y, double z) { return Vec3<Counted>{{x}, {y}, {z}}; };
  const PointJet<Counted> jet{vector(1, 0.1, 0), vector(0.1, 1, 0.1), vector(0, 1, 1), vector(1, 0, 1), {}};
  PointJet<Counted> gradient;
  Counted::operations = 0;
  energy_gradient(PointLaw(Fabric{}), jet, Curvature<Counted>{}, gradient);
  const double law = static_cast<double>(Counted::operations);
  const double along_v = 2 * 3 * 6 * side;        // 3 sums there and 3 back, 6 operations each, (p+1)^3 of each a cell
  const double along_u = 2 * 5 * 6 * side;        // 5 sums there and 5 back at each point
  const double to_cloth_and_back = 56 + 53 + 12;  // parameters to weft and warp, transposed, times the weight
  return law + along_v + along_u + to_cloth_and_back;
}

void force_at_a_point(benchmark::State& state) {
  double operations = 0;
  for (auto _ : state) benchmark::DoNotOptimize(operations = force_operations(static_cast<int>(state.range(0))));
  state.counters["operations"] = operations;
}
BENCHMARK(force_at_a_point)->ArgName("p")->Arg(2)->Arg(3);

}  // namespace
}  // namespace toile
