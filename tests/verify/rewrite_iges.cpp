// SPDX-License-Identifier: GPL-3.0-or-later
// rewrite_iges [--faces] IN OUT: read, and write every known record from the model instead of replaying it; with
// --faces a new file of nothing but the panels, as a drape writes them.
#include <cstdio>
#include <cstring>
#include <exception>
#include <vector>

#include "io/file.h"
#include "io/iges.h"

namespace {

std::string new_faces(const toile::PanelFile& file) {
  std::vector<toile::OutputFace> faces;
  for (const toile::TrimmedSurface& panel : file.panels) faces.push_back({panel, panel.name, 0, {}});
  toile::IgesHeader header;
  header.unit = file.unit;
  if (file.resolution > 0) header.resolution = file.resolution;
  return toile::format_iges(faces, header).text;
}

}  // namespace

int main(int count, char** arguments) {
  const bool faces = count == 4 && std::strcmp(arguments[1], "--faces") == 0;
  if (count != 3 && !faces) {
    std::fprintf(stderr, "usage: rewrite_iges [--faces] IN OUT\n");
    return 2;
  }
  try {
    const toile::PanelFile file = toile::read_iges(arguments[count - 2]);
    toile::write_file(arguments[count - 1],
                      faces ? new_faces(file) : toile::format_iges(file, toile::IgesMode::rewrite));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
