// SPDX-License-Identifier: GPL-3.0-or-later
// Entity 128, rational B-spline surface. [IGES 5.3, 4.24]
#include <algorithm>
#include <string>

#include "geometry/error.h"
#include "geometry/refine.h"
#include "io/iges/entity.h"
#include "io/iges/splines.h"
#include "io/iges/surfaces.h"

namespace toile::iges {

namespace {

void drop_surplus_rows(Parameters& in, int m1, int m2, std::vector<double>& knots_u, std::vector<double>& knots_v,
                       std::vector<double>& weights, Eigen::Matrix3Xd& points) {
  const int n1 = static_cast<int>(knots_u.size()) - m1 - 1, n2 = static_cast<int>(knots_v.size()) - m2 - 1;
  const auto same = [&](int i, int j) {
    return points.col(i) == points.col(j) &&
           (weights.empty() || weights[static_cast<std::size_t>(i)] == weights[static_cast<std::size_t>(j)]);
  };
  const std::vector<int> columns = drop_surplus(m1, knots_u, [&](int a, int b) {
    for (int j = 0; j < n2; ++j)
      if (!same(a + n1 * j, b + n1 * j)) return false;
    return true;
  });
  const std::vector<int> rows = drop_surplus(m2, knots_v, [&](int a, int b) {
    for (int i = 0; i < n1; ++i)
      if (!same(i + n1 * a, i + n1 * b)) return false;
    return true;
  });
  if (columns.empty() && rows.empty()) return;
  in.note("surplus knots 128", "a knot occurs more often than the degree; " +
                                   std::to_string(columns.size() + rows.size()) +
                                   " rows of control points that it makes idle are left out");
  std::vector<int> kept;
  for (int j = 0; j < n2; ++j)
    for (int i = 0; i < n1; ++i)
      if (!std::binary_search(columns.begin(), columns.end(), i) && !std::binary_search(rows.begin(), rows.end(), j))
        kept.push_back(i + n1 * j);
  points = points(Eigen::all, kept).eval();
  if (weights.empty()) return;
  std::vector<double> left;
  for (const int k : kept) left.push_back(weights[static_cast<std::size_t>(k)]);
  const bool plain = std::all_of(left.begin(), left.end(), [](double w) { return w == 1; });
  weights = plain ? std::vector<double>() : std::move(left);
}

}  // namespace

SplineSurface read_spline_surface(Parameters& in) {
  const int k1 = in.integer("K1"), k2 = in.integer("K2");
  const int m1 = in.integer("M1"), m2 = in.integer("M2");
  for (int i = 0; i < 5; ++i) in.integer("PROP");
  if (m1 < 1 || m2 < 1 || m1 > max_degree || m2 > max_degree)
    in.fail("degrees are " + std::to_string(m1) + " and " + std::to_string(m2) + ", must be 1 to " +
            std::to_string(max_degree));
  if (k1 < m1 || k2 < m2)
    in.fail("K1, K2 are " + std::to_string(k1) + ", " + std::to_string(k2) + ", must be at least the degrees " +
            std::to_string(m1) + ", " + std::to_string(m2));
  const long long n1 = static_cast<long long>(k1) + 1, n2 = static_cast<long long>(k2) + 1;
  const std::string claim = std::to_string(n1) + " x " + std::to_string(n2) + " control points of degree " +
                            std::to_string(m1) + ", " + std::to_string(m2);
  in.expect(n1, claim);
  in.expect(n2, claim);
  in.expect(n1 + m1 + 1 + n2 + m2 + 1 + 4 * n1 * n2, claim);
  const int count = static_cast<int>(n1 * n2);
  std::vector<double> knots_u = read_knots(in, k1 + m1 + 2);
  std::vector<double> knots_v = read_knots(in, k2 + m2 + 2);
  std::vector<double> weights = read_weights(in, count);
  Eigen::Matrix3Xd points(3, count);
  for (int i = 0; i < count; ++i)
    for (int axis = 0; axis < 3; ++axis) points(axis, i) = in.real("coordinate of control point", i);
  drop_surplus_rows(in, m1, m2, knots_u, knots_v, weights, points);
  try {
    SplineSurface out;
    out.surface = NurbsSurface(KnotVector(m1, std::move(knots_u)), KnotVector(m2, std::move(knots_v)),
                               std::move(points), std::move(weights));
    out.u = read_range(in, "U", out.surface.u());
    out.v = read_range(in, "V", out.surface.v());
    return out;
  } catch (const GeometryError& error) {
    in.fail(error.what());
  }
}

namespace {

// The first and last control points along a direction coincide: within 1e-12 of the net's size.
bool closed(const NurbsSurface& s, Direction direction) {
  if (!s.knots(direction).clamped()) return false;
  const Eigen::Matrix3Xd& p = s.points();
  const double size = (p.rowwise().maxCoeff() - p.rowwise().minCoeff()).norm();
  const int n = direction == Direction::u ? s.count_v() : s.count_u();
  for (int k = 0; k < n; ++k) {
    const int first = direction == Direction::u ? s.index(0, k) : s.index(k, 0);
    const int last = direction == Direction::u ? s.index(s.count_u() - 1, k) : s.index(k, s.count_v() - 1);
    if ((p.col(first) - p.col(last)).norm() > 1e-12 * size) return false;
  }
  return true;
}

// The surface over [range.min, range.max] in u: with a knot at both ends, the control points of the other spans go.
NurbsSurface restrict_u(const NurbsSurface& surface, Interval range) {
  std::vector<double> added;
  const Interval domain = surface.u().domain();
  for (double end : {range.min, range.max})
    if (domain.min < end && end < domain.max && surface.u().multiplicity(end) == 0) added.push_back(end);
  const NurbsSurface whole = insert_knots(surface, Direction::u, added);
  const KnotVector& k = whole.u();
  const int p = k.degree();
  int first = 0, last = 0;  // knots[first] is the last occurrence of min, knots[last] the first occurrence of max
  for (int i = p; i <= k.control_point_count(); ++i) {
    if (k[i] <= range.min) first = i;
    if (k[i] < range.max) last = i + 1;
  }
  const int n = last - first + p;
  std::vector<double> knots(k.knots().begin() + (first - p), k.knots().begin() + (last + p + 1));
  Eigen::Matrix3Xd points(3, n * whole.count_v());
  std::vector<double> weights;
  for (int j = 0; j < whole.count_v(); ++j)
    for (int i = 0; i < n; ++i) {
      points.col(i + n * j) = whole.points().col(whole.index(first - p + i, j));
      if (!whole.weights().empty()) weights.push_back(whole.weight(whole.index(first - p + i, j)));
    }
  return NurbsSurface(KnotVector(p, std::move(knots)), whole.v(), std::move(points), std::move(weights));
}

bool whole(Interval range, const KnotVector& knots) {
  return range.min == knots.domain().min && range.max == knots.domain().max;
}

}  // namespace

bool SplineSurface::covers_domain() const {
  return whole(u, surface.u()) && whole(v, surface.v());
}

NurbsSurface restricted(const SplineSurface& spline) {
  NurbsSurface out = spline.surface;
  if (spline.covers_domain()) return out;
  if (!whole(spline.u, out.u())) out = restrict_u(out, spline.u);
  if (!whole(spline.v, out.v())) out = transposed(restrict_u(transposed(out), spline.v));
  return clamp(out);
}

void write(const SplineSurface& spline, Record& out) {
  const NurbsSurface& s = spline.surface;
  out.integer(s.count_u() - 1).integer(s.count_v() - 1).integer(s.u().degree()).integer(s.v().degree());
  out.integer(closed(s, Direction::u) ? 1 : 0).integer(closed(s, Direction::v) ? 1 : 0);
  out.integer(s.rational() ? 0 : 1).integer(0).integer(0);
  for (double knot : s.u().knots()) out.real(knot);
  for (double knot : s.v().knots()) out.real(knot);
  const int count = s.count_u() * s.count_v();
  for (int i = 0; i < count; ++i) out.real(s.weight(i));
  for (int i = 0; i < count; ++i)
    for (int axis = 0; axis < 3; ++axis) out.real(s.points()(axis, i));
  out.real(spline.u.min).real(spline.u.max).real(spline.v.min).real(spline.v.max);
}

}  // namespace toile::iges
