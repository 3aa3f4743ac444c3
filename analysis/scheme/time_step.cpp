// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/scheme/time_step.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include "geometry/error.h"
#include "geometry/text.h"

namespace toile {
namespace {

constexpr int max_iterations = 60;
constexpr int least = 20;        // iterations that a start may hide the largest eigenvalue
constexpr double enough = 0.02;  // residual over Ritz value at which the bound costs 1 % of the step

// A start that no symmetry of the panel can be orthogonal to, the same on every machine. [splitmix64, Steele et al.
// 2014]
Eigen::VectorXd start_vector(Eigen::Index n) {
  Eigen::VectorXd v(n);
  std::uint64_t state = 1;
  for (double& x : v) {
    std::uint64_t z = (state += 0x9e3779b97f4a7c15ull);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    x = static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1.0p-52 - 1.0;
  }
  return v.normalized();
}

// dq = T dx, without the moved part of the map.
void apply_free_part(const AffineMap& map, const Eigen::VectorXd& dx, Eigen::VectorXd& dq) {
  using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
  Eigen::Map<Points>(dq.data(), map.control_points(), 3).noalias() =
      map.free_part() * Eigen::Map<const Points>(dx.data(), map.nodes(), 3);
}

// Largest eigenvalue of a tridiagonal matrix, its vector in v. Shifted and scaled so that every diagonal is from 1 to
// 3: Eigen's iteration deflates by an absolute threshold and does not end on entries that differ by many powers of ten.
double largest_pair(const Eigen::Ref<const Eigen::VectorXd>& diagonal, const Eigen::Ref<const Eigen::VectorXd>& beside,
                    Eigen::VectorXd& v) {
  const double size = diagonal.lpNorm<Eigen::Infinity>() + 2 * beside.lpNorm<Eigen::Infinity>();
  v = Eigen::VectorXd::Unit(diagonal.size(), 0);
  if (!(size > 0)) return 0;
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
  solver.computeFromTridiagonal(diagonal / size + Eigen::VectorXd::Constant(diagonal.size(), 2), beside / size);
  if (solver.info() != Eigen::Success)
    throw SolverError("no time step: the eigenvalues of the stiffness are not found");
  v = solver.eigenvectors().rightCols<1>();
  return (solver.eigenvalues().tail<1>()[0] - 2) * size;
}

}  // namespace

// Lanczos with full reorthogonalisation on M^-1/2 T^T K T M^-1/2: the residual of the largest Ritz pair bounds its
// distance to an eigenvalue, the largest one for all but unlucky starts. [Parlett 1998, ch. 13]
TimeStepBound time_step_bound(const Model& model, const AffineMap& map, const Eigen::VectorXd& node_mass,
                              const Eigen::VectorXd& q, Workers* workers, const Potential* besides) {
  TimeStepBound bound;
  bound.dt = std::numeric_limits<double>::infinity();
  const int nodes = map.nodes();
  const Eigen::Index n = 3 * nodes;
  if (n == 0) return bound;
  for (int k = 0; k < nodes; ++k)
    if (!(node_mass[k] > 0))
      throw SolverError("no time step: control point " + std::to_string(map.node_control_point()[k]) + " has mass " +
                        text(node_mass[k]) + " kg");
  const Eigen::VectorXd scale = node_mass.cwiseSqrt().cwiseInverse().replicate(1, 3).transpose().reshaped();

  std::vector<const Potential*> potentials = model.potentials();
  if (besides) potentials.push_back(besides);
  const int steps = static_cast<int>(std::min<Eigen::Index>(max_iterations, n));
  Eigen::MatrixXd basis(n, steps);
  Eigen::VectorXd alpha(steps), beta(steps), ritz_vector, dx(n), dq(3 * map.control_points()), df(dq.size()), image(n);
  basis.col(0) = start_vector(n);
  double ritz = 0, residual = 0;
  int used = 0;
  for (int k = 0; k < steps; ++k) {
    dx = scale.cwiseProduct(basis.col(k));
    apply_free_part(map, dx, dq);
    df.setZero();
    for (const Potential* potential : potentials) potential->add_force_change(q, dq, df, TangentKind::upper, workers);
    map.reduce(df, image);
    image = -image;
    image.array() *= scale.array();
    if (!image.allFinite()) throw SolverError("no time step: the stiffness of this state is not finite");
    alpha[k] = basis.col(k).dot(image);
    used = k + 1;
    for (int pass = 0; pass < 2; ++pass)
      image -= basis.leftCols(used) * (basis.leftCols(used).transpose() * image).eval();
    beta[k] = image.norm();
    const bool ends = !(beta[k] > 1e-12 * alpha.head(used).cwiseAbs().maxCoeff()) || used == steps;
    if (ends || (used >= least && used % 4 == 0)) {
      ritz = largest_pair(alpha.head(used), beta.head(used - 1), ritz_vector);
      residual = beta[k] * std::abs(ritz_vector[used - 1]);
      if (ends || residual <= enough * ritz) break;
    }
    basis.col(used) = image / beta[k];
  }
  if (!(ritz > 0)) return bound;

  bound.eigenvalue = ritz + residual;
  bound.relative_gap = residual / ritz;
  bound.dt = 2 / std::sqrt(bound.eigenvalue);
  dx = scale.cwiseProduct(basis.leftCols(used) * ritz_vector);
  apply_free_part(map, dx, dq);
  const CellShare share = model.stiffest_cell(q, dq);
  bound.cell = share.cell;
  bound.bending = share.bending > share.membrane;
  return bound;
}

}  // namespace toile
