#include "geometry/error.h"
#include "pipeline/preview.h"

namespace toile {

bool preview_available() {
  return false;
}

std::string preview_png(const Frame&, const PreviewOptions&) {
  throw OutputError("this program was built without Embree and stb: it draws no preview");
}

}  // namespace toile
