// SPDX-License-Identifier: GPL-3.0-or-later
#include <Eigen/Geometry>
#include <cmath>

#include "analysis/parallel/workers.h"
#include "analysis/shell/shell_model.h"
#include "support/near.h"
#include "support/panels.h"

namespace toile {
namespace {

using test::Random;

Fabric stiff_fabric(double twist = 0) {
  Fabric fabric;
  fabric.membrane = {11.7, 25.0, 4.68};
  fabric.bending = {.b0 = 0.05, .kappa0 = 3, .kappa_reg = 0.5, .twist = twist};
  return fabric;
}

struct Case {
  const char* name;
  int degree;
  bool rational;
  double grain, twist;
};
std::ostream& operator<<(std::ostream& out, const Case& c) {
  return out << c.name;
}

class ShellLaws : public ::testing::TestWithParam<Case> {
 protected:
  ShellModel model() const {
    const Case& c = GetParam();
    return ShellModel(
        {test::make_panel(test::bumpy_surface(c.degree, 3, 2, c.rational), stiff_fabric(c.twist), c.grain)});
  }
  // Away from rest by strains of 0.1 and curvatures on both branches of the law.
  static Eigen::VectorXd deformed(const ShellModel& model, std::uint64_t seed = 7) {
    return model.rest() + 0.03 * Random(seed).vector(model.rest().size());
  }
  // To less than half of its length, where the guard of the area holds.
  static Eigen::VectorXd squeezed(const ShellModel& model) {
    Eigen::VectorXd q = deformed(model);
    for (Eigen::Index k = 0; k < q.size(); k += 3) q[k] *= 0.4;
    return q;
  }
};

TEST_P(ShellLaws, ForceIsMinusTheGradientOfTheEnergy) {
  const ShellModel m = model();
  for (const Eigen::VectorXd& q : {deformed(m), squeezed(m)}) {
    Eigen::VectorXd force(q.size()), ignored(q.size());
    m.internal_force(q, force);
    const double h = 1e-6;
    for (int k = 0; k < q.size(); ++k) {
      Eigen::VectorXd plus = q, minus = q;
      plus[k] += h;
      minus[k] -= h;
      const double slope =
          (m.internal_force(plus, ignored).total() - m.internal_force(minus, ignored).total()) / (2 * h);
      ASSERT_TRUE(test::near_rel(force[k], -slope, 1e-6, 1e-7 * force.cwiseAbs().maxCoeff())) << "dof " << k;
    }
  }
}

TEST_P(ShellLaws, ExactTangentIsMinusTheDerivativeOfTheForce) {
  const ShellModel m = model();
  for (const Eigen::VectorXd& q : {deformed(m), squeezed(m)}) {
    const Eigen::VectorXd dq = Random(3).vector(q.size());
    Eigen::VectorXd df(q.size()), plus(q.size()), minus(q.size());
    m.apply_tangent(q, dq, df, TangentKind::exact);
    const double h = 1e-6;
    m.internal_force(q + h * dq, plus);
    m.internal_force(q - h * dq, minus);
    const Eigen::VectorXd expected = (minus - plus) / (2 * h);
    EXPECT_LT((df - expected).norm(), 1e-6 * expected.norm());
  }
}

TEST_P(ShellLaws, UpperTangentIsSymmetricAndNeverBelowTheExactOne) {
  const ShellModel m = model();
  const Eigen::VectorXd shrunk = 0.97 * deformed(m), small = squeezed(m);
  Eigen::VectorXd exact(shrunk.size()), upper(shrunk.size()), other(shrunk.size());
  Random random(11);
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::VectorXd& q = trial % 2 == 0 ? shrunk : small;
    const Eigen::VectorXd a = random.vector(q.size()), b = random.vector(q.size());
    m.apply_tangent(q, a, exact, TangentKind::exact);
    m.apply_tangent(q, a, upper);
    m.apply_tangent(q, b, other);
    EXPECT_GE(a.dot(upper), a.dot(exact) - 1e-12 * std::abs(a.dot(upper)));
    expect_near_rel(b.dot(upper), a.dot(other), 1e-10, 1e-12 * a.norm() * other.norm());
  }
}

TEST_P(ShellLaws, RigidMotionLeavesTheEnergyAndTurnsTheForce) {
  const ShellModel m = model();
  const Eigen::VectorXd q = deformed(m);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  Eigen::VectorXd force(q.size()), turned_force(q.size());
  const Eigen::VectorXd moved =
      ((turn * q.reshaped(3, q.size() / 3)).colwise() + Eigen::Vector3d(0.3, -4, 2)).reshaped();
  const ShellEnergy energy = m.internal_force(q, force), after = m.internal_force(moved, turned_force);
  expect_near_rel(after.membrane, energy.membrane, 1e-12);
  expect_near_rel(after.bending, energy.bending, 1e-11);
  const Eigen::VectorXd expected = (turn * force.reshaped(3, q.size() / 3)).reshaped();
  EXPECT_LT((turned_force - expected).norm(), 1e-11 * force.norm());
}

TEST_P(ShellLaws, InternalForcesHaveNoResultantAndNoTorque) {
  const ShellModel m = model();
  const Eigen::VectorXd q = deformed(m);
  Eigen::VectorXd force(q.size());
  m.internal_force(q, force);
  Eigen::Vector3d resultant = Eigen::Vector3d::Zero(), torque = Eigen::Vector3d::Zero();
  for (int k = 0; k < m.point_count(); ++k) {
    const Eigen::Vector3d f = force.segment<3>(3 * k), x = q.segment<3>(3 * k);
    resultant += f;
    torque += x.cross(f);
  }
  EXPECT_LT(resultant.norm(), 1e-12 * force.norm());
  EXPECT_LT(torque.norm(), 1e-12 * force.norm());
}

TEST_P(ShellLaws, RestHasNoEnergyAndNoForce) {
  const ShellModel m = model();
  Eigen::VectorXd force(m.rest().size()), scale(m.rest().size());
  const ShellEnergy energy = m.internal_force(m.rest(), force);
  m.internal_force(deformed(m), scale);
  EXPECT_LT(std::abs(energy.total()), 1e-20);
  EXPECT_LT(force.norm(), 1e-12 * scale.norm());
}

TEST_P(ShellLaws, StateAgreesWithMaterialPoint) {
  const ShellModel m = model();
  const Eigen::VectorXd q = deformed(m);
  const MaterialPoint p = m.material_point(0, 0.37, 0.21);
  const MaterialState state = m.state(0, 0.37, 0.21, q);
  std::array<Eigen::Vector3d, 6> x;
  for (int r = 0; r < 6; ++r) {
    x[r].setZero();
    for (std::size_t k = 0; k < p.index.size(); ++k) x[r] += p.value[r][k] * q.segment<3>(3 * p.index[k]);
  }
  EXPECT_LT((state.position - x[0]).norm(), 1e-14);
  expect_near_rel(state.strain[0], 0.5 * (x[1].squaredNorm() - 1), 1e-12);
  expect_near_rel(state.strain[2], x[1].dot(x[2]), 1e-12);
  expect_near_rel(state.nominal[1], x[2].norm() * 25.0 * state.strain[1], 1e-12);
  // The tangents at rest are orthonormal: weft and warp.
  const MaterialState rest = m.state(0, 0.37, 0.21, m.rest());
  EXPECT_LT(rest.strain.norm(), 1e-13);
  EXPECT_LT(rest.curvature.norm(), 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Panels, ShellLaws,
                         ::testing::Values(Case{"p2", 2, false, 0, 0}, Case{"p2_rational_grain", 2, true, 0.4, 0},
                                           Case{"p3_twist", 3, false, 0, 0.02},
                                           Case{"p3_rational_grain_twist", 3, true, -1.1, 0.02},
                                           Case{"p4", 4, true, 0.2, 0}),
                         [](const auto& c) { return c.param.name; });

TEST(ShellModel, LumpedMassIsTheMassOfTheCloth) {
  const ShellModel model({test::make_flat_panel(0.7, 1.3, 2, 5, 4)});
  const Fabric fabric;
  expect_near_rel(model.lumped_mass().sum(), fabric.density * 0.7 * 1.3, 1e-13);
  expect_near_rel(model.lumped_drag().sum(), fabric.drag * 0.7 * 1.3, 1e-13);
  EXPECT_GT(model.lumped_mass().minCoeff(), 0);
}

TEST(ShellModel, HomogeneousDeformationGivesOneStressAndNoInteriorForce) {
  for (const int degree : {2, 3})
    for (const double grain : {0.0, 0.5}) {
      const ShellModel model({test::make_flat_panel(1, 0.8, degree, 5, 4, stiff_fabric(), grain)});
      Eigen::Matrix3d F = Eigen::Matrix3d::Identity();
      F.col(0) << 1.1, 0.05, 0.2;
      F.col(1) << -0.1, 0.9, 0.1;
      const int n = model.point_count();
      const Eigen::VectorXd q = (F * model.rest().reshaped(3, n)).reshaped();
      const Eigen::Vector3d weft = F * Eigen::Vector3d(std::cos(grain), std::sin(grain), 0);
      const Eigen::Vector3d warp = F * Eigen::Vector3d(-std::sin(grain), std::cos(grain), 0);
      for (const double u : {0.0, 0.31, 1.0})
        for (const double v : {0.0, 0.77, 1.0}) {
          const MaterialState state = model.state(0, u, v, q);
          expect_near_rel(state.second_pk[0], 11.7 * 0.5 * (weft.squaredNorm() - 1), 1e-11);
          expect_near_rel(state.second_pk[1], 25.0 * 0.5 * (warp.squaredNorm() - 1), 1e-11);
          expect_near_rel(state.second_pk[2], 4.68 * weft.dot(warp), 1e-11);
          EXPECT_LT(state.curvature.norm(), 1e-11);
        }
      Eigen::VectorXd force(3 * n);
      const ShellEnergy energy = model.internal_force(q, force);
      const Eigen::Vector3d S = model.state(0, 0.5, 0.5, q).second_pk, E = model.state(0, 0.5, 0.5, q).strain;
      expect_near_rel(energy.membrane, 0.5 * S.dot(E) * 0.8, 1e-12);
      EXPECT_LT(energy.bending, 1e-18);
      const NurbsSurface& surface = model.panels()[0].rest;
      for (int j = 1; j + 1 < surface.count_v(); ++j)
        for (int i = 1; i + 1 < surface.count_u(); ++i)
          EXPECT_LT(force.segment<3>(3 * surface.index(i, j)).norm(), 1e-13 * force.norm());
    }
}

TEST(ShellModel, RationalCylinderHasTheCurvatureOfItsRadius) {
  Fabric fabric = stiff_fabric(0.02);
  fabric.rest_curvature = RestCurvature::zero;
  const double radius = 0.25;
  const NurbsSurface cylinder = test::cylinder_surface(radius, 2.0, 0.6, 4, 2);
  for (const double grain : {0.0, 0.6}) {
    const ShellModel model({test::make_panel(cylinder, fabric, grain)});
    const double c = std::cos(grain), s = std::sin(grain);
    for (const double u : {0.0, 0.13, 0.5, 0.99}) {
      const MaterialState state = model.state(0, u, 0.4, model.rest());
      expect_near_rel(state.curvature[0], c * c / radius, 1e-11);
      expect_near_rel(state.curvature[1], s * s / radius, 1e-11, 1e-11);
      expect_near_rel(state.curvature[2], -c * s / radius, 1e-11, 1e-11);
      EXPECT_LT(state.strain.norm(), 1e-13);
    }
    Eigen::VectorXd force(model.rest().size());
    const double density = bending_response(fabric.bending, c * c / radius).energy +
                           bending_response(fabric.bending, s * s / radius).energy +
                           fabric.bending.twist * std::pow(c * s / radius, 2);
    // The rational area element isn't polynomial: the rule integrates it to its own order.
    expect_near_rel(model.internal_force(model.rest(), force).bending, density * radius * 2.0 * 0.6, 1e-6);
  }
}

TEST(ShellModel, CurvatureTurnsWithTheGrainAsATensor) {
  Fabric fabric = stiff_fabric();
  fabric.rest_curvature = RestCurvature::zero;
  const NurbsSurface surface = test::bumpy_surface(3, 3, 2, true);
  const auto tensor = [&](double grain) {
    const ShellModel model({test::make_panel(surface, fabric, grain)});
    const Eigen::Vector3d k = model.state(0, 0.3, 0.2, model.rest()).curvature;
    return Eigen::Matrix2d{{k[0], k[2]}, {k[2], k[1]}};
  };
  const Eigen::Matrix2d straight = tensor(0);
  EXPECT_GT(std::abs(straight(0, 1)), 0.01 * straight.norm());
  for (const double grain : {0.3, 1.0, -2.0}) {
    const Eigen::Matrix2d turn = Eigen::Rotation2Dd(grain).toRotationMatrix();
    EXPECT_LT((tensor(grain) - turn.transpose() * straight * turn).norm(), 1e-12 * straight.norm());
  }
}

// The classical shell has no grain, only while stretch, shear, bending, twist and both couplings belong together.
TEST(ShellModel, AnIsotropicFabricDoesNotKnowItsGrain) {
  Fabric fabric = isotropic(300, 0.3, 0.02);
  const NurbsSurface surface = test::bumpy_surface(3, 3, 2, false);
  const auto energies = [&](double grain) {
    const ShellModel model({test::make_panel(surface, fabric, grain)});
    const Eigen::VectorXd q = model.rest() + 0.02 * test::Random(5).vector(model.rest().size());
    Eigen::VectorXd force(q.size());
    const auto elastic = model.internal_force(q, force);
    return std::array{elastic.membrane, elastic.bending, force.norm()};
  };
  const auto straight = energies(0);
  EXPECT_GT(straight[0], 0);
  EXPECT_GT(straight[1], 0);
  for (const double grain : {0.3, 1.0})
    for (int k = 0; k < 3; ++k) expect_near_rel(energies(grain)[k], straight[k], 1e-9);
  fabric.bending.coupling = 0;
  EXPECT_GT(std::abs(energies(0.3)[1] / energies(0)[1] - 1), 1e-3);
}

TEST(ShellModel, CurvedPanelKeepsItsRestCurvatureUnlessTold) {
  Fabric fabric = stiff_fabric();
  const ShellModel own({test::make_panel(test::cylinder_surface(0.25, 2.0, 0.6, 4, 2), fabric)});
  Eigen::VectorXd force(own.rest().size());
  EXPECT_LT(own.internal_force(own.rest(), force).bending, 1e-20);
  fabric.rest_curvature = RestCurvature::zero;
  const ShellModel flat({test::make_panel(test::cylinder_surface(0.25, 2.0, 0.6, 4, 2), fabric)});
  EXPECT_GT(flat.internal_force(flat.rest(), force).bending, 1e-3);
}

// A flat strip bent to a cylinder by moving its control points as a least-squares spline of the circle would: curvature
// errors fall with the order p - 1 of second derivatives at least.
TEST(ShellModel, BentStripFindsTheCurvatureOfTheCylinder) {
  const double radius = 0.3, length = 0.5;
  for (const int degree : {2, 3}) {
    std::array<double, 2> error{};
    for (int level = 0; level < 2; ++level) {
      const ShellModel model({test::make_flat_panel(length, 0.1, degree, 8 << level, 1)});
      const NurbsSurface& surface = model.panels()[0].rest;
      // Quasi-interpolation by the blossom of the Taylor polynomial of the surface's degree at the Greville abscissa.
      Eigen::VectorXd q = model.rest();
      for (int i = 0; i < surface.count_u(); ++i) {
        double spread = 0;  // sum over pairs of (knot - mean)(knot - mean), the blossom of (s - mean)^2
        const double mean = surface.u().greville(i);
        for (int a = 1; a <= degree; ++a)
          for (int b = a + 1; b <= degree; ++b) spread += (surface.u()[i + a] - mean) * (surface.u()[i + b] - mean);
        spread *= length * length / (degree * (degree - 1) / 2.0);
        const double angle = length * mean / radius;
        const Eigen::Vector2d place(radius * std::sin(angle), radius * (1 - std::cos(angle)));
        const Eigen::Vector2d bend(-std::sin(angle) / radius, std::cos(angle) / radius);
        const Eigen::Vector2d turn = Eigen::Vector2d(-std::cos(angle), -std::sin(angle)) / (radius * radius);
        double cube = degree == 3 ? length * length * length : 0;  // blossom of (s - mean)^3
        for (int a = 1; a <= degree; ++a) cube *= surface.u()[i + a] - mean;
        const Eigen::Vector2d p = place + 0.5 * spread * bend + cube / 6 * turn;
        for (int j = 0; j < surface.count_v(); ++j) {
          q[3 * surface.index(i, j)] = p[0];
          q[3 * surface.index(i, j) + 2] = p[1];
        }
      }
      for (int k = 0; k < 97; ++k) {
        const double kappa = model.state(0, (k + 0.5) / 97, 0.5, q).curvature[0];
        error[level] = std::max(error[level], std::abs(kappa * radius - 1));
      }
    }
    EXPECT_LT(error[1], 0.02);
    EXPECT_GT(std::log2(error[0] / error[1]), degree == 2 ? 0.95 : 1.85) << error[0] << " " << error[1];
  }
}

TEST(ShellModel, PartsWithoutStiffnessAreAbsentAndTheOthersUnchanged) {
  const NurbsSurface surface = test::bumpy_surface(2, 3, 3, true);
  Fabric both = stiff_fabric(), membrane = both, bending = both;
  membrane.bending.b0 = 0;
  bending.membrane = {0, 0, 0};
  const ShellModel model({test::make_panel(surface, both)}), only_membrane({test::make_panel(surface, membrane)}),
      only_bending({test::make_panel(surface, bending)});
  const Eigen::VectorXd q = model.rest() + 0.03 * Random(5).vector(model.rest().size());
  Eigen::VectorXd f(q.size()), fm(q.size()), fb(q.size());
  const ShellEnergy e = model.internal_force(q, f), em = only_membrane.internal_force(q, fm),
                    eb = only_bending.internal_force(q, fb);
  EXPECT_EQ(em.bending, 0);
  EXPECT_EQ(eb.membrane, 0);
  expect_near_rel(em.membrane, e.membrane, 1e-14);
  expect_near_rel(eb.bending, e.bending, 1e-14);
  EXPECT_LT((f - fm - fb).norm(), 1e-13 * f.norm());
  EXPECT_LT(only_membrane.table_bytes(), model.table_bytes());
}

// Law (8) alone lets cloth go to nothing: pressed together, it resists less and less. The guard stands in the way, and
// nowhere else.
TEST(ShellModel, ClothResistsMoreTheFurtherItIsSqueezed) {
  const ShellModel m({test::make_flat_panel(1, 1, 2, 3, 3, stiff_fabric())});
  Eigen::VectorXd force(m.rest().size());
  const auto energy_at = [&](double length) {
    Eigen::VectorXd q = m.rest();
    for (Eigen::Index k = 0; k < q.size(); k += 3) q[k] *= length;
    return m.internal_force(q, force).total();
  };
  const auto by_law = [](double length) { return 0.5 * 11.7 * std::pow(0.5 * (length * length - 1), 2); };
  expect_near_rel(energy_at(0.6), by_law(0.6), 1e-12);
  expect_near_rel(energy_at(1.5), by_law(1.5), 1e-12);
  double last = 0;
  for (double length = 0.95; length > 0.02; length -= 0.01) {
    const double pull = (energy_at(length - 1e-5) - energy_at(length + 1e-5)) / 2e-5;
    EXPECT_GT(pull, last - 0.02) << "at " << length;
    last = std::max(last, pull);
  }
  EXPECT_GT(energy_at(1e-6), 1e5);
  expect_near_rel(m.internal_force(0.7 * m.rest(), force).least_strain, 0.5 * (0.49 - 1), 1e-12);
  expect_near_rel(m.internal_force(1.5 * m.rest(), force).largest_strain, 0.5 * (2.25 - 1), 1e-12);
}

TEST(ShellModel, PanelsDontTouchEachOther) {
  const ClothPanel a = test::make_flat_panel(1, 1, 2, 3, 3), b = test::make_panel(test::bumpy_surface(3, 2, 3, true));
  const ShellModel both({a, b}), first({a}), second({b});
  EXPECT_EQ(both.point_count(), first.point_count() + second.point_count());
  EXPECT_EQ(both.first_point(1), first.point_count());
  const Eigen::VectorXd q = both.rest() + 0.02 * Random(9).vector(both.rest().size());
  Eigen::VectorXd f(q.size()), fa(first.rest().size()), fb(second.rest().size());
  both.internal_force(q, f);
  first.internal_force(q.head(fa.size()), fa);
  second.internal_force(q.tail(fb.size()), fb);
  EXPECT_EQ(f.head(fa.size()), fa);
  EXPECT_EQ(f.tail(fb.size()), fb);
}

// Uncut polynomial cells keep 1-D tables; the same rule not declared a tensor rule keeps full ones.
TEST(ShellModel, BothKindsOfTablesGiveTheSameForceAndTangent) {
  Fabric membrane = stiff_fabric(), bending = stiff_fabric();
  membrane.bending.b0 = 0;
  bending.membrane = {0, 0, 0};
  for (const Fabric& fabric : {membrane, bending, stiff_fabric(), stiff_fabric(0.02)})
    for (const auto& [degree_u, degree_v] : {std::pair(2, 2), std::pair(3, 3), std::pair(2, 3), std::pair(5, 4)}) {
      NurbsSurface surface = test::flat_surface(1, 0.8, uniform_knots(degree_u, 4),
                                                clamped_knots(degree_v, std::vector{0.0, 0.3, 0.4, 1.0}));
      surface = surface.with_points(
          surface.points() + 0.02 * Random(3).vector(surface.points().size()).reshaped(3, surface.points().cols()));
      ClothPanel tensor = test::make_panel(surface, fabric, 0.3), full = tensor;
      for (CellRule& cell : full.quadrature.cells) cell.tensor = false;
      const ShellModel a({tensor}), b({full});
      EXPECT_LT(a.table_bytes(), b.table_bytes());
      const Eigen::VectorXd q = a.rest() + 0.03 * Random(5).vector(a.rest().size()), dq = Random(6).vector(q.size());
      Eigen::VectorXd fa(q.size()), fb(q.size());
      expect_near_rel(a.internal_force(q, fa).total(), b.internal_force(q, fb).total(), 1e-12);
      EXPECT_LT((fa - fb).norm(), 1e-12 * fb.norm());
      a.apply_tangent(q, dq, fa);
      b.apply_tangent(q, dq, fb);
      EXPECT_LT((fa - fb).norm(), 1e-12 * fb.norm());
    }
}

// Cutting the same cloth into cells with other numbers of points changes which cells share a lane group, nothing else.
TEST(ShellModel, CellsOfUnequalRulesAddUp) {
  const NurbsSurface surface = test::flat_surface(1, 1, uniform_knots(2, 5), uniform_knots(2, 5));
  ClothPanel whole = test::make_panel(surface, stiff_fabric()), left = whole, right = whole;
  left.quadrature = test::tensor_quadrature(surface, {Interval{0, 0.47}, Interval{0, 1}});
  right.quadrature = test::tensor_quadrature(surface, {Interval{0.47, 1}, Interval{0, 1}}, 5);
  ClothPanel joined = left;
  for (CellRule cell : right.quadrature.cells) {
    cell.first += static_cast<int>(left.quadrature.points.size());
    joined.quadrature.cells.push_back(cell);
  }
  auto& points = joined.quadrature.points;
  points.insert(points.end(), right.quadrature.points.begin(), right.quadrature.points.end());
  auto& weights = joined.quadrature.weights;
  weights.insert(weights.end(), right.quadrature.weights.begin(), right.quadrature.weights.end());
  const ShellModel a({left}), b({right}), c({joined});
  EXPECT_EQ(c.quadrature_points(), a.quadrature_points() + b.quadrature_points());
  const Eigen::VectorXd q = a.rest() + 0.02 * Random(4).vector(a.rest().size());
  Eigen::VectorXd fa(q.size()), fb(q.size()), fc(q.size());
  const double energy = a.internal_force(q, fa).total() + b.internal_force(q, fb).total();
  expect_near_rel(c.internal_force(q, fc).total(), energy, 1e-13);
  EXPECT_LT((fc - fa - fb).norm(), 1e-13 * fc.norm());
}

TEST(Shell, ThreadsGiveTheSameBits) {
  for (const int degree : {2, 3}) {
    for (const bool rational : {false, true}) {
      // Two panels, so that threads meet in the middle of one, and material that cuts cells.
      ClothPanel whole = test::make_panel(test::bumpy_surface(degree, 40, 30, rational), stiff_fabric(0.01));
      ClothPanel cut = test::make_panel(test::bumpy_surface(degree, 20, 17, false), stiff_fabric());
      cut.quadrature = test::tensor_quadrature(cut.rest, {Interval{-0.7, 1.63}, Interval{0.03, 0.41}});
      ShellModel model({whole, cut});
      const Eigen::Index n = model.rest().size();
      const Eigen::VectorXd q = model.rest() + 0.01 * Random(5).vector(n), dq = Random(6).vector(n);
      Eigen::VectorXd force(n), image(n), same(n);
      const ShellEnergy energy = model.internal_force(q, force);
      model.apply_tangent(q, dq, image);
      for (const int threads : {2, 3, 7, 1}) {
        Workers workers(threads);
        for (int repeat = 0; repeat < 3; ++repeat) {
          const ShellEnergy again = model.internal_force(q, same, &workers);
          EXPECT_EQ(same, force) << threads << " threads, degree " << degree;
          EXPECT_EQ(again.membrane, energy.membrane);
          EXPECT_EQ(again.bending, energy.bending);
          model.apply_tangent(q, dq, same, TangentKind::upper, &workers);
          EXPECT_EQ(same, image) << threads << " threads, degree " << degree;
        }
      }
    }
  }
}

}  // namespace
}  // namespace toile
