// SPDX-License-Identifier: GPL-3.0-or-later
// Drawings as pictures: filled and stroked polygons and letters, antialiased.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>

#include "geometry/error.h"
#include "pipeline/picture/image.h"
#include "pipeline/picture/svg.h"

namespace toile {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3f;
using Points = std::vector<Vector2d>;
using Rules = std::map<std::string, std::string, std::less<>>;

constexpr double max_pixels = 1e8;

// key:value; pairs.
void read_rules(std::string_view text, Rules& into) {
  while (!text.empty()) {
    const std::string_view rule = text.substr(0, text.find(';'));
    text.remove_prefix(std::min(text.size(), rule.size() + 1));
    const std::size_t colon = rule.find(':');
    if (colon != std::string_view::npos) into[std::string(rule.substr(0, colon))] = rule.substr(colon + 1);
  }
}

// Class name -> its rules; selectors other than ".name" are for browsers.
std::map<std::string, Rules, std::less<>> read_sheet(std::string_view sheet) {
  std::map<std::string, Rules, std::less<>> out;
  std::size_t at = 0;
  while (true) {
    const std::size_t open = sheet.find('{', at), close = sheet.find('}', at);
    if (open == std::string_view::npos || close == std::string_view::npos) return out;
    std::string_view name = sheet.substr(at, open - at);
    while (!name.empty() && std::isspace(static_cast<unsigned char>(name.front()))) name.remove_prefix(1);
    if (name.starts_with('.')) read_rules(sheet.substr(open + 1, close - open - 1), out[std::string(name.substr(1))]);
    at = close + 1;
  }
}

double number_of(std::string_view text, double otherwise) {
  double value = otherwise;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

std::optional<Vector3f> colour_of(std::string_view text) {
  if (text.size() != 7 || text[0] != '#') return std::nullopt;
  Vector3f out;
  for (int c = 0; c < 3; ++c) {
    int value = 0;
    std::from_chars(text.data() + 1 + 2 * c, text.data() + 3 + 2 * c, value, 16);
    // sRGB to linear. [IEC 61966-2-1]
    const float s = static_cast<float>(value) / 255;
    out[c] = s <= 0.04045f ? s / 12.92f : std::pow((s + 0.055f) / 1.055f, 2.4f);
  }
  return out;
}

struct Paint {
  std::optional<Vector3f> fill = Vector3f(0, 0, 0), stroke;
  float opacity = 1;
  double width = 1;
  bool even_odd = false, halo = false;
};

class Painter {
 public:
  Painter(int width, int height, std::string_view sheet) : image_(width, height), sheet_(read_sheet(sheet)) {
    std::ranges::fill(image_.linear, Vector3f(1, 1, 1));
  }
  void draw(const SvgItem& item);
  const Image& image() const { return image_; }

 private:
  Paint paint_of(const std::string& style, bool text) const;
  void stroke(const Points& line, const Vector3f& colour, double width);
  void text(const SvgItem& item, const Paint& paint);

  Image image_;
  std::map<std::string, Rules, std::less<>> sheet_;
};

Paint Painter::paint_of(const std::string& style, bool text) const {
  Rules rules;
  if (text) rules["fill"] = "#26313f";
  const auto add_classes = [&](std::string_view names) {
    while (!names.empty()) {
      const std::string_view name = names.substr(0, names.find(' '));
      names.remove_prefix(std::min(names.size(), name.size() + 1));
      const auto found = sheet_.find(name);
      if (found == sheet_.end()) continue;
      for (const auto& [key, value] : found->second)
        if (!(text && key == "stroke")) rules[key] = value;
      if (name == "halo") rules.insert_or_assign("halo", std::string("yes"));
    }
  };
  if (style.find('=') == std::string::npos) {
    add_classes(style);
  } else {
    std::string_view rest = style;
    while (true) {
      const std::size_t open = rest.find("=\""), close = rest.find('"', open + 2);
      if (open == std::string_view::npos || close == std::string_view::npos) break;
      std::string_view key = rest.substr(0, open);
      while (key.starts_with(' ')) key.remove_prefix(1);
      const std::string_view value = rest.substr(open + 2, close - open - 2);
      if (key == "class")
        add_classes(value);
      else
        rules[std::string(key)] = value;
      rest.remove_prefix(close + 1);
    }
  }
  Paint paint;
  const auto rule = [&](const char* key) -> std::string_view {
    const auto found = rules.find(key);
    return found == rules.end() ? std::string_view() : found->second;
  };
  if (!rule("fill").empty()) paint.fill = colour_of(rule("fill"));
  paint.stroke = colour_of(rule("stroke"));
  paint.opacity = static_cast<float>(number_of(rule("fill-opacity"), 1));
  // ".7" begins without its nought.
  std::string width(rule("stroke-width"));
  if (width.starts_with('.')) width.insert(std::size_t{0}, 1, '0');
  paint.width = number_of(width, 1);
  paint.even_odd = rule("fill-rule") == "evenodd";
  paint.halo = !rule("halo").empty();
  return paint;
}

// "M x y L x y ... Z" as svg_path writes it.
struct Path {
  std::vector<Points> lines;
  std::vector<bool> closed;
};
Path read_path(std::string_view data) {
  Path out;
  const char* at = data.data();
  const char* const end = at + data.size();
  const auto number = [&] {
    while (at < end && *at == ' ') ++at;
    double value = 0;
    at = std::from_chars(at, end, value).ptr;
    return value;
  };
  while (at < end) {
    const char command = *at++;
    if (command == 'Z' && !out.closed.empty()) {
      out.closed.back() = true;
    } else if (command == 'M' || command == 'L') {
      if (command == 'M') out.lines.emplace_back(), out.closed.push_back(false);
      const double x = number(), y = number();
      if (!out.lines.empty()) out.lines.back().emplace_back(x, y);
    }
  }
  return out;
}

// The union of its segments' rectangles and of discs at the joints, as one polygon set with nonzero winding: all of
// them run the same way round.
void Painter::stroke(const Points& line, const Vector3f& colour, double width) {
  const double half = std::max(width, 0.8) / 2;
  const float strength = static_cast<float>(std::min(1.0, width / 0.8));
  std::vector<Points> parts;
  for (std::size_t k = 0; k + 1 < line.size(); ++k) {
    const Vector2d d = line[k + 1] - line[k];
    if (!(d.norm() > 0)) continue;
    const Vector2d side = half / d.norm() * Vector2d(-d.y(), d.x());
    parts.push_back({line[k] + side, line[k] - side, line[k + 1] - side, line[k + 1] + side});
    if (k == 0 || half < 0.6) continue;
    Points disc;
    for (int m = 0; m < 12; ++m) {
      const double angle = 3.14159265358979 / 6 * m;
      disc.push_back(line[k] + half * Vector2d(std::cos(angle), std::sin(angle)));
    }
    parts.push_back(std::move(disc));
  }
  fill_polygons(image_, parts, colour, strength);
}

void Painter::text(const SvgItem& item, const Paint& paint) {
  const float size = static_cast<float>(0.72 * item.size);  // digits of a font are lower than its size
  const TextShape shape = text_shape(item.words, size);
  Vector2d at = item.at;
  if (item.anchor != TextAnchor::start) at.x() -= item.anchor == TextAnchor::middle ? shape.width / 2 : shape.width;
  const auto placed = [&](const std::vector<Eigen::Vector2f>& line) {
    Points points;
    for (const auto& p : line) points.push_back(at + p.cast<double>());
    return points;
  };
  const auto write = [&](const std::vector<std::vector<Eigen::Vector2f>>& lines, const Vector3f& colour, double width) {
    for (const auto& line : lines) stroke(placed(line), colour, width);
  };
  const double pen = std::max(1.1, 0.12 * item.size);
  const Vector3f ink = paint.fill.value_or(Vector3f(0, 0, 0));
  if (paint.halo) {
    write(shape.strokes, Vector3f(1, 1, 1), pen + 2.4);
    write(shape.outlines, Vector3f(1, 1, 1), 2.4);
  }
  write(shape.strokes, ink, pen);
  std::vector<Points> filled;
  for (const auto& outline : shape.outlines) filled.push_back(placed(outline));
  fill_polygons(image_, filled, ink);
}

void Painter::draw(const SvgItem& item) {
  if (item.kind == SvgItem::Kind::open_group || item.kind == SvgItem::Kind::close_group) return;
  const Paint paint = paint_of(item.style, item.kind == SvgItem::Kind::text);
  if (item.kind == SvgItem::Kind::text) return text(item, paint);
  Path path;
  if (item.kind == SvgItem::Kind::circle) {
    path.closed = {true};
    path.lines.emplace_back();
    for (int k = 0; k < 24; ++k) {
      const double angle = 3.14159265358979 / 12 * k;
      path.lines.back().push_back(item.at + item.size * Vector2d(std::sin(angle), std::cos(angle)));
    }
  } else {
    path = read_path(item.words);
  }
  if (paint.fill) fill_polygons(image_, path.lines, *paint.fill, paint.opacity, paint.even_odd);
  if (!paint.stroke) return;
  for (std::size_t k = 0; k < path.lines.size(); ++k) {
    if (path.closed[k] && !path.lines[k].empty()) path.lines[k].push_back(path.lines[k].front());
    stroke(path.lines[k], *paint.stroke, paint.width);
  }
}

}  // namespace

std::string svg_png(const Svg& svg, double width, double height, std::string_view style_sheet) {
  if (!(width * height <= max_pixels))
    throw OutputError("the drawing has more than a hundred million pixels; use --svg");
  Painter painter(static_cast<int>(std::ceil(width)), static_cast<int>(std::ceil(height)), style_sheet);
  for (const SvgItem& item : svg.items()) painter.draw(item);
  return png(painter.image());
}

}  // namespace toile
