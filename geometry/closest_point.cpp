// closest_point(): descent from the local minima of a sampling.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "geometry/error.h"
#include "geometry/grid_evaluation.h"
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
    open[i] =
        !(q[i] <= box.min[i] && gradient[i] >= 0) && !(q[i] >= box.max[i] && gradient[i] <= 0);
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
// positive definite, else Gauss-Newton, else scaled steepest descent; each with an Armijo search along the projected arc.
// `evaluate(q)` gives the Local; `size` is the length that the tolerance refers to.
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
          step[i] = open[i] && local.gauss_newton(i, i) > 0
                        ? -local.gradient[i] / (N * local.gauss_newton(i, i))
                        : 0.0;
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
        const bool level = std::abs(next.f - local.f) <= 8 * epsilon * local.f + grain * std::sqrt(2 * local.f) &&
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
  for (int i = 0; i < N; ++i)
    piece[i] = piece_of(ends[i], start[i]);
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
      if (best.q[i] >= box.max[i] && piece[i] + 2 < static_cast<int>(ends[i].size()))
        shifts[i][choices[i]++] = 1;
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

// A sampling has one local minimum for each candidate of the global one; the nearest few are followed.
constexpr std::size_t followed = 12;

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
          if (const double other = f[a + nu * b];
              other < value || (other == value && a + nu * b < i + nu * j)) {
            lowest = false;
            break;
          }
      if (lowest) found.push_back({value, {u[i], v[j]}});
    }
  std::ranges::stable_sort(found, {}, &Candidate::f);
  if (found.size() > followed) found.resize(followed);
  return found;
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
  for (const Candidate& candidate : candidates) {
    auto found = descend_pieces<2, 3>(local, candidate.q, ends, size, target, options);
    iterations += found.iterations;
    if (!best || better(found, *best, size)) best = found;
  }
  return {best->q[0],      best->q[1],     best->local.x,  std::sqrt(2 * best->local.f),
          best->residual, iterations, best->converged};
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
  for (const Candidate& candidate : candidates) {
    auto found = descend_pieces<1, Dim>(local, Parameter(candidate.q[0]), ends, size, target, options);
    iterations += found.iterations;
    if (!best || better(found, *best, size)) best = found;
  }
  return {best->q[0], best->local.x, std::sqrt(2 * best->local.f), best->residual, iterations, best->converged};
}

template CurveClosestPoint<2> closest_point(const NurbsCurve<2>&, const Eigen::Matrix<double, 2, 1>&,
                                            const ClosestPointOptions&);
template CurveClosestPoint<3> closest_point(const NurbsCurve<3>&, const Eigen::Matrix<double, 3, 1>&,
                                            const ClosestPointOptions&);

}  // namespace toile
