// SPDX-License-Identifier: GPL-3.0-or-later
// Sewing patterns: every edge is exactly the curve that the file names; what is wrong is named with its line.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "geometry/error.h"
#include "io/file.h"
#include "io/panel_facts.h"
#include "io/pattern_json.h"
#include "support/flipped.h"
#include "support/near.h"

namespace toile {
namespace {

using Eigen::Vector2d;
using test::area;

std::string corpus_text(const std::string& name) {
  return read_file(std::filesystem::path(TOILE_TEST_DATA) / "patterns" / name);
}
Pattern read_corpus(const std::string& name) {
  return parse_pattern(corpus_text(name), name);
}

// One panel of two edges from (0, 0) to (8, 4) and back; the first is curved.
std::string panel(const std::string& curvature, const std::string& properties = "\"units_in_meter\": 100") {
  return "{\"properties\": {" + properties +
         "},\n\"pattern\": {\"panels\": {\"p\": {\n\"vertices\": [[0, 0], [8, 4]],\n" +
         "\"edges\": [{\"endpoints\": [0, 1],\n\"curvature\": " + curvature + "},\n{\"endpoints\": [1, 0]}]}}}}";
}
Curve2 first_edge(const std::string& curvature, const std::string& properties = "\"units_in_meter\": 100") {
  return parse_pattern(panel(curvature, properties), "p.json").file.panels.at(0).loops.at(0).curves.at(0).curve;
}

TEST(Pattern, AQuadraticIsTheBezierThatTheFileNames) {
  // A + x (B - A) + y perp(B - A) = (0.5 * 8 - 0.25 * 4, 0.5 * 4 + 0.25 * 8)
  Eigen::Matrix2Xd wanted(2, 3);
  wanted << 0, 3, 8, 0, 4, 4;
  for (const char* text : {"[0.5, 0.25]", "{\"type\": \"quadratic\", \"params\": [[0.5, 0.25]]}"}) {
    const Curve2 curve = first_edge(text);
    EXPECT_EQ(curve.points(), wanted) << text;
    EXPECT_EQ(curve.knots(), uniform_knots(2, 1));
    EXPECT_FALSE(curve.rational());
  }
  EXPECT_EQ(first_edge("[3, 4]", "\"units_in_meter\": 100, \"curvature_coords\": \"absolute\"").points(), wanted);
}

TEST(Pattern, ACubicIsTheBezierThatTheFileNames) {
  Eigen::Matrix2Xd wanted(2, 4);
  wanted << 0, 1, 5.5, 8, 0, 3, 4, 4;
  const Curve2 curve = first_edge("{\"type\": \"cubic\", \"params\": [[0.25, 0.25], [0.75, 0.125]]}");
  EXPECT_EQ(curve.points(), wanted);
  EXPECT_EQ(curve.degree(), 3);
}

TEST(Pattern, ACircleEdgeIsAnArcOnTheNamedSide) {
  const double chord = std::hypot(8, 4);
  for (const double ratio : {0.5, 0.500001, 0.51, 0.7, 1.0, 3.0, 1000.0}) {
    for (const bool large : {false, true}) {
      for (const bool right : {false, true}) {
        if (large && ratio > 3) continue;  // crosses the other edge's box, nothing new
        const double radius = ratio * chord;
        char text[128];
        std::snprintf(text, sizeof text, "{\"type\": \"circle\", \"params\": [%.17g, %d, %s]}", radius, large,
                      right ? "true" : "false");
        const Pattern pattern = parse_pattern(panel(text), "p.json");
        const TrimmedSurface& face = pattern.file.panels[0];
        const Curve2& arc = face.loops[0].curves[0].curve;
        EXPECT_EQ(arc.start(), Vector2d(0, 0));
        EXPECT_EQ(arc.end(), Vector2d(8, 4));
        // The centre lies left of an arc that runs on the right, unless it is the large one.
        const double apothem = std::sqrt((radius - chord / 2) * (radius + chord / 2));
        const Vector2d left(-4 / chord, 8 / chord);
        const Vector2d centre = Vector2d(4, 2) + (right != large ? 1 : -1) * apothem * left;
        for (int k = 0; k <= 40; ++k)
          EXPECT_NEAR((arc(k / 40.0) - centre).norm() / radius, 1, 2e-15) << text << " at " << k;
        // Segment of a circle: r^2 (angle - sin angle) / 2, in square centimetres; the net is in millimetres.
        const double half = std::asin(std::min(1.0, chord / 2 / radius));
        const double angle = 2 * (large ? std::numbers::pi - half : half);
        const double segment = radius * radius * (angle - std::sin(angle)) / 2;
        if (ratio > 0.5 && ratio < 1000) {
          expect_near_rel(area(face), 100 * segment, 1e-9) << text;
        }
      }
    }
  }
}

TEST(Pattern, BothDialectsBecomePanelsInTheFilesOrder) {
  const Pattern skirt = read_corpus("skirt.jsonc");
  ASSERT_EQ(skirt.file.panels.size(), 2u);
  EXPECT_EQ(skirt.file.panels[0].name, "front");
  EXPECT_FALSE(skirt.soles_at_zero);
  expect_near_rel(skirt.places[0].translate.z(), 0.2, 1e-15);
  // Trapezium of 120 and 240 over 180, less the waist's parabola (2/3 of 120 x 15), plus the hem's (2/3 of 240 x 15):
  // the control points lie 30 off their edges, the curves half of that.
  const double trapezium = 180 * 180 - 2.0 / 3 * 120 * 15 + 2.0 / 3 * 240 * 15;
  expect_near_rel(area(skirt.file.panels[0]) * 1e-6, trapezium / 9e4, 1e-12);
  expect_near_rel(area(skirt.file.panels[1]) * 1e-6, 180 * 180 / 9e4, 1e-14);

  const Pattern bodice = read_corpus("bodice_and_cuff.json");
  EXPECT_TRUE(bodice.soles_at_zero);
  ASSERT_EQ(bodice.stitches.size(), 2u);
  EXPECT_EQ(bodice.stitches[1].a.at(0).curve, 5);
  EXPECT_EQ(bodice.places[1].rotate_deg, Eigen::Vector3d(0, 180, 0));
  EXPECT_TRUE(bodice.file.warnings.empty());
}

TEST(Pattern, EdgesThatCloseEarlyBeginAHole) {
  const TrimmedSurface face = read_corpus("bodice_and_cuff.json").file.panels[0];
  ASSERT_EQ(face.loops.size(), 2u);
  EXPECT_EQ(face.loops[0].curves.size(), 6u);
  EXPECT_EQ(face.loops[1].kind, LoopKind::hole);
  EXPECT_EQ(face.loops[1].curves[1].index, 1);
  // The hole: a half disc of radius 4 and the larger segment of a disc of radius 5 on the same chord of 8.
  const double half = std::asin(0.8), angle = 2 * std::numbers::pi - 2 * half;
  const double hole = 8 * std::numbers::pi + 12.5 * (angle - std::sin(angle));
  TrimmedSurface filled = face;
  filled.loops.pop_back();
  expect_near_rel(area(filled) - area(face), 100 * hole, 1e-10);
}

TEST(Pattern, IgesKeepsEveryNumber) {
  for (const char* name : {"skirt.jsonc", "bodice_and_cuff.json"}) {
    const PanelFile file = read_corpus(name).file;
    const RoundtripReport report = roundtrip(file, IgesMode::replay);
    EXPECT_TRUE(report.exact()) << (report.differences.empty() ? name : report.differences.front());
    EXPECT_EQ(report.faces, 2);
    const PanelFile again = parse_iges(format_iges(file), name);
    EXPECT_EQ(again.panels[1].name, file.panels[1].name);
    EXPECT_EQ(again.unit, "MM");
    expect_near_rel(area(again.panels[0]), area(file.panels[0]), 1e-14);
  }
}

TEST(Pattern, AnEdgeAgainstItsNeighboursIsTurned) {
  std::string text = corpus_text("skirt.jsonc");
  const std::string edge = "{\"endpoints\": [0, 1]}, {\"endpoints\": [1, 2]}";
  text.replace(text.find(edge), edge.size(), "{\"endpoints\": [0, 1]}, {\"endpoints\": [2, 1]}");
  const Pattern pattern = parse_pattern(text, "s.json");
  ASSERT_EQ(pattern.file.warnings.size(), 1u);
  EXPECT_EQ(pattern.file.warnings[0].find("s.json:21: panel 'back': edge 1: it runs against"), 0u)
      << pattern.file.warnings[0];
  const TrimCurve& turned = pattern.file.panels[1].loops[0].curves[1];
  EXPECT_EQ(turned.curve.start(), Vector2d(60, 0));
  EXPECT_EQ(turned.curve.end(), Vector2d(120, -180));
  expect_near_rel(area(pattern.file.panels[1]) * 1e-6, 180 * 180 / 9e4, 1e-14);
}

// Squares of 40 from left to right, called a, b, c, ...; edge 1 of each lies at edge 3 of the next.
std::string squares(int count, const std::string& stitches, const std::string& odd_panel = "") {
  std::string panels;
  for (int k = 0; k < count; ++k) {
    panels += std::string(k ? ",\n" : "") + "\"" + static_cast<char>('a' + k) +
              "\": {\"vertices\": [[0, 0], [40, 0], [40, 40], [0, 40]], \"edges\": [{\"endpoints\": [0, 1]}, "
              "{\"endpoints\": [1, 2]}, {\"endpoints\": [2, 3]}, {\"endpoints\": [3, 0]}]}";
  }
  return "{\"properties\": {\"units_in_meter\": 100}, \"pattern\": {\"panels\": {" + panels + odd_panel +
         "},\n\"stitches\": [" + stitches + "]}}";
}
std::string edge(const std::string& panel, int number) {
  return "{\"panel\": \"" + panel + "\", \"edge\": " + std::to_string(number) + "}";
}

TEST(Pattern, AStitchJoinsTheStartOfOneEdgeToTheEndOfTheOther) {
  const Pattern plain = parse_pattern(squares(2, "[" + edge("a", 1) + "," + edge("b", 3) + "]"), "s.json");
  EXPECT_TRUE(plain.stitches.at(0).reverse);
  EXPECT_TRUE(plain.file.warnings.empty()) << plain.file.warnings[0];
  const Pattern wrong =
      parse_pattern(squares(2, "[" + edge("a", 1) + "," + edge("b", 3) + ", \"right_wrong\"]"), "s.json");
  EXPECT_FALSE(wrong.stitches.at(0).reverse);
  EXPECT_TRUE(wrong.file.warnings.empty());
}

TEST(Pattern, AGarmentIsGluedAndWhatIsNoSurfaceIsNamed) {
  const auto pair = [](const std::string& a, int i, const std::string& b, int j) {
    return "[" + edge(a, i) + "," + edge(b, j) + "]";
  };
  // A ring of three.
  const std::string ring = pair("a", 1, "b", 3) + "," + pair("b", 1, "c", 3) + "," + pair("c", 1, "a", 3);
  const Pattern tube = parse_pattern(squares(3, ring), "s.json");
  EXPECT_TRUE(tube.file.warnings.empty());
  ASSERT_EQ(tube.gluing.pieces.size(), 1u);
  EXPECT_EQ(tube.gluing.pieces[0].euler, 0);
  EXPECT_EQ(tube.gluing.pieces[0].borders, 2);
  EXPECT_TRUE(tube.gluing.pieces[0].orientable);
  ASSERT_EQ(tube.file.notes.size(), 1u);
  EXPECT_NE(tube.file.notes[0].find("Euler characteristic 0, 2 borders, orientable"), std::string::npos);
  // The last panel mirrored, drawn clockwise as such files have it: still an orientable tube.
  std::string mirrored = squares(3, ring);
  mirrored.replace(mirrored.rfind("[[0, 0], [40, 0], [40, 40], [0, 40]]"), 36, "[[40, 0], [0, 0], [0, 40], [40, 40]]");
  EXPECT_TRUE(parse_pattern(mirrored, "s.json").gluing.pieces.at(0).orientable);
  // Both ends of the band at one side's hems: a half twist.
  const Pattern twisted =
      parse_pattern(squares(2, pair("a", 1, "b", 3) + "," + "[" + edge("b", 1) + "," + edge("a", 3) + "]"), "s.json");
  EXPECT_TRUE(twisted.gluing.pieces.at(0).orientable);
  const Pattern dart =
      parse_pattern(squares(1, "[" + edge("a", 0) + "," + edge("a", 1) + ", \"left_right\"]"), "s.json");
  ASSERT_EQ(dart.file.warnings.size(), 1u);
  EXPECT_NE(dart.file.warnings[0].find("the word \"left_right\" is not known"), std::string::npos);
  const Pattern thrice = parse_pattern(squares(3, pair("a", 1, "b", 3) + "," + pair("a", 1, "c", 3)), "s.json");
  ASSERT_EQ(thrice.file.warnings.size(), 1u);
  EXPECT_NE(thrice.file.warnings[0].find("stitch 1: curve 0,1 of panel 'a' is sewn more than once (stitches 0, 1)"),
            std::string::npos)
      << thrice.file.warnings[0];
}

TEST(Pattern, OneEdgeIsSewnToSeveral) {
  // b and c are half as wide: their bottoms to a's top, from right to left as a's top runs.
  std::string text = squares(3, "[" + edge("a", 2) + "," + edge("b", 0) + "," + edge("c", 0) + "]");
  for (int k = 0; k < 2; ++k)
    text.replace(text.rfind("[[0, 0], [40, 0], [40, 40], [0, 40]]"), 36, "[[0, 0], [20, 0], [20, 30], [0, 30]]");
  const Pattern pattern = parse_pattern(text, "s.json");
  EXPECT_TRUE(pattern.file.warnings.empty());
  ASSERT_EQ(pattern.stitches.size(), 1u);
  EXPECT_EQ(pattern.stitches[0].a.size(), 1u);
  EXPECT_EQ(pattern.stitches[0].b.size(), 2u);
  EXPECT_EQ(pattern.gluing.pieces.at(0).euler, 1);
  EXPECT_EQ(pattern.gluing.pieces.at(0).borders, 1);
  // The one may stand last: its length says so.
  text.replace(text.rfind(edge("a", 2)), edge("a", 2).size(), "X");
  text.replace(text.rfind(edge("c", 0)), edge("c", 0).size(), edge("a", 2));
  text.replace(text.rfind("X"), 1, edge("c", 0));
  EXPECT_EQ(parse_pattern(text, "s.json").stitches.at(0).a.at(0).panel, 0);
}

TEST(Pattern, ABadPanelIsLeftOutAndNamed) {
  const std::string bow =
      ",\n\"bow\": {\"vertices\": [[0, 0], [40, 0], [0, 60], [40, 60]], \"edges\": [{\"endpoints\": [0, 1]}, "
      "{\"endpoints\": [1, 2]}, {\"endpoints\": [2, 3]}, {\"endpoints\": [3, 0]}]}";
  const Pattern pattern = parse_pattern(
      squares(2, "[" + edge("a", 1) + "," + edge("bow", 3) + "],[" + edge("a", 3) + "," + edge("b", 1) + "]", bow),
      "s.json");
  EXPECT_EQ(pattern.file.panels.size(), 2u);
  ASSERT_EQ(pattern.file.refused.size(), 1u);
  EXPECT_EQ(pattern.file.refused[0],
            "s.json:3: panel 'bow': the outline crosses itself at (20, 30); the smaller loop there measures 40 x 30");
  EXPECT_EQ(pattern.stitches.size(), 1u) << "what is sewn to it goes with it";
  EXPECT_EQ(pattern.file.warnings.size(), 1u);
  std::string open = bow;
  open.replace(open.find(", {\"endpoints\": [3, 0]}"), 23, "");
  EXPECT_NE(parse_pattern(squares(1, "", open), "s.json").file.refused.at(0).find("its edges don't close"),
            std::string::npos);
  std::string nameless = bow;
  nameless.replace(nameless.find("bow"), 3, "");
  EXPECT_EQ(parse_pattern(squares(1, "", nameless), "s.json").file.refused.at(0), "s.json:2: panel '': it has no name");
  // Alone it is an error, of geometry.
  std::string alone = squares(0, "", bow);
  alone.replace(alone.find(",\n\"bow"), 2, "");
  EXPECT_THROW(parse_pattern(alone, "s.json"), GeometryError);
}

TEST(Pattern, ABadStitchIsLeftOutAndNamed) {
  const std::string good = ",\n[" + edge("a", 1) + "," + edge("b", 3) + "]";
  const auto bad = [&](const std::string& stitch, const std::string& reason) {
    const Pattern pattern = parse_pattern(squares(2, stitch + good), "s.json");
    EXPECT_EQ(pattern.file.panels.size(), 2u);
    ASSERT_EQ(pattern.stitches.size(), 1u) << stitch;
    EXPECT_EQ(pattern.stitches[0].line, 4);
    ASSERT_EQ(pattern.file.warnings.size(), 1u) << stitch;
    EXPECT_EQ(pattern.file.warnings[0], "s.json:3: stitch 0: " + reason + "; the stitch is left out");
  };
  bad("[" + edge("a", 3) + "," + edge("q", 1) + "]", "there is no panel 'q'");
  bad("[" + edge("a", 3) + "," + edge("b", 9) + "]", "'edge' of panel 'b' is 9, must be a whole number from 0 to 3");
  bad("[" + edge("a", 3) + "," + edge("b", -1) + "]", "'edge' of panel 'b' is -1, must be a whole number from 0 to 3");
  bad("[" + edge("a", 3) + ", {\"panel\": \"b\"}]", "'edge' is missing");
  bad("[" + edge("a", 3) + ", {\"panel\": 1, \"edge\": 1}]", "'panel' must be a string, not a number");
  bad("[" + edge("a", 3) + ", 7]", "a side must be an object, not a number");
  bad("[" + edge("a", 3) + "]", "it has 1 sides, must have 2");
  bad("[" + edge("a", 3) + "," + edge("a", 3) + "]", "it joins an edge with itself");
  bad("{}", "a stitch must be an array, not an object");
  std::string none = squares(2, "");
  none.replace(none.find("[]"), 2, "{}");
  const Pattern pattern = parse_pattern(none, "s.json");
  EXPECT_EQ(pattern.file.panels.size(), 2u);
  EXPECT_EQ(pattern.file.warnings.at(0), "s.json:3: 'stitches' must be an array, not an object; nothing is sewn");
}

TEST(Pattern, NamesAreUtf8WhateverTheFileIsWrittenIn) {
  std::string text = squares(1, "");
  text.replace(text.find("\"a\""), 3, "\"\xc4rmel\"");
  const PanelFile file = parse_pattern(text, "s.json").file;
  EXPECT_EQ(file.panels.at(0).name, "\u00c4rmel");
  ASSERT_EQ(file.warnings.size(), 1u);
  EXPECT_NE(file.warnings[0].find("s.json: it isn't UTF-8"), std::string::npos);
  std::string wide = "\xff\xfe";
  for (const char c : squares(1, "")) wide += {c, '\0'};
  EXPECT_EQ(parse_pattern(wide, "s.json").file.panels.at(0).name, "a") << "UTF-16";
}

TEST(Pattern, AnEdgeDrawnOutAndBackIsASlit) {
  std::string text = squares(1, "");
  text.replace(text.find("[40, 40]"), 8, "[40, 40], [40, 20], [30, 20]");
  text.replace(text.find("{\"endpoints\": [1, 2]}"), 21,
               "{\"endpoints\": [1, 3]}, {\"endpoints\": [3, 4]}, {\"endpoints\": [4, 3]}, {\"endpoints\": [3, 2]}");
  text.replace(text.find("[2, 3]}"), 7, "[2, 5]}");
  text.replace(text.find("[3, 0]}"), 7, "[5, 0]}");
  const PanelFile file = parse_pattern(text, "s.json").file;
  EXPECT_TRUE(file.refused.empty()) << file.refused[0];
  expect_near_rel(area(file.panels.at(0)), 400 * 400, 1e-14);
  ASSERT_EQ(file.panels[0].marks.size(), 1u);
  EXPECT_EQ(file.panels[0].marks[0].kind, MarkKind::slit);
  EXPECT_EQ(file.panels[0].loops[0].curves[2].index, 4) << "curves keep the numbers of their edges";
  EXPECT_NE(file.warnings.at(0).find("drawn out and back, 10 long"), std::string::npos) << file.warnings[0];
}

void expect_error(const std::string& text, const std::string& message) {
  try {
    parse_pattern(text, "p.json");
    ADD_FAILURE() << "accepted: " << text;
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
  }
}

TEST(Pattern, WhatIsWrongIsNamedWithItsLine) {
  const std::string good = panel("[0.5, 0.25]");
  const auto with = [&](const std::string& old, const std::string& replacement) {
    std::string text = good;
    return text.replace(text.find(old), old.size(), replacement);
  };
  expect_error("", "p.json:1: no valid JSON");
  expect_error("{\"a\": 4" + std::string(400, '0') + "}", "p.json:1: no valid JSON: number overflow parsing '4000");
  expect_error("[]", "p.json:1: a pattern file must be an object, not an array");
  expect_error("{\"pattern\": 3}", "'pattern' must be an object, not a number");
  expect_error("{\"pattern\": {}}", "'panels' is missing");
  expect_error("{\"pattern\": {\"panels\": {}}}", "the pattern has no panels");
  expect_error(with("[0.5, 0.25]", "[0.5]"), "p.json:5: panel 'p': edge 0: 'curvature' has 1 numbers, must have 2");
  expect_error(with("[0.5, 0.25]", "[0.5, 1e999]"), "p.json:5");
  expect_error(with("[0.5, 0.25]", "[0.5, \"x\"]"), "p.json:5: panel 'p': edge 0: 'curvature' must be a number");
  expect_error(with("[0.5, 0.25]", "{\"type\": \"spline\", \"params\": []}"), "\"spline\", must be \"quadratic\"");
  expect_error(with("[0.5, 0.25]", "{\"type\": \"circle\", \"params\": [4, 0, 1]}"),
               "the radius is 4, must be at least");
  expect_error(with("[0, 0], [8, 4]", "[0, 0]"),
               "p.json:4: panel 'p': edge 0: an endpoint is 1, must be a whole number from 0");
  expect_error(with("[[0, 0], [8, 4]]", "[]"), "the panel has no vertices");
  expect_error(with("[8, 4]]", "[8, 0]]").replace(good.find("[0.5"), 11, "null"),
               "p.json:2: panel 'p': its edges enclose nothing");
  expect_error(with("{\"endpoints\": [1, 0]}", "{\"endpoints\": [1, 1]}"), "its edges don't close: they end at (8, 4)");
  expect_error(with("100", "0"), "'units_in_meter' is 0, must be positive");
  expect_error(with("\"p\": {", "\"p\": {}, \"p\": {"), "key 'p' stands twice");
  expect_error(std::string(100, '['), "nested more than 64 levels deep");
}

TEST(Pattern, ATruncatedFileIsRefusedWithItsPlace) {
  const std::string text = corpus_text("bodice_and_cuff.json");
  const std::size_t last = text.find_last_of('}');
  for (std::size_t size = 0; size < last; size += 7) {
    try {
      parse_pattern(text.substr(0, size), "cut.json");
      ADD_FAILURE() << "accepted " << size << " bytes";
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).find("cut.json:"), 0u) << error.what();
    }
  }
}

// Any other exception than InputError fails the test.
TEST(Pattern, FlippedBytesGivePanelsOrErrors) {
  const std::uint32_t seed = 20261126;
  std::mt19937 random(seed);
  int read = 0, refused = 0;
  for (const std::string name : {"bodice_and_cuff.json", "skirt.jsonc"}) {
    const std::string source = corpus_text(name);
    for (int k = 0; k < 2000; ++k) {
      SCOPED_TRACE("flip " + std::to_string(k) + ", seed " + std::to_string(seed));
      try {
        parse_pattern(test::flipped(source, "0123456789.,:[]{}\"-eE ntfu", random), "flipped.json");
        ++read;
      } catch (const Error&) {
        ++refused;
      }
    }
  }
  EXPECT_GT(read, 100);
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace toile
