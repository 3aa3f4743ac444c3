// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>

#include "analysis/shell/shell_model.h"
#include "geometry/error.h"
#include "geometry/refine.h"
#include "pipeline/panels.h"
#include "pipeline/run/run.h"

namespace toile {
namespace {

using test::Folder;

const std::string corner_pins = "[[pin]]\nat = \"corner:0,0\"\n[[pin]]\nat = \"corner:1,0\"\n";

Build built(const Folder& folder, const TrimmedSurface& face, const std::string& scene) {
  test::write_panels(folder / "panel.igs", {face});
  return build(parse_scene(scene, folder / "scene.toml"));
}

// The sheet with its knot u = 160 `times` more, creased there to 45 degrees on either side.
TrimmedSurface creased(int times) {
  TrimmedSurface face = test::sheet("cloth");
  std::vector<double> knots(face.surface.u().knots().begin(), face.surface.u().knots().end());
  knots.insert(std::ranges::find(knots, 160.0), static_cast<std::size_t>(times), 160.0);
  const KnotVector u(2, knots);
  face.surface = rebuild(AffinePatch{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0}, u, face.surface.v());
  Eigen::Matrix3Xd net = face.surface.points();
  for (auto point : net.colwise()) point.z() = std::abs(point.x() - 160);
  face.surface = face.surface.with_points(net);
  return face;
}

// Cosine of the angle between the tangent planes on either side of the crease; 0 at rest.
double crease_cosine(const Build& b) {
  const RunResult result = run(b);
  EXPECT_EQ(result.exit, RunExit::ok) << result.reason;
  const Eigen::VectorXd q = control_points(*result.system, result.state);
  const NurbsSurface draped = b.rest(0).with_points(b.net(0, q));
  const int after = draped.u().find_span(160), before = draped.u().find_span(159.99), v = draped.v().find_span(200);
  const auto normal = [&](int span) -> Eigen::Vector3d {
    const SurfaceJet jet = evaluate_on_span(draped, span, v, 160, 200);
    return jet.u.cross(jet.v).normalized();
  };
  return normal(before).dot(normal(after));
}

TEST(Creases, AStripCarriesThemAndKeepsTheirAngle) {
  const Folder folder("crease");
  // All is held up to the crease; what lies beyond hangs from it.
  Build b = built(folder, creased(1), test::scene_text("[[pin]]\nat = \"box:[-1, -1, -1],[0.1601, 1, 1]\"\n"));
  ASSERT_FALSE(b.model->panels()[0].kinks.empty());
  for (const KinkPoint& point : b.model->panels()[0].kinks) EXPECT_EQ(point.at, 160);
  EXPECT_FALSE(b.panels[0].extra_points.empty());
  EXPECT_LT(std::abs(crease_cosine(b)), 0.05);
  std::vector<ClothPanel> without = b.model->panels();
  without[0].kinks.clear();
  b.model = std::make_unique<ShellModel>(without);
  EXPECT_GT(std::abs(crease_cosine(b)), 0.1);
}

TEST(Creases, ATearIsNamedByItsKnot) {
  const Folder folder("tear");
  // Two columns of control points on the line: together they are a crease, apart a tear.
  TrimmedSurface face = creased(2);
  EXPECT_FALSE(built(folder, face, test::scene_text(corner_pins)).model->panels()[0].kinks.empty());
  Eigen::Matrix3Xd net = face.surface.points();
  for (int k = 0; k < net.cols(); ++k)
    if (k % face.surface.count_u() >= 4) net(2, k) += 5;
  face.surface = face.surface.with_points(net);
  try {
    built(folder, face, test::scene_text(corner_pins));
    FAIL() << "a torn panel was accepted";
  } catch (const GeometryError& error) {
    EXPECT_NE(std::string(error.what()).find("u = 160"), std::string::npos) << error.what();
  }
}

// A bicubic panel that is not flat can't be rebuilt at p = 2.
TEST(Degree, CubicPanelsTakeMorePointsThanTheyList) {
  TrimmedSurface face = test::sheet("cloth");
  const AffinePatch plane{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0};
  face.surface = rebuild(plane, uniform_knots(3, 5, {0, 400}), uniform_knots(3, 5, {0, 400}));
  Eigen::Matrix3Xd net = face.surface.points();
  for (auto point : net.colwise()) point.z() = 4e-4 * point.x() * point.x();
  face.surface = face.surface.with_points(net);
  const Folder folder("cubic");
  const Build b = built(folder, face, test::scene_text(corner_pins));
  EXPECT_EQ(b.rest(0).u().degree(), 3);
  EXPECT_EQ(b.panels[0].points.size(), 36u);        // the knot vertices: what inspect lists
  EXPECT_EQ(b.panels[0].extra_points.size(), 45u);  // 7 x 7 lines in all, which meet the listed points at the corners
  EXPECT_EQ(std::ranges::count(b.panels[0].points, true, &ConstraintPoint::used), 4);
  const RunResult result = run(b);
  EXPECT_EQ(result.exit, RunExit::ok) << result.reason;
  EXPECT_EQ(result.system->points[0].size(), 36u);
  EXPECT_GT(result.system->strain_rows, 2 * 36);
}

}  // namespace
}  // namespace toile
