// SPDX-License-Identifier: GPL-3.0-or-later
// Contact and friction around the constraint solver of a step: normal impulses with a compliant law, anchored Coulomb
// friction. [projected Gauss-Seidel on rows: Jean 1999; alternation with the strain limit accelerated: Anderson 1965]
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "analysis/contact/contact_proxy.h"
#include "analysis/contact/contact_row.h"
#include "analysis/contact/contact_search.h"
#include "analysis/contact/obstacle.h"
#include "analysis/projection/constraint_solver.h"

namespace toile {

struct ContactOptions {
  double acceleration = 9.81;  // m/s2 at work, which small displacements and forces are compared with
  double push_out = 0.2;       // m/s, at which cloth that starts nearer than its offset is moved off, without velocity
  int max_rounds = 30;         // of contact and the other constraints in turn
  ContactSearchOptions search = {};
};

// The offset of a vertex from an obstacle is half the cloth's thickness, the obstacle's thickness and the chord error
// there. A contact yields to its normal force, under its own weight by a hundredth of the offset and never by more than
// three tenths.
//
// Contact impulses p [kg m] move nodes in the step by M^-1 W^T p and change velocities by M^-1 W^T p / dt, within the
// solution of the other constraints; settle() then takes inward and held velocities out. A resting contact has half its
// force from each.
//   (1) the normal impulse is >= 0, the tangential one at most friction times it;
//   (2) a contact that sticks stays at its anchor, a material point of the obstacle; one that slides takes it along;
//   (3) `contact_met`: with the other constraints met, no contact would move by more than 2 % of its offset along the
//       normal, nor along the surface by more than 0.2 % of acceleration dt^2 or 1 % of what its normal force moves it;
//   (4) results don't depend on threads;
//   (5) contacts of a still obstacle add no energy but the law's.
class ContactProjection final : public ConstraintSolver {
 public:
  // `inner`: the other constraints; null: none. Obstacles must outlive it.
  // `node_drag` [kg/s]: steps take it as if nothing touched, which the reported forces make up for.
  ContactProjection(const Body& body, const AffineMap& map, const Eigen::VectorXd& node_mass,
                    const Eigen::VectorXd& node_drag, const std::vector<ProxyPanel>& panels,
                    const std::vector<std::unique_ptr<Obstacle>>& obstacles, std::unique_ptr<ConstraintSolver> inner,
                    const ContactOptions& options = {});
  ~ContactProjection() override;

  ProjectionReport project(Eigen::Ref<Eigen::VectorXd> x, double t) override;  // without contact
  ProjectionReport step(Eigen::Ref<Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> v, double t,
                        const Eigen::Ref<const Eigen::VectorXd>& start, double dt, ConstraintForces& forces) override;
  bool end_velocity() const override { return true; }
  double settle(Eigen::Ref<Eigen::VectorXd> v, double t) override;
  double step_share() const override;
  ProjectionReport measure(const Eigen::Ref<const Eigen::VectorXd>& x, double t) override;  // without contact
  double energy(const Eigen::Ref<const Eigen::VectorXd>& x, double t) override;
  const ProjectionMemory& memory() const override;
  void use_threads(Workers* workers) override;
  const ConstraintRows& rows() const override;
  std::size_t factor_nonzeros() const override;
  std::size_t gram_nonzeros() const override;

  const std::vector<ContactRow>& contacts() const;  // of the last step
  const ContactRow* worst() const;                  // the one farthest from its balance there; null: none
  const ContactProxy& proxy() const;
  struct Counts {
    long steps = 0, rounds = 0, sweeps = 0;
    double search_seconds = 0, sweep_seconds = 0;  // wall time
    double seconds() const { return search_seconds + sweep_seconds; }
    Counts& operator+=(const Counts& more);
  };
  const Counts& counts() const;

 private:
  void set_memory(const ProjectionMemory& memory) override;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace toile
