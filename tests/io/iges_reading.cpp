// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <set>

#include "geometry/error.h"
#include "geometry/measure.h"
#include "io/iges_corpus.h"
#include "support/near.h"

namespace toile {
namespace {

using test::has_warning;
using test::message_of;
using test::read_corpus;

TEST(IgesReading, EveryFileOfTheCorpusHasPanels) {
  const std::vector<std::string> names = test::corpus_names();
  ASSERT_GE(names.size(), 20u);
  for (const std::string& name : names) {
    SCOPED_TRACE(name);
    const PanelFile file = read_corpus(name);
    ASSERT_FALSE(file.panels.empty());
    for (const TrimmedSurface& panel : file.panels) {
      EXPECT_FALSE(panel.name.empty());
      ASSERT_FALSE(panel.loops.empty());
      EXPECT_EQ(panel.loops[0].kind, LoopKind::outer);
      for (std::size_t l = 0; l < panel.loops.size(); ++l) {
        EXPECT_EQ(panel.loops[l].index, static_cast<int>(l));
        std::set<int> numbers;
        for (const TrimCurve& c : panel.loops[l].curves) numbers.insert(c.index);
        ASSERT_EQ(numbers.size(), panel.loops[l].curves.size());
        EXPECT_EQ(*numbers.begin(), 0);
        EXPECT_EQ(*numbers.rbegin(), static_cast<int>(numbers.size()) - 1);
        EXPECT_LE(panel.loops[l].gap, name == "gaps_and_excursions" ? 1e-3 : 1e-12);
      }
    }
  }
}

TEST(IgesReading, CompositesAreFlattenedInFileOrder) {
  const PanelFile file = read_corpus("hole_and_composite");
  ASSERT_EQ(file.panels.size(), 1u);
  const TrimmedSurface& panel = file.panels[0];
  ASSERT_EQ(panel.loops.size(), 2u);
  ASSERT_EQ(panel.loops[0].curves.size(), 5u);
  EXPECT_EQ(panel.loops[0].curves[0].curve.start(), Eigen::Vector2d(0.1, 0.1));
  EXPECT_EQ(panel.loops[0].curves[1].curve.degree(), 2);
  EXPECT_EQ(panel.loops[0].curves[3].curve.degree(), 3);
  EXPECT_EQ(panel.loops[1].kind, LoopKind::hole);
  ASSERT_EQ(panel.loops[1].curves.size(), 1u);
  EXPECT_TRUE(panel.loops[1].curves[0].curve.rational());
  EXPECT_FALSE(panel.natural_bounds);
}

TEST(IgesReading, ArcsKeepTheirEndsBitForBitAndTheirRadius) {
  const Curve2 arc = read_corpus("hole_and_composite").panels[0].loops[0].curves[2].curve;
  EXPECT_EQ(arc.start(), Eigen::Vector2d(0.9, 0.8));
  EXPECT_EQ(arc.end(), Eigen::Vector2d(0.8, 0.9));
  for (double f : {0.1, 0.4, 0.8}) {
    const Interval t = arc.domain();
    expect_near_rel((arc(t.min + f * t.length()) - Eigen::Vector2d(0.8, 0.8)).norm(), 0.1, 1e-14);
  }
}

TEST(IgesReading, NamesColoursAndGroupsAreKnown) {
  const PanelFile file = read_corpus("hole_and_composite");
  EXPECT_EQ(file.panels[0].name, "front; left, 1");
  EXPECT_TRUE(file.warnings.empty()) << file.warnings[0];
  EXPECT_EQ(file.entities.at(314), 1);
  EXPECT_EQ(file.entities.at(402), 1);
  EXPECT_EQ(read_corpus("rational").panels[0].name, "SLEEVE2");  // label and subscript of the directory
  const PanelFile twins = read_corpus("two_panels_units_m");     // two panels, one label
  EXPECT_EQ(twins.panels[0].name, "panel_1");
  EXPECT_EQ(twins.panels[1].name, "panel_2");
}

TEST(IgesReading, UnitsGiveMetres) {
  EXPECT_EQ(read_corpus("hole_and_composite").metres_per_unit, 0.001);
  EXPECT_EQ(read_corpus("two_panels_units_m").metres_per_unit, 1);
  EXPECT_EQ(read_corpus("unit_by_name").metres_per_unit, 0.01);
  const PanelFile inch = read_corpus("inch_and_scale");
  EXPECT_EQ(inch.unit, "INCH");
  EXPECT_EQ(inch.metres_per_unit, 0.0254 / 0.5);  // the model is half the garment's size
  EXPECT_EQ(inch.panels[0].metres_per_unit, inch.metres_per_unit);
}

TEST(IgesReading, AbsentUnitIsInches) {
  std::string text = test::corpus_text("short_global");
  const std::size_t at = text.find(",2,2HMM");
  ASSERT_NE(at, std::string::npos);
  text.replace(at, 7, ",,      ");
  text.erase(text.find("  ", at + 3), 1);
  const PanelFile file = parse_iges(text, "inches.igs");
  EXPECT_EQ(file.unit, "INCH");
  EXPECT_EQ(file.metres_per_unit, 0.0254);
  EXPECT_TRUE(has_warning(file, "inches"));
}

// Files that say the same in different clothes.
TEST(IgesReading, LineEndsDelimitersAndCountersDoNotMatter) {
  const TrimmedSurface plain = read_corpus("denied_outer").panels[0];
  for (const char* name : {"crlf", "cr_only", "no_line_breaks", "wrong_t", "delimiters", "hollerith_counts",
                           "short_global", "unknown_entities", "unit_by_name", "inch_and_scale", "quarantine"}) {
    SCOPED_TRACE(name);
    const TrimmedSurface other = read_corpus(name).panels[0];
    EXPECT_EQ(other.surface, plain.surface);
    ASSERT_EQ(other.loops.size(), plain.loops.size());
    ASSERT_EQ(other.loops[0].curves.size(), plain.loops[0].curves.size());
    for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(other.loops[0].curves[k].curve, plain.loops[0].curves[k].curve);
  }
  EXPECT_EQ(read_corpus("misaligned").panels[0].surface, read_corpus("hole_and_composite").panels[0].surface);
}

TEST(IgesReading, OdditiesAreReportedWithTheirLine) {
  EXPECT_TRUE(has_warning(read_corpus("wrong_t"), "wrong_t.igs:37: text after the terminate line"));
  EXPECT_TRUE(has_warning(read_corpus("wrong_t"), "counts in the terminate line"));
  EXPECT_TRUE(has_warning(read_corpus("misaligned"), "misaligned.igs:1: the section letter"));
  EXPECT_TRUE(has_warning(read_corpus("denied_outer"), "entity 144: N1 is 0"));
  EXPECT_TRUE(has_warning(read_corpus("hollerith_counts"), "entity 406: a string count is wrong"));
  EXPECT_EQ(read_corpus("hollerith_counts").panels[0].name, "na\xefve");
  EXPECT_EQ(read_corpus("delimiters").panels[0].name, "a/b#c,d;");
}

TEST(IgesReading, DExponentsAndDefaultsAreRead) {
  const PanelFile file = read_corpus("d_exponents_and_defaults");
  const NurbsSurface& s = file.panels[0].surface;
  const NurbsSurface plain = read_corpus("denied_outer").panels[0].surface;
  EXPECT_EQ(s.u(), plain.u());
  EXPECT_EQ(s.points().leftCols<12>(), plain.points().leftCols<12>());
  EXPECT_EQ(s.points()(0, 14), -5);  // "-.5d+1"
}

TEST(IgesReading, UnknownEntitiesAreKeptAndListedOncePerType) {
  const PanelFile file = read_corpus("unknown_entities");
  ASSERT_EQ(file.warnings.size(), 1u);
  EXPECT_EQ(file.warnings[0], "entity 212: 1 kept, not read");
  EXPECT_EQ(file.ledger[0].disposition, Disposition::kept);
  EXPECT_EQ(file.ledger[0].why, "no face uses it");  // a point
  EXPECT_EQ(file.ledger[3].type, 128);
  EXPECT_EQ(file.ledger[3].disposition, Disposition::read);
  EXPECT_EQ(file.ledger[4].disposition, Disposition::converted);  // a line as a B-spline curve
}

TEST(IgesReading, TransformationsNestAndApplyToSurfacesAndFaces) {
  const NurbsSurface plain = read_corpus("denied_outer").panels[0].surface;
  const NurbsSurface moved = read_corpus("transforms").panels[0].surface;
  // The surface: a quarter turn about z and (10, 20, 30), itself under a shift of 100 in x; the face: the shift again.
  Eigen::Affine3d turn = Eigen::Affine3d::Identity();
  turn.linear() << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  turn.translation() << 210, 20, 30;
  for (Eigen::Index i = 0; i < plain.points().cols(); ++i)
    EXPECT_LE((moved.points().col(i) - turn * plain.points().col(i)).norm(), 1e-12);
  EXPECT_EQ(moved.u(), plain.u());
}

TEST(IgesReading, AFaceWithoutLoopsHasItsNaturalLoop) {
  for (const char* name : {"natural_144", "unclamped", "missing_range"}) {
    SCOPED_TRACE(name);
    const TrimmedSurface panel = read_corpus(name).panels[0];
    EXPECT_TRUE(panel.natural_bounds);
    ASSERT_EQ(panel.loops[0].curves.size(), 4u);
    const Interval u = panel.surface.u().domain(), v = panel.surface.v().domain();
    EXPECT_EQ(panel.loops[0].curves[0].curve.start(), Eigen::Vector2d(u.min, v.min));
    EXPECT_EQ(panel.loops[0].curves[1].curve.start(), Eigen::Vector2d(u.max, v.min));
  }
  const KnotVector unclamped = read_corpus("unclamped").panels[0].surface.u();
  EXPECT_FALSE(unclamped.clamped());
  EXPECT_EQ(unclamped.domain().min, 0);
  EXPECT_EQ(unclamped.domain().max, 2);
}

TEST(IgesReading, AStatedPartOfTheDomainIsThatPart) {
  const NurbsSurface part = read_corpus("sub_range").panels[0].surface;
  const NurbsSurface whole = read_corpus("missing_range").panels[0].surface;
  EXPECT_EQ(part.u().domain().min, 0.25);
  EXPECT_EQ(part.u().domain().max, 0.75);
  EXPECT_EQ(part.v().domain().min, 0);
  EXPECT_EQ(part.v().domain().max, 0.4);
  for (double u : {0.25, 0.3, 0.5, 0.61, 0.75})
    for (double v : {0.0, 0.13, 0.4}) EXPECT_LE((part(u, v) - whole(u, v)).norm(), 1e-12 * 500);
}

TEST(IgesReading, ModelCurvesOnAFlatSurfaceArePulledBack) {
  const PanelFile file = read_corpus("model_curves_only");
  const TrimmedSurface& panel = file.panels[0];
  ASSERT_EQ(panel.loops[0].curves.size(), 4u);
  for (const TrimCurve& c : panel.loops[0].curves) {
    ASSERT_TRUE(c.model);
    for (double t : {0.0, 0.3, 1.0}) {
      const Eigen::Vector2d p = c.curve(t);
      EXPECT_LE((panel.surface(p.x(), p.y()) - (*c.model)(t)).norm(), 1e-12 * 500);
    }
  }
  EXPECT_TRUE(has_warning(file, "pulled back"));
}

TEST(IgesReading, OneBadFaceLeavesTheOthers) {
  const PanelFile file = read_corpus("quarantine");
  EXPECT_EQ(file.panels.size(), 1u);
  EXPECT_TRUE(has_warning(file, "entity 128: weight 7 is -0.5, must be positive"));
  const auto bad = std::count_if(file.ledger.begin(), file.ledger.end(),
                                 [](const LedgerEntry& e) { return e.disposition == Disposition::quarantined; });
  EXPECT_EQ(bad, 1);
}

TEST(IgesReading, ErrorsNameFileLineEntityAndWhatWasExpected) {
  auto error = [](const char* name) { return message_of<InputError>([&] { read_corpus(name); }); };
  EXPECT_EQ(error("broken/negative_weight"),
            "broken/negative_weight.igs:8: entity 128: weight 7 is -0.5, must be positive");
  EXPECT_EQ(error("broken/text_for_number"),
            "broken/text_for_number.igs:7: entity 128: knot 3 is 'zebra', must be a finite number");
  EXPECT_NE(error("broken/decreasing_knots").find("entity 128: knot 4 is 0.5"), std::string::npos);
  EXPECT_NE(error("broken/empty").find("empty"), std::string::npos);
  EXPECT_NE(error("broken/garbage").find("no IGES file"), std::string::npos);
}

TEST(IgesReading, ClaimedCountsAreRefusedBeforeAnythingIsAllocated) {
  for (const char* name : {"broken/huge_counts", "broken/huge_curve"})
    EXPECT_NE(message_of<InputError>([&] { read_corpus(name); }).find("1000000001"), std::string::npos) << name;
}

TEST(IgesReading, PointerCyclesEnd) {
  EXPECT_NE(message_of<InputError>([] { read_corpus("broken/composite_cycle"); }).find("cycle"), std::string::npos);
  EXPECT_NE(message_of<InputError>([] { read_corpus("broken/transform_cycle"); }).find("cycle"), std::string::npos);
  EXPECT_NE(message_of<InputError>([] { read_corpus("broken/composite_doubling"); }).find("repeats"),
            std::string::npos);
}

TEST(IgesReading, ALostPointerIsNamed) {
  EXPECT_TRUE(has_warning(read_corpus("broken/lost_pointer"), "entity 144: pointer 99 to its surface leads nowhere"));
}

}  // namespace
}  // namespace toile
