// SPDX-License-Identifier: GPL-3.0-or-later
// Costs of mechanics, one core. The shell: the cloth of example 4.1(a) on n x n control points of the unit square in a
// rough state, (p+1)^2 Gauss points a cell; building the model is excluded. `per_point` is the time that the issue
// bounds by 0.1 us at p = 2. The strain limit: one iteration, and its factors against others, on n x n control points
// at p = 2, weft and warp limited at all knot vertices, nothing held.
#include <benchmark/benchmark.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseLU>
#include <memory>

#include "analysis/constraint/composed_rows.h"
#include "analysis/flat_cloth.h"
#include "analysis/linear/block_matrix.h"
#include "analysis/linear/cholesky.h"
#include "analysis/projection/lagrange_newton.h"
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

// Per element, for implicit steps.
void shell_hessian(benchmark::State& state) {
  ShellBench bench(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  const BlockPattern pattern(bench.model.point_count(), bench.model.couplings());
  const std::vector<int> slots = bench.model.slots(pattern);
  BlockMatrix matrix(pattern);
  for (auto _ : state) {
    matrix.set_zero();
    bench.model.add_hessian(bench.q, TangentKind::positive, slots, matrix, nullptr);
    benchmark::DoNotOptimize(matrix.block(0));
  }
  const double spans = static_cast<double>(state.range(1) - state.range(0));
  state.counters["per_element"] =
      benchmark::Counter(spans * spans, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(shell_hessian)->ArgNames({"p", "n"})->ArgsProduct({{2, 3}, {32, 100}})->Unit(benchmark::kMicrosecond);

void shell_force_with_twist(benchmark::State& state) {
  ShellBench bench(static_cast<int>(state.range(0)), 32, 1e-3);
  for (auto _ : state) benchmark::DoNotOptimize(bench.model.internal_force(bench.q, bench.force));
  bench.count(state);
}
BENCHMARK(shell_force_with_twist)->ArgName("p")->Arg(2)->Arg(3)->Unit(benchmark::kMicrosecond);

void shell_force_by_threads(benchmark::State& state) {
  ShellBench bench(2, static_cast<int>(state.range(1)));
  Workers workers(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(bench.model.internal_force(bench.q, bench.force, &workers));
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

struct LimitBench {
  explicit LimitBench(int control_points)
      : cloth(test::flat_cloth(2, control_points - 2)),
        map(test::free_map(cloth)),
        rows{test::vertex_rows(cloth), {}},
        x(test::disturbed(cloth.rest, 0.01 / control_points, 1)),
        composed(compose(map, rows)),
        y(3, composed.free.size()) {
    evaluate(composed, x, Eigen::Matrix3Xd(3, 0), y);
  }
  int size() const { return composed.free.size(); }
  test::FlatCloth cloth;
  AffineMap map;
  ConstraintRows rows;
  Eigen::VectorXd x;
  ComposedRows composed;
  Eigen::Matrix3Xd y;
};

template <class Solver>
void limit_iteration(benchmark::State& state) {
  const LimitBench bench(static_cast<int>(state.range(0)));
  Solver solver(bench.map, bench.cloth.mass, bench.rows,
                {.variant = ProjectionVariant::paper, .tolerance = 1e-15, .max_iterations = 1});
  Eigen::VectorXd x = bench.x;
  for (auto _ : state) {
    x = bench.x;
    benchmark::DoNotOptimize(solver.project(x, 0));
  }
  state.counters["rows"] = bench.size();
  state.counters["factor_nonzeros"] = static_cast<double>(solver.factor_nonzeros());
}
BENCHMARK_TEMPLATE(limit_iteration, FastProjection)
    ->ArgName("n")
    ->Arg(10)
    ->Arg(32)
    ->Arg(100)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_TEMPLATE(limit_iteration, LagrangeNewton)
    ->ArgName("n")
    ->Arg(10)
    ->Arg(32)
    ->Arg(100)
    ->Unit(benchmark::kMicrosecond);

// Eq. (27) as the paper writes it, unsymmetric, 3 n + m rows, by a supernodal LU: numeric factorisation and one
// solution, without assembly and analysis.
void eq_27_as_written(benchmark::State& state) {
  const LimitBench bench(static_cast<int>(state.range(0)));
  const CompressedRows& d = bench.composed.free;
  const int unknowns = static_cast<int>(bench.x.size());
  const double lambda = 1e-3 * bench.cloth.mass.mean() / d.size();  // any: the pattern counts
  std::vector<Eigen::Triplet<double>> entries;
  for (int k = 0; k < unknowns; ++k) entries.emplace_back(k, k, 1);
  for (int r = 0; r < d.size(); ++r)
    for (int p = d.start[r]; p < d.start[r + 1]; ++p)
      for (int a = 0; a < 3; ++a) {
        const int i = 3 * d.column[p] + a;
        const double mass = bench.cloth.mass[d.column[p]], gradient = d.value[p] * bench.y(a, r);
        entries.emplace_back(i, unknowns + r, gradient / mass);
        entries.emplace_back(unknowns + r, i, gradient);
        for (int q = d.start[r]; q < d.start[r + 1]; ++q)
          entries.emplace_back(i, 3 * d.column[q] + a, lambda * d.value[p] * d.value[q] / mass);
      }
  Eigen::SparseMatrix<double> matrix(unknowns + d.size(), unknowns + d.size());
  matrix.setFromTriplets(entries.begin(), entries.end());
  Eigen::SparseLU<Eigen::SparseMatrix<double>> factor;
  factor.analyzePattern(matrix);
  const Eigen::VectorXd rhs = Eigen::VectorXd::Ones(matrix.rows());
  Eigen::VectorXd solution(rhs.size());
  for (auto _ : state) {
    factor.factorize(matrix);
    solution = factor.solve(rhs);
    benchmark::DoNotOptimize(solution.data());
  }
  if (factor.info() != Eigen::Success) state.SkipWithError("singular");
  state.counters["rows"] = static_cast<double>(matrix.rows());
  state.counters["factor_nonzeros"] = static_cast<double>(factor.nnzL() + factor.nnzU());
}
BENCHMARK(eq_27_as_written)->ArgName("n")->Arg(10)->Arg(32)->Arg(100)->Unit(benchmark::kMicrosecond);

// The projection's matrix, lower triangle: what the factors below refactor and solve.
struct LimitMatrix {
  explicit LimitMatrix(int control_points)
      : bench(control_points), gram(gram_matrix(bench.composed.free, bench.cloth.mass)) {
    const auto& start = gram.pattern.column_start;
    for (int c = 0; c < bench.size(); ++c)
      for (int e = start[c]; e < start[c + 1]; ++e)
        gram.value[e] *= bench.y.col(c).dot(bench.y.col(gram.pattern.row[e])) * (e == start[c] ? 1.001 : 1);
  }
  Eigen::SparseMatrix<double> sparse() const {
    return Eigen::Map<const Eigen::SparseMatrix<double>>(bench.size(), bench.size(), gram.pattern.row.size(),
                                                         gram.pattern.column_start.data(), gram.pattern.row.data(),
                                                         gram.value.data());
  }
  LimitBench bench;
  GramMatrix gram;
};

template <class Factorise, class Solve>
void time_factor(benchmark::State& state, const LimitMatrix& matrix, Factorise factorise, Solve solve) {
  const Eigen::VectorXd rhs = Eigen::VectorXd::Ones(matrix.bench.size());
  Eigen::VectorXd solution(rhs.size());
  for (auto _ : state) {
    factorise();
    solve(rhs, solution);
    benchmark::DoNotOptimize(solution.data());
  }
  state.counters["rows"] = matrix.bench.size();
}

void small_factor_ours(benchmark::State& state) {
  const LimitMatrix matrix(static_cast<int>(state.range(0)));
  Cholesky factor(matrix.gram.pattern);
  time_factor(
      state, matrix, [&] { factor.factorise(matrix.gram.value); },
      [&](const Eigen::VectorXd& b, Eigen::VectorXd& x) { factor.solve(b, x); });
}
void small_factor_simplicial(benchmark::State& state) {
  const LimitMatrix matrix(static_cast<int>(state.range(0)));
  const Eigen::SparseMatrix<double> lower = matrix.sparse();
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor;
  factor.analyzePattern(lower);
  time_factor(
      state, matrix, [&] { factor.factorize(lower); },
      [&](const Eigen::VectorXd& b, Eigen::VectorXd& x) { x = factor.solve(b); });
}
void small_factor_dense(benchmark::State& state) {
  const LimitMatrix matrix(static_cast<int>(state.range(0)));
  const Eigen::MatrixXd lower(matrix.sparse());
  Eigen::LLT<Eigen::MatrixXd> factor(lower.rows());
  time_factor(
      state, matrix, [&] { factor.compute(lower); },
      [&](const Eigen::VectorXd& b, Eigen::VectorXd& x) { x = factor.solve(b); });
}
BENCHMARK(small_factor_ours)->ArgName("n")->DenseRange(4, 12, 2)->Unit(benchmark::kMicrosecond);
BENCHMARK(small_factor_simplicial)->ArgName("n")->DenseRange(4, 12, 2)->Unit(benchmark::kMicrosecond);
BENCHMARK(small_factor_dense)->ArgName("n")->DenseRange(4, 12, 2)->Unit(benchmark::kMicrosecond);

// Both halves alone, with what they compute and read.
void factorisation(benchmark::State& state) {
  const LimitMatrix matrix(static_cast<int>(state.range(0)));
  Cholesky factor(matrix.gram.pattern);
  for (auto _ : state) benchmark::DoNotOptimize(factor.factorise(matrix.gram.value));
  state.counters["rows"] = matrix.bench.size();
  state.counters["operations"] = factor.factor_operations();
  state.counters["bytes"] = 8 * static_cast<double>(factor.factor_nonzeros());
}
void solution(benchmark::State& state) {
  const LimitMatrix matrix(static_cast<int>(state.range(0)));
  Cholesky factor(matrix.gram.pattern);
  factor.factorise(matrix.gram.value);
  const Eigen::VectorXd rhs = Eigen::VectorXd::Ones(matrix.bench.size());
  Eigen::VectorXd x(rhs.size());
  for (auto _ : state) {
    factor.solve(rhs, x);
    benchmark::DoNotOptimize(x.data());
  }
  // Forth and back: two operations a nonzero each time.
  state.counters["rows"] = matrix.bench.size();
  state.counters["operations"] = 4 * static_cast<double>(factor.factor_nonzeros());
  state.counters["bytes"] = 2 * 8 * static_cast<double>(factor.factor_nonzeros());
}
BENCHMARK(factorisation)->ArgName("n")->Arg(10)->Arg(32)->Arg(100)->Unit(benchmark::kMicrosecond);
BENCHMARK(solution)->ArgName("n")->Arg(10)->Arg(32)->Arg(100)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace toile
