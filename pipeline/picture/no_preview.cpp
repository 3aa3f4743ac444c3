// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/error.h"
#include "pipeline/picture/preview.h"
#include "pipeline/picture/svg.h"

namespace toile {

bool preview_available() {
  return false;
}

std::string preview_png(const Frame&, const PreviewOptions&) {
  throw OutputError("this program was built without Embree and stb: it draws no preview");
}

std::string svg_png(const Svg&, double, double, std::string_view) {
  throw OutputError("this program was built without Embree and stb: it writes no PNG; use --svg");
}

}  // namespace toile
