// SPDX-License-Identifier: GPL-3.0-or-later
// What every model has of a scene's cloth: panels, coordinates, masses, and how the position of a material point
// depends on the coordinates. Constraint rows, pins, stress recovery and contact know a Body, never a model.
//
// Coordinates: positions of points [m], panel by panel, xyz interleaved (3 n numbers). The points of a shell are the
// control points of its panels, u fastest.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "analysis/model/cloth_panel.h"

namespace toile {

// The one sparse row: a row d over points gives the vector y = sum_I d_I q_I.
struct ScalarRow {
  std::vector<int> index;  // points, ascending
  std::vector<double> value;
};
// y = sum d_I q_I.
inline Eigen::Vector3d apply(const ScalarRow& row, const Eigen::Ref<const Eigen::VectorXd>& q) {
  Eigen::Vector3d y = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < row.index.size(); ++k) y += row.value[k] * q.segment<3>(3 * row.index[k]);
  return y;
}

// Functions at a material point in the fabric's own rest coordinates (weft = 1, warp = 2): row r of the arrays holds N,
// N_,1, N_,2, N_,11, N_,22, N_,12 for points `index` (global numbers). [Peng & Zheng 2022, eqs. 5-7]
struct MaterialPoint {
  std::vector<int> index;
  std::array<std::vector<double>, 6> value;
};

// Strains, curvatures and stress resultants at a material point, in weft / warp / shear.
struct MaterialState {
  Eigen::Vector3d position;
  Eigen::Vector3d strain;     // E11, E22, 2 E12
  Eigen::Vector3d curvature;  // kappa11, kappa22, kappa12, change from rest
  Eigen::Vector3d second_pk;  // S11, S22, S12 [N/m], of law (8)
  Eigen::Vector2d nominal;    // lambda S in weft and warp [N/m]
};

class Body {
 public:
  virtual ~Body() = default;

  const std::vector<ClothPanel>& panels() const { return data_->panels; }
  int point_count() const { return data_->first.back(); }
  int first_point(int panel) const { return data_->first[static_cast<std::size_t>(panel)]; }
  const Eigen::VectorXd& rest() const { return data_->rest; }
  const Eigen::VectorXd& lumped_mass() const { return data_->lumped_mass; }
  const Eigen::VectorXd& lumped_drag() const { return data_->lumped_drag; }

  // Where a material place is: its position is apply(place(...), q).
  virtual ScalarRow place(int panel, double u, double v) const = 0;
  virtual MaterialPoint material_point(int panel, double u, double v) const = 0;
  virtual MaterialState state(int panel, double u, double v, const Eigen::Ref<const Eigen::VectorXd>& q) const = 0;

 protected:
  struct Data {
    std::vector<ClothPanel> panels;
    std::vector<int> first;       // point of each panel, and their number n
    Eigen::VectorXd rest;         // 3 n
    Eigen::VectorXd lumped_mass;  // n, row sums [kg]; 0 where a point carries no cloth
    Eigen::VectorXd lumped_drag;  // n, row sums of eta [kg/s]
  };
  explicit Body(std::unique_ptr<Data> data) : data_(std::move(data)) {}
  Body(Body&&) = default;
  Body& operator=(Body&&) = default;

  std::unique_ptr<Data> data_;  // stays where it is when the body is moved
};

}  // namespace toile
