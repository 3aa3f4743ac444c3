// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/contact/self_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "analysis/map/affine_map.h"
#include "geometry/trimmed_surface.h"
#include "support/panels.h"
#include "trimming/cell_triangles.h"

namespace toile::test {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr double half = 0.5e-3, margin = 1e-3, size = 0.1;

// Square panels that lie over each other in the plane at rest.
struct Sheets {
  ShellModel model;
  AffineMap map;
  ContactProxy proxy;
  Matrix3Xd rest;
  SelfSearch search;

  explicit Sheets(int count)
      : model(flat(count)),
        map(AffineMap::identity(model.point_count()), {}, nullptr),
        proxy(model, map, map.reduce_scalar(model.lumped_mass()), proxies(model)),
        rest(places()),
        search(proxy, rest, 0.25e-3) {}

  static std::vector<ClothPanel> flat(int count) {
    std::vector<ClothPanel> panels;
    for (int k = 0; k < count; ++k) panels.push_back(make_flat_panel(size, size, 2, 4, 4, Fabric{}));
    return panels;
  }
  static std::vector<ProxyPanel> proxies(const ShellModel& model) {
    std::vector<ProxyPanel> out;
    for (const ClothPanel& panel : model.panels()) {
      TrimmedSurface surface;
      surface.surface = panel.rest;
      surface.loops.push_back(natural_loop(panel.rest));
      out.push_back({triangulate_cells(surface, trace_trims(surface), {2, 2}), half, 0.3});
    }
    return out;
  }
  Matrix3Xd places() const {
    Matrix3Xd out(3, proxy.vertices());
    for (int v = 0; v < proxy.vertices(); ++v) out.col(v) = apply(proxy.points(v), model.rest());
    return out;
  }
  // The second panel moved by `shift`.
  Matrix3Xd shifted(const Vector3d& shift) const {
    Matrix3Xd out = rest;
    for (int v = 0; v < proxy.vertices(); ++v)
      if (proxy.panel(v) == 1) out.col(v) += shift;
    return out;
  }
};

TEST(SelfSearch, FlatClothMeetsNothing) {
  Sheets one(1);
  EXPECT_TRUE(one.search.find(one.rest, one.rest, margin).empty());
}

TEST(SelfSearch, SheetsMeetWithinTheirOffsetsAndTheMarginAlone) {
  Sheets two(2);
  const Vector3d beside(0.003, 0.002, 0);
  const auto meetings = [&](double height) {
    const Matrix3Xd at = two.shifted(beside + Vector3d(0, 0, height));
    return two.search.find(at, at, margin);
  };
  EXPECT_FALSE(meetings(2 * half + 0.9 * margin).empty());
  EXPECT_TRUE(meetings(2 * half + 1.1 * margin).empty());
}

// Also in one step and also where it ends far beyond.
TEST(SelfSearch, WhatPassesThroughIsHeldOnItsSide) {
  Sheets two(2);
  for (const double end : {-1e-4, -0.02}) {
    const Matrix3Xd from = two.shifted({0.003, 0.002, 0.004}), at = two.shifted({0.003, 0.002, end});
    int vertices = 0, edges = 0;
    for (const SelfMeeting& meeting : two.search.find(from, at, margin)) {
      ++(meeting.edges ? edges : vertices);
      const bool upper = two.proxy.panel(meeting.vertices.front().first) == 1;
      EXPECT_NEAR(meeting.normal.z(), upper ? 1 : -1, 1e-12);
      EXPECT_NEAR(meeting.distance, 0.004, 1e-12);
      EXPECT_NEAR(meeting.thickness, 2 * half, 1e-15);
      Vector3d apart = Vector3d::Zero();
      for (const auto& [vertex, share] : meeting.vertices) apart += share * at.col(vertex);
      EXPECT_NEAR(meeting.normal.dot(apart), end, 1e-12);
    }
    EXPECT_GT(vertices, 40) << end;
    EXPECT_GT(edges, 40) << end;
  }
}

// A sheet that crosses the other's plane beyond its border is free there.
TEST(SelfSearch, WhatPassesBesideIsFree) {
  Sheets two(2);
  const Matrix3Xd from = two.shifted({1.2 * size, 0, 0.004}), at = two.shifted({1.2 * size, 0, -0.004});
  EXPECT_TRUE(two.search.find(from, at, margin).empty());
}

// A panel that is bent to a fold meets itself; what lies over each other at rest in two panels meets too.
TEST(SelfSearch, AFoldMeetsItself) {
  Sheets one(1);
  Matrix3Xd at = one.rest;
  const double radius = 0.5e-3 + 0.4e-3, bend = std::numbers::pi * radius;
  for (int v = 0; v < at.cols(); ++v) {
    const double s = at(0, v) - 0.5 * (size - bend), turn = std::clamp(s / radius, 0.0, std::numbers::pi);
    const double flat = s < 0 ? s : s > bend ? bend - s : 0;
    at(0, v) = flat + radius * std::sin(turn);
    at(2, v) = radius * (1 - std::cos(turn));
  }
  EXPECT_GT(one.search.find(at, at, margin).size(), 20u);
  Sheets two(2);
  EXPECT_FALSE(two.search.find(two.rest, two.rest, margin).empty());
}

}  // namespace
}  // namespace toile::test
