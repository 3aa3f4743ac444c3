// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/quadrature.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "trimming/cell_boundary.h"
#include "trimming/gauss.h"
#include "trimming/loops.h"

// A cut cell is integrated in three steps, all in the box of its material, [-1, 1]^2, and in products of Legendre
// polynomials there:
//   1. exact moments by Green's theorem along the boundary [Gunderman, Weiss & Evans 2021];
//   2. a positive candidate rule inside the material: horizontal bands between the heights where the boundary turns or
//      has a corner, in each band Gauss levels, on each level Gauss points between the crossings of the boundary; its
//      weights, nearly right, are corrected to the exact moments by the smallest relative change;
//   3. elimination of points along null vectors of the moment matrix until no more points than moments are left:
//   weights
//      stay positive, moments unchanged [Tchakaloff 1957; Sommariva & Vianello 2009].
namespace toile {
namespace {

using Real = BoundaryBezier::Real;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Bernstein polynomials ---------------------------------------------------------------------------------------------

struct Bernstein {
  int degree = 0;
  std::array<double, 2 * max_degree + 2> c{};
};

double value(const Bernstein& f, double t) {
  auto c = f.c;
  for (int r = f.degree; r > 0; --r)
    for (int j = 0; j < r; ++j) c[j] += t * (c[j + 1] - c[j]);
  return c[0];
}

int sign_changes(const Bernstein& f, double noise) {
  int changes = 0, sign = 0;
  for (int k = 0; k <= f.degree; ++k) {
    const int s = f.c[k] > noise ? 1 : f.c[k] < -noise ? -1 : 0;
    if (s != 0 && sign != 0 && s != sign) ++changes;
    if (s != 0) sign = s;
  }
  return changes;
}

// Places where f changes sign, ascending; a root may be listed within rounding of its place.
void find_roots(const Bernstein& f, double t0, double t1, double noise, int depth, std::vector<double>& roots) {
  const int changes = sign_changes(f, noise);
  if (changes == 0) return;
  if (changes == 1 || depth == 0) {
    double low = 0, high = 1;
    double at_low = f.c[0];
    if (at_low == 0)
      for (int k = 1; k <= f.degree && at_low == 0; ++k) at_low = f.c[k];
    for (int step = 0; step < 52; ++step) {
      const double middle = (low + high) / 2;
      ((value(f, middle) > 0) == (at_low > 0) ? low : high) = middle;
    }
    roots.push_back(t0 + (t1 - t0) * (low + high) / 2);
    return;
  }
  Bernstein left = f, right = f;
  for (int r = 1; r <= f.degree; ++r) {
    for (int j = f.degree; j >= r; --j) left.c[j] = (left.c[j - 1] + left.c[j]) / 2;
    for (int j = 0; j <= f.degree - r; ++j) right.c[j] = (right.c[j] + right.c[j + 1]) / 2;
  }
  const double middle = (t0 + t1) / 2;
  find_roots(left, t0, middle, noise, depth - 1, roots);
  find_roots(right, middle, t1, noise, depth - 1, roots);
}

// Pieces of the boundary that rise or fall all along ----------------------------------------------------------------

struct Curve {
  int degree = 1;
  bool rational = false;
  std::array<double, max_degree + 1> x{}, y{}, w{};
};

struct Point {
  double x, y, dy;
};

Point at(const Curve& curve, double t) {
  const int d = curve.degree;
  auto x = curve.x, y = curve.y;
  for (int r = d; r > 1; --r)
    for (int j = 0; j < r; ++j) {
      x[j] += t * (x[j + 1] - x[j]);
      y[j] += t * (y[j + 1] - y[j]);
    }
  const double dy = d * (y[1] - y[0]), px = x[0] + t * (x[1] - x[0]), py = y[0] + t * (y[1] - y[0]);
  if (!curve.rational) return {px, py, dy};
  auto w = curve.w;
  for (int r = d; r > 1; --r)
    for (int j = 0; j < r; ++j) w[j] += t * (w[j + 1] - w[j]);
  const double dw = d * (w[1] - w[0]), pw = w[0] + t * (w[1] - w[0]);
  return {px / pw, py / pw, (dy - py / pw * dw) / pw};
}

struct Monotone {
  int curve = 0;
  double t0 = 0, t1 = 0;  // t0 < t1, on the curve
  double y0 = 0, y1 = 0;  // heights at t0, t1
};

// Numerator of y'(t) of a piece.
Bernstein slope(const Curve& curve) {
  const int d = curve.degree;
  Bernstein f;
  if (!curve.rational) {
    f.degree = d - 1;
    for (int k = 0; k < d; ++k) f.c[k] = curve.y[k + 1] - curve.y[k];
    return f;
  }
  const auto binomial = [](int n, int k) {
    double b = 1;
    for (int i = 1; i <= k; ++i) b = b * (n - k + i) / i;
    return b;
  };
  f.degree = 2 * d - 1;
  for (int i = 0; i < d; ++i)
    for (int j = 0; j <= d; ++j)
      f.c[i + j] += binomial(d - 1, i) * binomial(d, j) / binomial(2 * d - 1, i + j) *
                    ((curve.y[i + 1] - curve.y[i]) * curve.w[j] - curve.y[j] * (curve.w[i + 1] - curve.w[i]));
  return f;
}

// Where the boundary passes a height, and to which side the material lies.
struct Crossing {
  double x;
  int step;  // +1 entering the material from the left, -1 leaving it
};

double crossing_x(const Curve& curve, const Monotone& piece, double y) {
  if (curve.degree == 1 && !curve.rational) {
    const double t = (y - piece.y0) / (piece.y1 - piece.y0);
    return curve.x[0] + t * (curve.x[1] - curve.x[0]);
  }
  const double direction = piece.y1 > piece.y0 ? 1 : -1;
  double low = piece.t0, high = piece.t1;
  double t = low + (high - low) * (y - piece.y0) / (piece.y1 - piece.y0);
  Point p{};
  for (int step = 0; step < 60; ++step) {
    p = at(curve, t);
    const double error = (p.y - y) * direction;
    (error < 0 ? low : high) = t;
    if (error == 0 || high - low < 1e-16) break;
    double next = t - (p.y - y) / p.dy;
    if (!(next > low && next < high)) next = (low + high) / 2;
    if (std::abs(next - t) < 1e-16) break;
    t = next;
  }
  return p.x;
}

// The rule of one cut cell ------------------------------------------------------------------------------------------

class CutCellRule {
 public:
  // Points relative to `boundary.origin`, weights in parameter area.
  struct Node {
    Real x, y;
    double weight;
  };
  struct Result {
    double area = 0;
    double residual = 0;  // largest moment error over the area
  };

  Result build(CellBoundary& boundary, int degree_x, int degree_y, std::vector<Node>& nodes);

 private:
  void prepare(const CellBoundary& boundary);
  void add_candidates(int refinement);
  void tabulate();
  double residual();
  bool correct();
  void find_basis();
  void pivot_on(int row, int column);
  void eliminate();
  void polish();

  int degree_x_ = 0, degree_y_ = 0, functions_ = 0;
  std::vector<Real> exact_;
  Eigen::VectorXd moments_;  // over the area
  std::vector<Curve> curves_;
  std::vector<Monotone> monotone_;
  std::vector<double> heights_, roots_;
  std::vector<Crossing> crossings_;
  // Candidates; weights over the area. Eigen sums in an order that depends on the alignment, so it is fixed.
  std::vector<double, Eigen::aligned_allocator<double>> x_, y_, w_;
  RowMajor phi_;            // functions x candidates
  RowMajor table_;          // the same in terms of the basis points
  std::vector<int> basis_;  // candidate of each row, -1: none
  std::vector<char> in_basis_;
  Eigen::VectorXd error_;
};

void CutCellRule::prepare(const CellBoundary& boundary) {
  curves_.clear();
  monotone_.clear();
  heights_.clear();
  for (const BoundaryBezier& piece : boundary.pieces) {
    Curve curve;
    curve.degree = piece.degree;
    curve.rational = piece.rational;
    for (int k = 0; k <= piece.degree; ++k) {
      curve.x[k] = static_cast<double>(piece.x[k]);
      curve.y[k] = static_cast<double>(piece.y[k]);
      curve.w[k] = static_cast<double>(piece.w[k]);
    }
    const int index = static_cast<int>(curves_.size());
    curves_.push_back(curve);
    roots_.assign(1, 0.0);
    const Bernstein f = slope(curve);
    double size = 0;
    for (int k = 0; k <= f.degree; ++k) size = std::max(size, std::abs(f.c[k]));
    if (f.degree > 0) find_roots(f, 0, 1, 1e-15 * size, 40, roots_);
    roots_.push_back(1);
    double y0 = at(curve, 0).y;
    for (std::size_t k = 0; k + 1 < roots_.size(); ++k) {
      const double y1 = at(curve, roots_[k + 1]).y;
      if (y0 != y1) {
        monotone_.push_back({index, roots_[k], roots_[k + 1], y0, y1});
        heights_.push_back(y0);
        heights_.push_back(y1);
      }
      y0 = y1;
    }
  }
  std::sort(heights_.begin(), heights_.end());
}

// A tensor rule in each band and interval. Its weights need not be exact, so bands of no height are left out.
void CutCellRule::add_candidates(int refinement) {
  constexpr double no_height = 1e-12;
  x_.clear();
  y_.clear();
  w_.clear();
  for (std::size_t band = 0; band + 1 < heights_.size(); ++band) {
    const double y0 = heights_[band], y1 = heights_[band + 1];
    if (y1 - y0 < no_height) continue;
    const double share = (y1 - y0) / (heights_.back() - heights_.front());
    const int levels =
        std::min(refinement * (2 + static_cast<int>(std::ceil((degree_y_ + 1) * share))), max_gauss_points);
    const GaussRule& rule = gauss_rule(levels);
    for (int q = 0; q < levels; ++q) {
      const double y = (y0 + y1) / 2 + (y1 - y0) / 2 * rule.x[q];
      crossings_.clear();
      for (const Monotone& piece : monotone_)
        if (std::min(piece.y0, piece.y1) < y && y < std::max(piece.y0, piece.y1))
          crossings_.push_back({crossing_x(curves_[piece.curve], piece, y), piece.y1 < piece.y0 ? 1 : -1});
      std::sort(crossings_.begin(), crossings_.end(),
                [](const Crossing& a, const Crossing& b) { return a.x < b.x || (a.x == b.x && a.step > b.step); });
      double width = 0;
      int depth = 0;
      for (std::size_t k = 0; k + 1 < crossings_.size(); ++k) {
        depth += crossings_[k].step;
        if (depth > 0) width += crossings_[k + 1].x - crossings_[k].x;
      }
      depth = 0;
      for (std::size_t k = 0; k + 1 < crossings_.size(); ++k) {
        depth += crossings_[k].step;
        const double x0 = crossings_[k].x, x1 = crossings_[k + 1].x;
        if (depth <= 0 || !(x1 > x0)) continue;
        const int count = std::max(2, static_cast<int>(std::ceil((degree_x_ + 1) * (x1 - x0) / width)));
        const GaussRule& across = gauss_rule(std::min(count, max_gauss_points));
        for (int i = 0; i < across.size(); ++i) {
          x_.push_back((x0 + x1) / 2 + (x1 - x0) / 2 * across.x[i]);
          y_.push_back(y);
          w_.push_back(rule.w[q] * across.w[i] * (y1 - y0) * (x1 - x0) / 4);
        }
      }
    }
  }
}

void CutCellRule::tabulate() {
  const auto count = static_cast<Eigen::Index>(x_.size());
  phi_.resize(functions_, count);
  const Eigen::Map<const Eigen::ArrayXd> x(x_.data(), count), y(y_.data(), count);
  const auto row = [&](int a, int b) { return phi_.row(a + (degree_x_ + 1) * b).array(); };
  row(0, 0).setOnes();
  for (int a = 0; a < degree_x_; ++a) {
    row(a + 1, 0) = ((2 * a + 1) / (a + 1.0)) * x.transpose() * row(a, 0);
    if (a > 0) row(a + 1, 0) -= (a / (a + 1.0)) * row(a - 1, 0);
  }
  for (int b = 0; b < degree_y_; ++b)
    for (int a = 0; a <= degree_x_; ++a) {
      row(a, b + 1) = ((2 * b + 1) / (b + 1.0)) * y.transpose() * row(a, b);
      if (b > 0) row(a, b + 1) -= (b / (b + 1.0)) * row(a, b - 1);
    }
}

double CutCellRule::residual() {
  const Eigen::Map<const Eigen::VectorXd> w(w_.data(), static_cast<Eigen::Index>(w_.size()));
  error_ = moments_;
  error_.noalias() -= phi_ * w;
  return error_.cwiseAbs().maxCoeff();
}

// The change of the weights that repairs the moments with the least sum of (change / weight)^2 weight: each weight is
// multiplied by one polynomial, near 1. By normal equations, or where the functions are nearly dependent on the
// material (high degrees on triangles, slanted slivers) by an orthogonal decomposition. Weights stay above a fifth of
// what they were. False where the moments stay wrong.
bool CutCellRule::correct() {
  // Moments are no better known than the sum over the boundary that they come from.
  const double noise = static_cast<double>(1e-18L / exact_[0]);
  const double exact = std::max(1e-14, noise);
  Eigen::Map<Eigen::VectorXd> w(w_.data(), static_cast<Eigen::Index>(w_.size()));
  w /= w.sum();
  double least = residual();
  if (least < exact) return true;
  const Eigen::VectorXd before = w;
  Eigen::VectorXd best = w;
  const auto improved = [&] {
    const double now = residual();
    if (!((w.array() / before.array()).minCoeff() > 0.2 && now < least)) return false;
    best = w;
    least = now;
    return true;
  };
  const RowMajor weighted = phi_ * w.asDiagonal();
  Eigen::MatrixXd gram = weighted * phi_.transpose();
  gram.diagonal().array() += 1e-15 * gram.diagonal().maxCoeff();
  const Eigen::LLT<Eigen::MatrixXd> factor(gram);
  for (int step = 0; step < 3 && least > exact && factor.info() == Eigen::Success; ++step) {
    w.noalias() += weighted.transpose() * factor.solve(error_);
    if (!improved()) break;
  }
  if (least > exact) {
    w = best;
    residual();
    const Eigen::VectorXd root = before.cwiseSqrt();
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> orthogonal;
    orthogonal.setThreshold(std::max(1e-14, 100 * noise));
    orthogonal.compute(phi_ * root.asDiagonal());
    for (int step = 0; step < 3 && least > exact; ++step) {
      w += root.cwiseProduct(orthogonal.solve(error_));
      if (!improved()) break;
    }
  }
  w = best;
  return least < 10 * exact;
}

void CutCellRule::pivot_on(int row, int column) {
  table_.row(row) /= table_(row, column);
  for (int i = 0; i < functions_; ++i)
    if (i != row && table_(i, column) != 0) table_.row(i) -= table_(i, column) * table_.row(row);
  if (basis_[row] >= 0) in_basis_[basis_[row]] = 0;
  basis_[row] = column;
  in_basis_[column] = 1;
}

// Gauss-Jordan with complete pivoting: points on which the functions are well independent, one for each function but
// for those that depend on the others in double precision (a thin slanted sliver).
void CutCellRule::find_basis() {
  constexpr double dependent = 1e-13;
  table_ = phi_;
  basis_.assign(functions_, -1);
  in_basis_.assign(w_.size(), 0);
  for (int step = 0; step < functions_; ++step) {
    int row = -1, column = -1;
    double largest = dependent;
    for (int i = 0; i < functions_; ++i) {
      if (basis_[i] >= 0) continue;
      Eigen::Index j = 0;
      const double size = table_.row(i).cwiseAbs().maxCoeff(&j);
      if (size > largest) {
        largest = size;
        row = i;
        column = static_cast<int>(j);
      }
    }
    if (row < 0) return;
    pivot_on(row, column);
  }
}

void CutCellRule::eliminate() {
  const int n = static_cast<int>(x_.size());
  if (n <= functions_) return;
  find_basis();
  // Each remaining point is a combination of the basis points: weight moves along that null vector, in the direction
  // with the better pivot, until a point has none left.
  for (int j = 0; j < n; ++j) {
    if (in_basis_[j] || w_[j] == 0) continue;
    int leave_up = -1, leave_down = -1;
    double up = w_[j], down = HUGE_VAL;  // how far the weight of j can fall, rise
    for (int i = 0; i < functions_; ++i) {
      if (basis_[i] < 0) continue;
      const double c = table_(i, j);
      if (c < 0 && w_[basis_[i]] < up * -c) {
        up = w_[basis_[i]] / -c;
        leave_up = i;
      } else if (c > 0 && w_[basis_[i]] < down * c) {
        down = w_[basis_[i]] / c;
        leave_down = i;
      }
    }
    const bool fall =
        leave_up < 0 || leave_down < 0 || std::abs(table_(leave_up, j)) >= std::abs(table_(leave_down, j));
    const double move = fall ? up : -down;
    const int leave = fall ? leave_up : leave_down;
    for (int i = 0; i < functions_; ++i)
      if (basis_[i] >= 0) w_[basis_[i]] = std::max(w_[basis_[i]] + move * table_(i, j), 0.0);
    w_[j] -= move;
    if (leave >= 0) {
      w_[basis_[leave]] = 0;
      pivot_on(leave, j);
    } else {
      w_[j] = 0;
    }
  }
  int kept = 0;
  for (int j = 0; j < n; ++j) {
    if (!(w_[j] > 1e-17)) continue;
    x_[kept] = x_[j];
    y_[kept] = y_[j];
    w_[kept] = w_[j];
    phi_.col(kept) = phi_.col(j);
    ++kept;
  }
  x_.resize(kept);
  y_.resize(kept);
  w_.resize(kept);
  phi_.conservativeResize(Eigen::NoChange, kept);
}

// Takes back the rounding that elimination has gathered.
void CutCellRule::polish() {
  const auto n = static_cast<Eigen::Index>(w_.size());
  Eigen::Map<Eigen::VectorXd> w(w_.data(), n);
  double before = residual();
  for (int step = 0; step < 3 && before > 1e-15; ++step) {
    const Eigen::VectorXd kept = w;
    bool better = false;
    if (n == functions_) {
      const Eigen::VectorXd polished = w + phi_.partialPivLu().solve(error_);
      better = polished.minCoeff() > 0;
      if (better) w = polished;
    }
    // Fewer points, or nearly dependent ones: the smallest relative change that keeps every weight positive.
    if (!better) correct();
    const double after = residual();
    if (!(w.minCoeff() > 0 && after < before)) {
      w = kept;
      return;
    }
    before = after;
  }
}

CutCellRule::Result CutCellRule::build(CellBoundary& boundary, int degree_x, int degree_y, std::vector<Node>& nodes) {
  nodes.clear();
  if (boundary.pieces.empty()) return {};
  const BoundaryBox box = box_of(boundary);
  if (!(box.half_x > 0 && box.half_y > 0)) return {};
  scale_to_box(boundary, box);
  degree_x_ = degree_x;
  degree_y_ = degree_y;
  legendre_moments(boundary.pieces, degree_x, degree_y, exact_);
  if (!(exact_[0] > 0)) return {};
  functions_ = (degree_x + 1) * (degree_y + 1);
  moments_.resize(functions_);
  for (int k = 0; k < functions_; ++k) moments_[k] = static_cast<double>(exact_[k] / exact_[0]);
  prepare(boundary);
  // Where the last try isn't exact either, its weights are positive and their error is reported.
  bool exact = false;
  for (int refinement = 1; refinement <= 8 && !exact; refinement *= 2) {
    add_candidates(refinement);
    if (x_.empty()) continue;
    tabulate();
    exact = correct();
  }
  if (x_.empty()) return {};
  eliminate();
  polish();
  Result result;
  result.area = static_cast<double>(exact_[0] * box.half_x * box.half_y);
  result.residual = residual();
  double weight = 0;
  for (const double w : w_) weight += w;
  for (std::size_t k = 0; k < x_.size(); ++k)
    nodes.push_back(
        {box.centre_x + box.half_x * x_[k], box.centre_y + box.half_y * y_[k], w_[k] / weight * result.area});
  return result;
}

// Of each knot line, whether functions are C1 there; no border is.
std::vector<char> smooth_lines(const KnotVector& knots, const std::vector<double>& lines) {
  std::vector<char> smooth(lines.size(), false);
  for (std::size_t k = 1; k + 1 < lines.size(); ++k) smooth[k] = knots.multiplicity(lines[k]) < knots.degree();
  return smooth;
}

}  // namespace

CutQuadrature quadrature(const TrimmedSurface& surface, const TrimTopology& topology,
                         const QuadratureOptions& options) {
  const KnotMesh& mesh = topology.mesh;
  const int degree_u = options.degree_u.value_or(2 * surface.surface.u().degree());
  const int degree_v = options.degree_v.value_or(2 * surface.surface.v().degree());
  const int most_u = options.gauss_u.value_or(surface.surface.u().degree() + 1);
  const int most_v = options.gauss_v.value_or(surface.surface.v().degree() + 1);
  const std::vector<char> smooth_u = smooth_lines(surface.surface.u(), mesh.u);
  const std::vector<char> smooth_v = smooth_lines(surface.surface.v(), mesh.v);
  // Does cloth go on from cell k of a row over the line at its end into an uncut cell that is at least half as long?
  const auto goes_on = [](const std::vector<double>& lines, const std::vector<char>& smooth, int k, int end,
                          const auto& kind) {
    const int next = k + (end == 0 ? -1 : 1);
    return smooth[k + end] && kind(next) == CellKind::inside &&
           lines[next + 1] - lines[next] >= 0.5 * (lines[k + 1] - lines[k]);
  };
  CutQuadrature result;
  CutCellRule rule;
  CellBoundary boundary;
  std::vector<CutCellRule::Node> nodes;
  auto cut = topology.cut_cells.begin();
  for (int j = 0; j < mesh.cells_v(); ++j)
    for (int i = 0; i < mesh.cells_u(); ++i) {
      const CellKind kind = topology.cells[mesh.cell(i, j)];
      if (kind == CellKind::outside) continue;
      const double width = mesh.u[i + 1] - mesh.u[i], height = mesh.v[j + 1] - mesh.v[j];
      CellRule cell{.i = i, .j = j, .first = static_cast<int>(result.points.size())};
      if (kind == CellKind::inside) {
        const auto along_u = [&](int k) { return topology.cells[mesh.cell(k, j)]; };
        const auto along_v = [&](int k) { return topology.cells[mesh.cell(i, k)]; };
        const bool less_u =
            options.one_less && (goes_on(mesh.u, smooth_u, i, 0, along_u) || goes_on(mesh.u, smooth_u, i, 1, along_u));
        const bool less_v =
            options.one_less && (goes_on(mesh.v, smooth_v, j, 0, along_v) || goes_on(mesh.v, smooth_v, j, 1, along_v));
        const GaussRule& gauss_u = gauss_rule(std::max(1, most_u - less_u));
        const GaussRule& gauss_v = gauss_rule(std::max(1, most_v - less_v));
        cell.tensor = true;
        cell.area = width * height;
        for (int b = 0; b < gauss_v.size(); ++b)
          for (int a = 0; a < gauss_u.size(); ++a) {
            result.points.emplace_back(mesh.u[i] + width * (1 + gauss_u.x[a]) / 2,
                                       mesh.v[j] + height * (1 + gauss_v.x[b]) / 2);
            result.weights.push_back(cell.area / 4 * gauss_u.w[a] * gauss_v.w[b]);
          }
      } else {
        while (cut != topology.cut_cells.end() && mesh.cell(cut->i, cut->j) < mesh.cell(i, j)) ++cut;
        if (cut == topology.cut_cells.end() || cut->i != i || cut->j != j) continue;
        build_boundary(surface, mesh, *cut, boundary);
        const CutCellRule::Result made = rule.build(boundary, degree_u, degree_v, nodes);
        if (nodes.empty()) continue;
        cell.area = made.area;
        cell.cut_fraction = made.area / (width * height);
        for (const CutCellRule::Node& node : nodes) {
          const auto u = static_cast<double>(boundary.origin.x() + node.x);
          const auto v = static_cast<double>(boundary.origin.y() + node.y);
          result.points.emplace_back(std::clamp(u, mesh.u[i], mesh.u[i + 1]), std::clamp(v, mesh.v[j], mesh.v[j + 1]));
          result.weights.push_back(node.weight);
        }
        result.moment_residual = std::max(result.moment_residual, made.residual);
      }
      cell.count = static_cast<int>(result.points.size()) - cell.first;
      result.area += cell.area;
      result.cells.push_back(cell);
    }
  return result;
}

CutQuadrature quadrature(TrimmedSurface surface, const QuadratureOptions& options) {
  validate_loops(surface);
  return quadrature(surface, trace_trims(surface), options);
}

}  // namespace toile
