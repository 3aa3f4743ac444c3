// SPDX-License-Identifier: GPL-3.0-or-later
// Panels glued along their seams: surfaces that everybody knows, and what is none.
#include "io/gluing.h"

#include <gtest/gtest.h>

#include <random>

namespace toile {
namespace {

// A square: edges 0 to 3 counter-clockwise from the bottom.
GluePanel square() {
  return {{{{1, 1, 1, 1}, true}}};
}
GlueSeam seam(int panel_a, int edge_a, int panel_b, int edge_b, bool reverse = true) {
  return {{{panel_a, 0, edge_a}}, {{panel_b, 0, edge_b}}, reverse};
}
void expect_piece(const Gluing& gluing, int euler, int borders, bool orientable) {
  ASSERT_EQ(gluing.pieces.size(), 1u);
  EXPECT_EQ(gluing.pieces[0].euler, euler);
  EXPECT_EQ(gluing.pieces[0].borders, borders);
  EXPECT_EQ(gluing.pieces[0].orientable, orientable);
  EXPECT_TRUE(gluing.pieces[0].manifold);
  EXPECT_TRUE(gluing.oversewn.empty());
  EXPECT_TRUE(gluing.unmatched.empty());
  EXPECT_EQ(gluing.twisted.empty(), orientable);
}

TEST(Gluing, OneSquareBecomesTheSurfacesOfTheTextbook) {
  expect_piece(glue({square()}, {}), 1, 1, true);                                                   // disc
  expect_piece(glue({square()}, {seam(0, 1, 0, 3)}), 0, 2, true);                                   // tube
  expect_piece(glue({square()}, {seam(0, 1, 0, 3, false)}), 0, 1, false);                           // Moebius band
  expect_piece(glue({square()}, {seam(0, 0, 0, 2), seam(0, 1, 0, 3)}), 0, 0, true);                 // torus
  expect_piece(glue({square()}, {seam(0, 0, 0, 2), seam(0, 1, 0, 3, false)}), 0, 0, false);         // Klein bottle
  expect_piece(glue({square()}, {seam(0, 0, 0, 2, false), seam(0, 1, 0, 3, false)}), 1, 0, false);  // projective plane
  expect_piece(glue({square()}, {seam(0, 0, 0, 1), seam(0, 2, 0, 3)}), 2, 0, true);                 // sphere
}

TEST(Gluing, AClosedDartLeavesADisc) {
  const GluePanel front{{{{3, 4, 1, 2, 2, 1, 4}, true}}};
  expect_piece(glue({front}, {seam(0, 3, 0, 4)}), 1, 1, true);
  EXPECT_FALSE(glue({front}, {seam(0, 3, 0, 4, false)}).pieces[0].orientable);
}

TEST(Gluing, ATeeHasFourOpenings) {
  // Front and back with a shoulder and a side each way; sleeves closed under the arm. Edges of a body from the hem:
  // hem, side, armhole, shoulder, neck, shoulder, armhole, side.
  const GluePanel body{{{{5, 4, 2, 1, 2, 1, 2, 4}, true}}}, sleeve{{{{4, 3, 2, 3}, true}}};
  std::vector<GlueSeam> seams{seam(0, 1, 1, 7), seam(0, 7, 1, 1), seam(0, 3, 1, 5), seam(0, 5, 1, 3)};
  expect_piece(glue({body, body}, seams), -2, 4, true);
  for (const int side : {0, 1}) {
    // The cap of the sleeve to both armholes of its side.
    seams.push_back({{{2 + side, 0, 0}}, {{0, 0, side == 0 ? 2 : 6}, {1, 0, side == 0 ? 6 : 2}}, true});
    seams.push_back(seam(2 + side, 1, 2 + side, 3));
  }
  expect_piece(glue({body, body, sleeve, sleeve}, seams), -2, 4, true);
}

TEST(Gluing, AHoleIsABorderMore) {
  GluePanel ring = square();
  ring.loops.push_back({{1, 1}, true});
  expect_piece(glue({ring}, {}), 0, 2, true);
  // Its two halves sewn: the hole is closed.
  expect_piece(glue({ring}, {{{{0, 1, 0}}, {{0, 1, 1}}, true}}), 1, 1, true);
  // The hole's other direction changes nothing else than the sense of its seams to others.
  ring.loops[1].material_left = false;
  expect_piece(glue({ring, square()}, {{{{0, 1, 0}}, {{1, 0, 0}}, false}}), 0, 2, true);
}

TEST(Gluing, APanelDrawnTheOtherWayRoundIsTheSame) {
  std::mt19937 random(20261128);
  for (int k = 0; k < 200; ++k) {
    std::vector<GluePanel> panels(4, square());
    std::vector<GlueSeam> seams;
    // Edges in random pairs.
    std::vector<std::pair<int, int>> edges;
    for (int p = 0; p < 4; ++p)
      for (int e = 0; e < 4; ++e) edges.emplace_back(p, e);
    std::shuffle(edges.begin(), edges.end(), random);
    for (std::size_t n = 0; n + 5 < edges.size(); n += 2)
      seams.push_back(
          seam(edges[n].first, edges[n].second, edges[n + 1].first, edges[n + 1].second, random() % 2 == 0));
    const Gluing before = glue(panels, seams);
    for (const GluedPiece& piece : before.pieces) {
      EXPECT_TRUE(piece.manifold) << "pairs of edges make a surface, case " << k;
      if (piece.orientable) {
        EXPECT_EQ((piece.euler + piece.borders) % 2, 0) << "case " << k;
      }
    }
    // Panel 2 mirrored: its edges run the other way round, edge e is now edge 3 - e, and start and end change places.
    std::vector<GlueSeam> same = seams;
    for (GlueSeam& s : same) {
      for (GluePart* part : {&s.a[0], &s.b[0]}) {
        if (part->panel != 2) continue;
        part->edge = 3 - part->edge;
        s.reverse = !s.reverse;
      }
    }
    panels[2].loops[0].material_left = false;
    const Gluing after = glue(panels, same);
    ASSERT_EQ(after.pieces.size(), before.pieces.size());
    for (std::size_t n = 0; n < after.pieces.size(); ++n) {
      EXPECT_EQ(after.pieces[n].panels, before.pieces[n].panels);
      EXPECT_EQ(after.pieces[n].euler, before.pieces[n].euler) << "case " << k;
      EXPECT_EQ(after.pieces[n].borders, before.pieces[n].borders) << "case " << k;
      EXPECT_EQ(after.pieces[n].orientable, before.pieces[n].orientable) << "case " << k;
    }
  }
}

TEST(Gluing, DividedEdgesGlueAsBefore) {
  // A tube of one seam, the same with the seam in two halves, and with one side of three edges against one.
  const GluePanel three{{{{1, 0.25, 0.5, 0.25, 1, 1}, true}}};
  const std::vector<GluePart> chain{{0, 0, 1}, {0, 0, 2}, {0, 0, 3}};
  expect_piece(glue({three}, {{chain, {{0, 0, 5}}, true}}), 0, 2, true);
  expect_piece(glue({three}, {{chain, {{0, 0, 5}}, false}}), 0, 1, false);
  expect_piece(glue({square()}, {{{{0, 0, 1, 0, 0.3}}, {{0, 0, 3, 0.7, 1}}, true},
                                 {{{0, 0, 1, 0.3, 1}}, {{0, 0, 3, 0, 0.7}}, true}}),
               0, 2, true);
  // Run backwards by its fractions is run backwards.
  expect_piece(glue({square()}, {{{{0, 0, 1}}, {{0, 0, 3, 1, 0}}, false}}), 0, 2, true);
}

TEST(Gluing, CutsGoOnOverTheNextSeam) {
  // A panel's edge sewn to two edges of the next, that one's far edge to two others of a third: all in line.
  const GluePanel two{{{{0.5, 0.5, 1, 1, 1}, true}}};
  const Gluing gluing = glue({square(), two, two, two}, {{{{0, 0, 2}}, {{1, 0, 0}, {1, 0, 1}}, true},
                                                         {{{1, 0, 3}}, {{2, 0, 0}, {3, 0, 0}}, true}});
  expect_piece(gluing, 1, 1, true);
}

TEST(Gluing, AnEdgeInTwoSeamsIsNamed) {
  const Gluing gluing = glue({square(), square(), square()}, {seam(0, 1, 1, 3), seam(0, 1, 2, 3)});
  ASSERT_EQ(gluing.oversewn.size(), 1u);
  EXPECT_EQ(gluing.oversewn[0].edge.panel, 0);
  EXPECT_EQ(gluing.oversewn[0].edge.edge, 1);
  EXPECT_EQ(gluing.oversewn[0].seams, (std::vector<int>{0, 1}));
  EXPECT_FALSE(gluing.pieces.at(0).manifold);
  // Two seams on two halves of an edge are none too many.
  EXPECT_TRUE(glue({square(), square(), square()},
                   {{{{0, 0, 1, 0, 0.5}}, {{1, 0, 3}}, true}, {{{0, 0, 1, 0.5, 1}}, {{2, 0, 3}}, true}})
                  .oversewn.empty());
}

TEST(Gluing, BordersAreRunInOneGo) {
  // A tube's upper and lower edge, each of one edge of either panel, run in one direction.
  const Gluing tube = glue({square(), square()}, {seam(0, 1, 1, 3), seam(1, 1, 0, 3)});
  ASSERT_EQ(tube.pieces.at(0).border_lines.size(), 2u);
  for (const std::vector<GluePart>& line : tube.pieces[0].border_lines) {
    ASSERT_EQ(line.size(), 2u);
    EXPECT_EQ(line[0].edge, line[1].edge);
    EXPECT_NE(line[0].panel, line[1].panel);
    EXPECT_EQ(line[0].from < line[0].to, line[1].from < line[1].to);
  }
  // The second panel upside down and drawn so: its edge is run backwards against its own direction.
  const Gluing turned = glue({square(), {{{{1, 1, 1, 1}, false}}}}, {seam(0, 1, 1, 1, false), seam(0, 3, 1, 3, false)});
  for (const std::vector<GluePart>& line : turned.pieces.at(0).border_lines) {
    ASSERT_EQ(line.size(), 2u);
    EXPECT_NE(line[0].from < line[0].to, line[1].from < line[1].to);
  }
}

TEST(Gluing, PiecesAreCountedApart) {
  const Gluing gluing = glue({square(), square(), square()}, {seam(0, 1, 2, 3), seam(0, 3, 2, 1)});
  ASSERT_EQ(gluing.pieces.size(), 2u);
  EXPECT_EQ(gluing.pieces[0].panels, (std::vector<int>{0, 2}));
  EXPECT_EQ(gluing.pieces[0].borders, 2);
  EXPECT_EQ(gluing.pieces[1].panels, (std::vector<int>{1}));
  EXPECT_EQ(gluing.pieces[1].euler, 1);
}

}  // namespace
}  // namespace toile
