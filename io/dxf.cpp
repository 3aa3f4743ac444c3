// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/dxf.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "geometry/error.h"
#include "geometry/text.h"
#include "io/dxf/curves.h"
#include "io/dxf/mirror.h"
#include "io/dxf/pieces.h"
#include "io/file.h"
#include "io/limits.h"
#include "io/outlines.h"
#include "trimming/loops.h"

namespace toile {

namespace {

using dxf::Corners;
using dxf::Item;
using dxf::Mirror;
using dxf::Piece;
using Eigen::Vector2d;

constexpr std::uintmax_t max_bytes = std::uintmax_t{256} << 20;
constexpr std::array corner_angles{20.0, 25.0, 30.0, 40.0, 50.0, 60.0, 75.0, 90.0};  // degrees, tried in turn
constexpr double open_corner = 60;  // degrees: open polylines end at corners; only what is surely one cuts them
constexpr double largest_piece = 10, smallest_piece = 0.005;  // m: others are a wrong unit, most likely

// Layers 84 to 87 repeat these as curves, to check the others by.
constexpr std::array<std::pair<std::string_view, std::string_view>, 4> repeats{
    {{"84", "1"}, {"85", "8"}, {"86", "11"}, {"87", "14"}}};

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

// The layer whose content an item is; empty where it repeats what the piece has on that layer.
std::string meant_layer(const Piece& piece, const Item& item) {
  for (const auto& [repeat, original] : repeats) {
    if (item.layer != repeat) continue;
    return piece.on_layer(original) ? std::string() : std::string(original);
  }
  return item.layer;
}

bool is_curve(const Item& item) {
  return !item.lines.empty() || !item.curves.empty();
}

class DxfReader {
 public:
  DxfReader(const std::string& name, const PanelChoice& choice, PanelFile& out)
      : name_(name), choice_(choice), out_(out) {
    out_.path = name;
  }
  void read(std::string_view text);

 private:
  void choose_unit(const dxf::Drawing& drawing);
  void name_what_is_left_out(const dxf::Drawing& drawing);
  std::vector<Piece> in_one_size(std::vector<Piece> pieces, const std::string& sample);
  std::vector<std::size_t> of_size(const std::vector<Piece>& pieces, const std::vector<std::size_t>& same,
                                   const std::string& sample);
  Corners corners(const Piece& piece) const;
  void choose_corners(const std::vector<Piece>& pieces);
  void read_piece(const Piece& piece);
  void read_plain(const Piece& piece);
  std::vector<LooseCurve> boundary(const Piece& piece, std::string_view layer, std::vector<Mirror>& mirrors);
  void add_marks(const Piece& piece, bool sewn, const std::vector<Mirror>& mirrors,
                 std::vector<TrimmedSurface>& panels);
  std::vector<PanelMark> marks_of(const Item& item, const std::string& layer, bool sewn) const;
  void report(const Piece& piece, const Outlines& found);
  void add_panels(const Piece& piece, Outlines found);
  void name_panels();
  std::string line_of(int line) const { return name_ + ":" + std::to_string(line); }
  void warn(int line, const std::string& what) { out_.warnings.push_back(line_of(line) + ": " + what); }
  void note(int line, const std::string& what) { out_.notes.push_back(line_of(line) + ": " + what); }
  void refuse(int line, const std::string& what) { out_.refused.push_back(line_of(line) + ": " + what); }

  const std::string& name_;
  const PanelChoice& choice_;
  PanelFile& out_;
  std::map<std::string, std::pair<double, double>> angles_;  // closed and open, of pieces in several sizes
  std::vector<std::string> sizes_of_panels_;                 // of out_.panels
};

void DxfReader::choose_unit(const dxf::Drawing& drawing) {
  dxf::Unit unit;
  if (!choice_.unit.empty()) {
    const auto called = dxf::unit_called(choice_.unit);
    if (!called) throw InputError(name_ + ": unit is \"" + choice_.unit + "\", must be mm, cm, m, inch or ft");
    unit = *called;
  } else {
    std::string warning;
    unit = dxf::unit_of(drawing, warning);
    if (!warning.empty()) out_.warnings.push_back(name_ + ": " + warning);
  }
  out_.unit = unit.name;
  out_.metres_per_unit = unit.metres;
  out_.resolution = unit.name == "MM" ? 1e-3 : unit.name == "INCH" ? 1e-4 : 1e-6 / unit.metres;
}

void DxfReader::name_what_is_left_out(const dxf::Drawing& drawing) {
  std::set<std::string> blocks;
  for (std::size_t k = 1; k < drawing.blocks.size(); ++k) blocks.insert(drawing.blocks[k].name);
  std::map<std::string, int> missing;  // by block, inserts of it
  for (const dxf::Block& block : drawing.blocks)
    for (const Item& item : block.items)
      if (item.insert && !blocks.contains(item.insert->block)) ++missing[item.insert->block];
  for (const auto& [block, item] : dxf::circular_inserts(drawing))
    warn(item->line, item->type + ": block '" + item->insert->block + "' holds block '" + block->name +
                         "', in which it is inserted; it is left out there");
  for (const dxf::Block& block : drawing.blocks) {
    for (const Item& item : block.items) {
      const auto named = item.insert ? missing.extract(item.insert->block) : decltype(missing)::node_type();
      if (named)
        warn(item.line, item.type + ": there is no block '" + named.key() + "'; it is left out" +
                            (named.mapped() > 1 ? ", " + std::to_string(named.mapped()) + " times" : ""));
      for (const dxf::Polyline& line : item.lines)
        for (const double bulge : line.bulges)
          if (!(std::abs(bulge) < dxf::largest_bulge))
            warn(item.line, item.type + ": a bulge of " + toile::text(bulge) + " is no arc; it is drawn straight");
    }
  }
}

// Of pieces of one name, those of the size that is read.
std::vector<std::size_t> DxfReader::of_size(const std::vector<Piece>& pieces, const std::vector<std::size_t>& same,
                                            const std::string& sample) {
  std::vector<std::string> sizes;
  for (const std::size_t k : same)
    if (std::ranges::find(sizes, pieces[k].size) == sizes.end()) sizes.push_back(pieces[k].size);
  const auto with = [&](const std::string& size) {
    std::vector<std::size_t> out;
    for (const std::size_t k : same)
      if (lower(pieces[k].size) == lower(size)) out.push_back(k);
    return out;
  };
  if (!choice_.size.empty()) {
    std::vector<std::size_t> out = with(choice_.size);
    if (!out.empty()) return out;
    if (sizes.size() == 1 && sizes[0].empty()) return same;
    std::string all;
    for (const std::string& size : sizes) all += (all.empty() ? "" : ", ") + size;
    refuse(pieces[same[0]].line, "piece '" + pieces[same[0]].name + "' has no size " + choice_.size + ", only " + all);
    return {};
  }
  if (sizes.size() == 1) return same;
  std::vector<std::size_t> out = with(sample);
  if (!sample.empty() && !out.empty()) return out;
  // Turn points and grade rules are drawn on the size that the others are made from.
  for (const std::size_t k : same) {
    const auto& items = pieces[k].items;
    if (out.empty() && std::ranges::any_of(items, [](const Item& i) { return i.layer == "2" && i.point; }))
      out = with(pieces[k].size);
  }
  if (out.empty()) out = with(sizes[sizes.size() / 2]);
  warn(pieces[out[0]].line, "piece '" + pieces[out[0]].name + "' has " + std::to_string(sizes.size()) +
                                " sizes and the file's sample size is none of them; size " + pieces[out[0]].size +
                                " is read: --size or size = \"...\" chooses another");
  return out;
}

std::vector<Piece> DxfReader::in_one_size(std::vector<Piece> pieces, const std::string& sample) {
  std::vector<std::string> names;
  std::map<std::string, std::vector<std::size_t>> by_name;
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    if (by_name[pieces[k].name].empty()) names.push_back(pieces[k].name);
    by_name[pieces[k].name].push_back(k);
    const std::string& size = pieces[k].size;
    if (!size.empty() && std::ranges::find(out_.sizes, size) == out_.sizes.end()) out_.sizes.push_back(size);
  }
  const bool all = lower(choice_.size) == "all";
  const auto asked = [&](const std::string& size) { return lower(size) == lower(choice_.size); };
  if (!choice_.size.empty() && !all && std::ranges::none_of(out_.sizes, asked)) {
    std::string have;
    for (const std::string& size : out_.sizes) have += (have.empty() ? "" : ", ") + size;
    throw InputError(name_ + ": there is no size '" + choice_.size + "'" +
                     (have.empty() ? "; its pieces have no sizes" : "; it has " + have));
  }
  out_.size = all ? "all" : !choice_.size.empty() ? choice_.size : sample;
  if (out_.sizes.size() > 1) {
    std::string have;
    for (const std::string& size : out_.sizes) have += (have.empty() ? "" : ", ") + size;
    out_.notes.push_back(name_ + ": it has sizes " + have + (out_.size.empty() ? "" : "; read is " + out_.size) +
                         ": --size or size = \"...\" chooses");
  }
  if (all) return pieces;
  std::vector<std::size_t> kept;
  for (const std::string& name : names) {
    const std::vector<std::size_t> one = of_size(pieces, by_name[name], sample);
    kept.insert(kept.end(), one.begin(), one.end());
  }
  std::ranges::sort(kept);
  std::vector<Piece> out;
  for (const std::size_t k : kept) out.push_back(std::move(pieces[k]));
  return out;
}

Corners DxfReader::corners(const Piece& piece) const {
  Corners out;
  out.near = out_.resolution;
  for (const Item& item : piece.items)
    if (item.layer == "2" && item.point && item.text.empty()) out.turn_points.push_back(*item.point);
  // A boundary of one polyline is cut at its corners, closed by its numbers or nearly so.
  std::size_t entities = 0;
  for (const Item& item : piece.items) entities += meant_layer(piece, item) == "1" && is_curve(item) ? 1 : 0;
  out.closed_angle = corner_angles[0];
  out.open_angle = entities == 1 ? out.closed_angle : open_corner;
  const auto found = angles_.find(piece.name);
  if (found != angles_.end()) std::tie(out.closed_angle, out.open_angle) = found->second;
  return out;
}

// Angles at which every size of a piece has the same number of curves.
void DxfReader::choose_corners(const std::vector<Piece>& pieces) {
  std::map<std::string, std::vector<const Piece*>> by_name;
  for (const Piece& piece : pieces)
    if (!piece.name.empty()) by_name[piece.name].push_back(&piece);
  for (const auto& [name, same] : by_name) {
    std::set<std::string> sizes;
    for (const Piece* piece : same) sizes.insert(piece->size);
    if (same.size() < 2 || sizes.size() < same.size()) continue;  // other pieces of the same name
    const auto counts = [&](const Piece& piece) {
      std::vector<std::size_t> out;
      const Corners rule = corners(piece);
      for (const Item& item : piece.items)
        if (meant_layer(piece, item) == "1" && is_curve(item)) out.push_back(dxf::curves_of(item, rule).size());
      return out;
    };
    const auto agree = [&, &alike = same] {
      const auto first = counts(*alike[0]);
      return std::ranges::all_of(alike, [&](const Piece* piece) { return counts(*piece) == first; });
    };
    if (agree()) continue;
    bool found = false;
    for (std::size_t k = 1; k < corner_angles.size() && !found; ++k) {
      angles_[name] = {corner_angles[k], std::max(open_corner, corner_angles[k])};
      found = agree();
    }
    if (!found) angles_[name] = {corner_angles[0], 180};  // where polylines end
    if (!found && !agree())
      warn(same[0]->line,
           "piece '" + name +
               "': its sizes are drawn with different numbers of curves; a curve's number is of one size only");
  }
}

// The curves of a layer (1 or 14) with cutouts, unfolded.
std::vector<LooseCurve> DxfReader::boundary(const Piece& piece, std::string_view layer, std::vector<Mirror>& mirrors) {
  const Corners rule = corners(piece);
  std::vector<LooseCurve> curves;
  for (std::size_t k = 0; k < piece.items.size(); ++k) {
    const Item& item = piece.items[k];
    const std::string meant = meant_layer(piece, item);
    if ((meant != layer && meant != "11") || !is_curve(item)) continue;
    LooseCurve loose{static_cast<int>(k), {}, dxf::curves_of(item, rule)};
    if (!loose.pieces.empty()) curves.push_back(std::move(loose));
  }
  // A mirror line may be one only once another has been unfolded.
  std::vector<const Item*> lines;
  for (const Item& item : piece.items)
    if (dxf::mirror_of(item)) lines.push_back(&item);
  for (bool unfolded = true; unfolded && !curves.empty();) {
    unfolded = false;
    for (auto line = lines.begin(); line != lines.end() && !unfolded; ++line) {
      const Mirror mirror = *dxf::mirror_of(**line);
      if (!dxf::unfold(curves, mirror, 10 * out_.resolution)) continue;
      mirrors.push_back(mirror);
      lines.erase(line);
      unfolded = true;
      break;
    }
  }
  if (layer == "1" && !curves.empty())
    for (const Item* line : lines)
      warn(line->line, "piece '" + piece.name + "': no edge lies on its mirror line; it stays as it is drawn");
  return curves;
}

std::vector<PanelMark> DxfReader::marks_of(const Item& item, const std::string& layer, bool sewn) const {
  static const std::set<std::string, std::less<>> notches{"4", "80", "81", "82", "83"};
  PanelMark mark;
  const bool notch = notches.contains(layer);
  if (item.point) {
    mark.at = *item.point;
    mark.text = item.text;
    if (!item.text.empty()) {
      // Grade rules and kinds of points.
      if (layer == "2" || layer == "3" || item.text.starts_with('#')) return {};
      mark.kind = MarkKind::text;
    } else if (notch || layer == "13") {
      mark.kind = notch ? MarkKind::notch : MarkKind::drill;
    } else {
      return {};  // turn, curve and grading points are how the boundary is drawn
    }
    return {mark};
  }
  std::vector<PanelMark> out;
  for (const Curve3& curve : dxf::curves_of(item, {})) {
    mark.curve = Curve2(curve.knots(), curve.points().topRows<2>(), curve.weights());
    mark.at = mark.curve->start();
    mark.kind = layer == "7" && mark.curve->degree() == 1 ? MarkKind::grain
                : notch                                   ? MarkKind::notch
                : layer == "14" && !sewn                  ? MarkKind::sew
                                                          : MarkKind::line;
    out.push_back(mark);
  }
  return out;
}

// On an unfolded piece notches, holes and lines come twice; grain lines, mirror lines and texts don't.
void DxfReader::add_marks(const Piece& piece, bool sewn, const std::vector<Mirror>& mirrors,
                          std::vector<TrimmedSurface>& panels) {
  // A block has one piece as a rule; else the first whose box holds the mark.
  const auto add = [&](const PanelMark& mark) {
    for (TrimmedSurface& panel : panels) {
      const Interval u = panel.surface.u().domain(), v = panel.surface.v().domain();
      if (panels.size() > 1 && !(u.contains(mark.at.x()) && v.contains(mark.at.y()))) continue;
      panel.marks.push_back(mark);
      return;
    }
  };
  for (const Item& item : piece.items) {
    const std::string layer = meant_layer(piece, item);
    if (layer.empty() || ((layer == (sewn ? "14" : "1") || layer == "11") && !item.point)) continue;
    for (const auto& [repeat, original] : repeats)
      if (item.layer == repeat && item.point) continue;
    std::vector<PanelMark> marks = marks_of(item, layer, sewn);
    for (const Mirror& mirror : mirrors) {
      for (std::size_t k = 0, n = marks.size(); k < n; ++k) {
        const MarkKind kind = marks[k].kind;
        if (layer != "6" && kind != MarkKind::grain && kind != MarkKind::text)
          marks.push_back(dxf::mirrored(mirror, marks[k]));
      }
    }
    for (const PanelMark& mark : marks) add(mark);
  }
}

// Places of notes by the entity's line; what kept a piece from being a panel is refused.
void DxfReader::report(const Piece& piece, const Outlines& found) {
  for (const OutlineNote& n : found.notes) {
    const Item& item = piece.items[static_cast<std::size_t>(n.id)];
    const std::string what = "piece '" + piece.name + "': " + item.type + ": " + n.what;
    n.refused ? refuse(item.line, what) : warn(item.line, what);
  }
}

void DxfReader::add_panels(const Piece& piece, Outlines found) {
  for (std::size_t k = 0; k < found.panels.size(); ++k) {
    TrimmedSurface& panel = found.panels[k];
    if (panel.name.empty()) panel.name = piece.name;
    panel.metres_per_unit = out_.metres_per_unit;
    panel.resolution = out_.resolution;
    panel.source = line_of(piece.items[static_cast<std::size_t>(found.ids[k])].line);
    const Interval u = panel.surface.u().domain(), v = panel.surface.v().domain();
    if (!(std::max(u.length(), v.length()) <= largest_number)) {
      refuse(piece.line, "piece '" + panel.name + "' is larger than 1e25 units: check the scales of its inserts");
      continue;
    }
    const double size = std::max(u.length(), v.length()) * out_.metres_per_unit;
    if (choice_.unit.empty() && (size > largest_piece || size < smallest_piece))
      out_.warnings.push_back(panel.source + ": piece '" + panel.name + "' is " + text(size) + " m large: is " +
                              out_.unit + " its unit? --unit or unit = \"...\" chooses another");
    out_.panels.push_back(panel);
    sizes_of_panels_.push_back(piece.size);
    if (!piece.paired) continue;
    try {
      TrimmedSurface second = dxf::mirrored(panel);
      second.name += " mirrored";
      out_.panels.push_back(std::move(second));
      sizes_of_panels_.push_back(piece.size);
    } catch (const GeometryError& error) {
      refuse(piece.line, "piece '" + piece.name + "': its mirrored second: " + error.what());
    }
  }
  if (!piece.paired && piece.quantity > 1 && !found.panels.empty())
    note(piece.line,
         "piece '" + piece.name + "' is cut " + std::to_string(piece.quantity) + " times; one panel is read");
}

void DxfReader::read_piece(const Piece& piece) {
  const bool wants_sew = choice_.outline == "sew";
  if (wants_sew && (piece.on_layer("14") || piece.on_layer("87"))) {
    std::vector<Mirror> mirrors;
    Outlines found = find_outlines(boundary(piece, "14", mirrors), {}, 0);
    if (!found.panels.empty()) {
      report(piece, found);
      add_marks(piece, true, mirrors, found.panels);
      return add_panels(piece, std::move(found));
    }
  }
  std::vector<Mirror> mirrors;
  std::vector<LooseCurve> curves = boundary(piece, "1", mirrors);
  if (curves.empty()) {
    if (std::ranges::any_of(piece.items, is_curve))
      warn(piece.line, "piece '" + piece.name + "' has nothing on layer 1, where boundaries are; it is left out");
    return;
  }
  if (wants_sew)
    warn(piece.line, "piece '" + piece.name + "' has no closed sew line (layer 14); it is cut at its boundary");
  const std::size_t refused = out_.refused.size();
  Outlines found = find_outlines(std::move(curves), {}, 0);
  report(piece, found);
  if (found.panels.empty() && out_.refused.size() == refused)
    refuse(piece.line, "piece '" + piece.name + "' has no closed boundary on layer 1");
  add_marks(piece, false, mirrors, found.panels);
  add_panels(piece, std::move(found));
}

// A drawing without layers of pieces: containment decides which curves are outlines, position which are marks.
void DxfReader::read_plain(const Piece& piece) {
  Corners rule = corners(piece);
  rule.turn_points.clear();
  std::vector<LooseCurve> curves;
  std::vector<LoosePoint> points;
  for (std::size_t k = 0; k < piece.items.size(); ++k) {
    const Item& item = piece.items[k];
    const int id = static_cast<int>(k);
    if (item.point) points.push_back({id, {}, {item.point->x(), item.point->y(), 0}, item.text});
    if (!is_curve(item)) continue;
    LooseCurve loose{id, lower(item.layer).find("grain") != std::string::npos ? item.layer : std::string(),
                     dxf::curves_of(item, rule)};
    if (!loose.pieces.empty()) curves.push_back(std::move(loose));
  }
  if (curves.empty()) return;
  Outlines found = find_outlines(std::move(curves), points, 0);
  report(piece, found);
  for (TrimmedSurface& panel : found.panels) {
    panel.name.clear();
    for (const PanelMark& mark : panel.marks)
      if (const auto name = dxf::value_of(mark.text, "piece name")) panel.name = *name;
  }
  add_panels(piece, std::move(found));
}

// Names that several panels share get their size, then a number.
void DxfReader::name_panels() {
  std::map<std::string, int> seen, again;
  for (TrimmedSurface& panel : out_.panels) {
    if (panel.name.empty()) panel.name = "piece";
    ++seen[panel.name];
  }
  for (std::size_t k = 0; k < out_.panels.size(); ++k) {
    std::string& name = out_.panels[k].name;
    if (seen[name] > 1 && !sizes_of_panels_[k].empty()) name += " " + sizes_of_panels_[k];
    const int n = ++again[name];
    if (n > 1) name += " " + std::to_string(n);
  }
}

void DxfReader::read(std::string_view text) {
  if (!choice_.outline.empty() && choice_.outline != "cut" && choice_.outline != "sew")
    throw InputError(name_ + ": outline is \"" + choice_.outline + "\", must be cut or sew");
  const dxf::Drawing drawing = dxf::read_drawing(text, name_);
  choose_unit(drawing);
  for (const std::string& warning : drawing.warnings) out_.warnings.push_back(warning);
  name_what_is_left_out(drawing);
  std::vector<Piece> pieces = dxf::pieces_of(drawing);
  const bool layered = std::ranges::any_of(
      pieces, [](const Piece& piece) { return piece.on_layer("1") || piece.on_layer("84") || piece.on_layer("11"); });
  if (layered) {
    choose_corners(pieces);
    pieces = in_one_size(std::move(pieces), dxf::value_of(drawing, "sample size").value_or(""));
  }
  for (const Piece& piece : pieces) {
    if (piece.cut)
      warn(piece.line, "piece '" + piece.name +
                           "': blocks are inserted in it more than 64 deep or too often; the others are left out: "
                           "explode them before exporting");
    try {
      layered ? read_piece(piece) : read_plain(piece);
    } catch (const GeometryError& error) {
      refuse(piece.line, "piece '" + piece.name + "': " + error.what());
    }
  }
  for (const auto& [type, count] : drawing.unread)
    out_.warnings.push_back(name_ + ": " + type + ": " + std::to_string(count) + " not read");
  if (out_.panels.empty()) {
    // What wasn't read is why, most likely.
    std::string unread;
    for (const std::string& warning : out_.warnings)
      if (!warning.starts_with(name_ + ": ") && unread.size() < 400) unread += "; " + warning;
    if (!out_.refused.empty()) throw GeometryError(out_.refused.front() + unread);
    throw InputError(name_ + ": no piece with a closed boundary" + unread);
  }
  name_panels();
}

}  // namespace

PanelFile parse_dxf(std::string_view text, const std::string& name, const PanelChoice& choice) {
  PanelFile out;
  DxfReader(name, choice, out).read(text);
  return out;
}

PanelFile read_dxf(const std::filesystem::path& path, const PanelChoice& choice) {
  return parse_dxf(read_file(path, max_bytes), path.string(), choice);
}

}  // namespace toile
