// Panels from any file that holds them.
#pragma once

#include <filesystem>

#include "io/iges.h"

namespace toile {

// Sewing patterns (.json, .jsonc), pattern pieces (.dxf, where the program was built with dxflib); any other ending is
// read as IGES. Throws InputError.
PanelFile read_panels(const std::filesystem::path& path);

}  // namespace toile
