// SPDX-License-Identifier: GPL-3.0-or-later
// Where cloth meets cloth.
#pragma once

#include <Eigen/Core>
#include <array>
#include <utility>
#include <vector>

#include "analysis/contact/bounds_tree.h"
#include "analysis/contact/contact_proxy.h"

namespace toile {

// Two places of the cloth: a vertex and a place of a triangle, or places of two edges. sum share x over `vertices` is
// the vector from the second to the first.
struct SelfMeeting {
  bool edges = false;
  int first = 0, second = 0;  // vertex and triangle; edges
  std::vector<std::pair<int, double>> vertices;
  Eigen::Vector3d normal{0, 0, 1};  // unit, towards the first: from the side that it was on at the start
  double thickness = 0;             // m: half of both
  double chord = 0;                 // m, of both: the offset is their sum
  double distance = 0;              // m along the normal, at the start
};

// Cloth around a seam, laid out flat: both sides with the seam between them. Distances are measured along it and from
// it, |dx| + |dy|.
struct SewnChart {
  std::vector<std::pair<int, Eigen::Vector2d>> places;  // proxy vertex, m; ascending
};

//   (1) found is what comes within offset + margin, and what passes through: where the two are in one plane, with
//       heights that change in proportion to time [after Provot 1997, whose cubic is exact also where planes turn];
//   (2) places of one panel that are within an offset of each other at rest don't meet, nor those that are within three
//       in a chart; from there to twelve their thickness grows to the whole: sewn cloth lies on itself at its seam;
//   (3) neighbouring cells whose triangles face within a right angle of each other don't meet [Volino &
//       Magnenat-Thalmann 1994]: flat cloth costs a box and a cone of normals a cell.
class SelfSearch {
 public:
  // `largest_chord`: of the chord errors that count [m].
  SelfSearch(const ContactProxy& proxy, Eigen::Matrix3Xd rest, double largest_chord,
             const std::vector<SewnChart>& charts = {});
  // Between the places `from` and `at` of the vertices; in an order that the proxy alone decides.
  std::vector<SelfMeeting> find(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& at, double margin);

 private:
  struct Cell {
    std::vector<int> vertices, triangles, edges;
  };
  struct Cone {
    Eigen::Vector3d axis{0, 0, 1};
    double cosine = 1;  // of the widest angle from the axis
  };
  struct Moved {
    const Eigen::Matrix3Xd& from;
    const Eigen::Matrix3Xd& at;
    double margin;
  };
  void set_cells(const Moved& moved);
  bool flat(int a, int b) const;
  void vertices_to_triangles(const Moved& moved, int a, int b, std::vector<SelfMeeting>& out) const;
  void edges_to_edges(const Moved& moved, int a, int b, std::vector<SelfMeeting>& out) const;
  void add(const Moved& moved, SelfMeeting meeting, std::vector<SelfMeeting>& out) const;
  bool neighbours(int a, int b) const;
  double chart_distance(const SelfMeeting& meeting) const;

  const ContactProxy& proxy_;
  Eigen::Matrix3Xd rest_;
  double largest_chord_, thickest_ = 0;
  struct OnChart {
    int chart;
    Eigen::Vector2d place;
  };
  std::vector<std::vector<OnChart>> charts_;  // per vertex, ascending
  std::vector<Cell> cells_;
  std::vector<std::vector<int>> beside_;  // per cell those that share a vertex with it, itself too; ascending
  BoundsTree tree_;
  std::vector<Box> boxes_, triangle_boxes_, edge_boxes_;
  std::vector<Cone> cones_;
};

}  // namespace toile
