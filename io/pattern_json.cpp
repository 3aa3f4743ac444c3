// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/pattern_json.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <optional>

#include "geometry/error.h"
#include "geometry/refine.h"
#include "geometry/text.h"
#include "io/encoding.h"
#include "io/file.h"
#include "io/flat_panel.h"
#include "io/json_document.h"
#include "io/limits.h"
#include "io/outline_repair.h"
#include "trimming/loops.h"

namespace toile {

namespace {

using Eigen::Vector2d;

constexpr std::uintmax_t max_bytes = std::uintmax_t{64} << 20;
constexpr double rounding_step = 1e-9;  // of numbers with all the digits of a double: patterns are some 100 units large

class PatternReader {
 public:
  PatternReader(const std::string& name, Pattern& out) : name_(name), out_(out) { out_.file.path = name; }
  void read(const JsonValue& root);

 private:
  std::string message(const JsonValue& at, const std::string& what) const {
    return name_ + ":" + std::to_string(at.line) + ": " + where_ + what;
  }
  [[noreturn]] void fail(const JsonValue& at, const std::string& what) const { throw InputError(message(at, what)); }
  void warn(const JsonValue& at, const std::string& what) { out_.file.warnings.push_back(message(at, what)); }
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
  struct Edges {
    std::vector<std::vector<TrimCurve>> chains;
    std::vector<int> first_of_chain;  // of each edge of the file: the number of its chain's first edge
    double step = 0;                  // of the file's numbers
  };
  struct ReadPanel {
    TrimmedSurface face;
    PatternPlace place;
    std::vector<PatternEdge> edges;  // panel -1: left out
    GluePanel glue;
  };
  void panel(const std::string& name, const JsonValue& value);
  ReadPanel read_panel(const std::string& name, const JsonValue& value);
  Edges edges_of(const std::string& panel, const JsonValue& value);
  std::vector<std::vector<TrimCurve>> loops_of(const JsonValue& value, Edges edges, std::vector<PanelMark>& marks);
  Curve2 edge(const JsonValue& value, const Vector2d& a, const Vector2d& b);
  Curve2 curved(const JsonValue& value, const Vector2d& a, const Vector2d& b,
                const std::vector<Vector2d>& params) const;
  Curve2 arc(const JsonValue& value, const Vector2d& a, const Vector2d& b, const JsonValue& params) const;
  void sew(const JsonValue& stitches);
  void stitch(const JsonValue& value);
  std::optional<PatternEdge> edge_of(const JsonValue& value);
  std::vector<PatternEdge> side(const JsonValue& value);
  double length(const PatternEdge& edge) const;
  void share_out(std::vector<std::vector<PatternEdge>> sides, Stitch& stitch) const;
  std::vector<GluePart> parts(const std::vector<PatternEdge>& side) const;
  void check_gluing();

  const std::string& name_;
  Pattern& out_;
  std::string where_;  // "panel 'front': edge 3: "
  double units_in_metre_ = 100;
  bool absolute_ = false;                        // control points in the panel's own coordinates
  bool labels_ = false, objects_ = false;        // what only the second dialect has
  std::vector<std::vector<PatternEdge>> edges_;  // per panel; panel -1: left out
  std::vector<GluePanel> glue_;                  // likewise
  std::vector<std::string> refused_;             // names
  std::exception_ptr first_refusal_;
  const std::vector<JsonValue>* stitches_ = nullptr;
  std::vector<int> numbers_;  // in the file, of out_.stitches
};

double PatternReader::number(const JsonValue& value, const std::string& what) const {
  expect(value, JsonValue::Kind::number, what);
  if (!std::isfinite(value.number)) fail(value, what + " must be finite");
  if (std::abs(value.number) > largest_number)
    fail(value, what + " is " + text(value.number) + ", too large for a length: at most 1e25");
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

// The edges of a panel as closed chains; a curve's index is the number of its edge.
PatternReader::Edges PatternReader::edges_of(const std::string& panel, const JsonValue& value) {
  std::vector<Vector2d> vertices;
  for (const JsonValue& item : member(value, "vertices", JsonValue::Kind::array).items)
    vertices.push_back(vector<2>(item, "vertex " + std::to_string(vertices.size())));
  const JsonValue& edges = member(value, "edges", JsonValue::Kind::array);
  if (edges.items.empty()) fail(edges, "it has no edges");
  Edges out;
  out.step = decimal_step(vertices);
  out.chains.emplace_back();
  Vector2d first(0, 0), last(0, 0);
  int start = 0;  // of this chain
  for (std::size_t k = 0; k < edges.items.size(); ++k) {
    const JsonValue& item = edges.items[k];
    where_ = "panel '" + panel + "': edge " + std::to_string(k) + ": ";
    expect(item, JsonValue::Kind::object, "an edge");
    const JsonValue& ends = member(item, "endpoints", JsonValue::Kind::array);
    if (ends.items.size() != 2) fail(ends, "'endpoints' must be two vertex numbers");
    if (vertices.empty()) fail(ends, "the panel has no vertices");
    const Vector2d from = vertices[static_cast<std::size_t>(index(ends.items[0], vertices.size(), "an endpoint"))];
    const Vector2d to = vertices[static_cast<std::size_t>(index(ends.items[1], vertices.size(), "an endpoint"))];
    bool against = false;
    if (static_cast<int>(k) > start && from != last) {
      if (last == first) {
        out.chains.emplace_back();  // the chain is complete: this edge begins a hole
        start = static_cast<int>(k);
      } else if (to == last) {
        warn(item, "it runs against its neighbours; it is taken the other way round");
        against = true;
      } else {
        fail(ends, "it starts at (" + text(from.x()) + ", " + text(from.y()) + "), the edge before it ends at (" +
                       text(last.x()) + ", " + text(last.y()) + ")");
      }
    }
    if (static_cast<int>(k) == start) first = from;
    last = against ? from : to;
    out.first_of_chain.push_back(start);
    if (from == to) {
      warn(item, "it has no length and is left out");
      continue;
    }
    TrimCurve trim;
    trim.index = static_cast<int>(k);
    trim.curve = edge(item, from, to);
    if (against) trim.curve = reversed(trim.curve);
    out.chains.back().push_back(std::move(trim));
  }
  where_ = "panel '" + panel + "': ";
  if (last != first)
    fail(edges, "its edges don't close: they end at (" + text(last.x()) + ", " + text(last.y()) + ") and start at (" +
                    text(first.x()) + ", " + text(first.y()) + ")");
  std::erase_if(out.chains, [](const auto& chain) { return chain.empty(); });
  return out;
}

// Slits and harmless crossings go, with a warning each; what still crosses itself makes no panel.
std::vector<std::vector<TrimCurve>> PatternReader::loops_of(const JsonValue& value, Edges edges,
                                                            std::vector<PanelMark>& marks) {
  const double step = std::max(edges.step, rounding_step);
  std::vector<std::vector<TrimCurve>> loops;
  for (std::vector<TrimCurve>& chain : edges.chains) {
    RepairedOutline repaired = repair_outline(std::move(chain), {rounding_step, harmless_steps * step});
    for (const OutlineChange& change : repaired.changes)
      warn(value, change.what + ", at (" + text(change.at.x()) + ", " + text(change.at.y()) + ")");
    for (Curve2& slit : repaired.slits) {
      PanelMark mark;
      mark.kind = MarkKind::slit;
      mark.at = slit.start();
      mark.curve = std::move(slit);
      marks.push_back(std::move(mark));
    }
    for (std::vector<TrimCurve>& loop : repaired.loops) {
      if (const std::string crossing = self_crossing(loop); !crossing.empty())
        throw GeometryError(message(value, crossing));
      loops.push_back(std::move(loop));
    }
  }
  if (loops.empty()) throw GeometryError(message(value, "its edges enclose nothing"));
  // The outer loop is number 0; it is the largest.
  const auto largest =
      std::ranges::max_element(loops, {}, [](const auto& loop) { return std::abs(polygon_area(loop)); });
  std::rotate(loops.begin(), largest, largest + 1);
  return loops;
}

PatternReader::ReadPanel PatternReader::read_panel(const std::string& name, const JsonValue& value) {
  where_ = "panel '" + name + "': ";
  expect(value, JsonValue::Kind::object, "a panel");
  if (name.empty()) fail(value, "it has no name");
  labels_ = labels_ || value.find("label");
  ReadPanel out;
  if (const JsonValue* v = value.find("translation"))
    out.place.translate = vector<3>(*v, "'translation'") / units_in_metre_;
  if (const JsonValue* v = value.find("rotation")) out.place.rotate_deg = vector<3>(*v, "'rotation'");
  const Edges edges = edges_of(name, value);
  std::vector<PanelMark> marks;
  std::vector<std::vector<TrimCurve>> loops = loops_of(value, edges, marks);
  out.edges.resize(edges.first_of_chain.size(), {-1, 0, 0});
  for (std::size_t l = 0; l < loops.size(); ++l) {
    for (TrimCurve& trim : loops[l]) {
      const auto k = static_cast<std::size_t>(trim.index);
      trim.index -= edges.first_of_chain[k];
      out.edges[k] = {static_cast<int>(out_.file.panels.size()), static_cast<int>(l), trim.index};
    }
  }
  const double mm = 1000 / units_in_metre_;
  try {
    out.face = flat_panel(std::move(loops), {{0, 0, 0}, {mm, 0, 0}, {0, mm, 0}, 0});
  } catch (const GeometryError& error) {
    fail(value, error.what());
  }
  out.face.name = name;
  out.face.metres_per_unit = 1e-3;
  out.face.resolution = out_.file.resolution;
  out.face.source = name_ + ":" + std::to_string(value.line);
  out.face.marks = std::move(marks);
  TrimmedSurface valid = out.face;
  validate_loops(valid);
  for (const TrimLoop& loop : out.face.loops) {
    const auto same = std::ranges::find(valid.loops, loop.index, &TrimLoop::index);
    GlueLoop glued;
    glued.material_left = same == valid.loops.end() || !same->curves.front().reversed;
    for (const TrimCurve& trim : loop.curves) glued.lengths.push_back(arc_length(trim.curve, trim.curve.domain()));
    out.glue.loops.push_back(std::move(glued));
  }
  return out;
}

// A panel that can't be is left out; the others stay.
void PatternReader::panel(const std::string& name, const JsonValue& value) {
  try {
    ReadPanel read = read_panel(name, value);
    out_.file.panels.push_back(std::move(read.face));
    out_.places.push_back(read.place);
    edges_.push_back(std::move(read.edges));
    glue_.push_back(std::move(read.glue));
  } catch (const Error& error) {
    if (!first_refusal_) first_refusal_ = std::current_exception();
    out_.file.refused.emplace_back(error.what());
    refused_.push_back(name);
  }
}

// Nothing where the edge is none of a panel that was read.
std::optional<PatternEdge> PatternReader::edge_of(const JsonValue& value) {
  expect(value, JsonValue::Kind::object, "a side");
  const JsonValue& name = member(value, "panel", JsonValue::Kind::string);
  const JsonValue& number = member(value, "edge", JsonValue::Kind::number);
  if (std::ranges::find(refused_, name.text) != refused_.end()) {
    warn(value, "panel '" + name.text + "' is left out, and with it what is sewn to it");
    return std::nullopt;
  }
  const auto found = std::ranges::find(out_.file.panels, name.text, &TrimmedSurface::name);
  if (found == out_.file.panels.end()) fail(name, "there is no panel '" + name.text + "'");
  const auto& edges = edges_[static_cast<std::size_t>(found - out_.file.panels.begin())];
  const PatternEdge edge =
      edges[static_cast<std::size_t>(index(number, edges.size(), "'edge' of panel '" + name.text + "'"))];
  if (edge.panel >= 0) return edge;
  warn(value, "edge " + text(number.number) + " of panel '" + name.text +
                  "' has no length or is a slit; nothing is sewn to it");
  return std::nullopt;
}

std::vector<PatternEdge> PatternReader::side(const JsonValue& value) {
  std::vector<PatternEdge> out;
  if (value.kind == JsonValue::Kind::array) {
    for (const JsonValue& item : value.items)
      if (const auto edge = edge_of(item)) out.push_back(*edge);
  } else if (const auto edge = edge_of(value)) {
    out.push_back(*edge);
  }
  return out;
}

double PatternReader::length(const PatternEdge& edge) const {
  const auto& loop = out_.file.panels[static_cast<std::size_t>(edge.panel)].loops[static_cast<std::size_t>(edge.loop)];
  const auto at = std::ranges::find(loop.curves, edge.curve, &TrimCurve::index) - loop.curves.begin();
  return glue_[static_cast<std::size_t>(edge.panel)]
      .loops[static_cast<std::size_t>(edge.loop)]
      .lengths[static_cast<std::size_t>(at)];
}

// One edge against all others: the first, unless the last is nearer to them in length.
void PatternReader::share_out(std::vector<std::vector<PatternEdge>> sides, Stitch& stitch) const {
  const auto gap = [&](std::size_t one) {
    double all = 0;
    for (const auto& side : sides)
      for (const PatternEdge& edge : side) all += length(edge);
    double alone = 0;
    for (const PatternEdge& edge : sides[one]) alone += length(edge);
    return std::abs(all - 2 * alone);
  };
  const bool last = sides.size() > 2 && gap(sides.size() - 1) < gap(0) * (1 - 1e-6);
  const std::size_t one = last ? sides.size() - 1 : 0;
  stitch.a = sides[one];
  for (std::size_t k = 0; k < sides.size(); ++k)
    if (k != one) stitch.b.insert(stitch.b.end(), sides[k].begin(), sides[k].end());
}

void PatternReader::stitch(const JsonValue& value) {
  expect(value, JsonValue::Kind::array, "a stitch");
  Stitch stitch;
  stitch.line = value.line;
  std::vector<std::vector<PatternEdge>> sides;
  std::size_t written = 0;
  for (const JsonValue& item : value.items) {
    if (item.kind == JsonValue::Kind::string && item.text == "right_wrong") {
      stitch.reverse = false;
    } else if (item.kind == JsonValue::Kind::string) {
      warn(item, "the word \"" + item.text + "\" is not known (\"right_wrong\" is) and ignored");
    } else if (item.kind != JsonValue::Kind::boolean) {
      ++written;
      sides.push_back(side(item));
    }
  }
  if (written < 2) fail(value, "it has " + std::to_string(written) + " sides, must have 2");
  std::erase_if(sides, [](const auto& side) { return side.empty(); });
  if (sides.size() < 2) return;  // said why
  const auto same = [](const PatternEdge& x, const PatternEdge& y) {
    return x.panel == y.panel && x.loop == y.loop && x.curve == y.curve;
  };
  for (std::size_t i = 0; i < sides.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      for (const PatternEdge& x : sides[i])
        if (std::ranges::any_of(sides[j], [&](const PatternEdge& y) { return same(x, y); }))
          fail(value, "it joins an edge with itself");
  share_out(std::move(sides), stitch);
  numbers_.push_back(static_cast<int>(&value - stitches_->data()));
  out_.stitches.push_back(std::move(stitch));
}

std::vector<GluePart> PatternReader::parts(const std::vector<PatternEdge>& side) const {
  std::vector<GluePart> out;
  for (const PatternEdge& e : side) {
    const auto& loop = out_.file.panels[static_cast<std::size_t>(e.panel)].loops[static_cast<std::size_t>(e.loop)];
    const auto at = std::ranges::find(loop.curves, e.curve, &TrimCurve::index) - loop.curves.begin();
    out.push_back({e.panel, e.loop, static_cast<int>(at)});
  }
  return out;
}

// Glues the garment: what is no surface is no garment that could be worn.
void PatternReader::check_gluing() {
  if (out_.stitches.empty()) return;
  std::vector<GlueSeam> seams;
  for (const Stitch& stitch : out_.stitches) seams.push_back({parts(stitch.a), parts(stitch.b), stitch.reverse});
  out_.gluing = glue(glue_, seams);
  const auto say = [&](int stitch, const std::string& what) {
    out_.file.warnings.push_back(name_ + ":" + std::to_string(out_.stitches[static_cast<std::size_t>(stitch)].line) +
                                 ": stitch " + std::to_string(numbers_[static_cast<std::size_t>(stitch)]) + ": " +
                                 what);
  };
  for (const Gluing::Oversewn& o : out_.gluing.oversewn) {
    const TrimmedSurface& face = out_.file.panels[static_cast<std::size_t>(o.edge.panel)];
    const TrimCurve& trim =
        face.loops[static_cast<std::size_t>(o.edge.loop)].curves[static_cast<std::size_t>(o.edge.edge)];
    std::string others;
    for (const int s : o.seams)
      others += (others.empty() ? "" : ", ") + std::to_string(numbers_[static_cast<std::size_t>(s)]);
    say(o.seams.back(), "curve " + std::to_string(o.edge.loop) + "," + std::to_string(trim.index) + " of panel '" +
                            face.name + "' is sewn more than once (stitches " + others +
                            "): more than two layers meet there, the garment is no surface");
  }
  for (const int s : out_.gluing.twisted) {
    if (!out_.stitches[static_cast<std::size_t>(s)].reverse) continue;  // right side to wrong side, as it says
    say(s,
        "with the stitches before it, it closes a band with a half twist: the garment has no right side. A stitch "
        "joins the start of one edge to the end of the other unless it says \"right_wrong\"");
  }
  for (const GluedPiece& piece : out_.gluing.pieces) {
    if (piece.panels.size() == 1 && piece.euler + piece.borders == 2) continue;  // nothing sewn, or a closed dart
    out_.file.notes.push_back(name_ + ": glued by its stitches, " + std::to_string(piece.panels.size()) +
                              " panels are one piece: Euler characteristic " + std::to_string(piece.euler) + ", " +
                              std::to_string(piece.borders) + " borders, " +
                              (!piece.manifold    ? "no surface"
                               : piece.orientable ? "orientable"
                                                  : "not orientable"));
  }
}

// A stitch that can't be is left out with a warning; the panels and the other stitches stay.
void PatternReader::sew(const JsonValue& stitches) {
  if (stitches.kind != JsonValue::Kind::array)
    return warn(stitches,
                std::string("'stitches' must be an array, not ") + stitches.kind_name() + "; nothing is sewn");
  stitches_ = &stitches.items;
  for (std::size_t k = 0; k < stitches.items.size(); ++k) {
    where_ = "stitch " + std::to_string(k) + ": ";
    try {
      stitch(stitches.items[k]);
    } catch (const InputError& error) {
      out_.file.warnings.push_back(std::string(error.what()) + "; the stitch is left out");
    }
  }
  where_.clear();
  check_gluing();
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
  if (out_.file.panels.empty() && first_refusal_) std::rethrow_exception(first_refusal_);
  if (out_.file.panels.empty()) fail(panels, "the pattern has no panels");
  const JsonValue* stitches = pattern.find("stitches");
  if (stitches && stitches->kind != JsonValue::Kind::null) sew(*stitches);
  out_.soles_at_zero = objects_ || labels_;
}

}  // namespace

Pattern parse_pattern(std::string_view text, const std::string& name) {
  Pattern out;
  std::string converted;
  if (!valid_utf8(text)) {
    const bool wide = text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff");  // a byte order mark
    converted = from_codepage(std::string(text), wide ? "UTF-16" : "");
    text = converted;
    if (!wide)
      out.file.warnings.push_back(
          name +
          ": it isn't UTF-8, as JSON must be; it is read as Latin-1, so names may be wrong: save "
          "it as UTF-8");
  }
  const JsonValue root = parse_json(text, name);
  PatternReader(name, out).read(root);
  return out;
}

Pattern read_pattern(const std::filesystem::path& path) {
  return parse_pattern(read_file(path, max_bytes), path.string());
}

}  // namespace toile
