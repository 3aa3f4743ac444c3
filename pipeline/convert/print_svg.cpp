// SPDX-License-Identifier: GPL-3.0-or-later
// Panels for the printer: one unit is a millimetre.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "geometry/error.h"
#include "io/iges/model_curve.h"
#include "io/pattern_sheet.h"
#include "pipeline/convert/convert.h"
#include "pipeline/picture/svg.h"

namespace toile {
namespace {

using Eigen::Vector2d;

// Where numbers are rounded, and how near the cubics must be that stand for other curves [mm].
constexpr double precision = 1e-4, curve_tolerance = 1e-3;

std::string number(double value) {
  const double rounded = std::round(value / precision) * precision;
  std::string text = fmt::format("{:.4f}", rounded == 0 ? 0.0 : rounded);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}
std::string point(const Vector2d& p) {
  return number(p.x()) + " " + number(p.y());
}

// Cubics through position and derivative at both ends of [a, b], halved until they follow the curve.
void append_cubics(std::string& path, const Curve2& curve, double a, double b, int depth) {
  const CurveJet<2> from = evaluate_on_span(curve, curve.knots().find_span((a + b) / 2), a);
  const CurveJet<2> to = evaluate_on_span(curve, curve.knots().find_span((a + b) / 2), b);
  const Vector2d c1 = from.x + (b - a) / 3 * from.d1, c2 = to.x - (b - a) / 3 * to.d1;
  double error = 0;
  for (const double s : {0.25, 0.5, 0.75}) {
    const double r = 1 - s;
    const Vector2d x = r * r * r * from.x + 3 * r * r * s * c1 + 3 * r * s * s * c2 + s * s * s * to.x;
    error = std::max(error, (x - curve(a + s * (b - a))).norm());
  }
  if (error > curve_tolerance && depth > 0) {
    append_cubics(path, curve, a, (a + b) / 2, depth - 1);
    append_cubics(path, curve, (a + b) / 2, b, depth - 1);
    return;
  }
  path += std::string("C") + point(c1) + " " + point(c2) + " " + point(to.x);
}

// A curve on the paper from its start, which the pen has reached.
void append_curve(std::string& path, const Curve2& curve) {
  const int degree = curve.degree();
  for (const BezierCurve<2>& piece : bezier_pieces(curve)) {
    if (curve.rational() || degree > 3 || degree < 1) {
      append_cubics(path, curve, piece.range.min, piece.range.max, 12);
      continue;
    }
    path += degree == 1 ? "L" : degree == 2 ? "Q" : "C";
    for (int k = 1; k <= degree; ++k) {
      if (k > 1) path += ' ';
      path += point(piece.points.col(k));
    }
  }
}

struct Sheet {
  const TrimmedSurface* face;
  DrawingPlane plane;
  std::optional<AffinePatch> patch;
  double mm = 1;  // millimetres per unit of the net
  Vector2d origin{0, 0};

  // A parameter curve on the paper, y downwards.
  Curve2 operator()(const Curve2& curve) const {
    const Curve3 model = iges::fit_model_curve(face->surface, curve, 0.1 * curve_tolerance / mm, patch).curve;
    Curve2::Points points(2, model.points().cols());
    for (Eigen::Index k = 0; k < points.cols(); ++k) points.col(k) = place(model.points().col(k));
    return Curve2(model.knots(), std::move(points), model.weights());
  }
  Vector2d operator()(const Vector2d& uv) const { return place(face->surface(uv.x(), uv.y())); }

 private:
  Vector2d place(const Eigen::Vector3d& x) const {
    const Vector2d p = mm * plane(x);
    return origin + Vector2d(p.x(), -p.y());
  }
};

std::string outline(const Sheet& sheet, const TrimLoop& loop) {
  std::string path;
  for (const TrimCurve& trim : loop.curves) {
    const Curve2 curve = sheet(trim.reversed ? reversed(trim.curve) : trim.curve);
    if (path.empty()) {
      path += 'M';
      path += point(curve.start());
    }
    append_curve(path, curve);
  }
  return path + "Z";
}

std::string line_path(const Vector2d& a, const Vector2d& b) {
  return std::string("M") + point(a) + "L" + point(b);
}

class Paper {
 public:
  void path(const std::string& data, const char* style) {
    body_ += fmt::format("<path class=\"{}\" d=\"{}\"/>\n", style, data);
  }
  void text(const Vector2d& at, double size, const std::string& words, const char* anchor = "start") {
    if (words.empty()) return;
    body_ += fmt::format("<text x=\"{}\" y=\"{}\" font-size=\"{}\" text-anchor=\"{}\">{}</text>\n", number(at.x()),
                         number(at.y()), number(size), anchor, svg_escape(words));
  }
  void arrow(const Vector2d& from, const Vector2d& to) {
    const Vector2d d = (to - from).normalized(), side(-d.y(), d.x());
    path(line_path(from, to), "mark");
    for (const auto& [tip, way] : {std::pair<Vector2d, Vector2d>{to, d}, {from, Vector2d(-d)}})
      path(std::string("M") + point(tip) + "L" + point(tip - 6 * way + 2 * side) + "L" +
               point(tip - 6 * way - 2 * side) + "Z",
           "solid");
  }
  void open(const std::string& name) { body_ += "<g><title>" + svg_escape(name) + "</title>\n"; }
  void close() { body_ += "</g>\n"; }
  std::string finish(const Vector2d& size, const std::string& title) const {
    const std::string w = number(size.x()), h = number(size.y());
    return fmt::format(
               "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}mm\" height=\"{1}mm\" viewBox=\"0 0 {0} {1}\">\n"
               "<title>{2}</title>\n<style>",
               w, h, svg_escape(title)) +
           "path{fill:none;stroke:#000;stroke-width:.4;stroke-linejoin:round}.mark{stroke-width:.25}"
           ".inner{stroke-width:.25;stroke-dasharray:3 1.5}.solid{fill:#000;stroke:none}"
           "text{font-family:'DejaVu Sans',Helvetica,sans-serif}</style>\n" +
           body_ + "</svg>\n";
  }

 private:
  std::string body_;
};

void draw_marks(Paper& paper, const Sheet& sheet) {
  for (const PanelMark& mark : sheet.face->marks) {
    const Vector2d at = sheet(mark.at);
    switch (mark.kind) {
      case MarkKind::grain:
        if (mark.curve) paper.arrow(sheet(mark.curve->start()), sheet(mark.curve->end()));
        break;
      case MarkKind::line:
      case MarkKind::sew:
      case MarkKind::slit:
      case MarkKind::notch: {
        if (mark.curve) {
          const Curve2 curve = sheet(*mark.curve);
          std::string path = std::string("M") + point(curve.start());
          append_curve(path, curve);
          paper.path(path, mark.kind == MarkKind::notch ? "mark" : "inner");
        } else {
          paper.path(line_path(at - Vector2d(2.5, 0), at + Vector2d(2.5, 0)), "mark");
        }
        break;
      }
      case MarkKind::drill:
        paper.path(line_path(at - Vector2d(3, 0), at + Vector2d(3, 0)), "mark");
        paper.path(line_path(at - Vector2d(0, 3), at + Vector2d(0, 3)), "mark");
        break;
      case MarkKind::text:
        paper.text(at, 4, mark.text);
        break;
    }
  }
}

// A bar of 100 mm, to check the printer with.
void draw_scale(Paper& paper, const Vector2d& at) {
  paper.path(line_path(at, at + Vector2d(100, 0)), "mark");
  for (int k = 0; k <= 10; ++k) {
    const double tick = k % 5 == 0 ? 4 : 2;
    paper.path(line_path(at + Vector2d(10 * k, 0), at + Vector2d(10 * k, -tick)), "mark");
  }
  paper.text(at + Vector2d(104, 0), 4, "100 mm");
}

}  // namespace

std::string print_svg(const PanelFile& file) {
  constexpr double margin = 20, head = 12, row_width = 1500;
  Paper paper;
  Vector2d at(margin, margin + head), page(2 * margin + 130, 0);
  double row = 0;
  for (std::size_t k = 0; k < file.panels.size(); ++k) {
    const TrimmedSurface& face = file.panels[k];
    const std::string name = face.name.empty() ? fmt::format("panel_{}", k + 1) : face.name;
    const std::optional<DrawingPlane> plane = drawing_plane(face.surface);
    if (!plane) {
      throw GeometryError(
          fmt::format("{}: panel '{}' is not flat: it can't be printed at its true size", face.source, name));
    }
    const double size =
        (face.surface.points().rowwise().maxCoeff() - face.surface.points().rowwise().minCoeff()).norm();
    Sheet sheet{&face, *plane, affine_patch(face.surface, 1e-9 * size), 1000 * face.metres_per_unit};
    Vector2d low = Vector2d::Constant(1e300), high = -low;
    for (const TrimLoop& loop : face.loops) {
      for (const TrimCurve& trim : loop.curves) {
        const Curve2::Points points = sheet(trim.curve).points();
        low = low.cwiseMin(points.rowwise().minCoeff()), high = high.cwiseMax(points.rowwise().maxCoeff());
      }
    }
    if (at.x() > margin && at.x() + (high - low).x() + margin > row_width) {
      at = {margin, at.y() + row + margin + head};
      row = 0;
    }
    sheet.origin = at - low;
    paper.open(name);
    paper.text(at + Vector2d(0, -4), 6, name);
    for (const TrimLoop& loop : face.loops) paper.path(outline(sheet, loop), "outline");
    draw_marks(paper, sheet);
    paper.close();
    at.x() += (high - low).x() + margin;
    row = std::max(row, (high - low).y());
    page.x() = std::max(page.x(), at.x());
  }
  page.y() = at.y() + row + margin + head;
  draw_scale(paper, {margin, page.y() - margin / 2});
  return paper.finish(page, file.path);
}

}  // namespace toile
