// SPDX-License-Identifier: GPL-3.0-or-later
// Which pieces a drawing holds, in which size and unit.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/dxf/drawing.h"

namespace toile::dxf {

// One piece as it lies: the items of its block, of blocks inserted in it too, mapped as it is inserted.
struct Piece {
  std::string name, size;  // of its texts, else the block's name and empty
  std::string block;
  int line = 0;
  std::vector<Item> items;
  bool mirrored_insert = false;
  bool cut = false;     // blocks in it lie too deep or are too many: some are left out
  bool paired = false;  // a mirrored second one is cut
  int quantity = 1;

  bool on_layer(std::string_view layer) const;  // some curve of it is
};

// Blocks as they are inserted, each way of lying once (a shift is none: a piece keeps its own coordinates); blocks that
// nobody inserts; what stands outside of blocks, first.
std::vector<Piece> pieces_of(const Drawing& drawing);

// The inserts by which a block would be inserted in itself, at once or by way of others, each with its block; in the
// file's order.
std::vector<std::pair<const Block*, const Item*>> circular_inserts(const Drawing& drawing);

// "Piece Name: FRONT" -> "FRONT" for the key "piece name", capitals or not.
std::optional<std::string> value_of(const std::string& text, std::string_view key);
// The value of the first text of the drawing with that key.
std::optional<std::string> value_of(const Drawing& drawing, std::string_view key);

struct Unit {
  std::string name;  // as IGES names it
  double metres = 1e-3;
};
// "mm", "cm", "inch", "METRIC", ...; nothing for other words.
std::optional<Unit> unit_called(std::string word);
// What the drawing says: a text "Units: ", else $INSUNITS, else $MEASUREMENT; else millimetres. `warning` takes what is
// doubtful about it.
Unit unit_of(const Drawing& drawing, std::string& warning);

}  // namespace toile::dxf
