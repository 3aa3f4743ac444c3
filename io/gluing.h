// SPDX-License-Identifier: GPL-3.0-or-later
// Panels glued along their seams: is the garment a surface? Combinatorics only; of geometry it takes the lengths of
// edges, which say where the ends of a 1:N seam's edges fall on the other side.
#pragma once

#include <vector>

namespace toile {

// The edges of a loop in their order, edge k from corner k to corner k + 1.
struct GlueLoop {
  std::vector<double> lengths;  // positive, any unit
  bool material_left = true;    // of the edges' direction: an outline that runs counter-clockwise, a hole clockwise
};
// A disc with holes: loop 0 and the others.
struct GluePanel {
  std::vector<GlueLoop> loops;
};

// A part of an edge, between two fractions of its length; it is run backwards where `from` > `to`.
struct GluePart {
  int panel = 0, loop = 0, edge = 0;
  double from = 0, to = 1;
};
// Each side runs along its parts in their order; side b is run backwards where `reverse`. Points of equal shares of
// the two sides' lengths are one.
struct GlueSeam {
  std::vector<GluePart> a, b;
  bool reverse = false;
};

// Panels that seams hold together, glued.
struct GluedPiece {
  std::vector<int> panels;  // ascending
  int euler = 0;            // V - E + F: 2 less twice the handles less the borders, where it is an orientable surface
  int borders = 0;          // closed lines of edges that nothing is sewn to
  std::vector<std::vector<GluePart>> border_lines;  // each of them, part after part
  bool orientable = true;                           // it has two sides, one of them the right one
  bool manifold = true;                             // nowhere more than two layers meet at an edge
};

struct Gluing {
  std::vector<GluedPiece> pieces;  // by their first panel
  // Seams after which, in their order, a piece has one side only: each closes a band with a half twist.
  std::vector<int> twisted;
  // Edges of which some part is in more than one seam (or twice in one), each with the seams.
  struct Oversewn {
    GluePart edge;  // whole
    std::vector<int> seams;
  };
  std::vector<Oversewn> oversewn;
  std::vector<int> unmatched;  // seams whose sides could not be divided alike (edges sewn round and round)
};

// Laws:
//   (1) pairs of edges glue panels to a surface, whatever the pairs: every piece is a manifold unless `oversewn` names
//       an edge of it;
//   (2) an orientable piece has an even euler + borders; each panel without seams is a piece of euler 1 - holes;
//   (3) dividing an edge in two, sewn as before, changes nothing but the numbers of edges;
//   (4) drawing a panel the other way round, its seams' `reverse` following, changes nothing.
// The indices must lie in range, lengths be positive and parts within 0..1 and not empty.
Gluing glue(const std::vector<GluePanel>& panels, const std::vector<GlueSeam>& seams);

}  // namespace toile
