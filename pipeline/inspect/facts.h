// SPDX-License-Identifier: GPL-3.0-or-later
// What the texts of an inspection, for reading and for programs, say alike.
#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/inspect/inspect.h"

namespace toile {

// Throws GeometryError with loop and place where the face has no valid trim.
InspectedPanel inspect(TrimmedSurface face, const InspectOptions& options);

// body(k) for every k below `count`, on `threads` threads (0: one for each core); the GeometryErrors thrown, null where
// there was none.
std::vector<std::exception_ptr> each_panel(std::size_t count, int threads,
                                           const std::function<void(std::size_t)>& body);
// `refused`, then their messages. Throws the first where no panel is left.
std::vector<std::string> refusals(std::vector<std::string> refused, const std::vector<std::exception_ptr>& errors);

// What is said of the file as a whole; no panels.
Inspection facts_of(PanelFile file);
// The panel's warnings and notes, after those of the file.
void append_messages(const InspectedPanel& panel, Inspection& facts);

// Loops by the file's number, with their length [unit of the net].
std::vector<std::pair<const TrimLoop*, double>> loops_in_file_order(const InspectedPanel& panel);
int curves_in_file(const TrimLoop& loop);
double gap_as_read(const InspectedPanel& panel, int loop);
double perimeter(const InspectedPanel& panel);  // m
double area(const InspectedPanel& panel);       // m2
std::ptrdiff_t count_cells(const InspectedPanel& panel, CellKind kind);
const char* name(LoopKind kind);
const char* name(Disposition disposition);

}  // namespace toile
