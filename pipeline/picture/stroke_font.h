// SPDX-License-Identifier: GPL-3.0-or-later
// Letters made of strokes, for labels in pictures.
#pragma once

#include <Eigen/Core>
#include <string_view>
#include <vector>

namespace toile {

// Code points of UTF-8; bytes that aren't count as Latin-1.
std::vector<char32_t> code_points(std::string_view text);

// Whether the font has every character of the text.
bool has_strokes(std::string_view text);

// Centre lines of a line of text, y downwards from the baseline (negative above it); `size` is the height of a digit.
// A character that the font lacks is a box.
struct TextStrokes {
  std::vector<std::vector<Eigen::Vector2f>> lines;
  float width = 0;
};
TextStrokes text_strokes(std::string_view text, float size);

}  // namespace toile
