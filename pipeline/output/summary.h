// SPDX-License-Identifier: GPL-3.0-or-later
// What a drape says at its end: numbers, warnings, what to open, how to go on.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/run/measures.h"
#include "pipeline/run/run.h"

namespace toile {

// The limit is held at its points; where the cloth between them is strained much farther, they lie too far apart: a
// warning that names the strains and a span that would hold them, or, where it is stretched ten times as far and more,
// a failed check.
struct BetweenPoints {
  std::string text;     // empty where there is nothing to say
  bool failed = false;  // what is drawn is no cloth of that limit
};
BetweenPoints strained_between_points(const Build& build, const StateMeasures& measures);

// Lines for people; `wall_seconds` from the call to the last file.
std::vector<std::string> summary(const Build& build, const RunResult& result, const StateMeasures& measures,
                                 double wall_seconds);

// The results that are there, each with the program that opens it.
std::vector<std::string> results_to_open(const std::filesystem::path& directory, const std::string& scene);

// A word of a command line as a shell wants it: quoted where it has to be.
std::string shell_word(const std::string& word);

// The command that goes on with a run that was stopped; `command` is that of the run, without directory and checkpoint.
std::string resume_command(const std::string& command, const std::filesystem::path& directory);

}  // namespace toile
