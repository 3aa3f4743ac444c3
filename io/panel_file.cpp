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

void leave_out_invalid(PanelFile& file) {
  const bool any = !file.panels.empty();
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
  if (any && file.panels.empty()) throw GeometryError(file.refused.back());
}

}  // namespace toile
