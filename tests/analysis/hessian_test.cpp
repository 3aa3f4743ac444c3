// SPDX-License-Identifier: GPL-3.0-or-later
// Block patterns, and the shell's Hessian assembled on them.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <vector>

#include "analysis/linear/block_matrix.h"
#include "analysis/linear/cholesky.h"
#include "analysis/parallel/workers.h"
#include "analysis/scheme/reduced_matrix.h"
#include "analysis/shell/shell_model.h"
#include "geometry/refine.h"
#include "support/near.h"
#include "support/panels.h"

namespace toile {
namespace {

using test::Random;

TEST(BlockPattern, HasABlockForEachPairThatActsOnEachOtherAndForEachPoint) {
  const BlockPattern pattern(5, {{0, 3}, {3, 1, 0}, {3, 3}});
  EXPECT_EQ(pattern.points(), 5);
  EXPECT_EQ(pattern.blocks(), 8);
  const std::vector<std::vector<int>> rows{{0, 1, 3}, {1, 3}, {2}, {3}, {4}};
  int slot = 0;
  for (int column = 0; column < 5; ++column) {
    const auto of = pattern.rows(column);
    EXPECT_EQ(std::vector<int>(of.begin(), of.end()), rows[static_cast<std::size_t>(column)]);
    for (const int row : of) EXPECT_EQ(pattern.slot(row, column), slot++);
  }
  EXPECT_THROW(pattern.slot(4, 0), std::out_of_range);
}

Eigen::MatrixXd dense(const BlockMatrix& matrix) {
  const int n = 3 * matrix.pattern().points();
  Eigen::MatrixXd out(n, n);
  Eigen::VectorXd image(n);
  for (int k = 0; k < n; ++k) {
    matrix.multiply(Eigen::VectorXd::Unit(n, k), image);
    out.col(k) = image;
  }
  return out;
}

TEST(ReducedMatrix, IsTheMatrixBetweenTheMap) {
  // Point 1 is fixed, point 3 follows three others, of which it has a block with one; point 4 follows one.
  AffineMap::Matrix dependence = AffineMap::identity(6);
  std::vector<Eigen::Triplet<double>> entries{{0, 0, 1},   {1, 1, 1},    {2, 2, 1},   {5, 5, 1},
                                              {3, 0, 0.7}, {3, 2, -0.4}, {3, 1, 0.7}, {4, 5, 1}};
  dependence.setFromTriplets(entries.begin(), entries.end());
  const AffineMap map(dependence, {1}, [](std::size_t, double) { return Eigen::Vector3d(1, 2, 3); });
  const BlockPattern pattern(6, {{0, 2, 3}, {3, 4, 5}, {1, 2}});
  BlockMatrix matrix(pattern);
  Random random(5);
  for (int slot = 0; slot < pattern.blocks(); ++slot)
    for (int e = 0; e < 9; ++e) matrix.block(slot)[e] = random();
  const ReducedMatrix reduced(pattern, map);
  BlockMatrix out(reduced.pattern());
  reduced.reduce(matrix, out);
  Eigen::MatrixXd t = Eigen::MatrixXd::Zero(18, 3 * map.nodes());
  for (int i = 0; i < 6; ++i)
    for (AffineMap::Matrix::InnerIterator e(map.free_part(), i); e; ++e)
      for (int a = 0; a < 3; ++a) t(3 * i + a, 3 * e.col() + a) = e.value();
  EXPECT_LT((dense(out) - t.transpose() * dense(matrix) * t).norm(), 1e-13 * dense(matrix).norm());
}

TEST(BlockMatrix, ItsScalarsAreThoseOfItsProducts) {
  const BlockPattern pattern(4, {{0, 2}, {1, 2, 3}});
  BlockMatrix matrix(pattern);
  Random random(3);
  for (int slot = 0; slot < pattern.blocks(); ++slot)
    for (int e = 0; e < 9; ++e) matrix.block(slot)[e] = random();
  const Eigen::MatrixXd a = dense(matrix);
  EXPECT_EQ(a, a.transpose());
  const SparsePattern scalars = pattern.scalars();
  std::vector<double> values(scalars.row.size());
  matrix.write(values);
  Eigen::MatrixXd lower = Eigen::MatrixXd::Zero(12, 12);
  for (int c = 0; c < scalars.size(); ++c)
    for (int k = scalars.column_start[c]; k < scalars.column_start[c + 1]; ++k) lower(scalars.row[k], c) = values[k];
  EXPECT_EQ(lower, Eigen::MatrixXd(a.triangularView<Eigen::Lower>()));
}

Fabric fabric(double twist, bool membrane = true, bool bending = true) {
  Fabric f;
  f.membrane = {11.7, 25.0, 4.68};
  if (!membrane) f.membrane = {0, 0, 0};
  f.bending = {.b0 = bending ? 0.05 : 0, .kappa0 = 3, .kappa_reg = 0.5, .twist = twist};
  return f;
}

// With a C0 line in each direction.
ClothPanel creased(int degree) {
  NurbsSurface surface = test::bumpy_surface(degree, 3, 3, false);
  for (const Direction d : {Direction::u, Direction::v})
    surface = insert_knots(surface, d,
                           std::vector<double>(static_cast<std::size_t>(degree - 1), surface.knots(d).breaks()[1]));
  ClothPanel panel = test::make_panel(surface, fabric(1e-3));
  const TrimmedSurface face = untrimmed(surface);
  panel.kinks = kink_points(face, trace_trims(face));
  EXPECT_FALSE(panel.kinks.empty());
  return panel;
}

// Of every kind of table, law and cell; two panels in one model.
std::vector<ShellModel> models() {
  std::vector<ShellModel> out;
  for (const int degree : {2, 3})
    for (const bool rational : {false, true})
      out.emplace_back(std::vector{test::make_panel(test::bumpy_surface(degree, 3, 2, rational), fabric(1e-3), 0.3),
                                   test::make_panel(test::bumpy_surface(degree, 2, 3, rational), fabric(0))});
  out.emplace_back(std::vector{test::make_panel(test::bumpy_surface(2, 4, 3, false), fabric(0, true, false))});
  out.emplace_back(std::vector{test::make_panel(test::bumpy_surface(4, 2, 3, false), fabric(0, false, true))});
  Fabric coupled = fabric(1e-3);
  coupled.membrane.coupling = 7;
  coupled.bending.coupling = 0.03;
  out.emplace_back(std::vector{test::make_panel(test::bumpy_surface(3, 3, 2, false), coupled, 0.3)});
  out.emplace_back(std::vector{test::make_panel(test::bumpy_surface(2, 3, 3, false), isotropic(300, 0.3, 0.01))});
  ClothPanel cut = test::make_panel(test::bumpy_surface(2, 5, 4, false), fabric(1e-3));
  cut.quadrature = test::tensor_quadrature(cut.rest, {Interval{-0.7, 1.63}, Interval{0.03, 0.41}});
  out.emplace_back(std::vector{cut});
  out.emplace_back(std::vector{creased(2)});
  out.emplace_back(std::vector{creased(3)});
  return out;
}

struct Assembled {
  explicit Assembled(const ShellModel& model)
      : pattern(model.point_count(), model.couplings()), slots(model.slots(pattern)), matrix(pattern) {}
  BlockPattern pattern;
  std::vector<int> slots;
  BlockMatrix matrix;
  void operator()(const ShellModel& model, const Eigen::VectorXd& q, TangentKind kind, Workers* workers = nullptr) {
    matrix.set_zero();
    model.add_hessian(q, kind, slots, matrix, workers);
  }
};

// Strained, bent on both branches of the law, and squeezed so that the guard holds.
std::vector<Eigen::VectorXd> states(const ShellModel& model) {
  std::vector<Eigen::VectorXd> out(2, model.rest() + 0.03 * Random(7).vector(model.rest().size()));
  for (Eigen::Index k = 0; k < out[1].size(); k += 3) out[1][k] *= 0.4;
  return out;
}

TEST(ShellHessian, IsTheTangentThatForcesHave) {
  int number = 0;
  for (const ShellModel& model : models()) {
    SCOPED_TRACE(number++);
    Assembled hessian(model);
    for (const Eigen::VectorXd& q : states(model))
      for (const TangentKind kind : {TangentKind::exact, TangentKind::upper}) {
        hessian(model, q, kind);
        for (const std::uint64_t seed : {1u, 2u, 3u}) {
          const Eigen::VectorXd dq = Random(seed).vector(q.size());
          Eigen::VectorXd expected(q.size()), image(q.size());
          model.apply_tangent(q, dq, expected, kind);
          hessian.matrix.multiply(dq, image);
          EXPECT_LT((image - expected).cwiseAbs().maxCoeff(), 1e-12 * expected.cwiseAbs().maxCoeff());
        }
      }
  }
}

TEST(ShellHessian, ThePositiveOneHasNoNegativeEigenvalue) {
  int number = 0;
  for (const ShellModel& model : models()) {
    SCOPED_TRACE(number++);
    Assembled hessian(model);
    double exact_least = 0;
    for (const Eigen::VectorXd& q : states(model)) {
      hessian(model, q, TangentKind::positive);
      const Eigen::VectorXd positive =
          Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(dense(hessian.matrix)).eigenvalues();
      EXPECT_GT(positive[0], -1e-13 * positive.tail<1>()[0]);
      hessian(model, q, TangentKind::exact);
      exact_least =
          std::min(exact_least, Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(dense(hessian.matrix)).eigenvalues()[0]);
    }
    EXPECT_LT(exact_least, 0) << "or nothing is shown";
  }
}

// Where nothing is strained or bent there is nothing to leave out.
TEST(ShellHessian, ThePositiveOneIsExactAtRest) {
  for (const ShellModel& model : models()) {
    Assembled exact(model), positive(model);
    exact(model, model.rest(), TangentKind::exact);
    positive(model, model.rest(), TangentKind::positive);
    const Eigen::MatrixXd k = dense(exact.matrix);
    EXPECT_LT((dense(positive.matrix) - k).cwiseAbs().maxCoeff(), 1e-10 * k.cwiseAbs().maxCoeff());
  }
}

TEST(ShellHessian, ThreadsGiveTheSameBits) {
  const ShellModel model({test::make_panel(test::bumpy_surface(2, 60, 50, false), fabric(0.01))});
  ASSERT_GT(model.quadrature_points(), 8000u);
  const Eigen::VectorXd q = states(model)[0];
  Assembled one(model), many(model);
  one(model, q, TangentKind::exact);
  const std::size_t numbers = 9 * static_cast<std::size_t>(one.pattern.blocks());
  for (const int threads : {2, 3, 7}) {
    Workers workers(threads);
    many(model, q, TangentKind::exact, &workers);
    EXPECT_TRUE(std::equal(one.matrix.block(0), one.matrix.block(0) + numbers, many.matrix.block(0))) << threads;
  }
}

// An implicit step's system: the factor takes what is assembled.
TEST(ShellHessian, TheFactorSolvesWithIt) {
  const ShellModel model({test::make_panel(test::bumpy_surface(2, 12, 9, false), fabric(1e-3))});
  const Eigen::VectorXd q = states(model)[0];
  Assembled hessian(model);
  hessian(model, q, TangentKind::positive);
  for (int p = 0; p < model.point_count(); ++p)
    for (int k = 0; k < 3; ++k)
      hessian.matrix.block(hessian.pattern.slot(p, p))[4 * k] += model.lumped_mass()[p] / (1e-3 * 1e-3);
  const SparsePattern scalars = hessian.pattern.scalars();
  std::vector<double> values(scalars.row.size());
  hessian.matrix.write(values);
  Cholesky factor(scalars);
  ASSERT_TRUE(factor.factorise(values));
  const Eigen::VectorXd expected = Random(9).vector(q.size());
  Eigen::VectorXd rhs(q.size()), x(q.size());
  hessian.matrix.multiply(expected, rhs);
  factor.solve(rhs, x);
  EXPECT_LT((x - expected).cwiseAbs().maxCoeff(), 1e-10);
}

}  // namespace
}  // namespace toile
