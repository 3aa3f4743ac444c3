// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/picture/colour_scale.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipeline/picture/colour.h"

namespace toile {

using Eigen::Vector3f;

namespace {

const Vector3f ink(0.045f, 0.055f, 0.075f);

// As many decimals as tell multiples of `step` apart.
std::string percent(double value, double step) {
  const int decimals = std::clamp(-static_cast<int>(std::floor(std::log10(100 * step) + 1e-9)), 0, 7);
  const std::string text = fmt::format("{:.{}f} %", 100 * value, decimals);
  const bool nought = text.starts_with('-') && text.find_first_of("123456789") == std::string::npos;
  return nought ? text.substr(1) : text;
}

double tick_step(double range, int most) {
  const double rough = range / most, power = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (rough <= step * power * (1 + 1e-9)) return step * power;
  }
  return 10 * power;
}

struct Bar {
  int left, right, top, bottom;
  float height(const ColourScale& scale, double value) const {
    return static_cast<float>(bottom - (value - scale.low) / (scale.high - scale.low) * (bottom - top));
  }
};

// A point beyond the end of the bar, in that end's colour.
void draw_arrow(Image& image, const Bar& bar, bool up, const Vector3f& colour, float unit) {
  const double height = 11 * unit, base = up ? bar.top - 1 : bar.bottom + 1, tip = up ? base - height : base + height;
  const double middle = (bar.left + bar.right) / 2.0;
  fill_polygons(image, {{{bar.left - 1.0, base}, {bar.right + 1.0, base}, {middle, tip}}}, ink, 0.6f);
  fill_polygons(image, {{{bar.left + 1.0, base}, {bar.right - 1.0, base}, {middle, tip + (up ? 2.5 : -2.5) * unit}}},
                colour);
}

}  // namespace

Vector3f ColourScale::colour(double value) const {
  if (!both_signs) return strain_colour((value - low) / (high - low));
  return signed_colour(value / std::max(-low, high));
}

ColourScale scale_of(std::vector<float> values, const std::optional<Interval>& range) {
  ColourScale scale;
  if (!values.empty()) {
    const auto [least, most] = std::ranges::minmax_element(values);
    scale.least = *least, scale.most = *most;
  }
  if (range && range->length() > 0) {
    scale.low = range->min, scale.high = range->max;
    scale.both_signs = scale.low < 0;
    return scale;
  }
  if (values.empty()) return scale;
  const auto end = static_cast<std::ptrdiff_t>(values.size());
  const auto quantile = [&](std::ptrdiff_t k) {
    std::nth_element(values.begin(), values.begin() + k, values.end());
    return static_cast<double>(values[static_cast<std::size_t>(k)]);
  };
  constexpr double noise = 1e-7;  // strain that single precision can't tell from none
  scale.low = std::min(quantile(end / 200), 0.0);
  scale.high = std::max({quantile(end - 1 - end / 200), 0.0, scale.low + noise});
  // Less than this of the larger sign is nothing to see.
  constexpr double unseen = 0.02;
  scale.both_signs = -scale.low > unseen * scale.high;
  if (!scale.both_signs) scale.low = 0;
  if (scale.both_signs && scale.high < unseen * -scale.low) scale.high = 0;
  return scale;
}

std::vector<double> round_ticks(double low, double high, int most) {
  std::vector<double> ticks;
  if (!(high > low)) return ticks;
  const double step = tick_step(high - low, most);
  const double slack = 1e-9 * (high - low);
  for (double k = std::ceil((low - slack) / step); k * step <= high + slack; ++k) ticks.push_back(k * step + 0.0);
  return ticks;
}

void draw_strain_bar(Image& image, const ColourScale& scale, float unit) {
  Bar bar{};
  bar.left = static_cast<int>(static_cast<float>(image.width) - 112 * unit);
  bar.right = bar.left + static_cast<int>(15 * unit);
  bar.top = static_cast<int>(0.25f * static_cast<float>(image.height));
  bar.bottom = static_cast<int>(0.75f * static_cast<float>(image.height));
  for (int y = bar.top - 1; y <= bar.bottom; ++y)
    for (int x = bar.left - 1; x <= bar.right; ++x) {
      const bool edge = y < bar.top || y >= bar.bottom || x < bar.left || x >= bar.right;
      // The end colours fill the rows at the ends exactly.
      const double s = static_cast<double>(bar.bottom - 1 - y) / (bar.bottom - 1 - bar.top);
      image.blend(x, y, edge ? ink : scale.colour(scale.low + s * (scale.high - scale.low)), edge ? 0.6f : 1.0f);
    }
  const float text_left = static_cast<float>(bar.right) + 9 * unit;
  const double range = scale.high - scale.low, step = tick_step(range, 6);
  for (const double tick : round_ticks(scale.low, scale.high, 6)) {
    const float y = bar.height(scale, tick);
    const int row = std::clamp(static_cast<int>(y), bar.top, bar.bottom - 1);
    const int from = tick == 0 ? bar.left - static_cast<int>(5 * unit) : bar.right;
    for (int x = from; x < bar.right + static_cast<int>(5 * unit); ++x) image.blend(x, row, ink, 0.6f);
    draw_text(image, text_left, y + 4.5f * unit, 9.5f * unit, percent(tick, step), ink);
  }
  const bool above = scale.most > scale.high + 0.01 * range, below = scale.least < scale.low - 0.01 * range;
  const auto middle = static_cast<float>(bar.left + bar.right) / 2 + 14 * unit;
  const auto centred = [&](const std::string& text, float y, float size) {
    draw_text(image, middle - text_width(text, size) / 2, y, size, text, ink);
  };
  if (above) draw_arrow(image, bar, true, scale.colour(scale.high), unit);
  if (below) draw_arrow(image, bar, false, scale.colour(scale.low), unit);
  const auto top = static_cast<float>(bar.top), bottom = static_cast<float>(bar.bottom);
  if (above) centred("up to " + percent(scale.most, step / 10), top - 20 * unit, 8 * unit);
  if (below) centred("down to " + percent(scale.least, step / 10), bottom + 28 * unit, 8 * unit);
  centred("strain", top - (above ? 40 : 18) * unit, 12 * unit);
  const float foot = bottom + (below ? 47 : 26) * unit;
  centred("larger of weft", foot, 8 * unit);
  centred("and warp", foot + 15 * unit, 8 * unit);
}

}  // namespace toile
