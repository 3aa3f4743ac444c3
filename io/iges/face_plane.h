// SPDX-License-Identifier: GPL-3.0-or-later
// The parameter plane of a face: its surface, where it closes, and what counts as near.
#pragma once

#include <array>

#include "io/iges/face.h"

namespace toile::iges {

inline constexpr double usable = 1e-3;  // of the domain; validation refuses gaps and excursions beyond it

struct FacePlane {
  FacePlane(const FileSurface& surface, const FaceOptions& options);

  const FileSurface& file;
  const NurbsSurface& surface;
  const FaceOptions& options;
  std::array<Interval, 2> domain;
  std::array<bool, 2> closed{};
  std::array<double, 2> period{};  // 0 where the surface isn't closed
  double size = 0;                 // diagonal of the control net's box
  double snap = 0;                 // the file's resolution, 1e-6 of the size at most

  [[noreturn]] void fail(const BoundaryCurves& b, const std::string& what) const;
  void note(const BoundaryCurves& b, const std::string& kind, const std::string& what) const;
};

// Ends of a curve in its loop's direction.
Eigen::Vector2d first(const TrimCurve& c);
Eigen::Vector2d last(const TrimCurve& c);
void shift(TrimCurve& c, int axis, double by);
// A straight curve of a loop.
TrimCurve leg(const Eigen::Vector2d& a, const Eigen::Vector2d& b, int index);
// Places along a loop, in its direction.
std::vector<Eigen::Vector2d> polygon(const std::vector<TrimCurve>& curves);

}  // namespace toile::iges
