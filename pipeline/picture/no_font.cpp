// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/picture/font.h"

namespace toile {

std::optional<TextOutlines> text_outlines(std::string_view, float) {
  return std::nullopt;
}

}  // namespace toile
