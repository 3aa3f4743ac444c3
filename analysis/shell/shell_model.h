// SPDX-License-Identifier: GPL-3.0-or-later
// Isogeometric Kirchhoff-Love cloth: energy, force and tangent of the panels of a scene. [Peng & Zheng 2022, eqs. 1-17]
//
// Points of the body are the control points of the panels, so a panel's net is what the state holds of it.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "analysis/model/model.h"

namespace toile {

// Quadrature that the shell asks for: p points a direction. What it integrates exactly (2 p - 1 in each direction)
// keeps the order of convergence, no motion that full quadrature sees goes unseen, and p = 2 takes less than half as
// long. Rational functions take p + 1. [Strang & Fix 1973, 4.3; analysis/shell/README.md, "Quadrature"]
QuadratureOptions shell_quadrature(const NurbsSurface& surface);

struct ShellEnergy {
  double membrane = 0, bending = 0;             // J
  double least_strain = 0, largest_strain = 0;  // of E11, E22 and 0 at the quadrature points
  double total() const { return membrane + bending; }
};

//   (1) force = -dE/dq; (2) rigid motion of q leaves the energy; (3) results don't depend on the number of threads;
//   (4) bending is not assembled where b0 and twist are 0, membrane not where weft, warp and shear are 0.
// Models of fewer than 8000 quadrature points stay on the caller's thread, which is faster; larger ones serve one
// caller with threads at a time.
class ShellModel final : public Model, public Potential {
 public:
  // Throws GeometryError where a panel's rest surface has no tangent plane or its degree is above 7, Error for a fabric
  // with impossible numbers.
  explicit ShellModel(std::vector<ClothPanel> panels);
  ~ShellModel() override;
  ShellModel(ShellModel&&) noexcept;
  ShellModel& operator=(ShellModel&&) noexcept;

  std::vector<const Potential*> potentials() const override { return {this}; }
  ScalarRow place(int panel, double u, double v) const override;
  MaterialPoint material_point(int panel, double u, double v) const override;
  MaterialState state(int panel, double u, double v, const Eigen::Ref<const Eigen::VectorXd>& q) const override;
  Eigen::Matrix3Xd net(int panel, const Eigen::Ref<const Eigen::VectorXd>& q) const override;
  CellShare stiffest_cell(const Eigen::Ref<const Eigen::VectorXd>& q,
                          const Eigen::Ref<const Eigen::VectorXd>& dq) const override;

  void add_force(const Eigen::Ref<const Eigen::VectorXd>& q, Eigen::Ref<Eigen::VectorXd> force, Elastic& elastic,
                 Workers* workers) const override;
  void add_force_change(const Eigen::Ref<const Eigen::VectorXd>& q, const Eigen::Ref<const Eigen::VectorXd>& dq,
                        Eigen::Ref<Eigen::VectorXd> df, TangentKind kind, Workers* workers) const override;

  std::vector<std::vector<int>> couplings() const override;
  std::vector<int> slots(const BlockPattern& pattern) const override;
  void add_hessian(const Eigen::Ref<const Eigen::VectorXd>& q, TangentKind kind, std::span<const int> slots,
                   BlockMatrix& matrix, Workers* workers) const override;

  // The same alone: overwrites `force` with the internal force [N] at q; df = K(q) dq.
  ShellEnergy internal_force(const Eigen::Ref<const Eigen::VectorXd>& q, Eigen::Ref<Eigen::VectorXd> force,
                             Workers* workers = nullptr) const;
  void apply_tangent(const Eigen::Ref<const Eigen::VectorXd>& q, const Eigen::Ref<const Eigen::VectorXd>& dq,
                     Eigen::Ref<Eigen::VectorXd> df, TangentKind kind = TangentKind::upper,
                     Workers* workers = nullptr) const;

  std::size_t quadrature_points() const;
  std::size_t table_bytes() const override;  // of the stored functions

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace toile
