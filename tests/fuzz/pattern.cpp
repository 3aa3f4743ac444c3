// SPDX-License-Identifier: GPL-3.0-or-later
// Any bytes as a sewing pattern: panels or an InputError, nothing else.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "fuzz/cpu_limit.h"
#include "geometry/error.h"
#include "io/pattern_json.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const toile::CpuLimit limit;
  try {
    toile::parse_pattern({reinterpret_cast<const char*>(data), size}, "fuzz.json");
  } catch (const toile::Error&) {
  }
  return 0;
}
