// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/face_triangles.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "geometry/error.h"
#include "geometry/nurbs_curve.h"
#include "geometry/nurbs_surface.h"
#include "trimming/loops.h"

namespace toile {
namespace {

using Eigen::Vector3d;

// A quarter of a cylinder of radius 1 and height 2, exact.
TrimmedSurface quarter_cylinder() {
  Eigen::Matrix3Xd net(3, 6);
  net << 1, 1, 0, 1, 1, 0,  //
      0, 1, 1, 0, 1, 1,     //
      0, 0, 0, 2, 2, 2;
  const double w = std::sqrt(0.5);
  TrimmedSurface face =
      untrimmed(NurbsSurface(KnotVector(2, {0, 0, 0, 1, 1, 1}), KnotVector(1, {0, 0, 1, 1}), net, {1, w, 1, 1, w, 1}));
  validate_loops(face);
  return face;
}

double area(const TriangleMesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vector3d a = mesh.vertices.col(t[0]), b = mesh.vertices.col(t[1]), c = mesh.vertices.col(t[2]);
    sum += 0.5 * (b - a).cross(c - a).norm();
  }
  return sum;
}

// A chord of error e spans 2 sqrt(2 e) of a unit circle: triangles that are much smaller would be a waste.
TEST(FaceTriangles, MeetTheChordErrorWithoutWaste) {
  const TrimmedSurface face = quarter_cylinder();
  for (const double error : {1e-2, 1e-3}) {
    SCOPED_TRACE(error);
    const FaceTriangles found = face_triangles(face, error);
    EXPECT_LE(found.chord_error, error);
    for (const Triangle& t : found.mesh.triangles) {
      Vector3d middle = Vector3d::Zero();
      for (int k = 0; k < 3; ++k) {
        const Vector3d a = found.mesh.vertices.col(t[k]), b = found.mesh.vertices.col(t[(k + 1) % 3]);
        EXPECT_NEAR(a.head<2>().norm(), 1, 1e-12);
        EXPECT_GE((0.5 * (a + b)).head<2>().norm(), 1 - error);
        middle += a / 3;
      }
      EXPECT_GE(middle.head<2>().norm(), 1 - error);
    }
    const double exact = std::acos(-1.0);  // pi / 2 times 2
    EXPECT_NEAR(area(found.mesh), exact, exact * error);
    const double longest = 2 * std::sqrt(2 * error);
    EXPECT_LT(static_cast<double>(found.mesh.triangles.size()), 40 * exact / (longest * longest));
  }
}

// Longest edge over height above it.
double thinness(const TriangleMesh& mesh, const Triangle& t) {
  const Vector3d a = mesh.vertices.col(t[0]), b = mesh.vertices.col(t[1]), c = mesh.vertices.col(t[2]);
  const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
  return longest * longest / (b - a).cross(c - a).norm();
}

// Edges just below the chord error beside edges just above it: once triangles along the first grew thinner without end.
TEST(FaceTriangles, AreNotThinAtAnyChordError) {
  constexpr int spans = 12;
  const KnotVector knots = uniform_knots(2, spans, {0, 1});
  Eigen::Matrix3Xd net(3, (spans + 2) * (spans + 2));
  std::mt19937 chance(7);
  for (int j = 0; j < spans + 2; ++j)
    for (int i = 0; i < spans + 2; ++i)
      net.col(j * (spans + 2) + i) =
          Vector3d(knots.greville(i), knots.greville(j), 0.06 * static_cast<double>(chance()) / std::mt19937::max());
  TrimmedSurface face = untrimmed(NurbsSurface(knots, knots, net));
  validate_loops(face);
  for (int k = 0; k < 40; ++k) {
    const double error = 2e-3 * std::pow(0.95, k);
    const FaceTriangles found = face_triangles(face, error);
    EXPECT_LE(found.chord_error, error);
    for (const Triangle& t : found.mesh.triangles) ASSERT_LT(thinness(found.mesh, t), 20) << error;
  }
}

// In a plane nothing but the trims asks for triangles: a disc by one curve, by two and by five.
TEST(FaceTriangles, BordersFollowTheirTrims) {
  constexpr double pi = 3.14159265358979323846, error = 1e-3;
  Eigen::Matrix3Xd net(3, 4);
  net << -2, 2, -2, 2, -2, -2, 2, 2, 0, 0, 0, 0;
  for (const int parts : {1, 2, 5}) {
    SCOPED_TRACE(parts);
    TrimmedSurface face = untrimmed(NurbsSurface(KnotVector(1, {-2, -2, 2, 2}), KnotVector(1, {-2, -2, 2, 2}), net));
    face.natural_bounds = false;
    TrimLoop loop;
    for (int k = 0; k < parts; ++k) {
      TrimCurve trim;
      trim.curve = circular_arc({0, 0}, 1, 1 + 2 * pi * k / parts, 1 + 2 * pi * (k + 1) / parts);
      trim.index = k;
      loop.curves.push_back(trim);
    }
    face.loops = {loop};
    validate_loops(face);
    const FaceTriangles found = face_triangles(face, error);
    // A polygon whose chords are at most `error` off the circle.
    EXPECT_LT(area(found.mesh), pi);
    EXPECT_GT(area(found.mesh), pi - 2 * pi * error);
  }
}

TEST(FaceTriangles, AFlatFaceNeedsFew) {
  Eigen::Matrix3Xd net(3, 4);
  net << 0, 1, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0;
  TrimmedSurface face = untrimmed(NurbsSurface(KnotVector(1, {0, 0, 1, 1}), KnotVector(1, {0, 0, 1, 1}), net));
  validate_loops(face);
  const FaceTriangles found = face_triangles(face, 1e-6);
  EXPECT_LT(found.chord_error, 1e-15);
  EXPECT_LT(found.mesh.triangles.size(), 200u);
  EXPECT_NEAR(area(found.mesh), 1, 1e-14);
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) try {
      face_triangles(face, bad);
      ADD_FAILURE() << "accepted";
    } catch (const GeometryError& error) {
      EXPECT_NE(std::string(error.what()).find("panel '" + face.name + "': its chord error is "), std::string::npos);
    }
}

}  // namespace
}  // namespace toile
