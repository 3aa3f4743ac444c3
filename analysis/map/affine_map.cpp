// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/map/affine_map.h"

#include <cassert>
#include <string>
#include <utility>

#include "geometry/error.h"

namespace toile {
namespace {

using Matrix = AffineMap::Matrix;
using Triplets = std::vector<Eigen::Triplet<double>>;

bool identity_row(const Matrix& m, int i) {
  int entries = 0;
  bool unit = false;
  for (Matrix::InnerIterator e(m, i); e; ++e) {
    if (e.value() == 0) continue;
    ++entries;
    unit = unit || (e.col() == i && e.value() == 1);
  }
  return entries == 1 && unit;
}

Matrix assemble(int rows, int cols, const Triplets& entries) {
  Matrix m(rows, cols);
  m.setFromTriplets(entries.begin(), entries.end());
  return m;
}

}  // namespace

AffineMap::AffineMap(const Matrix& dependence, std::vector<int> fixed, Motion motion)
    : fixed_(std::move(fixed)), motion_(std::move(motion)) {
  const int n = static_cast<int>(dependence.rows());
  if (dependence.cols() != n) throw SolverError("affine map: the dependence matrix isn't square");
  if (!fixed_.empty() && !motion_) throw SolverError("affine map: fixed control points need a motion");

  std::vector<int> fixed_slot(n, -1), node_slot(n, -1);
  for (std::size_t k = 0; k < fixed_.size(); ++k) {
    const int i = fixed_[k];
    if (i < 0 || i >= n || fixed_slot[i] >= 0)
      throw SolverError("affine map: control point " + std::to_string(i) + " is out of range or fixed twice");
    fixed_slot[i] = static_cast<int>(k);
  }
  for (int i = 0; i < n; ++i)
    if (fixed_slot[i] < 0 && identity_row(dependence, i)) {
      node_slot[i] = static_cast<int>(node_control_point_.size());
      node_control_point_.push_back(i);
    }

  Triplets free_entries, fixed_entries;
  for (int i = 0; i < n; ++i) {
    if (fixed_slot[i] >= 0) {
      fixed_entries.emplace_back(i, fixed_slot[i], 1.0);
      continue;
    }
    for (Matrix::InnerIterator e(dependence, i); e; ++e) {
      const int j = static_cast<int>(e.col());
      if (e.value() == 0) continue;
      if (fixed_slot[j] >= 0)
        fixed_entries.emplace_back(i, fixed_slot[j], e.value());
      else if (node_slot[j] >= 0)
        free_entries.emplace_back(i, node_slot[j], e.value());
      else
        throw SolverError("affine map: control point " + std::to_string(i) + " follows " + std::to_string(j) +
                          ", which is itself dependent");
    }
  }
  free_ = assemble(n, static_cast<int>(node_control_point_.size()), free_entries);
  transposed_ = free_.transpose();
  fixed_part_ = assemble(n, static_cast<int>(fixed_.size()), fixed_entries);
}

Matrix AffineMap::identity(int control_points) {
  Matrix m(control_points, control_points);
  m.setIdentity();
  return m;
}

AffineMap::Matrix AffineMap::all() const {
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < control_points(); ++i) {
    for (Matrix::InnerIterator e(free_, i); e; ++e) entries.emplace_back(i, static_cast<int>(e.col()), e.value());
    for (Matrix::InnerIterator e(fixed_part_, i); e; ++e)
      entries.emplace_back(i, nodes() + static_cast<int>(e.col()), e.value());
  }
  Matrix out(control_points(), nodes() + static_cast<int>(fixed_.size()));
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

Eigen::Matrix3Xd AffineMap::fixed_places(double t) const {
  Eigen::Matrix3Xd places;
  fixed_places(t, places);
  return places;
}

void AffineMap::fixed_places(double t, Eigen::Matrix3Xd& places) const {
  places.resize(3, static_cast<Eigen::Index>(fixed_.size()));
  for (std::size_t k = 0; k < fixed_.size(); ++k) places.col(k) = motion_(k, t);
}

void AffineMap::expand(const Eigen::Ref<const Eigen::VectorXd>& x, double t, Eigen::Ref<Eigen::VectorXd> q) const {
  expand(x, fixed_places(t), q);
}

void AffineMap::expand(const Eigen::Ref<const Eigen::VectorXd>& x, const Eigen::Matrix3Xd& places,
                       Eigen::Ref<Eigen::VectorXd> q, Workers* workers) const {
  assert(x.size() == 3 * nodes() && q.size() == 3 * control_points());
  share_out(workers, control_points(), [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (Matrix::InnerIterator e(free_, i); e; ++e) sum += e.value() * x.segment<3>(3 * e.col());
      for (Matrix::InnerIterator e(fixed_part_, i); e; ++e) sum += e.value() * places.col(e.col());
      q.segment<3>(3 * i) = sum;
    }
  });
}

void AffineMap::reduce(const Eigen::Ref<const Eigen::VectorXd>& f, Eigen::Ref<Eigen::VectorXd> fx,
                       Workers* workers) const {
  assert(f.size() == 3 * control_points() && fx.size() == 3 * nodes());
  share_out(workers, nodes(), [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (Matrix::InnerIterator e(transposed_, k); e; ++e) sum += e.value() * f.segment<3>(3 * e.col());
      fx.segment<3>(3 * k) = sum;
    }
  });
}

Eigen::VectorXd AffineMap::reduce_scalar(const Eigen::Ref<const Eigen::VectorXd>& m) const {
  assert(m.size() == control_points());
  return free_.transpose() * m;
}

Eigen::VectorXd AffineMap::restrict(const Eigen::Ref<const Eigen::VectorXd>& q) const {
  assert(q.size() == 3 * control_points());
  Eigen::VectorXd x(3 * nodes());
  for (int k = 0; k < nodes(); ++k) x.segment<3>(3 * k) = q.segment<3>(3 * node_control_point_[k]);
  return x;
}

}  // namespace toile
