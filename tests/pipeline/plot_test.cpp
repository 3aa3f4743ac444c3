// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/picture/plot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <regex>
#include <string>
#include <vector>

namespace toile {
namespace {

struct Element {
  std::string name, attributes, text;
};

// The elements of an SVG in order; fails where they don't nest.
std::vector<Element> parse(const std::string& svg) {
  std::vector<Element> elements;
  std::vector<std::string> open;
  const std::regex tag("<(/?)([a-z]+)([^>]*?)(/?)>([^<]*)");
  for (auto it = std::sregex_iterator(svg.begin(), svg.end(), tag); it != std::sregex_iterator(); ++it) {
    const std::smatch& m = *it;
    if (m[1].length() > 0) {
      EXPECT_FALSE(open.empty());
      if (open.empty()) return {};
      EXPECT_EQ(open.back(), m[2]);
      open.pop_back();
      if (m[2] == "g") elements.push_back({"/g", "", ""});
      continue;
    }
    elements.push_back({m[2], m[3], m[5]});
    if (m[4].length() == 0) open.push_back(m[2]);
  }
  EXPECT_TRUE(open.empty());
  return elements;
}

double number(const Element& e, const std::string& attribute) {
  std::smatch m;
  return std::regex_search(e.attributes, m, std::regex(" " + attribute + "=\"([^\"]*)\""))
             ? std::atof(m[1].str().c_str())
             : NAN;
}

// The paths of the group with this title.
std::vector<Element> titled(const std::vector<Element>& elements, const std::string& title) {
  std::vector<Element> result;
  for (std::size_t k = 0; k < elements.size(); ++k) {
    if (elements[k].name != "title" || elements[k].text != title) continue;
    for (std::size_t i = k + 1; i < elements.size() && elements[i].name == "path"; ++i) result.push_back(elements[i]);
  }
  return result;
}

double tick(const std::vector<Element>& elements, const std::string& label, const std::string& coordinate) {
  for (const Element& e : elements) {
    if (e.name == "text" && e.text == label) return number(e, coordinate);
  }
  ADD_FAILURE() << "no tick " << label;
  return NAN;
}

// x and y of the first point of a path.
std::pair<double, double> start(const Element& path) {
  std::smatch m;
  std::regex_search(path.attributes, m, std::regex(" d=\"M([-0-9.]+) ([-0-9.]+)"));
  return {std::atof(m[1].str().c_str()), std::atof(m[2].str().c_str())};
}

LogPlot example() {
  LogPlot plot{"a < b", "time [s]", "error [m]", "uncertainty", {}};
  PlotSeries a{
      "first", {"order 2"}, {{{0.1, 1e-2, 0.05, 0.2, "coarse", false}, {10.0, 1e-4, 0, 0, "fine", false}}}, 1e-5};
  PlotSeries b{
      "second", {}, {{{1.0, std::nullopt, 0, 0, "lost", true}, {std::nullopt, std::nullopt, 0, 0, "gone", true}}}, {}};
  plot.series = {a, b};
  return plot;
}

TEST(Plot, PointsStandWhereTheTicksSay) {
  const auto elements = parse(log_plot_svg(example()));
  // The first series has circles: their path starts at the left, 4 px from the centre; a label's baseline lies 4 px
  // below its tick.
  const auto fine = titled(elements, "fine");
  ASSERT_EQ(fine.size(), 1u);
  EXPECT_NEAR(start(fine[0]).first + 4, tick(elements, "10", "x"), 0.02);
  EXPECT_NEAR(start(fine[0]).second, tick(elements, "0.0001", "y") - 4, 0.02);
  const auto coarse = titled(elements, "coarse");
  ASSERT_EQ(coarse.size(), 4u) << "the spread, its two ends and the marker";
  EXPECT_NEAR(start(coarse[3]).first + 4, tick(elements, "0.1", "x"), 0.02);
  EXPECT_NEAR(start(coarse[0]).first,
              tick(elements, "0.1", "x") - 0.30103 * (tick(elements, "1", "x") - tick(elements, "0.1", "x")), 0.05);
}

TEST(Plot, WhatFailedHasAPlaceAboveTheOthers) {
  const auto elements = parse(log_plot_svg(example()));
  const auto lost = titled(elements, "lost"), gone = titled(elements, "gone"), coarse = titled(elements, "coarse");
  ASSERT_EQ(lost.size(), 1u);
  ASSERT_EQ(gone.size(), 1u);
  EXPECT_NEAR(start(lost[0]).first + 5, tick(elements, "1", "x"), 0.02);
  EXPECT_LT(start(lost[0]).second + 5, start(coarse[3]).second);
  EXPECT_EQ(start(lost[0]).second, start(gone[0]).second);
  EXPECT_LT(start(gone[0]).first, tick(elements, "0.1", "x"));
  EXPECT_NE(tick(elements, "failed", "y"), 0);
}

TEST(Plot, LegendNamesSeriesNotesAndLevel) {
  const auto elements = parse(log_plot_svg(example()));
  std::vector<std::string> texts;
  for (const Element& e : elements) texts.push_back(e.text);
  for (const char* text : {"a &lt; b", "time [s]", "error [m]", "first", "order 2", "second", "uncertainty"}) {
    EXPECT_NE(std::find(texts.begin(), texts.end(), text), texts.end()) << text;
  }
  const auto level = titled(elements, "first: uncertainty 1e-05");
  ASSERT_GE(level.size(), 1u);
  EXPECT_NE(level[0].attributes.find("stroke-dasharray"), std::string::npos);
  EXPECT_NEAR(start(level[0]).second, tick(elements, "1e-05", "y") - 4, 0.02);
}

TEST(Plot, NothingToShowIsStillADrawing) {
  for (const LogPlot& plot :
       {LogPlot{}, LogPlot{"t", "x", "y", "l", {{"only", {}, {{{1.0, 1.0, 0, 0, "one", false}}}, {}}}}}) {
    const std::string svg = log_plot_svg(plot);
    EXPECT_GT(parse(svg).size(), 5u);
    EXPECT_EQ(svg.find("nan"), std::string::npos);
    EXPECT_EQ(svg.find("inf"), std::string::npos);
  }
  EXPECT_EQ(bar_plot_svg({}).find("nan"), std::string::npos);
}

TEST(Plot, BarsAreAsLongAsTheirNumbers) {
  const BarPlot plot{"times", "s", {"force", "write"}, {{"a", {2, 1}}, {"b", {0, 4}}}};
  const auto elements = parse(bar_plot_svg(plot));
  const auto extent = [&](const std::string& title) {
    const auto bars = titled(elements, title);
    EXPECT_EQ(bars.size(), 1u) << title;
    std::smatch m;
    std::regex_search(bars.at(0).attributes, m, std::regex("d=\"M([-0-9.]+) [-0-9.]+L([-0-9.]+) "));
    return std::pair{std::atof(m[1].str().c_str()), std::atof(m[2].str().c_str())};
  };
  const double zero = tick(elements, "0", "x"), one = tick(elements, "1", "x") - zero;
  EXPECT_NEAR(extent("a: force 2").second, zero + 2 * one, 0.05);
  EXPECT_NEAR(extent("a: write 1").first, zero + 2 * one, 0.05);
  EXPECT_NEAR(extent("a: write 1").second, zero + 3 * one, 0.05);
  EXPECT_NEAR(extent("b: write 4").second, zero + 4 * one, 0.05);
}

}  // namespace
}  // namespace toile
