// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/constraint/select_rows.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "analysis/constraint/composed_rows.h"
#include "geometry/error.h"

namespace toile {
namespace {

constexpr double dependent_place = 1e-9;  // pivot below which a pin says what others say already
constexpr double contradiction = 1e-6;    // m

bool is_vertex(const ConstraintPoint& point) {
  return point.kind == PointKind::vertex;
}

// Position in cells: index of the cell and how far into it.
double in_cells(const std::vector<double>& breaks, double u) {
  const auto above = std::upper_bound(breaks.begin() + 1, breaks.end() - 1, u);
  const auto c = above - breaks.begin() - 1;
  return static_cast<double>(c) + (u - breaks[c]) / (breaks[c + 1] - breaks[c]);
}

// Pins may say the same twice, but not different things.
void check_places(const AffineMap& map, const std::vector<PlaceRow>& place) {
  const int n = static_cast<int>(place.size());
  if (n < 2) return;
  const ComposedRows composed = compose(map, {{}, place});
  const GramMatrix gram = gram_matrix(composed.free, Eigen::VectorXd::Ones(map.nodes()));
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
  for (int c = 0; c < n; ++c)
    for (int e = gram.pattern.column_start[c]; e < gram.pattern.column_start[c + 1]; ++e)
      a(gram.pattern.row[e], c) = a(c, gram.pattern.row[e]) = gram.value[e];
  const Eigen::VectorXd size = a.diagonal().cwiseSqrt();
  Eigen::Matrix3Xd wanted(3, n);  // places less what fixed control points give, row by row scaled as a
  const Eigen::Matrix3Xd fixed = map.fixed_places(0);
  for (int p = 0; p < n; ++p) {
    if (!(size[p] > 0)) return;  // refused by FastProjection, which names it
    wanted.col(p) = place[p].target(0);
    for (int e = composed.fixed.start[p]; e < composed.fixed.start[p + 1]; ++e)
      wanted.col(p) -= composed.fixed.value[e] * fixed.col(composed.fixed.column[e]);
    wanted.col(p) /= size[p];
  }
  a = size.cwiseInverse().asDiagonal() * a * size.cwiseInverse().asDiagonal();
  // Row by row Cholesky; `said` holds what the rows taken ask for in the factor's own coordinates.
  Eigen::MatrixXd factor(n, n);
  Eigen::Matrix3Xd said(3, n);
  std::vector<int> taken;
  for (int p = 0; p < n; ++p) {
    const int m = static_cast<int>(taken.size());
    Eigen::VectorXd link(m);
    for (int i = 0; i < m; ++i) link[i] = a(taken[i], p);
    const Eigen::VectorXd share = factor.topLeftCorner(m, m).triangularView<Eigen::Lower>().solve(link);
    const Eigen::Vector3d left = wanted.col(p) - said.leftCols(m) * share;
    const double pivot = 1 - share.squaredNorm();
    if (pivot > dependent_place) {
      factor.row(m).head(m) = share.transpose();
      factor(m, m) = std::sqrt(pivot);
      said.col(m) = left / factor(m, m);
      taken.push_back(p);
    } else if (!(left.norm() * size[p] <= contradiction)) {
      Eigen::Index other = 0;
      link.cwiseAbs().maxCoeff(&other);
      throw SolverError(name(place[taken[other]]) + " and " + name(place[p]) +
                        " hold the same material at different places");
    }
  }
}

}  // namespace

void merge_near_points(const NurbsSurface& surface, std::vector<ConstraintPoint>& points, double distance) {
  const std::vector<double> u = surface.u().breaks(), v = surface.v().breaks();
  // Kept points by whole cell: the last one that came, and before each the one that came before it.
  const int along_u = static_cast<int>(u.size()), along_v = static_cast<int>(v.size());
  std::vector<int> last(u.size() * v.size(), -1), before(points.size(), -1);
  std::vector<Eigen::Vector2d> place(points.size());
  const auto near_one_kept = [&](std::size_t k, int i, int j) {
    for (int b = std::max(j - 1, 0); b <= std::min(j + 1, along_v - 1); ++b)
      for (int a = std::max(i - 1, 0); a <= std::min(i + 1, along_u - 1); ++a)
        for (int other = last[a + along_u * b]; other >= 0; other = before[other])
          if ((place[k] - place[other]).norm() < distance) return true;
    return false;
  };
  for (bool vertices : {true, false})
    for (std::size_t k = 0; k < points.size(); ++k) {
      ConstraintPoint& point = points[k];
      if (!point.used || is_vertex(point) != vertices) continue;
      place[k] = {in_cells(u, point.u), in_cells(v, point.v)};
      const int i = static_cast<int>(place[k][0]), j = static_cast<int>(place[k][1]);
      if (near_one_kept(k, i, j)) {
        point.used = false;
        point.why = "merged";
      } else {
        before[k] = std::exchange(last[i + along_u * j], static_cast<int>(k));
      }
    }
}

std::vector<StrainRow> select_rows(const Body& body, const AffineMap& map,
                                   std::vector<std::vector<ConstraintPoint>>& points,
                                   const std::vector<PlaceRow>& place, const std::vector<StrainRow>& means) {
  check_places(map, place);
  for (std::size_t panel = 0; panel < points.size(); ++panel)
    merge_near_points(body.panels()[panel].rest, points[panel]);

  std::vector<StrainRow> all = strain_rows(body, map, points);
  all.insert(all.end(), means.begin(), means.end());
  const ComposedRows composed = compose(map, {all, {}});
  const auto moves = [&](std::size_t r) { return composed.free.start[r] < composed.free.start[r + 1]; };
  std::vector<StrainRow> out;
  for (std::size_t r = 0; r < all.size(); ++r) {
    const bool first_of_point = all[r].point >= 0 && !all[r].warp;
    if (first_of_point && !moves(r) && !moves(r + 1)) {
      ConstraintPoint& point = points[all[r].panel][all[r].point];
      point.used = false;
      point.why = "fixed";
    }
    if (moves(r)) out.push_back(all[r]);
  }
  return out;
}

}  // namespace toile
