// SPDX-License-Identifier: GPL-3.0-or-later
// A picture in memory, lines and letters on it, and PNG bytes.
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

namespace toile {

// Linear rgb, 0..1, rows from the top.
struct Image {
  Image(int w, int h) : width(w), height(h), linear(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}
  Eigen::Vector3f& at(int x, int y) {
    return linear[static_cast<std::size_t>(x) + static_cast<std::size_t>(width) * static_cast<std::size_t>(y)];
  }
  // Mixes a colour in; outside the picture nothing happens.
  void blend(int x, int y, const Eigen::Vector3f& colour, float cover);

  int width, height;
  std::vector<Eigen::Vector3f> linear;
};

// Fills the polygons, closed from their last point to the first; where they overlap, by nonzero winding or even-odd.
// Edges are antialiased.
void fill_polygons(Image& image, const std::vector<std::vector<Eigen::Vector2d>>& polygons,
                   const Eigen::Vector3f& colour, float opacity = 1, bool even_odd = false);

// A line of text as shapes, y downwards from the baseline: strokes of our own font where it has every character, else
// outlines of the machine's fonts, else strokes with boxes for what is missing.
struct TextShape {
  std::vector<std::vector<Eigen::Vector2f>> strokes;   // centre lines
  std::vector<std::vector<Eigen::Vector2f>> outlines;  // closed, nonzero winding
  float width = 0;
};
TextShape text_shape(std::string_view text, float size);

// Text of digit height `size` [pixels], its baseline at y, from x to the right.
void draw_text(Image& image, float x, float y, float size, std::string_view text, const Eigen::Vector3f& colour);
float text_width(std::string_view text, float size);

std::string png(const Image& image);  // sRGB, 8 bits

}  // namespace toile
