#include "analysis/projection/select_rows.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <string>

#include "analysis/linear/cholesky.h"
#include "analysis/projection/composed_rows.h"
#include "geometry/error.h"

namespace toile {
namespace {

constexpr double vertex_softness = 1e-7;       // vertices may depend on each other; far below any pivot that counts
constexpr double dependent_place = 1e-9;       // pivot below which a pin says what others say already
constexpr double contradiction = 1e-6;         // m

bool is_vertex(const ConstraintPoint& point) { return point.kind == PointKind::vertex; }

// Position in cells: index of the cell and how far into it.
double in_cells(const std::vector<double>& breaks, double u) {
  const auto above = std::upper_bound(breaks.begin() + 1, breaks.end() - 1, u);
  const auto c = above - breaks.begin() - 1;
  return static_cast<double>(c) + (u - breaks[c]) / (breaks[c + 1] - breaks[c]);
}

void merge_near_points(const NurbsSurface& surface, double distance, std::vector<ConstraintPoint>& points) {
  const std::vector<double> u = surface.u().breaks(), v = surface.v().breaks();
  std::map<std::array<int, 2>, std::vector<Eigen::Vector2d>> buckets;  // kept points by whole cell
  for (bool vertices : {true, false})
    for (ConstraintPoint& point : points) {
      if (!point.used || is_vertex(point) != vertices) continue;
      const Eigen::Vector2d place(in_cells(u, point.u), in_cells(v, point.v));
      const std::array<int, 2> cell{static_cast<int>(place[0]), static_cast<int>(place[1])};
      bool near = false;
      for (int a = cell[0] - 1; !near && a <= cell[0] + 1; ++a)
        for (int b = cell[1] - 1; !near && b <= cell[1] + 1; ++b)
          if (const auto bucket = buckets.find({a, b}); bucket != buckets.end())
            for (const Eigen::Vector2d& other : bucket->second) near = near || (place - other).norm() < distance;
      if (near) {
        point.used = false;
        point.why = "merged";
      } else {
        buckets[cell].push_back(place);
      }
    }
}

// Numbers in [-1, 1) that are the same on every machine. [splitmix64, Steele et al. 2014]
double next_random(std::uint64_t& state) {
  std::uint64_t z = (state += 0x9e3779b97f4a7c15ull);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1.0p-52 - 1.0;
}

// The rest state rolled onto a cylinder whose axis lies in each panel's main plane at a random angle, with a radius
// between half and all of the panel's extent: near-isometric, since the net is much finer than the radius.
Eigen::VectorXd random_bend(const ShellModel& model, std::uint64_t& seed) {
  Eigen::VectorXd q = model.rest();
  for (int panel = 0; panel < static_cast<int>(model.panels().size()); ++panel) {
    const Eigen::Matrix3Xd& net = model.panels()[panel].rest.points();
    const Eigen::Vector3d centre = net.rowwise().mean();
    const Eigen::Matrix3Xd spread = net.colwise() - centre;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread * spread.transpose());
    const Eigen::Vector3d normal = axes.eigenvectors().col(0), first = axes.eigenvectors().col(2),
                          second = axes.eigenvectors().col(1);
    const double angle = std::numbers::pi * next_random(seed);
    const Eigen::Vector3d along = std::cos(angle) * first + std::sin(angle) * second;
    const Eigen::Vector3d axis = std::cos(angle) * second - std::sin(angle) * first;
    const double radius = (1.5 + 0.5 * next_random(seed)) * spread.colwise().norm().maxCoeff();
    for (int k = 0; k < net.cols(); ++k) {
      const double s = spread.col(k).dot(along), w = spread.col(k).dot(axis), n = spread.col(k).dot(normal);
      q.segment<3>(3 * (model.first_control_point(panel) + k)) =
          centre + (radius - n) * std::sin(s / radius) * along + w * axis +
          (radius - (radius - n) * std::cos(s / radius)) * normal;
    }
  }
  return q;
}

Eigen::Vector3d combination(const ScalarRow& row, const Eigen::VectorXd& q) {
  Eigen::Vector3d y = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < row.index.size(); ++k) y += row.value[k] * q.segment<3>(3 * row.index[k]);
  return y;
}

// Rows in three groups: [0, vertices) inner vertices, [vertices, strains) crossings, then place rows.
struct Candidates {
  ConstraintRows rows;
  int vertices = 0;
  GramMatrix gram;
  int strains() const { return static_cast<int>(rows.strain.size()); }
  int places() const { return static_cast<int>(rows.place.size()); }
  int crossings() const { return strains() - vertices; }
  int taken_first() const { return vertices + 3 * places(); }
};

// J M^-1 J^T of the crossings at one state, scaled to unit diagonal, less what vertices and place rows explain.
Eigen::MatrixXd crossing_complement(const Candidates& c, const Eigen::VectorXd& q) {
  const int scalars = c.strains() + c.places();
  std::vector<double> diagonal(scalars);
  for (int r = 0; r < scalars; ++r) diagonal[r] = c.gram.value[c.gram.pattern.column_start[r]];
  Eigen::Matrix3Xd direction(3, c.strains());
  for (int r = 0; r < c.strains(); ++r)
    direction.col(r) = combination(c.rows.strain[r].row, q).normalized() / std::sqrt(diagonal[r]);

  SparsePattern pattern;
  std::vector<double> values;
  std::vector<std::vector<std::pair<int, double>>> coupling(c.crossings());  // of each crossing to those taken first
  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(c.crossings(), c.crossings());
  pattern.column_start.push_back(0);
  const auto place_slot = [&](int scalar, int component) { return c.vertices + 3 * (scalar - c.strains()) + component; };
  for (int col = 0; col < c.strains(); ++col) {
    for (int e = c.gram.pattern.column_start[col]; e < c.gram.pattern.column_start[col + 1]; ++e) {
      const int row = c.gram.pattern.row[e];
      if (row >= c.strains()) {
        const double scale = 1 / std::sqrt(diagonal[row]);
        for (int k = 0; k < 3; ++k) {
          const double value = c.gram.value[e] * direction(k, col) * scale;
          if (col < c.vertices)
            pattern.row.push_back(place_slot(row, k)), values.push_back(value);
          else
            coupling[col - c.vertices].emplace_back(place_slot(row, k), value);
        }
        continue;
      }
      const double value = c.gram.value[e] * direction.col(row).dot(direction.col(col));
      if (col >= c.vertices)
        own(row - c.vertices, col - c.vertices) = own(col - c.vertices, row - c.vertices) = value;
      else if (row >= c.vertices)
        coupling[row - c.vertices].emplace_back(col, value);
      else
        pattern.row.push_back(row), values.push_back(value + (row == col ? vertex_softness : 0));
    }
    if (col < c.vertices) pattern.column_start.push_back(static_cast<int>(pattern.row.size()));
  }
  for (int p = 0; p < c.places(); ++p)
    for (int k = 0; k < 3; ++k) {
      const int col = c.strains() + p;
      for (int e = c.gram.pattern.column_start[col]; e < c.gram.pattern.column_start[col + 1]; ++e) {
        const int row = c.gram.pattern.row[e];
        pattern.row.push_back(place_slot(row, k));
        values.push_back(c.gram.value[e] / std::sqrt(diagonal[row] * diagonal[col]) +
                         (row == col ? vertex_softness : 0));
      }
      pattern.column_start.push_back(static_cast<int>(pattern.row.size()));
    }
  if (c.taken_first() == 0) return own;

  Cholesky factor(std::move(pattern));
  if (!factor.factorise(values)) throw SolverError("row selection: the strain rows of the knot vertices can't be factored");
  Eigen::VectorXd rhs = Eigen::VectorXd::Zero(c.taken_first()), explained(rhs.size());
  for (int i = 0; i < c.crossings(); ++i) {
    if (coupling[i].empty()) continue;
    for (const auto& [k, value] : coupling[i]) rhs[k] = value;
    factor.solve(rhs, explained);
    for (const auto& [k, value] : coupling[i]) rhs[k] = 0;
    for (int j = i; j < c.crossings(); ++j) {
      double sum = 0;
      for (const auto& [k, value] : coupling[j]) sum += value * explained[k];
      own(i, j) -= sum;
      if (j > i) own(j, i) = own(i, j);
    }
  }
  return own;
}

// Pivoted Cholesky of all states side by side: the next row is the one whose smallest pivot is largest.
std::vector<char> independent(const std::vector<Eigen::MatrixXd>& states, double smallest_pivot) {
  const Eigen::Index n = states.front().rows();
  std::vector<char> taken(n, 0);
  std::vector<Eigen::MatrixXd> factor(states.size(), Eigen::MatrixXd(n, n));
  std::vector<Eigen::VectorXd> pivots;
  for (const Eigen::MatrixXd& s : states) pivots.emplace_back(s.diagonal());
  for (Eigen::Index step = 0; step < n; ++step) {
    Eigen::Index best = -1;
    double best_pivot = smallest_pivot;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (taken[i]) continue;
      double pivot = pivots.front()[i];
      for (const Eigen::VectorXd& p : pivots) pivot = std::min(pivot, p[i]);
      // A hair's breadth more is no reason to prefer: mirror images keep the order of the points.
      if (pivot > best_pivot * (1 + (best >= 0 ? 1e-9 : 0))) best = i, best_pivot = pivot;
    }
    if (best < 0) break;
    taken[best] = 1;
    for (std::size_t s = 0; s < states.size(); ++s) {
      auto column = factor[s].col(step);
      column = states[s].col(best);
      if (step > 0) column.noalias() -= factor[s].leftCols(step) * factor[s].row(best).head(step).transpose();
      column /= std::sqrt(pivots[s][best]);
      pivots[s] -= column.cwiseAbs2();
    }
  }
  return taken;
}

// Pins may say the same twice, but not different things.
void check_places(const AffineMap& map, const Eigen::VectorXd& node_mass, const std::vector<PlaceRow>& place) {
  const int n = static_cast<int>(place.size());
  if (n < 2) return;
  const ComposedRows composed = compose(map, {{}, place});
  const GramMatrix gram = gram_matrix(composed.free, node_mass);
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
      throw SolverError("pins " + std::to_string(place[taken[other]].pin) + " and " + std::to_string(place[p].pin) +
                        " hold the same material at different places");
    }
  }
}

}  // namespace

std::vector<StrainRow> select_rows(const ShellModel& model, const AffineMap& map, const Eigen::VectorXd& node_mass,
                                   std::vector<std::vector<ConstraintPoint>>& points,
                                   const std::vector<PlaceRow>& place, const RowSelectionOptions& options) {
  check_places(map, node_mass, place);
  for (std::size_t panel = 0; panel < points.size(); ++panel)
    merge_near_points(model.panels()[panel].rest, options.merge_distance, points[panel]);

  const std::vector<StrainRow> all = strain_rows(model, points);
  const ComposedRows composed = compose(map, {all, {}});
  Candidates candidates;
  candidates.rows.place = place;
  std::vector<char> remains(all.size(), 0);
  std::vector<std::size_t> origin;  // of each candidate, in `all`
  for (bool vertices : {true, false}) {
    for (std::size_t r = 0; r < all.size(); ++r) {
      if (is_vertex(points[all[r].panel][all[r].point]) != vertices) continue;
      if (composed.free.start[r] == composed.free.start[r + 1]) continue;
      candidates.rows.strain.push_back(all[r]);
      origin.push_back(r);
    }
    if (vertices) candidates.vertices = candidates.strains();
  }
  std::vector<char> free_row(all.size(), 0);
  for (std::size_t r : origin) free_row[r] = 1;
  for (int i = 0; i < candidates.vertices; ++i) remains[origin[i]] = 1;

  if (candidates.crossings() > 0) {
    candidates.gram = gram_matrix(compose(map, candidates.rows).free, node_mass);
    std::vector<Eigen::MatrixXd> states{crossing_complement(candidates, model.rest())};
    std::uint64_t seed = 1;
    for (int b = 0; b < options.bends; ++b)
      states.push_back(crossing_complement(candidates, random_bend(model, seed)));
    const std::vector<char> taken = independent(states, options.smallest_pivot);
    for (int i = 0; i < candidates.crossings(); ++i) remains[origin[candidates.vertices + i]] = taken[i];
  }

  std::vector<StrainRow> out;
  for (std::size_t r = 0; r < all.size(); r += 2) {  // weft and warp of one point
    ConstraintPoint& point = points[all[r].panel][all[r].point];
    if (!remains[r] && !remains[r + 1]) {
      point.used = false;
      point.why = free_row[r] || free_row[r + 1] ? "redundant" : "fixed";
    }
    for (std::size_t k : {r, r + 1}) {
      if (!remains[k] && !free_row[k]) continue;
      out.push_back(all[k]);
      out.back().guard = !remains[k];
    }
  }
  return out;
}

}  // namespace toile
