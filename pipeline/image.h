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

// Text of digit height `size` [pixels], its baseline at y, from x to the right.
void draw_text(Image& image, float x, float y, float size, std::string_view text, const Eigen::Vector3f& colour);
float text_width(std::string_view text, float size);

std::string png(const Image& image);  // sRGB, 8 bits

}  // namespace toile
