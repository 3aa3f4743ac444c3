// SPDX-License-Identifier: GPL-3.0-or-later
// The planar map of closed trim loops: cut where they meet; pieces that lie on each other are one edge.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "geometry/trimmed_surface.h"

namespace toile {

// A piece of one or several loops between two vertices.
struct ArrangedEdge {
  // A loop's run along it.
  struct Use {
    int loop = 0, curve = 0;  // positions, as in TrimSpan
    double t0 = 0, t1 = 0;    // parameters on the curve as given, at `from` and at `to`
    bool forward = true;      // the loop runs from `from` to `to`
  };
  // Winding numbers of a loop just left and just right of the edge.
  struct Sides {
    int loop = 0, left = 0, right = 0;
  };
  int from = 0, to = 0;  // vertices
  std::vector<Use> uses;
  std::vector<Sides> sides;   // of the loops in its component; those that have it outside on both sides are left out
  Eigen::Vector2d near_from;  // places on the edge close to its ends: directions around a vertex
  Eigen::Vector2d near_to;
  Eigen::Vector2d middle;
};

//   (1) edges meet in vertices only;
//   (2) across an edge a loop's winding number changes by the number of its runs, forward less backward;
//   (3) a vertex on a loop's line of constant u or v has that coordinate bitwise.
struct Arrangement {
  std::vector<Eigen::Vector2d> vertices;
  std::vector<ArrangedEdge> edges;
  // The edges of each loop in its direction, and where in `uses` its run stands.
  struct Step {
    int edge = 0, use = 0;
  };
  std::vector<std::vector<Step>> chains;
  std::vector<int> component;  // of each loop; loops that meet have the same
};

// Loops whose joints are bitwise equal. Places nearer than `tolerance` count as one, and so do pieces between the same
// vertices that keep within it: such places move by some tolerances. What lies on which side is decided by exact
// winding numbers of places on either side. Throws GeometryError with the place where these contradict each other.
Arrangement arrange(const std::vector<TrimLoop>& loops, const Eigen::Vector2d& tolerance);

}  // namespace toile
