// A drawing as SVG text: y downwards, numbers in pixels.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <string_view>

namespace toile {

// Two decimals, no minus zero: a thousandth of a pixel is nothing to see.
std::string svg_number(double value);
std::string svg_escape(std::string_view text);

// "M x y L x y ..." with Z at the end where closed.
std::string svg_path(std::span<const Eigen::Vector2d> points, bool closed);

enum class TextAnchor { start, middle, end };

class Svg {
 public:
  // `style`: class names of the sheet in svg.cpp, or attributes.
  void path(const std::string& data, std::string_view style);
  void circle(const Eigen::Vector2d& centre, double radius, std::string_view style);
  void text(const Eigen::Vector2d& at, double size, std::string_view words, std::string_view style,
            TextAnchor anchor = TextAnchor::middle);
  void line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, std::string_view style);
  // A triangle with its tip at `tip`, pointing along `direction`.
  void arrow_head(const Eigen::Vector2d& tip, const Eigen::Vector2d& direction, double length, std::string_view style);
  void open_group(std::string_view title);
  void close_group();

  std::string finish(double width, double height, std::string_view title, std::string_view style_sheet) const;

 private:
  std::string body_;
};

}  // namespace toile
