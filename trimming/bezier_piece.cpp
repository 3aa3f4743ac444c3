// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/bezier_piece.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace toile {
namespace {

using Eigen::Vector2d;

double cross(const Vector2d& a, const Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

// Distance of the control points from the chord.
double sag(const BezierPiece& piece) {
  const Vector2d chord = piece.last() - piece.first();
  const double length = chord.norm();
  double most = 0;
  for (int i = 1; i < piece.degree(); ++i) {
    const Vector2d d = piece.span.point(i) - piece.first();
    most = std::max(most, length > 0 ? std::abs(cross(chord, d)) / length : d.norm());
  }
  return most;
}

bool apart(const Box& a, const Box& b) {
  return a.max.x() < b.min.x() || b.max.x() < a.min.x() || a.max.y() < b.min.y() || b.max.y() < a.min.y();
}

// Where on a straight piece the place at a share of its length lies: the weights of the ends move the parameter.
double parameter_of(const BezierPiece& piece, double share) {
  if (!piece.straight()) return share;
  const double from = (1 - share) * piece.span.w[1], to = share * piece.span.w[0];
  return to / (from + to);
}

// A part of a piece with its parameters on that.
struct Stretch {
  BezierPiece piece;
  double x0 = 0, x1 = 1;
};

std::pair<Stretch, Stretch> halves(const Stretch& s) {
  const double mid = 0.5 * (s.x0 + s.x1);
  auto [left, right] = split(s.piece, 0.5);
  return {{std::move(left), s.x0, mid}, {std::move(right), mid, s.x1}};
}

// Newton's steps from a place where chords cross; the chords' place where they lead away.
Vector2d polished(const BezierPiece& a, const BezierPiece& b, const Vector2d& start, double reach) {
  Vector2d x = start;
  const auto slope = [](const BezierPiece& p, double s) {
    const double h = 1e-6, low = std::clamp(s - h, 0.0, 1.0), high = std::clamp(s + h, 0.0, 1.0);
    return Vector2d((p.at(high) - p.at(low)) / (high - low));
  };
  double least = (a.at(x[0]) - b.at(x[1])).norm();
  for (int step = 0; step < 8; ++step) {
    const Vector2d da = slope(a, x[0]), db = slope(b, x[1]), gap = b.at(x[1]) - a.at(x[0]);
    const double det = cross(da, db);
    if (!(std::abs(det) > 1e-12 * da.norm() * db.norm())) break;
    const Vector2d next = x + Vector2d(cross(gap, db), cross(gap, da)) / det;
    if (!((next - start).cwiseAbs().maxCoeff() <= reach) || next.minCoeff() < 0 || next.maxCoeff() > 1) break;
    const double off = (a.at(next[0]) - b.at(next[1])).norm();
    if (!(off < least)) break;
    least = off;
    x = next;
  }
  return x;
}

class Crossings {
 public:
  Crossings(const BezierPiece& a, const BezierPiece& b, double flat, const std::function<void(double, double)>& each)
      : a_(a), b_(b), flat_(flat), each_(each) {}

  void search(const Stretch& a, const Stretch& b, int depth = 0) {
    if (apart(a.piece.box, b.piece.box) || chord_parts(a.piece, b.piece, 0) || chord_parts(b.piece, a.piece, 0)) return;
    const bool flat_a = sag(a.piece) <= flat_, flat_b = sag(b.piece) <= flat_;
    if ((flat_a && flat_b) || depth > 120) return chords(a, b);
    if (flat_a || (!flat_b && b.piece.size() > a.piece.size())) {
      const auto [b1, b2] = halves(b);
      search(a, b1, depth + 1);
      search(a, b2, depth + 1);
    } else {
      const auto [a1, a2] = halves(a);
      search(a1, b, depth + 1);
      search(a2, b, depth + 1);
    }
  }

 private:
  void chords(const Stretch& a, const Stretch& b) const {
    const Vector2d da = a.piece.last() - a.piece.first(), db = b.piece.last() - b.piece.first();
    const Vector2d gap = b.piece.first() - a.piece.first();
    const double det = cross(da, db);
    if (!(std::abs(det) > 1e-15 * da.norm() * db.norm())) return;  // along each other: they meet at ends only
    const double s = cross(gap, db) / det, t = cross(gap, da) / det;
    // Ends of stretches count for both neighbours.
    const double slack_a = flat_ / std::max(da.norm(), flat_), slack_b = flat_ / std::max(db.norm(), flat_);
    if (s < -slack_a || s > 1 + slack_a || t < -slack_b || t > 1 + slack_b) return;
    const double x0 = parameter_of(a.piece, std::clamp(s, 0.0, 1.0)),
                 y0 = parameter_of(b.piece, std::clamp(t, 0.0, 1.0));
    const Vector2d start(a.x0 + (a.x1 - a.x0) * x0, b.x0 + (b.x1 - b.x0) * y0);
    const Vector2d x = polished(a_, b_, start, 2 * std::max(a.x1 - a.x0, b.x1 - b.x0));
    each_(x[0], x[1]);
  }

  const BezierPiece &a_, &b_;
  double flat_;
  const std::function<void(double, double)>& each_;
};

}  // namespace

BezierPiece::BezierPiece(const TrimSpan& of) : span(of) {
  set_box();
}

void BezierPiece::set_box() {
  box = {first(), first()};
  for (int i = 1; i <= degree(); ++i) {
    box.min = box.min.cwiseMin(span.point(i));
    box.max = box.max.cwiseMax(span.point(i));
  }
}

void turn(TrimSpan& span) {
  std::reverse(span.u.begin(), span.u.begin() + span.degree + 1);
  std::reverse(span.v.begin(), span.v.begin() + span.degree + 1);
  std::reverse(span.w.begin(), span.w.begin() + span.degree + 1);
}

std::pair<BezierPiece, BezierPiece> split(const BezierPiece& piece, double x) {
  BezierPiece left = piece, right = piece;
  const std::size_t n = static_cast<std::size_t>(piece.degree());
  std::array<Eigen::Vector3d, max_degree + 1> d;
  for (std::size_t i = 0; i <= n; ++i) {
    const double w = piece.span.w[i];
    d[i] = {piece.span.u[i] * w, piece.span.v[i] * w, w};
  }
  const auto store = [](TrimSpan& span, std::size_t i, const Eigen::Vector3d& h) {
    span.u[i] = h.x() / h.z();
    span.v[i] = h.y() / h.z();
    span.w[i] = h.z();
  };
  for (std::size_t k = 1; k <= n; ++k) {
    for (std::size_t i = 0; i + k <= n; ++i)
      d[i] = x == 0.5 ? (0.5 * (d[i] + d[i + 1])).eval() : ((1 - x) * d[i] + x * d[i + 1]).eval();
    store(left.span, k, d[0]);
    if (k < n) store(right.span, n - k, d[n - k]);
  }
  right.span.u[0] = left.span.u[n];
  right.span.v[0] = left.span.v[n];
  right.span.w[0] = left.span.w[n];
  left.s1 = right.s0 = x == 0.5 ? 0.5 * (piece.s0 + piece.s1) : piece.s0 + (piece.s1 - piece.s0) * x;
  left.set_box();
  right.set_box();
  return {left, right};
}

bool forward(const BezierPiece& piece) {
  const Vector2d chord = piece.last() - piece.first();
  if (chord == Vector2d::Zero()) return false;
  for (int i = 0; i < piece.degree(); ++i) {
    if (!((piece.span.point(i + 1) - piece.span.point(i)).dot(chord) >= 0)) return false;
  }
  return true;
}

void split_forward(const BezierPiece& piece, const std::function<void(const BezierPiece&)>& each, int depth) {
  if (depth == 30 || piece.is_point() || forward(piece)) return each(piece);
  const auto [a, b] = split(piece, 0.5);
  split_forward(a, each, depth + 1);
  split_forward(b, each, depth + 1);
}

bool chord_parts(const BezierPiece& a, const BezierPiece& b, double margin) {
  const Vector2d chord = a.last() - a.first();
  const double length = chord.norm();
  if (length == 0) return false;
  const Vector2d normal = Vector2d(-chord.y(), chord.x()) / length;
  double a_min = 0, a_max = 0;
  double b_min = std::numeric_limits<double>::infinity(), b_max = -b_min;
  for (int i = 1; i <= a.degree(); ++i) {
    const double x = normal.dot(a.span.point(i) - a.first());
    a_min = std::min(a_min, x);
    a_max = std::max(a_max, x);
  }
  for (int i = 0; i <= b.degree(); ++i) {
    const double x = normal.dot(b.span.point(i) - a.first());
    b_min = std::min(b_min, x);
    b_max = std::max(b_max, x);
  }
  return a_max + margin < b_min || b_max + margin < a_min;
}

std::pair<double, double> nearest(const BezierPiece& piece, const Vector2d& x) {
  if (piece.straight()) {
    const Vector2d d = piece.last() - piece.first();
    const double length = d.squaredNorm();
    const double share = length > 0 ? std::clamp((x - piece.first()).dot(d) / length, 0.0, 1.0) : 0;
    return {parameter_of(piece, share), (piece.first() + share * d - x).norm()};
  }
  const auto off = [&](double s) { return (piece.at(s) - x).squaredNorm(); };
  const int parts = 4 * piece.degree();
  int best = 0;
  for (int i = 1; i <= parts; ++i)
    if (off(static_cast<double>(i) / parts) < off(static_cast<double>(best) / parts)) best = i;
  // Golden section between the neighbours, then Newton's steps for the foot of the perpendicular.
  double low = std::max(0, best - 1) / static_cast<double>(parts),
         high = std::min(parts, best + 1) / static_cast<double>(parts);
  constexpr double golden = 0.6180339887498949;
  for (int step = 0; step < 40; ++step) {
    const double a = high - golden * (high - low), b = low + golden * (high - low);
    (off(a) < off(b) ? high : low) = off(a) < off(b) ? b : a;
  }
  double s = 0.5 * (low + high);
  for (int step = 0; step < 4; ++step) {
    const double h = 1e-6, a = std::clamp(s - h, 0.0, 1.0), b = std::clamp(s + h, 0.0, 1.0);
    const Vector2d slope = (piece.at(b) - piece.at(a)) / (b - a);
    const double next = std::clamp(s + (x - piece.at(s)).dot(slope) / slope.squaredNorm(), 0.0, 1.0);
    if (!(off(next) < off(s))) break;
    s = next;
  }
  for (const double end : {0.0, 1.0})
    if (off(end) < off(s)) s = end;
  return {s, std::sqrt(off(s))};
}

void crossings(const BezierPiece& a, const BezierPiece& b, double flat,
               const std::function<void(double s, double t)>& each) {
  Crossings(a, b, flat, each).search({a}, {b});
}

}  // namespace toile
