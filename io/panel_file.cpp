#include "io/panel_file.h"

#include <algorithm>
#include <cctype>

#include "geometry/error.h"
#include "io/dxf.h"
#include "io/pattern_json.h"

namespace toile {

PanelFile read_panels(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (ending == ".json" || ending == ".jsonc") return read_pattern(path).file;
  if (ending == ".dxf") {
#ifdef TOILE_HAS_DXF
    return read_dxf(path);
#else
    throw InputError(path.string() + ": this program was built without dxflib: it reads no DXF");
#endif
  }
  return read_iges(path);
}

}  // namespace toile
