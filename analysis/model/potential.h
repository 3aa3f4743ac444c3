// SPDX-License-Identifier: GPL-3.0-or-later
// What stores energy in a state of the coordinates: the elastic laws of a model, later seams.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "analysis/fabric/stiffening.h"
#include "analysis/model/energy_parts.h"

namespace toile {

class BlockMatrix;
class BlockPattern;
class Workers;

enum class TangentKind {
  exact,  // the second derivative of the energy
  upper,  // without the part of the membrane's geometric stiffness that compression makes negative
  // Positive semidefinite: `upper`, and of bending what the slope of its law gives (Gauss-Newton). Hessians only.
  positive,
};

// What the potentials of a system store in a state.
struct Elastic {
  EnergyParts energy;
  StrainRange strain;  // over all quadrature points
  double total() const { return energy.total(); }
};

// q: positions of all coordinates [m], xyz interleaved.
//   (1) forces are -dE/dq, and changes of force -K dq with K the derivative of dE/dq (TangentKind::exact);
//   (2) a rigid motion of q leaves the energy unchanged;
//   (3) results don't depend on the number of threads; with threads a potential serves one caller at a time.
class Potential {
 public:
  virtual ~Potential() = default;
  // Adds its force [N] and its part of `elastic`. Workers: null for the caller's thread alone. Allocates nothing.
  virtual void add_force(const Eigen::Ref<const Eigen::VectorXd>& q, Eigen::Ref<Eigen::VectorXd> force,
                         Elastic& elastic, Workers* workers) const = 0;
  // Adds the change of its force for a change dq at q. Allocates nothing.
  virtual void add_force_change(const Eigen::Ref<const Eigen::VectorXd>& q, const Eigen::Ref<const Eigen::VectorXd>& dq,
                                Eigen::Ref<Eigen::VectorXd> df, TangentKind kind, Workers* workers) const = 0;

  // The Hessian, assembled. Points that act on each other, group by group: what a BlockPattern must hold.
  virtual std::vector<std::vector<int>> couplings() const = 0;
  // Where this potential's blocks go in a pattern that holds its couplings; made once for each pattern.
  virtual std::vector<int> slots(const BlockPattern& pattern) const = 0;
  // Adds d2E/dq2 at q.
  virtual void add_hessian(const Eigen::Ref<const Eigen::VectorXd>& q, TangentKind kind, std::span<const int> slots,
                           BlockMatrix& matrix, Workers* workers) const = 0;
};

// Force of all of them at q [N], overwriting `force`, and what they store.
inline Elastic internal_force(const std::vector<const Potential*>& potentials,
                              const Eigen::Ref<const Eigen::VectorXd>& q, Eigen::Ref<Eigen::VectorXd> force,
                              Workers* workers = nullptr) {
  Elastic elastic;
  force.setZero();
  for (const Potential* potential : potentials) potential->add_force(q, force, elastic, workers);
  return elastic;
}

}  // namespace toile
