// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/iges/closed_chains.h"

namespace toile::iges {

std::vector<std::size_t> closed_chains(const std::vector<std::array<Eigen::Vector3d, 2>>& ends, double reach) {
  std::vector<std::size_t> begins{0};
  if (ends.empty()) return begins;
  const auto meet = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return (a - b).norm() <= reach; };
  Eigen::Vector3d tail = ends[0][0], head = ends[0][1];
  for (std::size_t i = 1; i < ends.size(); ++i) {
    const auto& [a, b] = ends[i];
    if (meet(head, a)) {
      head = b;
    } else if (meet(head, b)) {
      head = a;
    } else if (begins.back() + 1 == i && meet(tail, a)) {  // the first curve of a chain may run backwards
      tail = head;
      head = b;
    } else if (begins.back() + 1 == i && meet(tail, b)) {
      tail = head;
      head = a;
    } else {
      if (!meet(tail, head)) return {0};
      begins.push_back(i);
      tail = a;
      head = b;
    }
  }
  return meet(tail, head) ? begins : std::vector<std::size_t>{0};
}

}  // namespace toile::iges
