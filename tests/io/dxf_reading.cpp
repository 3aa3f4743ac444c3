// Pattern pieces in DXF: exact outlines, marks by layer, errors with their line.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>

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
  PanelFile file = parse_dxf(text, "apron.dxf");
  EXPECT_EQ(file.unit, "INCH");
  EXPECT_EQ(file.panels[0].metres_per_unit, 0.0254);
  EXPECT_EQ(file.panels[0].name, "FRONT S");
  EXPECT_EQ(file.panels[1].name, "FRONT S 2");
  text.replace(text.find("ENGLISH"), 7, "CUBITS");
  file = parse_dxf(text, "apron.dxf");
  ASSERT_EQ(file.warnings.size(), 1u);
  EXPECT_NE(file.warnings[0].find("neither METRIC nor ENGLISH"), std::string::npos) << file.warnings[0];
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
  } catch (const InputError& error) {
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
    } catch (const InputError&) {
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
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("no piece with a closed boundary"), std::string::npos) << error.what();
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
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(read, 100);
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace toile
