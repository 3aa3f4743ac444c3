// Letters made of strokes, for labels in pictures.
#pragma once

#include <Eigen/Core>
#include <string_view>
#include <vector>

namespace toile {

// Centre lines of a line of text, y downwards from the baseline (negative above it); `size` is the height of a digit.
// UTF-8; unknown characters leave a gap.
struct TextStrokes {
  std::vector<std::vector<Eigen::Vector2f>> lines;
  float width = 0;
};
TextStrokes text_strokes(std::string_view text, float size);

}  // namespace toile
