// SPDX-License-Identifier: GPL-3.0-or-later
// Shell benchmarks as scenes: on nets that fit and on trimmed ones. The references, their sources and the nets' own
// convergence are in tests/analysis/obstacle_course_test.cpp.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "pipeline/build/build.h"
#include "pipeline/run/measures.h"
#include "pipeline/run/run.h"
#include "support/near.h"

namespace toile {
namespace {

// How far the scene's output point has moved.
Eigen::Vector3d moved(const std::string& scene, const std::vector<std::string>& settings) {
  const Build b = build(read_scene(std::string(TOILE_SAMPLES "/") + scene, settings));
  const RunResult result = run(b);
  EXPECT_EQ(result.exit, RunExit::ok) << result.reason;
  EXPECT_EQ(result.path.factor, 1);
  const Eigen::VectorXd q = control_points(*result.system, result.state);
  return output_points(b, q)[0] - output_points(b, b.start)[0];
}

TEST(Shells, TheSamplesMeetTheObstacleCourse) {
  expect_near_rel(moved("studies/shells/roof.toml", {}).z(), -0.300592457e-5, 1e-4);
  expect_near_rel(moved("studies/shells/hemisphere.toml", {"panel.0.refine.spans=[18,18]"}).x(), 4e-5 * 0.0935208,
                  1e-3);
  expect_near_rel(moved("studies/shells/cylinder.toml", {"panel.0.refine.spans=[40,40]"}).z(), -1.8282e-5, 2e-3);
}

// Its ends and its straight edges cut the cells of the net; pins along the cuts are the diaphragms.
TEST(Shells, ATrimmedRoofSinksAsTheFittedOne) {
  const Eigen::Vector3d fitted = moved("studies/shells/roof.toml", {"panel.0.refine.spans=[16,16]"});
  const Eigen::Vector3d trimmed = moved("studies/shells/trimmed_roof.toml", {});
  expect_near_rel(trimmed.z(), fitted.z(), 1e-4);
  expect_near_rel(trimmed.x(), fitted.x(), 1e-3);
}

// Navier's series for a simply supported square plate, on a net that is turned by 30 degrees against the square.
TEST(Shells, ATrimmedPlateOnATurnedNetBendsAsNavierSays) {
  std::vector<std::string> settings = {
      "fabric.plate={law='isotropic',youngs_modulus=1e6,poissons_ratio=0.3,thickness=0.01,density=1}",
      "panel.0.fabric=plate",
      "panel.0.refine={degree=3,spans=[13,13]}",
      "strain_limit={mode='off'}",
      "load.gravity=[0,0,-1e-5]",
      "solver={until='rest',rest={method='newton',load_steps=1}}",
      "output={formats=[],preview=false,points=[{uv=[0.8125,0.8125]}]}"};
  std::string pins = "pin=[";
  for (const char* curve : {"0", "1", "2", "3"}) pins += std::string("{at='curve:0,") + curve + "',hold='z'},";
  settings.push_back(pins + "{at='uv:0.8125,0.8125',hold='xy'},{at='uv:0.9,0.8125',hold='y'}]");
  const double stiffness = 1e6 * 1e-6 / 12 / (1 - 0.09);
  expect_near_rel(moved("grid_independence/turned_30.toml", settings).z(), -0.00406235 * 1e-5 / stiffness, 1e-3);
}

}  // namespace
}  // namespace toile
