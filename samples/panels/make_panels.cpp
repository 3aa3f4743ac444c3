// SPDX-License-Identifier: GPL-3.0-or-later
// Drafts every panel file of the samples with the library itself: make_panels DIR writes DIR/<sample>/<panel>.igs.
// The tests compare what it writes with what is committed.
#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numbers>
#include <random>

#include "geometry/error.h"
#include "geometry/refine.h"
#include "geometry/trimmed_surface.h"
#include "io/file.h"
#include "io/iges.h"

namespace {

using namespace toile;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double mm = 1e-3;

// A flat B-spline rectangle: (u, v) in `u` x `v` at origin + u e_u + v e_v, drawn in the plane z = 0.
NurbsSurface flat(Interval u, Interval v, int degree, int spans_u, int spans_v, Vector2d origin = {0, 0},
                  Vector2d e_u = {1, 0}, Vector2d e_v = {0, 1}) {
  const AffinePatch patch{{origin.x(), origin.y(), 0}, {e_u.x(), e_u.y(), 0}, {e_v.x(), e_v.y(), 0}};
  return rebuild(patch, uniform_knots(degree, spans_u, u), uniform_knots(degree, spans_v, v));
}

TrimLoop outer_loop(std::vector<Curve2> curves) {
  TrimLoop loop;
  for (Curve2& curve : curves) {
    TrimCurve segment;
    segment.curve = std::move(curve);
    segment.index = static_cast<int>(loop.curves.size());
    loop.curves.push_back(std::move(segment));
  }
  return loop;
}

TrimLoop polygon(const std::vector<Vector2d>& corners) {
  std::vector<Curve2> sides;
  for (std::size_t k = 0; k < corners.size(); ++k)
    sides.push_back(line_segment<2>(corners[k], corners[(k + 1) % corners.size()]));
  return outer_loop(std::move(sides));
}

Curve2 cubic(Vector2d a, Vector2d b, Vector2d c, Vector2d d) {
  Eigen::Matrix2Xd points(2, 4);
  points << a, b, c, d;
  return Curve2(uniform_knots(3, 1), points);
}

// Faces of one file, by their names.
void write(const std::filesystem::path& file, std::vector<TrimmedSurface> faces, double metres_per_unit,
           const std::string& unit) {
  IgesHeader header;
  header.product = faces.front().name;
  header.unit = unit;
  header.date = "20261122.000000";
  std::vector<OutputFace> output;
  for (TrimmedSurface& face : faces) {
    face.metres_per_unit = metres_per_unit;
    const std::string name = face.name;
    output.push_back({std::move(face), name, 0, std::nullopt});
  }
  write_file(file, format_iges(output, header).text);
}

void write(const std::filesystem::path& file, TrimmedSurface face, const std::string& name, double metres_per_unit,
           const std::string& unit) {
  face.name = name;
  write(file, {std::move(face)}, metres_per_unit, unit);
}

TrimmedSurface trimmed(NurbsSurface surface, TrimLoop loop) {
  TrimmedSurface face;
  face.surface = std::move(surface);
  face.loops = {std::move(loop)};
  return face;
}

// Front of a flared skirt in millimetres: a quarter of an annulus about (0, 0), waist 35 cm on a circular arc, 55 cm
// long, side seams curved over the hip. Curve 0 is the hem, 1 and 3 the side seams, 2 the waist.
TrimmedSurface skirt_panel() {
  const double waist = 350 / (std::numbers::pi / 2), hem = waist + 550;
  const double s = std::sqrt(0.5);
  const Vector2d left(-s, -s), right(s, -s);
  const Vector2d out(s, s);  // away from the panel at the right seam; mirrored at the left
  const Vector2d out_left(-s, s);
  auto seam = [&](const Vector2d& along, const Vector2d& away, bool up) {
    const Vector2d top = waist * along, bottom = hem * along;
    const Vector2d hip = (waist + 120) * along + 12 * away, thigh = (waist + 300) * along + 6 * away;
    return up ? cubic(bottom, thigh, hip, top) : cubic(top, hip, thigh, bottom);
  };
  // The hem as one cubic that meets the seams' ends and the circle's lowest point.
  const double pull = hem * 4.0 / 3.0 * std::tan(std::numbers::pi / 8);
  const Curve2 hem_curve =
      cubic(hem * left, hem * left + pull * Vector2d(s, -s), hem * right + pull * Vector2d(-s, -s), hem * right);
  // The waist as a rational quadratic arc, run from right to left.
  Eigen::Matrix2Xd arc(2, 3);
  arc << waist * right, Vector2d(0, -waist / s), waist * left;
  const Curve2 waist_curve(uniform_knots(2, 1), arc, {1, s, 1});
  return trimmed(flat({-600, 600}, {-820, -100}, 2, 10, 6),
                 outer_loop({hem_curve, seam(right, out, true), waist_curve, seam(left, out_left, false)}));
}

// The 1 m square of example 4.1 as a trim in a larger surface whose net is turned; e_u, e_v are the net's axes. Curves
// 0 to 3 run from corner (0, 0) counter-clockwise.
TrimmedSurface square_in(int spans, double size, Vector2d e_u, Vector2d e_v) {
  const Vector2d centre(0.5, 0.5);
  const Vector2d origin = centre - 0.5 * size * (e_u + e_v);
  Eigen::Matrix2d axes;
  axes << e_u, e_v;
  std::vector<Vector2d> corners;
  for (const Vector2d& corner : {Vector2d(0, 0), Vector2d(1, 0), Vector2d(1, 1), Vector2d(0, 1)})
    corners.push_back(axes.inverse() * (corner - origin));
  return trimmed(flat({0, size}, {0, size}, 2, spans, spans, origin, e_u, e_v), polygon(corners));
}

// The fitted square with an inner net that is skewed: the border is kept, the inside sheared by up to `shear`.
TrimmedSurface skewed_square(int spans, double shear) {
  const NurbsSurface straight = flat({0, 1}, {0, 1}, 2, spans, spans);
  Eigen::Matrix3Xd points = straight.points();
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    const double x = points(0, k), y = points(1, k);
    const double bump = 16 * x * (1 - x) * y * (1 - y);
    points(0, k) += shear * bump * (y - 0.5);
    points(1, k) += shear * bump * (x - 0.5);
  }
  return untrimmed(straight.with_points(points));
}

// A disc as four arcs between the corners (+-a, +-a), each turning by 60 degrees, so that they meet at 150: a round
// disc has no regular map from a square. As curves from corner (-a, -a) counter-clockwise, in a square of `size`...
constexpr double disc_corner = 0.21, disc_turn = std::numbers::pi / 3;

TrimmedSurface trimmed_disc(double size) {
  const double a = disc_corner, apex = a * (1 + std::tan(disc_turn / 2));
  const std::vector<Vector2d> corners{{-a, -a}, {a, -a}, {a, a}, {-a, a}};
  const std::vector<Vector2d> apices{{0, -apex}, {apex, 0}, {0, apex}, {-apex, 0}};
  std::vector<Curve2> arcs;
  for (std::size_t k = 0; k < 4; ++k) {
    Eigen::Matrix2Xd points(2, 3);
    points << corners[k], apices[k], corners[(k + 1) % 4];
    arcs.emplace_back(uniform_knots(2, 1), points, std::vector<double>{1, std::cos(disc_turn / 2), 1});
  }
  const Interval side{-0.5 * size, 0.5 * size};
  return trimmed(flat(side, side, 2, 1, 1), outer_loop(std::move(arcs)));
}

// ... and as one rational biquadratic patch on [-1, 1]^2 whose edges are the arcs.
TrimmedSurface fitted_disc() {
  const double a = disc_corner, apex = a * (1 + std::tan(disc_turn / 2));
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, 9);
  std::vector<double> weights(9, 1);
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) {
      const Vector2d at(i - 1, j - 1);
      const bool corner = at.squaredNorm() > 1, middle = at.isZero(0);
      points.col(i + 3 * j).head<2>() = (corner ? a : apex) * at;
      if (!corner && !middle) weights[static_cast<std::size_t>(i + 3 * j)] = std::cos(disc_turn / 2);
    }
  }
  const KnotVector knots = uniform_knots(2, 1, {-1, 1});
  return untrimmed(NurbsSurface(knots, knots, points, weights));
}

// A round disc about (0, 0), four quarters of its circle, in a square net of 24 x 24 spans; and where a run may begin:
// heights outside `calm` raised or lowered by chance, up to `height` each.
TrimmedSurface round_disc(double radius) {
  std::vector<Curve2> arcs;
  const Vector2d turn[] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
  for (int k = 0; k < 4; ++k) {
    const Vector2d from = radius * turn[k], to = radius * turn[(k + 1) % 4];
    Eigen::Matrix2Xd points(2, 3);
    points << from, from + to, to;
    arcs.emplace_back(uniform_knots(2, 1), points, std::vector<double>{1, std::sqrt(0.5), 1});
  }
  const Interval side{-1.06 * radius, 1.06 * radius};
  return trimmed(flat(side, side, 2, 24, 24), outer_loop(std::move(arcs)));
}

TrimmedSurface shaken(const TrimmedSurface& disc, double calm, double height, unsigned seed) {
  std::mt19937 chance(seed);
  TrimmedSurface start = disc;
  Eigen::Matrix3Xd points = disc.surface.points();
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    const double share = 2 * static_cast<double>(chance()) / std::mt19937::max() - 1;
    if (points.col(k).norm() > calm) points(2, k) += share * height;
  }
  start.surface = disc.surface.with_points(points);
  start.name = "start " + std::to_string(seed);
  return start;
}

// The unit square with 8 x 8 elements of which the material fills the first four and `fraction` of the fifth, in u only
// or in both directions.
TrimmedSurface cut_square(double fraction, bool both) {
  const double end = 0.5 + fraction / 8, top = both ? end : 1;
  return trimmed(flat({0, 1}, {0, 1}, 2, 8, 8), polygon({{0, 0}, {end, 0}, {end, top}, {0, top}}));
}

// The unit square with one inner control point of weight `weight`.
TrimmedSurface weighted_square(double weight) {
  const NurbsSurface plain = flat({0, 1}, {0, 1}, 2, 8, 8);
  std::vector<double> weights(static_cast<std::size_t>(plain.count_u() * plain.count_v()), 1);
  weights[static_cast<std::size_t>(plain.index(5, 5))] = weight;
  return untrimmed(NurbsSurface(plain.u(), plain.v(), plain.points(), weights));
}

// The unit square with elements from 0.25e-6 to 0.25 in both directions.
TrimmedSurface uneven_square() {
  const KnotVector knots(2, {0, 0, 0, 0.25, 0.5, 0.5 + 0.25e-6, 0.75, 1, 1, 1});
  return untrimmed(rebuild({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, knots, knots));
}

// A triangle: the unit square with its edge v = 1 drawn together.
TrimmedSurface collapsed_square() {
  const NurbsSurface square = flat({0, 1}, {0, 1}, 2, 4, 4);
  Eigen::Matrix3Xd points = square.points();
  for (Eigen::Index k = 0; k < points.cols(); ++k) points(0, k) = 0.5 + (points(0, k) - 0.5) * (1 - points(1, k));
  return untrimmed(square.with_points(points));
}

// A unit square raised to a parabola in u, `height` in the middle.
TrimmedSurface arched_square(double height) {
  const NurbsSurface plain = flat({0, 1}, {0, 1}, 2, 1, 1);
  Eigen::Matrix3Xd points = plain.points();
  for (int j = 0; j < 3; ++j) points(2, plain.index(1, j)) = 2 * height;
  return untrimmed(plain.with_points(std::move(points)));
}

// Rational quadratic arc about the origin over [a, a + turn], turn < pi: cosines, sines and weights of its points.
struct Arc {
  Eigen::Vector3d x, y, weight;
};
Arc arc(double a, double turn) {
  const double w = std::cos(turn / 2);
  return {{std::cos(a), std::cos(a + turn / 2) / w, std::cos(a + turn)},
          {std::sin(a), std::sin(a + turn / 2) / w, std::sin(a + turn)},
          {1, w, 1}};
}

// Part of a cylinder about the y axis: u in [0, 1] along the arc, from angle a against the z axis on towards x; v is y.
NurbsSurface cylinder(double radius, double a, double turn, Interval y) {
  const Arc c = arc(a, turn);
  Eigen::Matrix3Xd points(3, 6);
  std::vector<double> weights;
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 3; ++i) {
      points.col(i + 3 * j) << radius * c.y[i], j == 0 ? y.min : y.max, radius * c.x[i];
      weights.push_back(c.weight[i]);
    }
  }
  return {uniform_knots(2, 1), uniform_knots(1, 1, y), points, weights};
}

// A quarter of the sphere's belt from the equator up: u is the longitude from x to y, v the latitude.
NurbsSurface sphere(double radius, double latitude) {
  const Arc around = arc(0, std::numbers::pi / 2), up = arc(0, latitude);
  Eigen::Matrix3Xd points(3, 9);
  std::vector<double> weights;
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) {
      points.col(i + 3 * j) << radius * up.x[j] * around.x[i], radius * up.x[j] * around.y[i], radius * up.y[j];
      weights.push_back(around.weight[i] * up.weight[j]);
    }
  }
  return {uniform_knots(2, 1), uniform_knots(2, 1), points, weights};
}

// The whole roof, 80 degrees and 50 long, as a trim in 100 degrees and 60. Curves 0 and 2 are the arcs at its ends.
TrimmedSurface trimmed_roof() {
  constexpr double degree = std::numbers::pi / 180, turn = 100 * degree, cut = 10 * degree;
  const double a = std::sin(cut / 2), b = std::sin((turn - cut) / 2), u = a / (a + b);
  return trimmed(cylinder(25, -turn / 2, turn, {-30, 30}), polygon({{u, -25}, {1 - u, -25}, {1 - u, 25}, {u, 25}}));
}

void write_shell_panels(const std::filesystem::path& out) {
  constexpr double degree = std::numbers::pi / 180;
  write(out / "roof.igs", untrimmed(cylinder(25, 0, 40 * degree, {0, 25})), "shell", 1, "M");
  write(out / "trimmed_roof.igs", trimmed_roof(), "shell", 1, "M");
  write(out / "cylinder.igs", untrimmed(cylinder(300, 0, 90 * degree, {0, 300})), "shell", 1, "M");
  write(out / "hemisphere.igs", untrimmed(sphere(10, 72 * degree)), "shell", 1, "M");
}

void write_study_panels(const std::filesystem::path& out) {
  write(out / "studies/cantilever/strip.igs", untrimmed(flat({0, 0.2}, {0, 0.02}, 1, 1, 1)), "strip", 1, "M");
  write(out / "studies/disc/trimmed.igs", trimmed_disc(0.7), "disc", 1, "M");
  write(out / "studies/disc/fitted.igs", fitted_disc(), "disc", 1, "M");
  write(out / "studies/rules/arch.igs", arched_square(0.1), "cloth", 1, "M");
  write_shell_panels(out / "studies/shells");
  const std::filesystem::path stability = out / "stability/panels";
  for (int k = 1; k <= 4; ++k) {
    write(stability / ("aspect_1e" + std::to_string(k) + ".igs"),
          untrimmed(flat({0, 1}, {0, std::pow(10.0, -k)}, 1, 1, 1)), "cloth", 1, "M");
  }
  for (const int k : {1, 3, 6, 9, 12}) {
    const double fraction = std::pow(10.0, -k);
    write(stability / ("cut_1e-" + std::to_string(k) + ".igs"), cut_square(fraction, false), "cloth", 1, "M");
    write(stability / ("cut_both_1e-" + std::to_string(k) + ".igs"), cut_square(fraction, true), "cloth", 1, "M");
  }
  write(stability / "weight_1e-4.igs", weighted_square(1e-4), "cloth", 1, "M");
  write(stability / "weight_1e4.igs", weighted_square(1e4), "cloth", 1, "M");
  write(stability / "uneven.igs", uneven_square(), "cloth", 1, "M");
  write(stability / "collapsed.igs", collapsed_square(), "cloth", 1, "M");
  write(stability / "millimetre.igs", untrimmed(flat({0, 1}, {0, 1}, 1, 1, 1)), "cloth", mm, "MM");
  write(stability / "hundred_metres.igs", untrimmed(flat({0, 100}, {0, 100}, 1, 1, 1)), "cloth", 1, "M");
}

}  // namespace

int main(int argc, char** argv) {
  const std::filesystem::path out = argc > 1 ? argv[1] : "samples";
  try {
    write(out / "skirt_panel/skirt_panel.igs", skirt_panel(), "front", mm, "MM");
    write(out / "kidnapped_a/square.igs", untrimmed(flat({0, 1}, {0, 1}, 1, 1, 1)), "cloth", 1, "M");
    write(out / "patch_test/square.igs", untrimmed(flat({0, 1}, {0, 1}, 1, 1, 1)), "cloth", 1, "M");
    for (const int turn : {0, 15, 30, 45}) {
      const double a = turn * std::numbers::pi / 180;
      // 1/8 m elements as in the fitted 10 x 10 net; large enough to hold the turned square.
      write(out / ("grid_independence/turned_" + std::to_string(turn) + ".igs"),
            square_in(13, 1.625, {std::cos(a), std::sin(a)}, {-std::sin(a), std::cos(a)}), "cloth", 1, "M");
    }
    write(out / "grid_independence/fitted.igs", untrimmed(flat({0, 1}, {0, 1}, 2, 8, 8)), "cloth", 1, "M");
    write(out / "grid_independence/skewed.igs", skewed_square(8, 0.25), "cloth", 1, "M");
    write(out / "grid_independence/parallelogram.igs",
          square_in(14, 1.75, {1, 0}, {std::sin(std::numbers::pi / 12), std::cos(std::numbers::pi / 12)}), "cloth", 1,
          "M");
    TrimmedSurface disc = round_disc(150);
    disc.name = "disc";
    write(out / "cusick/disc.igs", {disc, shaken(disc, 110, 1, 1), shaken(disc, 110, 1, 2), shaken(disc, 110, 1, 3)},
          mm, "MM");
    write_study_panels(out);
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
