// SPDX-License-Identifier: GPL-3.0-or-later
// From a surface and the curves that bound it to panels: which curves to believe, seams, order and direction of loops.
// Geometry only; records and pointers are the reader's.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "geometry/trimmed_surface.h"
#include "io/iges/surfaces.h"

namespace toile::iges {

// The curves of one boundary as the file gives them, the model curves placed where the surface stands.
struct BoundaryCurves {
  std::vector<Curve3> model;
  std::vector<Curve3> parameter;     // the file's parameters in x and y; empty where any edge has none
  bool parameter_preferred = false;  // the record says so
  std::string place;                 // "panel.igs:412: entity 142: "
  std::size_t record = 0;            // which of the face's boundary records it comes from
  // What was done to it, filled in: empty where the parameter curves are the file's own numbers.
  std::string converted;
};

struct FaceOptions {
  bool outer_known = true;  // else the loops' areas tell which is the outer one
  double resolution = 0;    // of the file
  // One thing worth a warning: kind (warnings of a kind are counted), and what.
  std::function<void(const std::string& kind, const std::string& message)> note;
};

// One panel for every outer loop, in the file's order. Loops are numbered as the boundaries; loops that had to be
// joined across a seam take the first one's number. Throws GeometryError with the boundary's place where a loop can't
// be had.
std::vector<TrimmedSurface> make_faces(const FileSurface& surface, std::vector<BoundaryCurves>& boundaries,
                                       const FaceOptions& options);

// The frame coordinates that the boundaries' curves reach: what a plane or a cylinder without ends has to cover.
Eigen::AlignedBox3d reach(const Frame& frame, const std::vector<BoundaryCurves>& boundaries);

}  // namespace toile::iges
