// SPDX-License-Identifier: GPL-3.0-or-later
// From the parameters that the file means to those of the NURBS that a curve or surface became.
#pragma once

#include <array>
#include <vector>

#include "geometry/nurbs_curve.h"

namespace toile::iges {

// Along one direction: x -> g(scale x + shift). g is the identity but on turns, where a NURBS runs through equal
// circular arcs: there the file counts angles, and the NURBS agrees with it at the ends of its arcs only.
//   (1) Continuous and increasing for scale > 0; C1 within a turn.
//   (2) A lone turn goes on beyond its range, by further arcs of its kind.
struct Turn {
  Interval range;  // in both parameters alike
  int arcs = 1;
  double sweep = 0;  // angle over the range [rad]
};
struct AxisMap {
  double scale = 1, shift = 0;
  std::vector<Turn> turns = {};

  bool affine() const { return turns.empty(); }
  double operator()(double x) const;
  double derivative(double x) const;
};

struct ParameterMap {
  AxisMap u, v;
  bool swapped = false;  // the file names v first
  Eigen::Vector2d operator()(const Eigen::Vector2d& x) const {
    return swapped ? Eigen::Vector2d(u(x.y()), v(x.x())) : Eigen::Vector2d(u(x.x()), v(x.y()));
  }
  bool identity() const;
};

// What a file may count along one direction in place of the standard's parameter: `standard` runs over `range`, the
// file over one of `counted`, linearly.
struct AxisReadings {
  AxisMap standard;
  Interval range;
  std::vector<Interval> counted;
};
// All pairs of readings, the standard's first, then those with u and v swapped.
std::vector<ParameterMap> readings(const AxisReadings& u, const AxisReadings& v);

// The image of a parameter curve. Exact where the maps are affine where the curve goes, and as a set of points for
// lines of constant u or v; else a cubic within `tolerance` [parameters of the NURBS], the error reported.
struct CarriedCurve {
  Curve2 curve;
  double error = 0;
};
CarriedCurve carried(const Curve2& curve, const ParameterMap& map, const Eigen::Vector2d& tolerance);

}  // namespace toile::iges
