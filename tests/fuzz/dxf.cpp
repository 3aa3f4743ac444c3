// SPDX-License-Identifier: GPL-3.0-or-later
// Any bytes as a DXF drawing: panels or an InputError, nothing else.
#include "io/dxf.h"

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "fuzz/cpu_limit.h"
#include "geometry/error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const toile::CpuLimit limit;
  try {
    toile::parse_dxf({reinterpret_cast<const char*>(data), size}, "fuzz.dxf");
  } catch (const toile::Error&) {
  }
  return 0;
}
