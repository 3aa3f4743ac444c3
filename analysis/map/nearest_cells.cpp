// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/map/nearest_cells.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <limits>
#include <tuple>

namespace toile {
namespace {

int own_cell(double x, int cells) {
  return std::min(static_cast<int>(x), cells - 1);
}

// The marked cells of each row at or before, and at or after, each place; -1 where there are none.
struct Neighbours {
  int nu, nv;
  std::vector<int> before, after;

  Neighbours(int cells_u, int cells_v, std::span<const char> marked)
      : nu(cells_u), nv(cells_v), before(marked.size()), after(marked.size()) {
    for (int b = 0; b < nv; ++b) {
      for (int a = 0; a < nu; ++a) before[at(a, b)] = marked[at(a, b)] ? a : a > 0 ? before[at(a - 1, b)] : -1;
      for (int a = nu - 1; a >= 0; --a) after[at(a, b)] = marked[at(a, b)] ? a : a < nu - 1 ? after[at(a + 1, b)] : -1;
    }
  }
  std::size_t at(int a, int b) const {
    return static_cast<std::size_t>(a) + static_cast<std::size_t>(nu) * static_cast<std::size_t>(b);
  }
  // The nearest ones to a place in cell a; a place on a border is as near to both cells there.
  std::array<int, 3> around(int a, int b) const {
    const int left = before[at(a, b)];
    return {left, left == a && a > 0 ? before[at(a - 1, b)] : -1, a < nu - 1 ? after[at(a + 1, b)] : -1};
  }
};

// One column of points, x = constant. The row of the nearest cell only grows with y, since f_b(y) - f_c(y), with
// f_b(y) = d_b^2 + (b + 0.5 - y)^2, grows with y for b < c: halving the points halves the rows to look at.
class Column {
 public:
  Column(const Neighbours& cells, double x, std::span<const double> y)
      : cells_(cells), x_(x), y_(y), own_(own_cell(x, cells.nu)) {}

  void solve(std::size_t first, std::size_t last, int low, int high, std::span<NearestCell> out,
             std::size_t stride) const {
    if (first == last) return;
    const std::size_t mid = first + (last - first) / 2;
    const NearestCell best = nearest(mid, low, high);
    out[mid * stride] = best;
    solve(first, mid, low, best.j < 0 ? high : best.j, out, stride);
    solve(mid + 1, last, best.j < 0 ? low : best.j, high, out, stride);
  }

 private:
  NearestCell nearest(std::size_t k, int low, int high) const {
    const double y = y_[k];
    const int own = own_cell(y, cells_.nv);
    std::tuple<double, int, int, int> best{std::numeric_limits<double>::infinity(), 0, -1, -1};
    for (int b = low; b <= high; ++b)
      for (const int a : cells_.around(own_, b)) {
        if (a < 0) continue;
        const double du = a + 0.5 - x_, dv = b + 0.5 - y;
        best = std::min(best, std::tuple(du * du + dv * dv, std::max(std::abs(a - own_), std::abs(b - own)), b, a));
      }
    return {std::get<3>(best), std::get<2>(best), std::get<0>(best)};
  }

  const Neighbours& cells_;
  double x_;
  std::span<const double> y_;
  int own_;
};

}  // namespace

std::vector<NearestCell> nearest_cells(int nu, int nv, std::span<const char> marked, std::span<const double> x,
                                       std::span<const double> y) {
  std::vector<NearestCell> out(x.size() * y.size());
  const Neighbours cells(nu, nv, marked);
  for (std::size_t i = 0; i < x.size(); ++i)
    Column(cells, x[i], y).solve(0, y.size(), 0, nv - 1, std::span(out).subspan(i), x.size());
  return out;
}

}  // namespace toile
