// SPDX-License-Identifier: GPL-3.0-or-later
// What a pattern draws on its panels survives the way through an IGES file with faces.
#include <gtest/gtest.h>

#include <cmath>

#include "io/iges_corpus.h"
#include "io/panel_facts.h"

namespace toile {
namespace {

// A patternmaker's panel: grain line, notches drawn and as a point, drill hole, inner line, words.
TrimmedSurface marked_panel() {
  TrimmedSurface face;
  const KnotVector knots = uniform_knots(2, 3, {0, 1});
  const int n = knots.control_point_count();
  Eigen::Matrix3Xd points(3, n * n);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) points.col(i + n * j) << 300 * knots.greville(i), 500 * knots.greville(j), 7;
  face.name = "front";
  face.surface = NurbsSurface(knots, knots, points);
  face.metres_per_unit = 0.001;
  TrimLoop loop;
  const Eigen::Vector2d corners[] = {{0.1, 0.1}, {0.9, 0.15}, {0.85, 0.9}, {0.1, 0.8}};
  for (int k = 0; k < 4; ++k) {
    loop.curves.push_back({line_segment<2>(corners[k], corners[(k + 1) % 4]), k, false, std::nullopt});
  }
  face.loops.push_back(loop);
  const auto along = [](double u0, double v0, double u1, double v1) { return line_segment<2>({u0, v0}, {u1, v1}); };
  face.marks = {{MarkKind::grain, {0.5, 0.2}, along(0.5, 0.2, 0.47, 0.8), ""},
                {MarkKind::notch, {0.1, 0.3}, along(0.1, 0.3, 0.12, 0.3), "V2"},
                {MarkKind::notch, {0.1, 0.6}, std::nullopt, ""},
                {MarkKind::drill, {1.0 / 3, 0.7}, std::nullopt, "dart: tip"},
                {MarkKind::line, {0.3, 0.4}, along(0.3, 0.4, 0.7, 0.45), "fold"},
                {MarkKind::text, {0.4, 0.5}, std::nullopt, "Vorderteil, cut 2; size 38"}};
  return face;
}

void expect_marks_come_back(const TrimmedSurface& face, const IgesMode mode) {
  const std::string text = format_iges(std::vector<OutputFace>{{face, "", 0, {}}}, IgesHeader{}).text;
  const PanelFile read = parse_iges(text, "marked.igs");
  const PanelFile back = parse_iges(format_iges(read, mode), "again.igs");
  ASSERT_EQ(back.panels.size(), 1u);
  const TrimmedSurface& panel = back.panels[0];
  EXPECT_EQ(panel.name, "front");
  ASSERT_EQ(panel.marks.size(), face.marks.size());
  for (std::size_t k = 0; k < face.marks.size(); ++k) {
    SCOPED_TRACE(k);
    const PanelMark &a = face.marks[k], &b = panel.marks[k];
    EXPECT_EQ(a.kind, b.kind);
    EXPECT_EQ(a.text, b.text);
    EXPECT_LE((a.at - b.at).norm(), 1e-9);
    ASSERT_EQ(a.curve.has_value(), b.curve.has_value());
    if (a.curve) {
      EXPECT_EQ(*a.curve, *b.curve);
    }
  }
  EXPECT_EQ(grain_angle(panel), grain_angle(face));
  for (const LedgerEntry& row : back.ledger) EXPECT_NE(row.disposition, Disposition::kept) << row.type;
  EXPECT_TRUE(roundtrip(back, IgesMode::rewrite).exact());
}

TEST(IgesMarks, OfAFlatPanelComeBack) {
  expect_marks_come_back(marked_panel(), IgesMode::replay);
  expect_marks_come_back(marked_panel(), IgesMode::rewrite);
}

TEST(IgesMarks, OfADrapedPanelComeBack) {
  TrimmedSurface face = marked_panel();
  Eigen::Matrix3Xd points = face.surface.points();
  for (Eigen::Index k = 0; k < points.cols(); ++k) points(2, k) += 40 * std::sin(points(0, k) / 70 + points(1, k) / 90);
  face.surface = face.surface.with_points(points);
  expect_marks_come_back(face, IgesMode::replay);
}

TEST(IgesMarks, OfAPanelWithoutATrimComeBack) {
  TrimmedSurface face = marked_panel();
  face.loops = {natural_loop(face.surface)};
  face.natural_bounds = true;
  expect_marks_come_back(face, IgesMode::replay);
}

// What outlines make of a drawing is the same after the way through faces.
TEST(IgesMarks, OfADrawingSurviveItsConversion) {
  const PanelFile drawing = test::read_corpus("outlines_only");
  std::vector<OutputFace> faces;
  for (const TrimmedSurface& panel : drawing.panels) faces.push_back({panel, panel.name, 0, {}});
  IgesHeader header;
  header.unit = drawing.unit;
  const PanelFile back = parse_iges(format_iges(faces, header).text, "faces.igs");
  ASSERT_EQ(back.panels.size(), drawing.panels.size());
  std::size_t marks = 0;
  for (std::size_t k = 0; k < back.panels.size(); ++k) {
    for (const MarkKind kind : {MarkKind::grain, MarkKind::notch, MarkKind::drill, MarkKind::line, MarkKind::text})
      EXPECT_EQ(test::count(back.panels[k], kind), test::count(drawing.panels[k], kind)) << k << name(kind);
    EXPECT_EQ(grain_angle(back.panels[k]).has_value(), grain_angle(drawing.panels[k]).has_value());
    marks += back.panels[k].marks.size();
  }
  EXPECT_GE(marks, 4u);
}

}  // namespace
}  // namespace toile
