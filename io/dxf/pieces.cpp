// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/dxf/pieces.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <map>
#include <set>
#include <span>

#include "geometry/text.h"
#include "io/dxf/pairs.h"

namespace toile::dxf {

namespace {

constexpr std::size_t max_depth = 64;           // of blocks inserted in blocks
constexpr std::size_t max_inserts = 1'000'000;  // of all pieces: blocks within blocks double quickly
constexpr std::size_t max_items = 2'000'000;    // of a piece, inserted ones included

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

class Expander {
 public:
  explicit Expander(const Drawing& drawing) {
    for (std::size_t k = 1; k < drawing.blocks.size(); ++k)
      blocks_.try_emplace(drawing.blocks[k].name, &drawing.blocks[k]);
  }
  const Block* find(const std::string& name) const {
    const auto found = blocks_.find(name);
    return found == blocks_.end() ? nullptr : found->second;
  }
  std::vector<Item> items(const Block& block, const Affine& map, bool inserts = true) {
    std::vector<Item> out;
    cut_ = false;
    std::vector<const Block*> within;
    add(block, map, inserts, within, out);
    return out;
  }
  // Whether the newest items lack some that lie too deep or are too many.
  bool cut() const { return cut_; }
  // A block's coordinates to those of where it is inserted.
  static Affine placing(const Insert& insert, const Block& block) {
    return insert.map * Affine{Eigen::Matrix2d::Identity(), -block.base};
  }

 private:
  // `within`: the blocks that this one is inserted in; none of them is inserted again.
  void add(const Block& block, const Affine& map, bool inserts, std::vector<const Block*>& within,
           std::vector<Item>& out) {
    within.push_back(&block);
    const bool identity = map.linear.isIdentity(0) && map.shift.isZero(0);
    for (const Item& item : block.items) {
      const bool full = out.size() >= max_items || inserts_ >= max_inserts;
      cut_ = cut_ || full;
      if (full) break;
      if (!item.insert) {
        out.push_back(identity ? item : mapped(map, item));
        continue;
      }
      const Block* inner = inserts ? find(item.insert->block) : nullptr;
      if (!inner || std::ranges::find(within, inner) != within.end()) continue;
      const bool deep = within.size() > max_depth;
      cut_ = cut_ || deep;
      ++inserts_;
      if (!deep) add(*inner, map * placing(*item.insert, *inner), inserts, within, out);
    }
    within.pop_back();
  }
  std::map<std::string, const Block*> blocks_;
  std::size_t inserts_ = 0;
  bool cut_ = false;
};

bool says_no(const std::string& value) {
  static const std::set<std::string> words{"", "no", "n", "none", "0", "false", "single", "not paired", "unpaired"};
  return words.contains(lower(value));
}

// "2", "2 / Paired", "1,1" (as drawn, and mirrored).
void read_quantity(const std::string& text, Piece& piece) {
  const std::string words = lower(text);
  std::from_chars(words.data(), words.data() + words.size(), piece.quantity);
  piece.quantity = std::clamp(piece.quantity, 1, 1000);
  if (words.find("pair") != std::string::npos && words.find("unpair") == std::string::npos) piece.paired = true;
  const std::size_t comma = words.find(',');
  if (comma == std::string::npos) return;
  int mirrored = 0;
  const std::string rest = trimmed(std::string_view(words).substr(comma + 1));
  std::from_chars(rest.data(), rest.data() + rest.size(), mirrored);
  piece.paired = piece.paired || mirrored > 0;
}

Piece piece_of(const Block& block, std::vector<Item> items) {
  Piece out;
  out.name = out.block = block.name;
  out.line = block.line;
  out.items = std::move(items);
  for (const Item& item : out.items) {
    if (const auto value = value_of(item.text, "piece name")) out.name = *value;
    if (const auto value = value_of(item.text, "size")) out.size = *value;
    if (const auto value = value_of(item.text, "quantity")) read_quantity(*value, out);
    if (const auto value = value_of(item.text, "paired")) out.paired = out.paired || !says_no(*value);
  }
  return out;
}

// Of nodes and where their edges lead: two have the same number where each leads to the other (Tarjan 1972, without
// recursion: blocks nest as deep as a file likes).
std::vector<int> circles(const std::vector<std::vector<int>>& edges) {
  const std::size_t count = edges.size();
  std::vector<int> out(count, -1), order(count, -1), low(count, 0), waiting;
  struct Visit {
    std::size_t node, next = 0;
  };
  std::vector<Visit> open;
  int visited = 0, found = 0;
  for (std::size_t start = 0; start < count; ++start) {
    if (order[start] < 0) open.push_back({start});
    while (!open.empty()) {
      const std::size_t node = open.back().node;
      if (order[node] < 0) {
        order[node] = low[node] = visited++;
        waiting.push_back(static_cast<int>(node));
      }
      if (open.back().next < edges[node].size()) {
        const auto to = static_cast<std::size_t>(edges[node][open.back().next++]);
        if (order[to] < 0)
          open.push_back({to});
        else if (out[to] < 0)
          low[node] = std::min(low[node], order[to]);
        continue;
      }
      open.pop_back();
      if (!open.empty()) low[open.back().node] = std::min(low[open.back().node], low[node]);
      if (low[node] < order[node]) continue;
      while (out[node] < 0) {
        out[static_cast<std::size_t>(waiting.back())] = found;
        waiting.pop_back();
      }
      ++found;
    }
  }
  return out;
}

}  // namespace

bool Piece::on_layer(std::string_view layer) const {
  return std::ranges::any_of(
      items, [&](const Item& item) { return item.layer == layer && (!item.lines.empty() || !item.curves.empty()); });
}

std::vector<Piece> pieces_of(const Drawing& drawing) {
  Expander expander(drawing);
  std::vector<Piece> out;
  const Block& outside = drawing.blocks.front();
  out.push_back(piece_of(outside, expander.items(outside, {}, false)));
  std::set<std::string_view> inserted;
  for (const Block& block : drawing.blocks)
    for (const Item& item : block.items)
      if (item.insert) inserted.insert(item.insert->block);
  std::map<std::string_view, std::vector<const Insert*>> outside_inserts;
  for (const Item& item : outside.items)
    if (item.insert) outside_inserts[item.insert->block].push_back(&*item.insert);
  // In the order of the blocks; of each, the ways it lies.
  for (std::size_t k = 1; k < drawing.blocks.size(); ++k) {
    const Block& block = drawing.blocks[k];
    std::vector<Affine> ways;
    for (const Insert* insert : outside_inserts[block.name]) {
      Affine map = Expander::placing(*insert, block);
      if (map.linear.isIdentity(0)) map.shift.setZero();
      const auto same = [&](const Affine& way) { return (way.linear - map.linear).isZero(1e-12); };
      if (std::ranges::none_of(ways, same)) ways.push_back(map);
    }
    const bool hidden = block.name.starts_with('*') || inserted.contains(block.name);
    if (ways.empty() && !hidden) ways.emplace_back();
    for (const Affine& way : ways) {
      Piece piece = piece_of(block, expander.items(block, way));
      piece.mirrored_insert = way.mirrors();
      piece.cut = expander.cut();
      out.push_back(std::move(piece));
    }
  }
  return out;
}

std::vector<std::pair<const Block*, const Item*>> circular_inserts(const Drawing& drawing) {
  std::map<std::string_view, int> number;
  for (const Block& block : std::span(drawing.blocks).subspan(1))
    number.try_emplace(block.name, static_cast<int>(number.size()));
  std::vector<std::vector<int>> inserts(number.size());
  for (const Block& block : std::span(drawing.blocks).subspan(1))
    for (const Item& item : block.items)
      if (const auto to = item.insert ? number.find(item.insert->block) : number.end(); to != number.end())
        inserts[static_cast<std::size_t>(number.at(block.name))].push_back(to->second);
  const std::vector<int> circle = circles(inserts);
  std::vector<std::pair<const Block*, const Item*>> out;
  for (const Block& block : std::span(drawing.blocks).subspan(1))
    for (const Item& item : block.items)
      if (const auto to = item.insert ? number.find(item.insert->block) : number.end();
          to != number.end() &&
          circle[static_cast<std::size_t>(to->second)] == circle[static_cast<std::size_t>(number.at(block.name))])
        out.emplace_back(&block, &item);
  return out;
}

std::optional<std::string> value_of(const std::string& text, std::string_view key) {
  if (text.size() <= key.size()) return std::nullopt;
  for (std::size_t k = 0; k < key.size(); ++k)
    if (std::tolower(static_cast<unsigned char>(text[k])) != key[k]) return std::nullopt;
  const std::string rest = trimmed(std::string_view(text).substr(key.size()));
  if (!rest.starts_with(':')) return std::nullopt;
  return trimmed(std::string_view(rest).substr(1));
}

std::optional<std::string> value_of(const Drawing& drawing, std::string_view key) {
  for (const Block& block : drawing.blocks)
    for (const Item& item : block.items)
      if (auto value = value_of(item.text, key)) return value;
  return std::nullopt;
}

std::optional<Unit> unit_called(std::string word) {
  word = lower(trimmed(word));
  static const std::map<std::string, Unit> units{
      {"mm", {"MM", 1e-3}},          {"metric", {"MM", 1e-3}},      {"millimeter", {"MM", 1e-3}},
      {"millimeters", {"MM", 1e-3}}, {"millimetre", {"MM", 1e-3}},  {"millimetres", {"MM", 1e-3}},
      {"cm", {"CM", 1e-2}},          {"centimeter", {"CM", 1e-2}},  {"centimeters", {"CM", 1e-2}},
      {"centimetre", {"CM", 1e-2}},  {"centimetres", {"CM", 1e-2}}, {"m", {"M", 1}},
      {"meter", {"M", 1}},           {"meters", {"M", 1}},          {"metre", {"M", 1}},
      {"metres", {"M", 1}},          {"in", {"INCH", 0.0254}},      {"inch", {"INCH", 0.0254}},
      {"inches", {"INCH", 0.0254}},  {"english", {"INCH", 0.0254}}, {"imperial", {"INCH", 0.0254}},
      {"\"", {"INCH", 0.0254}},      {"ft", {"FT", 0.3048}},        {"feet", {"FT", 0.3048}},
      {"foot", {"FT", 0.3048}}};
  const auto found = units.find(word);
  return found == units.end() ? std::nullopt : std::optional(found->second);
}

Unit unit_of(const Drawing& drawing, std::string& warning) {
  std::optional<Unit> stated;
  const auto number = [&](const char* variable) {
    const auto found = drawing.header.find(variable);
    int value = -1;
    if (found != drawing.header.end())
      std::from_chars(found->second.data(), found->second.data() + found->second.size(), value);
    return value;
  };
  const int insunits = number("$INSUNITS"), measurement = number("$MEASUREMENT");
  std::string from;
  static const std::map<int, const char*> names{{1, "inch"}, {2, "ft"}, {4, "mm"}, {5, "cm"}, {6, "m"}};
  if (const auto known = names.find(insunits); known != names.end()) {
    stated = unit_called(known->second);
    from = "$INSUNITS = " + std::to_string(insunits);
  } else if (measurement == 0 || measurement == 1) {
    stated = unit_called(measurement == 0 ? "inch" : "mm");
    from = "$MEASUREMENT = " + std::to_string(measurement);
  }
  const std::optional<std::string> text = value_of(drawing, "units");
  const std::optional<Unit> said = text ? unit_called(*text) : std::nullopt;
  const auto other = [](const Unit& unit) { return unit.name + " is taken; unit = \"...\" chooses another"; };
  if (said) {
    // A template's header says little beside the piece's own text.
    if (stated && stated->name != said->name && from.starts_with("$INS"))
      warning = "'Units: " + *text + "' and " + from + " disagree; " + other(*said);
    return *said;
  }
  if (text)
    warning = "the units are '" + *text + "', which is no unit known here; " + other(stated.value_or(Unit{"MM", 1e-3}));
  if (stated) return *stated;
  if (!text)
    warning = "no text 'Units: METRIC' or 'Units: ENGLISH' and " +
              (insunits > 0 ? "$INSUNITS = " + std::to_string(insunits) + " is no unit known here" : "no $INSUNITS") +
              "; millimetres are assumed: unit = \"...\" chooses others";
  return {"MM", 1e-3};
}

}  // namespace toile::dxf
