// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/iges/parameter_map.h"

#include <algorithm>
#include <cmath>

#include "geometry/cubic_fit.h"
#include "geometry/refine.h"

namespace toile::iges {

namespace {

const Turn* turn_at(const AxisMap& map, double x) {
  if (map.turns.size() == 1) return &map.turns[0];
  for (const Turn& turn : map.turns)
    if (turn.range.contains(x)) return &turn;
  return nullptr;
}

// On an arc of half angle h the rational quadratic's parameter is tan(angle / 2) / tan(h / 2), counted from the middle.
struct ArcPlace {
  double middle, half;      // of the arc, in the parameter
  double rate, half_angle;  // angle for each unit of the parameter
};
ArcPlace arc_place(const Turn& turn, double x) {
  const double width = turn.range.length() / turn.arcs;
  const double k = std::floor((x - turn.range.min) / width);
  return {turn.range.min + (k + 0.5) * width, 0.5 * width, turn.sweep / turn.range.length(),
          0.5 * turn.sweep / turn.arcs};
}

}  // namespace

double AxisMap::operator()(double x) const {
  x = scale * x + shift;
  const Turn* turn = turn_at(*this, x);
  if (!turn || x == turn->range.min || x == turn->range.max) return x;
  const ArcPlace arc = arc_place(*turn, x);
  return arc.middle + arc.half * std::tan(0.5 * arc.rate * (x - arc.middle)) / std::tan(0.5 * arc.half_angle);
}

double AxisMap::derivative(double x) const {
  x = scale * x + shift;
  const Turn* turn = turn_at(*this, x);
  if (!turn) return scale;
  const ArcPlace arc = arc_place(*turn, x);
  const double c = std::cos(0.5 * arc.rate * (x - arc.middle));
  return scale * 0.5 * arc.rate * arc.half / (std::tan(0.5 * arc.half_angle) * c * c);
}

bool ParameterMap::identity() const {
  const auto plain = [](const AxisMap& axis) { return axis.affine() && axis.scale == 1 && axis.shift == 0; };
  return plain(u) && plain(v) && !swapped;
}

std::vector<ParameterMap> readings(const AxisReadings& u, const AxisReadings& v) {
  const auto along = [](const AxisReadings& axis) {
    std::vector<AxisMap> out{axis.standard};
    for (const Interval& counted : axis.counted) {
      AxisMap map = axis.standard;
      map.scale = axis.range.length() / counted.length();
      map.shift = axis.range.min - counted.min * map.scale;
      const auto known = [&](const AxisMap& m) {
        return std::abs(m.scale - map.scale) <= 1e-12 * map.scale &&
               std::abs(m.shift - map.shift) <= 1e-12 * axis.range.length();
      };
      if (std::isfinite(map.scale) && map.scale > 0 && std::none_of(out.begin(), out.end(), known))
        out.push_back(std::move(map));
    }
    return out;
  };
  std::vector<ParameterMap> out;
  for (const bool swapped : {false, true})
    for (const AxisMap& mu : along(u))
      for (const AxisMap& mv : along(v)) out.push_back({mu, mv, swapped});
  return out;
}

CarriedCurve carried(const Curve2& curve, const ParameterMap& map, const Eigen::Vector2d& tolerance) {
  if (map.swapped)
    return carried(Curve2(curve.knots(), curve.points().colwise().reverse(), curve.weights()), {map.u, map.v, false},
                   tolerance);
  const Curve2::Points& points = curve.points();
  const auto constant = [&](int k) { return (points.row(k).array() == points(k, 0)).all(); };
  const std::array<const AxisMap*, 2> axes{&map.u, &map.v};
  // Rows on which the map is affine for this curve; a constant row takes any map.
  std::array<bool, 2> plain{};
  for (int k = 0; k < 2; ++k)
    plain[static_cast<std::size_t>(k)] = axes[static_cast<std::size_t>(k)]->affine() || constant(k);
  if (plain[0] && plain[1]) {
    Curve2::Points image = points;
    for (int k = 0; k < 2; ++k)
      image.row(k) = points.row(k).unaryExpr([&](double x) { return (*axes[static_cast<std::size_t>(k)])(x); });
    return {Curve2(curve.knots(), std::move(image), curve.weights()), 0};
  }
  // Along a line of constant u or v only the parameter changes; the points are those of a segment.
  for (int k = 0; k < 2; ++k) {
    if (!constant(k)) continue;
    bool rising = true, falling = true;
    for (Eigen::Index i = 0; i + 1 < points.cols(); ++i) {
      rising = rising && points(1 - k, i) <= points(1 - k, i + 1);
      falling = falling && points(1 - k, i) >= points(1 - k, i + 1);
    }
    if (rising || falling)
      return {with_domain(line_segment<2>(map(curve.start()), map(curve.end())), curve.domain()), 0};
  }
  std::vector<SmoothPath<2>> path;
  for (const int span : curve.knots().spans())
    path.push_back({{curve.knots()[span], curve.knots()[span + 1]}, [&curve, &map, span](double t) {
                      const CurveJet<2> jet = evaluate_on_span(curve, span, t);
                      return PathPoint<2>{
                          map(jet.x),
                          {jet.d1.x() * map.u.derivative(jet.x.x()), jet.d1.y() * map.v.derivative(jet.x.y())}};
                    }});
  CubicFitOptions<2> options;
  options.tolerance = 1;
  options.max_halvings = 12;
  options.distance = [&](double, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return (a - b).cwiseQuotient(tolerance).norm();
  };
  CubicFit<2> fit = fit_cubic<2>(path, options);
  return {std::move(fit.curve), fit.error * tolerance.maxCoeff()};
}

}  // namespace toile::iges
