// SPDX-License-Identifier: GPL-3.0-or-later
// Fixed points z = G(z), faster. [Anderson 1965; Walker & Ni 2011]
#pragma once

#include <Eigen/Core>
#include <Eigen/QR>
#include <vector>

namespace toile {

class Anderson {
 public:
  explicit Anderson(int depth) : depth_(depth) {}
  void restart() { results_.clear(), residuals_.clear(); }
  // The next z after `result` = G(z): the combination of the last results whose residuals G(z) - z cancel best.
  Eigen::VectorXd next(const Eigen::VectorXd& z, const Eigen::VectorXd& result) {
    results_.push_back(result);
    residuals_.push_back(result - z);
    if (static_cast<int>(results_.size()) > depth_ + 1) {
      results_.erase(results_.begin());
      residuals_.erase(residuals_.begin());
    }
    const auto last = static_cast<Eigen::Index>(results_.size()) - 1;
    if (last == 0) return result;
    Eigen::MatrixXd steps(z.size(), last), moves(z.size(), last);
    for (Eigen::Index k = 0; k < last; ++k) {
      const auto i = static_cast<std::size_t>(k);
      steps.col(k) = residuals_[i + 1] - residuals_[i];
      moves.col(k) = results_[i + 1] - results_[i];
    }
    return result - moves * steps.colPivHouseholderQr().solve(residuals_.back());
  }

 private:
  int depth_;
  std::vector<Eigen::VectorXd> results_, residuals_;
};

}  // namespace toile
