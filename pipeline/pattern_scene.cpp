#include "pipeline/pattern_scene.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "geometry/error.h"
#include "io/panel_file.h"
#include "io/triangle_mesh.h"
#include "pipeline/scene.h"
#include "pipeline/templates.h"
#include "pipeline/units.h"

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

Eigen::Isometry3d placed(const PatternPlace& place) {
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
  return std::ranges::any_of(pattern.stitches, [&](const Stitch& s) { return same(s.a) || same(s.b); });
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

// Length of the longest closed line in which the plane y = height cuts the mesh: the trunk's girth, arms left out.
double girth(const TriangleMesh& mesh, double height) {
  using Edge = std::pair<int, int>;
  std::map<Edge, int> ids;
  std::vector<int> parent;
  std::vector<double> length;
  std::vector<Vector3d> at;
  const auto root = [&](int k) {
    while (parent[static_cast<std::size_t>(k)] != k)
      k = parent[static_cast<std::size_t>(k)] = parent[static_cast<std::size_t>(parent[static_cast<std::size_t>(k)])];
    return k;
  };
  const auto cut = [&](int a, int b) {
    if (a > b) std::swap(a, b);
    const auto [found, fresh] = ids.try_emplace({a, b}, static_cast<int>(at.size()));
    if (fresh) {
      const Vector3d p = mesh.vertices.col(a), q = mesh.vertices.col(b);
      at.push_back(p + (height - p.y()) / (q.y() - p.y()) * (q - p));
      parent.push_back(found->second);
      length.push_back(0);
    }
    return found->second;
  };
  for (const std::array<int, 3>& t : mesh.triangles) {
    std::vector<int> ends;
    for (int k = 0; k < 3; ++k) {
      const int a = t[static_cast<std::size_t>(k)], b = t[static_cast<std::size_t>((k + 1) % 3)];
      if ((mesh.vertices(1, a) < height) != (mesh.vertices(1, b) < height)) ends.push_back(cut(a, b));
    }
    if (ends.size() != 2) continue;
    const double piece = (at[static_cast<std::size_t>(ends[0])] - at[static_cast<std::size_t>(ends[1])]).norm();
    const int a = root(ends[0]), b = root(ends[1]);
    length[static_cast<std::size_t>(a)] += piece + (a == b ? 0 : length[static_cast<std::size_t>(b)]);
    parent[static_cast<std::size_t>(b)] = a;
  }
  return length.empty() ? 0 : *std::ranges::max_element(length);
}

Vector3d centre_of_mass(const TriangleMesh& mesh) {
  double volume = 0;
  Vector3d sum(0, 0, 0);
  for (const std::array<int, 3>& t : mesh.triangles) {
    const Vector3d a = mesh.vertices.col(t[0]), b = mesh.vertices.col(t[1]), c = mesh.vertices.col(t[2]);
    const double v = a.dot(b.cross(c)) / 6;
    volume += v;
    sum += v * (a + b + c) / 4;
  }
  const Vector3d middle = (mesh.vertices.rowwise().minCoeff() + mesh.vertices.rowwise().maxCoeff()) / 2;
  return volume > 0 ? Vector3d(sum / volume) : middle;
}

std::string address(const PatternEdge& edge) {
  return fmt::format("curve:{},{}", edge.loop, edge.curve);
}

}  // namespace

SeamDirection seam_direction(const Pattern& pattern, const Stitch& stitch) {
  const PlacedEdge a = placed_edge(pattern, stitch.a), b = placed_edge(pattern, stitch.b);
  const double along = (a.start - b.start).norm() + (a.end - b.end).norm();
  const double against = (a.start - b.end).norm() + (a.end - b.start).norm();
  // Either way nearly as far: the placement doesn't tell, say so.
  return {against < along, std::abs(along - against) <= 0.05 * std::min(a.length, b.length)};
}

PatternScene pattern_scene(const std::filesystem::path& path, const std::optional<std::filesystem::path>& body,
                           const std::filesystem::path& scene) {
  Pattern pattern;
  if (is_pattern(path)) {
    pattern = read_pattern(path);
  } else {
    pattern.file = read_panels(path);
    pattern.places.resize(pattern.file.panels.size());
  }
  const std::vector<TrimmedSurface>& panels = pattern.file.panels;
  if (panels.empty()) throw InputError(fmt::format("{}: holds no panel", path.string()));
  for (std::size_t k = 0; k < panels.size(); ++k) {
    for (std::size_t m = 0; m < k; ++m)
      if (panels[m].name == panels[k].name)
        throw InputError(fmt::format("{}: two panels are called '{}'", path.string(), panels[k].name));
  }
  PatternScene out;
  out.warnings = pattern.file.warnings;
  std::optional<TriangleMesh> mesh;
  std::string moved;
  if (body) {
    mesh = read_mesh(*body);
    const double soles = mesh->vertices.row(1).minCoeff(), height = mesh->vertices.row(1).maxCoeff() - soles;
    if (!(height > 0.3 && height < 3)) {
      out.warnings.push_back(
          fmt::format("{}: the body is {:.3g} high in y; a body in metres is expected: set unit in "
                      "[[obstacle]] and move the panels",
                      body->string(), height));
    }
    Vector3d shift(0, soles, 0);
    if (!pattern.soles_at_zero) {
      const Vector3d mass = centre_of_mass(*mesh);
      shift = {mass.x(), soles + origin_height * height, mass.z()};
    }
    for (PatternPlace& place : pattern.places) place.translate += shift;
    moved =
        fmt::format("# Moved by {} m to the body: {}\n", vector(shift),
                    pattern.soles_at_zero ? "the pattern's soles are at y = 0."
                                          : "the pattern's origin is the centre of mass of the body it was drawn on.");
  }
  const Vector3d up = Vector3d::UnitY();
  const bool json = is_pattern(path);

  std::string& text = out.text;
  text = fmt::format(
      "# {} as a scene: toile init --pattern. Lengths in metres, or with units: \"20 mm\"; y points up.\n"
      "# toile inspect {} --svg panels.svg     shows the loop and curve numbers used below\n",
      path.filename().string(), path_from(scene, path));
  if (!pattern.stitches.empty() || body) {
    text +=
        "# Seams and obstacles are checked but not simulated by this version. Each panel drapes alone:\n"
        "#   toile drape scene.toml --set 'seam=[]' --set 'obstacle=[]'\n";
  }
  text += moved;
  for (std::size_t k = 0; k < panels.size(); ++k) {
    text += fmt::format("\n[[panel]]\nname = {}\n{} = {}\nrefine = {{ degree = 2, span = \"20 mm\" }}\n",
                        quoted(panels[k].name), json ? "pattern" : "file", quoted(path_from(scene, path)));
    if (const auto grain = grain_angle(panels[k])) {
      text += fmt::format("# grain_deg = {}     is what the panel's grain line says\n", degrees_text(*grain));
    }
    const PatternPlace& place = pattern.places[k];
    text += fmt::format("place = {{ translate = {}, rotate_deg = [{}, {}, {}] }}\nfabric = \"cotton\"\n",
                        vector(place.translate), place.rotate_deg[0] + 0.0, place.rotate_deg[1] + 0.0,
                        place.rotate_deg[2] + 0.0);
  }
  text += '\n';
  text += fabric_tables();

  text += "\n# Each panel hangs from its upper edges. Seams and a waistband take their place when panels are sewn.\n";
  double free_length = 0, free_height = 0;
  for (int k = 0; k < static_cast<int>(panels.size()); ++k) {
    for (const HungEdge& h : upper_edges(pattern, k, up)) {
      text += fmt::format("[[pin]]\npanel = {}\nat = \"{}\"     # {:.3f} m at y = {:.3f}{}\n",
                          quoted(panels[static_cast<std::size_t>(k)].name), address(h.edge), h.placed.length,
                          up.dot(h.placed.middle), h.free ? "" : ", sewn");
    }
  }
  // The waistband: free edges in the upper tenth of the whole garment's height.
  double low = 1e300, high = -1e300;
  std::vector<HungEdge> edges;
  for (int k = 0; k < static_cast<int>(panels.size()); ++k) {
    for (const TrimCurve& trim : panels[static_cast<std::size_t>(k)].loops[0].curves) {
      HungEdge h{{k, 0, trim.index}, {}, false};
      h.placed = placed_edge(pattern, h.edge);
      h.free = !stitched(pattern, h.edge);
      low = std::min(low, up.dot(h.placed.middle));
      high = std::max(high, up.dot(h.placed.middle));
      edges.push_back(h);
    }
  }
  for (const HungEdge& h : edges) {
    const double rise = std::abs(up.dot(h.placed.end - h.placed.start));
    if (!h.free || rise > 0.7 * h.placed.length || up.dot(h.placed.middle) < high - 0.1 * (high - low)) continue;
    free_length += h.placed.length;
    free_height += h.placed.length * up.dot(h.placed.middle);
  }
  if (free_length > 0 && !pattern.stitches.empty()) {
    free_height /= free_length;
    std::string advice = fmt::format("the free upper edge is {:.3f} m long at y = {:.3f}", free_length, free_height);
    if (mesh) {
      const double around = girth(*mesh, free_height);
      advice += fmt::format("; the body measures {:.3f} m there", around);
      if (free_length < around) advice += ": it must stretch or sit elsewhere";
    }
    text += "# Waistband: " + advice + ".\n";
    out.notes.push_back(advice);
  }

  for (const Stitch& stitch : pattern.stitches) {
    const SeamDirection direction = seam_direction(pattern, stitch);
    const double a = placed_edge(pattern, stitch.a).length, b = placed_edge(pattern, stitch.b).length;
    const std::string &name_a = panels[static_cast<std::size_t>(stitch.a.panel)].name,
                      &name_b = panels[static_cast<std::size_t>(stitch.b.panel)].name;
    text += fmt::format("\n[[seam]]     # {:.3f} m to {:.3f} m{}\n", a, b,
                        direction.doubt ? "; the placement doesn't tell the direction: look at reverse" : "");
    text += fmt::format("a = {{ panel = {}, loop = {}, curve = {} }}\n", quoted(name_a), stitch.a.loop, stitch.a.curve);
    text += fmt::format("b = {{ panel = {}, loop = {}, curve = {}{} }}\n", quoted(name_b), stitch.b.loop,
                        stitch.b.curve, direction.reverse ? ", reverse = true" : "");
    if (direction.doubt) {
      out.warnings.push_back(
          fmt::format("{}:{}: the placement doesn't tell in which direction '{}' {} and '{}' {} are "
                      "sewn; look at reverse in the scene",
                      path.string(), stitch.line, name_a, address(stitch.a), name_b, address(stitch.b)));
    }
  }
  if (body) {
    text += fmt::format("\n[[obstacle]]\nmesh = {}\nunit = \"m\"\nfriction = 0.3\n", quoted(path_from(scene, *body)));
  }
  text +=
      "\n[load]\ngravity = [0, -9.81, 0]\n\n[solver]\nuntil = \"0.8 s\"\n\n[output]\nevery = \"1/30 s\"\n"
      "formats = [\"vtu\"]     # also \"iges\", \"obj\"\n";
  out.notes.push_back(
      fmt::format("{} panels, {} seams{}", panels.size(), pattern.stitches.size(), body ? ", a body" : ""));
  return out;
}

}  // namespace toile
