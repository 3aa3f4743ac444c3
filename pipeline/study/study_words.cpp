// SPDX-License-Identifier: GPL-3.0-or-later
// Meaning and defaults of the keys of studies.
#include <span>

#include "pipeline/study/schema.h"

namespace toile {

std::span<const KeyWords> study_words() {
  static constexpr KeyWords words[] = {
      {"title", "Title of tables and plots (default: the study's name)"},
      {"kind", "Errors against a reference, or a verdict on each run (default: convergence)"},
      {"repeats", "How often each case runs, for timings (default: 1)"},
      {"columns", "Entries of report.json that the table shows too"},
      {"limits", "Limits of each run"},
      {"check", "What makes the study fail"},
      {"scene", "The scene file, relative to the study"},
      {"set", "Scene keys for every run"},
      {"quantity", "What is looked at"},
      {"reference", "What it is compared with"},
      {"rows", "An axis whose entries set several scene keys, each with an optional label"},
      {"vary", "Axes: scene keys with the values that they take, from coarse to fine"},
      {"series", "Several series of runs, each with what it changes"},

      {"limits.seconds", "Wall time (default: 600)"},
      {"limits.megabytes", "Address space (default: 4096)"},
      {"check.error", "Largest error of the last case of a series"},
      {"quantity.of", "A measure or an entry of report.json (points.0.position.2), or several", true},
      {"quantity.name", "Its name in tables and plots"},
      {"quantity.unit", "Its unit in tables and plots"},
      {"reference.kind", "The finest run, an extrapolation, a value, or an entry of a table", true},
      {"reference.relative", "Errors as shares of the reference (default: false)"},
      {"reference.of", "The series that gives it (default: each its own)"},
      {"reference.order", "Order of the extrapolation (default: observed)"},
      {"reference.value", "A number or a vector"},
      {"reference.scale", "Factors of the values (default: 1)"},
      {"reference.uncertainty", "How far the reference may be off"},
      {"reference.source", "Where it comes from"},
      {"reference.file", "A CSV file, relative to the study"},
      {"reference.column", "A column of it, or several"},
      {"reference.where", "Column = number: the row"},
      {"series.name", "Its name (default: by order)"},
      {"series.scene", "Its scene (default: the study's)"},
      {"series.set", "Scene keys for every run of it"},
      {"series.quantity", "What is looked at (default: the study's)"},
      {"series.reference", "What it is compared with (default: the study's)"},
      {"series.rows", "An axis whose entries set several scene keys, each with an optional label"},
      {"series.vary", "Axes: scene keys with the values that they take, from coarse to fine"},
  };
  return words;
}

}  // namespace toile
