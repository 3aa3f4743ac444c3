// SPDX-License-Identifier: GPL-3.0-or-later
// Letters of the machine's fonts, where FreeType and fontconfig are at hand (TOILE_FONTS).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string_view>
#include <vector>

namespace toile {

// Outlines of a line of text, to be filled with nonzero winding: closed polygons, y downwards from the baseline; `size`
// is the height of a capital. Each character comes from the sans-serif font or, where that lacks it, from the font that
// fontconfig names for it; one that no font has is a box. Letters stand side by side as they come: scripts that join or
// run from right to left are spelt, not set.
struct TextOutlines {
  std::vector<std::vector<Eigen::Vector2f>> polygons;
  float width = 0;
};

// Nothing where the program was built without fonts or the machine has none.
std::optional<TextOutlines> text_outlines(std::string_view text, float size);

}  // namespace toile
