// SPDX-License-Identifier: GPL-3.0-or-later
// Cloth on nets that its border cuts, against what equilibrium and symmetry say.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "pipeline/output/output.h"
#include "pipeline/panels.h"
#include "pipeline/run/measures.h"
#include "pipeline/run/run.h"
#include "support/near.h"
#include "support/panels.h"

namespace toile {
namespace {

// Example 4.4 on a net of `spans` spans of 1.6 / spans m (1.2 where it isn't turned): a square metre held along its top
// edge, at rest under 1 N/m along its bottom edge, or under the loads of `more`.
struct Patch {
  int degrees = 0, spans = 10;
  int degree = 2;
  std::string more =
      "[[traction]]\npanel = \"cloth\"\nalong = \"curve:0,0\"\nforce = [0, -1, 0]\n"
      "[load]\ngravity = [0, 0, 0]\n";
};
struct Still {
  Build build;
  RunResult run;
  StateMeasures measures;
  nlohmann::ordered_json report;
};
Still at_rest(const Patch& patch) {
  const test::Folder folder("trimmed");
  TrimmedSurface face = test::turned_square(patch.degree, patch.spans, patch.degrees == 0 ? 1.2 : 1.6,
                                            patch.degrees * std::numbers::pi / 180);
  face.name = "cloth";
  test::write_panels(folder / "panel.igs", {face});
  const std::string text = "[[panel]]\nname = \"cloth\"\nfile = \"panel.igs\"\nfabric = \"patch\"\ngrain_deg = " +
                           std::to_string(-patch.degrees) +
                           "\n[fabric.patch]\ndensity = 0.117\nthickness = 0.001177\n"
                           "membrane = { weft = 11.7, warp = 11.7, shear = 4.68 }\n"
                           "bending = { b0 = 3.3e-3, kappa0 = 30, kappa_reg = 0.03 }\n"
                           "[[pin]]\npanel = \"cloth\"\nat = \"curve:0,2\"\n"
                           "[strain_limit]\ntolerance = 0.01\n[solver]\nuntil = \"rest\"\ndt = 1e-3\n"
                           "rest = { tolerance = 1e-6 }\n[output]\npreview = false\nformats = []\n" +
                           patch.more;
  write_file(folder / "scene.toml", text);
  Still still{build(read_scene((folder / "scene.toml").string())), {}, {}, {}};
  still.run = run(still.build);
  still.measures = measure(still.build, *still.run.system, still.run.state, still.run.dt_last);
  still.report = report_json(still.build, still.run, still.measures, 0);
  return still;
}

// The default stiffness, 10 / 0.01 times the load, yields by a tenth of the limit less what the limit's law and the
// fabric take of it: S with S / 1000 / (1 + S / 1000) = E, S + 11.7 E = 1 / sqrt(1 + 2 E).
TEST(Trimmed, APatchStrainsTheSameUpToItsCorners) {
  const Still still = at_rest({});
  ASSERT_EQ(still.run.exit, RunExit::ok) << still.run.reason;
  const Eigen::VectorXd q = control_points(*still.run.system, still.run.state);
  for (const double x : {-0.5, -0.48, 0.0, 0.48, 0.5})
    for (const double y : {-0.5, -0.48, 0.0, 0.48, 0.5})
      EXPECT_NEAR(still.build.model->state(0, x, y, q).strain[1], 0.0009, 1e-4) << x << ' ' << y;
  for (const char* thread : {"weft", "warp"}) EXPECT_LT(still.report.at("stress").at("unbalanced").at(thread), 1e-6);
}

}  // namespace
}  // namespace toile
