// SPDX-License-Identifier: GPL-3.0-or-later
// Pattern pieces in DXF: exact outlines, marks by layer, errors with their line.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <sstream>

#include "geometry/error.h"
#include "io/dxf.h"
#include "io/file.h"
#include "io/panel_facts.h"
#include "support/flipped.h"
#include "support/near.h"

namespace toile {
namespace {

using Eigen::Vector2d;
using test::area;
using test::count;

std::string apron() {
  return read_file(std::filesystem::path(TOILE_SAMPLES) / "dxf_pieces" / "apron.dxf");
}

TEST(Dxf, PiecesArePanelsWithTheirNames) {
  const PanelFile file = parse_dxf(apron(), "apron.dxf");
  EXPECT_EQ(file.unit, "MM");
  ASSERT_EQ(file.panels.size(), 2u);
  EXPECT_EQ(file.panels[0].name, "FRONT");
  EXPECT_EQ(file.panels[1].name, "STRAP");
  EXPECT_TRUE(file.warnings.empty()) << file.warnings[0];
  // The boundary begins at the group code before the first word POLYLINE.
  const std::string text = apron();
  const auto line = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(text.find("POLYLINE")), '\n');
  EXPECT_EQ(file.panels[0].source, "apron.dxf:" + std::to_string(line));
}

TEST(Dxf, OutlinesKeepTheirNumbersAndBulgesAreArcs) {
  const TrimmedSurface front = parse_dxf(apron(), "apron.dxf").panels[0];
  ASSERT_EQ(front.loops.size(), 2u);
  // Six turn points: six curves, the hem one of them with all its nine points.
  ASSERT_EQ(front.loops[0].curves.size(), 6u);
  const Curve2& hem = front.loops[0].curves[1].curve;
  EXPECT_EQ(hem.points().cols(), 9);
  EXPECT_EQ(hem.points().col(4), Vector2d(200, -40));
  const Curve2& armhole = front.loops[0].curves[5].curve;
  EXPECT_EQ(armhole.start(), Vector2d(100, 500));
  EXPECT_EQ(armhole.end(), Vector2d(0, 300));
  // Area by the surveyor's formula on the corners, the circle's segment beside the armhole and the cutout.
  std::vector<Vector2d> corners{{0, 300}};
  for (int k = 0; k <= 8; ++k) corners.emplace_back(50 * k, -160 * (k / 8.0) * (1 - k / 8.0));
  for (const Vector2d& p : {Vector2d(400, 300), Vector2d(300, 500), Vector2d(100, 500)}) corners.push_back(p);
  double twice = 0;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vector2d a = corners[k], b = corners[(k + 1) % corners.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  const double angle = 4 * std::atan(0.25), radius = std::hypot(100, 200) / (2 * std::sin(angle / 2));
  expect_near_rel(area(front), twice / 2 + radius * radius * (angle - std::sin(angle)) / 2 - 40 * 20, 1e-12);
}

TEST(Dxf, MarksAreToldByTheirLayers) {
  const PanelFile file = parse_dxf(apron(), "apron.dxf");
  const TrimmedSurface& front = file.panels[0];
  EXPECT_EQ(count(front, MarkKind::grain), 1);
  EXPECT_EQ(count(front, MarkKind::notch), 2);
  EXPECT_EQ(count(front, MarkKind::drill), 1);
  EXPECT_GE(count(front, MarkKind::line), 1);
  EXPECT_EQ(count(front, MarkKind::text), 4);
  expect_near_rel(grain_angle(front).value(), 0, 0, 1e-15);
  expect_near_rel(grain_angle(file.panels[1]).value(), std::numbers::pi / 2, 1e-15);
}

TEST(Dxf, UnitsAndSizesAreRead) {
  std::string text = apron();
  text.replace(text.find("METRIC"), 6, "ENGLISH");
  text.replace(text.find("Piece Name: STRAP"), 17, "Piece Name: FRONT");
  text.replace(text.find("Quantity: 2"), 11, "Quantity: 1");
  PanelFile file = parse_dxf(text, "apron.dxf");
  EXPECT_EQ(file.unit, "INCH");
  EXPECT_EQ(file.panels[0].metres_per_unit, 0.0254);
  EXPECT_EQ(file.panels[0].name, "FRONT S");
  EXPECT_EQ(file.panels[1].name, "FRONT S 2");
  text.replace(text.find("ENGLISH"), 7, "CUBITS");
  file = parse_dxf(text, "apron.dxf");
  ASSERT_EQ(file.warnings.size(), 1u);
  EXPECT_NE(file.warnings[0].find("'CUBITS', which is no unit"), std::string::npos) << file.warnings[0];
}

TEST(Dxf, RoundTripsThroughIgesAreExact) {
  const PanelFile file = parse_dxf(apron(), "apron.dxf");
  const RoundtripReport report = roundtrip(file, IgesMode::replay);
  EXPECT_TRUE(report.exact()) << (report.differences.empty() ? "" : report.differences[0]);
  EXPECT_EQ(report.faces, 2);
}

void expect_error(const std::string& text, const std::string& message) {
  try {
    parse_dxf(text, "p.dxf");
    ADD_FAILURE() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()).find("p.dxf:"), 0u) << error.what();
    EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
  }
}

TEST(Dxf, WhatIsWrongIsNamedWithItsLine) {
  const std::string good = apron();
  const auto with = [&](const std::string& old, const std::string& replacement) {
    std::string text = good;
    return text.replace(text.find(old), old.size(), replacement);
  };
  expect_error("", "the file ends without EOF");
  expect_error("solid ascii\n0\n", "p.dxf:1: 'solid ascii' is no group code");
  expect_error("  0\nEOF\n", "no piece with a closed boundary");
  expect_error(with("\n 10\n0\n 20\n300\n", "\n 10\nabc\n 20\n300\n"), "group code 10 is 'abc', must be a number");
  expect_error(with("\n 10\n0\n 20\n300\n", "\n 10\nnan\n 20\n300\n"), "must be a number");
  // A count that no file of this size can hold is refused before anybody allocates for it.
  expect_error("  0\nSECTION\n  2\nENTITIES\n  0\nLWPOLYLINE\n  8\n1\n 90\n2000000000\n 70\n1\n  0\nENDSEC\n  0\nEOF\n",
               "p.dxf:10: group code 90 is '2000000000'");
}

// Half a piece, 100 wide and 300 high, with a notch at the hem, a drill hole and a grain line; its mirror line at x.
std::string half_piece(const std::string& x) {
  const auto line = [](const std::string& layer, const std::string& x0, const std::string& y0, const std::string& x1,
                       const std::string& y1) {
    return "  0\nLINE\n  8\n" + layer + "\n 10\n" + x0 + "\n 20\n" + y0 + "\n 11\n" + x1 + "\n 21\n" + y1 + "\n";
  };
  const auto point = [](const std::string& layer, const std::string& x0, const std::string& y0) {
    return "  0\nPOINT\n  8\n" + layer + "\n 10\n" + x0 + "\n 20\n" + y0 + "\n";
  };
  return "  0\nSECTION\n  2\nBLOCKS\n  0\nBLOCK\n  8\n0\n  2\nBACK\n 10\n0\n 20\n0\n"
         "  0\nTEXT\n  8\n1\n 10\n0\n 20\n0\n 40\n5\n  1\nUnits: METRIC\n" +
         line("1", "0", "0", "100", "0") + line("1", "100", "0", "80", "300") + line("1", "80", "300", "0", "300") +
         line("1", "0", "300", "0", "0") + line("6", x, "0", x, "300") + point("4", "50", "0") +
         point("13", "40", "200") + line("8", "10", "50", "60", "50") + line("7", "20", "100", "20", "250") +
         "  0\nENDBLK\n  8\n0\n  0\nENDSEC\n  0\nEOF\n";
}

TEST(Dxf, APieceCutOnTheFoldIsUnfolded) {
  const PanelFile file = parse_dxf(half_piece("0"), "half.dxf");
  EXPECT_TRUE(file.warnings.empty()) << testing::PrintToString(file.warnings);
  ASSERT_EQ(file.panels.size(), 1u);
  const TrimmedSurface& back = file.panels[0];
  ASSERT_EQ(back.loops.size(), 1u);
  EXPECT_EQ(back.loops[0].curves.size(), 6u);
  expect_near_rel(area(back), 2 * 90.0 * 300, 1e-12);
  EXPECT_EQ(count(back, MarkKind::notch), 2);
  EXPECT_EQ(count(back, MarkKind::drill), 2);
  EXPECT_EQ(count(back, MarkKind::line), 3);  // the fold, and the inner line twice
  EXPECT_EQ(count(back, MarkKind::grain), 1);
}

TEST(Dxf, AMirrorLineThatIsNoEdgeFoldsNothing) {
  const PanelFile file = parse_dxf(half_piece("10"), "half.dxf");
  ASSERT_EQ(file.warnings.size(), 1u);
  EXPECT_NE(file.warnings[0].find("no edge lies on its mirror line"), std::string::npos) << file.warnings[0];
  expect_near_rel(area(file.panels.at(0)), 90.0 * 300, 1e-12);
  EXPECT_EQ(count(file.panels[0], MarkKind::notch), 1);
}

// ---- drawings made here, of words that different systems write ----

std::string xy(double x, double y) {
  std::ostringstream out;
  out.precision(17);
  out << " 10\n" << x << "\n 20\n" << y << "\n";
  return out.str();
}
std::string poly(const std::string& layer, const std::vector<Vector2d>& points, bool closed) {
  std::string out = "  0\nPOLYLINE\n  8\n" + layer + "\n 66\n1\n 70\n" + (closed ? "1" : "0") + "\n";
  for (const Vector2d& p : points) out += "  0\nVERTEX\n  8\n" + layer + "\n" + xy(p.x(), p.y());
  return out + "  0\nSEQEND\n";
}
std::string line(const std::string& layer, const Vector2d& a, const Vector2d& b) {
  std::ostringstream end;
  end << " 11\n" << b.x() << "\n 21\n" << b.y() << "\n";
  return "  0\nLINE\n  8\n" + layer + "\n" + xy(a.x(), a.y()) + end.str();
}
std::string dot(const std::string& layer, const Vector2d& p) {
  return "  0\nPOINT\n  8\n" + layer + "\n" + xy(p.x(), p.y());
}
std::string words(const std::string& text) {
  return "  0\nTEXT\n  8\n1\n" + xy(0, 0) + " 40\n5\n  1\n" + text + "\n";
}
std::string block(const std::string& name, const std::string& items) {
  return "  0\nBLOCK\n  8\n0\n  2\n" + name + "\n 70\n0\n" + xy(0, 0) + items + "  0\nENDBLK\n  8\n0\n";
}
std::string insert(const std::string& name, const std::string& more = "") {
  return "  0\nINSERT\n  8\n1\n  2\n" + name + "\n" + xy(0, 0) + more;
}
std::string file(const std::string& blocks, const std::string& entities, const std::string& header = "") {
  return "  0\nSECTION\n  2\nHEADER\n" + header + "  0\nENDSEC\n  0\nSECTION\n  2\nBLOCKS\n" + blocks +
         "  0\nENDSEC\n  0\nSECTION\n  2\nENTITIES\n" + entities + "  0\nENDSEC\n  0\nEOF\n";
}
const std::vector<Vector2d> rectangle{{0, 0}, {300, 0}, {300, 400}, {0, 400}};
const std::string metric = words("Units: METRIC");
double square_metres(const PanelFile& of) {
  double sum = 0;
  for (const TrimmedSurface& panel : of.panels) sum += area(panel) * of.metres_per_unit * of.metres_per_unit;
  return sum;
}
PanelFile one_piece(const std::string& items, const std::string& entities = metric, const PanelChoice& choice = {}) {
  return parse_dxf(file(block("A", words("Piece Name: A") + items), insert("A") + entities), "p.dxf", choice);
}

// A front in three sizes: its curved side of five points is flatter the larger it is, so that at 20 degrees the sizes
// have different corners.
std::string graded(bool closed, const std::string& sample) {
  std::string blocks;
  int n = 0;
  for (const double bend : {70.0, 50.0, 20.0}) {
    const double w = 200 + 20 * n, h = 400 + 10 * n;
    const std::vector<Vector2d> side{{w, 0}, {w + bend, h / 4}, {w + 1.2 * bend, h / 2}, {w + bend, 3 * h / 4}, {w, h}};
    std::vector<Vector2d> all{{0, 0}};
    all.insert(all.end(), side.begin(), side.end());
    all.emplace_back(0, h);
    const char* size = n == 0 ? "36" : n == 1 ? "38" : "40";
    std::string items = words("Piece Name: FRONT") + words(std::string("Size: ") + size);
    items += closed ? poly("1", all, true)
                    : poly("1", {{0, 0}, {w, 0}}, false) + poly("1", side, false) + poly("1", {{w, h}, {0, h}}, false) +
                          poly("1", {{0, h}, {0, 0}}, false);
    // Turn points are drawn on the sample size only.
    if (!closed && n == 1) items += dot("2", {0, 0}) + dot("2", {w, 0}) + dot("2", {w + 1.2 * bend, h / 2});
    blocks += block("FRONT-" + std::string(size), items);
    ++n;
  }
  return file(blocks, metric + (sample.empty() ? "" : words("Sample Size: " + sample)));
}

TEST(Dxf, OneSizeIsReadTheSampleSizeUnlessAsked) {
  const PanelFile sample = parse_dxf(graded(false, "38"), "g.dxf");
  ASSERT_EQ(sample.panels.size(), 1u);
  EXPECT_EQ(sample.panels[0].name, "FRONT");
  EXPECT_EQ(sample.panels[0].loops[0].curves[0].curve.end(), Vector2d(220, 0));
  EXPECT_EQ(sample.sizes, (std::vector<std::string>{"36", "38", "40"}));
  EXPECT_TRUE(sample.warnings.empty()) << sample.warnings[0];
  EXPECT_EQ(parse_dxf(graded(false, "38"), "g.dxf", {"40", "", ""}).panels[0].loops[0].curves[0].curve.end(),
            Vector2d(240, 0));
  const PanelFile all = parse_dxf(graded(false, "38"), "g.dxf", {"all", "", ""});
  ASSERT_EQ(all.panels.size(), 3u);
  EXPECT_EQ(all.panels[2].name, "FRONT 40");
  try {
    parse_dxf(graded(false, "38"), "g.dxf", {"XL", "", ""});
    ADD_FAILURE() << "there is no such size";
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "g.dxf: there is no size 'XL'; it has 36, 38, 40");
  }
  // Without a word of the sample it is the size with turn points, and a warning.
  const PanelFile unsaid = parse_dxf(graded(false, ""), "g.dxf");
  EXPECT_EQ(unsaid.panels.at(0).loops[0].curves[0].curve.end(), Vector2d(220, 0));
  EXPECT_EQ(unsaid.warnings.size(), 1u);
}

TEST(Dxf, CurveNumbersAreThoseOfEverySize) {
  for (const bool closed : {false, true}) {
    const PanelFile all = parse_dxf(graded(closed, "38"), "g.dxf", {"all", "", ""});
    ASSERT_EQ(all.panels.size(), 3u);
    for (const TrimmedSurface& panel : all.panels) EXPECT_EQ(panel.loops[0].curves.size(), 4u) << panel.name << closed;
    EXPECT_TRUE(all.warnings.empty());
  }
}

TEST(Dxf, PolylinesOfABoundaryEndAtItsCorners) {
  // Two polylines, each around a square corner: corners that sharp are cut; a bend of 45 degrees isn't.
  const PanelFile corners =
      one_piece(poly("1", {{0, 0}, {300, 0}, {300, 400}}, false) + poly("1", {{300, 400}, {0, 400}, {0, 0}}, false));
  EXPECT_EQ(corners.panels.at(0).loops[0].curves.size(), 4u);
  const PanelFile bend = one_piece(poly("1", {{0, 0}, {300, 0}, {400, 100}}, false) +
                                   poly("1", {{400, 100}, {0, 400}}, false) + poly("1", {{0, 400}, {0, 0}}, false));
  EXPECT_EQ(bend.panels.at(0).loops[0].curves.size(), 3u);
}

TEST(Dxf, TheUnitIsWhatTheFileSays) {
  const std::string piece = block("A", poly("1", rectangle, true));
  const auto metres = [&](const std::string& entities, const std::string& header, const std::string& unit = "") {
    return square_metres(parse_dxf(file(piece, entities, header), "u.dxf", {"", unit, ""})) / 0.12;
  };
  const std::string inch = "  9\n$INSUNITS\n 70\n1\n", cm = "  9\n$INSUNITS\n 70\n5\n",
                    english = "  9\n$MEASUREMENT\n 70\n0\n";
  expect_near_rel(metres("", inch), 25.4 * 25.4, 1e-12);
  expect_near_rel(metres("", cm), 100, 1e-12);
  expect_near_rel(metres("", english), 25.4 * 25.4, 1e-12);
  expect_near_rel(metres("", english + cm), 100, 1e-12);
  expect_near_rel(metres(words("Units: CM"), ""), 100, 1e-12);
  expect_near_rel(metres(words("UNITS : English"), ""), 25.4 * 25.4, 1e-12);
  expect_near_rel(metres(metric, inch), 1, 1e-12) << "the piece's text comes before the drawing's header";
  expect_near_rel(metres(metric, "", "cm"), 100, 1e-12);
  expect_near_rel(metres("", "", "inch"), 25.4 * 25.4, 1e-12);
  EXPECT_THROW(metres("", "", "cubit"), InputError);
  EXPECT_EQ(parse_dxf(file(piece, "", cm), "u.dxf").unit, "CM");
  EXPECT_TRUE(parse_dxf(file(piece, metric), "u.dxf").warnings.empty());
  EXPECT_EQ(parse_dxf(file(piece, metric, inch), "u.dxf").warnings.size(), 1u) << "they disagree";
  EXPECT_EQ(parse_dxf(file(piece, words("Units: M")), "u.dxf").warnings.size(), 1u) << "a piece of 400 m";
  const PanelFile decimetres = parse_dxf(file(piece, "", "  9\n$INSUNITS\n 70\n14\n"), "u.dxf");
  ASSERT_EQ(decimetres.warnings.size(), 1u);
  EXPECT_NE(decimetres.warnings[0].find("$INSUNITS = 14 is no unit known here; millimetres"), std::string::npos);
}

TEST(Dxf, SewLinesAreMarksOrTheOutline) {
  const std::vector<Vector2d> inner{{10, 10}, {290, 10}, {290, 390}, {10, 390}};
  for (const char* layer : {"14", "87"}) {
    const std::string items = poly("1", rectangle, true) + poly(layer, inner, true);
    const TrimmedSurface cut = one_piece(items).panels.at(0);
    expect_near_rel(area(cut), 300 * 400, 1e-12);
    EXPECT_EQ(count(cut, MarkKind::sew), 4);
    const PanelFile sewn = one_piece(items, metric, {"", "", "sew"});
    expect_near_rel(area(sewn.panels.at(0)), 280 * 380, 1e-12);
    EXPECT_EQ(count(sewn.panels[0], MarkKind::sew), 0);
    EXPECT_EQ(count(sewn.panels[0], MarkKind::line), 4) << "the cut line";
    EXPECT_TRUE(sewn.warnings.empty());
  }
  EXPECT_EQ(one_piece(poly("1", rectangle, true), metric, {"", "", "sew"}).warnings.size(), 1u);
  EXPECT_THROW(one_piece(poly("1", rectangle, true), metric, {"", "", "edge"}), InputError);
}

TEST(Dxf, LayersThatRepeatOthersAreReadInTheirStead) {
  const std::string line8 = line("8", {50, 50}, {250, 50}), line85 = line("85", {50, 50}, {250, 50});
  const PanelFile repeated = one_piece(poly("1", rectangle, true) + poly("84", rectangle, true) + line8 + line85);
  ASSERT_EQ(repeated.panels.size(), 1u);
  EXPECT_EQ(count(repeated.panels[0], MarkKind::line), 1);
  const PanelFile alone = one_piece(poly("84", rectangle, true) + line85);
  expect_near_rel(area(alone.panels.at(0)), 300 * 400, 1e-12);
  EXPECT_EQ(count(alone.panels[0], MarkKind::line), 1);
}

TEST(Dxf, WhatIsLeftOutIsNamedByLineAndEntity) {
  const std::string sound = poly("1", rectangle, true);
  const std::string twice = insert("B") + insert("B");
  const PanelFile missing = one_piece(sound, metric + twice);
  expect_near_rel(area(missing.panels.at(0)), 300 * 400, 1e-12);
  ASSERT_EQ(missing.warnings.size(), 1u);
  const std::string text = file(block("A", words("Piece Name: A") + sound), insert("A") + metric + twice);
  const auto line_of = [](const std::string& all, const std::string& word) {
    return std::to_string(std::ranges::count(all.substr(0, all.find(word)), '\n') + 1);
  };
  // The line of the first insert's "0" is that before the entity's name.
  const std::string first = std::to_string(std::stoi(line_of(text, "INSERT\n  8\n1\n  2\nB")) - 1);
  EXPECT_EQ(missing.warnings[0], "p.dxf:" + first + ": INSERT: there is no block 'B'; it is left out, 2 times");

  std::string bulging = sound;
  const std::string vertex = xy(300, 0);
  bulging.insert(bulging.find(vertex) + vertex.size(), " 42\n1e9\n");
  const PanelFile straight = one_piece(bulging);
  expect_near_rel(area(straight.panels.at(0)), 300 * 400, 1e-12);
  ASSERT_EQ(straight.warnings.size(), 1u);
  EXPECT_NE(straight.warnings[0].find(": POLYLINE: a bulge of 1e+09 is no arc; it is drawn straight"),
            std::string::npos)
      << straight.warnings[0];
}

TEST(Dxf, APieceIsUnfoldedAtEachMirrorLine) {
  // A quarter of a disc of radius 300, its arc a bulge of tan(90 / 4 degrees).
  std::string quarter = poly("1", {{0, 0}, {300, 0}, {0, 300}}, true);
  const std::string vertex = xy(300, 0);
  quarter.insert(quarter.find(vertex) + vertex.size(), " 42\n0.41421356237309503\n");
  const PanelFile disc =
      one_piece(quarter + line("6", {0, 0}, {300, 0}) + line("6", {0, 0}, {0, 300}) + dot("13", {100, 100}));
  EXPECT_TRUE(disc.warnings.empty()) << disc.warnings[0];
  expect_near_rel(area(disc.panels.at(0)), std::numbers::pi * 300 * 300, 1e-12);
  EXPECT_EQ(disc.panels[0].loops[0].curves.size(), 4u);
  EXPECT_EQ(count(disc.panels[0], MarkKind::drill), 4);
  // The edge on the fold may be left undrawn.
  const PanelFile open =
      one_piece(poly("1", {{0, 0}, {300, 0}, {300, 400}, {0, 400}}, false) + line("6", {0, 0}, {0, 400}));
  expect_near_rel(area(open.panels.at(0)), 2 * 300 * 400, 1e-12);
  EXPECT_TRUE(open.warnings.empty());
}

TEST(Dxf, PiecesLieAsTheyAreInserted) {
  const std::string piece = block("A", words("Piece Name: A") + poly("1", {{0, 0}, {10, 0}, {10, 20}, {0, 20}}, true));
  const auto read = [&](const std::string& entities) { return parse_dxf(file(piece, entities + metric), "i.dxf"); };
  expect_near_rel(square_metres(read(insert("A", " 41\n25.4\n 42\n25.4\n"))), 200e-6 * 25.4 * 25.4, 1e-12);
  expect_near_rel(square_metres(read(insert("A", " 50\n90\n"))), 200e-6, 1e-12);
  const PanelFile turned = read(insert("A", " 50\n90\n"));
  EXPECT_EQ(turned.panels.at(0).loops[0].curves[0].curve.end(), Vector2d(0, 10)) << "bitwise, at right angles";
  EXPECT_EQ(read(insert("A") + insert("A")).panels.size(), 1u) << "a shift makes no other piece";
  const PanelFile pair = read(insert("A") + insert("A", " 41\n-1\n"));
  ASSERT_EQ(pair.panels.size(), 2u) << "a mirrored one does";
  EXPECT_EQ(pair.panels[1].loops[0].curves[0].curve.end(), Vector2d(-10, 0));
  // A block in a block, drawn to the side of its base.
  const std::string inner = block("IN", poly("11", {{2, 2}, {4, 2}, {4, 4}, {2, 4}}, true));
  std::string outer = piece;
  outer.insert(outer.find("  0\nENDBLK"), insert("IN", " 41\n2\n 42\n2\n"));
  expect_near_rel(square_metres(parse_dxf(file(inner + outer, insert("A") + metric), "i.dxf")), (200 - 16) * 1e-6,
                  1e-12);
}

TEST(Dxf, ABlockWithinItselfIsReadOnce) {
  const std::string piece = poly("1", rectangle, true);
  const PanelFile within = one_piece(piece + insert("A"));
  ASSERT_EQ(within.panels.size(), 1u);
  ASSERT_EQ(within.warnings.size(), 1u);
  EXPECT_NE(within.warnings[0].find("INSERT: block 'A' holds block 'A'"), std::string::npos) << within.warnings[0];
  const PanelFile around = parse_dxf(
      file(block("A", piece + insert("B")) + block("B", insert("A") + insert("A")), insert("A") + metric), "p.dxf");
  ASSERT_EQ(around.panels.size(), 1u);
  EXPECT_EQ(around.warnings.size(), 3u);
}

// Twenty blocks around the outline; forty that double without an end.
TEST(Dxf, BlocksInBlocksAreReadOrNamed) {
  std::string chain = block("B20", poly("1", rectangle, true));
  for (int k = 19; k >= 0; --k) chain = block("B" + std::to_string(k), insert("B" + std::to_string(k + 1))) + chain;
  const PanelFile deep = parse_dxf(file(chain, insert("B0") + metric), "p.dxf");
  ASSERT_EQ(deep.panels.size(), 1u);
  EXPECT_TRUE(deep.warnings.empty()) << deep.warnings[0];
  std::string bomb = block("A", poly("1", rectangle, true) + insert("C0"));
  for (int k = 0; k < 40; ++k)
    bomb += block("C" + std::to_string(k), insert("C" + std::to_string(k + 1)) + insert("C" + std::to_string(k + 1)));
  const PanelFile many = parse_dxf(file(bomb + block("C40", ""), insert("A") + metric), "p.dxf");
  ASSERT_EQ(many.panels.size(), 1u);
  EXPECT_NE(many.warnings.at(0).find("piece 'A': blocks are inserted in it more than 64 deep or too often"),
            std::string::npos);
  expect_error(file(block("A", poly("1", rectangle, true)), insert("A", " 41\n0\n") + metric),
               "INSERT: block 'A' has the scale 0");
}

// So many that looking through all blocks for each insert would take hours.
TEST(Dxf, BlocksMayNestDeep) {
  constexpr int depth = 20000;
  const std::string piece = poly("1", rectangle, true);
  const auto name = [](int k) { return "B" + std::to_string(k); };
  std::string chain;
  for (int k = 0; k < depth; ++k) chain += block(name(k), insert(name(k + 1)));
  const auto read = [&](const std::string& last) {
    return parse_dxf(file(block("A", piece) + chain + block(name(depth), last), insert("A") + metric), "p.dxf");
  };
  // Deeper than is read; that is one warning.
  EXPECT_EQ(read(piece).warnings.size(), 1u);
  EXPECT_EQ(read(insert(name(depth - 9))).warnings.size(), 11u) << "of the circle, not of what leads to it";
}

TEST(Dxf, VerticesOfAFittedPolylinesFrameAreNoCorners) {
  // The curve's vertices after the frame's, told by bit 16 of their flags.
  std::string fitted = "  0\nPOLYLINE\n  8\n1\n 66\n1\n 70\n5\n 75\n6\n";
  for (const Vector2d& p : rectangle) fitted += "  0\nVERTEX\n  8\n1\n" + xy(p.x(), p.y()) + " 70\n16\n";
  for (const Vector2d& p : {Vector2d(150, 0), Vector2d(300, 200), Vector2d(150, 400), Vector2d(0, 200)})
    fitted += "  0\nVERTEX\n  8\n1\n" + xy(p.x(), p.y()) + " 70\n8\n";
  const PanelFile of = one_piece(fitted + "  0\nSEQEND\n");
  expect_near_rel(area(of.panels.at(0)), 300 * 400 / 2, 1e-14);
}

TEST(Dxf, ArcsKeepTheirShapeUnderAnyMap) {
  // A half disc on a rectangle; stretched, the half disc is half an ellipse.
  std::string arch = poly("1", {{0, 0}, {200, 0}, {200, 100}, {0, 100}}, true);
  const std::string vertex = xy(200, 100);
  arch.insert(arch.find(vertex) + vertex.size(), " 42\n1\n");
  for (const auto& [more, scale] :
       {std::pair<std::string, double>{"", 1}, {" 41\n-1\n", 1}, {" 42\n3\n", 3}, {" 50\n30\n", 1}}) {
    const PanelFile got = parse_dxf(file(block("A", arch), insert("A", more) + metric), "a.dxf");
    expect_near_rel(area(got.panels.at(0)), scale * (200 * 100 + std::numbers::pi * 100 * 100 / 2), 1e-12) << more;
  }
}

TEST(Dxf, APairedPieceIsTwoPanels) {
  for (const char* text : {"Paired: DOUBLE", "Quantity: 2 / Paired", "Quantity: 1,1"}) {
    const PanelFile pair =
        one_piece(poly("1", {{0, 0}, {300, 0}, {300, 400}}, true) + words(text) + line("7", {200, 50}, {200, 150}));
    ASSERT_EQ(pair.panels.size(), 2u) << text;
    EXPECT_EQ(pair.panels[1].name, "A mirrored");
    EXPECT_EQ(pair.panels[1].loops[0].curves[0].curve.end(), Vector2d(-300, 0));
    EXPECT_EQ(count(pair.panels[1], MarkKind::grain), 1);
    EXPECT_TRUE(pair.warnings.empty());
  }
  EXPECT_EQ(one_piece(poly("1", rectangle, true) + words("Paired: NO")).panels.size(), 1u);
  const PanelFile two = one_piece(poly("1", rectangle, true) + words("Quantity: 2"));
  EXPECT_EQ(two.panels.size(), 1u);
  EXPECT_EQ(two.notes.size(), 1u);
}

TEST(Dxf, AnOutlineOnAnyLayerIsAPanel) {
  const PanelFile plain =
      parse_dxf(file("",
                     poly("Layer_1", rectangle, true) + poly("holes", {{50, 50}, {60, 50}, {60, 60}}, true) +
                         line("GRAIN", {200, 100}, {200, 300}),
                     "  9\n$INSUNITS\n 70\n4\n"),
                "p.dxf");
  ASSERT_EQ(plain.panels.size(), 1u);
  expect_near_rel(area(plain.panels[0]), 300 * 400 - 50, 1e-12);
  EXPECT_EQ(count(plain.panels[0], MarkKind::grain), 1);
  EXPECT_TRUE(plain.warnings.empty()) << plain.warnings[0];
}

TEST(Dxf, SplinesAndEllipsesAreExact) {
  // A cubic edge from (300, 0) to (300, 400) by way of x = 400: it adds 3/4 of 100 over 400 in width at the middle.
  const std::string edges = poly("1", {{300, 400}, {0, 400}, {0, 0}, {300, 0}}, false);
  const std::string head = "  0\nSPLINE\n  8\n1\n 70\n8\n 71\n3\n 72\n8\n 73\n4\n 74\n0\n";
  std::string knots;
  for (const char* k : {"0", "0", "0", "0", "1", "1", "1", "1"}) knots += " 40\n" + std::string(k) + "\n";
  const std::vector<Vector2d> control{{300, 0}, {400, 100}, {400, 300}, {300, 400}};
  std::string points, weights, mixed;
  for (const Vector2d& p : control) {
    points += xy(p.x(), p.y());
    weights += " 41\n2\n";
    mixed += xy(p.x(), p.y()) + " 41\n2\n";
  }
  // What the cubic encloses beyond its chord, by many short chords.
  const auto bulge = [&] {
    double sum = 0;
    const int n = 4000;
    for (int k = 0; k < n; ++k) {
      const auto at = [&](double t) {
        const double s = 1 - t;
        return Vector2d(s * s * s * control[0] + 3 * s * s * t * control[1] + 3 * s * t * t * control[2] +
                        t * t * t * control[3]);
      };
      const Vector2d a = at(static_cast<double>(k) / n), b = at(static_cast<double>(k + 1) / n);
      sum += ((a.x() + b.x()) / 2 - 300) * (b.y() - a.y());
    }
    return sum;
  }();
  for (const std::string& numbers : {points, weights + points, mixed}) {
    const PanelFile got = one_piece(edges + head + knots + numbers);
    EXPECT_TRUE(got.warnings.empty());
    expect_near_rel(area(got.panels.at(0)), 300 * 400 + bulge, 1e-6);
    const auto& curves = got.panels[0].loops[0].curves;
    const auto cubic = std::ranges::find_if(curves, [](const TrimCurve& c) { return c.curve.degree() == 3; });
    ASSERT_NE(cubic, curves.end());
    EXPECT_EQ(cubic->curve.points().col(1), Vector2d(400, 100));
  }
  // Half an ellipse of 100 by 200 on the right.
  const PanelFile oval = one_piece(edges + "  0\nELLIPSE\n  8\n1\n" + xy(300, 200) +
                                   " 11\n0\n 21\n200\n 40\n0.5\n 41\n3.1415926535897931\n 42\n6.2831853071795862\n");
  expect_near_rel(area(oval.panels.at(0)), 300 * 400 + std::numbers::pi * 100 * 200 / 2, 1e-9);
  // What can't be is named with its line.
  const PanelFile fit =
      parse_dxf(file(block("A", poly("1", rectangle, true) + head + " 11\n5\n 21\n5\n"), metric), "f.dxf");
  ASSERT_EQ(fit.warnings.size(), 1u);
  EXPECT_NE(fit.warnings[0].find("SPLINE: it has 1 fit points and no control points"), std::string::npos);
  // Derivatives that aren't finite, and an outline that the unread curve leaves open: both are said.
  std::string tiny = knots;
  for (std::size_t at; (at = tiny.find("\n1\n")) != std::string::npos;) tiny.replace(at, 3, "\n1e-300\n");
  expect_error(file(block("A", edges + head + tiny + points), metric),
               "SPLINE: its knots 3 and 4 must be equal or at least 1e-25 apart; it is not read");
  expect_error(file(block("A", edges + head + knots + points + " 41\n1\n 41\n1e20\n 41\n1\n 41\n1\n"), metric),
               "its weights must be within a factor of 1e15");
}

TEST(Dxf, AnOpenBoundaryIsNamedWithItsGap) {
  const std::string open = poly("1", {{0, 0}, {300, 0}, {300, 400}, {0, 400}, {0, 3}}, false);
  try {
    one_piece(open);
    ADD_FAILURE() << "it is open";
  } catch (const GeometryError& error) {
    EXPECT_NE(std::string(error.what())
                  .find("piece 'A': POLYLINE: the outline is open: it ends at (0, 3, 0), the nearest "
                        "other end is 3 away at (0, 0, 0)"),
              std::string::npos)
        << error.what();
  }
  // Beside a good one it is left out, and named.
  const PanelFile both = parse_dxf(file(block("A", open) + block("B", poly("1", rectangle, true)), metric), "b.dxf");
  EXPECT_EQ(both.panels.size(), 1u);
  EXPECT_EQ(both.refused.size(), 1u);
  const PanelFile bow = parse_dxf(file(block("A", poly("1", {{0, 0}, {300, 0}, {0, 400}, {300, 400}}, true)) +
                                           block("B", poly("1", rectangle, true)),
                                       metric),
                                  "b.dxf");
  EXPECT_NE(bow.refused.at(0).find("crosses itself at (150, 200); the smaller loop there measures 300 x 200"),
            std::string::npos)
      << bow.refused[0];
}

TEST(Dxf, AnEdgeDrawnOutAndBackIsASlit) {
  const PanelFile slit = one_piece(
      poly("1", {{0, 0}, {300, 0}, {300, 200}}, false) + poly("1", {{300, 200}, {290, 200}}, false) +
      poly("1", {{290, 200}, {300, 200}}, false) + poly("1", {{300, 200}, {300, 400}, {0, 400}, {0, 0}}, false));
  expect_near_rel(area(slit.panels.at(0)), 300 * 400, 1e-12);
  EXPECT_EQ(count(slit.panels[0], MarkKind::slit), 1);
  EXPECT_EQ(slit.warnings.size(), 1u);
  EXPECT_TRUE(slit.refused.empty());
}

TEST(Dxf, NamesAreUtf8WhateverTheFileIsWrittenIn) {
  const auto name = [&](const std::string& bytes, const std::string& codepage = "") {
    const std::string header = codepage.empty() ? "" : "  9\n$DWGCODEPAGE\n  3\n" + codepage + "\n";
    return parse_dxf(file(block("A", words("Piece Name: " + bytes) + poly("1", rectangle, true)), metric, header),
                     "n.dxf")
        .panels.at(0)
        .name;
  };
  EXPECT_EQ(name("\xc4RMEL"), "\u00c4RMEL");
  EXPECT_EQ(name("\xc4RMEL", "ANSI_1252"), "\u00c4RMEL");
  EXPECT_EQ(name("\u00c4RMEL", "ANSI_1252"), "\u00c4RMEL") << "UTF-8 already";
  EXPECT_EQ(name("\\U+00C4RMEL"), "\u00c4RMEL");
  EXPECT_EQ(name("\xd0\xf3\xea\xe0\xe2", "ANSI_1251"), "\u0420\u0443\u043a\u0430\u0432");
  EXPECT_EQ(name("\xba\xf3\xc6\xac", "ANSI_936"), "\u540e\u7247");
  EXPECT_EQ(name("\xc9\xcf\xd2\xc2 M", "GB2312"), "\u4e0a\u8863 M");
  EXPECT_EQ(name("\x91O", "ANSI_932"), "\u524d");
  EXPECT_EQ(name("\xbe\xd5", "ANSI_949"), "\uc55e");
  EXPECT_EQ(name("\xab\x65", "ANSI_950"), "\u524d");
  EXPECT_EQ(name("\\M+5BAF3\\U+7247", "ANSI_1252"), "\u540e\u7247");
  // Two letters whose bytes are UTF-8 as well: the rest of the file says what it is.
  EXPECT_EQ(name("\xc4\xa3", "ANSI_936"), "\u0123") << "all of the file is UTF-8";
  const std::string mixed =
      block("A", words("Piece Name: \xc4\xa3") + words("Material: \xba\xf3\xc6\xac") + poly("1", rectangle, true));
  EXPECT_EQ(parse_dxf(file(mixed, metric, "  9\n$DWGCODEPAGE\n  3\nANSI_936\n"), "n.dxf").panels.at(0).name, "\u6a21");
  const PanelFile unknown = parse_dxf(file(block("A", words("Piece Name: \xc4RMEL") + poly("1", rectangle, true)),
                                           metric, "  9\n$DWGCODEPAGE\n  3\nrunes\n"),
                                      "n.dxf");
  EXPECT_EQ(unknown.panels.at(0).name, "\u00c4RMEL");
  EXPECT_EQ(unknown.warnings.at(0),
            "n.dxf: $DWGCODEPAGE 'runes' is not known; text that isn't UTF-8 is read as Latin-1");
}

TEST(Dxf, AByteOrderMarkIsNoPartOfTheFile) {
  const PanelFile of =
      parse_dxf("\xEF\xBB\xBF" + file(block("A", poly("1", rectangle, true)), insert("A") + metric), "p.dxf");
  EXPECT_EQ(of.panels.size(), 1u);
}

TEST(Dxf, ATruncatedFileIsRefusedWithItsPlace) {
  const std::string text = apron();
  for (std::size_t size = 0; size + 5 < text.size(); size += 37) expect_error(text.substr(0, size), "");
}

// What tests/fuzz/run found; the name says what it was.
TEST(Dxf, FindingsOfTheFuzzerStayFixed) {
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(TOILE_TEST_DATA) / "fuzz" / "dxf")) {
    SCOPED_TRACE(entry.path().filename().string());
    try {
      parse_dxf(read_file(entry.path()), "found.dxf");
    } catch (const Error&) {
    }
  }
}

// Two edges that end at a fork: each is followed from its own side, and neither makes a panel.
TEST(Dxf, AChainToAForkIsFollowedFromBothItsEnds) {
  std::string text = half_piece("0");
  const std::string edge = "  0\nLINE\n  8\n1\n 10\n0\n 20\n0\n 11\n0\n 21\n-50\n";
  text.insert(text.find("  0\nENDBLK"), edge + "  0\nLINE\n  8\n1\n 10\n0\n 20\n-50\n 11\n0\n 21\n0\n");
  try {
    for (const std::string& warning : parse_dxf(text, "fork.dxf").warnings)
      EXPECT_EQ(warning.find("fork.dxf:"), 0u) << warning;
  } catch (const GeometryError& error) {
    EXPECT_EQ(std::string(error.what()).find("fork.dxf:"), 0u) << error.what();
  }
}

// Any other exception than InputError fails the test.
TEST(Dxf, FlippedBytesGivePanelsOrErrors) {
  const std::uint32_t seed = 20261126;
  std::mt19937 random(seed);
  int read = 0, refused = 0;
  for (int k = 0; k < 2000; ++k) {
    SCOPED_TRACE("flip " + std::to_string(k) + ", seed " + std::to_string(seed));
    try {
      parse_dxf(test::flipped(k % 2 == 0 ? apron() : half_piece("0"), "0123456789.-\n eEAPLV", random), "flipped.dxf");
      ++read;
    } catch (const Error&) {
      ++refused;
    }
  }
  EXPECT_GT(read, 100);
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace toile
