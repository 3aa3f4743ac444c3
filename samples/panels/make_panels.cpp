// Drafts every panel file of the samples with the library itself: make_panels DIR writes DIR/<sample>/<panel>.igs.
// The tests compare what it writes with what is committed.
#include <Eigen/LU>
#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numbers>

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

void write(const std::filesystem::path& file, TrimmedSurface face, const std::string& name, double metres_per_unit,
           const std::string& unit) {
  face.name = name;
  face.metres_per_unit = metres_per_unit;
  IgesHeader header;
  header.product = name;
  header.unit = unit;
  header.date = "20261122.000000";
  const OutputFace output{std::move(face), name, 0, std::nullopt};
  write_file(file, format_iges(std::span(&output, 1), header).text);
}

TrimmedSurface untrimmed(NurbsSurface surface) {
  TrimmedSurface face;
  face.surface = std::move(surface);
  face.loops = {natural_loop(face.surface)};
  face.natural_bounds = true;
  return face;
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
  const Curve2 hem_curve = cubic(hem * left, hem * left + pull * Vector2d(s, -s), hem * right + pull * Vector2d(-s, -s),
                                 hem * right);
  // The waist as a rational quadratic arc, run from right to left.
  Eigen::Matrix2Xd arc(2, 3);
  arc << waist * right, Vector2d(0, -waist / s), waist * left;
  const Curve2 waist_curve(uniform_knots(2, 1), arc, {1, s, 1});
  return trimmed(flat({-600, 600}, {-820, -100}, 2, 10, 6),
                 outer_loop({hem_curve, seam(right, out, true), waist_curve, seam(left, out_left, false)}));
}

// The 1 m square of example 4.1 as a trim in a larger surface whose net is turned; e_u, e_v are the net's axes. Curves 0
// to 3 run from corner (0, 0) counter-clockwise.
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
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
