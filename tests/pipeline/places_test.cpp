// SPDX-License-Identifier: GPL-3.0-or-later
// What pins and loads of a scene hold and reach on a panel.
#include "pipeline/build/places.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "geometry/error.h"
#include "pipeline/build/system.h"
#include "pipeline/panels.h"
#include "support/near.h"

namespace toile {
namespace {

using test::Folder;

Build built(const Folder& folder, const TrimmedSurface& face, const std::string& scene) {
  test::write_panels(folder / "panel.igs", {face});
  return build(parse_scene(scene, folder / "scene.toml"));
}

std::string geometry_refusal(const TrimmedSurface& face, const std::string& pins) {
  const Folder folder("refusal");
  const Build b = built(folder, face, test::scene_text(pins));
  try {
    assemble(b, 0);
  } catch (const GeometryError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Places, TrimmedAwayPlacesAreNamed) {
  const TrimmedSurface face = test::trimmed_sheet("cloth");
  for (const char* at :
       {"corner:0,0", "edge:u0", "edge:v1", "uv:10,10", "uv:900,10", "curve:0,7", "curve:1,0", "cp:40,0"}) {
    const std::string message = geometry_refusal(face, std::string("[[pin]]\nat = \"") + at + "\"\n");
    EXPECT_NE(message.find(std::string("pin 0 (") + at + ")"), std::string::npos) << at << ": " << message;
    EXPECT_NE(message.find("'cloth'"), std::string::npos) << at << ": " << message;
    EXPECT_NE(message.find("scene.toml:4"), std::string::npos) << at << ": " << message;
  }
}

TEST(Places, ACurveThatCoversAnEdgeHoldsItsControlPoints) {
  const Folder folder("edge");
  const Build b = built(folder, test::sheet("cloth"), test::scene_text("[[pin]]\nat = \"curve:0,2\"\n"));
  const auto curve = assemble(b, 0);
  const Folder other("edge2");
  const Build e = built(other, test::sheet("cloth"), test::scene_text("[[pin]]\nat = \"edge:v1\"\n"));
  const auto edge = assemble(e, 0);
  EXPECT_EQ(curve->map->fixed(), edge->map->fixed());
  EXPECT_EQ(curve->place_rows, 0);
}

TEST(Places, FractionsOfACurveAreOfItsLengthInSpace) {
  const Folder folder("length");
  const Build b = built(folder, test::trimmed_sheet("cloth"), test::scene_text(""));
  const BuiltPanel& panel = b.panels[0];
  const CurveOnSurface path(panel.face, panel.topology, 0, 2, b.rest(0));
  // The panel is flat and isometric: lengths are those of the plane curve in millimetres.
  const Curve2& curve = panel.face.loops[0].curves[2].curve;
  expect_near_rel(path.length(), 1e-3 * arc_length(curve, curve.domain()), 1e-10);
  for (const double fraction : {0.1, 0.5, 0.83}) {
    const double t = path.parameter(fraction);
    expect_near_rel(arc_length(curve, {curve.domain().min, t}), fraction * 1e3 * path.length(), 1e-10);
  }
}

TEST(Places, ALineLoadAddsUpToItsLength) {
  const Folder folder("traction");
  const Build b = built(folder, test::trimmed_sheet("cloth"),
                        test::scene_text("[[traction]]\nalong = \"curve:0,0,0.25,1\"\nforce = [0, -2, 0]\n",
                                         "[load]\ngravity = [0, 0, 0]\n"));
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int i = 0; i < b.model->point_count(); ++i) sum += b.loads.force.segment<3>(3 * i);
  expect_near_rel(sum.y(), -2 * 0.75 * 0.34, 1e-12);
  EXPECT_EQ(sum.x(), 0);
}

// The trimmed sheet with a notch: a hole that pokes out through curve 0, of which 120 mm on either side are left.
// Backwards: the file's outline runs clockwise.
TrimmedSurface notched_sheet(bool backwards = false) {
  TrimmedSurface face = test::trimmed_sheet("cloth");
  TrimLoop notch;
  notch.kind = LoopKind::hole;
  notch.index = 1;
  const std::array<Eigen::Vector2d, 4> corner{{{150, 5}, {150, 70}, {250, 70}, {250, 5}}};
  for (int k = 0; k < 4; ++k) {
    TrimCurve side;
    side.curve = line_segment<2>(corner[static_cast<std::size_t>(k)], corner[static_cast<std::size_t>((k + 1) % 4)]);
    side.index = k;
    notch.curves.push_back(side);
  }
  face.loops.push_back(notch);
  if (backwards) {
    for (TrimCurve& c : face.loops[0].curves) c.curve = reversed(c.curve), c.reversed = true;
  }
  return face;
}

TEST(Places, ACurveCutInTwoIsReachedWhole) {
  const Folder folder("pieces");
  const Build b = built(folder, notched_sheet(), test::scene_text("[[pin]]\nat = \"curve:0,0\"\n"));
  ASSERT_EQ(std::ranges::count(b.panels[0].face.loops[0].curves, 0, &TrimCurve::index), 2);
  const auto system = assemble(b, 0);
  int left = 0, right = 0;
  for (const PlaceRow& row : system->projection->rows().place) {
    const Eigen::Vector3d at = row.target(0);
    expect_near_rel(at.y(), 0.02, 1e-9);
    if (at.x() < 0.15 + 1e-9) ++left;
    if (at.x() > 0.25 - 1e-9) ++right;
  }
  EXPECT_GE(left, 2);
  EXPECT_GE(right, 2);
  EXPECT_EQ(left + right, system->place_rows);
}

TEST(Places, FractionsOfACurveCutInTwoAreOfWhatIsLeftInTheFilesDirection) {
  struct Case {
    const char* range;
    double length, middle;  // m, of the part and of where it lies in x
  };
  for (const bool backwards : {false, true}) {
    for (const Case& c : {Case{"", 0.24, 0.2}, Case{",0,0.5", 0.12, 0.09}, Case{",0.5,1", 0.12, 0.31},
                          Case{",0.25,0.75", 0.12, 0.2}, Case{",0.75,1", 0.06, 0.34}}) {
      const Folder folder("pieces_load");
      const Build b = built(
          folder, notched_sheet(backwards),
          test::scene_text(std::string("[[traction]]\nalong = \"curve:0,0") + c.range + "\"\nforce = [0, -2, 0]\n",
                           "[load]\ngravity = [0, 0, 0]\n"));
      double force = 0, moment = 0;
      for (int i = 0; i < b.model->point_count(); ++i) {
        force += b.loads.force[3 * i + 1];
        moment += b.start[3 * i] * b.loads.force[3 * i + 1];
      }
      expect_near_rel(force, -2 * c.length, 1e-10);
      expect_near_rel(moment / force, backwards ? 0.4 - c.middle : c.middle, 1e-10);
    }
  }
}

TEST(Places, CurvePinRowsAreIndependent) {
  const Folder folder("rank");
  const Build b = built(folder, test::trimmed_sheet("cloth"), test::scene_text("[[pin]]\nat = \"curve:0,2\"\n"));
  const auto system = assemble(b, 0);
  const auto& rows = system->projection->rows().place;
  ASSERT_GE(rows.size(), 4u);
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(rows.size()), system->map->nodes());
  const Eigen::MatrixXd free = system->map->free_part();
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (std::size_t k = 0; k < rows[r].row.index.size(); ++k) {
      dense.row(static_cast<Eigen::Index>(r)) += rows[r].row.value[k] * free.row(rows[r].row.index[k]);
    }
    dense.row(static_cast<Eigen::Index>(r)).array() /= system->dynamic.node_mass.transpose().array().sqrt();
    dense.row(static_cast<Eigen::Index>(r)).normalize();
  }
  const Eigen::MatrixXd gram = dense * dense.transpose();
  const Eigen::LLT<Eigen::MatrixXd> factor(gram);
  ASSERT_EQ(factor.info(), Eigen::Success);
  EXPECT_GT(factor.rcond(), 1e-2);
}

TEST(Places, AlongACurveAPointStandsInEverySpan) {
  const Folder folder("spans");
  TrimmedSurface face = test::sheet("cloth");
  face.natural_bounds = false;
  TrimLoop loop;  // curve 2 runs from (300, 320) to (60, 320): three spans of 80 mm along a knot line
  const Eigen::Vector2d corners[] = {{60, 100}, {300, 100}, {300, 320}, {60, 320}};
  for (int k = 0; k < 4; ++k) loop.curves.push_back({line_segment<2>(corners[k], corners[(k + 1) % 4]), k, false, {}});
  face.loops = {loop};
  const Build b = built(folder, face, test::scene_text("[[pin]]\nat = \"curve:0,2\"\n"));
  const auto system = assemble(b, 0);
  std::vector<double> x;
  for (const PlaceRow& row : system->projection->rows().place) x.push_back(row.target(0).x());
  std::ranges::sort(x);
  ASSERT_EQ(x.size(), 4u);
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(x[k], 0.06 + 0.08 * k, 1e-12);
}

std::string scene_refusal(const Folder& folder, const std::string& text) {
  try {
    assemble(built(folder, test::sheet("cloth"), text), 0);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Places, PinsThatGoFartherThanTheClothReachesAreRefused) {
  const Folder folder("reach");
  const auto pulled = [&](const char* a, const char* b, double by, const std::string& limit = "") {
    std::string text = test::scene_text(std::string("[[pin]]\nat = \"") + a + "\"\n[[pin]]\nat = \"" + b +
                                        "\"\nmove = { translate = [" + std::to_string(by) + ", 0, 0], end = 0.05 }\n");
    if (!limit.empty()) text.replace(text.find("tolerance = 0.01"), 16, limit);
    return scene_refusal(folder, text);
  };
  // 0.4 m of cloth reaches 0.404 m.
  EXPECT_NE(pulled("edge:u0", "edge:u1", 0.006).find("m apart at t = "), std::string::npos);
  EXPECT_EQ(pulled("edge:u0", "edge:u1", 0.0035), "accepted");
  EXPECT_EQ(pulled("edge:u0", "edge:u1", 0.006, "mode = \"off\""), "accepted");
  EXPECT_EQ(pulled("edge:u0", "edge:u1", 0.006, "mode = \"band\"\nstretch = [0.02, 0.001]"), "accepted");
  EXPECT_EQ(pulled("edge:u0", "edge:u1", 0.006, "mode = \"band\"\ncompress = [0.02, 0.001]"), "accepted");
  EXPECT_NE(pulled("uv:160,200", "uv:240,200", 0.002).find("within the strain limit"), std::string::npos);
  EXPECT_EQ(pulled("uv:160,200", "uv:240,200", -0.02), "accepted");
  // Across the threads shear gives: from corner to corner they reach 0.8 m.
  EXPECT_EQ(pulled("corner:0,0", "corner:1,1", 0.1), "accepted");
  EXPECT_NE(pulled("corner:0,0", "corner:1,1", 0.4).find("apart"), std::string::npos);
}

TEST(Places, APlaceHeldTwiceIsSaid) {
  const Folder folder("twice");
  const auto with = [](const std::string& move) {
    return test::scene_text("[[pin]]\nat = \"uv:200,200\"\n[[pin]]\nat = \"uv:200,200.0001\"\n" + move);
  };
  const auto system = assemble(built(folder, test::sheet("cloth"), with("")), 0);
  ASSERT_EQ(system->warnings.size(), 1u);
  EXPECT_NE(system->warnings[0].find("hold the same control points"), std::string::npos) << system->warnings[0];
  EXPECT_NE(scene_refusal(folder, with("move = { translate = [0, 0, 0.01], end = 0.05 }\n")), "accepted");
  std::string free = with("move = { translate = [0, 0, 0.01], end = 0.05 }\n");
  free.replace(free.find("tolerance = 0.01"), 16, "mode = \"off\"");
  EXPECT_NE(scene_refusal(folder, free).find("one of them moves"), std::string::npos);
}

}  // namespace
}  // namespace toile
