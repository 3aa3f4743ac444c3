#include "pipeline/version.h"

namespace toile {

const char* version() {
  return TOILE_VERSION;
}

}  // namespace toile
