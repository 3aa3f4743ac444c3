// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/pattern_sheet.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>

namespace toile {

using Eigen::Vector3d;

std::optional<DrawingPlane> drawing_plane(const NurbsSurface& surface) {
  const Vector3d centre = surface.points().rowwise().mean();
  const Eigen::Matrix3Xd spread = surface.points().colwise() - centre;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread * spread.transpose());
  Vector3d normal = axes.eigenvectors().col(0);
  const double size = spread.colwise().norm().maxCoeff();
  if (!((normal.transpose() * spread).cwiseAbs().maxCoeff() <= 1e-6 * size)) return std::nullopt;
  const Interval u = surface.u().domain(), v = surface.v().domain();
  const SurfaceJet jet = evaluate(surface, (u.min + u.max) / 2, (v.min + v.max) / 2);
  if (jet.u.cross(jet.v).dot(normal) < 0) normal = -normal;
  Vector3d right = std::abs(normal.z()) > 0.9999 ? Vector3d(normal.z() > 0 ? 1 : -1, 0, 0) : Vector3d(jet.u);
  right = (right - right.dot(normal) * normal).normalized();
  return DrawingPlane{right, normal.cross(right)};
}

PatternSheet::PatternSheet(const NurbsSurface& surface) : surface_(&surface), plane_(drawing_plane(surface)) {
  if (plane_) return;
  const Interval u = surface.u().domain(), v = surface.v().domain();
  constexpr int samples = 8;
  stretch_.setZero();
  for (int j = 0; j < samples; ++j) {
    for (int i = 0; i < samples; ++i) {
      const SurfaceJet jet =
          evaluate(surface, u.min + u.length() * (i + 0.5) / samples, v.min + v.length() * (j + 0.5) / samples);
      stretch_ += Eigen::Vector2d(jet.u.norm(), jet.v.norm()) / (samples * samples);
    }
  }
}

Eigen::Vector2d PatternSheet::operator()(const Eigen::Vector2d& uv) const {
  if (plane_) return (*plane_)((*surface_)(uv.x(), uv.y()));
  return stretch_.cwiseProduct(uv);
}

}  // namespace toile
