// SPDX-License-Identifier: GPL-3.0-or-later
// The size by which forces on nodes are compared.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace toile {

// |M^-1/2 f| [N / sqrt(kg)]: what is left on light nodes counts for more, as it moves them more.
inline double force_norm(const Eigen::VectorXd& f, const Eigen::VectorXd& node_mass) {
  double sum = 0;
  for (Eigen::Index k = 0; k < node_mass.size(); ++k) sum += f.segment<3>(3 * k).squaredNorm() / node_mass[k];
  return std::sqrt(sum);
}

}  // namespace toile
