// Extended B-splines: functions with too little cloth under them, and control points with none, follow their neighbours
// by polynomial extension, so that small cut cells bound neither the time step nor the conditioning.
// [Hoellig, Reif, Wipper 2001; positions are extended, design.md Decision 5]
#pragma once

#include <string>
#include <vector>

#include "analysis/affine_map.h"
#include "geometry/nurbs_surface.h"
#include "trimming/quadrature.h"

namespace toile {

struct ExtensionOptions {
  double smallest_support = 0.2;   // functions with a smaller part of their support (area) in the material are extended
  double largest_deviation = 1e-3; // of the cell size: where extending would move the rest surface inside the trim
                                   // further than this, the function is kept as it is
};

struct Extension {
  AffineMap::Matrix dependence;      // n x n for this panel, see AffineMap
  std::vector<bool> carries_cloth;   // per control point: its support meets the material
  std::vector<int> extended;         // control points with cloth that are extended
  NurbsSurface rest;                 // the rest surface with its net replaced by its own extension
  double deviation = 0;              // largest move of the rest surface inside the material, unit of the net
};

// Extended coefficients: the polynomial of the nearest well supported cell, continued; coefficient j is its blossom at
// the knots of function j. Row sums are 1. Functions whose extension would make a reduced lumped mass nonpositive are
// kept. `lumped_mass`: n row sums of the panel.
Extension extend(const NurbsSurface& rest, const CutQuadrature& quadrature, const Eigen::VectorXd& lumped_mass,
                 const ExtensionOptions& options = {});

}  // namespace toile
