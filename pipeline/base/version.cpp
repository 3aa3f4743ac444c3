// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/base/version.h"

namespace toile {

const char* version() {
  return TOILE_VERSION;
}

}  // namespace toile
