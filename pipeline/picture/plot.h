// SPDX-License-Identifier: GPL-3.0-or-later
// Plots as SVG: points on two logarithmic axes, and stacked bars.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace toile {

struct PlotPoint {
  // Without x the point stands at the left edge, without y in a band above the plot: what failed has a place too.
  std::optional<double> x, y;    // positive
  double x_low = 0, x_high = 0;  // spread of x, drawn where x_low < x_high
  std::string title;             // shown where the pointer rests
  bool failed = false;           // crossed
};

struct PlotSeries {
  std::string name;
  std::vector<std::string> notes;             // below the name in the legend
  std::vector<std::vector<PlotPoint>> lines;  // the points of each are joined where they didn't fail
  std::optional<double> level;                // y of a dashed line, such as the reference's own uncertainty
};

struct LogPlot {
  std::string title, x, y, level;  // names of the axes with units, and of the levels
  std::vector<PlotSeries> series;
};

// Both axes have ticks at powers of ten (and at 2 and 5 times them on short axes) with labels, a marker and a colour
// per series, a legend. The same plot gives the same bytes.
std::string log_plot_svg(const LogPlot& plot);

struct BarPlot {
  std::string title, x;
  std::vector<std::string> parts;                                 // names, in the order of stacking
  std::vector<std::pair<std::string, std::vector<double>>> rows;  // label and a length per part, none negative
};
std::string bar_plot_svg(const BarPlot& plot);

}  // namespace toile
