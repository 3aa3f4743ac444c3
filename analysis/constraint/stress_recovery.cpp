// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/constraint/stress_recovery.h"

namespace toile {

std::vector<ThreadStress> row_stress(const Body& body, const ConstraintRows& rows,
                                     const Eigen::Ref<const Eigen::VectorXd>& row_force,
                                     const Eigen::Ref<const Eigen::VectorXd>& q) {
  std::vector<ThreadStress> out;
  for (std::size_t r = 0; r < rows.strain.size(); ++r) {
    const StrainRow& row = rows.strain[r];
    const MaterialState fabric = body.state(row.panel, row.uv.x(), row.uv.y(), q);
    const double limit = row_force[static_cast<Eigen::Index>(r)] / row.area;
    const Eigen::Vector2d share = row.thread.cwiseAbs2();
    out.push_back(
        {share.dot(fabric.second_pk.head<2>()) + limit / apply(row.row, q).norm(), share.dot(fabric.nominal) + limit});
  }
  return out;
}

StressField::StressField(const Body& body, const ConstraintRows& rows, const std::vector<ThreadStress>& stress)
    : body_(body) {
  sums_.fill(Eigen::Matrix3Xd::Zero(3, body.point_count()));
  for (std::size_t r = 0; r < rows.strain.size(); ++r) {
    const StrainRow& row = rows.strain[r];
    const MaterialPoint point = body.material_point(row.panel, row.uv.x(), row.uv.y());
    for (std::size_t k = 0; k < point.index.size(); ++k)
      sums_[row.warp ? 1 : 0].col(point.index[k]) +=
          row.area * point.value[0][k] * Eigen::Vector3d(1, stress[r].second_pk, stress[r].nominal);
  }
}

std::array<ThreadStress, 2> StressField::at(int panel, double u, double v,
                                            const Eigen::Ref<const Eigen::VectorXd>& q) const {
  const MaterialPoint point = body_.material_point(panel, u, v);
  std::array<ThreadStress, 2> out;
  for (std::size_t d = 0; d < 2; ++d) {
    double reached = 0;
    for (std::size_t k = 0; k < point.index.size(); ++k) {
      const auto sum = sums_[d].col(point.index[k]);
      if (!(sum[0] > 0)) continue;
      const double value = point.value[0][k];
      reached += value;
      out[d].second_pk += value * sum[1] / sum[0];
      out[d].nominal += value * sum[2] / sum[0];
    }
    if (reached > 0) {
      out[d].second_pk /= reached;
      out[d].nominal /= reached;
    } else {
      const MaterialState fabric = body_.state(panel, u, v, q);
      const auto c = static_cast<Eigen::Index>(d);
      out[d] = {fabric.second_pk[c], fabric.nominal[c]};
    }
  }
  return out;
}

}  // namespace toile
