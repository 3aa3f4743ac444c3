// SPDX-License-Identifier: GPL-3.0-or-later
// Any bytes give panels or an InputError; what gives panels comes back exactly when its records are written anew.
// tests/fuzz/run iges SECONDS
#include "io/iges.h"

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "fuzz/cpu_limit.h"
#include "geometry/error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const toile::CpuLimit limit;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    const toile::PanelFile file = toile::parse_iges(text, "fuzz.igs");
    const toile::RoundtripReport report = toile::roundtrip(file, toile::IgesMode::rewrite);
    for (const std::string& difference : report.differences) std::fprintf(stderr, "%s\n", difference.c_str());
    if (!report.exact()) std::abort();
  } catch (const toile::InputError&) {
  }
  return 0;
}
