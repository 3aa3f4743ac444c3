// SPDX-License-Identifier: GPL-3.0-or-later
// The page of `toile inspect --html`: one file, nothing loaded from elsewhere.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "pipeline/inspect/inspect.h"
#include "pipeline/picture/svg.h"

namespace toile {
namespace {

constexpr std::string_view page_style =
    "body{font:14px/1.5 'DejaVu Sans',Helvetica,sans-serif;color:#26313f;margin:24px;max-width:1600px}\n"
    "h1{font-size:20px}h2{font-size:16px;margin-top:28px}\n"
    "table{border-collapse:collapse}th,td{padding:3px 12px;text-align:right;border-bottom:1px solid #dfe5ea}\n"
    "th:first-child,td:first-child{text-align:left}th{color:#7c8896;font-weight:normal}\n"
    ".warnings li{color:#b04600}svg{max-width:100%;height:auto;border:1px solid #dfe5ea}\n"
    ".quiet{color:#7c8896}summary{cursor:pointer}\n";

std::string row(std::initializer_list<std::string> cells, const char* tag = "td") {
  std::string out = "<tr>";
  for (const std::string& text : cells) out += fmt::format("<{0}>{1}</{0}>", tag, text);
  return out + "</tr>\n";
}

std::string curve_table(const InspectedPanel& panel) {
  std::string out = "<table>\n" + row({"curve", "degree", "control points", "from (u, v)", "to (u, v)"}, "th");
  for (const TrimLoop& loop : panel.face.loops) {
    for (const TrimCurve& trim : loop.curves) {
      const auto place = [](const Eigen::Vector2d& p) { return fmt::format("{:.6g}, {:.6g}", p.x(), p.y()); };
      out += row({fmt::format("curve:{},{}", loop.index, trim.index),
                  fmt::format("{}{}", trim.curve.degree(), trim.curve.rational() ? ", rational" : ""),
                  std::to_string(trim.curve.points().cols()), place(trim.curve.start()), place(trim.curve.end())});
    }
  }
  return out + "</table>\n";
}

}  // namespace

std::string inspect_html(const Inspection& inspection) {
  const std::string title = svg_escape(inspection.file);
  std::string out = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta "
      "charset=\"utf-8\"><title>{0}</title>\n<style>\n{1}</style></head>\n"
      "<body>\n<h1>{0}</h1>\n<p class=\"quiet\">{2}{3}</p>\n",
      title, page_style, svg_escape(inspection.unit),
      inspection.exporter.empty() ? "" : ", written by " + svg_escape(inspection.exporter));
  out +=
      "<table>\n" +
      row({"panel", "area m²", "perimeter m", "degree", "net", "cells in / cut / out", "loops", "points used"}, "th");
  const nlohmann::ordered_json json = inspect_json(inspection);
  for (std::size_t k = 0; k < inspection.panels.size(); ++k) {
    const InspectedPanel& panel = inspection.panels[k];
    const auto& p = json["panels"][k];
    out += row(
        {svg_escape(panel.face.name), fmt::format("{:.6g}", p["area"].get<double>()),
         fmt::format("{:.6g}", p["perimeter"].get<double>()),
         fmt::format("{} × {}", panel.face.surface.u().degree(), panel.face.surface.v().degree()),
         fmt::format("{} × {}", panel.face.surface.count_u(), panel.face.surface.count_v()),
         fmt::format("{} / {} / {}", p["cells"]["inside"].get<int>(), p["cells"]["cut"].get<int>(),
                     p["cells"]["outside"].get<int>()),
         std::to_string(panel.face.loops.size()),
         fmt::format("{} of {}", std::ranges::count(panel.points, true, &ConstraintPoint::used), panel.points.size())});
  }
  out += "</table>\n";
  if (!inspection.warnings.empty() || !inspection.refused.empty()) {
    out += "<h2>Warnings</h2>\n<ul class=\"warnings\">\n";
    for (const std::string& warning : inspection.warnings) out += "<li>" + svg_escape(warning) + "</li>\n";
    for (const std::string& panel : inspection.refused) out += "<li>refused: " + svg_escape(panel) + "</li>\n";
    out += "</ul>\n";
  }
  if (!inspection.ledger.empty()) {
    out += "<h2>Entities</h2>\n<pre>" + svg_escape(ledger_text(inspection.ledger)) + "</pre>\n";
  }
  out += "<h2>Panels</h2>\n" + inspect_svg(inspection);
  out += "<h2>Curves</h2>\n";
  for (const InspectedPanel& panel : inspection.panels) {
    out += "<details><summary>" + svg_escape(panel.face.name) + "</summary>\n" + curve_table(panel) + "</details>\n";
  }
  return out + "</body></html>\n";
}

}  // namespace toile
