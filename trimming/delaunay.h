// SPDX-License-Identifier: GPL-3.0-or-later
// Constrained Delaunay triangulation of what loops enclose, as the sources of this room use it.
#pragma once

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Constrained_triangulation_face_base_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <vector>

namespace toile {

using PlaneKernel = CGAL::Exact_predicates_inexact_constructions_kernel;
// What a vertex carries: a number of the caller's. Where constraints cross, CGAL makes vertices that have none.
struct VertexNumber {
  VertexNumber(int n = -1) : number(n) {}
  operator int() const { return number; }
  int number;
};
// A face carries its nesting depth: odd in the material.
using Delaunay = CGAL::Constrained_Delaunay_triangulation_2<
    PlaneKernel,
    CGAL::Triangulation_data_structure_2<CGAL::Triangulation_vertex_base_with_info_2<VertexNumber, PlaneKernel>,
                                         CGAL::Constrained_triangulation_face_base_2<
                                             PlaneKernel, CGAL::Triangulation_face_base_with_info_2<int, PlaneKernel>>>,
    CGAL::Exact_predicates_tag>;

// Nesting depth of the faces, counted by the constraints between them and the outside.
inline void mark_depths(Delaunay& delaunay) {
  for (const auto face : delaunay.all_face_handles()) face->info() = -1;
  std::vector<Delaunay::Face_handle> now{delaunay.infinite_face()}, next;
  for (int depth = 0; !now.empty(); ++depth, now.swap(next), next.clear()) {
    while (!now.empty()) {
      const Delaunay::Face_handle face = now.back();
      now.pop_back();
      if (face->info() >= 0) continue;
      face->info() = depth;
      for (int k = 0; k < 3; ++k) {
        const Delaunay::Face_handle neighbour = face->neighbor(k);
        if (neighbour->info() < 0) (face->is_constrained(k) ? next : now).push_back(neighbour);
      }
    }
  }
}

}  // namespace toile
