// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace toile {

// "0.1.0", as in CMakeLists.txt.
const char* version();

}  // namespace toile
