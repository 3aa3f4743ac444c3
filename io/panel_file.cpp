// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/panel_file.h"

#include <algorithm>
#include <cctype>

#include "geometry/error.h"
#include "io/dxf.h"
#include "io/encoding.h"
#include "io/pattern_json.h"
#include "trimming/loops.h"

namespace toile {

PanelFile read_panels(const std::filesystem::path& path, const PanelChoice& choice) {
  std::string ending = path.extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (ending == ".dxf") {
#ifdef TOILE_HAS_DXF
    return read_dxf(path, choice);
#else
    throw InputError(path.string() + ": this program was built without dxflib: it reads no DXF");
#endif
  }
  if (choice != PanelChoice())
    throw InputError(path.string() +
                     ": size, unit and outline choose among what a DXF file holds; this file leaves no choice");
  if (ending == ".json" || ending == ".jsonc") return read_pattern(path).file;
  PanelFile out = read_iges(path);
  for (TrimmedSurface& panel : out.panels) panel.name = to_utf8(panel.name);
  return out;
}

void require_panels(const PanelFile& file) {
  if (!file.panels.empty()) return;
  if (!file.refused.empty()) throw GeometryError(file.refused.front());
  throw InputError(file.path + ": holds no face and no surface");
}

void leave_out_invalid(PanelFile& file) {
  std::erase_if(file.panels, [&](const TrimmedSurface& panel) {
    try {
      TrimmedSurface copy = panel;
      validate_loops(copy);
      return false;
    } catch (const GeometryError& error) {
      file.refused.emplace_back(error.what());
      return true;
    }
  });
  require_panels(file);
}

}  // namespace toile
