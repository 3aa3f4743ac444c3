// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/scheme/node_forces.h"

#include <utility>

namespace toile {
namespace {

BlockPattern couplings_of(const MechanicalSystem& system) {
  std::vector<std::vector<int>> groups;
  for (const Potential* potential : system.potentials)
    for (std::vector<int>& group : potential->couplings()) groups.push_back(std::move(group));
  return BlockPattern(system.map->control_points(), groups);
}

}  // namespace

using Vector = Eigen::VectorXd;
using Places = Eigen::Ref<const Vector>;

NodeForces::NodeForces(const MechanicalSystem& system)
    : system_(system),
      pattern_(couplings_of(system)),
      reduced_(pattern_, *system.map),
      points_(pattern_),
      nodes_(reduced_.pattern()),
      q_(3 * system.map->control_points()),
      f_(q_.size()),
      of_nodes_(3 * system.map->nodes()) {
  for (const Potential* potential : system.potentials) slots_.push_back(potential->slots(pattern_));
}

void NodeForces::at(double t, const Vector& from, double beta) {
  system_.map->fixed_places(t, fixed_places_);
  from_ = from;
  beta_ = beta;
}

Elastic NodeForces::force(const Places& x) {
  system_.map->expand(x, fixed_places_, q_, system_.workers);
  const Elastic elastic = internal_force(system_.potentials, q_, f_, system_.workers);
  f_ += load_factor * system_.loads.force;
  return elastic;
}

double NodeForces::value(const Places& x) {
  double sum = force(x).total() - load_factor * system_.loads.force.dot(q_);
  for (int k = 0; k < system_.map->nodes(); ++k)
    sum += 0.5 * system_.node_drag[k] * beta_ * (velocity(x, k) - system_.loads.wind).squaredNorm();
  return sum;
}

void NodeForces::add_gradient(const Places& x, Vector& g) {
  force(x);
  system_.map->reduce(f_, of_nodes_, system_.workers);
  g -= of_nodes_;
  for (int k = 0; k < system_.map->nodes(); ++k)
    g.segment<3>(3 * k) += system_.node_drag[k] * (velocity(x, k) - system_.loads.wind);
}

const BlockMatrix& NodeForces::hessian(const Places& x, bool positive) {
  system_.map->expand(x, fixed_places_, q_, system_.workers);
  points_.set_zero();
  for (std::size_t k = 0; k < slots_.size(); ++k)
    system_.potentials[k]->add_hessian(q_, positive ? TangentKind::positive : TangentKind::exact, slots_[k], points_,
                                       system_.workers);
  reduced_.reduce(points_, nodes_);
  for (int k = 0; k < system_.map->nodes(); ++k)
    for (int a = 0; a < 3; ++a) nodes_.block(pattern().first_slot(k))[4 * a] += system_.node_drag[k] / beta_;
  return nodes_;
}

}  // namespace toile
