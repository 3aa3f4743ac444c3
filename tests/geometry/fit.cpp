// SPDX-License-Identifier: GPL-3.0-or-later
// Nets fitted to scattered points.
#include "geometry/fit.h"

#include <cmath>

#include "expect_error.h"
#include "geometry/error.h"
#include "random_geometry.h"
#include "support/near.h"

namespace toile::test {
namespace {

// The plane (u, v, 0) on 8 x 6 spans of degree 3 and 2 with uneven knots; weights wavy where asked.
NurbsSurface flat(bool rational) {
  const KnotVector u(3, {0, 0, 0, 0, 0.1, 0.2, 0.35, 0.5, 0.6, 0.8, 0.9, 1, 1, 1, 1});
  const KnotVector v(2, {0, 0, 0, 0.3, 0.4, 0.7, 0.9, 1, 1, 1});
  Eigen::Matrix3Xd net(3, u.control_point_count() * v.control_point_count());
  std::vector<double> weights;
  for (int j = 0; j < v.control_point_count(); ++j)
    for (int i = 0; i < u.control_point_count(); ++i) {
      net.col(i + u.control_point_count() * j) << u.greville(i), v.greville(j), 0;
      if (rational) weights.push_back(1 + 0.3 * std::sin(3.0 * i + j));
    }
  return {u, v, net, weights};
}

template <class Inside>
std::vector<FitSample> samples_of(const NurbsSurface& surface, int n, const Inside& inside) {
  std::vector<FitSample> samples;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const double u = std::fmod(0.37 + i * 0.6180339887498949 + 0.01 * j, 1.0), v = (j + 0.5) / n;
      if (inside(u, v)) samples.push_back({u, v, surface(u, v), 1 + 0.5 * u});
    }
  return samples;
}
const auto everywhere = [](double, double) { return true; };
const auto disc = [](double u, double v) { return std::hypot(u - 0.5, v - 0.5) < 0.3; };

TEST(FitNet, FindsTheSurfaceThatTheSamplesComeFrom) {
  for (const bool rational : {false, true}) {
    const NurbsSurface start = flat(rational);
    Eigen::Matrix3Xd net = start.points();
    for (int k = 0; k < static_cast<int>(net.cols()); ++k)
      net.col(k) += Eigen::Vector3d(0.1 * std::cos(2.0 * k), 0.1 * std::sin(k), std::sin(0.7 * k));
    const NurbsSurface wanted = start.with_points(net);
    const NetFit fit = fit_net(start, samples_of(wanted, 60, everywhere));
    EXPECT_LT((fit.surface.points() - net).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LT(fit.largest, 1e-10);
    EXPECT_EQ(fit.without_samples, 0);
  }
}

// Samples in a disc: the rest of the net continues what they say.
TEST(FitNet, ContinuesSmoothlyWhereThereAreNoSamples) {
  const NurbsSurface start = flat(false);
  Eigen::Matrix3d turn;
  turn << 0.6, -0.8, 0, 0.8, 0.6, 0, 0, 0, 1;
  const Eigen::Matrix3Xd net = (turn * start.points()).colwise() + Eigen::Vector3d(1, 2, 3);
  const NetFit fit = fit_net(start, samples_of(start.with_points(net), 60, disc));
  EXPECT_GT(fit.without_samples, 0);
  EXPECT_LT((fit.surface.points() - net).cwiseAbs().maxCoeff(), 1e-8);
  // Curved: within the disc to the space's resolution, around it without wild points.
  std::vector<FitSample> bowl = samples_of(start, 60, disc);
  for (FitSample& s : bowl) s.x.z() = 0.2 * std::sin(3 * s.u) * std::cos(2 * s.v);
  const NetFit curved = fit_net(start, bowl);
  EXPECT_LT(curved.largest, 2e-3);
  EXPECT_GT(curved.largest, 0);
  EXPECT_TRUE(disc(curved.largest_at.x(), curved.largest_at.y()));
  EXPECT_LT(curved.surface.points().row(2).cwiseAbs().maxCoeff(), 0.6);
}

TEST(FitNet, ANetThatFitsComesBack) {
  const NurbsSurface start = flat(true);
  const NetFit fit = fit_net(start, samples_of(start, 20, disc));
  EXPECT_EQ(fit.surface.points(), start.points());
  EXPECT_LT(fit.largest, 1e-14);
}

TEST(FitNet, ReportsWhatIsLeft) {
  const NurbsSurface start = flat(false);
  std::vector<FitSample> samples = samples_of(start, 60, everywhere);
  samples[700].x.z() += 0.5;
  const NetFit fit = fit_net(start, samples);
  EXPECT_GT(fit.largest, 0.3);
  EXPECT_EQ(fit.largest_at, Eigen::Vector2d(samples[700].u, samples[700].v));
  EXPECT_GT(fit.rms, fit.largest / 60);
  EXPECT_LT(fit.rms, fit.largest / 30);
}

TEST(FitNet, RefusesSamplesThatDetermineNothing) {
  const NurbsSurface start = flat(false);
  std::vector<FitSample> line, outside = samples_of(start, 5, everywhere), broken = outside, weightless = outside;
  for (int k = 0; k < 50; ++k) line.push_back({k / 50.0, k / 50.0, start(k / 50.0, k / 50.0)});
  outside[3].u = 1.5;
  broken[3].x.y() = std::nan("");
  weightless[3].weight = 0;
  EXPECT_THROW(fit_net(start, {}), GeometryError);
  EXPECT_THROW(fit_net(start, line), GeometryError);
  EXPECT_THROW(fit_net(start, outside), GeometryError);
  EXPECT_THROW(fit_net(start, broken), GeometryError);
  EXPECT_THROW(fit_net(start, weightless), GeometryError);
}

}  // namespace
}  // namespace toile::test
