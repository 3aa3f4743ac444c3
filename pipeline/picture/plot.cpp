// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/picture/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "pipeline/picture/svg.h"

namespace toile {
namespace {

using Eigen::Vector2d;

constexpr std::string_view style_sheet =
    "text{font-family:Helvetica,Arial,sans-serif;fill:#222}\n"
    ".frame{fill:none;stroke:#444}\n.grid{stroke:#e2e2e2}\n.band{fill:#f6eeee}\n";

// Okabe and Ito's colours, which colour-blind readers tell apart.
constexpr std::array<const char*, 8> colours{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                             "#e69f00", "#56b4e9", "#000000", "#b8a900"};
const char* colour(std::size_t k) {
  return colours[k % colours.size()];
}

std::string shortened(const std::string& text, std::size_t most) {
  if (text.size() <= most) return text;
  std::size_t end = most - 3;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80) --end;  // whole letters
  return text.substr(0, end) + "...";
}

// A circle, square, diamond, triangle or triangle upside down.
std::string marker(std::size_t k, const Vector2d& at, double r) {
  std::vector<Vector2d> corners;
  switch (k % 5) {
    case 0:
      return fmt::format("M{0} {1}a{2} {2} 0 1 0 {3} 0a{2} {2} 0 1 0 -{3} 0Z", svg_number(at.x() - r),
                         svg_number(at.y()), svg_number(r), svg_number(2 * r));
    case 1:
      corners = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
      break;
    case 2:
      corners = {{0, -1.35}, {1.35, 0}, {0, 1.35}, {-1.35, 0}};
      break;
    case 3:
      corners = {{0, -1.3}, {1.2, 0.9}, {-1.2, 0.9}};
      break;
    default:
      corners = {{0, 1.3}, {1.2, -0.9}, {-1.2, -0.9}};
  }
  for (Vector2d& c : corners) c = at + r * c;
  return svg_path(corners, true);
}

std::string cross(const Vector2d& at, double r) {
  const std::array<Vector2d, 2> a{at + Vector2d(-r, -r), at + Vector2d(r, r)},
      b{at + Vector2d(-r, r), at + Vector2d(r, -r)};
  return svg_path(a, false) + svg_path(b, false);
}

struct LogAxis {
  double low = 0, high = 1;  // log10
  double from = 0, to = 1;   // pixels
  std::vector<double> ticks;
  double operator()(double value) const { return from + (std::log10(value) - low) / (high - low) * (to - from); }
};

LogAxis log_axis(const std::vector<double>& values, double from, double to) {
  LogAxis axis;
  axis.from = from;
  axis.to = to;
  double least = std::numeric_limits<double>::infinity(), most = 0;
  for (const double v : values) {
    least = std::min(least, v);
    most = std::max(most, v);
  }
  if (!(least <= most)) least = most = 1;
  const double middle = 0.5 * (std::log10(least) + std::log10(most));
  const double half = std::max(0.56 * (std::log10(most) - std::log10(least)), 0.35);
  axis.low = middle - half;
  axis.high = middle + half;
  const int first = static_cast<int>(std::floor(axis.low)), last = static_cast<int>(std::ceil(axis.high));
  const int stride = std::max(1, (last - first) / 8);
  for (int k = first; k <= last; ++k) {
    for (const double step : {1.0, 2.0, 5.0}) {
      const bool wanted = step == 1 ? k % stride == 0 : axis.high - axis.low < 2.5;
      const double tick = step * std::pow(10.0, k), place = std::log10(tick);
      if (wanted && place >= axis.low && place <= axis.high) axis.ticks.push_back(tick);
    }
  }
  return axis;
}

constexpr double left = 92, top = 52, plot_width = 460, plot_height = 340, band = 26;
constexpr double right = left + plot_width, bottom = top + plot_height;

struct Axes {
  LogAxis x, y;
  bool failures = false;  // some point has no y
  bool crosses = false;   // some point failed
  Vector2d place(const PlotPoint& p, int without_x = 0) const {
    return {p.x ? x(*p.x) : left + 10 + 14 * without_x, p.y ? y(*p.y) : top + 0.5 * band};
  }
};

Axes axes_of(const LogPlot& plot) {
  Axes axes;
  std::vector<double> xs, ys;
  for (const PlotSeries& s : plot.series) {
    for (const auto& line : s.lines) {
      for (const PlotPoint& p : line) {
        if (p.x) xs.push_back(*p.x);
        if (p.x && p.x_low < p.x_high) xs.insert(xs.end(), {p.x_low, p.x_high});
        if (p.y) ys.push_back(*p.y);
        axes.failures = axes.failures || !p.y;
        axes.crosses = axes.crosses || p.failed;
      }
    }
    if (s.level) ys.push_back(*s.level);
  }
  axes.x = log_axis(xs, left, right);
  axes.y = log_axis(ys, bottom, axes.failures ? top + band : top);
  return axes;
}

void draw_axes(Svg& svg, const LogPlot& plot, const Axes& axes) {
  if (axes.failures) {
    const std::array<Vector2d, 4> area{Vector2d(left, top), Vector2d(right, top), Vector2d(right, top + band),
                                       Vector2d(left, top + band)};
    svg.path(svg_path(area, true), "band");
    svg.text({left - 6, top + 0.5 * band + 4}, 11, "failed", "", TextAnchor::end);
  }
  for (const double tick : axes.x.ticks) {
    const double x = axes.x(tick);
    svg.line({x, axes.y.to}, {x, bottom}, "grid");
    svg.text({x, bottom + 16}, 11, fmt::format("{:g}", tick), "");
  }
  for (const double tick : axes.y.ticks) {
    const double y = axes.y(tick);
    svg.line({left, y}, {right, y}, "grid");
    svg.text({left - 6, y + 4}, 11, fmt::format("{:g}", tick), "", TextAnchor::end);
  }
  const std::array<Vector2d, 4> frame{Vector2d(left, top), Vector2d(right, top), Vector2d(right, bottom),
                                      Vector2d(left, bottom)};
  svg.path(svg_path(frame, true), "frame");
  svg.text({left, 28}, 15, plot.title, "", TextAnchor::start);
  svg.text({0.5 * (left + right), bottom + 38}, 12, plot.x, "");
  const double middle = 0.5 * (top + bottom);
  svg.text({20, middle}, 12, plot.y, fmt::format("transform=\"rotate(-90 20 {})\"", svg_number(middle)));
}

void draw_series(Svg& svg, const PlotSeries& series, std::size_t k, const Axes& axes, const std::string& level,
                 int& without_x) {
  const std::string stroke = fmt::format("stroke=\"{}\" fill=\"none\"", colour(k));
  svg.open_group(series.name);
  if (series.level) {
    const double y = axes.y(*series.level);
    svg.open_group(fmt::format("{}: {} {:.3g}", series.name, level, *series.level));
    svg.line({left, y}, {right, y}, stroke + " stroke-dasharray=\"6 4\"");
    svg.close_group();
  }
  for (const auto& line : series.lines) {
    std::vector<Vector2d> joined;
    for (const PlotPoint& p : line) {
      if (p.x && p.y && !p.failed) joined.push_back(axes.place(p));
    }
    if (joined.size() > 1) svg.path(svg_path(joined, false), stroke + " stroke-width=\"1.5\"");
    for (const PlotPoint& p : line) {
      const Vector2d at = axes.place(p, p.x ? 0 : without_x++);
      svg.open_group(p.title);
      if (p.x && p.x_low < p.x_high) {
        const Vector2d low(axes.x(p.x_low), at.y()), high(axes.x(p.x_high), at.y());
        svg.line(low, high, stroke);
        for (const Vector2d& end : {low, high}) svg.line(end - Vector2d(0, 4), end + Vector2d(0, 4), stroke);
      }
      if (p.y) {
        svg.path(marker(k, at, 4),
                 fmt::format("stroke=\"{}\" fill=\"{}\"", colour(k), p.failed ? "#ffffff" : colour(k)));
      }
      if (p.failed) svg.path(cross(at, 5), stroke + " stroke-width=\"2\"");
      svg.close_group();
    }
  }
  svg.close_group();
}

// Returns the height that it takes.
double draw_legend(Svg& svg, const LogPlot& plot, bool failures) {
  double y = top + 10;
  constexpr double x = right + 22;
  bool levels = false;
  for (std::size_t k = 0; k < plot.series.size(); ++k) {
    const PlotSeries& s = plot.series[k];
    svg.path(marker(k, {x, y - 4}, 4), fmt::format("stroke=\"{0}\" fill=\"{0}\"", colour(k)));
    svg.text({x + 12, y}, 12, shortened(s.name, 50), "", TextAnchor::start);
    for (const std::string& note : s.notes) {
      y += 15;
      svg.text({x + 12, y}, 11, shortened(note, 56), "fill-opacity=\"0.75\"", TextAnchor::start);
    }
    levels = levels || s.level;
    y += 21;
  }
  if (levels) {
    svg.line({x - 8, y - 4}, {x + 8, y - 4}, "stroke=\"#444\" stroke-dasharray=\"6 4\"");
    svg.text({x + 12, y}, 11, plot.level, "", TextAnchor::start);
    y += 18;
  }
  if (failures) {
    svg.path(cross({x, y - 4}, 5), "stroke=\"#444\" stroke-width=\"2\"");
    svg.text({x + 12, y}, 11, "failed or a check not met", "", TextAnchor::start);
    y += 18;
  }
  return y + 2;
}

// 1, 2 or 5 times a power of ten, some five of them up to `most`.
double linear_stride(double most) {
  const double rough = most / 5, power = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (rough <= step * power) return step * power;
  }
  return 10 * power;
}

}  // namespace

std::string log_plot_svg(const LogPlot& plot) {
  const Axes axes = axes_of(plot);
  Svg svg;
  draw_axes(svg, plot, axes);
  int without_x = 0;
  for (std::size_t k = 0; k < plot.series.size(); ++k) draw_series(svg, plot.series[k], k, axes, plot.level, without_x);
  const double height = std::max(bottom + 60, draw_legend(svg, plot, axes.crosses));
  return svg.finish(right + 360, height, plot.title, style_sheet);
}

std::string bar_plot_svg(const BarPlot& plot) {
  constexpr double labels = 380, row = 20, width = 420, first = 74;
  Svg svg;
  double most = 0;
  for (const auto& [label, lengths] : plot.rows) {
    double sum = 0;
    for (const double length : lengths) sum += length;
    most = std::max(most, sum);
  }
  if (!(most > 0)) most = 1;
  const double end = first + row * static_cast<double>(plot.rows.size()), scale = width / (1.05 * most);
  svg.text({20, 28}, 15, plot.title, "", TextAnchor::start);
  double x = labels;
  for (std::size_t k = 0; k < plot.parts.size(); ++k) {
    svg.path(marker(1, {x, 50}, 5), fmt::format("fill=\"{}\"", colour(k)));
    svg.text({x + 10, 54}, 11, plot.parts[k], "", TextAnchor::start);
    x += 24 + 6.5 * static_cast<double>(plot.parts[k].size());
  }
  const double stride = linear_stride(most);
  for (int k = 0; k * stride <= 1.05 * most; ++k) {
    const double at = labels + scale * k * stride;
    svg.line({at, first - 6}, {at, end}, "grid");
    svg.text({at, end + 16}, 11, fmt::format("{:g}", k * stride), "");
  }
  for (std::size_t r = 0; r < plot.rows.size(); ++r) {
    const auto& [label, lengths] = plot.rows[r];
    const double y = first + row * static_cast<double>(r);
    svg.text({labels - 8, y + 13}, 11, shortened(label, 62), "", TextAnchor::end);
    double from = labels;
    for (std::size_t k = 0; k < lengths.size(); ++k) {
      const double to = from + scale * lengths[k];
      if (lengths[k] > 0) {
        const std::array<Vector2d, 4> bar{Vector2d(from, y + 3), Vector2d(to, y + 3), Vector2d(to, y + row - 3),
                                          Vector2d(from, y + row - 3)};
        svg.open_group(fmt::format("{}: {} {:.3g}", label, plot.parts[k], lengths[k]));
        svg.path(svg_path(bar, true), fmt::format("fill=\"{}\"", colour(k)));
        svg.close_group();
      }
      from = to;
    }
  }
  svg.line({labels, first - 6}, {labels, end}, "frame");
  svg.text({labels + 0.5 * width, end + 38}, 12, plot.x, "");
  return svg.finish(std::max(labels + width, x) + 20, end + 54, plot.title, style_sheet);
}

}  // namespace toile
