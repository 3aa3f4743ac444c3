// SPDX-License-Identifier: GPL-3.0-or-later
// Shadows whose area and nodes are known.
#include "pipeline/measure/shadow.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "geometry/error.h"
#include "pipeline/draped_cap.h"
#include "pipeline/measure/draped_panel.h"
#include "support/near.h"

namespace toile {
namespace {

constexpr double pi = std::numbers::pi;

// A fan about `centre` whose border is at `radius` of the angle, at `count` places.
Shadow fan(const std::function<double(double)>& radius, const Eigen::Vector2d& centre, int count, double support = 0) {
  Eigen::Matrix2Xd points(2, count + 1);
  std::vector<Triangle> triangles;
  points.col(count) = centre;
  for (int k = 0; k < count; ++k) {
    const double angle = 2 * pi * k / count;
    points.col(k) = centre + radius(angle) * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    triangles.push_back(k % 2 ? Triangle{count, k, (k + 1) % count} : Triangle{(k + 1) % count, k, count});
  }
  return shadow_of(points, triangles, centre, support);
}

TEST(Shadow, OfADiscIsItsAreaAndHasNoNodes) {
  const Shadow disc = fan([](double) { return 0.15; }, {0.3, -0.2}, 3600);
  expect_near_rel(disc.area, pi * 0.15 * 0.15, 1e-6);
  const DrapeMeasure flat = measure_drape(disc, 0.09, disc.area);
  expect_near_rel(flat.coefficient, 100, 1e-12);
  EXPECT_TRUE(flat.nodes.empty());
}

// Area pi (r0^2 + a^2 / 2).
TEST(Shadow, OfACosineHasItsAreaNodesAndAmplitude) {
  for (const int n : {1, 3, 7, 12}) {
    const double r0 = 0.12, a = 0.011;
    const Shadow shadow = fan([&](double angle) { return r0 + a * std::cos(n * angle - 1); }, {0, 0}, 3600);
    const double area = pi * (r0 * r0 + 0.5 * a * a);
    expect_near_rel(shadow.area, area, 1e-4);
    const double held = pi * 0.09 * 0.09, flat = pi * 0.15 * 0.15;
    const DrapeMeasure drape = measure_drape(shadow, 0.09, flat);
    expect_near_rel(drape.coefficient, 100 * (area - held) / (flat - held), 2e-4);
    ASSERT_EQ(drape.nodes.size(), static_cast<std::size_t>(n));
    for (const DrapeNode& node : drape.nodes) {
      expect_near_rel(node.amplitude, a, 1e-3);
      expect_near_rel(node.radius, r0 + a, 1e-3);
      EXPECT_NEAR(std::remainder(n * node.angle - 1, 2 * pi), 0, 2e-3 * n);
    }
  }
}

// 2 % of the free ring of 60 mm are 1.2 mm from valley to top.
TEST(Shadow, RipplesBelowTwoPercentOfTheFreeRingAreNoNodes) {
  const auto nodes = [](double ripple) {
    const Shadow shadow = fan(
        [&](double angle) { return 0.12 + 0.01 * std::cos(5 * angle) + ripple * std::cos(60 * angle); }, {0, 0}, 3600);
    return measure_drape(shadow, 0.09, pi * 0.15 * 0.15).nodes.size();
  };
  EXPECT_EQ(nodes(0.3e-3), 5u);
  EXPECT_GT(nodes(3e-3), 20u);
}

TEST(Shadow, CoversTwiceWhatIsThereOnceAndLeavesGapsOut) {
  // Two squares of 1 beside the support that overlap by half, seen from a point between gap and support.
  Eigen::Matrix2Xd points(2, 8);
  points << 1, 2, 2, 1, 1.5, 2.5, 2.5, 1.5,  //
      -0.5, -0.5, 0.5, 0.5, -0.5, -0.5, 0.5, 0.5;
  const std::vector<Triangle> triangles{{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {6, 4, 7}};
  const Shadow shadow = shadow_of(points, triangles, {0, 0}, 0.25);
  expect_near_rel(shadow.area, 1.5 + pi * 0.25 * 0.25, 1e-3);
  expect_near_rel(shadow.radius[0], 2.5, 1e-12);
  expect_near_rel(shadow.radius[1800], 0.25, 1e-12);
}

// A part of a sphere, exact: its shadow is the disc within its rim.
TEST(Shadow, OfASphericalCapIsTheDiscWithinItsRim) {
  const test::DrapedCap cap;
  for (const double degrees : {0.0, 35.0, 90.0}) {
    const Eigen::Matrix3d turned =
        Eigen::AngleAxisd(degrees * pi / 180, Eigen::Vector3d(1, 2, 0).normalized()).matrix();
    PanelFile file = test::draped_cap(cap, turned);
    file.up = turned.col(2);
    const DrapedPanel panel = draped_panel(file);
    expect_near_rel(panel.flat_area, pi * cap.radius * cap.radius, 1e-9);
    EXPECT_LT(panel.centre.norm(), 1e-9);
    const Shadow shadow = shadow_of(panel.points, panel.triangles, panel.centre, 0.03);
    const auto [least, largest] = std::ranges::minmax(shadow.radius);
    expect_near_rel(least, cap.rim(), 1e-3);  // triangles to 0.1 mm
    expect_near_rel(largest, cap.rim(), 1e-9);
    expect_near_rel(shadow.area, pi * cap.rim() * cap.rim(), 1e-3);
    EXPECT_TRUE(measure_drape(shadow, 0.03, panel.flat_area).nodes.empty());
  }
}

TEST(Shadow, IsOfOnePairOfPanels) {
  const PanelFile both = test::draped_cap({});
  PanelFile one = both, several = both;
  one.panels.pop_back();
  several.panels.push_back(both.panels.back());
  for (const PanelFile& file : {one, several, PanelFile()}) EXPECT_THROW(draped_panel(file), InputError);
}

TEST(Shadow, DrawsItsOutlineInMillimetres) {
  const Shadow disc = fan([](double) { return 0.12; }, {0, 0}, 3600);
  const std::string svg = drape_svg(disc, measure_drape(disc, 0.09, pi * 0.15 * 0.15));
  EXPECT_NE(svg.find("M280 160"), std::string::npos) << svg.substr(0, 900);
}

}  // namespace
}  // namespace toile
