// SPDX-License-Identifier: GPL-3.0-or-later
// `toile inspect` as functions: the contract of the JSON, the table and the drawing.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <nlohmann/json.hpp>
#include <numbers>
#include <regex>

#include "geometry/error.h"
#include "pipeline/inspect/inspect.h"
#include "support/near.h"

namespace toile {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double radius = 0.23;

// A flat panel of `unit` metres a side, degree 2, 5 x 5 spans, in the file's unit; with a round hole off the knot
// vertices on demand, given the wrong way round.
PanelFile flat_panel(bool hole, double metres_per_unit = 1) {
  const KnotVector knots = uniform_knots(2, 5);
  const double side = 1 / metres_per_unit;
  TrimmedSurface face = untrimmed(rebuild(AffinePatch{{0, 0, 0}, {side, 0, 0}, {0, side, 0}}, knots, knots));
  face.name = "front";
  face.metres_per_unit = metres_per_unit;
  face.natural_bounds = !hole;
  if (hole) {
    TrimLoop loop;
    loop.kind = LoopKind::hole;
    loop.index = 1;
    for (int k = 0; k < 2; ++k) {
      loop.curves.push_back({circular_arc({0.47, 0.52}, radius, pi * k, pi * (k + 1)), k, false, {}});
    }
    face.loops.push_back(std::move(loop));
  }
  PanelFile file;
  file.path = "panel.igs";
  file.unit = "MM";
  file.metres_per_unit = metres_per_unit;
  file.entities = {{128, 1}, {144, 1}};
  file.panels.push_back(std::move(face));
  return file;
}

std::vector<std::string> keys(const nlohmann::ordered_json& object) {
  std::vector<std::string> out;
  for (const auto& item : object.items()) out.push_back(item.key());
  return out;
}

TEST(Inspect, AFaceWithoutATrimHasEveryKnotVertexAndNothingElse) {
  const auto json = inspect_json(inspect(flat_panel(false)));
  const auto& panel = json.at("panels").at(0);
  expect_near_rel(panel.at("area"), 1, 1e-12);
  expect_near_rel(panel.at("perimeter"), 4, 1e-12);
  EXPECT_EQ(panel.at("cells"), (nlohmann::ordered_json{{"inside", 25}, {"cut", 0}, {"outside", 0}}));
  EXPECT_EQ(panel.at("active_control_points"), 49);
  ASSERT_EQ(panel.at("loops").size(), 1u);
  EXPECT_EQ(panel.at("loops").at(0).at("kind"), "outer");
  EXPECT_EQ(panel.at("loops").at(0).at("curves"), 4);
  EXPECT_EQ(panel.at("constraint_points").size(), 36u);
  for (const auto& point : panel.at("constraint_points")) EXPECT_EQ(point.at("kind"), "vertex") << point;
}

TEST(Inspect, JsonHasTheFieldsOfTheContract) {
  const auto json = inspect_json(inspect(flat_panel(true)));
  EXPECT_EQ(keys(json), (std::vector<std::string>{"file", "unit", "exporter", "warnings", "size", "sizes", "notes",
                                                  "entities", "panels", "refused", "ledger"}));
  EXPECT_EQ(json.at("entities"), (nlohmann::ordered_json{{"128", 1}, {"144", 1}}));
  const auto& panel = json.at("panels").at(0);
  EXPECT_EQ(keys(panel), (std::vector<std::string>{"name", "degree", "control_points", "rational", "knots", "domain",
                                                   "area", "perimeter", "loops", "cells", "active_control_points",
                                                   "predicates", "constraint_points"}));
  EXPECT_EQ(panel.at("degree"), (nlohmann::ordered_json{2, 2}));
  EXPECT_EQ(panel.at("control_points"), (nlohmann::ordered_json{7, 7}));
  EXPECT_EQ(panel.at("rational"), false);
  EXPECT_EQ(panel.at("knots").at(0).size(), 10u);
  EXPECT_EQ(keys(panel.at("loops").at(1)), (std::vector<std::string>{"kind", "curves", "length", "closed", "gap"}));
  for (const auto& point : panel.at("constraint_points")) {
    std::vector<std::string> expected{"kind", "u", "v", "position"};
    if (point.contains("loop")) expected.insert(expected.end(), {"loop", "curve", "t"});
    expected.push_back("used");
    if (!point.at("used").get<bool>()) expected.push_back("why");
    EXPECT_EQ(keys(point), expected);
  }
}

TEST(Inspect, MeasuresAPanelWithARoundHoleInMetres) {
  for (const double unit : {1.0, 1e-3, 0.0254}) {
    const auto json = inspect_json(inspect(flat_panel(true, unit)));
    const auto& panel = json.at("panels").at(0);
    expect_near_rel(panel.at("area"), 1 - pi * radius * radius, 1e-10);
    expect_near_rel(panel.at("loops").at(0).at("length"), 4, 1e-10);
    expect_near_rel(panel.at("loops").at(1).at("length"), 2 * pi * radius, 1e-9);
    expect_near_rel(panel.at("perimeter"), 4 + 2 * pi * radius, 1e-9);
    EXPECT_EQ(panel.at("loops").at(1).at("kind"), "hole");
    const auto& cells = panel.at("cells");
    EXPECT_EQ(cells.at("inside").get<int>() + cells.at("cut").get<int>() + cells.at("outside").get<int>(), 25);
    for (const auto& point : panel.at("constraint_points")) {
      EXPECT_NEAR(point.at("position").at(0), point.at("u"), 1e-12);
      EXPECT_NEAR(point.at("position").at(1), point.at("v"), 1e-12);
      if (point.value("loop", -1) != 1) continue;
      EXPECT_NEAR(std::hypot(point.at("u").get<double>() - 0.47, point.at("v").get<double>() - 0.52), radius, 1e-12);
    }
  }
}

TEST(Inspect, SaysWhatTheProjectionTakesAndWhyNot) {
  const auto inspection = inspect(flat_panel(true));
  const auto& points = inspection.panels.front().points;
  const auto used = std::ranges::count(points, true, &ConstraintPoint::used);
  EXPECT_GT(used, 0);
  EXPECT_LT(2 * used, 3 * inspection.panels.front().active_control_points) << "more rows than degrees of freedom";
  for (const ConstraintPoint& point : points) EXPECT_EQ(point.used, point.why.empty());
}

TEST(Inspect, RefinesAsAskedAndKeepsTheFilesKnots) {
  const PanelFile file = flat_panel(true, 1e-3);
  InspectOptions options;
  options.span = 0.07;  // m: a file span of 0.2 m becomes three
  const Inspection inspection = inspect(file, options);
  const KnotVector& knots = inspection.panels.front().face.surface.u();
  EXPECT_EQ(knots.spans().size(), 15u);
  const auto breaks = knots.breaks();
  for (const double knot : file.panels.front().surface.u().breaks()) {
    EXPECT_TRUE(std::ranges::find(breaks, knot) != breaks.end()) << knot;
  }
}

TEST(Inspect, ReportsTheGapAsReadAndTheRepair) {
  PanelFile file = flat_panel(true);
  TrimCurve& arc = file.panels.front().loops.back().curves.front();
  auto points = arc.curve.points();
  points.col(points.cols() - 1) += Eigen::Vector2d(0, 3e-6);
  arc.curve = Curve2(arc.curve.knots(), points, arc.curve.weights());
  const auto json = inspect_json(inspect(file));
  EXPECT_NEAR(json.at("panels").at(0).at("loops").at(1).at("gap"), 3e-6, 1e-12);
  EXPECT_EQ(json.at("panels").at(0).at("loops").at(0).at("gap"), 0.0);
  ASSERT_FALSE(json.at("warnings").empty());
  EXPECT_NE(json.at("warnings").at(0).get<std::string>().find("front"), std::string::npos);
}

TEST(Inspect, RefusesALoopThatCantBeClosed) {
  PanelFile file = flat_panel(true);
  file.panels.front().loops.back().curves.pop_back();
  EXPECT_THROW(inspect(file), GeometryError);
}

TEST(Inspect, ThreadsAndTheirNumberDontShow) {
  PanelFile file = flat_panel(true);
  for (int k = 1; k < 40; ++k) {
    file.panels.push_back(file.panels.front());
    file.panels.back().name = "panel " + std::to_string(k);
    if (k % 7 == 0) file.panels.back().loops.back().curves.pop_back();
  }
  InspectOptions options;
  options.threads = 1;
  const Inspection one = inspect(file, options);
  EXPECT_EQ(one.refused.size(), 5u);
  for (const int threads : {0, 2, 5, 64}) {
    options.threads = threads;
    const Inspection many = inspect(file, options);
    EXPECT_EQ(many.refused, one.refused);
    EXPECT_EQ(many.warnings, one.warnings);
    EXPECT_EQ(inspect_json(many).dump(), inspect_json(one).dump());
  }
}

TEST(Inspect, ASurfaceWithoutAreaIsNamed) {
  for (const double unit : {1.0, 1e-3}) {
    PanelFile file = flat_panel(false, unit);
    EXPECT_TRUE(inspect(file).warnings.empty());
    const NurbsSurface& flat = file.panels.front().surface;
    const Eigen::Vector3d along(1, 2, -0.5);
    for (const Eigen::Matrix3d& squeeze :
         {Eigen::Matrix3d(along * along.transpose()), Eigen::Matrix3d(Eigen::Vector3d(1, 1e-11, 1).asDiagonal())}) {
      PanelFile line = file;
      line.panels.front().surface = flat.with_points(squeeze * flat.points());
      const Inspection found = inspect(line);
      ASSERT_FALSE(found.warnings.empty());
      EXPECT_NE(found.warnings.back().find("panel 'front': it has no area"), std::string::npos)
          << found.warnings.back();
    }
    PanelFile narrow = file;  // a thread, but cloth
    narrow.panels.front().surface = flat.with_points(Eigen::Vector3d(1, 1e-6, 1).asDiagonal() * flat.points());
    EXPECT_TRUE(inspect(narrow).warnings.empty());
  }
}

TEST(Inspect, NamesInAnyEncodingBecomeJson) {
  PanelFile file = flat_panel(false);
  file.exporter = "caf\xe9";                 // Latin-1
  file.panels.front().name = "caf\xc3\xa9";  // UTF-8
  const auto json = inspect_json(inspect(file));
  EXPECT_EQ(json.at("exporter"), "caf\xc3\xa9");
  EXPECT_EQ(json.at("panels").at(0).at("name"), "caf\xc3\xa9");
  for (const char* broken : {"\xc0\x80", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xe2\x82", "\xff"}) {
    file.exporter = broken;
    const std::string text = inspect_json(inspect(file)).dump();  // throws where a string isn't UTF-8
    EXPECT_NE(nlohmann::json::parse(text).at("exporter"), "") << text;
  }
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + part.size())) ++n;
  return n;
}

TEST(Inspect, PagesAndDrawingsKeepLettersAndLines) {
  PanelFile file = flat_panel(true);
  file.panels.front().name =
      "R\xc3\xbc"
      "ckenteil \xe5\x90\x8e\xe7\x89\x87";
  file.exporter = "caf\xe9";  // Latin-1
  const Inspection inspection = inspect(file);
  const std::string page = inspect_html(inspection), svg = inspect_svg(inspection);
  EXPECT_NE(svg.find("R\xc3\xbc"
                     "ckenteil \xe5\x90\x8e\xe7\x89\x87</text>"),
            std::string::npos);
  EXPECT_NE(page.find("R\xc3\xbc"
                      "ckenteil \xe5\x90\x8e\xe7\x89\x87"),
            std::string::npos);
  EXPECT_NE(page.find("caf\xc3\xa9"), std::string::npos);
  // The ledger stays a table.
  std::vector<LedgerEntry> ledger{{1, 5, 128, 0, Disposition::read, ""}, {3, 7, 144, 0, Disposition::read, ""}};
  Inspection with_ledger = inspect(file);
  with_ledger.ledger = ledger;
  const std::string pre = inspect_html(with_ledger);
  const std::size_t begin = pre.find("<pre>"), end = pre.find("</pre>");
  ASSERT_LT(begin, end);
  EXPECT_EQ(count(pre.substr(begin, end - begin), "\n"), count(ledger_text(ledger), "\n"));
  EXPECT_EQ(pre.substr(begin, end - begin).find('?'), std::string::npos);
}

TEST(Inspect, TheTableAddressesCurvesAndListsPoints) {
  const Inspection inspection = inspect(flat_panel(true));
  const std::string text = inspect_text(inspection, true);
  for (const char* words : {"panel 'front'", "curve:0,0", "curve:0,3", "curve:1,1", "crossing_u", "crossing_v"}) {
    EXPECT_NE(text.find(words), std::string::npos) << words;
  }
}

TEST(Inspect, TheDrawingIsXmlWithNumbersCornersAndPoints) {
  PanelFile file = flat_panel(true);
  file.panels.front().name = "a < b & \"c\"\x01\xff";
  const Inspection inspection = inspect(file);
  const std::string svg = inspect_svg(inspection);
  for (const char* words :
       {">0,0<", ">0,3<", ">1,1<", ">corner:0,0<", ">corner:1,1<", ">u<", ">v<", ">warp<", ">weft<"}) {
    EXPECT_NE(svg.find(words), std::string::npos) << words;
  }
  EXPECT_NE(svg.find("a &lt; b &amp; &quot;c&quot;?\xc3\xbf"), std::string::npos);
  // Tags nest: every element is closed, by itself or later.
  EXPECT_EQ(count(svg, "<g>"), count(svg, "</g>"));
  EXPECT_EQ(count(svg, "<text"), count(svg, "</text>"));
  EXPECT_EQ(count(svg, "<"), count(svg, ">"));
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  // As many full and hollow vertex marks as there are vertices, and one of each in the legend.
  std::size_t vertices = 0;
  for (const auto& point : inspection.panels.front().points) vertices += point.kind == PointKind::vertex;
  EXPECT_EQ(count(svg, "<circle fill=\"#2166ac\"") + count(svg, "<circle fill=\"#ffffff\" stroke=\"#2166ac\""),
            vertices + 2);
  EXPECT_EQ(svg, inspect_svg(inspect(file)));
}

// Text of the drawing with the boxes that it takes at least.
struct Words {
  std::string text;
  Eigen::AlignedBox2d box;
};
std::vector<Words> words_of(const std::string& svg) {
  std::vector<Words> out;
  const std::regex element(
      "<text[^>]* x=\"([-0-9.]+)\" y=\"([-0-9.]+)\" font-size=\"([0-9.]+)\" text-anchor=\"(\\w+)\">([^<]*)</text>");
  for (std::sregex_iterator it(svg.begin(), svg.end(), element), end; it != end; ++it) {
    const double x = std::stod((*it)[1]), y = std::stod((*it)[2]), size = std::stod((*it)[3]);
    const std::string anchor = (*it)[4], text = (*it)[5];
    const double width = 0.5 * size * double(text.size());
    const double left = anchor == "start" ? x : anchor == "middle" ? x - width / 2 : x - width;
    out.push_back({text, {Eigen::Vector2d(left, y - 0.7 * size), Eigen::Vector2d(left + width, y)}});
  }
  return out;
}

TEST(Inspect, LabelsOfNarrowPanelsKeepApart) {
  PanelFile file = flat_panel(false);
  const KnotVector knots = uniform_knots(2, 5);
  TrimmedSurface strap =
      untrimmed(rebuild(AffinePatch{{0, 0, 0}, {0.03, 0, 0}, {0, 1, 0}}, knots, uniform_knots(2, 40)));
  strap.metres_per_unit = 1;
  file.panels.clear();
  for (const char* name : {"strap", "a strap with a name that is longer than the panel is wide", "strap 3"}) {
    strap.name = name;
    file.panels.push_back(strap);
  }
  const std::vector<Words> words = words_of(inspect_svg(inspect(file)));
  ASSERT_GT(words.size(), 3u * 8);
  for (std::size_t k = 0; k < words.size(); ++k)
    for (std::size_t i = 0; i < k; ++i)
      EXPECT_FALSE(words[k].box.intersects(words[i].box)) << words[i].text << " and " << words[k].text;
}

}  // namespace
}  // namespace toile
