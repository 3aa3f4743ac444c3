#include "io/pattern_json.h"

#include <algorithm>
#include <cmath>

#include "geometry/error.h"
#include "geometry/refine.h"
#include "geometry/text.h"
#include "io/file.h"
#include "io/flat_panel.h"
#include "io/json_document.h"

namespace toile {

namespace {

using Eigen::Vector2d;

constexpr std::uintmax_t max_bytes = std::uintmax_t{64} << 20;

class PatternReader {
 public:
  PatternReader(const std::string& name, Pattern& out) : name_(name), out_(out) { out_.file.path = name; }
  void read(const JsonValue& root);

 private:
  [[noreturn]] void fail(const JsonValue& at, const std::string& what) const {
    throw InputError(name_ + ":" + std::to_string(at.line) + ": " + where_ + what);
  }
  void warn(const JsonValue& at, const std::string& what) {
    out_.file.warnings.push_back(name_ + ":" + std::to_string(at.line) + ": " + where_ + what);
  }
  const JsonValue& expect(const JsonValue& value, JsonValue::Kind kind, const std::string& what) const {
    JsonValue wanted;
    wanted.kind = kind;
    if (value.kind != kind) fail(value, what + " must be " + wanted.kind_name() + ", not " + value.kind_name());
    return value;
  }
  const JsonValue& member(const JsonValue& object, const char* key, JsonValue::Kind kind) const {
    const JsonValue* found = object.find(key);
    if (!found) fail(object, std::string("'") + key + "' is missing");
    return expect(*found, kind, std::string("'") + key + "'");
  }
  double number(const JsonValue& value, const std::string& what) const;
  int index(const JsonValue& value, std::size_t count, const std::string& what) const;
  template <int N>
  Eigen::Matrix<double, N, 1> vector(const JsonValue& value, const std::string& what) const;

  void properties(const JsonValue& root);
  void panel(const std::string& name, const JsonValue& value);
  Curve2 edge(const JsonValue& value, const Vector2d& a, const Vector2d& b);
  Curve2 curved(const JsonValue& value, const Vector2d& a, const Vector2d& b,
                const std::vector<Vector2d>& params) const;
  Curve2 arc(const JsonValue& value, const Vector2d& a, const Vector2d& b, const JsonValue& params) const;
  void stitch(const JsonValue& value);
  PatternEdge side(const JsonValue& value) const;

  const std::string& name_;
  Pattern& out_;
  std::string where_;  // "panel 'front': edge 3: "
  double units_in_metre_ = 100;
  bool absolute_ = false;                        // control points in the panel's own coordinates
  bool labels_ = false, objects_ = false;        // what only the second dialect has
  std::vector<std::vector<PatternEdge>> edges_;  // per panel; panel -1: left out
};

double PatternReader::number(const JsonValue& value, const std::string& what) const {
  expect(value, JsonValue::Kind::number, what);
  if (!std::isfinite(value.number)) fail(value, what + " must be finite");
  // Squares and products of coordinates stay finite below this.
  if (std::abs(value.number) > 1e100) fail(value, what + " is " + text(value.number) + ", too large for a length");
  return value.number;
}

int PatternReader::index(const JsonValue& value, std::size_t count, const std::string& what) const {
  const double n = number(value, what);
  if (!(n == std::floor(n) && n >= 0 && n < static_cast<double>(count)))
    fail(value, what + " is " + text(n) + ", must be a whole number from 0 to " + std::to_string(count - 1));
  return static_cast<int>(n);
}

template <int N>
Eigen::Matrix<double, N, 1> PatternReader::vector(const JsonValue& value, const std::string& what) const {
  expect(value, JsonValue::Kind::array, what);
  if (value.items.size() != N)
    fail(value, what + " has " + std::to_string(value.items.size()) + " numbers, must have " + std::to_string(N));
  Eigen::Matrix<double, N, 1> out;
  for (int i = 0; i < N; ++i) out[i] = number(value.items[static_cast<std::size_t>(i)], what);
  return out;
}

void PatternReader::properties(const JsonValue& root) {
  const JsonValue* table = root.find("properties");
  const JsonValue* units = table ? table->find("units_in_meter") : nullptr;
  if (units) {
    units_in_metre_ = number(*units, "'units_in_meter'");
    if (!(units_in_metre_ >= 1e-6 && units_in_metre_ <= 1e9))
      fail(*units, "'units_in_meter' is " + text(units_in_metre_) + ", must be positive (100 for centimetres)");
  } else {
    warn(root, "'properties' has no 'units_in_meter'; centimetres are assumed");
  }
  const JsonValue* coordinates = table ? table->find("curvature_coords") : nullptr;
  if (!coordinates) return;
  const std::string& word = expect(*coordinates, JsonValue::Kind::string, "'curvature_coords'").text;
  if (word != "relative" && word != "absolute")
    fail(*coordinates, "'curvature_coords' is \"" + word + "\", must be \"relative\" or \"absolute\"");
  absolute_ = word == "absolute";
}

Curve2 PatternReader::curved(const JsonValue& value, const Vector2d& a, const Vector2d& b,
                             const std::vector<Vector2d>& params) const {
  const Vector2d along = b - a, across(-along.y(), along.x());
  const int degree = static_cast<int>(params.size()) + 1;
  Curve2::Points points(2, degree + 1);
  points.col(0) = a;
  for (int k = 1; k < degree; ++k) {
    const Vector2d& p = params[static_cast<std::size_t>(k) - 1];
    points.col(k) = absolute_ ? p : Vector2d(a + p.x() * along + p.y() * across);
  }
  points.col(degree) = b;
  if (!points.allFinite()) fail(value, "its control points are not finite");
  return Curve2(uniform_knots(degree, 1), std::move(points));
}

// [radius, large_arc, right]: the arc lies to the right of the edge's direction where `right` is true, and is the one
// that turns by more than half a circle where `large_arc` is.
Curve2 PatternReader::arc(const JsonValue& value, const Vector2d& a, const Vector2d& b, const JsonValue& params) const {
  if (params.items.size() != 3) fail(params, "a circle's params must be [radius, large_arc, right]");
  const auto flag = [&](const JsonValue& item, const char* what) {
    if (item.kind != JsonValue::Kind::boolean) expect(item, JsonValue::Kind::number, what);
    if (item.number != 0 && item.number != 1) fail(item, std::string(what) + " must be true or false, 1 or 0");
    return item.number == 1;
  };
  const double radius = number(params.items[0], "the radius");
  const bool large = flag(params.items[1], "large_arc"), right = flag(params.items[2], "right");
  const double half_chord = (b - a).norm() / 2;
  // Rounding may leave a half circle's radius a little short of half its chord.
  if (!(radius >= half_chord * (1 - 1e-9)))
    fail(params, "the radius is " + text(radius) + ", must be at least half the distance of the edge's ends, " +
                     text(half_chord));
  const double apothem = std::sqrt(std::max(0.0, (radius - half_chord) * (radius + half_chord)));
  const double half_turn = std::atan2(half_chord, large ? -apothem : apothem);
  try {
    return circular_arc_between(a, b, (right ? 2 : -2) * half_turn);
  } catch (const GeometryError& error) {
    fail(value, error.what());
  }
}

Curve2 PatternReader::edge(const JsonValue& value, const Vector2d& a, const Vector2d& b) {
  labels_ = labels_ || value.find("label");
  const JsonValue* curvature = value.find("curvature");
  if (!curvature || curvature->kind == JsonValue::Kind::null) return line_segment<2>(a, b);
  if (curvature->kind == JsonValue::Kind::array) {
    return curved(value, a, b, {vector<2>(*curvature, "'curvature'")});
  }
  expect(*curvature, JsonValue::Kind::object, "'curvature'");
  objects_ = true;
  const JsonValue& type = member(*curvature, "type", JsonValue::Kind::string);
  const JsonValue& params = member(*curvature, "params", JsonValue::Kind::array);
  if (type.text == "circle") return arc(value, a, b, params);
  if (type.text != "quadratic" && type.text != "cubic")
    fail(type, "curvature type is \"" + type.text + "\", must be \"quadratic\", \"cubic\" or \"circle\"");
  const std::size_t count = type.text == "cubic" ? 2 : 1;
  if (params.items.size() != count)
    fail(params, "a " + type.text + " edge has " + std::to_string(params.items.size()) + " control points, must have " +
                     std::to_string(count));
  std::vector<Vector2d> points;
  for (const JsonValue& item : params.items) points.push_back(vector<2>(item, "a control point"));
  return curved(value, a, b, points);
}

void PatternReader::panel(const std::string& name, const JsonValue& value) {
  where_ = "panel '" + name + "': ";
  expect(value, JsonValue::Kind::object, "a panel");
  labels_ = labels_ || value.find("label");
  std::vector<Vector2d> vertices;
  for (const JsonValue& item : member(value, "vertices", JsonValue::Kind::array).items)
    vertices.push_back(vector<2>(item, "vertex " + std::to_string(vertices.size())));
  PatternPlace place;
  if (const JsonValue* v = value.find("translation"))
    place.translate = vector<3>(*v, "'translation'") / units_in_metre_;
  if (const JsonValue* v = value.find("rotation")) place.rotate_deg = vector<3>(*v, "'rotation'");

  const JsonValue& edges = member(value, "edges", JsonValue::Kind::array);
  if (edges.items.empty()) fail(edges, "it has no edges");
  const int number_of_panel = static_cast<int>(out_.file.panels.size());
  std::vector<PatternEdge> places;
  std::vector<std::vector<TrimCurve>> loops(1);
  Vector2d first(0, 0), last(0, 0);
  int in_loop = 0;  // edges of this loop so far, those without length included
  for (std::size_t k = 0; k < edges.items.size(); ++k) {
    const JsonValue& item = edges.items[k];
    where_ = "panel '" + name + "': edge " + std::to_string(k) + ": ";
    expect(item, JsonValue::Kind::object, "an edge");
    const JsonValue& ends = member(item, "endpoints", JsonValue::Kind::array);
    if (ends.items.size() != 2) fail(ends, "'endpoints' must be two vertex numbers");
    if (vertices.empty()) fail(ends, "the panel has no vertices");
    const Vector2d from = vertices[static_cast<std::size_t>(index(ends.items[0], vertices.size(), "an endpoint"))];
    const Vector2d to = vertices[static_cast<std::size_t>(index(ends.items[1], vertices.size(), "an endpoint"))];
    TrimCurve trim;
    bool against = false;
    if (in_loop > 0 && from != last) {
      if (last == first) {
        loops.emplace_back();  // the loop is complete: this edge begins a hole
        in_loop = 0;
      } else if (to == last) {
        warn(item, "it runs against its neighbours; it is taken the other way round");
        against = true;
      } else {
        fail(ends, "it starts at (" + text(from.x()) + ", " + text(from.y()) + "), the edge before it ends at (" +
                       text(last.x()) + ", " + text(last.y()) + ")");
      }
    }
    if (in_loop == 0) first = from;
    trim.index = in_loop++;
    last = against ? from : to;
    if (from == to) {
      warn(item, "it has no length and is left out");
      places.push_back({-1, 0, 0});
      continue;
    }
    places.push_back({number_of_panel, static_cast<int>(loops.size()) - 1, trim.index});
    trim.curve = edge(item, from, to);
    if (against) trim.curve = reversed(trim.curve);
    loops.back().push_back(std::move(trim));
  }
  where_ = "panel '" + name + "': ";
  if (last != first)
    fail(edges, "its edges don't close: they end at (" + text(last.x()) + ", " + text(last.y()) + ") and start at (" +
                    text(first.x()) + ", " + text(first.y()) + ")");
  for (int k = static_cast<int>(loops.size()) - 1; k >= 0; --k) {
    if (!loops[static_cast<std::size_t>(k)].empty()) continue;
    loops.erase(loops.begin() + k);  // every edge of it was without length
    for (PatternEdge& p : places) p.loop -= p.loop > k;
  }
  // The outer loop is number 0; it is the largest.
  if (loops.size() > 1) {
    const auto largest =
        std::ranges::max_element(loops, {}, [](const auto& loop) { return std::abs(polygon_area(loop)); });
    const int at = static_cast<int>(largest - loops.begin());
    std::rotate(loops.begin(), largest, largest + 1);
    for (PatternEdge& p : places) p.loop = p.loop == at ? 0 : p.loop < at ? p.loop + 1 : p.loop;
  }
  const double mm = 1000 / units_in_metre_;
  TrimmedSurface face;
  try {
    face = flat_panel(std::move(loops), {{0, 0, 0}, {mm, 0, 0}, {0, mm, 0}, 0});
  } catch (const GeometryError& error) {
    fail(value, error.what());
  }
  face.name = name;
  face.metres_per_unit = 1e-3;
  face.resolution = out_.file.resolution;
  face.source = name_ + ":" + std::to_string(value.line);
  out_.file.panels.push_back(std::move(face));
  out_.places.push_back(place);
  edges_.push_back(std::move(places));
}

PatternEdge PatternReader::side(const JsonValue& value) const {
  expect(value, JsonValue::Kind::object, "a side");
  const JsonValue& name = member(value, "panel", JsonValue::Kind::string);
  const JsonValue& number = member(value, "edge", JsonValue::Kind::number);
  const auto found = std::ranges::find(out_.file.panels, name.text, &TrimmedSurface::name);
  if (found == out_.file.panels.end()) fail(name, "there is no panel '" + name.text + "'");
  const auto& edges = edges_[static_cast<std::size_t>(found - out_.file.panels.begin())];
  return edges[static_cast<std::size_t>(index(number, edges.size(), "'edge' of panel '" + name.text + "'"))];
}

void PatternReader::stitch(const JsonValue& value) {
  expect(value, JsonValue::Kind::array, "a stitch");
  // GarmentCode may add a word after the two sides.
  std::vector<const JsonValue*> sides;
  for (const JsonValue& item : value.items)
    if (item.kind != JsonValue::Kind::string && item.kind != JsonValue::Kind::boolean) sides.push_back(&item);
  if (sides.size() < 2) fail(value, "it has " + std::to_string(sides.size()) + " sides, must have 2");
  if (sides.size() > 2) {
    warn(value, "it joins " + std::to_string(sides.size()) + " edges and is left out; write one stitch a pair");
    return;
  }
  const PatternEdge a = side(*sides[0]), b = side(*sides[1]);
  if (a.panel < 0 || b.panel < 0) {
    warn(value, "one of its edges has no length; it is left out");
    return;
  }
  if (a.panel == b.panel && a.loop == b.loop && a.curve == b.curve) fail(value, "it joins an edge with itself");
  out_.stitches.push_back({a, b, value.line});
}

void PatternReader::read(const JsonValue& root) {
  expect(root, JsonValue::Kind::object, "a pattern file");
  properties(root);
  out_.file.unit = "MM";
  out_.file.metres_per_unit = 1e-3;
  out_.file.resolution = 1e-6;
  const JsonValue& pattern = member(root, "pattern", JsonValue::Kind::object);
  const JsonValue& panels = member(pattern, "panels", JsonValue::Kind::object);
  for (const auto& [name, value] : panels.members) panel(name, value);
  where_.clear();
  if (out_.file.panels.empty()) fail(panels, "the pattern has no panels");
  const JsonValue* stitches = pattern.find("stitches");
  if (stitches && stitches->kind != JsonValue::Kind::null) {
    expect(*stitches, JsonValue::Kind::array, "'stitches'");
    for (std::size_t k = 0; k < stitches->items.size(); ++k) {
      where_ = "stitch " + std::to_string(k) + ": ";
      stitch(stitches->items[k]);
    }
  }
  out_.soles_at_zero = objects_ || labels_;
}

}  // namespace

Pattern parse_pattern(std::string_view text, const std::string& name) {
  Pattern out;
  const JsonValue root = parse_json(text, name);
  PatternReader(name, out).read(root);
  return out;
}

Pattern read_pattern(const std::filesystem::path& path) {
  return parse_pattern(read_file(path, max_bytes), path.string());
}

}  // namespace toile
