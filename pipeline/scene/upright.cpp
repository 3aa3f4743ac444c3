// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/scene/upright.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "geometry/measure.h"
#include "geometry/refine.h"

namespace toile {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double gap = 0.05;   // m between panels that hang side by side
constexpr double level = 0.1;  // a direction that rises by less of its length lies level

struct Flat {
  Vector3d normal, grain;
  Eigen::Matrix3Xd border;  // m
};

std::optional<Flat> flat(const TrimmedSurface& panel) {
  const double size = bounding_box(panel.surface).diagonal().norm();
  const auto patch = affine_patch(panel.surface, 1e-6 * size);
  if (!patch) return std::nullopt;
  Flat out;
  const Vector3d u = patch->du.normalized(), v = patch->dv.normalized();
  out.normal = u.cross(v).normalized();
  if (const auto weft = grain_angle(panel)) {
    out.grain = -std::sin(*weft) * u + std::cos(*weft) * v;
  } else {
    const Vector3d y = Vector3d::UnitY() - out.normal.y() * out.normal;
    out.grain = y.norm() > 0.5 ? y : v;
  }
  out.grain = (out.grain - out.grain.dot(out.normal) * out.normal).normalized();
  const bool down = std::abs(out.grain.y()) > level ? out.grain.y() < 0 : out.grain.x() < -1e-12;
  if (down) out.grain = -out.grain;
  std::vector<Vector3d> points;
  for (const TrimCurve& trim : panel.loops[0].curves) {
    for (int k = 0; k < 16; ++k) {
      const Eigen::Vector2d p = trim.curve(trim.curve.domain().min + trim.curve.domain().length() * k / 16);
      points.push_back(panel.metres_per_unit * panel.surface(p.x(), p.y()));
    }
  }
  out.border.resize(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t k = 0; k < points.size(); ++k) out.border.col(static_cast<Eigen::Index>(k)) = points[k];
  return out;
}

// Angles about x, then y, then z, in degrees; exact ones stay so.
Vector3d angles(const Matrix3d& r) {
  Vector3d out(std::atan2(r(2, 1), r(2, 2)), std::asin(std::clamp(-r(2, 0), -1.0, 1.0)), std::atan2(r(1, 0), r(0, 0)));
  out *= 180 / std::numbers::pi;
  for (double& a : out)
    if (std::abs(a - std::round(a)) < 1e-9) a = std::round(a) + 0.0;
  return out;
}

}  // namespace

std::optional<std::vector<PatternPlace>> hang_upright(const std::vector<TrimmedSurface>& panels) {
  std::vector<Flat> all;
  for (const TrimmedSurface& panel : panels) {
    const auto one = flat(panel);
    if (!one || (!all.empty() && one->normal.cross(all[0].normal).norm() > 1e-6)) return std::nullopt;
    all.push_back(*one);
  }
  std::vector<Matrix3d> turns;
  std::vector<Eigen::AlignedBox3d> boxes;
  bool stays = true;
  for (const Flat& one : all) {
    Matrix3d r;
    r.row(0) = one.grain.cross(one.normal);
    r.row(1) = one.grain;
    r.row(2) = one.normal;
    stays = stays && r.isIdentity(1e-9);
    turns.push_back(r);
    const Eigen::Matrix3Xd turned = r * one.border;
    Eigen::AlignedBox3d box(Vector3d(turned.rowwise().minCoeff()), Vector3d(turned.rowwise().maxCoeff()));
    for (const Eigen::AlignedBox3d& other : boxes) {
      const Eigen::AlignedBox3d both = box.intersection(other);
      stays = stays && (both.isEmpty() || both.sizes().head<2>().minCoeff() <= 0);
    }
    boxes.push_back(box);
  }
  std::vector<PatternPlace> out(panels.size());
  if (stays) return out;
  double x = 0;
  for (std::size_t k = 0; k < panels.size(); ++k) {
    out[k].rotate_deg = angles(turns[k]);
    out[k].translate = {x - boxes[k].min().x(), -boxes[k].max().y(), -boxes[k].min().z()};
    x += boxes[k].sizes().x() + gap;
  }
  return out;
}

}  // namespace toile
