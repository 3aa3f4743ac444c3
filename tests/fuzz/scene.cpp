// SPDX-License-Identifier: GPL-3.0-or-later
// Any bytes as a scene file: a scene or an InputError, nothing else. Files beside the scene are those of a sample.
#include "pipeline/scene/scene.h"

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "fuzz/cpu_limit.h"
#include "geometry/error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const toile::CpuLimit limit;
  static const std::filesystem::path place = std::filesystem::path(TOILE_SAMPLES) / "skirt_panel" / "scene.toml";
  try {
    toile::parse_scene({reinterpret_cast<const char*>(data), size}, place);
  } catch (const toile::InputError&) {
  }
  return 0;
}
