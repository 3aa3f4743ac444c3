// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/program/refinement.h"

#include <fmt/format.h>

#include "geometry/error.h"
#include "pipeline/scene/units.h"

namespace toile {

void add_refinement(Command& command, RefinementArguments& a) {
  command.integer("--degree N", a.degree, 1, 5, "Degree (default: the file's)")
      .text("--span LENGTH", a.span, "Longest knot span, m or with a unit (\"20 mm\")")
      .integer("--spans N", a.spans, 1, 10000, "Spans per direction; not with --span")
      .excludes("--spans", "--span");
}

InspectOptions options_of(const RefinementArguments& a) {
  InspectOptions options;
  if (a.degree > 0) options.degree = a.degree;
  if (a.spans > 0) options.spans = a.spans;
  if (!a.span.empty()) options.span = length_option(a.span, "--span");
  return options;
}

double length_option(const std::string& text, const char* option) {
  try {
    const double length = parse_quantity(text, dimension::length);
    if (length > 0) return length;
  } catch (const InputError& error) {
    throw UsageError(fmt::format("{}: {}", option, error.what()));
  }
  throw UsageError(fmt::format("{} must be positive", option));
}

}  // namespace toile
