// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/picture/svg.h"

#include <array>
#include <charconv>
#include <cmath>

#include "io/xml_text.h"
#include "pipeline/base/json_text.h"

namespace toile {

std::string svg_number(double value) {
  const double rounded = std::round(100 * value) / 100;
  std::array<char, 64> text;
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), rounded == 0 ? 0.0 : rounded).ptr};
}

std::string svg_escape(std::string_view text) {
  std::string valid = utf8(std::string(text));
  // XML has no place for other control characters.
  for (char& c : valid) {
    if ((static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t') || c == 0x7f) c = '?';
  }
  return xml_text(valid);
}

std::string svg_path(std::span<const Eigen::Vector2d> points, bool closed) {
  std::string out;
  for (const Eigen::Vector2d& p : points) {
    out += out.empty() ? 'M' : 'L';
    out += svg_number(p.x()) + ' ' + svg_number(p.y());
  }
  return closed ? out + 'Z' : out;
}

namespace {

std::string attributes(std::string_view style) {
  // A style is either attributes or the name of a class.
  if (style.find('=') != std::string_view::npos) return ' ' + std::string(style);
  return style.empty() ? "" : " class=\"" + std::string(style) + '"';
}

}  // namespace

void Svg::path(const std::string& data, std::string_view style) {
  items_.push_back({SvgItem::Kind::path, data, std::string(style)});
}

void Svg::circle(const Eigen::Vector2d& centre, double radius, std::string_view style) {
  items_.push_back({SvgItem::Kind::circle, {}, std::string(style), centre, radius});
}

void Svg::text(const Eigen::Vector2d& at, double size, std::string_view words, std::string_view style,
               TextAnchor anchor) {
  items_.push_back({SvgItem::Kind::text, std::string(words), std::string(style), at, size, anchor});
}

void Svg::line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, std::string_view style) {
  const std::array<Eigen::Vector2d, 2> ends{a, b};
  path(svg_path(ends, false), style);
}

void Svg::arrow_head(const Eigen::Vector2d& tip, const Eigen::Vector2d& direction, double length,
                     std::string_view style) {
  const Eigen::Vector2d d = direction.stableNormalized();
  const Eigen::Vector2d side(-d.y(), d.x());
  const std::array<Eigen::Vector2d, 3> corners{tip, tip - length * d + 0.42 * length * side,
                                               tip - length * d - 0.42 * length * side};
  path(svg_path(corners, true), style);
}

void Svg::open_group(std::string_view title) {
  items_.push_back({SvgItem::Kind::open_group, std::string(title), {}});
}
void Svg::close_group() {
  items_.push_back({SvgItem::Kind::close_group, {}, {}});
}

std::string Svg::finish(double width, double height, std::string_view title, std::string_view style_sheet) const {
  static constexpr std::array<const char*, 3> anchors{"start", "middle", "end"};
  std::string body;
  for (const SvgItem& item : items_) {
    const std::string style = attributes(item.style);
    const auto place = [&](const char* x, const char* y) {
      return std::string(" ") + x + "=\"" + svg_number(item.at.x()) + "\" " + y + "=\"" + svg_number(item.at.y()) + '"';
    };
    switch (item.kind) {
      case SvgItem::Kind::path:
        body += "<path" + style + " d=\"" + item.words + "\"/>\n";
        break;
      case SvgItem::Kind::circle:
        body += "<circle" + style + place("cx", "cy") + " r=\"" + svg_number(item.size) + "\"/>\n";
        break;
      case SvgItem::Kind::text:
        body += "<text" + style + place("x", "y") + " font-size=\"" + svg_number(item.size) + "\" text-anchor=\"" +
                anchors[static_cast<std::size_t>(item.anchor)] + "\">" + svg_escape(item.words) + "</text>\n";
        break;
      case SvgItem::Kind::open_group:
        body += "<g><title>" + svg_escape(item.words) + "</title>\n";
        break;
      case SvgItem::Kind::close_group:
        body += "</g>\n";
        break;
    }
  }
  const std::string size = svg_number(width) + "\" height=\"" + svg_number(height);
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + size + "\" viewBox=\"0 0 " + svg_number(width) + ' ' +
         svg_number(height) + "\">\n<title>" + svg_escape(title) + "</title>\n<style>\n" + std::string(style_sheet) +
         "</style>\n<rect width=\"" + size + "\" fill=\"#ffffff\"/>\n" + body + "</svg>\n";
}

}  // namespace toile
