// Any bytes give panels or an InputError; what gives panels comes back exactly when its records are written anew.
// fuzz_iges -timeout=1 FINDINGS tests/corpus/iges tests/corpus/iges/broken
#include <cstdint>
#include <cstdlib>

#include "geometry/error.h"
#include "io/iges.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    const toile::PanelFile file = toile::parse_iges(text, "fuzz.igs");
    if (!toile::roundtrip(file, toile::IgesMode::rewrite).exact()) std::abort();
  } catch (const toile::InputError&) {
  }
  return 0;
}
