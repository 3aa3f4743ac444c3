// SPDX-License-Identifier: GPL-3.0-or-later
// Extended B-splines: functions with too little cloth under them, and control points with none, follow their neighbours
// by polynomial extension, so that small cut cells bound neither the time step nor the conditioning.
// [Hoellig, Reif, Wipper 2001; positions are extended, not displacements]
#pragma once

#include <string>
#include <vector>

#include "analysis/map/affine_map.h"
#include "geometry/nurbs_surface.h"
#include "trimming/quadrature.h"

namespace toile {

struct ExtensionOptions {
  double smallest_support = 0.2;  // functions with a smaller part of their support (area) in the material are extended
  double largest_deviation = 1e-3;  // of the cell size: where extending would move the rest surface inside the trim
                                    // further than this, the function is kept as it is
  double smallest_mass = 0.1;       // of its own: what extending must leave of every other function's lumped mass
};

struct Extension {
  AffineMap::Matrix dependence;     // n x n for this panel, see AffineMap
  std::vector<bool> carries_cloth;  // per control point: its support meets the material
  std::vector<int> extended;        // control points with cloth that are extended
  std::vector<int> kept;            // control points with too little cloth that could not be (mass, deviation, no cell)
  NurbsSurface rest;                // the rest surface with its net replaced by its own extension
  double deviation = 0;             // largest move of the rest surface inside the material, unit of the net
};

// Control points with too little cloth follow the polynomial of the nearest well supported cell (all of its functions
// independent), continued; coefficient j is its blossom at the knots of function j. Control points without cloth, which
// no mechanics sees, follow the tangent plane of that cell instead: the untrimmed surface stays as near as the cloth's
// own stretch, however far it reaches.
//   (1) row sums are 1; (2) extended rows reproduce every polynomial of the surface's degree per direction, rows
//       without cloth every affine map; (3) reduced lumped masses are positive where `lumped_mass` is: functions whose
//       extension would leave less than `smallest_mass` are kept.
// `lumped_mass`: n row sums of the panel. `leader` (seam_leaders; empty: no control point is another): control points
// of a seam are one, whose function is the sum of theirs; rows of followers are those of their leaders, so that the
// seam stays closed bitwise. An extended one follows the cell of one side, so law (2) holds for polynomials continued
// from there.
Extension extend(const NurbsSurface& rest, const CutQuadrature& quadrature, const Eigen::VectorXd& lumped_mass,
                 const ExtensionOptions& options = {}, const std::vector<int>& leader = {});

// Coefficients (p+1) by which the polynomial of a nonempty span, continued, has its B-spline coefficient `function`:
// the blossom at knots[function+1 .. function+p]. Uniform knots, p = 2: (1,-3,3) for the first function outside,
// (3,-8,6) for the second; a unit vector for the span's own. [de Boor 1978; Ramshaw 1989]
std::vector<double> extension_coefficients(const KnotVector& knots, int span, int function);

// Safety net under functions that are kept: fraction of density x area of an element, per control point [kg for a
// density in kg/m2 and a net in m]. Gravity stays on the true mass.
Eigen::VectorXd mass_floor(const NurbsSurface& rest, double density, double fraction = 0.01);

// Lumped masses of nodes, none below its control point's floor.
Eigen::VectorXd floored_node_mass(const AffineMap& map, const Eigen::VectorXd& lumped_mass,
                                  const Eigen::VectorXd& floor);

}  // namespace toile
