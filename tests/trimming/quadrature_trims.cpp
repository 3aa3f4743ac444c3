// SPDX-License-Identifier: GPL-3.0-or-later
// Quadrature over traced trims: whole panels against closed forms.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

#include "geometry/refine.h"
#include "hand_made.h"
#include "trim_cases.h"
#include "trims.h"

namespace toile::test {
namespace {

constexpr double pi = std::numbers::pi;

struct Panel {
  TrimmedSurface surface;
  TrimTopology topology;
  CutQuadrature rule;
};
Panel panel_of(TrimmedSurface surface, const QuadratureOptions& options = {}) {
  Panel panel{std::move(surface), {}, {}};
  panel.topology = trace_trims(panel.surface);
  panel.rule = quadrature(panel.surface, panel.topology, options);
  return panel;
}
const QuadratureOptions quadratic = {.degree_u = 4, .degree_v = 4, .gauss_u = 3, .gauss_v = 3};

void expect_in_cells(const Panel& panel) {
  const KnotMesh& mesh = panel.topology.mesh;
  int last = -1;
  for (const CellRule& cell : panel.rule.cells) {
    EXPECT_LT(last, mesh.cell(cell.i, cell.j));
    last = mesh.cell(cell.i, cell.j);
    for (int k = cell.first; k < cell.first + cell.count; ++k) {
      const Vector2d& p = panel.rule.points[k];
      EXPECT_TRUE(mesh.u[cell.i] <= p.x() && p.x() <= mesh.u[cell.i + 1]);
      EXPECT_TRUE(mesh.v[cell.j] <= p.y() && p.y() <= mesh.v[cell.j + 1]);
    }
  }
}

TEST(TrimQuadrature, DiscsOnGrids) {
  for (const int n : {1, 2, 5, 16})
    for (const double r : {0.45, 0.31, 0.11})
      for (const Vector2d& share : {Vector2d(0.5, 0.5), Vector2d(0.4876, 0.5123)}) {
        const Vector2d centre = n * share;
        const double radius = n * r;
        const Panel panel = panel_of(trimmed(unit_cells(n), {loop_of({round_curve(centre, radius)})}), quadratic);
        expect_lawful(panel.rule, 2, [&](double u, double v) { return (Vector2d(u, v) - centre).norm() < radius; });
        expect_in_cells(panel);
        expect_near_rel(panel.rule.area, pi * radius * radius, 1e-12);
        double total = 0;
        for (const double w : panel.rule.weights) total += w;
        expect_near_rel(total, pi * radius * radius, 1e-12);
        expect_near_rel(sum(panel.rule, [&](double u, double) { return power(u - centre.x(), 2); }),
                        pi * power(radius, 4) / 4, 1e-12);
        expect_near_rel(
            sum(panel.rule, [&](double u, double v) { return power(u - centre.x(), 4) * power(v - centre.y(), 4); }),
            pi * power(radius, 10) * 3 / 640, 1e-12);
        const PanelMeasure space = measure(panel.surface, panel.topology);
        expect_near_rel(space.area, pi * radius * radius, 1e-11);
        expect_near_rel(space.loop_lengths[0], 2 * pi * radius, 1e-11);
      }
}

// The disc passes the lines around it by eps: four caps of that height, of the exact area of a cap.
TEST(TrimQuadrature, DiscsThatJustPassKnotLines) {
  for (double eps = 1e-2; eps > 5e-13; eps /= 10) {
    const Vector2d centre(2.5, 2.5);
    const double r = 1.5 + eps;
    const Panel panel = panel_of(trimmed(unit_cells(5), {loop_of({round_curve(centre, r)})}), quadratic);
    expect_lawful(panel.rule, 2,
                  [&](double u, double v) { return (Vector2d(u, v) - centre).norm() <= r * (1 + 1e-15); });
    expect_in_cells(panel);
    expect_near_rel(panel.rule.area, pi * r * r, 1e-12);
    const double height = r - 1.5, half_angle = 2 * std::asin(std::sqrt(height / (2 * r)));
    // r^2 (a - sin a cos a), without cancellation: a - sin(2 a) / 2 by its series where a is small.
    double cap = 0, term = 2 * half_angle;
    for (int k = 1; k < 12; ++k) {
      term *= -4 * half_angle * half_angle / ((2 * k) * (2 * k + 1));
      cap -= term / 2;
    }
    int caps = 0;
    for (const CellRule& cell : panel.rule.cells)
      if ((cell.i == 0 && cell.j == 2) || (cell.i == 2 && cell.j == 0) || (cell.i == 4 && cell.j == 2) ||
          (cell.i == 2 && cell.j == 4)) {
        ++caps;
        expect_near_rel(cell.area, r * r * cap, std::max(1e-12, 2e-15 / eps));
      }
    EXPECT_EQ(caps, 4);
  }
}

TEST(TrimQuadrature, PolygonsWithHolesOnGrids) {
  const std::vector<Vector2d> outer = {{0.25, 0.125}, {5.5, 0.25}, {5.75, 4}, {3, 5.875}, {2.5, 3.25}, {0.125, 5.5}};
  const std::vector<Vector2d> hole = {{1.25, 1.5}, {1.5, 2.75}, {3.25, 2.25}};
  const Panel panel =
      panel_of(trimmed(unit_cells(6), {polygon_loop(outer), polygon_loop(hole, LoopKind::hole)}), quadratic);
  expect_in_cells(panel);
  for (int b = 0; b <= 4; ++b)
    for (int a = 0; a <= 4; ++a)
      expect_near_rel(moment(panel.rule, a, b),
                      Rational(exact_moment(outer, a, b) + exact_moment(hole, a, b)).convert_to<double>(), 1e-12);
}

// Holes that share cells, touch each other in a point off every line, and touch the outline.
TEST(TrimQuadrature, HolesThatTouchGiveTheirArea) {
  std::vector<TrimLoop> loops = {polygon_loop({{0, 0}, {4, 0}, {4, 4}, {0, 4}})};
  double area = 16;
  const auto add = [&](Vector2d centre, double r) {
    loops.push_back(backwards(loop_of({round_curve(centre, r)})));
    area -= pi * r * r;
  };
  add({1.25, 1.5}, 0.0625);
  add({1.375, 1.5}, 0.0625);   // beside the first
  add({1.3125, 1.75}, 0.125);  // in the same cell
  add({0.375, 2.5}, 0.375);    // on the outline
  add({3, 3}, 0.5);            // around a vertex
  TrimmedSurface face = trimmed(unit_cells(4), loops);
  int touches = 0;
  for (const LoopRepair& r : validate_loops(face)) touches += r.what.find("touches") != std::string::npos;
  EXPECT_EQ(touches, 2);
  const Panel panel = panel_of(face, quadratic);
  expect_lawful(panel.rule, 2, [&](double u, double v) { return contains(panel.surface, panel.topology, {u, v}); });
  expect_near_rel(panel.rule.area, area, 1e-13);
  EXPECT_EQ(std::count(panel.topology.cells.begin(), panel.topology.cells.end(), CellKind::cut), 6);
}

TEST(TrimQuadrature, TrimsOnKnotLinesCutNothing) {
  const std::vector<Vector2d> square = {{1, 1}, {4, 1}, {4, 3}, {1, 3}};
  const Panel panel = panel_of(trimmed(unit_cells(5), {polygon_loop(square)}), quadratic);
  EXPECT_EQ(panel.rule.cells.size(), 6u);
  for (const CellRule& cell : panel.rule.cells) EXPECT_TRUE(cell.tensor);
  EXPECT_EQ(panel.rule.area, 6);
}

// Reversed curves and holes turn nothing but the direction.
TEST(PanelMeasure, AFaceWithAPoleIsMeasuredAtOnce) {
  // A triangle with sides 1, 1 and sqrt(2), its edge v = 1 drawn together in one point that is no exact double.
  Eigen::Matrix3Xd points(3, 4);
  points << 0.3, 1.3, 0.3, 0.3, 0.7, 0.7, 1.7, 1.7, 0.1, 0.1, 0.1, 0.1;
  const KnotVector line = uniform_knots(1, 1);
  const NurbsSurface bilinear(line, line, points, {1, 0.7, 1.3, 0.9});
  const TrimmedSurface face = untrimmed(elevate_degree(elevate_degree(bilinear, Direction::u, 3), Direction::v, 3));
  const PanelMeasure measured = measure(face, trace_trims(face));
  EXPECT_NEAR(measured.area, 0.5, 1e-9);
  EXPECT_NEAR(measured.loop_lengths.at(0), 2 + std::sqrt(2.0), 1e-9);
}

TEST(TrimQuadrature, ReversedCurvesGiveTheSameRule) {
  const auto area = [](bool reversed) {
    TrimLoop loop = loop_of({round_curve({2.3, 2.6}, 1.7)});
    if (reversed) {
      loop.curves[0].curve = backwards(loop.curves[0].curve);
      loop.curves[0].reversed = true;
    }
    return panel_of(trimmed(unit_cells(5), {loop}), quadratic);
  };
  const Panel plain = area(false), reversed = area(true);
  ASSERT_EQ(plain.rule.cells.size(), reversed.rule.cells.size());
  for (std::size_t k = 0; k < plain.rule.cells.size(); ++k)
    expect_near_rel(reversed.rule.cells[k].area, plain.rule.cells[k].area, 1e-12);
}

// The integral of exp(u + v / 2) over a disc of radius r is 2 pi r I_1(c r) / c with c = |(1, 1/2)|: a function that no
// degree has exactly. Products of degree 2 p leave an error of order 2 p + 1 at least.
TEST(TrimQuadrature, SmoothFunctionsConvergeOnDiscs) {
  const double c = std::hypot(1, 0.5), r = 0.83;
  const double exact = 2 * pi * r * std::cyl_bessel_i(1, c * r) / c;
  for (const int p : {1, 2}) {
    double before = 0;
    for (const int n : {2, 4, 8, 16}) {
      const double h = 2.0 / n;
      const Panel panel = panel_of(trimmed(unit_cells(n), {loop_of({round_curve({1 / h, 1 / h}, r / h)})}),
                                   {.degree_u = 2 * p, .degree_v = 2 * p, .gauss_u = p + 1, .gauss_v = p + 1});
      const double integral =
          h * h * sum(panel.rule, [&](double u, double v) { return std::exp(u * h - 1 + (v * h - 1) / 2); });
      const double error = std::abs(integral / exact - 1);
      if (n == 16) {
        EXPECT_LT(error, p == 1 ? 1e-6 : 1e-11);
        EXPECT_LT(error, before * std::pow(2.0, -(2 * p + 0.5)));
      }
      if (n == 8) before = error;
    }
  }
}

// Integral of u^a v^b over the inside of loops of polynomial pieces, in exact arithmetic: Green's theorem in the power
// basis.
class ExactMoments {
 public:
  explicit ExactMoments(const std::vector<ExactLoop>& loops) {
    for (const ExactLoop& loop : loops)
      for (const ExactPiece& piece : loop) pieces_.push_back({power_basis(piece.u), power_basis(piece.v)});
  }
  double operator()(int a, int b) const {
    Rational total = 0;
    for (const auto& [u, v] : pieces_) {
      Polynomial f{1};
      for (int k = 0; k <= a; ++k) f = product(f, u);
      for (int k = 0; k < b; ++k) f = product(f, v);
      Polynomial dv;
      for (std::size_t k = 1; k < v.size(); ++k) dv.push_back(v[k] * static_cast<int>(k));
      f = product(f, dv);
      for (std::size_t k = 0; k < f.size(); ++k) total += f[k] / static_cast<int>(k + 1);
    }
    return Rational(total / (a + 1)).convert_to<double>();
  }

 private:
  using Polynomial = std::vector<Rational>;
  static Polynomial product(const Polynomial& p, const Polynomial& q) {
    Polynomial r(p.size() + q.size() - 1, 0);
    for (std::size_t i = 0; i < p.size(); ++i)
      for (std::size_t j = 0; j < q.size(); ++j) r[i + j] += p[i] * q[j];
    return r;
  }
  static Polynomial power_basis(const std::vector<double>& bernstein) {
    Polynomial c(bernstein.begin(), bernstein.end()), p;
    const int n = static_cast<int>(c.size()) - 1;
    Rational binomial = 1;
    for (int k = 0; k <= n; ++k) {
      p.push_back(binomial * c[0]);
      for (std::size_t i = 0; i + 1 < c.size(); ++i) c[i] = c[i + 1] - c[i];
      c.pop_back();
      binomial = binomial * (n - k) / (k + 1);
    }
    return p;
  }
  std::vector<std::array<Polynomial, 2>> pieces_;
};

// In the material or, where that is thinner than rounding, 4 eps of the panel beside it.
bool within_rounding(const Panel& panel, const Vector2d& x) {
  const double d = 0x1p-50 * std::max(panel.topology.mesh.u.back(), panel.topology.mesh.v.back());
  for (const double a : {0.0, d, -d})
    for (const double b : {0.0, d, -d})
      if (contains(panel.surface, panel.topology, x + Vector2d(a, b))) return true;
  return false;
}

// Curved trims of degree 1 to 5 through vertices, along lines, touching, with slivers down to an ulp of the
// coordinates: the whole panel's moments are those of exact arithmetic, every point is in the material.
TEST(TrimQuadrature, HardRandomTrimsHaveExactMoments) {
  int made = 0;
  for (std::uint64_t seed = 1; made < 60; ++seed) {
    const TrimCase given = random_trim_case(seed);
    const bool polynomial = std::all_of(given.loops.begin(), given.loops.end(), [](const ExactLoop& loop) {
      return std::all_of(loop.begin(), loop.end(),
                         [](const ExactPiece& p) { return p.w == std::vector<double>(p.w.size(), 1.0); });
    });
    if (!given.valid || !polynomial) continue;
    SCOPED_TRACE("seed " + std::to_string(seed) + ", " + given.family);
    ++made;
    TrimmedSurface face = surface_of(given);
    validate_loops(face);
    const int p = 1 + static_cast<int>(seed % 3);
    const Panel panel = panel_of(face, {.degree_u = 2 * p, .degree_v = 2 * p, .gauss_u = p + 1, .gauss_v = p + 1});
    for (std::size_t k = 0; k < panel.rule.points.size(); ++k) {
      EXPECT_GT(panel.rule.weights[k], 0);
      EXPECT_TRUE(within_rounding(panel, panel.rule.points[k])) << panel.rule.points[k].transpose();
    }
    const ExactMoments exact(given.loops);
    for (int b = 0; b <= 2 * p; ++b)
      for (int a = 0; a <= 2 * p; ++a) expect_near_rel(moment(panel.rule, a, b), exact(a, b), 1e-12);
  }
}

// Rational trims: the moments are integrated to rounding, and a smooth function's error falls by a factor with every
// degree. A disc in one cell, exp(u + v / 2) over it.
TEST(TrimQuadrature, RationalTrimsConvergeSpectrally) {
  const double c = std::hypot(1, 0.5), r = 0.9, exact = 2 * pi * r * std::cyl_bessel_i(1, c * r) / c;
  const TrimmedSurface face = trimmed(knot_plane({-1, 1}, {-1, 1}), {loop_of({round_curve({0, 0}, r)})});
  const TrimTopology topology = trace_trims(face);
  std::printf("degree  points  relative error of the integral of exp(u + v/2) over a disc in one cell\n");
  double before = 1;
  for (int d = 1; d <= 12; ++d) {
    const CutQuadrature rule = quadrature(face, topology, {.degree_u = d, .degree_v = d, .gauss_u = 1, .gauss_v = 1});
    const double error = std::abs(sum(rule, [](double u, double v) { return std::exp(u + v / 2); }) / exact - 1);
    std::printf("%6d  %6zu  %.1e\n", d, rule.points.size(), error);
    EXPECT_LE(rule.moment_residual, 1e-13);
    if (d % 2 == 0) {
      EXPECT_LT(error, std::max(before / 10, 1e-14));
      before = error;
    }
  }
  EXPECT_LT(before, 1e-13);
}

// Star-shaped closed splines of degree 1 to 4 with corners at random radii and weights: the rule is exact to
// rounding, and its points lie in the material.
TEST(TrimQuadrature, RandomSplinesObeyTheLaws) {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const auto uniform = [&](double a, double b) { return a + (b - a) * static_cast<double>(random()) / 4294967296.0; };
    const int n = 1 + static_cast<int>(random() % 6), degree = 1 + static_cast<int>(random() % 4),
              corners = degree + 3 + static_cast<int>(random() % 5);
    const Vector2d centre(n * uniform(0.4, 0.6), n * uniform(0.4, 0.6));
    Curve2::Points points(2, corners + 1);
    std::vector<double> knots(degree + 1, 0.0), weights;
    for (int k = 0; k < corners; ++k) {
      const double angle = 2 * pi * k / corners, r = 0.38 * n * uniform(0.3, 1);
      points.col(k) = centre + r * Vector2d(std::cos(angle), std::sin(angle));
    }
    points.col(corners) = points.col(0);
    for (int k = 0; k <= corners; ++k) weights.push_back(seed % 2 ? uniform(0.5, 2) : 1);
    for (int k = 1; k < corners + 1 - degree; ++k) knots.push_back(k);
    for (int k = 0; k <= degree; ++k) knots.push_back(corners + 1 - degree);
    const int p = 1 + static_cast<int>(seed % 4);
    const Panel panel =
        panel_of(trimmed(unit_cells(n), {loop_of({Curve2(KnotVector(degree, knots), points, weights)})}),
                 {.degree_u = 2 * p, .degree_v = 2 * p, .gauss_u = p + 1, .gauss_v = p + 1});
    expect_lawful(panel.rule, p, [&](double u, double v) { return contains(panel.surface, panel.topology, {u, v}); });
    expect_in_cells(panel);
    expect_near_rel(panel.rule.area, loop_area(panel.surface), 1e-11);
  }
}

}  // namespace
}  // namespace toile::test
