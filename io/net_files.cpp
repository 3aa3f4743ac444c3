// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/net_files.h"

#include <nlohmann/json.hpp>
#include <span>

#include "geometry/text.h"
#include "io/csv.h"

namespace toile {

namespace {

using Json = nlohmann::ordered_json;

Json numbers(std::span<const double> values) {
  return Json(std::vector<double>(values.begin(), values.end()));
}

Json curve_json(const TrimCurve& trim) {
  const Curve2& curve = trim.curve;
  Json points = Json::array();
  for (Eigen::Index i = 0; i < curve.points().cols(); ++i)
    points.push_back({curve.points()(0, i), curve.points()(1, i)});
  Json out = {{"degree", curve.degree()}, {"knots", numbers(curve.knots().knots())}, {"points", points}};
  if (curve.rational()) out["weights"] = numbers(curve.weights());
  out["reversed"] = trim.reversed;
  return out;
}

Json panel_json(const FramePanel& panel) {
  const NurbsSurface& s = *panel.surface;
  Json points = Json::array(), weights = Json::array();
  for (int i = 0; i < s.count_u(); ++i) {
    Json column = Json::array(), of_column = Json::array();
    for (int j = 0; j < s.count_v(); ++j) {
      const auto x = s.points().col(s.index(i, j));
      column.push_back({x[0], x[1], x[2]});
      of_column.push_back(s.weight(s.index(i, j)));
    }
    points.push_back(std::move(column));
    weights.push_back(std::move(of_column));
  }
  Json out = {{"name", panel.name},
              {"degree", {s.u().degree(), s.v().degree()}},
              {"control_points", {s.count_u(), s.count_v()}},
              {"knots", {numbers(s.u().knots()), numbers(s.v().knots())}},
              {"points", std::move(points)}};
  if (s.rational()) out["weights"] = std::move(weights);
  out["loops"] = Json::array();
  for (const TrimLoop& loop : panel.face->loops) {
    Json curves = Json::array();
    for (const TrimCurve& trim : loop.curves) curves.push_back(curve_json(trim));
    out["loops"].push_back({{"kind", loop.kind == LoopKind::outer ? "outer" : "hole"}, {"curves", std::move(curves)}});
  }
  return out;
}

}  // namespace

std::string format_net_json(const Frame& frame) {
  Json out = {{"unit", "m"}, {"time", frame.time}, {"panels", Json::array()}};
  for (const FramePanel& panel : frame.panels) out["panels"].push_back(panel_json(panel));
  return out.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string format_net_csv(const Frame& frame) {
  std::string out = csv_row({"panel", "i", "j", "x", "y", "z", "weight", "cloth"});
  for (const FramePanel& panel : frame.panels) {
    const NurbsSurface& s = *panel.surface;
    for (int i = 0; i < s.count_u(); ++i)
      for (int j = 0; j < s.count_v(); ++j) {
        const int c = s.index(i, j);
        const auto x = s.points().col(c);
        const bool known = !panel.carries_cloth.empty();
        out +=
            csv_row({panel.name, std::to_string(i), std::to_string(j), text(x[0]), text(x[1]), text(x[2]),
                     text(s.weight(c)), known ? (panel.carries_cloth[static_cast<std::size_t>(c)] ? "1" : "0") : ""});
      }
  }
  return out;
}

}  // namespace toile
