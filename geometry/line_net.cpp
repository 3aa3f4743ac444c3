// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/line_net.h"

#include <algorithm>
#include <cassert>
#include <string>

#include "geometry/error.h"
#include "geometry/text.h"

namespace toile::detail {
namespace {

// First index with knots[i] >= u, and first with knots[i] > u.
int lower_index(std::span<const double> knots, double u) {
  return static_cast<int>(std::lower_bound(knots.begin(), knots.end(), u) - knots.begin());
}
int upper_index(std::span<const double> knots, double u) {
  return static_cast<int>(std::upper_bound(knots.begin(), knots.end(), u) - knots.begin());
}

void insert_until(LineNet& net, double u, int multiplicity) {
  const int missing = multiplicity - net.knots.multiplicity(u);
  if (missing > 0) net = insert_knots(std::move(net), std::vector<double>(static_cast<std::size_t>(missing), u));
}

Rows elevate_bezier(const Rows& in) {
  const Eigen::Index p = in.rows() - 1;
  Rows out(p + 2, in.cols());
  out.row(0) = in.row(0);
  for (Eigen::Index i = 1; i <= p; ++i) {
    const double a = static_cast<double>(i) / static_cast<double>(p + 1);
    out.row(i) = a * in.row(i - 1) + (1 - a) * in.row(i);
  }
  out.row(p + 1) = in.row(p);
  return out;
}

}  // namespace

std::vector<double> equal_weights(const std::vector<double>& weights, Eigen::Index count) {
  return weights.empty() ? std::vector<double>()
                         : std::vector<double>(static_cast<std::size_t>(count), weights.front());
}

LineNet to_net(const NurbsSurface& surface, Direction d) {
  const int nu = surface.count_u(), nv = surface.count_v();
  const int width = surface.rational() ? 4 : 3;
  const bool along_u = d == Direction::u;
  Rows rows(along_u ? nu : nv, width * (along_u ? nv : nu));
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i) {
      const int k = surface.index(i, j);
      auto entry = along_u ? rows.row(i).segment(width * j, width) : rows.row(j).segment(width * i, width);
      entry.head<3>() = surface.points().col(k).transpose();
      if (width == 4) {
        entry *= surface.weight(k);
        entry(3) = surface.weight(k);
      }
    }
  return {surface.knots(d), std::move(rows)};
}

NurbsSurface to_surface(LineNet net, const NurbsSurface& like, Direction d) {
  const bool along_u = d == Direction::u;
  const int nu = along_u ? static_cast<int>(net.rows.rows()) : like.count_u();
  const int nv = along_u ? like.count_v() : static_cast<int>(net.rows.rows());
  const int width = like.rational() ? 4 : 3;
  Eigen::Matrix3Xd points(3, nu * nv);
  std::vector<double> weights =
      like.rational() ? std::vector<double>(static_cast<std::size_t>(nu * nv)) : equal_weights(like.weights(), nu * nv);
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i) {
      const auto entry =
          along_u ? net.rows.row(i).segment(width * j, width) : net.rows.row(j).segment(width * i, width);
      const int k = i + nu * j;
      points.col(k) = entry.head<3>().transpose();
      if (width == 4) {
        weights[static_cast<std::size_t>(k)] = entry(3);
        points.col(k) /= entry(3);
      }
    }
  KnotVector u = along_u ? std::move(net.knots) : like.u();
  KnotVector v = along_u ? like.v() : std::move(net.knots);
  return {std::move(u), std::move(v), std::move(points), std::move(weights)};
}

LineNet insert_knots(LineNet net, std::span<const double> added) {
  if (added.empty()) return net;
  const int p = net.knots.degree();
  const Interval domain = net.knots.domain();
  std::vector<double> sorted(added.begin(), added.end());
  std::ranges::sort(sorted);
  std::vector<double> t(net.knots.knots().begin(), net.knots.knots().end());
  int count = net.knots.control_point_count();
  Rows rows(count + static_cast<int>(sorted.size()), net.rows.cols());
  rows.topRows(count) = net.rows;
  // A corner cut must read points that earlier ones have not overwritten: from the last affected point backwards.
  for (double u : sorted) {
    if (!domain.contains(u))
      throw GeometryError("knot " + text(u) + " lies outside the domain [" + text(domain.min) + ", " +
                          text(domain.max) + "]");
    const int end = upper_index(t, u), s = end - 1;
    const int m = end - lower_index(t, u);
    if (m >= p)
      throw GeometryError("knot " + text(u) + " occurs " + std::to_string(m) + " times; degree " + std::to_string(p) +
                          " takes no more");
    for (int i = count; i > s - m; --i) rows.row(i) = rows.row(i - 1);
    for (int i = s - m; i > s - p; --i) {
      const double a = (u - t[i]) / (t[i + p] - t[i]);
      rows.row(i) = a * rows.row(i) + (1 - a) * rows.row(i - 1);
    }
    t.insert(t.begin() + end, u);
    ++count;
  }
  return {KnotVector(p, std::move(t)), std::move(rows)};
}

LineNet cut(LineNet net, Interval range) {
  const int p = net.knots.degree();
  const Interval domain = net.knots.domain();
  if (!(range.min < range.max) || !domain.contains(range.min) || !domain.contains(range.max))
    throw GeometryError("the range [" + text(range.min) + ", " + text(range.max) + "] is no part of the domain [" +
                        text(domain.min) + ", " + text(domain.max) + "]");
  insert_until(net, range.min, p);
  insert_until(net, range.max, p);
  const auto t = net.knots.knots();
  const int first = upper_index(t, range.min) - 1 - p;
  const int last = lower_index(t, range.max) - 1;
  if (p == 0) {  // nothing to insert: the constant pieces that the range meets
    std::vector<double> knots = {range.min};
    for (double b : net.knots.breaks())
      if (range.min < b && b < range.max) knots.push_back(b);
    knots.push_back(range.max);
    return {KnotVector(0, std::move(knots)), net.rows.middleRows(first, last - first + 1)};
  }
  if (first == 0 && last == net.rows.rows() - 1 && net.knots.clamped()) return net;
  std::vector<double> knots(t.begin() + first, t.begin() + last + p + 2);
  knots.front() = range.min;
  knots.back() = range.max;
  return {KnotVector(p, std::move(knots)), net.rows.middleRows(first, last - first + 1)};
}

std::vector<Rows> bezier_rows(const LineNet& net) {
  const int p = net.knots.degree();
  LineNet pieces = cut(net, net.knots.domain());
  std::vector<double> added;
  const std::vector<double> breaks = pieces.knots.breaks();
  for (std::size_t i = 1; i + 1 < breaks.size(); ++i)
    for (int m = pieces.knots.multiplicity(breaks[i]); m < p; ++m) added.push_back(breaks[i]);
  pieces = insert_knots(std::move(pieces), added);
  std::vector<Rows> result;
  for (int s : pieces.knots.spans()) result.push_back(pieces.rows.middleRows(s - p, p + 1));
  return result;
}

// Bezier coefficient i is the blossom at p - i times the start and i times the end of the span: the recursion of the
// basis with its own parameter at every degree.
Eigen::MatrixXd bezier_extraction(const KnotVector& knots, int span) {
  const int p = knots.degree();
  const double* t = knots.knots().data() + span;
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(p + 1, p + 1);
  for (int i = 0; i <= p; ++i) {
    auto row = matrix.row(i);
    row[0] = 1;
    for (int k = 1; k <= p; ++k) {
      const double u = k <= i ? t[1] : t[0];
      double carried = 0;
      for (int r = 0; r < k; ++r) {
        const double part = row[r] / (t[r + 1] - t[r + 1 - k]);
        row[r] = carried + (t[r + 1] - u) * part;
        carried = (u - t[r + 1 - k]) * part;
      }
      row[k] = carried;
    }
  }
  return matrix;
}

// Each control point of the result is the blossom of the elevated polynomial of some span at consecutive knots
// [Ramshaw 1989]. The longest span among them is taken, so that no argument lies further than q lengths away and the
// rounding of far extrapolation stays out.
LineNet elevate_degree(const LineNet& net, int degree) {
  const int p = net.knots.degree();
  if (degree < p || degree > max_degree)
    throw GeometryError("degree " + std::to_string(p) + " cannot be elevated to " + std::to_string(degree) +
                        (degree < p ? "" : ", the highest is " + std::to_string(max_degree)));
  if (degree == p) return net;
  std::vector<Rows> pieces = bezier_rows(net);
  for (Rows& piece : pieces)
    for (int k = p; k < degree; ++k) piece = elevate_bezier(piece);

  const std::vector<double> breaks = net.knots.breaks();
  std::vector<double> t(degree + 1, breaks.front());
  for (std::size_t i = 1; i + 1 < breaks.size(); ++i)
    t.insert(t.end(), net.knots.multiplicity(breaks[i]) + degree - p, breaks[i]);
  t.insert(t.end(), degree + 1, breaks.back());
  KnotVector knots(degree, std::move(t));

  Rows rows(knots.control_point_count(), net.rows.cols());
  Rows work;
  for (int j = 0; j < rows.rows(); ++j) {
    // Pieces between the first and the last argument; where all arguments are one knot, the piece on the side to which
    // the function belongs.
    const double first = knots[j + 1], last = knots[j + degree];
    auto piece_at = [&](double u) {
      return static_cast<int>(std::lower_bound(breaks.begin(), breaks.end(), u) - breaks.begin());
    };
    int begin = piece_at(first), end = piece_at(last);
    if (begin == end) {
      if (knots[j + degree + 1] > last)
        ++end;
      else
        --begin;
    }
    int best = begin;
    for (int k = begin; k < end; ++k)
      if (breaks[k + 1] - breaks[k] > breaks[best + 1] - breaks[best]) best = k;
    const double a = breaks[best], length = breaks[best + 1] - a;
    work = pieces[static_cast<std::size_t>(best)];
    for (int r = 1; r <= degree; ++r) {
      const double x = (knots[j + r] - a) / length;
      for (int i = 0; i <= degree - r; ++i) work.row(i) = (1 - x) * work.row(i) + x * work.row(i + 1);
    }
    rows.row(j) = work.row(0);
  }
  return {std::move(knots), std::move(rows)};
}

// Solves the insertion equations from both ends towards the middle, as in [Piegl & Tiller 1997, A5.8]; where both sides
// give the middle point, their mean is taken.
LineNet without_knot(const LineNet& net, double knot) {
  const int p = net.knots.degree();
  const auto t = net.knots.knots();
  const int r = upper_index(t, knot) - 1;
  const int m = net.knots.multiplicity(knot);
  assert(m > 0 && net.knots.domain().min < knot && knot < net.knots.domain().max);
  const int first = r - p, last = r - m;

  Rows rows(net.rows.rows() - 1, net.rows.cols());
  rows.topRows(first) = net.rows.topRows(first);                                          // 0 .. first - 1
  rows.bottomRows(rows.rows() - last) = net.rows.bottomRows(net.rows.rows() - last - 1);  // last .. end
  // The equations are net[i] = a_i rows[i] + (1 - a_i) rows[i - 1], i = first .. last; unknown rows[first .. last - 1].
  int i = first, j = last;
  for (; j > i; ++i, --j) {
    const double ai = (knot - t[i]) / (t[i + p + 1] - t[i]);
    const double aj = (knot - t[j]) / (t[j + p + 1] - t[j]);
    const Eigen::RowVectorXd left = (net.rows.row(i) - (1 - ai) * rows.row(i - 1)) / ai;
    const Eigen::RowVectorXd right = (net.rows.row(j) - aj * rows.row(j)) / (1 - aj);
    if (i == j - 1) {
      rows.row(i) = (left + right) / 2;
    } else {
      rows.row(i) = left;
      rows.row(j - 1) = right;
    }
  }
  if (m == p + 1) rows.row(first - 1) = (net.rows.row(first - 1) + net.rows.row(first)) / 2;

  std::vector<double> knots(t.begin(), t.end());
  knots.erase(knots.begin() + r);
  return {KnotVector(p, std::move(knots)), std::move(rows)};
}

}  // namespace toile::detail
