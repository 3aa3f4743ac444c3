// SPDX-License-Identifier: GPL-3.0-or-later
// Faces of every kind: their corpus files were made so that areas and places are known in closed form.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "geometry/error.h"
#include "geometry/measure.h"
#include "io/iges_corpus.h"
#include "support/near.h"
#include "trimming/loops.h"
#include "trimming/quadrature.h"
#include "trimming/topology.h"

namespace toile {
namespace {

using test::has_warning;
using test::message_of;
using test::read_corpus;
constexpr double pi = std::numbers::pi;

double area(TrimmedSurface panel) {
  validate_loops(panel);
  return measure(panel, trace_trims(panel)).area;
}

std::vector<double> areas(const char* name) {
  std::vector<double> out;
  for (const TrimmedSurface& panel : read_corpus(name).panels) out.push_back(area(panel));
  return out;
}

const LedgerEntry& row(const PanelFile& file, int type) {
  return *std::find_if(file.ledger.begin(), file.ledger.end(), [&](const LedgerEntry& e) { return e.type == type; });
}

TEST(IgesFaces, APlaneTakesTheRectangleOfItsBoundary) {
  const PanelFile file = read_corpus("bounded_141_planes");
  ASSERT_EQ(file.panels.size(), 1u);
  const TrimmedSurface& panel = file.panels[0];
  ASSERT_EQ(panel.loops.size(), 2u);  // the hole stands first in the file
  EXPECT_EQ(panel.loops[0].kind, LoopKind::outer);
  expect_near_rel(area(panel), 100 * 100 - 20 * 20, 1e-13);
  // The face's matrix: the plane z = 5 turned about x.
  EXPECT_LE((panel.surface(0, 0) - Eigen::Vector3d(10, 20 - 0.6 * 5, 30 + 0.8 * 5)).norm(), 1e-13);
  EXPECT_EQ(row(file, 108).disposition, Disposition::converted);
  EXPECT_EQ(row(file, 141).disposition, Disposition::converted);
  EXPECT_EQ(row(file, 143).disposition, Disposition::read);
}

TEST(IgesFaces, PreferencesOf141DontMatterWhereBothCurvesAgree) {
  const PanelFile file = read_corpus("preferences_141");
  ASSERT_EQ(file.panels.size(), 4u);
  for (const TrimmedSurface& panel : file.panels) {
    EXPECT_EQ(panel.loops[0].curves[1].curve.start(), Eigen::Vector2d(0.9, 0.1));
    EXPECT_EQ(panel.loops[0].curves[1].curve.degree(), 1);
  }
  EXPECT_TRUE(file.warnings.empty()) << file.warnings[0];
}

// The text with every `old` replaced by as many characters: parameters stand in columns.
std::string replaced(std::string text, const std::string& old, const std::string& by) {
  EXPECT_EQ(old.size(), by.size());
  std::size_t count = 0;
  for (std::size_t at = text.find(old); at != std::string::npos; at = text.find(old, at + by.size()), ++count)
    text.replace(at, old.size(), by);
  EXPECT_GT(count, 0u) << old;
  return text;
}

TEST(IgesFaces, CurvesThatPartALittleAreTakenAsTheBoundaryPrefers) {
  // Parameter curves around [20, 90] mm squared on a plane of 100 mm, model curves that start half a millimetre
  // further.
  const std::string apart = replaced(test::corpus_text("disagreeing_curves"), "10.0,", "20.5,");
  const auto of = [](const std::string& text) { return parse_iges(text, "apart.igs"); };
  const PanelFile preferred = of(apart);
  ASSERT_EQ(preferred.panels.size(), 1u);
  expect_near_rel(area(preferred.panels[0]), 70.0 * 70, 1e-12);
  EXPECT_TRUE(has_warning(preferred, "0.7071067811865476 from its model curves; the boundary prefers the parameter"));
  for (const char* preference : {"0", "2", "3"}) {
    const PanelFile file = of(replaced(apart, "142,0,1,11,21,1;", std::string("142,0,1,11,21,") + preference + ";"));
    expect_near_rel(area(file.panels.at(0)), 69.5 * 69.5, 1e-12);
    EXPECT_TRUE(has_warning(file, "pulled back")) << preference;
  }
  // Further apart than a hundredth of the surface's size they aren't one trim, whatever is preferred.
  const PanelFile far = of(replaced(apart, "20.5,", "22.0,"));
  expect_near_rel(area(far.panels.at(0)), 68.0 * 68, 1e-12);
}

TEST(IgesFaces, A141CountsItsPreferencesTheOtherWay) {
  std::string text = replaced(test::corpus_text("preferences_141"), "110,0.1,", "110,.11,");
  text = replaced(text, ",0.0,0.1,", ",0.0,.11,");  // parameter curves a millimetre from the model curves
  const PanelFile file = parse_iges(text, "apart_141.igs");
  ASSERT_EQ(file.panels.size(), 4u);
  for (std::size_t preference = 0; preference < 4; ++preference) {
    const double u = file.panels[preference].loops[0].curves[0].curve.start().x();
    EXPECT_NEAR(u, preference == 2 ? 0.11 : 0.1, 1e-6) << preference;
  }
}

TEST(IgesFaces, LoopsBesideEachOtherAreAPanelEach) {
  const std::vector<double> found = areas("several_outer_loops");
  ASSERT_EQ(found.size(), 3u);  // the island in the hole is one too
  expect_near_rel(found[0], 4000 * 0.9, 1e-13);
  expect_near_rel(found[1], 4000 * 0.9 - 3000 * 0.8, 1e-13);
  expect_near_rel(found[2], 1000 * 0.4, 1e-13);
  EXPECT_TRUE(has_warning(read_corpus("several_outer_loops"), "3 loops lie beside each other"));
  expect_near_rel(areas("outer_within_hole").at(0), 6400 - 1600, 1e-13);
}

TEST(IgesFaces, ASolidGivesItsFacesWhereItsMatrixPutsThem) {
  const PanelFile file = read_corpus("solid_186");
  ASSERT_EQ(file.panels.size(), 4u);
  expect_near_rel(area(file.panels[0]), 30 * 40 / 2.0, 1e-13);
  expect_near_rel(area(file.panels[1]), 30 * 50 / 2.0, 1e-13);
  expect_near_rel(area(file.panels[2]), 40 * 50 / 2.0, 1e-13);
  const Eigen::Vector3d a(30, 0, 0), b(0, 40, 0), c(0, 0, 50);
  expect_near_rel(area(file.panels[3]), (b - a).cross(c - a).norm() / 2, 1e-13);
  EXPECT_NEAR(file.panels[0].surface.points()(2, 0), 3, 1e-13);  // moved by (1, 2, 3)
  for (const int type : {186, 502, 504, 508, 510, 514, 190})
    EXPECT_NE(row(file, type).disposition, Disposition::kept) << type;
}

TEST(IgesFaces, ACylinderIsWholeWhateverItsParametersCount) {
  for (const char* name :
       {"cylinder_192_degrees", "cylinder_192_radians", "cylinder_192_model_only", "cylinder_no_seam"}) {
    SCOPED_TRACE(name);
    expect_near_rel(areas(name).at(0), 2 * pi * 20 * 60, 1e-9);
  }
  EXPECT_TRUE(has_warning(read_corpus("cylinder_no_seam"), "joined across its seam"));
}

TEST(IgesFaces, ALoopOverTheSeamUnrollsTheSurface) {
  expect_near_rel(areas("cylinder_across_seam").at(0), 20 * (80 * pi / 180) * 50, 1e-9);
  const PanelFile file = read_corpus("closed_128");
  ASSERT_EQ(file.panels.size(), 3u);
  for (const TrimmedSurface& panel : file.panels) {
    // A quarter between the middles of two quarters, wherever it stands: by symmetry as large as a quarter.
    expect_near_rel(area(panel), 20 * pi / 2 * 48, 1e-9);
    EXPECT_LE(panel.loops[0].gap, 1e-12);
  }
  EXPECT_TRUE(has_warning(file, "is moved by -4."));
  EXPECT_TRUE(has_warning(file, "crosses the seam"));
}

TEST(IgesFaces, ConesSpheresAndToriAreExact) {
  const double r0 = 30, r1 = 30 + 20 / std::sqrt(3), slant = 20 / std::cos(pi / 6);
  expect_near_rel(areas("cone_194").at(0), pi / 4 * (r0 + r1) * slant, 1e-9);
  expect_near_rel(areas("sphere_cap").at(0), 2 * pi * 50 * 20, 1e-8);
  const NurbsSurface torus = read_corpus("torus_198").panels[0].surface;
  for (double u : {0.1, 2.0, 5.0})
    for (double v : {0.3, 3.0, 6.0}) {
      const Eigen::Vector3d x = torus(u, v);
      EXPECT_NEAR(std::hypot(std::hypot(x.x(), x.y()) - 50, x.z()), 10, 1e-12);
    }
}

TEST(IgesFaces, ParameterCurvesAreCarriedAlongOntoATorus) {
  // The file's loop joins angles by straight lines; the carried curves must draw the same points.
  const TrimmedSurface panel = read_corpus("torus_198").panels[0];
  const std::vector<Eigen::Vector2d> corners{{.3, .2}, {1.2, .3}, {1.3, 1.1}, {.2, 1.2}};
  for (std::size_t k = 0; k < 4; ++k) {
    const Curve2& c = panel.loops[0].curves[k].curve;
    for (double t : {0.0, 0.21, 0.5, 0.83, 1.0}) {
      const Eigen::Vector2d p = (1 - t) * corners[k] + t * corners[(k + 1) % 4];
      const Eigen::Vector3d there((50 + 10 * std::cos(p.y())) * std::cos(p.x()),
                                  (50 + 10 * std::cos(p.y())) * std::sin(p.x()), 10 * std::sin(p.y()));
      const Eigen::Vector2d q = c(t);
      EXPECT_LE((panel.surface(q.x(), q.y()) - there).norm(), 1e-6) << k << " " << t;
    }
  }
}

TEST(IgesFaces, FreeSweptSurfacesArePanels) {
  const PanelFile file = read_corpus("swept_surfaces");
  ASSERT_EQ(file.panels.size(), 5u);
  // A ruling between two lines: the bilinear surface of their ends.
  const NurbsSurface& ruled = file.panels[0].surface;
  EXPECT_LE((ruled(0.25, 0.5) - Eigen::Vector3d(27.5, 26.25, 6.25)).norm(), 1e-13);
  const double slant = std::hypot(10, 50);
  expect_near_rel(surface_area(file.panels[1].surface), pi / 4 * (30 + 40) * slant, 1e-9);
  expect_near_rel(surface_area(file.panels[2].surface), 30 * pi / 2 * 80, 1e-9);
  for (double u : {0.0, 0.3, 1.0})
    for (double v : {0.0, 0.7, 2.0})
      EXPECT_LE((file.panels[3].surface(u, v) - Eigen::Vector3d(600 + 50 * u, 40 * v, 5 * u * u + 3 * u * v)).norm(),
                1e-12);
  const NurbsSurface& offset = file.panels[4].surface;
  for (double u : {0.0, 0.4, 0.9})
    for (double v : {0.1, 0.8}) {
      const Eigen::Vector3d x = offset(u, v);
      EXPECT_NEAR(std::hypot(x.x() - 800, x.y()), 35, 1e-5);  // the resolution of the file
    }
  EXPECT_NE(row(file, 140).why.find("off by"), std::string::npos);
}

TEST(IgesFaces, TrimsFollowAnglesOntoSweptArcs) {
  const PanelFile file = read_corpus("trimmed_swept");
  ASSERT_EQ(file.panels.size(), 3u);
  const auto corner = [&](std::size_t panel, std::size_t k) {
    const TrimmedSurface& p = file.panels[panel];
    const Eigen::Vector2d uv = p.loops[0].curves[k].curve.start();
    return p.surface(uv.x(), uv.y());
  };
  // A tabulated cylinder counts 0 to 1 along the arc's angle.
  const double a = 0.9 * pi / 2;
  EXPECT_LE((corner(0, 1) - Eigen::Vector3d(30 * std::cos(a), 30 * std::sin(a), 8)).norm(), 1e-12);
  // An arc revolved about the y axis: the generatrix' own angle, then the angle about the axis.
  const double r = 80 + 20 * std::cos(0.3);
  EXPECT_LE((corner(1, 0) - Eigen::Vector3d(r * std::cos(0.2), 20 * std::sin(0.3), -r * std::sin(0.2))).norm(), 1e-12);
  // A line of one unit of parameter, then an arc of pi / 2.
  const double at = 0.9 * (1 + pi / 2) - 1, angle = 3 * pi / 2 + at;
  EXPECT_LE((corner(2, 1) - Eigen::Vector3d(240 + 10 * std::cos(angle), 10 + 10 * std::sin(angle), 6)).norm(), 1e-12);
}

TEST(IgesFaces, RulingsByArcLengthAreFittedWithTheirError) {
  const PanelFile file = read_corpus("ruled_by_length");
  const NurbsSurface& s = file.panels[0].surface;
  // Half the parabola's length is its apex; the line's is its middle.
  EXPECT_LE((s(0.5, 0) - Eigen::Vector3d(50, 20, 0)).norm(), 1e-5);
  EXPECT_LE((s(0.3, 1) - Eigen::Vector3d(30, 0, 60)).norm(), 1e-5);
  EXPECT_TRUE(has_warning(file, "off by"));
}

TEST(IgesFaces, ARuledSurfaceBetweenUnlikeWeightsIsExact) {
  const PanelFile file = read_corpus("ruled_unlike_weights");
  const NurbsSurface& s = file.panels.at(0).surface;
  const double h = std::sqrt(0.5);
  Eigen::Matrix3Xd arc(3, 3), wave(3, 4);
  arc << 100, 100, 0, 0, 100, 100, 0, 0, 0;
  wave << 120, 90, 60, 0, 0, 40, 90, 130, 50, 60, 40, 50;
  const Curve3 a(KnotVector(2, {0, 0, 0, 1, 1, 1}), arc, {1, h, 1});
  const Curve3 b(KnotVector(2, {0, 0, 0, 0.4, 1, 1, 1}), wave, {1, 2, 0.5, 1});
  for (const double u : {0.0, 0.1, 0.39, 0.4, 0.7, 1.0})
    for (const double v : {0.0, 0.25, 1.0})
      EXPECT_LE((s(u, v) - ((1 - v) * a(u) + v * b(u))).norm(), 1e-12) << u << ' ' << v;
  EXPECT_EQ(row(file, 118).why.find("off by"), std::string::npos);
}

TEST(IgesFaces, ModelCurvesOnACurvedSurfaceArePulledBackOntoTheirKnotLines) {
  const PanelFile file = read_corpus("model_curves_on_curved");
  const TrimLoop& loop = file.panels[0].loops[0];
  ASSERT_EQ(loop.curves.size(), 4u);
  const std::vector<Eigen::Vector2d> corners{{0, 0}, {.75, 0}, {.75, .625}, {0, .625}};
  for (std::size_t k = 0; k < 4; ++k) {
    const TrimCurve& c = loop.curves[k];
    const Eigen::Vector2d start = c.reversed ? c.curve.end() : c.curve.start();
    EXPECT_LE((start - corners[k]).norm(), 1e-9) << k;
    EXPECT_EQ(c.curve.degree(), 1);
  }
  EXPECT_EQ(loop.curves[0].curve.start().y(), 0);  // bitwise on the border
  EXPECT_EQ(loop.curves[3].curve.start().x(), 0);
  EXPECT_TRUE(has_warning(file, "pulled back"));
}

TEST(IgesFaces, CountsPointersAndPlacesThatContradictAreSettledAndSaid) {
  expect_near_rel(areas("mismatched_counts").at(0), 6400, 1e-13);
  EXPECT_TRUE(has_warning(read_corpus("mismatched_counts"), "1 parameter curves and 4 model curves"));
  expect_near_rel(areas("same_pointer").at(0), 6400, 1e-12);
  // Model curves that lie on the surface outweigh parameter curves that draw something else.
  expect_near_rel(areas("disagreeing_curves").at(0), 6400, 1e-12);
  EXPECT_TRUE(has_warning(read_corpus("disagreeing_curves"), "from its model curves"));
  expect_near_rel(areas("clockwise").at(0), 6400, 1e-13);
  expect_near_rel(areas("gaps_and_excursions").at(0), 9000 * 0.8, 1e-3);
}

TEST(IgesFaces, OpenLoopsAreRefusedWithTheirPlace) {
  const PanelFile file = read_corpus("broken/open_loop");
  ASSERT_EQ(file.panels.size(), 2u);
  EXPECT_TRUE(has_warning(file, "its parameter curves don't close: gap"));
  TrimmedSurface open = file.panels[1];
  const std::string message = message_of<GeometryError>([&] { validate_loops(open); });
  EXPECT_NE(message.find("panel 'OPEN', loop 0, curve 0: the loop is open"), std::string::npos) << message;
}

TEST(IgesFaces, LoopsReachIntoACollapsedEdge) {
  const std::vector<double> found = areas("collapsed_edge");
  ASSERT_EQ(found.size(), 2u);
  const double whole = 100 * std::hypot(80, 10) / 2;
  expect_near_rel(found[0], whole * 0.8 * 0.81, 1e-9);
  expect_near_rel(found[1], whole, 1e-6);
}

// A plane whose holes alone are given: nothing says where it ends.
TEST(IgesFaces, ASurfaceWithoutEndNeedsAnOuterBoundary) {
  const std::string plane = test::with_entities(
      test::corpus_text("natural_144"),
      {"108,0.,0.,1.,5.,0,0.,0.,0.,0.;", "110,1.,1.,5.,2.,1.,5.;", "110,2.,1.,5.,1.,2.,5.;", "110,1.,2.,5.,1.,1.,5.;"});
  const auto last = 2 * static_cast<int>(read_corpus("natural_144").ledger.size()) - 1;
  const auto number = [&](int k) { return std::to_string(last + 2 * k); };
  const std::string with_face = test::with_entities(
      plane, {"102,3," + number(2) + "," + number(3) + "," + number(4) + ";",
              "142,0," + number(1) + ",0," + number(5) + ",2;", "144," + number(1) + ",1,1,0," + number(6) + ";"});
  const PanelFile file = parse_iges(with_face, "plane.igs");
  EXPECT_EQ(file.panels.size(), read_corpus("natural_144").panels.size());
  EXPECT_TRUE(has_warning(file, "has no border of its own")) << testing::PrintToString(file.warnings);
}

// But a plane may name its own border.
TEST(IgesFaces, APlanesOwnBorderBoundsAFaceThatNamesNone) {
  const auto last = 2 * static_cast<int>(read_corpus("natural_144").ledger.size()) - 1;
  const auto number = [&](int k) { return std::to_string(last + 2 * k); };
  const std::string text = test::with_entities(
      test::corpus_text("natural_144"),
      {"100,5.,1.5,1.5,11.5,1.5,11.5,1.5;", "108,0.,0.,1.,5.," + number(1) + ",0.,0.,0.,0.;", "110,1.,1.,5.,2.,1.,5.;",
       "110,2.,1.,5.,1.,2.,5.;", "110,1.,2.,5.,1.,1.,5.;",
       "102,3," + number(3) + "," + number(4) + "," + number(5) + ";", "142,0," + number(2) + ",0," + number(6) + ",2;",
       "144," + number(2) + ",1,1,0," + number(7) + ";"});
  const PanelFile file = parse_iges(text, "plane.igs");
  ASSERT_EQ(file.panels.size(), read_corpus("natural_144").panels.size() + 1);
  expect_near_rel(area(file.panels.back()), 100 * std::acos(-1.0) - 0.5, 1e-12);
}

// SolidWorks leaves out the side of a face where its surface is one point.
TEST(IgesFaces, ASideThatIsAPointMayBeLeftOut) {
  std::string text = test::corpus_text("collapsed_edge");
  const std::string all = "102,4,3,5,7,9;";
  text.replace(text.find(all), all.size(), "102,3,3,5,9;  ");
  const PanelFile file = parse_iges(text, "three_sides.igs");
  ASSERT_EQ(file.panels.size(), 2u);
  expect_near_rel(area(file.panels[0]), areas("collapsed_edge").at(0), 1e-13);
}

TEST(IgesFaces, InstancesAreScaledTurnedAndNested) {
  const PanelFile file = read_corpus("instances_and_groups");
  ASSERT_EQ(file.panels.size(), 2u);
  expect_near_rel(area(file.panels[0]), 6400, 1e-12);  // half, then double
  // x -> 0.5 x + (1, 2, 3) -> 2 x + (10, 20, 30) -> a quarter turn and (0, 0, 7)
  EXPECT_LE((file.panels[0].surface(1, 0) - Eigen::Vector3d(-24, 112, 43)).norm(), 1e-12);
  EXPECT_LE((file.panels[1].surface(1, 0) - Eigen::Vector3d(600, 0, 0)).norm(), 1e-12);
  EXPECT_EQ(row(file, 308).disposition, Disposition::read);
  EXPECT_EQ(row(file, 408).disposition, Disposition::read);
  EXPECT_EQ(row(file, 402).disposition, Disposition::read);
}

TEST(IgesFaces, AnOffsetCurveIsFittedInItsBoundary) {
  const PanelFile file = read_corpus("offset_curve_130");
  EXPECT_LE(file.panels[0].loops[0].gap, 1e-12);
  EXPECT_NE(row(file, 130).why.find("off by"), std::string::npos);
}

// An edge that bulges by a tenth in its middle: offset of a line by a function of the parameter, and of the length.
TEST(IgesFaces, AnOffsetFollowsItsFunction) {
  const std::vector<double> area = areas("function_offset_130");
  ASSERT_EQ(area.size(), 2u);
  for (const double a : area) expect_near_rel(a, 100 * 100 * (0.36 - 0.5 * 0.6 * 0.1), 1e-9);
  EXPECT_EQ(read_corpus("function_offset_130").warnings.size(), 0u);
}

// Places along the curve where the function has a kink are solved for; what misses an end by rounding is that end.
TEST(IgesFaces, AnOffsetHasNoSpansOfRounding) {
  for (const TrimmedSurface& panel : read_corpus("function_offset_130").panels)
    for (const TrimCurve& c : panel.loops[0].curves) {
      const std::vector<double> breaks = c.curve.knots().breaks();
      for (std::size_t k = 0; k + 1 < breaks.size(); ++k) EXPECT_GT(breaks[k + 1] - breaks[k], 1e-9) << panel.name;
    }
}

// The generatrix is an arc from 300 degrees; the exporter counts it from 0, and its model curves say so.
TEST(IgesFaces, ParametersCountAsTheModelCurvesSay) {
  const PanelFile file = read_corpus("revolution_from_arc_start");
  ASSERT_EQ(file.panels.size(), 1u);
  EXPECT_TRUE(has_warning(file, "a reading under which they lie on its model curves is taken"));
  // A zone of the sphere between the latitudes -30 and 45 degrees, 1.5 rad wide.
  expect_near_rel(area(file.panels[0]), 10 * (10 * std::sin(pi / 4) + 10 * 0.5) * 1.5, 1e-9);
}

TEST(IgesFaces, WholeSpheresAndToriBoundThemselves) {
  const std::vector<double> found = areas("sphere_and_torus");
  ASSERT_EQ(found.size(), 2u);
  expect_near_rel(found[0], 4 * pi * 21 * 21, 1e-9);
  expect_near_rel(found[1], 4 * pi * pi * 30 * 8, 1e-9);
}

TEST(IgesFaces, MoreThanATurnIsOne) {
  const std::vector<double> found = areas("revolution_beyond_a_turn");
  ASSERT_EQ(found.size(), 2u);
  expect_near_rel(found[0], 2 * pi * 30 * 50, 1e-9);
  expect_near_rel(found[1], 30 * 50 * 0.6 * 2, 1e-9);  // trimmed where the second turn would be
}

TEST(IgesFaces, OneBoundaryMayHoldBothEndsOfATube) {
  expect_near_rel(areas("tube_of_two_circles").at(0), 2 * pi * 10 * 20, 1e-9);
  EXPECT_TRUE(has_warning(read_corpus("tube_of_two_circles"), "holds 2 closed chains"));
}

TEST(IgesFaces, PatchesMayPartByLessThanTheFileResolves) {
  expect_near_rel(areas("spline_114_gap").at(0), 2, 1e-9);
  std::string finer = test::corpus_text("spline_114_gap");
  finer.replace(finer.find("1.E-04"), 6, "1.E-09");
  const std::string refusal = message_of<InputError>([&] { parse_iges(finer, "finer.igs"); });
  EXPECT_NE(refusal.find("a gap of 4"), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("must be at most"), std::string::npos) << refusal;
}

TEST(IgesFaces, IdleControlPointsOfSurplusKnotsAreLeftOut) {
  const PanelFile file = read_corpus("surplus_knots");
  const NurbsSurface& s = file.panels[0].surface;
  EXPECT_EQ(s.u(), KnotVector(1, {0, 0, 0.5, 1, 1}));
  EXPECT_LE((s(0.25, 0) - Eigen::Vector3d(25, 0, 0)).norm(), 1e-14);
  EXPECT_EQ(file.panels[0].loops[0].curves[0].curve.points().cols(), 3);
  expect_near_rel(area(file.panels[0]), 80 * 40 + 80 * 0.8 * std::hypot(50, 5), 1e-12);
  EXPECT_TRUE(has_warning(file, "entity 128: a knot occurs more often than the degree"));
}

// Found by mutation: a line that swallowed the next one gives an entry a record of another type.
TEST(IgesFaces, ARecordOfAnotherTypeIsQuarantinedAndStaysSoWhenRewritten) {
  const PanelFile file = read_corpus("record_of_another_type");
  EXPECT_EQ(file.panels.size(), 2u);
  EXPECT_TRUE(has_warning(file, "the parameter record says '102', must be 142"));
  EXPECT_TRUE(roundtrip(file, IgesMode::rewrite).exact());
}

TEST(IgesFaces, JunkInFieldsThatNobodyNeedsDoesNoHarm) {
  expect_near_rel(areas("junk_fields").at(0), 6400, 1e-13);
}

TEST(IgesFaces, HolesInADomainThatBoundsItself) {
  expect_near_rel(areas("natural_with_hole").at(0), 10000 - 1600, 1e-13);
}

}  // namespace
}  // namespace toile
