// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/map/extension.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/shell/shell_model.h"
#include "geometry/basis.h"
#include "support/near.h"
#include "support/panels.h"

namespace toile {
namespace {

// B-spline coefficients of a polynomial of degree <= p by interpolation at the Greville abscissae, moved inside.
Eigen::VectorXd spline_coefficients(const KnotVector& knots, const Eigen::VectorXd& polynomial) {
  const int n = knots.control_point_count();
  Eigen::MatrixXd collocation = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd values = Eigen::VectorXd::Zero(n);
  for (int i = 0; i < n; ++i) {
    const double u = std::clamp(knots.greville(i), knots.domain().min, knots.domain().max);
    const BasisValues b = evaluate_basis(knots, u, 0);
    for (int a = 0; a <= b.degree; ++a) collocation(i, b.first + a) = b.value[0][a];
    for (int k = 0; k < polynomial.size(); ++k) values[i] += polynomial[k] * std::pow(u, k);
  }
  return collocation.fullPivLu().solve(values);
}

TEST(Extension, CoefficientsOnUniformKnotsOfDegreeTwo) {
  const KnotVector knots(2, {0, 1, 2, 3, 4, 5, 6, 7, 8});
  const auto first = extension_coefficients(knots, 4, 5), second = extension_coefficients(knots, 3, 5);
  const double expected_first[] = {1, -3, 3}, expected_second[] = {3, -8, 6};
  for (int k = 0; k < 3; ++k) {
    expect_near_rel(first[k], expected_first[k], 1e-14);
    expect_near_rel(second[k], expected_second[k], 1e-14);
  }
  EXPECT_EQ(extension_coefficients(knots, 4, 3), (std::vector<double>{0, 1, 0}));
}

TEST(Extension, CoefficientsContinueEveryPolynomialOfTheDegree) {
  for (int p = 1; p <= 4; ++p) {
    std::vector<double> u(p + 1, 0.0);
    for (double t : {0.7, 1.1, 1.1, 2.0, 2.3, 3.5}) u.push_back(t);
    if (p == 1) u.erase(u.begin() + 3);
    u.insert(u.end(), p + 1, 4.0);
    const KnotVector knots(p, u);
    for (int power = 0; power <= p; ++power) {
      const Eigen::VectorXd c = spline_coefficients(knots, Eigen::VectorXd::Unit(p + 1, power));
      for (int span : knots.spans())
        for (int i = 0; i < knots.control_point_count(); ++i) {
          const auto e = extension_coefficients(knots, span, i);
          double sum = 0, size = 0;
          for (int a = 0; a <= p; ++a) sum += e[a] * c[span - p + a], size += std::abs(e[a] * c[span - p + a]);
          expect_near_rel(sum, c[i], 1e-11, 1e-12 * (1 + size));
        }
    }
  }
}

// A panel of `spans` x `spans` cells whose material ends `cut` of a cell behind the third knot line, to the right and
// above.
struct CutPanel {
  ClothPanel panel;
  Extension extension;
};
CutPanel cut_panel(NurbsSurface surface, double cut, const Fabric& fabric = {}, const ExtensionOptions& options = {}) {
  const auto end = [cut](const KnotVector& k) {
    const std::vector<double> b = k.breaks();
    const std::size_t line = b.size() - 3;
    return Interval{b.front(), b[line] + cut * (b[line + 1] - b[line])};
  };
  CutPanel out{test::make_panel(surface, fabric), {}};
  out.panel.quadrature = test::tensor_quadrature(surface, {end(surface.u()), end(surface.v())});
  std::vector<ClothPanel> panels{out.panel};
  const ShellModel model(std::move(panels));
  out.extension = extend(surface, out.panel.quadrature, model.lumped_mass(), options);
  out.panel.rest = out.extension.rest;
  return out;
}

class ExtendedPanel : public ::testing::TestWithParam<std::tuple<int, bool, double>> {
 protected:
  CutPanel make() const {
    const auto [degree, rational, cut] = GetParam();
    return cut_panel(test::bumpy_surface(degree, 9, 8, rational), cut, {}, {.largest_deviation = 10});
  }
};
INSTANTIATE_TEST_SUITE_P(Cuts, ExtendedPanel,
                         ::testing::Combine(::testing::Values(2, 3), ::testing::Bool(),
                                            ::testing::Values(1e-9, 1e-3, 0.3)));

TEST_P(ExtendedPanel, RowsSumToOneAndReferToIndependentControlPoints) {
  const CutPanel c = make();
  const auto& t = c.extension.dependence;
  EXPECT_GT(c.extension.extended.size(), 0u);
  const Eigen::VectorXd sums = t * Eigen::VectorXd::Ones(t.cols());
  for (int i = 0; i < t.rows(); ++i) expect_near_rel(sums[i], 1, 1e-12);
  for (int i = 0; i < t.rows(); ++i)
    for (AffineMap::Matrix::InnerIterator e(t, i); e; ++e) {
      if (e.value() == 0) continue;
      const int k = static_cast<int>(e.col());
      EXPECT_EQ(t.row(k).nonZeros(), 1) << i << " follows " << k;
      EXPECT_EQ(t.coeff(k, k), 1) << i << " follows " << k;
    }
  const auto bare = std::ranges::count(c.extension.carries_cloth, false);
  EXPECT_EQ(AffineMap(t, {}, nullptr).nodes(), t.rows() - bare - static_cast<int>(c.extension.extended.size()));
  for (int i : c.extension.extended) EXPECT_TRUE(c.extension.carries_cloth[i]);
}

TEST_P(ExtendedPanel, RestIsItsOwnExtension) {
  const CutPanel c = make();
  const Eigen::Matrix3Xd& net = c.extension.rest.points();
  EXPECT_LT((c.extension.dependence * net.transpose() - net.transpose()).cwiseAbs().maxCoeff(), 1e-11);
}

TEST_P(ExtendedPanel, ReducedMassesStayPositiveAndKeepTheTotal) {
  const CutPanel c = make();
  const ShellModel model({c.panel});
  const AffineMap map(c.extension.dependence, {}, nullptr);
  const Eigen::VectorXd mass = map.reduce_scalar(model.lumped_mass());
  EXPECT_GT(mass.minCoeff(), 0);
  expect_near_rel(mass.sum(), model.lumped_mass().sum(), 1e-12);
}

TEST_P(ExtendedPanel, RigidMotionCostsNoEnergy) {
  const CutPanel c = make();
  const ShellModel model({c.panel});
  const AffineMap map(c.extension.dependence, {}, nullptr);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  Eigen::VectorXd q = model.rest(), moved(q.size()), force(q.size()), reduced(3 * map.nodes());
  for (int i = 0; i < map.control_points(); ++i)
    q.segment<3>(3 * i) = turn * q.segment<3>(3 * i) + Eigen::Vector3d(0.3, 4, -1);
  map.expand(map.restrict(q), 0, moved);
  EXPECT_LT((moved - q).cwiseAbs().maxCoeff(), 1e-11);
  const ShellEnergy energy = model.internal_force(moved, force);
  map.reduce(force, reduced);
  EXPECT_LT(energy.total(), 1e-16);
  EXPECT_LT(reduced.cwiseAbs().maxCoeff(), 1e-7);
}

TEST(Extension, FlatRestStaysWhereItIs) {
  const NurbsSurface flat = test::flat_surface(1, 0.7, uniform_knots(2, 8), uniform_knots(3, 6));
  const CutPanel c = cut_panel(flat, 0.01);
  EXPECT_GT(c.extension.extended.size(), 0u);
  EXPECT_TRUE(c.extension.kept.empty());
  EXPECT_LT((c.extension.rest.points() - flat.points()).cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_LT(c.extension.deviation, 1e-13);
}

// Cut on the left and below, so that the last cells are whole and move nowhere.
TEST_P(ExtendedPanel, DeviationIsTheLargestMoveWithinTheMaterial) {
  const auto [degree, rational, cut] = GetParam();
  const NurbsSurface before = test::bumpy_surface(degree, 9, 8, rational);
  const auto begin = [cut = cut](const KnotVector& k) {
    const std::vector<double> b = k.breaks();
    return Interval{b[2] - cut * (b[2] - b[1]), b.back()};
  };
  ClothPanel panel = test::make_panel(before);
  panel.quadrature = test::tensor_quadrature(before, {begin(before.u()), begin(before.v())});
  const Extension extension =
      extend(before, panel.quadrature, ShellModel({panel}).lumped_mass(), {.largest_deviation = 10});
  double largest = 0;
  for (const Eigen::Vector2d& uv : panel.quadrature.points)
    largest = std::max(largest, (extension.rest(uv.x(), uv.y()) - before(uv.x(), uv.y())).norm());
  expect_near_rel(extension.deviation, largest, 1e-9, 1e-14);
}

TEST(Extension, KeepsFunctionsWhoseExtensionWouldMoveTheRestSurface) {
  const NurbsSurface surface = test::bumpy_surface(2, 9, 8, false);
  const CutPanel loose = cut_panel(surface, 0.3, {}, {.largest_deviation = 10});
  ASSERT_GT(loose.extension.deviation, 1e-6);
  const CutPanel tight = cut_panel(surface, 0.3, {}, {.largest_deviation = 1e-9});
  EXPECT_LT(tight.extension.deviation, 1e-9);
  EXPECT_GT(tight.extension.kept.size(), loose.extension.kept.size());
}

TEST(Extension, ControlPointsWithoutClothStayNearARolledUpCloth) {
  // The cloth is half of the parameter rectangle; rolled to a tube, the untrimmed rest of the surface must not explode.
  const NurbsSurface flat = test::flat_surface(2, 1, uniform_knots(2, 40), uniform_knots(2, 20));
  CutPanel c{test::make_panel(flat), {}};
  c.panel.quadrature = test::tensor_quadrature(flat, {Interval{0, 0.5}, Interval{0.2, 0.83}});
  c.extension = extend(flat, c.panel.quadrature, ShellModel({c.panel}).lumped_mass());
  const AffineMap map(c.extension.dependence, {}, nullptr);
  Eigen::VectorXd q(3 * map.control_points()), rolled(q.size());
  for (int i = 0; i < map.control_points(); ++i) {
    const Eigen::Vector3d x = flat.points().col(i);
    q.segment<3>(3 * i) = Eigen::Vector3d(0.15 * std::sin(x[0] / 0.15), x[1], 0.15 * (1 - std::cos(x[0] / 0.15)));
  }
  map.expand(map.restrict(q), 0, rolled);
  EXPECT_LT(rolled.cwiseAbs().maxCoeff(), 2.5);
  EXPECT_GT((rolled - q).cwiseAbs().maxCoeff(), 0.1);  // they do follow the tangent plane, not the tube
}

// What counts is how far the surface moves where there is cloth, not how far a control point does.
TEST(Extension, FunctionsThatHardlyReachTheClothAreExtendedHoweverFarTheirControlPointsMove) {
  const NurbsSurface surface = test::bumpy_surface(2, 9, 8, false);
  const CutPanel c = cut_panel(surface, 1e-9);
  double moved = 0;
  for (const int k : c.extension.extended)
    moved = std::max(moved, (c.extension.rest.points().col(k) - surface.points().col(k)).norm());
  EXPECT_GT(moved, 1e-3);  // of cells 1 / 9 wide
  // The material ends 1e-9 of a cell behind u line 7 and v line 6, where functions 9 and 8 begin.
  for (const int k : c.extension.kept) {
    EXPECT_LT(k % surface.count_u(), 9);
    EXPECT_LT(k / surface.count_u(), 8);
  }
}

TEST(Extension, SlenderPartsFarFromAnyGoodCellKeepTheirFunctions) {
  const NurbsSurface flat = test::flat_surface(1, 1, uniform_knots(2, 12), uniform_knots(2, 12));
  for (const bool along_v : {false, true}) {
    SCOPED_TRACE(along_v);
    CutPanel c{test::make_panel(flat), {}};
    // A block with a strap of a tenth of a cell along u, or along v.
    const auto part = [&](const Interval& along, const Interval& across) {
      return test::tensor_quadrature(flat, along_v ? std::array{across, along} : std::array{along, across});
    };
    CutQuadrature block = part({0, 0.34}, {0, 1});
    const CutQuadrature strap = part({0.34, 1}, {0.5, 0.5 + 0.1 / 12});
    for (CellRule cell : strap.cells) {
      cell.first += static_cast<int>(block.points.size());
      block.cells.push_back(cell);
    }
    block.points.insert(block.points.end(), strap.points.begin(), strap.points.end());
    block.weights.insert(block.weights.end(), strap.weights.begin(), strap.weights.end());
    c.panel.quadrature = block;
    c.extension = extend(flat, block, ShellModel({c.panel}).lumped_mass());
    EXPECT_GT(c.extension.kept.size(), 5u);
    double largest = 0;
    for (int k = 0; k < c.extension.dependence.outerSize(); ++k)
      for (AffineMap::Matrix::InnerIterator e(c.extension.dependence, k); e; ++e)
        largest = std::max(largest, std::abs(e.value()));
    EXPECT_LT(largest, 65);  // (3, -8, 6) twice
  }
}

TEST(Extension, MassFloorRaisesOnlyLightNodes) {
  const NurbsSurface flat = test::flat_surface(1, 1, uniform_knots(2, 8), uniform_knots(2, 8));
  const AffineMap map(AffineMap::identity(100), {0}, [](std::size_t, double) { return Eigen::Vector3d(0, 0, 0); });
  const Eigen::VectorXd floor = mass_floor(flat, 0.2);
  Eigen::VectorXd mass = Eigen::VectorXd::Constant(100, 1.0);
  mass[55] = 1e-9;
  const Eigen::VectorXd floored = floored_node_mass(map, mass, floor);
  EXPECT_EQ(floored.size(), 99);
  expect_near_rel(floored[54], 0.01 * 0.2 / 64, 1e-12);
  EXPECT_EQ(floored[53], 1.0);
}

TEST(Extension, MassFloorIsAShareOfAnElementsMass) {
  const NurbsSurface flat = test::flat_surface(1, 0.5, uniform_knots(2, 8), uniform_knots(3, 4));
  const Eigen::VectorXd floor = mass_floor(flat, 0.2);
  for (const double mass : floor) expect_near_rel(mass, 0.01 * 0.2 * (1.0 / 8) * (0.5 / 4), 1e-12);
}

}  // namespace
}  // namespace toile
