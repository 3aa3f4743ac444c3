// SPDX-License-Identifier: GPL-3.0-or-later
// The loose curves of a drawing joined to closed chains by their ends.
#pragma once

#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/outlines.h"

namespace toile::drawing {

// "(1, 2, 3)", for messages.
std::string place_text(const Eigen::Vector3d& x);

// Numbers for places: points nearer than the tolerance to one seen before share its number.
class Places {
 public:
  explicit Places(double tolerance) : tolerance_(tolerance) {}
  int operator()(const Eigen::Vector3d& x) {
    const Cell home = cell(x);
    for (long long a = -1; a <= 1; ++a)
      for (long long b = -1; b <= 1; ++b)
        for (long long c = -1; c <= 1; ++c) {
          const auto found = cells_.find({home[0] + a, home[1] + b, home[2] + c});
          if (found == cells_.end()) continue;
          for (const int k : found->second)
            if ((points_[static_cast<std::size_t>(k)] - x).norm() <= tolerance_) return k;
        }
    points_.push_back(x);
    cells_[home].push_back(static_cast<int>(points_.size()) - 1);
    return static_cast<int>(points_.size()) - 1;
  }
  int count() const { return static_cast<int>(points_.size()); }
  double tolerance() const { return tolerance_; }
  const Eigen::Vector3d& point(int k) const { return points_[static_cast<std::size_t>(k)]; }

 private:
  using Cell = std::array<long long, 3>;
  Cell cell(const Eigen::Vector3d& x) const {
    Cell c;
    for (int k = 0; k < 3; ++k) c[static_cast<std::size_t>(k)] = std::llround(std::floor(x[k] / tolerance_));
    return c;
  }
  double tolerance_;
  std::vector<Eigen::Vector3d> points_;
  std::map<Cell, std::vector<int>> cells_;
};

struct Piece {
  Curve3 curve;
  int id = 0;
  std::string name;
  int from = 0, to = 0;    // places
  bool of_closed = false;  // of a closed curve that became a mark
};

struct Step {
  int piece = 0;
  bool reversed = false;
};
using Chain = std::vector<Step>;

// The pieces of one entity as a closed chain in their own order, where they are one: whatever else meets its corners.
std::optional<Chain> closed_in_order(const std::vector<Piece>& pieces, std::size_t first, std::size_t count);

// Joins loose pieces to closed chains by their places.
class Chains {
 public:
  // `used` pieces are joined already.
  Chains(const std::vector<Piece>& pieces, std::vector<bool> used, int places, std::vector<OutlineNote>& notes);
  void find(const Places& places);

  std::vector<Chain> closed;
  std::vector<int> open;                   // pieces
  std::vector<int> slits;                  // pieces drawn out and back: one of the two
  std::vector<std::pair<int, int>> loose;  // places where nothing goes on, with the piece that ends there

 private:
  void drop_doubles(double tolerance);
  void remove(int piece);
  void drop_loose_ends();
  void follow(int first, const Places& places);

  const std::vector<Piece>& pieces_;
  std::vector<bool> used_;
  std::vector<std::vector<int>> at_;
  std::vector<int> degree_;  // ends that are left at each place
  std::vector<OutlineNote>& notes_;
};

}  // namespace toile::drawing
