// SPDX-License-Identifier: GPL-3.0-or-later
// Isogeometric Kirchhoff-Love cloth: energy, force and tangent of the panels of a scene. [Peng & Zheng 2022, eqs. 1-17]
//
// Degrees of freedom: q = positions of all control points [m], panel by panel, u fastest, xyz interleaved (3 n
// numbers).
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "analysis/fabric/fabric.h"
#include "analysis/shell/kink_strip.h"
#include "geometry/nurbs_surface.h"
#include "trimming/quadrature.h"

namespace toile {

class Workers;

// One panel, SI, in the scene's axes. `rest` is unstrained; its directions weft (turned by grain from the u direction
// within the tangent plane, counter-clockwise seen against the normal) and warp carry eqs. (8) and (9). The u direction
// is `straight_u`, projected, where that is set: threads of a flat panel are straight however its net is skewed.
struct ShellPanel {
  std::string name;
  NurbsSurface rest;
  CutQuadrature quadrature;
  Fabric fabric;
  double grain = 0;                                // rad
  std::optional<Eigen::Vector3d> straight_u = {};  // unit; unset: d rest / du of each point
  // On C0 knot lines, see kink_points(); without them the cloth bends there for nothing.
  std::vector<KinkPoint> kinks = {};
};

// Quadrature that the shell asks for: p points a direction. What it integrates exactly (2 p - 1 in each direction)
// keeps the order of convergence, no motion that full quadrature sees goes unseen, and p = 2 takes less than half as
// long. Rational functions take p + 1. [Strang & Fix 1973, 4.3; analysis/README.md, "Quadrature"]
QuadratureOptions shell_quadrature(const NurbsSurface& surface);

struct ShellEnergy {
  double membrane = 0, bending = 0;             // J
  double least_strain = 0, largest_strain = 0;  // of E11, E22 and 0 at the quadrature points
  double total() const { return membrane + bending; }
};

enum class TangentKind {
  exact,  // the second derivative of the energy
  upper,  // without the part of the membrane's geometric stiffness that compression makes negative
};

// Surface functions at a material point in the fabric's own rest coordinates (weft = 1, warp = 2): row r of the arrays
// holds N, N_,1, N_,2, N_,11, N_,22, N_,12 for control points `index` (global numbers). [eqs. 5-7]
struct MaterialPoint {
  std::vector<int> index;
  std::array<std::vector<double>, 6> value;
};

// Strains, curvatures and stress resultants at a material point, in weft / warp / shear.
struct ShellState {
  Eigen::Vector3d position;
  Eigen::Vector3d strain;     // E11, E22, 2 E12
  Eigen::Vector3d curvature;  // kappa11, kappa22, kappa12, change from rest
  Eigen::Vector3d second_pk;  // S11, S22, S12 [N/m], of law (8)
  Eigen::Vector2d nominal;    // lambda S in weft and warp [N/m]
};

//   (1) force = -dE/dq; (2) rigid motion of q leaves the energy; (3) results don't depend on the number of threads;
//   (4) bending is not assembled where b0 = 0, membrane not where all k = 0.
class ShellModel {
 public:
  // Throws GeometryError where a panel's rest surface has no tangent plane or its degree is above 7, Error for a fabric
  // with impossible numbers.
  explicit ShellModel(std::vector<ShellPanel> panels);
  ~ShellModel();
  ShellModel(ShellModel&&) noexcept;
  ShellModel& operator=(ShellModel&&) noexcept;

  int control_point_count() const;
  const std::vector<ShellPanel>& panels() const;
  int first_control_point(int panel) const;
  const Eigen::VectorXd& rest() const;         // 3 n
  const Eigen::VectorXd& lumped_mass() const;  // n, row sums [kg]; 0 where a control point carries no cloth
  const Eigen::VectorXd& lumped_drag() const;  // n, row sums of eta [kg/s]

  // Overwrites `force` with the internal force [N] at q. Allocates nothing.
  ShellEnergy internal_force(const Eigen::Ref<const Eigen::VectorXd>& q, Eigen::Ref<Eigen::VectorXd> force) const;

  // Action of the tangent stiffness at q: df = K(q) dq. TangentKind::upper leaves out what compression subtracts from
  // the membrane's geometric stiffness (what a step size bound wants), TangentKind::exact is the derivative of -force.
  // Allocates nothing.
  void apply_tangent(const Eigen::Ref<const Eigen::VectorXd>& q, const Eigen::Ref<const Eigen::VectorXd>& dq,
                     Eigen::Ref<Eigen::VectorXd> df, TangentKind kind = TangentKind::upper) const;

  // The cell with the largest share of dq . K(q) dq, and that share's parts.
  struct Cell {
    int panel = 0, i = 0, j = 0;
  };
  struct CellShare {
    Cell cell;
    double membrane = 0, bending = 0;  // J, for dq in m
  };
  CellShare stiffest_cell(const Eigen::Ref<const Eigen::VectorXd>& q,
                          const Eigen::Ref<const Eigen::VectorXd>& dq) const;

  // Forces and tangents by this many threads from now on: the same bits, as every sum keeps its order, but one caller
  // at a time. Models of fewer than 8000 quadrature points stay on the caller's thread, which is faster. 1: no
  // threads.
  void use_threads(int count);
  std::shared_ptr<Workers> workers() const;  // those threads, for work between the model's; null: none

  std::size_t quadrature_points() const;
  std::size_t table_bytes() const;  // memory of the stored functions

  MaterialPoint material_point(int panel, double u, double v) const;
  ShellState state(int panel, double u, double v, const Eigen::Ref<const Eigen::VectorXd>& q) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace toile
