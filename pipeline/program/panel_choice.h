// SPDX-License-Identifier: GPL-3.0-or-later
// --size, --unit and --outline of the commands that read panel files.
#pragma once

#include "io/panel_file.h"
#include "pipeline/program/command.h"

namespace toile {

inline void add_choice(Command& command, PanelChoice& choice) {
  command.text("--size SIZE", choice.size, "DXF: the size to read, or all (default: the file's sample size)")
      .text("--unit UNIT", choice.unit, "DXF: mm, cm, m, inch or ft (default: what the file says)")
      .text("--outline LINE", choice.outline, "DXF: cut, or sew for panels cut at their sew lines (default: cut)");
}

}  // namespace toile
