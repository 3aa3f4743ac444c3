// Costs of mechanics, one core. The shell: the cloth of example 4.1(a) on n x n control points of the unit square in a
// rough state, (p+1)^2 Gauss points a cell; building the model is excluded. `per_point` is the time that the issue
// bounds by 0.1 us at p = 2.
#include <benchmark/benchmark.h>

#include <Eigen/Core>

#include "analysis/shell/shell_model.h"
#include "support/panels.h"

namespace toile {
namespace {

struct ShellBench {
  ShellBench(int degree, int control_points, double twist = 0)
      : model([&] {
          Fabric fabric;
          fabric.bending.twist = twist;
          const int spans = control_points - degree;
          return ShellModel({test::make_flat_panel(1, 1, degree, spans, spans, fabric)});
        }()),
        q(model.rest() + 0.01 / control_points * test::Random(1).vector(model.rest().size())),
        force(q.size()) {}
  void count(benchmark::State& state) const {
    const double points = static_cast<double>(model.quadrature_points());
    state.counters["points"] = points;
    state.counters["per_point"] =
        benchmark::Counter(points, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
    state.counters["bytes_per_point"] = static_cast<double>(model.table_bytes()) / points;
  }
  ShellModel model;
  Eigen::VectorXd q, force;
};

void shell_force(benchmark::State& state) {
  ShellBench bench(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  for (auto _ : state) benchmark::DoNotOptimize(bench.model.internal_force(bench.q, bench.force));
  bench.count(state);
}
BENCHMARK(shell_force)->ArgNames({"p", "n"})->ArgsProduct({{2, 3}, {10, 32, 100, 316}})->Unit(benchmark::kMicrosecond);

void shell_force_with_twist(benchmark::State& state) {
  ShellBench bench(static_cast<int>(state.range(0)), 32, 1e-3);
  for (auto _ : state) benchmark::DoNotOptimize(bench.model.internal_force(bench.q, bench.force));
  bench.count(state);
}
BENCHMARK(shell_force_with_twist)->ArgName("p")->Arg(2)->Arg(3)->Unit(benchmark::kMicrosecond);

void shell_force_by_threads(benchmark::State& state) {
  ShellBench bench(2, static_cast<int>(state.range(1)));
  bench.model.use_threads(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(bench.model.internal_force(bench.q, bench.force));
  bench.count(state);
}
BENCHMARK(shell_force_by_threads)
    ->ArgNames({"threads", "n"})
    ->ArgsProduct({{1, 2}, {20, 25, 32, 50, 100, 316}})
    ->Unit(benchmark::kMicrosecond)
    ->UseRealTime();

void shell_tangent(benchmark::State& state) {
  ShellBench bench(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  const Eigen::VectorXd dq = test::Random(2).vector(bench.q.size());
  for (auto _ : state) {
    bench.model.apply_tangent(bench.q, dq, bench.force);
    benchmark::DoNotOptimize(bench.force.data());
  }
  bench.count(state);
}
BENCHMARK(shell_tangent)->ArgNames({"p", "n"})->ArgsProduct({{2, 3}, {10, 100}})->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace toile
