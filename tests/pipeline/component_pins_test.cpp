// SPDX-License-Identifier: GPL-3.0-or-later
// Pins that hold some components: planes of symmetry, supports that slide. Point loads and the isotropic law.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "geometry/error.h"
#include "pipeline/panels.h"
#include "pipeline/run/measures.h"
#include "pipeline/run/run.h"
#include "support/near.h"

namespace toile {
namespace {

using test::Folder;

// Of the plane, in millimetres.
TrimmedSurface square(double from, double to, int spans) {
  const AffinePatch plane{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0};
  const KnotVector knots = uniform_knots(2, spans, {from, to});
  TrimmedSurface face = untrimmed(rebuild(plane, knots, knots));
  face.name = "cloth";
  face.metres_per_unit = 1e-3;
  return face;
}

std::string scene(const std::string& pins, const std::string& more) {
  return "[[panel]]\nname = \"cloth\"\nfile = \"panel.igs\"\n" + pins + more +
         "\n[output]\npreview = false\nformats = []\npoints = [{ uv = [0, 0] }, { uv = [200, 100] }, { uv = [400, 0] "
         "}]\n";
}
const std::string by_newton = "[solver]\nuntil = \"rest\"\nrest = { method = \"newton\" }\n";

Build built(const Folder& folder, const TrimmedSurface& face, const std::string& text,
            const std::vector<std::string>& settings = {}) {
  test::write_panels(folder / "panel.igs", {face});
  return build(parse_scene(text, folder / "scene.toml", settings));
}

struct End {
  Build b;
  RunResult run;
  StateMeasures m;
};
End end_of(const TrimmedSurface& face, const std::string& text, const std::vector<std::string>& settings = {}) {
  const Folder folder("components");
  Build b = built(folder, face, text, settings);
  RunResult result = run(b);
  StateMeasures m = measure(b, *result.system, result.state, result.dt_last);
  return {std::move(b), std::move(result), std::move(m)};
}

double weight(const Build& b) {
  return b.model->lumped_mass().sum() * 9.81;
}

const std::string mirrors =
    "[[pin]]\nat = \"edge:u0\"\nhold = \"x\"\nclamp = true\n[[pin]]\nat = \"edge:v0\"\nhold = \"y\"\nclamp = true\n";

// Splines that are even across a plane are the same on both sides of it, so nothing but rounding lies between the two.
TEST(ComponentPins, AQuarterBetweenPlanesOfSymmetryRestsAsTheWhole) {
  const std::string corners =
      "[[pin]]\nat = \"corner:0,0\"\n[[pin]]\nat = \"corner:0,1\"\n[[pin]]\nat = \"corner:1,0\"\n";
  const std::string corner = "[[pin]]\nat = \"corner:1,1\"\n";
  const End whole = end_of(square(-400, 400, 10), scene(corners + corner, by_newton));
  const End quarter = end_of(square(0, 400, 5), scene(mirrors + corner, by_newton));
  ASSERT_EQ(whole.run.exit, RunExit::ok) << whole.run.reason;
  ASSERT_EQ(quarter.run.exit, RunExit::ok) << quarter.run.reason;
  EXPECT_GT(std::abs(whole.m.points[0].z()), 0.05);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_LT((whole.m.points[k] - quarter.m.points[k]).norm(), 1e-7) << k;
  // The planes push along their normals, and what the ties give to one row they take from the other.
  const Eigen::Vector3d& pin = quarter.m.reactions[2];
  expect_near_rel(pin.z(), weight(quarter.b), 1e-6);
  EXPECT_NEAR(quarter.m.reactions[0].x(), -pin.x(), 1e-6 * weight(quarter.b));
  EXPECT_NEAR(quarter.m.reactions[1].y(), -pin.y(), 1e-6 * weight(quarter.b));
  EXPECT_LT((quarter.m.reactions[2] - whole.m.reactions[3]).norm(), 1e-6 * weight(whole.b));
}

TEST(ComponentPins, RelaxationAndNewtonsMethodGiveOneAnswer) {
  const std::string text = scene(mirrors + "[[pin]]\nat = \"corner:1,1\"\n", "[solver]\nuntil = \"rest\"\n");
  const End relaxed = end_of(square(0, 400, 5), text, {"solver.rest.tolerance=1e-5"});
  const End newton = end_of(square(0, 400, 5), text, {"solver.rest.method=newton"});
  ASSERT_EQ(relaxed.run.exit, RunExit::ok) << relaxed.run.reason;
  for (std::size_t k = 0; k < 3; ++k) EXPECT_LT((relaxed.m.points[k] - newton.m.points[k]).norm(), 1e-4) << k;
}

// Held along x alone the cloth falls as if nothing held it, by every scheme, with a strain limit and without.
TEST(ComponentPins, WhatIsNotHeldFallsFreely) {
  const std::string pins = "[[pin]]\nat = \"edge:u0\"\nhold = \"x\"\n[[pin]]\nat = \"uv:200,110\"\nhold = \"xy\"\n";
  for (const char* scheme : {"verlet", "bdf2"}) {
    for (const char* limit : {"strain_limit.mode=off", "strain_limit.tolerance=0.01"}) {
      const End e = end_of(square(0, 400, 5), scene(pins, "[fabric.light]\ndrag = 0\n[solver]\nuntil = 0.1\n"),
                           {"panel.0.fabric=light", limit, std::string("solver.scheme=") + scheme});
      ASSERT_EQ(e.run.exit, RunExit::ok) << e.run.reason;
      const Eigen::VectorXd q = control_points(*e.run.system, e.run.state);
      for (int i = 0; i < e.b.model->point_count(); ++i) {
        const Eigen::Vector3d moved = (q - e.b.start).segment<3>(3 * i);
        EXPECT_LT((moved - Eigen::Vector3d(0, 0, -0.5 * 9.81 * 0.01)).norm(), 1e-9) << scheme << ' ' << limit;
      }
    }
  }
}

// A trimmed net on supports that slide: they push along z alone, and the one that holds x and y pushes along neither z.
TEST(ComponentPins, SupportsAlongTrimsCarryTheWeightAndSlide) {
  std::string pins;
  for (const char* curve : {"0", "1", "2", "3"})
    pins += std::string("[[pin]]\nat = \"curve:0,") + curve + "\"\nhold = \"z\"\n";
  pins += "[[pin]]\nat = \"uv:200,100\"\nhold = \"xy\"\n[[pin]]\nat = \"uv:200,250\"\nhold = \"x\"\n";
  const End e = end_of(test::trimmed_sheet("cloth"), scene(pins, by_newton), {"output.points=[{uv=[200,200]}]"});
  ASSERT_EQ(e.run.exit, RunExit::ok) << e.run.reason;
  EXPECT_LT(e.m.points[0].z(), -1e-4);
  const double w = weight(e.b);
  double carried = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector3d& r = e.m.reactions[k];
    EXPECT_EQ(r.x(), 0);
    EXPECT_EQ(r.y(), 0);
    EXPECT_GT(r.z(), 0);
    carried += r.z();
    EXPECT_LT(e.m.gaps[k].value_or(1), 3e-4);
  }
  expect_near_rel(carried, w, 1e-6);
  for (const std::size_t k : {4u, 5u}) EXPECT_LT(e.m.reactions[k].norm(), 1e-6 * w);
  EXPECT_EQ(e.m.reactions[4].z(), 0);
}

std::string refusal(const std::string& pins, const std::vector<std::string>& settings = {}) {
  const Folder folder("refused");
  try {
    const Build b = built(folder, square(0, 400, 5), scene(pins, ""), settings);
    assemble(b, 0);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(ComponentPins, WhatCanNotHoldThemSaysSoByTheKey) {
  const std::string pin = "[[pin]]\nat = \"edge:u0\"\nhold = \"x\"\n";
  EXPECT_EQ(refusal(pin), "accepted");
  EXPECT_EQ(refusal(pin, {"strain_limit.tolerance=0.01"}), "accepted");
  for (const char* solver : {"solver=substeps", "solver=lagrange", "variant=paper"}) {
    const std::string message = refusal(pin, {"strain_limit.tolerance=0.01", std::string("strain_limit.") + solver});
    for (const char* part : {"scene.toml:4", "pin 0 (edge:u0)", "hold", "strain_limit"})
      EXPECT_NE(message.find(part), std::string::npos) << solver << ": " << message;
  }
  for (const char* hold : {"", "w", "xx", "xyzx"})
    EXPECT_NE(refusal("[[pin]]\nat = \"edge:u0\"\nhold = \"" + std::string(hold) + "\"\n").find("hold = "),
              std::string::npos)
        << hold;
  EXPECT_NE(refusal("[[pin]]\nat = \"corner:0,0\"\nhold = \"x\"\nclamp = true\n").find("works at whole edges only"),
            std::string::npos);
  EXPECT_NE(refusal(pin + "clamp = true\nmove = { end = 1 }\n").find("can't move"), std::string::npos);
}

TEST(Forces, APointLoadIsCarriedByThePins) {
  const std::string load = "[[pin]]\nat = \"edge:u0\"\n[load]\ngravity = [0, 0, 0]\n";
  for (const auto& [at, x, y] : {std::tuple("uv:310,130", 0.31, 0.13), std::tuple("corner:1,0", 0.4, 0.0)}) {
    const Folder folder("force");
    const Build b = built(folder, square(0, 400, 5),
                          scene("[[force]]\nat = \"" + std::string(at) + "\"\nforce = [0, 1, \"-2 N\"]\n", load));
    Eigen::Vector3d sum = Eigen::Vector3d::Zero(), moment = Eigen::Vector3d::Zero();
    for (int i = 0; i < b.model->point_count(); ++i) {
      sum += b.loads.force.segment<3>(3 * i);
      moment += b.start.segment<3>(3 * i).cross(b.loads.force.segment<3>(3 * i));
    }
    EXPECT_LT((sum - Eigen::Vector3d(0, 1, -2)).norm(), 1e-12);
    EXPECT_LT((moment - Eigen::Vector3d(x, y, 0).cross(Eigen::Vector3d(0, 1, -2))).norm(), 1e-12);
  }
  const Folder folder("force_off");
  EXPECT_THROW(
      built(folder, test::trimmed_sheet("cloth"), scene("[[force]]\nat = \"corner:0,0\"\nforce = [0, 0, 1]\n", load)),
      GeometryError);
}

TEST(Fabrics, TheIsotropicLawIsTheClassicalShell) {
  const std::string fabric =
      "[fabric.plate]\nlaw = \"isotropic\"\nyoungs_modulus = \"2 kPa\"\npoissons_ratio = 0.25\n"
      "thickness = 0.1\ndensity = 3\n";
  const Folder folder("isotropic");
  const Build b = built(folder, square(0, 400, 5), scene("", fabric), {"panel.0.fabric=plate"});
  const Fabric& got = b.scene.panels[0].fabric;
  const double membrane = 2000 * 0.1 / (1 - 0.0625);
  expect_near_rel(got.membrane.warp, membrane, 1e-14);
  expect_near_rel(got.membrane.coupling, 0.25 * membrane, 1e-14);
  expect_near_rel(got.membrane.shear, 2000 * 0.1 / 2.5, 1e-14);
  expect_near_rel(got.bending.b0, membrane * 0.01 / 12, 1e-14);
  EXPECT_EQ(got.density, 3);
  for (const char* wrong : {"fabric.plate.poissons_ratio=0.6", "fabric.plate.law=weft-warp", "fabric.plate.bending={}",
                            "fabric.plate.youngs_modulus=\"2 N\""}) {
    EXPECT_THROW(built(folder, square(0, 400, 5), scene("", fabric), {wrong}), InputError) << wrong;
  }
}

}  // namespace
}  // namespace toile
