// SPDX-License-Identifier: GPL-3.0-or-later
// A file that was read, written again: from its bytes or from its model; and the proof that nothing was lost.
#include <algorithm>
#include <bit>
#include <cstdint>
#include <optional>

#include "geometry/error.h"
#include "io/iges.h"
#include "io/iges/cards.h"
#include "io/iges/entity.h"

namespace toile {

namespace iges {
namespace {

std::string padded(std::string_view text, std::size_t width) {
  std::string out(text.substr(0, width));
  out.resize(width, ' ');
  return out;
}

// The record's lines as they stand; where they are not 64 columns wide, its parameters anew.
std::string replayed(const File& file, const Entry& e) {
  bool regular = true;
  for (int i = e.first; i < e.first + e.count; ++i) {
    const auto next = static_cast<std::size_t>(i) + 1;
    const std::size_t end =
        next < file.parameter_lines.size() ? file.parameter_lines[next].begin : file.parameters.size();
    regular = regular && end - file.parameter_lines[next - 1].begin == 64;
  }
  if (regular) return std::string(file.record(e));
  Tokens tokens;
  tokenize(file.record(e), file.delimiters, tokens);
  if (!tokens.terminated) {
    // No end is put to a record that has none: it would say something else.
    std::string lines(file.record(e));
    lines.resize((lines.size() + 63) / 64 * 64, ' ');
    return lines;
  }
  // Also where the record says another type than its entry: it stays as wrong as it was.
  const std::optional<int> type = tokens.list.empty() ? std::nullopt : parse_integer(tokens.list[0].text);
  Record record(type.value_or(0), file.delimiters);
  for (std::size_t i = 1; i < tokens.list.size(); ++i) record.token(tokens.list[i]);
  return record.finish();
}

// The record written from what its reader made of it; pointers to associativities and properties follow as they were.
std::string rewritten(const File& file, const Entry& e) {
  const Kind* kind = find_kind(e.type);
  if (!kind || !kind->rewrite) return replayed(file, e);
  try {
    Parameters in(file, e);
    Record record(e.type, file.delimiters);
    if (!kind->rewrite(in, record)) return replayed(file, e);
    for (int i = in.position(); i < in.size(); ++i) record.token(in.token(i));
    return record.finish();
  } catch (const Error&) {
    return replayed(file, e);  // quarantined: as it was
  }
}

// The section as it was, but for a unit flag and name that don't name one unit: some readers look at the flag alone and
// take what they don't know for millimetres.
std::string rewritten(const Global& global, const Delimiters& delimiters) {
  constexpr std::size_t flag = 14 - 3, name = 15 - 3;  // the standard's numbers begin at 3 here
  const auto& fields = global.fields;
  const std::optional<Unit> named = name < fields.size() ? unit_of_name(fields[name]) : std::nullopt;
  const bool agree = named && named->flag == global.unit_flag && parse_integer(fields[flag]) == global.unit_flag;
  Record out = Record::global(delimiters);
  for (std::size_t i = 0; i < std::max(fields.size(), name + 1); ++i) {
    if (!agree && i == flag) {
      out.integer(global.unit_flag);
    } else if (!agree && i == name) {
      out.string(global.unit);
    } else if (i < fields.size()) {
      out.token({fields[i], global.is_text[i]});
    } else {
      out.blank();
    }
  }
  return out.finish();
}

// The file from its entries, each record as `record_of` writes it.
template <class RecordOf>
std::string with_records(const File& file, const RecordOf& record_of) {
  std::vector<OutRecord> records;
  for (const Entry& e : file.entries) {
    OutRecord record;
    for (std::size_t k = 0; k < 2; ++k) record.cards[k] = padded(e.cards[k], 72);
    std::replace(record.cards[0].begin() + 64, record.cards[0].end(), ' ', '0');
    record.lines = record_of(e);
    records.push_back(std::move(record));
  }
  std::vector<std::string> start;
  for (std::string_view line : file.start) start.push_back(padded(line, 72));
  return assemble(start, rewritten(file.global, file.delimiters), records);
}

std::string with_surface(const File& file, const Entry& e, const SurfaceChange& change) {
  Parameters in(file, e);
  SplineSurface spline = read_spline_surface(in);
  spline.surface = change(spline.surface);
  Record record(e.type, file.delimiters);
  write(spline, record);
  for (int i = in.position(); i < in.size(); ++i) record.token(in.token(i));
  return record.finish();
}

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

template <class A, class B>
bool same_bits(const A& a, const B& b) {
  return std::equal(std::begin(a), std::end(a), std::begin(b), std::end(b),
                    [](double x, double y) { return same_bits(x, y); });
}

bool same_bits(const KnotVector& a, const KnotVector& b) {
  return a.degree() == b.degree() && same_bits(a.knots(), b.knots());
}

template <class Points>
bool same_points(const Points& a, const Points& b) {
  return a.cols() == b.cols() && same_bits(a.reshaped(), b.reshaped());
}

bool same_curve(const Curve2& a, const Curve2& b) {
  return same_bits(a.knots(), b.knots()) && same_points(a.points(), b.points()) && same_bits(a.weights(), b.weights());
}

// Empty where all parameter curves are bit-equal; else the first that isn't.
std::string curve_difference(const TrimmedSurface& a, const TrimmedSurface& b) {
  if (a.loops.size() != b.loops.size() || a.natural_bounds != b.natural_bounds) return "another number of loops";
  for (std::size_t i = 0; i < a.loops.size(); ++i) {
    const auto &p = a.loops[i].curves, &q = b.loops[i].curves;
    const std::string where = "loop " + std::to_string(i);
    if (p.size() != q.size() || a.loops[i].kind != b.loops[i].kind || a.loops[i].index != b.loops[i].index)
      return where + " has another kind or number of curves";
    for (std::size_t k = 0; k < p.size(); ++k)
      if (p[k].index != q[k].index || p[k].reversed != q[k].reversed || !same_curve(p[k].curve, q[k].curve))
        return where + ", curve " + std::to_string(k) + " differs";
  }
  return {};
}

}  // namespace
}  // namespace iges

std::string format_iges(const PanelFile& file, IgesMode mode) {
  if (file.file) {
    if (mode == IgesMode::replay) return file.file->text;
    return iges::with_records(*file.file, [&](const iges::Entry& e) { return iges::rewritten(*file.file, e); });
  }
  std::vector<OutputFace> faces;
  for (const TrimmedSurface& panel : file.panels) faces.push_back({panel, panel.name, 0, {}});
  IgesHeader header;
  if (!file.unit.empty()) header.unit = file.unit;
  header.resolution = file.resolution;
  return format_iges(faces, header).text;
}

std::string format_iges(const PanelFile& file, const SurfaceChange& change) {
  const iges::File& records = *file.file;
  return iges::with_records(records, [&](const iges::Entry& e) {
    const bool bad =
        file.ledger[static_cast<std::size_t>((e.sequence - 1) / 2)].disposition == Disposition::quarantined;
    if (e.type != 128 || bad) return iges::replayed(records, e);
    try {
      return iges::with_surface(records, e, change);
    } catch (const InputError&) {
      return iges::replayed(records, e);  // no reader could take it
    }
  });
}

bool RoundtripReport::exact() const {
  return faces_lost == 0 && entities_lost == 0 && knots_equal && weights_equal && points_equal &&
         parameter_curves_equal;
}

RoundtripReport roundtrip(const PanelFile& original, IgesMode mode) {
  using namespace iges;
  RoundtripReport report;
  const PanelFile again = parse_iges(format_iges(original, mode), original.path);
  report.faces = static_cast<int>(original.panels.size());
  report.faces_lost = std::max(0, report.faces - static_cast<int>(again.panels.size()));
  for (const auto& [type, count] : original.entities) {
    const auto found = again.entities.find(type);
    const int left = found == again.entities.end() ? 0 : found->second;
    report.entities += count;
    if (left >= count) continue;
    report.entities_lost += count - left;
    report.differences.push_back("entity " + std::to_string(type) + ": " + std::to_string(count - left) + " of " +
                                 std::to_string(count) + " lost");
  }
  auto differs = [&](bool& flag, const TrimmedSurface& panel, const std::string& what) {
    if (flag) report.differences.push_back("panel '" + panel.name + "' (" + panel.source + "): " + what);
    flag = false;
  };
  const std::size_t common = std::min(original.panels.size(), again.panels.size());
  for (std::size_t i = 0; i < common; ++i) {
    const TrimmedSurface &a = original.panels[i], &b = again.panels[i];
    if (!same_bits(a.surface.u(), b.surface.u()) || !same_bits(a.surface.v(), b.surface.v()))
      differs(report.knots_equal, a, "knots differ");
    if (!same_bits(a.surface.weights(), b.surface.weights())) differs(report.weights_equal, a, "weights differ");
    if (!same_points(a.surface.points(), b.surface.points())) differs(report.points_equal, a, "control points differ");
    const std::string difference = curve_difference(a, b);
    if (!difference.empty()) differs(report.parameter_curves_equal, a, difference);
  }
  if (report.faces_lost > 0) report.differences.push_back(std::to_string(report.faces_lost) + " faces lost");
  return report;
}

}  // namespace toile
