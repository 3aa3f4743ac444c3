// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/measure/shadow.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "pipeline/picture/svg.h"

namespace toile {
namespace {

using Eigen::Vector2d;

constexpr double turn = 2 * std::numbers::pi;

Vector2d direction(double angle) {
  return {std::cos(angle), std::sin(angle)};
}

double cross(const Vector2d& a, const Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

using Stretch = std::pair<double, double>;  // of a ray, from and to

// What a ray from the origin meets of a triangle; empty (from > to) where it passes by.
Stretch met(const Vector2d (&corners)[3], const Vector2d& ray) {
  Stretch out{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  const auto take = [&](double s) {
    if (s < 0) return;
    out = {std::min(out.first, s), std::max(out.second, s)};
  };
  bool left = true, right = true;  // of all edges lies the origin
  for (int k = 0; k < 3; ++k) {
    const Vector2d &a = corners[k], &b = corners[(k + 1) % 3];
    const double side_a = cross(ray, a), side_b = cross(ray, b), turns = cross(a, b);
    left = left && turns >= 0;
    right = right && turns <= 0;
    if (side_a == 0) take(ray.dot(a));
    if ((side_a < 0) == (side_b < 0) || side_a == side_b) continue;
    const double t = side_a / (side_a - side_b);
    take(ray.dot((1 - t) * a + t * b));
  }
  if (left != right) take(0);  // the origin is inside
  return out;
}

// Half the sum of squares, of the union.
double sector(std::vector<Stretch>& stretches) {
  std::ranges::sort(stretches);
  double sum = 0, reached = 0;
  for (const auto& [from, to] : stretches) {
    if (to <= reached) continue;
    const double start = std::max(from, reached);
    sum += 0.5 * (to - start) * (to + start);
    reached = to;
  }
  return sum;
}

// How far the outline falls from ray `top` on one side until it is higher (or as high, going backwards: of two equal
// tops one counts); `valley` is its lowest place there.
double valley_beside(const std::vector<double>& radius, std::size_t top, bool forward) {
  const std::size_t n = radius.size();
  double lowest = radius[top];
  for (std::size_t k = 1; k < n; ++k) {
    const double r = radius[forward ? (top + k) % n : (top + n - k) % n];
    if (r > radius[top] || (!forward && r == radius[top])) break;
    lowest = std::min(lowest, r);
  }
  return lowest;
}

}  // namespace

Shadow shadow_of(const Eigen::Matrix2Xd& points, std::span<const Triangle> triangles, const Vector2d& centre,
                 double support, int rays) {
  std::vector<std::vector<Stretch>> stretches(static_cast<std::size_t>(rays), {{0, support}});
  for (const Triangle& triangle : triangles) {
    const Vector2d corners[3] = {points.col(triangle[0]) - centre, points.col(triangle[1]) - centre,
                                 points.col(triangle[2]) - centre};
    // The rays between its corners' angles; all of them where the centre is inside or on the border.
    double low = 0, high = 0;
    const double first = std::atan2(corners[0].y(), corners[0].x());
    bool around = corners[0].isZero(0);
    for (int k = 0; k < 3; ++k) {
      const Vector2d &a = corners[k], &b = corners[(k + 1) % 3];
      around = around || (cross(a, b) == 0 && a.dot(b) <= 0);
      if (k == 0) continue;
      const double angle = std::atan2(cross(corners[0], a), corners[0].dot(a));
      low = std::min(low, angle);
      high = std::max(high, angle);
    }
    if (around || high - low >= 0.5 * turn) low = -0.5 * turn, high = 0.5 * turn;
    const double step = turn / rays;
    for (long k = std::lround(std::floor((first + low) / step)); k <= std::lround(std::ceil((first + high) / step));
         ++k) {
      const Stretch stretch = met(corners, direction(step * static_cast<double>(k)));
      if (stretch.first < stretch.second)
        stretches[static_cast<std::size_t>(((k % rays) + rays) % rays)].push_back(stretch);
    }
  }
  Shadow out;
  for (auto& ray : stretches) {
    out.area += turn / rays * sector(ray);
    out.radius.push_back(std::ranges::max(ray, {}, &Stretch::second).second);
  }
  return out;
}

DrapeMeasure measure_drape(const Shadow& shadow, double support, double flat_area) {
  DrapeMeasure out;
  const double held = std::numbers::pi * support * support;
  out.support = support;
  out.area = shadow.area;
  out.flat_area = flat_area;
  out.coefficient = 100 * (shadow.area - held) / (flat_area - held);
  out.least = 0.02 * (std::sqrt(flat_area / std::numbers::pi) - support);
  const std::vector<double>& radius = shadow.radius;
  for (std::size_t k = 0; k < radius.size(); ++k) {
    const double drop = radius[k] - std::max(valley_beside(radius, k, true), valley_beside(radius, k, false));
    if (drop > out.least)
      out.nodes.push_back({turn * static_cast<double>(k) / static_cast<double>(radius.size()), radius[k], 0});
  }
  // Valleys between neighbours: the amplitude knows these, not the prominence.
  const auto ray_of = [&](double angle) {
    return static_cast<std::size_t>(std::lround(angle / turn * static_cast<double>(radius.size())));
  };
  const std::size_t count = out.nodes.size();
  std::vector<double> valley(count);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t from = ray_of(out.nodes[k].angle);
    std::size_t to = ray_of(out.nodes[(k + 1) % count].angle);
    if (to <= from) to += radius.size();
    valley[k] = radius[from];
    for (std::size_t i = from; i < to; ++i) valley[k] = std::min(valley[k], radius[i % radius.size()]);
  }
  for (std::size_t k = 0; k < count; ++k)
    out.nodes[k].amplitude = 0.5 * (out.nodes[k].radius - 0.5 * (valley[k] + valley[(k + count - 1) % count]));
  return out;
}

std::string drape_svg(const Shadow& shadow, const DrapeMeasure& measure) {
  constexpr double mm = 1e3;
  const double flat = std::sqrt(measure.flat_area / std::numbers::pi);
  const double half = mm * std::max(flat, std::ranges::max(shadow.radius)) + 10;
  const auto at = [&](double radius, double angle) -> Vector2d {
    return {half + mm * radius * std::cos(angle), half - mm * radius * std::sin(angle)};
  };
  std::vector<Vector2d> outline;
  for (std::size_t k = 0; k < shadow.radius.size(); ++k)
    outline.push_back(at(shadow.radius[k], turn * static_cast<double>(k) / static_cast<double>(shadow.radius.size())));
  Svg svg;
  svg.circle({half, half}, mm * flat, "flat");
  svg.path(svg_path(outline, true), "shadow");
  svg.circle({half, half}, mm * measure.support, "support");
  for (const DrapeNode& node : measure.nodes) svg.circle(at(node.radius, node.angle), 1.5, "node");
  svg.text({half, half - 3}, 9, fmt::format("DC {:.1f} %", measure.coefficient), "words");
  svg.text({half, half + 9}, 9, fmt::format("{} nodes", measure.nodes.size()), "words");
  return svg.finish(2 * half, 2 * half, "Drape",
                    ".flat{fill:none;stroke:#9fabb8;stroke-width:.5}\n.shadow{fill:#dcefe6;stroke:#1d2b4f;"
                    "stroke-width:.7}\n.support{fill:#ffffff;stroke:#7c8896;stroke-width:.5}\n.node{fill:#c0392b}\n"
                    ".words{fill:#26313f;font-family:'DejaVu Sans',sans-serif}\n");
}

}  // namespace toile
