// SPDX-License-Identifier: GPL-3.0-or-later
#include <nlohmann/json.hpp>
#include <utility>

#include "pipeline/base/json_writer.h"
#include "pipeline/inspect/facts.h"

namespace toile {
namespace {

using Layout = JsonWriter::Layout;

constexpr int panel_depth = 2;  // where a panel's object stands: in the array of an object

void write_point(JsonWriter& json, const InspectedPanel& panel, const ConstraintPoint& point) {
  const Eigen::Vector3d x = panel.face.metres_per_unit * panel.face.surface(point.u, point.v);
  json.begin_object(Layout::one_line).member("kind", name(point.kind)).member("u", point.u).member("v", point.v);
  json.key("position").values(x);
  if (point.loop >= 0) json.member("loop", point.loop).member("curve", point.curve).member("t", point.t);
  json.member("used", point.used);
  if (!point.used) json.member("why", point.why);
  json.end_object();
}

void write_trims(JsonWriter& json, const InspectedPanel& panel) {
  json.key("loops").begin_array();
  for (const auto& [loop, length] : loops_in_file_order(panel)) {
    json.begin_object(Layout::one_line)
        .member("kind", name(loop->kind))
        .member("curves", curves_in_file(*loop))
        .member("length", length * panel.face.metres_per_unit)
        .member("closed", true)
        .member("gap", gap_as_read(panel, loop->index))
        .end_object();
  }
  json.end_array();
  json.key("cells").begin_object(Layout::one_line);
  for (const auto& [what, kind] :
       {std::pair("inside", CellKind::inside), {"cut", CellKind::cut}, {"outside", CellKind::outside}})
    json.member(what, static_cast<std::int64_t>(count_cells(panel, kind)));
  json.end_object();
  json.member("active_control_points", panel.active_control_points);
  const PredicateCounts& counts = panel.topology.counts;  // how often each level of arithmetic decided
  json.key("predicates")
      .begin_object(Layout::one_line)
      .member("signs", counts.coefficient_signs)
      .member("interval", counts.interval)
      .member("exact", counts.exact)
      .member("algebraic", counts.algebraic)
      .end_object();
}

void write_marks(JsonWriter& json, const std::vector<PanelMark>& marks) {
  if (marks.empty()) return;
  json.key("marks").begin_array();
  for (const PanelMark& mark : marks)
    json.begin_object(Layout::one_line)
        .member("kind", name(mark.kind))
        .key("at")
        .values(mark.at)
        .member("text", mark.text)
        .end_object();
  json.end_array();
}

void write_panel(JsonWriter& json, const InspectedPanel& panel) {
  const NurbsSurface& surface = panel.face.surface;
  json.begin_object().member("name", panel.face.name);
  json.key("degree").values(std::array{surface.u().degree(), surface.v().degree()});
  json.key("control_points").values(std::array{surface.count_u(), surface.count_v()});
  json.member("rational", surface.rational());
  json.key("knots").begin_array().values(surface.u().knots()).values(surface.v().knots()).end_array();
  json.key("domain").begin_array(Layout::one_line);
  for (const Interval& range : {surface.u().domain(), surface.v().domain()})
    json.values(std::array{range.min, range.max});
  json.end_array();
  json.member("area", area(panel)).member("perimeter", perimeter(panel));
  write_trims(json, panel);
  write_marks(json, panel.face.marks);
  json.key("constraint_points").begin_array();
  for (const ConstraintPoint& point : panel.points) write_point(json, panel, point);
  json.end_array().end_object();
}

std::string panel_text(const InspectedPanel& panel) {
  constexpr std::size_t point_length = 160;  // about
  std::string out;
  out.reserve(point_length * (panel.points.size() + 8));
  JsonWriter json(out, panel_depth);
  write_panel(json, panel);
  return out;
}

void write_ledger(JsonWriter& json, const std::vector<LedgerEntry>& ledger) {
  json.begin_array();
  for (const LedgerEntry& entry : ledger) {
    json.begin_object(Layout::one_line)
        .member("entry", entry.sequence)
        .member("line", entry.line)
        .member("entity", entry.type)
        .member("form", entry.form)
        .member("disposition", name(entry.disposition));
    if (!entry.why.empty()) json.member("why", entry.why);
    json.end_object();
  }
  json.end_array();
}

void write_strings(JsonWriter& json, const char* key, const std::vector<std::string>& texts) {
  json.key(key).begin_array();
  for (const std::string& text : texts) json.value(text);
  json.end_array();
}

// The whole object: what `facts` says of the file and, in `panels`, the text of each.
std::vector<std::string> pieces_of(const Inspection& facts, std::vector<std::string> panels) {
  std::vector<std::string> pieces;
  std::string text;
  JsonWriter json(text);
  const auto cut = [&] { pieces.push_back(std::exchange(text, {})); };
  json.begin_object().member("file", facts.file).member("unit", facts.unit).member("exporter", facts.exporter);
  write_strings(json, "warnings", facts.warnings);
  json.member("size", facts.size).key("sizes").values(facts.sizes);
  write_strings(json, "notes", facts.notes);
  json.key("entities").begin_object(Layout::one_line);
  for (const auto& [type, count] : facts.entities) json.member(std::to_string(type), count);
  json.end_object().key("panels").begin_array();
  for (std::string& panel : panels) {
    json.text({});  // what stands before it
    cut();
    pieces.push_back(std::move(panel));
  }
  json.end_array();
  write_strings(json, "refused", facts.refused);
  write_ledger(json.key("ledger"), facts.ledger);
  json.end_object();
  cut();
  return pieces;
}

}  // namespace

InspectionText inspect_to_json(PanelFile file, const InspectOptions& options) {
  std::vector<TrimmedSurface> faces = std::move(file.panels);
  Inspection facts = facts_of(std::move(file));
  std::vector<std::string> panels(faces.size());
  std::vector<InspectedPanel> said(faces.size());
  facts.refused = refusals(std::move(facts.refused), each_panel(panels.size(), options.threads, [&](std::size_t k) {
                             InspectedPanel panel = inspect(std::move(faces[k]), options);
                             panels[k] = panel_text(panel);
                             said[k].warnings = std::move(panel.warnings);
                             said[k].notes = std::move(panel.notes);
                           }));
  std::erase_if(panels, [](const std::string& panel) { return panel.empty(); });
  for (const InspectedPanel& panel : said) append_messages(panel, facts);
  InspectionText out;
  out.pieces = pieces_of(facts, std::move(panels));
  out.refused = std::move(facts.refused);
  return out;
}

std::string inspect_json_text(const Inspection& inspection) {
  std::vector<std::string> panels;
  for (const InspectedPanel& panel : inspection.panels) panels.push_back(panel_text(panel));
  std::string out;
  for (const std::string& piece : pieces_of(inspection, std::move(panels))) out += piece;
  return out;
}

nlohmann::ordered_json inspect_json(const Inspection& inspection) {
  return nlohmann::ordered_json::parse(inspect_json_text(inspection));
}

nlohmann::ordered_json ledger_json(const std::vector<LedgerEntry>& ledger) {
  std::string text;
  JsonWriter json(text);
  write_ledger(json, ledger);
  return nlohmann::ordered_json::parse(text);
}

}  // namespace toile
