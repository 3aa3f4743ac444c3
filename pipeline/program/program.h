// SPDX-License-Identifier: GPL-3.0-or-later
// The `toile` program: options in, exit code out.
#pragma once

namespace toile {

int run_program(int argc, char** argv);

}  // namespace toile
