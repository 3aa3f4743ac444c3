// SPDX-License-Identifier: GPL-3.0-or-later
// The drawing of `toile inspect --svg`.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "io/pattern_sheet.h"
#include "io/polyline.h"
#include "pipeline/inspect/inspect.h"
#include "pipeline/picture/svg.h"

namespace toile {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Points = std::vector<Vector2d>;

constexpr std::string_view style_sheet =
    "text{font-family:'DejaVu Sans','Helvetica',sans-serif;fill:#26313f}\n"
    ".halo{paint-order:stroke;stroke:#ffffff;stroke-width:2.6px;stroke-linejoin:round}\n"
    ".quiet{fill:#7c8896}\n.faint{fill:#b3bcc6}\n.bold{font-weight:bold}\n"
    ".away{fill:#ffffff;fill-opacity:.72;fill-rule:evenodd}\n"
    ".inside{fill:#dcefe6}\n.cut{fill:#fbe8bf}\n.outside{fill:#dfe5ea}\n"
    ".knot{fill:none;stroke:#9fabb8;stroke-width:.7}\n.border{fill:none;stroke:#7c8896;stroke-width:1;"
    "stroke-dasharray:5 3}\n"
    ".outer{fill:none;stroke:#1d2b4f;stroke-width:2;stroke-linejoin:round;stroke-linecap:round}\n"
    ".hole{fill:none;stroke:#8c2a5b;stroke-width:2;stroke-linejoin:round;stroke-linecap:round}\n"
    ".outer-head{fill:#1d2b4f}\n.hole-head{fill:#8c2a5b}\n"
    ".outer-label{fill:#1d2b4f;font-weight:bold}\n.hole-label{fill:#8c2a5b;font-weight:bold}\n"
    ".end{fill:#ffffff;stroke:#1d2b4f;stroke-width:1.2}\n"
    ".u{fill:#c0392b;stroke:#c0392b;stroke-width:1.6}\n.v{fill:#1e8449;stroke:#1e8449;stroke-width:1.6}\n"
    ".u-label{fill:#c0392b;font-style:italic;font-weight:bold}\n"
    ".v-label{fill:#1e8449;font-style:italic;font-weight:bold}\n"
    ".grain{fill:#5b6775;stroke:#5b6775;stroke-width:1.4}\n"
    ".mark{fill:none;stroke:#8e5a1d;stroke-width:1.1}\n.mark-text{fill:#8e5a1d}\n"
    ".warning{fill:#d35400;stroke:#ffffff;stroke-width:.8}\n.warning-text{fill:#b04600}\n";

struct Marker {
  const char* colour;
  int corners;  // 0: circle
  double turn;  // of the first corner [rad], 0 is up
  const char* words;
};
const Marker& marker(PointKind kind) {
  constexpr double pi = 3.14159265358979;
  static const std::array<Marker, 7> markers{{{"#2166ac", 0, 0, "vertex: knot vertex in the material"},
                                              {"#c0392b", 4, 0, "crossing_u: trim meets u = const"},
                                              {"#1e8449", 4, pi / 4, "crossing_v: trim meets v = const"},
                                              {"#c0392b", 3, 0, "tangent_u: trim touches u = const"},
                                              {"#1e8449", 3, pi, "tangent_v: trim touches v = const"},
                                              {"#6c3483", 6, 0, "crossing_uv: trim through a knot vertex"},
                                              {"#c77700", 5, 0, "corner: the trim turns"}}};
  return markers[static_cast<std::size_t>(kind)];
}

void draw_marker(Svg& svg, const Vector2d& at, PointKind kind, bool used, double radius) {
  const Marker& m = marker(kind);
  const std::string style =
      used ? fmt::format("fill=\"{}\" stroke=\"#ffffff\" stroke-width=\"{}\"", m.colour, svg_number(0.22 * radius))
           : fmt::format("fill=\"#ffffff\" stroke=\"{}\" stroke-width=\"{}\"", m.colour, svg_number(0.32 * radius));
  if (m.corners == 0) {
    svg.circle(at, 0.88 * radius, style);
    return;
  }
  Points polygon;
  for (int k = 0; k < m.corners; ++k) {
    const double angle = m.turn + 2 * 3.14159265358979 * k / m.corners;
    polygon.push_back(at + 1.1 * radius * Vector2d(std::sin(angle), -std::cos(angle)));
  }
  svg.path(svg_path(polygon, true), style);
}

// ---- from the panel to the paper ----

struct Drawn {
  const InspectedPanel* panel;
  std::string title, facts;  // the lines above it
  PatternSheet sheet;
  Vector2d low, high;     // of the whole domain on the sheet [m]
  double scale = 1;       // pixels per metre
  Vector2d origin{0, 0};  // pixel of `low`
  Vector2d on_sheet(const Vector2d& uv) const { return face().metres_per_unit * sheet(uv); }
  Vector2d operator()(const Vector2d& uv) const {
    const Vector2d x = scale * (on_sheet(uv) - low);
    return {origin.x() + x.x(), origin.y() - x.y()};
  }
  const TrimmedSurface& face() const { return panel->face; }
};

// An iso-line as points on the paper, fine where knots are dense.
Points iso_line(const Drawn& at, Direction fixed, double value, double from, double to) {
  constexpr int pieces = 8;
  Points out;
  for (int k = 0; k <= pieces; ++k) {
    const double t = from + (to - from) * k / pieces;
    out.push_back(at(fixed == Direction::u ? Vector2d(value, t) : Vector2d(t, value)));
  }
  return out;
}

double length(const Points& line) {
  double sum = 0;
  for (std::size_t k = 1; k < line.size(); ++k) sum += (line[k] - line[k - 1]).norm();
  return sum;
}

// Place and direction at a fraction of a polyline's length.
std::pair<Vector2d, Vector2d> along(const Points& line, double fraction) {
  double left = fraction * length(line);
  for (std::size_t k = 1; k < line.size(); ++k) {
    const Vector2d d = line[k] - line[k - 1];
    if (d.norm() >= left && d.norm() > 0) return {line[k - 1] + left / d.norm() * d, d.normalized()};
    left -= d.norm();
  }
  return {line.back(), Vector2d(1, 0)};
}

Points simplified(const Points& line) {
  Points out;
  for (const Vector2d& p : line) {
    if (!out.empty() && (p - out.back()).norm() < 0.02) continue;
    // A point on the line through its neighbours says nothing.
    if (out.size() >= 2) {
      const Vector2d a = out.back() - out[out.size() - 2], b = p - out.back();
      if (std::abs(a.x() * b.y() - a.y() * b.x()) < 1e-3 * a.norm() * b.norm() && a.dot(b) > 0) out.pop_back();
    }
    out.push_back(p);
  }
  return out;
}

Points trim_line(const Drawn& at, const TrimCurve& curve) {
  Points line;
  for (const double t : polyline_parameters(at.face().surface, curve)) line.push_back(at(curve.curve(t)));
  return line;
}

void draw_cells(Svg& svg, const Drawn& at) {
  const KnotMesh& mesh = at.panel->topology.mesh;
  for (const auto& [kind, style] :
       {std::pair{CellKind::outside, "outside"}, {CellKind::inside, "inside"}, {CellKind::cut, "cut"}}) {
    std::string data;
    for (int j = 0; j < mesh.cells_v(); ++j) {
      for (int i = 0; i < mesh.cells_u(); ++i) {
        if (at.panel->topology.cells[static_cast<std::size_t>(mesh.cell(i, j))] != kind) continue;
        const double u0 = mesh.u[static_cast<std::size_t>(i)], u1 = mesh.u[static_cast<std::size_t>(i) + 1];
        const double v0 = mesh.v[static_cast<std::size_t>(j)], v1 = mesh.v[static_cast<std::size_t>(j) + 1];
        Points border = iso_line(at, Direction::v, v0, u0, u1);
        for (const Points& side : {iso_line(at, Direction::u, u1, v0, v1), iso_line(at, Direction::v, v1, u1, u0),
                                   iso_line(at, Direction::u, u0, v1, v0)}) {
          border.insert(border.end(), side.begin(), side.end());
        }
        data += svg_path(simplified(border), true);
      }
    }
    if (!data.empty()) svg.path(data, style);
  }
  // What the trims cut away is pale.
  Points border;
  for (const Points& side : {iso_line(at, Direction::v, mesh.v.front(), mesh.u.front(), mesh.u.back()),
                             iso_line(at, Direction::u, mesh.u.back(), mesh.v.front(), mesh.v.back()),
                             iso_line(at, Direction::v, mesh.v.back(), mesh.u.back(), mesh.u.front()),
                             iso_line(at, Direction::u, mesh.u.front(), mesh.v.back(), mesh.v.front())}) {
    border.insert(border.end(), side.begin(), side.end());
  }
  std::string away = svg_path(border, true);
  for (const TrimLoop& loop : at.face().loops) {
    Points outline;
    for (const TrimCurve& curve : loop.curves) {
      const Points line = trim_line(at, curve);
      outline.insert(outline.end(), line.begin(), line.end());
    }
    away += svg_path(simplified(outline), true);
  }
  svg.path(away, "away");
  std::string lines;
  for (const double u : mesh.u) {
    Points line;
    for (std::size_t j = 0; j + 1 < mesh.v.size(); ++j) {
      const Points piece = iso_line(at, Direction::u, u, mesh.v[j], mesh.v[j + 1]);
      line.insert(line.end(), piece.begin(), piece.end());
    }
    lines += svg_path(simplified(line), false);
  }
  for (const double v : mesh.v) {
    Points line;
    for (std::size_t i = 0; i + 1 < mesh.u.size(); ++i) {
      const Points piece = iso_line(at, Direction::v, v, mesh.u[i], mesh.u[i + 1]);
      line.insert(line.end(), piece.begin(), piece.end());
    }
    lines += svg_path(simplified(line), false);
  }
  svg.path(lines, "knot");
}

// Width that a line of text takes, on the safe side: fonts differ.
double text_room(std::string_view words, double size) {
  double room = 0;
  for (const char c : words) {
    const auto byte = static_cast<unsigned char>(c);
    // A letter beyond ASCII, counted at its first byte, may be as wide as it is high.
    if ((byte & 0xc0) != 0x80) room += (byte < 0x80 ? 0.62 : 1.05) * size;
  }
  return room;
}

// Where text stands already, so that other text keeps clear of it.
class TakenRoom {
 public:
  using Box = Eigen::AlignedBox2d;
  static Box box_of(const Vector2d& at, double size, std::string_view words, TextAnchor anchor = TextAnchor::middle) {
    const double width = text_room(words, size);
    const double left = anchor == TextAnchor::start ? 0 : anchor == TextAnchor::middle ? width / 2 : width;
    const Vector2d low(at.x() - left, at.y() - 0.8 * size);
    return {low, low + Vector2d(width, size)};
  }
  bool free(const Box& box) const {
    return std::ranges::none_of(boxes_, [&](const Box& other) { return other.intersects(box); });
  }
  void take(const Box& box) { boxes_.push_back(box); }

 private:
  std::vector<Box> boxes_;
};

// Right of the direction of travel on paper is away from the material.
Vector2d outwards(const Vector2d& direction) {
  return {-direction.y(), direction.x()};
}

// The fraction of the line whose place is furthest from what is drawn already; the first of equals.
double free_place(const Points& line, const Points& taken, std::initializer_list<double> fractions) {
  double best = 0.5, clearance = -1;
  for (const double fraction : fractions) {
    const Vector2d place = along(line, fraction).first;
    double nearest = 1e300;
    for (const Vector2d& other : taken) nearest = std::min(nearest, (other - place).norm());
    constexpr double enough = 14;  // pixels
    if (std::min(nearest, enough) > 1.001 * clearance) best = fraction, clearance = std::min(nearest, enough);
  }
  return best;
}

void draw_trims(Svg& svg, const Drawn& at, TakenRoom& room) {
  struct Label {
    Vector2d place;
    double size;
    std::string words, style;
  };
  std::vector<Label> labels;
  Points ends, marks;
  for (const ConstraintPoint& point : at.panel->points) marks.push_back(at({point.u, point.v}));
  for (const TrimLoop& loop : at.face().loops) {
    const std::string kind = loop.kind == LoopKind::outer ? "outer" : "hole";
    for (const TrimCurve& curve : loop.curves) {
      const Points line = trim_line(at, curve);
      svg.path(svg_path(simplified(line), false), kind);
      ends.push_back(line.front());
      const double size = std::clamp(length(line) / 3, 5.0, 11.0);
      const auto [middle, direction] = along(line, free_place(line, marks, {0.5, 0.45, 0.55, 0.4, 0.6, 0.35, 0.65}));
      if (length(line) > 9) svg.arrow_head(middle + 0.45 * size * direction, direction, 0.9 * size, kind + "-head");
      std::vector<Vector2d> taken = marks;
      taken.push_back(middle);
      const std::string words = fmt::format("{},{}", loop.index, curve.index);
      const auto beside = [&](double fraction, double distance) -> Vector2d {
        const auto [place, way] = along(line, fraction);
        const Vector2d out = outwards(way);
        return place + distance * (0.75 + 0.45 * std::abs(out.x())) * size * out + Vector2d(0, 0.36 * size);
      };
      // Beside the curve where there is room, else along it, else farther off.
      const double first = free_place(line, taken, {0.5, 0.44, 0.56, 0.38, 0.62});
      Vector2d place = beside(first, 1);
      bool found = false;
      for (const double distance : {1.0, 1.8, 2.6}) {
        for (const double fraction : {first, 0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8}) {
          const Vector2d here = beside(fraction, distance);
          if (found || !room.free(TakenRoom::box_of(here, size, words))) continue;
          place = here, found = true;
        }
      }
      room.take(TakenRoom::box_of(place, size, words));
      labels.push_back({place, size, words, kind + "-label halo"});
    }
  }
  for (const Vector2d& end : ends) svg.circle(end, 2.1, "end");
  for (const Label& label : labels) svg.text(label.place, label.size, label.words, label.style);
}

void draw_points(Svg& svg, const Drawn& at) {
  const KnotMesh& mesh = at.panel->topology.mesh;
  // Marks shrink with the cells, so that they never hide the mesh.
  const double cell =
      std::min((at.high - at.low).x() / mesh.cells_u(), (at.high - at.low).y() / mesh.cells_v()) * at.scale;
  const double radius = std::clamp(cell / 7, 1.3, 4.2);
  for (const bool used : {false, true}) {
    for (const ConstraintPoint& point : at.panel->points) {
      if (point.used == used) draw_marker(svg, at({point.u, point.v}), point.kind, used, radius);
    }
  }
}

void draw_arrow(Svg& svg, const Vector2d& from, const Vector2d& to, const std::string& style) {
  svg.line(from, to, style);
  svg.arrow_head(to, to - from, 8, style);
}

// Corners and edges as a scene addresses them; grey where the trim has taken them away.
void draw_addresses(Svg& svg, const Drawn& at, TakenRoom& room) {
  const NurbsSurface& surface = at.face().surface;
  const Interval u = surface.u().domain(), v = surface.v().domain();
  const Vector2d middle = at({(u.min + u.max) / 2, (v.min + v.max) / 2});
  for (int b = 0; b < 2; ++b) {
    for (int a = 0; a < 2; ++a) {
      const Vector2d uv(a ? u.max : u.min, b ? v.max : v.min), corner = at(uv);
      const Vector2d away((corner - middle).x() < 0 ? -1 : 1, (corner - middle).y() < 0 ? -1 : 1);
      const bool there = contains(at.face(), at.panel->topology, uv);
      const std::string words = fmt::format("corner:{},{}", a, b);
      // Inwards from the corner; on a narrow panel outwards, so that left and right keep apart.
      const bool narrow = at.scale * (at.high - at.low).x() < 2.3 * text_room(words, 10);
      const TextAnchor anchor = (away.x() < 0) != narrow ? TextAnchor::start : TextAnchor::end;
      const Vector2d place = corner + Vector2d(0, away.y() > 0 ? 38 : -30);
      svg.text(place, 10, words, there ? "" : "faint", anchor);
      room.take(TakenRoom::box_of(place, 10, words, anchor));
    }
  }
  // Axes stand a little off the corner of the smallest parameters.
  const Vector2d origin = at({u.min, v.min});
  const Vector2d du = (at({u.min + 0.2 * u.length(), v.min}) - origin).normalized();
  const Vector2d dv = (at({u.min, v.min + 0.2 * v.length()}) - origin).normalized();
  const Vector2d foot = origin - 17 * du - 17 * dv;
  draw_arrow(svg, foot, foot + 46 * du, "u");
  draw_arrow(svg, foot, foot + 46 * dv, "v");
  for (const Vector2d& axis : {du, dv}) {
    TakenRoom::Box box(foot);
    room.take({box.extend(Vector2d(foot + 62 * axis)).min() - Vector2d(5, 5), box.max() + Vector2d(5, 5)});
  }
  svg.circle(foot, 2, "grain");
  svg.text(foot + 56 * du + Vector2d(0, 4), 12, "u", "u-label halo");
  svg.text(foot + 56 * dv + Vector2d(0, 4), 12, "v", "v-label halo");
}

// The grain, drawn in a cell of the material near its middle: warp long, weft short.
void draw_grain(Svg& svg, const Drawn& at, TakenRoom& room) {
  const KnotMesh& mesh = at.panel->topology.mesh;
  Vector2d mean(0, 0), best(0, 0);
  int count = 0;
  const auto cells = [&](const auto& visit) {
    for (int j = 0; j < mesh.cells_v(); ++j) {
      for (int i = 0; i < mesh.cells_u(); ++i) {
        if (at.panel->topology.cells[static_cast<std::size_t>(mesh.cell(i, j))] == CellKind::outside) continue;
        visit(Vector2d((mesh.u[static_cast<std::size_t>(i)] + mesh.u[static_cast<std::size_t>(i) + 1]) / 2,
                       (mesh.v[static_cast<std::size_t>(j)] + mesh.v[static_cast<std::size_t>(j) + 1]) / 2));
      }
    }
  };
  cells([&](const Vector2d& uv) { mean += at(uv), ++count; });
  if (count == 0) return;
  mean /= count;
  const double reach = std::clamp(0.10 * (at.high - at.low).minCoeff() * at.scale, 26.0, 60.0);
  // Clear of the trims first, near the middle second.
  double highest = -1e300;
  cells([&](const Vector2d& uv) {
    if (!contains(at.face(), at.panel->topology, uv)) return;
    double clearance = 1.4 * reach;
    for (const TrimEvent& event : at.panel->topology.events) {
      clearance = std::min(clearance, (at(event.uv) - at(uv)).norm());
    }
    const double score = clearance - 0.1 * (at(uv) - mean).norm();
    if (score > highest) highest = score, best = uv;
  });
  if (highest == -1e300) return;
  const Interval u = at.face().surface.u().domain(), v = at.face().surface.v().domain();
  const Vector2d centre = at(best);
  const Vector2d along_u = (at(best + Vector2d(1e-4 * u.length(), 0)) - centre).stableNormalized();
  // The drawing's y runs down, so that a turn from u towards v is a turn to the left on it.
  const double turn = grain_angle(at.face()).value_or(0);
  const Vector2d weft = std::cos(turn) * along_u + std::sin(turn) * Vector2d(along_u.y(), -along_u.x());
  // Warp is at right angles to weft in the cloth, on the side of v.
  Vector2d warp(-weft.y(), weft.x());
  if (warp.dot(at(best + Vector2d(0, 1e-4 * v.length())) - centre) < 0) warp = -warp;
  draw_arrow(svg, centre - reach * warp, centre + reach * warp, "grain");
  svg.arrow_head(centre - reach * warp, -warp, 8, "grain");
  svg.line(centre - 0.35 * reach * weft, centre + 0.35 * reach * weft, "grain");
  // The arrows speak for themselves where their names find no room.
  for (const auto& [words, place] : {std::pair{"warp", Vector2d(centre + (reach + 12) * warp + Vector2d(0, 4))},
                                     {"weft", centre + (0.35 * reach + 17) * weft + Vector2d(0, 4)}}) {
    if (!room.free(TakenRoom::box_of(place, 10, words))) continue;
    svg.text(place, 10, words, "quiet halo");
    room.take(TakenRoom::box_of(place, 10, words));
  }
}

void draw_warnings(Svg& svg, const Drawn& at) {
  for (const LoopRepair& repair : at.panel->repairs) {
    const Vector2d place = at(repair.place);
    const std::array<Vector2d, 3> triangle{place + Vector2d(0, -9), place + Vector2d(8, 5), place + Vector2d(-8, 5)};
    svg.open_group(repair.what);
    svg.path(svg_path(triangle, true), "warning");
    svg.text(place + Vector2d(0, 3.6), 9, "!", "fill=\"#ffffff\" font-weight=\"bold\"");
    svg.close_group();
  }
}

// "200 mm": a round length that takes about a fifth of the width.
void draw_ruler(Svg& svg, const Vector2d& at, double scale, double width) {
  const double wanted = width / 5 / scale;
  double step = std::pow(10, std::floor(std::log10(wanted)));
  for (const double factor : {5.0, 2.0}) {
    if (step * factor <= wanted) {
      step *= factor;
      break;
    }
  }
  const double pixels = step * scale;
  svg.line(at, at + Vector2d(pixels, 0), "grain");
  for (const double x : {0.0, pixels}) svg.line(at + Vector2d(x, -4), at + Vector2d(x, 4), "grain");
  svg.text(at + Vector2d(pixels / 2, -7), 10, fmt::format("{:g} mm", 1000 * step), "quiet");
}

std::vector<std::string> wrapped(const std::string& words, std::size_t columns) {
  std::vector<std::string> lines{""};
  std::size_t at = 0;
  while (at < words.size()) {
    const std::size_t end = std::min(words.find(' ', at), words.size());
    const std::string word = words.substr(at, end - at);
    if (!lines.back().empty() && lines.back().size() + word.size() + 1 > columns) lines.emplace_back();
    lines.back() += (lines.back().empty() ? "" : " ") + word;
    at = end + 1;
  }
  return lines;
}

void draw_legend(Svg& svg, Vector2d at, double width) {
  constexpr double column = 270, row = 20;
  double x = 0;
  const auto next = [&] {
    x += column;
    if (x + column > width) x = 0, at.y() += row;
  };
  const auto words = [&](std::string_view text) {
    svg.text(at + Vector2d(x + 22, 4), 11, text, "", TextAnchor::start);
  };
  for (const auto& [style, text] :
       {std::pair{"inside", "cell inside the material"}, {"cut", "cell cut by a trim"}, {"outside", "cell outside"}}) {
    const Vector2d p = at + Vector2d(x, 0);
    const std::array<Vector2d, 4> box{p + Vector2d(0, -6), p + Vector2d(15, -6), p + Vector2d(15, 6),
                                      p + Vector2d(0, 6)};
    svg.path(svg_path(box, true), std::string("class=\"") + style + "\" stroke=\"#9fabb8\" stroke-width=\".7\"");
    words(text);
    next();
  }
  for (const auto& [style, text] :
       {std::pair{"outer", "outer loop, label LOOP,CURVE"}, {"hole", "hole, label LOOP,CURVE"}}) {
    svg.line(at + Vector2d(x - 1, 0), at + Vector2d(x + 15, 0), style);
    svg.arrow_head(at + Vector2d(x + 12, 0), {1, 0}, 9, std::string(style) + "-head");
    words(text);
    next();
  }
  for (int k = 0; k < 7; ++k) {
    draw_marker(svg, at + Vector2d(x + 7, 0), static_cast<PointKind>(k), true, 5);
    words(marker(static_cast<PointKind>(k)).words);
    next();
  }
  draw_marker(svg, at + Vector2d(x + 7, 0), PointKind::vertex, false, 5);
  words("hollow: the projection leaves it out");
}

std::string title_of(const InspectedPanel& panel, std::size_t number) {
  return panel.face.name.empty() ? fmt::format("panel_{}", number) : panel.face.name;
}

std::string facts_of(const InspectedPanel& panel, bool true_shape) {
  const double metre = panel.face.metres_per_unit;
  const NurbsSurface& s = panel.face.surface;
  return fmt::format("{:.4g} m2, degree {} x {}, {} x {} control points{}", panel.measure.area * metre * metre,
                     s.u().degree(), s.v().degree(), s.count_u(), s.count_v(),
                     true_shape ? "" : ", drawn in its parameters");
}

struct Drawing {
  Svg svg;
  double width = 0, height = 0;
};

// Marks of the pattern; the grain line shows as the panel's grain.
void draw_marks(Svg& svg, const Drawn& at) {
  for (const PanelMark& mark : at.face().marks) {
    const Vector2d place = at(mark.at);
    if (mark.kind == MarkKind::text) {
      svg.text(place, 10, mark.text, "mark-text halo", TextAnchor::start);
    } else if (mark.curve) {
      TrimCurve line;
      line.curve = *mark.curve;
      svg.path(svg_path(simplified(trim_line(at, line)), false), "mark");
    } else {
      svg.line(place - Vector2d(4, 0), place + Vector2d(4, 0), "mark");
      svg.line(place - Vector2d(0, 4), place + Vector2d(0, 4), "mark");
    }
  }
}

Drawing draw(const Inspection& inspection) {
  constexpr double margin = 70, head = 92, foot = 74, largest = 720, row_width = 2400;
  std::vector<Drawn> drawn;
  Vector2d size(0, 0);
  for (const InspectedPanel& panel : inspection.panels) {
    Drawn at{&panel, title_of(panel, drawn.size()), {}, PatternSheet(panel.face.surface), {}, {}};
    at.facts = facts_of(panel, at.sheet.true_shape());
    at.low.setConstant(1e300), at.high.setConstant(-1e300);
    const Interval u = panel.face.surface.u().domain(), v = panel.face.surface.v().domain();
    constexpr int samples = 40;
    for (int j = 0; j <= samples; ++j) {
      for (int i = 0; i <= samples; ++i) {
        const Vector2d x = at.on_sheet({u.min + u.length() * i / samples, v.min + v.length() * j / samples});
        at.low = at.low.cwiseMin(x), at.high = at.high.cwiseMax(x);
      }
    }
    size = size.cwiseMax(at.high - at.low);
    drawn.push_back(std::move(at));
  }

  // One scale for all panels: they are seen in their true proportions.
  const double scale = drawn.empty() ? 1 : largest / std::max(size.maxCoeff(), 1e-12);
  double x = 0, y = head, row_height = 0, width = 640;
  for (Drawn& at : drawn) {
    at.scale = scale;
    const Vector2d box = scale * (at.high - at.low);
    const double words = std::max(text_room(at.title, 14), text_room(at.facts, 10));
    const double wide = std::max(std::max(box.x(), 230.0) + 2 * margin, words + 24);
    if (x > 0 && x + wide > row_width) x = 0, y += row_height, row_height = 0;
    at.origin = {x + (wide - box.x()) / 2, y + 62 + box.y()};
    const double lines = 15.0 * static_cast<double>(at.panel->repairs.size());
    row_height = std::max(row_height, 62 + box.y() + foot + std::min(lines, 90.0));
    x += wide;
    width = std::max(width, x);
  }

  Svg svg;
  svg.text({24, 32}, 16, inspection.file, "bold", TextAnchor::start);
  svg.text(
      {24, 50}, 11,
      fmt::format("{}{}{}", inspection.unit, inspection.exporter.empty() ? "" : ", written by ", inspection.exporter),
      "quiet", TextAnchor::start);
  for (const Drawn& at : drawn) {
    const InspectedPanel& panel = *at.panel;
    const Vector2d box = scale * (at.high - at.low);
    const Vector2d above(at.origin.x() + box.x() / 2, at.origin.y() - box.y());
    svg.open_group(at.title);
    svg.text(above + Vector2d(0, -62), 14, at.title, "bold");
    svg.text(above + Vector2d(0, -46), 10, at.facts, "quiet");
    draw_cells(svg, at);
    TakenRoom room;
    draw_addresses(svg, at, room);
    draw_trims(svg, at, room);
    draw_points(svg, at);
    draw_marks(svg, at);
    draw_grain(svg, at, room);
    draw_warnings(svg, at);
    double line = at.origin.y() + 66;
    int shown = 0;
    for (const LoopRepair& repair : panel.repairs) {
      if (++shown > 6) {
        svg.text({above.x(), line}, 10, fmt::format("and {} more", panel.repairs.size() - 6), "warning-text");
        break;
      }
      svg.text({above.x(), line}, 10, wrapped(fmt::format("loop {}: {}", repair.loop, repair.what), 70).front(),
               "warning-text");
      line += 15;
    }
    svg.close_group();
  }
  y += row_height;
  if (!drawn.empty()) draw_ruler(svg, {24, y + 8}, scale, width);
  draw_legend(svg, {28, y + 44}, width - 20);
  const double columns = std::max(1.0, std::floor((width - 20) / 270));
  return {std::move(svg), width, y + 44 + 20 * std::ceil(12 / columns) + 16};
}

}  // namespace

std::string inspect_svg(const Inspection& inspection) {
  const Drawing drawing = draw(inspection);
  return drawing.svg.finish(drawing.width, drawing.height, inspection.file, style_sheet);
}

std::string inspect_png(const Inspection& inspection) {
  const Drawing drawing = draw(inspection);
  return svg_png(drawing.svg, drawing.width, drawing.height, style_sheet);
}

}  // namespace toile
