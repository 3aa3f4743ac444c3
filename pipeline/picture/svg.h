// SPDX-License-Identifier: GPL-3.0-or-later
// A drawing as SVG text: y downwards, numbers in pixels.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace toile {

// Two decimals, no minus zero: a thousandth of a pixel is nothing to see.
std::string svg_number(double value);
// For XML and HTML: UTF-8 (other bytes count as Latin-1), line breaks and tabs stay, other control characters become
// question marks.
std::string svg_escape(std::string_view text);

// "M x y L x y ..." with Z at the end where closed.
std::string svg_path(std::span<const Eigen::Vector2d> points, bool closed);

enum class TextAnchor { start, middle, end };

// What a drawing consists of, in drawing order.
struct SvgItem {
  enum class Kind { path, circle, text, open_group, close_group };
  Kind kind = Kind::path;
  std::string words;  // path data as of svg_path, text, title of a group
  std::string style;
  Eigen::Vector2d at{0, 0};
  double size = 0;  // radius, height of the font
  TextAnchor anchor = TextAnchor::middle;
};

class Svg {
 public:
  // `style`: class names of the style sheet, or attributes.
  void path(const std::string& data, std::string_view style);
  void circle(const Eigen::Vector2d& centre, double radius, std::string_view style);
  void text(const Eigen::Vector2d& at, double size, std::string_view words, std::string_view style,
            TextAnchor anchor = TextAnchor::middle);
  void line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, std::string_view style);
  // A triangle with its tip at `tip`, pointing along `direction`.
  void arrow_head(const Eigen::Vector2d& tip, const Eigen::Vector2d& direction, double length, std::string_view style);
  void open_group(std::string_view title);
  void close_group();

  std::span<const SvgItem> items() const { return items_; }
  std::string finish(double width, double height, std::string_view title, std::string_view style_sheet) const;

 private:
  std::vector<SvgItem> items_;
};

// The drawing as a picture, PNG bytes: rules `.name{key:value;...}` of the style sheet and attributes of the items;
// fill, fill-opacity, fill-rule, stroke and stroke-width are followed, dashes are not. Throws OutputError where the
// program was built without stb, and above a hundred million pixels.
std::string svg_png(const Svg& svg, double width, double height, std::string_view style_sheet);

}  // namespace toile
