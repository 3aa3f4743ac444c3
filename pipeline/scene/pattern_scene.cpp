// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/scene/pattern_scene.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "geometry/error.h"
#include "io/panel_file.h"
#include "io/triangle_mesh.h"
#include "pipeline/scene/body_fit.h"
#include "pipeline/scene/scene.h"
#include "pipeline/scene/templates.h"
#include "pipeline/scene/units.h"
#include "pipeline/scene/upright.h"

namespace toile {
namespace {

using Eigen::Vector3d;

// The first dialect puts its origin at the centre of mass of the body that it is drawn on, 1.04 m above the soles of a
// body of 1.666 m: the waist of its skirts then lies at that body's waist.
constexpr double origin_height = 1.04 / 1.666;

bool is_pattern(const std::filesystem::path& path) {
  return path.extension() == ".json" || path.extension() == ".jsonc";
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < ' ' || c == 0x7f ? fmt::format("\\u{:04x}", static_cast<unsigned char>(c))
                                                            : std::string(1, c);
  }
  return out + '"';
}

std::string path_from(const std::filesystem::path& scene, const std::filesystem::path& file) {
  const auto folder = std::filesystem::absolute(scene).lexically_normal().parent_path();
  const auto target = std::filesystem::absolute(file).lexically_normal();
  const auto relative = target.lexically_relative(folder);
  return relative.empty() || *relative.begin() == ".." ? target.string() : relative.string();
}

// Metres, to a hundredth of a millimetre.
std::string metres(double x) {
  const double rounded = std::round(1e5 * x) / 1e5;
  return fmt::format("{}", rounded == 0 ? 0.0 : rounded);
}
std::string vector(const Vector3d& x) {
  return fmt::format("[{}, {}, {}]", metres(x[0]), metres(x[1]), metres(x[2]));
}

using Isometry = Eigen::Isometry3d;

Isometry placed(const PatternPlace& place) {
  Placement p;
  p.rotate = place.rotate_deg * std::numbers::pi / 180;
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.linear() = p.rotation();
  out.translation() = place.translate;
  return out;
}

// A curve of a panel where the pattern places it.
struct PlacedEdge {
  Vector3d start, middle, end;
  double length = 0;  // m
};

const TrimCurve& curve_of(const Pattern& pattern, const PatternEdge& edge) {
  const TrimLoop& loop =
      pattern.file.panels[static_cast<std::size_t>(edge.panel)].loops[static_cast<std::size_t>(edge.loop)];
  return *std::ranges::find(loop.curves, edge.curve, &TrimCurve::index);
}

PlacedEdge placed_edge(const Pattern& pattern, const PatternEdge& edge) {
  const TrimmedSurface& face = pattern.file.panels[static_cast<std::size_t>(edge.panel)];
  const Eigen::Isometry3d place = placed(pattern.places[static_cast<std::size_t>(edge.panel)]);
  const Curve2& curve = curve_of(pattern, edge).curve;
  const auto at = [&](double fraction) -> Vector3d {
    const Eigen::Vector2d p = curve(curve.domain().min + fraction * curve.domain().length());
    return place * (face.metres_per_unit * face.surface(p.x(), p.y()));
  };
  PlacedEdge out{at(0), at(0.5), at(1)};
  // Chords of a fine polyline: good to the millimetre that the text says.
  constexpr int pieces = 256;
  Vector3d last = out.start;
  for (int k = 1; k <= pieces; ++k) {
    const Vector3d next = at(static_cast<double>(k) / pieces);
    out.length += (next - last).norm();
    last = next;
  }
  return out;
}

bool stitched(const Pattern& pattern, const PatternEdge& edge) {
  const auto same = [&](const PatternEdge& e) {
    return e.panel == edge.panel && e.loop == edge.loop && e.curve == edge.curve;
  };
  return std::ranges::any_of(pattern.stitches, [&](const Stitch& s) {
    return std::ranges::any_of(s.a, same) || std::ranges::any_of(s.b, same);
  });
}

struct HungEdge {
  PatternEdge edge;
  PlacedEdge placed;
  bool free = false;
};

// The edges that hold a panel up: those in the upper tenth of it that run more across than down; failing that, the
// highest.
std::vector<HungEdge> upper_edges(const Pattern& pattern, int panel, const Vector3d& up) {
  std::vector<HungEdge> all;
  double low = 1e300, high = -1e300;
  for (const TrimCurve& trim : pattern.file.panels[static_cast<std::size_t>(panel)].loops[0].curves) {
    HungEdge hung{{panel, 0, trim.index}, {}, false};
    hung.placed = placed_edge(pattern, hung.edge);
    hung.free = !stitched(pattern, hung.edge);
    for (const Vector3d& x : {hung.placed.start, hung.placed.end}) {
      low = std::min(low, up.dot(x));
      high = std::max(high, up.dot(x));
    }
    all.push_back(hung);
  }
  std::vector<HungEdge> out;
  for (const HungEdge& h : all) {
    const double rise = std::abs(up.dot(h.placed.end - h.placed.start));
    if (up.dot(h.placed.middle) >= high - 0.1 * (high - low) && rise <= 0.7 * h.placed.length) out.push_back(h);
  }
  if (out.empty() && !all.empty())
    out.push_back(*std::ranges::max_element(all, {}, [&](const HungEdge& h) { return up.dot(h.placed.middle); }));
  return out;
}

std::string address(const PatternEdge& edge) {
  return fmt::format("curve:{},{}", edge.loop, edge.curve);
}

double length(const Pattern& pattern, const std::vector<PatternEdge>& side) {
  double sum = 0;
  for (const PatternEdge& edge : side) sum += placed_edge(pattern, edge).length;
  return sum;
}

std::string panel_key(const Pattern& pattern, const PatternEdge& edge) {
  return fmt::format("panel = {}, loop = {}", quoted(pattern.file.panels[static_cast<std::size_t>(edge.panel)].name),
                     edge.loop);
}

// Edges that one key can name: `curves = [...]` runs along curves of one loop.
bool one_side(const std::vector<PatternEdge>& side) {
  return std::ranges::all_of(side,
                             [&](const PatternEdge& e) { return e.panel == side[0].panel && e.loop == side[0].loop; });
}

std::string side_text(const Pattern& pattern, const std::vector<PatternEdge>& side) {
  std::vector<int> curves;
  for (const PatternEdge& edge : side) curves.push_back(edge.curve);
  if (curves.size() == 1) return fmt::format("{}, curve = {}", panel_key(pattern, side[0]), curves[0]);
  return fmt::format("{}, curves = [{}]", panel_key(pattern, side[0]), fmt::join(curves, ", "));
}

std::string seam_table(const std::string& a, const std::string& b, bool reverse, double length_a, double length_b) {
  return fmt::format("\n[[seam]]     # {:.3f} m to {:.3f} m\na = {{ {} }}\nb = {{ {}{} }}\n", length_a, length_b, a, b,
                     reverse ? ", reverse = true" : "");
}

// One table a stitch; where the edges of a side lie on several panels, one for each of them with its share of the
// other.
std::string seam_tables(const Pattern& pattern, const Stitch& stitch) {
  const double length_a = length(pattern, stitch.a), length_b = length(pattern, stitch.b);
  if (one_side(stitch.a) && one_side(stitch.b)) {
    return seam_table(side_text(pattern, stitch.a), side_text(pattern, stitch.b), stitch.reverse, length_a, length_b);
  }
  const bool one_is_a = one_side(stitch.a);
  const std::vector<PatternEdge>&one = one_is_a ? stitch.a : stitch.b, &many = one_is_a ? stitch.b : stitch.a;
  if (!one_side(one)) {
    throw InputError(fmt::format("{}:{}: a stitch of several edges of several panels on both sides; write one a pair",
                                 pattern.file.path, stitch.line));
  }
  const double whole = length(pattern, many), other = length(pattern, one);
  std::string text;
  double before = 0;
  for (const PatternEdge& edge : many) {
    const double here = length(pattern, {edge});
    // The share from the start of `one` in its own direction.
    double from = before / whole, to = (before + here) / whole;
    if (stitch.reverse) std::tie(from, to) = std::pair(1 - to, 1 - from);
    const std::string share = fmt::format("{}, from = {:.9g}, to = {:.9g}", side_text(pattern, one), from, to);
    text += seam_table(share, side_text(pattern, {edge}), stitch.reverse, other * (to - from), here);
    before += here;
  }
  return text;
}

Pattern read_any(const std::filesystem::path& path, const PanelChoice& choice) {
  Pattern pattern;
  if (is_pattern(path) && choice == PanelChoice()) return read_pattern(path);
  pattern.file = read_panels(path, choice);
  leave_out_invalid(pattern.file);
  pattern.places.resize(pattern.file.panels.size());
  return pattern;
}

void refuse_unnamed(const Pattern& pattern, const std::filesystem::path& path) {
  const std::vector<TrimmedSurface>& panels = pattern.file.panels;
  if (panels.empty()) throw InputError(fmt::format("{}: holds no panel", path.string()));
  for (std::size_t k = 0; k < panels.size(); ++k) {
    for (std::size_t m = 0; m < k; ++m)
      if (panels[m].name == panels[k].name)
        throw InputError(fmt::format("{}: two panels are called '{}'", path.string(), panels[k].name));
  }
}

// Moves the panels to the body; a comment that says how.
std::string place_at(const TriangleMesh& mesh, const std::filesystem::path& body, bool drawing, Pattern& pattern,
                     PatternScene& out) {
  const Vector3d low = mesh.vertices.rowwise().minCoeff(), high = mesh.vertices.rowwise().maxCoeff();
  const double soles = low.y(), height = high.y() - soles;
  if (!(height > 0.3 && height < 3)) {
    out.warnings.push_back(
        fmt::format("{}: the body is {:.3g} high in y; a body in metres is expected: set unit in "
                    "[[obstacle]] and move the panels",
                    body.string(), height));
  }
  Vector3d shift(0, soles, 0);
  std::string why = "the pattern's soles are at y = 0.";
  if (drawing) {
    constexpr double shoulders = 0.82;  // of a body's height
    shift = {low.x(), soles + shoulders * height, high.z() + 0.05};
    why = "they hang before it, side by side.";
  } else if (!pattern.soles_at_zero) {
    const Vector3d mass = centre_of_mass(mesh);
    shift = {mass.x(), soles + origin_height * height, mass.z()};
    why = "the pattern's origin is the centre of mass of the body it was drawn on.";
  }
  for (PatternPlace& place : pattern.places) place.translate += shift;
  return fmt::format("# Moved by {} m to the body: {}\n", vector(shift), why);
}

// Places along edges that follow each other, even in length, from start to end.
std::vector<Vector3d> along_edges(const Pattern& pattern, const std::vector<PatternEdge>& edges, int count) {
  constexpr int pieces = 24;
  std::vector<std::pair<double, Vector3d>> line;  // length up to it
  double length = 0;
  for (const PatternEdge& edge : edges) {
    const TrimmedSurface& face = pattern.file.panels[static_cast<std::size_t>(edge.panel)];
    const Isometry place = placed(pattern.places[static_cast<std::size_t>(edge.panel)]);
    const Curve2& curve = curve_of(pattern, edge).curve;
    for (int k = 0; k <= pieces; ++k) {
      const Eigen::Vector2d p = curve(curve.domain().min + curve.domain().length() * k / pieces);
      const Vector3d x = place * Vector3d(face.metres_per_unit * face.surface(p.x(), p.y()));
      if (k > 0) length += (x - line.back().second).norm();
      line.emplace_back(length, x);
    }
  }
  std::vector<Vector3d> out;
  std::size_t at = 0;
  for (int k = 0; k < count; ++k) {
    const double wanted = length * k / (count - 1);
    while (at + 2 < line.size() && line[at + 1].first < wanted) ++at;
    const double whole = line[at + 1].first - line[at].first;
    const double share = whole > 0 ? std::clamp((wanted - line[at].first) / whole, 0.0, 1.0) : 0;
    out.push_back((1 - share) * line[at].second + share * line[at + 1].second);
  }
  return out;
}

// Patterns of tops are often drawn for another body: where seams would close through this one's shoulders the panels
// are raised until the fewest do. A comment that says how far; empty where nothing is to be done.
std::string clear_seams(const TriangleMesh& mesh, Pattern& pattern) {
  constexpr int along = 9, across = 19;
  constexpr double step = 0.01, highest = 0.5;  // m
  std::vector<Vector3d> ways;                   // places on the straight ways that seams close
  for (const Stitch& stitch : pattern.stitches) {
    const std::vector<Vector3d> a = along_edges(pattern, stitch.a, along);
    std::vector<Vector3d> b = along_edges(pattern, stitch.b, along);
    if (stitch.reverse) std::ranges::reverse(b);
    for (std::size_t k = 0; k < a.size(); ++k)
      for (int i = 1; i <= across; ++i) {
        const double share = static_cast<double>(i) / (across + 1);
        ways.push_back((1 - share) * a[k] + share * b[k]);
      }
  }
  const auto inside = [&](double shift) {
    std::vector<Vector3d> moved = ways;
    for (Vector3d& x : moved) x.y() += shift;
    return count_inside(mesh, moved);
  };
  std::vector<int> counts;
  for (int k = 0; k * step <= highest; ++k) counts.push_back(inside(k * step));
  // Of the first range where so few do the middle.
  const auto fewest = std::ranges::min_element(counts);
  const auto end = std::find_if(fewest, counts.end(), [&](int count) { return count != *fewest; });
  if (fewest == counts.begin()) return {};
  const double best =
      step * (static_cast<double>(fewest - counts.begin()) + 0.5 * static_cast<double>(end - fewest - 1));
  for (PatternPlace& place : pattern.places) place.translate.y() += best;
  return fmt::format("# Raised by {:.2f} m, where the fewest seams close through the body.\n", best);
}

// A line of places along a border of the glued garment.
std::vector<Vector3d> places_along(const Pattern& pattern, const std::vector<GluePart>& line) {
  constexpr int pieces = 16;
  std::vector<Vector3d> out;
  for (const GluePart& part : line) {
    const TrimmedSurface& face = pattern.file.panels[static_cast<std::size_t>(part.panel)];
    const Isometry place = placed(pattern.places[static_cast<std::size_t>(part.panel)]);
    const Curve2& curve =
        face.loops[static_cast<std::size_t>(part.loop)].curves[static_cast<std::size_t>(part.edge)].curve;
    for (int k = 0; k <= pieces; ++k) {
      const double t = part.from + (part.to - part.from) * k / pieces;
      const Eigen::Vector2d p = curve(curve.domain().min + t * curve.domain().length());
      out.push_back(place * Vector3d(face.metres_per_unit * face.surface(p.x(), p.y())));
    }
  }
  return out;
}

// The highest opening that runs around the trunk, against the body there; empty where none does.
std::string waist_advice(const Pattern& pattern, const TriangleMesh& mesh) {
  std::string advice;
  double best = -1e300;
  for (const GluedPiece& piece : pattern.gluing.pieces) {
    for (const std::vector<GluePart>& line : piece.border_lines) {
      const std::vector<Vector3d> places = places_along(pattern, line);
      double height = 0;
      std::vector<Eigen::Vector2d> around;
      for (const Vector3d& x : places) {
        height += x.y() / static_cast<double>(places.size());
        around.emplace_back(x.x(), x.z());
      }
      const TrunkSection trunk = trunk_section(mesh, height);
      if (height <= best || trunk.girth == 0 || std::abs(std::abs(turns_around(around, trunk.centre)) - 1) > 0.1)
        continue;
      best = height;
      double length = 0;
      for (const GluePart& part : line) {
        const TrimLoop& loop =
            pattern.file.panels[static_cast<std::size_t>(part.panel)].loops[static_cast<std::size_t>(part.loop)];
        length += placed_edge(pattern, {part.panel, part.loop, loop.curves[static_cast<std::size_t>(part.edge)].index})
                      .length *
                  std::abs(part.to - part.from);
      }
      advice =
          fmt::format("the upper opening is {:.3f} m around at y = {:.3f}; the body measures {:.3f} m there{}", length,
                      height, trunk.girth, length < trunk.girth ? ": it must stretch or sit elsewhere" : "");
    }
  }
  return advice;
}

// Places spread over a panel's material, by its outline's even-odd rule: good for a share in per cent.
std::vector<Vector3d> places_on(const Pattern& pattern, std::size_t k) {
  constexpr int grid = 20, pieces = 24;
  const TrimmedSurface& face = pattern.file.panels[k];
  const Isometry place = placed(pattern.places[k]);
  std::vector<std::vector<Eigen::Vector2d>> loops;
  for (const TrimLoop& loop : face.loops) {
    loops.emplace_back();
    for (const TrimCurve& trim : loop.curves)
      for (int n = 0; n < pieces; ++n) {
        const double t = static_cast<double>(trim.reversed ? pieces - n : n) / pieces;
        loops.back().push_back(trim.curve(trim.curve.domain().min + t * trim.curve.domain().length()));
      }
  }
  const Interval u = face.surface.u().domain(), v = face.surface.v().domain();
  std::vector<Vector3d> out;
  for (int i = 0; i < grid; ++i) {
    for (int j = 0; j < grid; ++j) {
      const Eigen::Vector2d p(u.min + u.length() * (i + 0.5) / grid, v.min + v.length() * (j + 0.5) / grid);
      double turns = 0;
      for (const auto& loop : loops) turns += std::abs(turns_around(loop, p));
      if (std::lround(turns) % 2 == 1)
        out.push_back(place * Vector3d(face.metres_per_unit * face.surface(p.x(), p.y())));
    }
  }
  return out;
}

// How much of the panels starts inside the body, which contact would have to push out.
void say_overlap(const Pattern& pattern, const TriangleMesh& mesh, PatternScene& out) {
  std::size_t all = 0;
  int inside = 0;
  std::string worst;
  double largest = 0;
  for (std::size_t k = 0; k < pattern.file.panels.size(); ++k) {
    const std::vector<Vector3d> places = places_on(pattern, k);
    const int in = count_inside(mesh, places);
    all += places.size();
    inside += in;
    const double share = places.empty() ? 0 : static_cast<double>(in) / static_cast<double>(places.size());
    if (share > largest) largest = share, worst = pattern.file.panels[k].name;
  }
  if (all == 0) return;
  std::string text =
      fmt::format("{:.1f} % of the panels lies inside the body", 100.0 * inside / static_cast<double>(all));
  if (inside > 0) text += fmt::format(", of '{}' {:.1f} %", worst, 100 * largest);
  out.text += "# " + text + ".\n";
  out.notes.push_back(text);
}

std::string head_text(const std::filesystem::path& path, const std::filesystem::path& scene) {
  return fmt::format(
      "# {} as a scene: toile init --pattern. Lengths in metres, or with units: \"20 mm\"; y points up.\n"
      "# toile inspect {} --svg panels.svg     shows the loop and curve numbers used below\n",
      path.filename().string(), path_from(scene, path));
}

std::string panel_text(const Pattern& pattern, std::size_t k, const std::string& file, const PanelChoice& choice) {
  const TrimmedSurface& panel = pattern.file.panels[k];
  std::string text = fmt::format("\n[[panel]]\nname = {}\n{} = {}\n", quoted(panel.name),
                                 is_pattern(file) ? "pattern" : "file", quoted(file));
  if (!choice.size.empty()) text += fmt::format("size = {}\n", quoted(choice.size));
  if (!choice.unit.empty()) text += fmt::format("unit = {}\n", quoted(choice.unit));
  if (!choice.outline.empty()) text += fmt::format("outline = {}\n", quoted(choice.outline));
  text += "refine = { degree = 2, span = \"20 mm\" }\n";
  if (const auto grain = grain_angle(panel)) {
    text += fmt::format("# grain_deg = {}     is what the panel's grain line says\n", degrees_text(*grain));
  }
  const PatternPlace& place = pattern.places[k];
  return text + fmt::format("place = {{ translate = {}, rotate_deg = [{}, {}, {}] }}\nfabric = \"cotton\"\n",
                            vector(place.translate), place.rotate_deg[0] + 0.0, place.rotate_deg[1] + 0.0,
                            place.rotate_deg[2] + 0.0);
}

std::string pins_text(const Pattern& pattern) {
  std::string text = "\n# Each panel hangs from its upper edges.\n";
  const Vector3d up = Vector3d::UnitY();
  for (int k = 0; k < static_cast<int>(pattern.file.panels.size()); ++k) {
    for (const HungEdge& h : upper_edges(pattern, k, up)) {
      text += fmt::format("[[pin]]\npanel = {}\nat = \"{}\"     # {:.3f} m at y = {:.3f}{}\n",
                          quoted(pattern.file.panels[static_cast<std::size_t>(k)].name), address(h.edge),
                          h.placed.length, up.dot(h.placed.middle), h.free ? "" : ", sewn");
    }
  }
  return text;
}

}  // namespace

PatternScene pattern_scene(const std::filesystem::path& path, const std::optional<std::filesystem::path>& body,
                           const std::filesystem::path& scene, const PanelChoice& choice) {
  Pattern pattern = read_any(path, choice);
  refuse_unnamed(pattern, path);
  PatternScene out;
  out.warnings = pattern.file.warnings;
  out.details = pattern.file.notes;
  out.refused = pattern.file.refused;
  std::string& text = out.text;
  text = head_text(path, scene);
  bool drawing = false;
  if (!is_pattern(path)) {
    if (auto places = hang_upright(pattern.file.panels)) {
      drawing = true;
      pattern.places = std::move(*places);
      text += "# The panels hang upright by their grain, side by side where they would overlap.\n";
    }
  }
  std::optional<TriangleMesh> mesh;
  if (body) {
    mesh = read_mesh(*body);
    text += place_at(*mesh, *body, drawing, pattern, out);
    if (!drawing) text += clear_seams(*mesh, pattern);
  }
  PanelChoice written = choice;
  if (written.size.empty() && pattern.file.sizes.size() > 1) written.size = pattern.file.size;
  for (std::size_t k = 0; k < pattern.file.panels.size(); ++k)
    text += panel_text(pattern, k, path_from(scene, path), written);
  const bool worn = body && !pattern.stitches.empty();
  text += '\n' + fabric_tables() +
          (worn ? "\n# Nothing holds the garment but the body: it is sewn around it without gravity, then falls into "
                  "place.\n"
                : pins_text(pattern));
  if (mesh) {
    say_overlap(pattern, *mesh, out);
    if (const std::string advice = waist_advice(pattern, *mesh); !advice.empty()) {
      text += "# " + advice + ".\n";
      out.notes.push_back(advice);
    }
  }
  for (const Stitch& stitch : pattern.stitches) text += seam_tables(pattern, stitch);
  if (body) {
    text += fmt::format("\n[[obstacle]]\nmesh = {}\nunit = \"m\"\nfriction = 0.3\n", quoted(path_from(scene, *body)));
  }
  text += fmt::format(
      "\n[load]\ngravity = [0, -9.81, 0]\n\n[solver]\nuntil = \"{} s\"\n\n[output]\nevery = \"1/30 s\"\n"
      "formats = [\"vtu\"]     # also \"iges\", \"obj\", \"glb\", ...\n",
      worn ? "3" : "0.8");
  out.notes.push_back(fmt::format("{} panels, {} seams{}", pattern.file.panels.size(), pattern.stitches.size(),
                                  body ? ", a body" : ""));
  if (pattern.file.sizes.size() > 1) {
    out.notes.push_back(fmt::format("sizes {}; {} is read: --size chooses another", fmt::join(pattern.file.sizes, ", "),
                                    written.size.empty() ? "one for each piece" : written.size));
  }
  return out;
}

}  // namespace toile
