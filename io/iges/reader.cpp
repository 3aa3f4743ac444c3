// SPDX-License-Identifier: GPL-3.0-or-later
// From records to panels: faces, or outlines where there are none; a bad face is left out.
#include <map>

#include "geometry/error.h"
#include "io/file.h"
#include "io/iges.h"
#include "io/iges/cards.h"
#include "io/iges/entity.h"
#include "io/iges/face_finding.h"
#include "io/iges/face_reading.h"
#include "io/iges/marks.h"
#include "io/iges/outline_reading.h"
#include "io/limits.h"

namespace toile {

namespace iges {
namespace {

void place(const Eigen::Affine3d& t, TrimmedSurface& panel) {
  if (is_identity(t)) return;
  panel.surface = panel.surface.with_points(t * panel.surface.points());
  for (TrimLoop& loop : panel.loops)
    for (TrimCurve& c : loop.curves)
      if (c.model) c.model = transformed(t, *c.model);
}

// Matrices and scales multiply what the records hold.
void require_moderate(const TrimmedSurface& panel) {
  if (const double size = panel.surface.points().cwiseAbs().maxCoeff(); !(size <= largest_number))
    throw GeometryError("its control points reach " + format_real(size) +
                        ", must stay below 1e25: check the matrices and scales that place it");
}

// Panels without a name take the directory's label where no other panel has it, else a number.
void finish_names(std::vector<TrimmedSurface>& panels, const std::vector<std::string>& labels) {
  std::map<std::string, int> taken;
  for (std::size_t i = 0; i < panels.size(); ++i) ++taken[panels[i].name.empty() ? labels[i] : panels[i].name];
  for (std::size_t i = 0; i < panels.size(); ++i) {
    std::string& name = panels[i].name;
    if (!name.empty()) continue;
    name = !labels[i].empty() && taken[labels[i]] == 1 ? labels[i] : "panel_" + std::to_string(i + 1);
  }
}

std::vector<TrimmedSurface> read_panels(Reading& reading, std::vector<std::string>& refused) {
  std::vector<TrimmedSurface> panels;
  std::vector<const Entry*> entries;
  for (const PlacedFace& face : find_faces(reading)) {
    const Entry& e = *face.entry;
    try {
      // A surface of its own has its matrix applied on reading.
      const bool face_entity = e.type == 143 || e.type == 144 || e.type == 510;
      const Eigen::Affine3d t = face_entity ? Eigen::Affine3d(face.placement * reading.transform(e)) : face.placement;
      for (TrimmedSurface& panel : panels_of(reading, e)) {
        place(t, panel);
        require_moderate(panel);
        reading.sign(panel, e);
        panels.push_back(std::move(panel));
        entries.push_back(&e);
      }
    } catch (const InputError& error) {
      reading.quarantine(e, error.what());  // its parts may be read; the face is not there
    } catch (const GeometryError& error) {
      reading.quarantine(e, reading.file.place(e) + error.what());
    }
  }
  read_marks(reading, entries, panels);
  std::vector<std::string> labels;
  for (const Entry* e : entries) labels.push_back(e->label);
  if (!holds_faces(reading.file)) panels = outline_panels(reading, refused);
  labels.resize(panels.size());
  if (panels.empty() && !reading.first_failure().empty()) throw InputError(reading.first_failure());
  finish_names(panels, labels);
  return panels;
}

// The program that wrote the file. (The product, field 3, names what is in it.)
std::string exporter(const Global& g) {
  std::string out;
  for (const std::string& part : {g.system, g.preprocessor})
    if (!part.empty() && out.find(part) == std::string::npos) out += (out.empty() ? "" : ", ") + part;
  return out;
}

// One line a type for entities that are only kept.
void warn_of_unread(PanelFile& out) {
  std::map<int, int> unread;
  for (const LedgerEntry& row : out.ledger)
    // Notes of a drawing are read though no record is made anew from them.
    if (!find_kind(row.type) && !(row.type == 212 && row.disposition == Disposition::read)) ++unread[row.type];
  for (const auto& [type, count] : unread)
    out.warnings.push_back("entity " + std::to_string(type) + ": " + std::to_string(count) + " kept, not read");
}

PanelFile read_text(std::string text, const std::string& name) {
  PanelFile out;
  out.file = parse_file(std::move(text), name);
  const Global& g = out.file->global;
  out.path = name;
  out.unit = g.unit;
  out.metres_per_unit = g.metres_per_unit;
  out.resolution = g.resolution;
  out.exporter = exporter(g);
  out.up = read_up(out.file->start);
  for (const Entry& e : out.file->entries) ++out.entities[e.type];
  Reading reading(*out.file, out.ledger);
  out.panels = read_panels(reading, out.refused);
  out.warnings = reading.notes.list();
  warn_of_unread(out);
  return out;
}

}  // namespace
}  // namespace iges

PanelFile parse_iges(std::string_view text, const std::string& name) {
  return iges::read_text(std::string(text), name);
}

PanelFile read_iges(const std::filesystem::path& path) {
  return iges::read_text(read_file(path), path.string());
}

}  // namespace toile
