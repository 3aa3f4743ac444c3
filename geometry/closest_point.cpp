// SPDX-License-Identifier: GPL-3.0-or-later
// closest_point(): descent from the local minima of a sampling, then a proof by subdivision that nothing is nearer.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "geometry/error.h"
#include "geometry/grid_evaluation.h"
#include "geometry/line_net.h"
#include "geometry/measure.h"

namespace toile {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

// What the descent needs at a parameter of an N-dimensional piece: r = x - target, f = |r|^2 / 2.
template <int N, int Dim>
struct Local {
  Eigen::Matrix<double, Dim, 1> x;
  double f = 0;
  Eigen::Matrix<double, N, 1> gradient;
  Eigen::Matrix<double, N, N> gauss_newton;  // J^T J
  Eigen::Matrix<double, N, N> hessian;
};

template <int N>
struct Box {
  Eigen::Matrix<double, N, 1> min, max;
};

template <int N, int Dim>
struct Minimum {
  Eigen::Matrix<double, N, 1> q;
  Local<N, Dim> local;
  double residual = 0;
  int iterations = 0;
  bool converged = false;
};

// Directions that the border leaves open: not those where it stops the descent.
template <int N>
std::array<bool, N> open_directions(const Eigen::Matrix<double, N, 1>& q, const Eigen::Matrix<double, N, 1>& gradient,
                                    const Box<N>& box) {
  std::array<bool, N> open;
  for (int i = 0; i < N; ++i)
    open[i] = !(q[i] <= box.min[i] && gradient[i] >= 0) && !(q[i] >= box.max[i] && gradient[i] <= 0);
  return open;
}

// Solves m d = b in the open directions (d = 0 in the others); false where m isn't safely positive definite there.
template <int N>
bool solve_open(const Eigen::Matrix<double, N, N>& m, const Eigen::Matrix<double, N, 1>& b, std::array<bool, N> open,
                Eigen::Matrix<double, N, 1>& d) {
  d.setZero();
  int count = 0, only = 0;
  for (int i = 0; i < N; ++i)
    if (open[i]) ++count, only = i;
  if (count == 0) return true;
  if (count == 1) {
    if (!(m(only, only) > 0)) return false;
    d[only] = b[only] / m(only, only);
    return std::isfinite(d[only]);
  }
  if constexpr (N == 2) {
    const double determinant = m(0, 0) * m(1, 1) - m(0, 1) * m(1, 0);
    if (!(m(0, 0) > 0 && determinant > 1e-14 * m(0, 0) * m(1, 1))) return false;
    d[0] = (m(1, 1) * b[0] - m(0, 1) * b[1]) / determinant;
    d[1] = (m(0, 0) * b[1] - m(1, 0) * b[0]) / determinant;
    return d.allFinite();
  }
  return false;
}

// Length of the part of r that lies in the open tangent directions.
template <int N, int Dim>
double tangential_residual(const Local<N, Dim>& local, const std::array<bool, N>& open) {
  Eigen::Matrix<double, N, 1> d;
  if (solve_open<N>(local.gauss_newton, local.gradient, open, d))
    return std::sqrt(std::max(0.0, local.gradient.dot(d)));
  // Parallel or vanishing tangents: the larger of the single directions.
  double residual = 0;
  for (int i = 0; i < N; ++i)
    if (open[i] && local.gauss_newton(i, i) > 0)
      residual = std::max(residual, std::abs(local.gradient[i]) / std::sqrt(local.gauss_newton(i, i)));
  return residual;
}

// Projected Newton descent inside one box on which the piece is smooth [Bertsekas 1982]: the Hessian where it is
// positive definite, else Gauss-Newton, else scaled steepest descent; each with an Armijo search along the projected
// arc. `evaluate(q)` gives the Local; `size` is the length that the tolerance refers to.
template <int N, int Dim, class Evaluate>
Minimum<N, Dim> descend(const Evaluate& evaluate, Eigen::Matrix<double, N, 1> q, const Box<N>& box, double size,
                        const Eigen::Matrix<double, Dim, 1>& target, const ClosestPointOptions& options) {
  using Parameter = Eigen::Matrix<double, N, 1>;
  Minimum<N, Dim> result;
  q = q.cwiseMax(box.min).cwiseMin(box.max);
  Local<N, Dim> local = evaluate(q);
  for (int iteration = 0;; ++iteration) {
    const auto open = open_directions<N>(q, local.gradient, box);
    const double residual = tangential_residual<N, Dim>(local, open);
    // What a rounded parameter and rounded coordinates leave of the residual.
    double grain = 4 * epsilon * (local.x.norm() + target.norm());
    for (int i = 0; i < N; ++i)
      grain += 2 * epsilon * std::max(std::abs(q[i]), std::abs(box.max[i])) * std::sqrt(local.gauss_newton(i, i));
    result.q = q;
    result.local = local;
    result.residual = residual;
    result.iterations = iteration;
    result.converged = residual <= std::max(options.tolerance * size, grain);
    if (result.converged || iteration >= options.max_iterations) return result;

    bool moved = false;
    for (int attempt = 0; attempt < 3 && !moved; ++attempt) {
      Parameter step;
      if (attempt == 2) {
        for (int i = 0; i < N; ++i)
          step[i] = open[i] && local.gauss_newton(i, i) > 0 ? -local.gradient[i] / (N * local.gauss_newton(i, i)) : 0.0;
      } else {
        if (!solve_open<N>(attempt == 0 ? local.hessian : local.gauss_newton, local.gradient, open, step)) continue;
        step = -step;
      }
      if (!(local.gradient.dot(step) < 0)) continue;
      for (double length = 1; length > 1e-12; length /= 2) {
        const Parameter trial = (q + length * step).cwiseMax(box.min).cwiseMin(box.max);
        if (trial == q) break;
        const Local<N, Dim> next = evaluate(trial);
        const double slope = local.gradient.dot(trial - q);
        const bool descends = slope < 0 && next.f <= local.f + 1e-4 * slope;
        // Near the minimum f no longer tells points apart, while the residual still does.
        const bool level =
            std::abs(next.f - local.f) <= 8 * epsilon * local.f + grain * std::sqrt(2 * local.f) &&
            tangential_residual<N, Dim>(next, open_directions<N>(trial, next.gradient, box)) < residual / 2;
        if (!descends && !level) continue;
        q = trial;
        local = next;
        moved = true;
        break;
      }
    }
    if (!moved) return result;
  }
}

// Ends of the smooth pieces: the ends of the domain and the knots at which the geometry may have a corner.
std::vector<double> smooth_ends(const KnotVector& knots) {
  const std::vector<double> breaks = knots.breaks();
  std::vector<double> ends = {breaks.front()};
  for (std::size_t i = 1; i + 1 < breaks.size(); ++i)
    if (knots.multiplicity(breaks[i]) >= knots.degree()) ends.push_back(breaks[i]);
  ends.push_back(breaks.back());
  return ends;
}

int piece_of(const std::vector<double>& ends, double q) {
  const auto upper = std::upper_bound(ends.begin(), ends.end(), q) - ends.begin();
  return std::clamp(static_cast<int>(upper) - 1, 0, static_cast<int>(ends.size()) - 2);
}

// Span of a parameter inside a piece; the end of the piece belongs to its last span.
int span_inside(const KnotVector& knots, double q, double piece_max) {
  if (q < piece_max) return knots.find_span(q);
  const auto t = knots.knots();
  return static_cast<int>(std::lower_bound(t.begin(), t.end(), piece_max) - t.begin()) - 1;
}

// Descends from `start`, and goes on over corners of the geometry into the neighbouring pieces as long as that brings
// the point nearer. `evaluate(q, box)` evaluates inside a piece.
template <int N, int Dim, class Evaluate>
Minimum<N, Dim> descend_pieces(const Evaluate& evaluate, const Eigen::Matrix<double, N, 1>& start,
                               const std::array<std::vector<double>, N>& ends, double size,
                               const Eigen::Matrix<double, Dim, 1>& target, const ClosestPointOptions& options) {
  std::array<int, N> piece;
  for (int i = 0; i < N; ++i) piece[i] = piece_of(ends[i], start[i]);
  const auto box_of = [&](const std::array<int, N>& p) {
    Box<N> box;
    for (int i = 0; i < N; ++i) {
      box.min[i] = ends[i][p[i]];
      box.max[i] = ends[i][p[i] + 1];
    }
    return box;
  };
  const auto run = [&](const std::array<int, N>& p, const Eigen::Matrix<double, N, 1>& from) {
    const Box<N> box = box_of(p);
    return descend<N, Dim>([&](const auto& q) { return evaluate(q, box); }, from, box, size, target, options);
  };
  Minimum<N, Dim> best = run(piece, start);
  int iterations = best.iterations;
  for (bool nearer = true; nearer;) {
    nearer = false;
    const Box<N> box = box_of(piece);
    // Neighbours over the borders that the point lies on: per direction -1, 0 or +1.
    std::array<std::array<int, 3>, N> shifts;
    std::array<int, N> choices;
    for (int i = 0; i < N; ++i) {
      choices[i] = 0;
      shifts[i][choices[i]++] = 0;
      if (best.q[i] <= box.min[i] && piece[i] > 0) shifts[i][choices[i]++] = -1;
      if (best.q[i] >= box.max[i] && piece[i] + 2 < static_cast<int>(ends[i].size())) shifts[i][choices[i]++] = 1;
    }
    int combinations = 1;
    for (int c : choices) combinations *= c;
    for (int c = 1; c < combinations && !nearer; ++c) {
      std::array<int, N> other = piece;
      for (int i = 0, rest = c; i < N; ++i) {
        other[i] += shifts[i][rest % choices[i]];
        rest /= choices[i];
      }
      Minimum<N, Dim> next = run(other, best.q);
      iterations += next.iterations;
      if (next.local.f < best.local.f * (1 - 16 * epsilon)) {
        best = next;
        piece = other;
        nearer = true;
      }
    }
  }
  best.iterations = iterations;
  return best;
}

// Parameters that sample every span: its ends and `inside` points between.
std::vector<double> samples(const KnotVector& knots) {
  const int parts = std::max(3, knots.degree() + 1);
  const std::vector<double> breaks = knots.breaks();
  std::vector<double> result;
  for (std::size_t s = 0; s + 1 < breaks.size(); ++s)
    for (int k = 0; k < parts; ++k) result.push_back(breaks[s] + (breaks[s + 1] - breaks[s]) * k / parts);
  result.push_back(breaks.back());
  return result;
}

// A sampling has a local minimum near most minima; the nearest few are followed, the proof finds what they miss.
constexpr std::size_t followed = 4;

struct Candidate {
  double f;
  Eigen::Vector2d q;
};

std::vector<Candidate> local_minima(const std::vector<double>& u, const std::vector<double>& v,
                                    const std::vector<double>& f) {
  const int nu = static_cast<int>(u.size()), nv = static_cast<int>(v.size());
  std::vector<Candidate> found;
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i) {
      const double value = f[i + nu * j];
      bool lowest = true;
      for (int b = std::max(j - 1, 0); b <= std::min(j + 1, nv - 1) && lowest; ++b)
        for (int a = std::max(i - 1, 0); a <= std::min(i + 1, nu - 1); ++a)
          // Of equal neighbours the first counts.
          if (const double other = f[a + nu * b]; other < value || (other == value && a + nu * b < i + nu * j)) {
            lowest = false;
            break;
          }
      if (lowest) found.push_back({value, {u[i], v[j]}});
    }
  std::ranges::stable_sort(found, {}, &Candidate::f);
  if (found.size() > followed) found.resize(followed);
  return found;
}

// The proof stops where it has shown that nothing is nearer by more than this, relative to the size of the geometry:
// far enough above the square root of the rounding of squared distances.
constexpr double proof_slack = 1e-7;

// Subdivisions spent on it. A few hundred do unless the target is as near to a whole region (the centre of a sphere).
constexpr int most_subdivisions = 4000;

// The squared distance N / W^2 to the target over one parameter rectangle, as Bernstein coefficients of degree
// (du, dv), u fastest. Since W^2 has positive coefficients, N / W^2 >= min_k N_k / (W^2)_k; `bound` is the root of
// that.
struct Piece {
  Interval u, v;
  int du = 0, dv = 0;
  std::vector<double> n, w;
  double bound = 0;
  int number = 0;  // order of making, for ties

  int count_u() const { return du + 1; }
  double corner(int i, int j) const {
    const int k = i * du + count_u() * j * dv;
    return n[k] / w[k];
  }
};

void set_bound(Piece& piece) {
  double lowest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < piece.n.size(); ++k) lowest = std::min(lowest, piece.n[k] / piece.w[k]);
  piece.bound = std::sqrt(std::max(lowest, 0.0));
}

double binomial(int n, int k) {
  double result = 1;
  for (int i = 1; i <= k; ++i) result = result * (n - k + i) / i;
  return result;
}

// The product of Bernstein polynomials with itself, coefficients in the columns of `c` (pu + 1 fastest).
std::vector<double> bernstein_square(const Eigen::MatrixXd& c, int pu, int pv) {
  const int nu = 2 * pu + 1;
  std::vector<double> result(nu * (2 * pv + 1), 0.0);
  for (int j = 0; j <= pv; ++j)
    for (int i = 0; i <= pu; ++i)
      for (int l = 0; l <= pv; ++l)
        for (int k = 0; k <= pu; ++k)
          result[i + k + nu * (j + l)] += binomial(pu, i) * binomial(pu, k) * binomial(pv, j) * binomial(pv, l) *
                                          c.col(i + (pu + 1) * j).dot(c.col(k + (pu + 1) * l));
  for (int j = 0; j <= 2 * pv; ++j)
    for (int i = 0; i <= 2 * pu; ++i) result[i + nu * j] /= binomial(2 * pu, i) * binomial(2 * pv, j);
  return result;
}

// `net` holds w (P - target) over w, `weighted` says whether any weight differs from 1.
Piece make_piece(Interval u, Interval v, int pu, int pv, const Eigen::MatrixXd& net, bool weighted) {
  Piece piece{u, v, 2 * pu, 2 * pv, {}, {}, 0, 0};
  piece.n = bernstein_square(net.topRows(net.rows() - 1), pu, pv);
  piece.w = weighted ? bernstein_square(net.bottomRows(1), pu, pv) : std::vector<double>(piece.n.size(), 1.0);
  set_bound(piece);
  return piece;
}

// de Casteljau's algorithm at the middle: lines of `count` coefficients `stride` apart; `low` becomes the lower half.
void halve_line(double* high, double* low, int count, int stride) {
  for (int k = 0; k < count; ++k) {
    low[k * stride] = high[0];
    for (int i = 0; i + 1 < count - k; ++i) high[i * stride] = (high[i * stride] + high[(i + 1) * stride]) / 2;
  }
}

// Halves the piece in the direction in which its coefficients vary more: the lower half is returned.
Piece split(Piece& high) {
  double along_u = 0, along_v = 0;
  const int nu = high.count_u();
  for (int j = 0; j <= high.dv; ++j)
    for (int i = 0; i <= high.du; ++i) {
      const double here = high.n[i + nu * j];
      if (i > 0) along_u = std::max(along_u, std::abs(here - high.n[i - 1 + nu * j]));
      if (j > 0) along_v = std::max(along_v, std::abs(here - high.n[i + nu * (j - 1)]));
    }
  Piece low = high;
  const bool in_u = high.dv == 0 || (high.du > 0 && along_u * high.du >= along_v * high.dv);
  for (auto [from, to] : {std::pair(&high.n, &low.n), std::pair(&high.w, &low.w)}) {
    if (in_u)
      for (int j = 0; j <= high.dv; ++j) halve_line(from->data() + nu * j, to->data() + nu * j, nu, 1);
    else
      for (int i = 0; i < nu; ++i) halve_line(from->data() + i, to->data() + i, high.dv + 1, nu);
  }
  Interval& range = in_u ? high.u : high.v;
  const double middle = range.min + range.length() / 2;
  (in_u ? low.u : low.v).max = middle;
  range.min = middle;
  set_bound(high);
  set_bound(low);
  return low;
}

// Best-first subdivision of the pieces. `best` is the distance found so far; where a corner is nearer, improve(q)
// descends from it and returns the new best distance. Returns a distance below which no point lies.
template <class Improve>
double bound_below(std::vector<Piece> open, double best, double slack, const Improve& improve) {
  const auto later = [](const Piece& a, const Piece& b) {
    return a.bound != b.bound ? a.bound > b.bound : a.number > b.number;
  };
  int number = 0;
  for (Piece& piece : open) piece.number = number++;
  std::ranges::make_heap(open, later);
  for (int splits = 0; !open.empty() && open.front().bound < best - slack; ++splits) {
    if (splits == most_subdivisions) return open.front().bound;
    std::ranges::pop_heap(open, later);
    Piece high = std::move(open.back());
    open.pop_back();
    Piece low = split(high);
    for (Piece* piece : {&low, &high}) {
      for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 2; ++i)
          if (const double f = piece->corner(i, j); f < (best - slack) * (best - slack))
            best = improve(Eigen::Vector2d(i ? piece->u.max : piece->u.min, j ? piece->v.max : piece->v.min));
      piece->number = number++;
      if (piece->bound < best - slack) {
        open.push_back(std::move(*piece));
        std::ranges::push_heap(open, later);
      }
    }
  }
  return std::max(best - slack, 0.0);
}

// Homogeneous coordinates of the control points k(a, b) of one span, relative to the target.
template <class Geometry, class Index>
Eigen::MatrixXd local_net(const Geometry& geometry, const auto& target, int nu, int nv, const Index& index) {
  const Eigen::Index dim = target.size();
  Eigen::MatrixXd net(dim + 1, nu * nv);
  for (int b = 0; b < nv; ++b)
    for (int a = 0; a < nu; ++a) {
      const int k = index(a, b);
      const double w = geometry.rational() ? geometry.weight(k) : 1.0;
      net.col(a + nu * b).head(dim) = w * (geometry.points().col(k) - target);
      net(dim, a + nu * b) = w;
    }
  return net;
}

// Distance from the target (the origin) to the box of the control points.
double hull_distance(const Eigen::MatrixXd& net) {
  const Eigen::Index dim = net.rows() - 1;
  const Eigen::MatrixXd points = net.topRows(dim).array().rowwise() / net.row(dim).array();
  const Eigen::ArrayXd low = points.rowwise().minCoeff(), high = points.rowwise().maxCoeff();
  return low.max(0.0).max(-high).matrix().norm();
}

void check(const ClosestPointOptions& options, bool finite_target) {
  if (!finite_target) throw GeometryError("closest point: the target is not finite");
  if (options.start && !options.start->allFinite()) throw GeometryError("closest point: the start is not finite");
}

// Of two candidates the nearer one; of two at the same distance to rounding, one that converged.
template <class M>
bool better(const M& a, const M& b, double size) {
  const double da = std::sqrt(2 * a.local.f), db = std::sqrt(2 * b.local.f);
  if (std::abs(da - db) <= 1e-12 * size && a.converged != b.converged) return a.converged;
  return a.local.f < b.local.f;
}

}  // namespace

ClosestPoint closest_point(const NurbsSurface& surface, const Eigen::Vector3d& target,
                           const ClosestPointOptions& options) {
  check(options, target.allFinite());
  const double size = bounding_box(surface).diagonal().norm();
  const std::array<std::vector<double>, 2> ends = {smooth_ends(surface.u()), smooth_ends(surface.v())};
  const auto local = [&](const Eigen::Vector2d& q, const Box<2>& box) {
    const SurfaceJet jet = evaluate_on_span(surface, span_inside(surface.u(), q[0], box.max[0]),
                                            span_inside(surface.v(), q[1], box.max[1]), q[0], q[1]);
    const Eigen::Vector3d r = jet.x - target;
    Local<2, 3> l;
    l.x = jet.x;
    l.f = r.squaredNorm() / 2;
    l.gradient << r.dot(jet.u), r.dot(jet.v);
    const double uv = jet.u.dot(jet.v);
    l.gauss_newton << jet.u.squaredNorm(), uv, uv, jet.v.squaredNorm();
    const double cross = r.dot(jet.uv);
    l.hessian = l.gauss_newton;
    l.hessian(0, 0) += r.dot(jet.uu);
    l.hessian(0, 1) += cross;
    l.hessian(1, 0) += cross;
    l.hessian(1, 1) += r.dot(jet.vv);
    return l;
  };
  std::vector<Candidate> candidates;
  if (options.start) {
    candidates.push_back({0, *options.start});
  } else {
    const std::vector<double> u = samples(surface.u()), v = samples(surface.v());
    const std::vector<BasisValues> table_u = tabulate_basis(surface.u(), u), table_v = tabulate_basis(surface.v(), v);
    std::vector<SurfaceJet> row(u.size());
    std::vector<double> f;
    f.reserve(u.size() * v.size());
    for (std::size_t j = 0; j < v.size(); ++j) {
      evaluate_grid(surface, table_u, std::span(&table_v[j], 1), row);
      for (const SurfaceJet& jet : row) f.push_back((jet.x - target).squaredNorm());
    }
    candidates = local_minima(u, v, f);
  }
  std::optional<Minimum<2, 3>> best;
  int iterations = 0;
  const auto improve = [&](const Eigen::Vector2d& q) {
    auto found = descend_pieces<2, 3>(local, q, ends, size, target, options);
    iterations += found.iterations;
    if (!best || better(found, *best, size)) best = found;
    return std::sqrt(2 * best->local.f);
  };
  for (const Candidate& candidate : candidates) improve(candidate.q);

  double lower_bound = 0;
  if (!options.start) {
    const double distance = std::sqrt(2 * best->local.f), slack = proof_slack * size;
    const int pu = surface.u().degree(), pv = surface.v().degree();
    std::vector<Piece> pieces;
    for (int sv : surface.v().spans())
      for (int su : surface.u().spans()) {
        const Eigen::MatrixXd net = local_net(surface, target, pu + 1, pv + 1,
                                              [&](int a, int b) { return surface.index(su - pu + a, sv - pv + b); });
        if (hull_distance(net) >= distance - slack) continue;
        const Eigen::MatrixXd in_u = detail::bezier_extraction(surface.u(), su);
        const Eigen::MatrixXd in_v = detail::bezier_extraction(surface.v(), sv);
        Eigen::MatrixXd bezier(4, net.cols());
        for (int d = 0; d < 4; ++d) {
          const Eigen::MatrixXd row = net.row(d).reshaped(pu + 1, pv + 1);
          bezier.row(d) = (in_u * row * in_v.transpose()).reshaped().transpose();
        }
        pieces.push_back(make_piece({surface.u()[su], surface.u()[su + 1]}, {surface.v()[sv], surface.v()[sv + 1]}, pu,
                                    pv, bezier, surface.rational()));
      }
    lower_bound = bound_below(std::move(pieces), distance, slack, improve);
  }
  return {best->q[0],     best->q[1], best->local.x,   std::sqrt(2 * best->local.f),
          best->residual, iterations, best->converged, lower_bound};
}

template <int Dim>
CurveClosestPoint<Dim> closest_point(const NurbsCurve<Dim>& curve, const Eigen::Matrix<double, Dim, 1>& target,
                                     const ClosestPointOptions& options) {
  check(options, target.allFinite());
  using Parameter = Eigen::Matrix<double, 1, 1>;
  const double size = bounding_box(curve).diagonal().norm();
  const std::array<std::vector<double>, 1> ends = {smooth_ends(curve.knots())};
  const auto local = [&](const Parameter& q, const Box<1>& box) {
    const CurveJet<Dim> jet = evaluate_on_span(curve, span_inside(curve.knots(), q[0], box.max[0]), q[0]);
    const Eigen::Matrix<double, Dim, 1> r = jet.x - target;
    Local<1, Dim> l;
    l.x = jet.x;
    l.f = r.squaredNorm() / 2;
    l.gradient[0] = r.dot(jet.d1);
    l.gauss_newton(0, 0) = jet.d1.squaredNorm();
    l.hessian(0, 0) = l.gauss_newton(0, 0) + r.dot(jet.d2);
    return l;
  };
  std::vector<Candidate> candidates;
  if (options.start) {
    candidates.push_back({0, *options.start});
  } else {
    const std::vector<double> t = samples(curve.knots());
    std::vector<double> f;
    f.reserve(t.size());
    for (double s : t) f.push_back((curve(s) - target).squaredNorm());
    candidates = local_minima(t, {0.0}, f);
  }
  std::optional<Minimum<1, Dim>> best;
  int iterations = 0;
  const auto improve = [&](const Eigen::Vector2d& q) {
    auto found = descend_pieces<1, Dim>(local, Parameter(q[0]), ends, size, target, options);
    iterations += found.iterations;
    if (!best || better(found, *best, size)) best = found;
    return std::sqrt(2 * best->local.f);
  };
  for (const Candidate& candidate : candidates) improve(candidate.q);

  double lower_bound = 0;
  if (!options.start) {
    const double distance = std::sqrt(2 * best->local.f), slack = proof_slack * size;
    const int p = curve.degree();
    std::vector<Piece> pieces;
    for (int s : curve.knots().spans()) {
      const Eigen::MatrixXd net = local_net(curve, target, p + 1, 1, [&](int a, int) { return s - p + a; });
      if (hull_distance(net) >= distance - slack) continue;
      pieces.push_back(make_piece({curve.knots()[s], curve.knots()[s + 1]}, {}, p, 0,
                                  net * detail::bezier_extraction(curve.knots(), s).transpose(), curve.rational()));
    }
    lower_bound = bound_below(std::move(pieces), distance, slack, improve);
  }
  return {best->q[0],      best->local.x, std::sqrt(2 * best->local.f), best->residual, iterations,
          best->converged, lower_bound};
}

template CurveClosestPoint<2> closest_point(const NurbsCurve<2>&, const Eigen::Matrix<double, 2, 1>&,
                                            const ClosestPointOptions&);
template CurveClosestPoint<3> closest_point(const NurbsCurve<3>&, const Eigen::Matrix<double, 3, 1>&,
                                            const ClosestPointOptions&);

}  // namespace toile
