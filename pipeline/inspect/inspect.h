// SPDX-License-Identifier: GPL-3.0-or-later
// What is in a panel file: entities, loops, cells, constraint points; for reading, for programs and as a drawing.
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/iges.h"
#include "pipeline/build/trace_panel.h"
#include "trimming/quadrature.h"

namespace toile {

// Unset: the file's own knots. (RefineOptions)
struct InspectOptions {
  std::optional<int> degree;
  std::optional<double> span;  // m, largest span length
  std::optional<int> spans;    // per direction
  int threads = 0;             // they share the panels, same results; 0: one for each core
};

// The face's surface, clamped, with these degrees and knots. Throws GeometryError where they can't be had.
NurbsSurface refined(const TrimmedSurface& face, const InspectOptions& options);

struct InspectedPanel : PanelTrace {         // refined as asked; points: those of the knot mesh
  PanelMeasure measure;                      // unit of the net
  int active_control_points = 0;             // their support meets the material
  std::vector<std::pair<int, double>> gaps;  // loop of the file, largest gap as read [parameter plane]
  std::vector<std::string> warnings;
  std::vector<std::string> notes;  // repairs that say nothing against the file
};

struct Inspection {
  std::string file, unit, exporter;
  std::map<int, int> entities;
  std::vector<LedgerEntry> ledger;    // of every entity
  std::vector<std::string> warnings;  // of the file, then of the panels
  std::vector<std::string> notes;     // likewise
  std::vector<InspectedPanel> panels;
  std::string size;                  // of a pattern in several: the one read
  std::vector<std::string> sizes;    // that the file has
  std::vector<std::string> refused;  // panels without a valid trim: panel, loop and place
};

// Throws GeometryError where no panel has a valid trim, with panel, loop and place of the first.
Inspection inspect(PanelFile file, const InspectOptions& options = {});

// The ledger by kind of entity and what became of it, with the first reason and its line (empty for a file
// without entities); for programs, every entity.
std::string ledger_text(const std::vector<LedgerEntry>& ledger);
nlohmann::ordered_json ledger_json(const std::vector<LedgerEntry>& ledger);

// A table of the panels and their curves; `points`: with the constraint points one by one.
std::string inspect_text(const Inspection& inspection, bool points = false);
// One object, for programs: lengths in metres, areas in square metres, parameters as in the file.
std::string inspect_json_text(const Inspection& inspection);
nlohmann::ordered_json inspect_json(const Inspection& inspection);
// The same text as inspect() and inspect_json_text() make, in pieces, but each panel is let go once its text is there:
// for files whose panels take more memory than their text.
struct InspectionText {
  std::vector<std::string> pieces, refused;
};
InspectionText inspect_to_json(PanelFile file, const InspectOptions& options = {});
std::string inspect_svg(const Inspection& inspection);
std::string inspect_png(const Inspection& inspection);   // the same drawing
std::string inspect_html(const Inspection& inspection);  // a page of its own: the drawing, tables, warnings

}  // namespace toile
