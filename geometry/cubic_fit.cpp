// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/cubic_fit.h"

#include <algorithm>
#include <array>
#include <vector>

#include "geometry/error.h"

namespace toile {

namespace {

template <int Dim>
using Point = Eigen::Matrix<double, Dim, 1>;

template <int Dim>
struct Span {
  Interval range;
  std::array<Point<Dim>, 4> points;  // Bezier
  Point<Dim> start_derivative, end_derivative;
};

template <int Dim>
Point<Dim> value(const Span<Dim>& span, double t) {
  const double b = (t - span.range.min) / span.range.length(), a = 1 - b;
  return a * a * a * span.points[0] + 3 * a * a * b * span.points[1] + 3 * a * b * b * span.points[2] +
         b * b * b * span.points[3];
}

template <int Dim>
class Fitter {
 public:
  explicit Fitter(const CubicFitOptions<Dim>& options) : options_(options) {}

  void add(const SmoothPath<Dim>& path) { fit(path, path.range, path.at(path.range.min), path.at(path.range.max), 0); }
  CubicFit<Dim> result() const { return {joined(), error_}; }

 private:
  double distance(const SmoothPath<Dim>& path, double t, const Point<Dim>& x) const {
    const Point<Dim> exact = path.at(t).x;
    return options_.distance ? options_.distance(t, exact, x) : (exact - x).norm();
  }

  void fit(const SmoothPath<Dim>& path, Interval range, const PathPoint<Dim>& start, const PathPoint<Dim>& end,
           int halvings) {
    const double h = range.length();
    const Span<Dim> span{range, {start.x, start.x + h / 3 * start.d, end.x - h / 3 * end.d, end.x}, start.d, end.d};
    bool good = true;
    for (double f : {0.125, 0.3, 0.5, 0.7, 0.875}) {
      const double t = range.min + f * h;
      good = good && distance(path, t, value(span, t)) <= options_.tolerance;
    }
    const double middle = range.min + 0.5 * h;
    if (good || halvings == options_.max_halvings || !(range.min < middle && middle < range.max)) {
      for (int k = 0; k <= 16; ++k) {
        const double t = range.min + h * k / 16;
        error_ = std::max(error_, distance(path, t, value(span, t)));
      }
      spans_.push_back(span);
      return;
    }
    const PathPoint<Dim> jet = path.at(middle);
    fit(path, {range.min, middle}, start, jet, halvings + 1);
    fit(path, {middle, range.max}, jet, end, halvings + 1);
  }

  NurbsCurve<Dim> joined() const {
    std::vector<double> knots(4, spans_.front().range.min);
    std::vector<Point<Dim>> points{spans_.front().points[0]};
    for (std::size_t i = 0; i < spans_.size(); ++i) {
      const Span<Dim>& span = spans_[i];
      points.push_back(span.points[1]);
      points.push_back(span.points[2]);
      const double end = span.range.max;
      if (i + 1 == spans_.size()) {
        knots.insert(knots.end(), 4, end);
        points.push_back(span.points[3]);
        break;
      }
      // One derivative on both sides: the joint is no control point of its own.
      const Point<Dim> jump = spans_[i + 1].start_derivative - span.end_derivative;
      const bool smooth = jump.norm() <= 1e-9 * span.end_derivative.norm();
      knots.insert(knots.end(), smooth ? 2 : 3, end);
      if (!smooth) points.push_back(span.points[3]);
    }
    typename NurbsCurve<Dim>::Points net(Dim, static_cast<Eigen::Index>(points.size()));
    for (std::size_t i = 0; i < points.size(); ++i) net.col(static_cast<Eigen::Index>(i)) = points[i];
    return NurbsCurve<Dim>(KnotVector(3, std::move(knots)), std::move(net));
  }

  const CubicFitOptions<Dim>& options_;
  std::vector<Span<Dim>> spans_;
  double error_ = 0;
};

}  // namespace

template <int Dim>
CubicFit<Dim> fit_cubic(std::span<const SmoothPath<Dim>> path, const CubicFitOptions<Dim>& options) {
  if (path.empty()) throw GeometryError("a path without pieces can't be fitted");
  Fitter<Dim> fitter(options);
  for (const SmoothPath<Dim>& piece : path) fitter.add(piece);
  return fitter.result();
}

template CubicFit<2> fit_cubic(std::span<const SmoothPath<2>>, const CubicFitOptions<2>&);
template CubicFit<3> fit_cubic(std::span<const SmoothPath<3>>, const CubicFitOptions<3>&);

}  // namespace toile
