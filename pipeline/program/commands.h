// SPDX-License-Identifier: GPL-3.0-or-later
// The commands of the program, one file each. Each declares its words and returns what it does with them.
#pragma once

#include "pipeline/program/command.h"

namespace toile {

Action drape_command(Command& command);
Action inspect_command(Command& command);
Action convert_command(Command& command);
Action roundtrip_command(Command& command);
Action check_command(Command& command);
Action measure_command(Command& command);
Action study_command(Command& command);
Action init_command(Command& command);
Action presets_command(Command& command);
Action schema_command(Command& command);
Action completion_command(Command& command);
Action help_command(Command& command);

}  // namespace toile
