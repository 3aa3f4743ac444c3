// SPDX-License-Identifier: GPL-3.0-or-later
// --degree, --span and --spans of inspect and convert.
#pragma once

#include <string>

#include "pipeline/inspect/inspect.h"
#include "pipeline/program/command.h"

namespace toile {

struct RefinementArguments {
  std::string span;
  int degree = 0, spans = 0;
};

void add_refinement(Command& command, RefinementArguments& arguments);
InspectOptions options_of(const RefinementArguments& arguments);

// A positive length with or without a unit [m]. Throws UsageError naming the option.
double length_option(const std::string& text, const char* option);

}  // namespace toile
