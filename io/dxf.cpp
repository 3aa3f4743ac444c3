#include "io/dxf.h"

#include <dxflib/dl_creationadapter.h>
#include <dxflib/dl_dxf.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <sstream>

#include "geometry/error.h"
#include "geometry/text.h"
#include "io/file.h"
#include "io/outlines.h"

namespace toile {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::uintmax_t max_bytes = std::uintmax_t{256} << 20;
constexpr double corner_angle = 20 * std::numbers::pi / 180;  // a sharper turn of a polyline begins a new curve

std::string trimmed(std::string_view text) {
  const auto space = [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; };
  while (!text.empty() && space(text.front())) text.remove_prefix(1);
  while (!text.empty() && space(text.back())) text.remove_suffix(1);
  return std::string(text);
}

// The file cut into pairs of group code and value, with the entities that we don't read taken out: dxflib allocates
// what polylines, splines and hatches claim.
struct Cut {
  std::string text;
  std::vector<int> lines;  // where each entity and block begins that dxflib will announce
  std::map<std::string, int> unread;
};

Cut cut(std::string_view text, const std::string& name) {
  static const std::set<std::string, std::less<>> known{"SECTION",  "ENDSEC", "EOF",    "BLOCK",  "ENDBLK",
                                                        "POLYLINE", "VERTEX", "SEQEND", "LINE",   "POINT",
                                                        "TEXT",     "ARC",    "CIRCLE", "INSERT", "LWPOLYLINE"};
  static const std::set<std::string, std::less<>> announced{"BLOCK", "POLYLINE", "LWPOLYLINE", "LINE",
                                                            "POINT", "TEXT",     "ARC",        "CIRCLE"};
  Cut out;
  std::string section;
  bool keep = true, ended = false;
  int line = 0;
  const auto next_line = [&]() -> std::optional<std::string_view> {
    if (text.empty()) return std::nullopt;
    const std::size_t end = text.find('\n');
    std::string_view out_line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (out_line.ends_with('\r')) out_line.remove_suffix(1);
    ++line;
    return out_line;
  };
  const auto fail = [&](const std::string& what) { throw InputError(name + ":" + std::to_string(line) + ": " + what); };
  while (!ended) {
    const auto code_text = next_line();
    if (!code_text) fail("the file ends without EOF");
    const std::string code_word = trimmed(*code_text);
    int code = -1;
    const auto [end, error] = std::from_chars(code_word.data(), code_word.data() + code_word.size(), code);
    if (error != std::errc() || end != code_word.data() + code_word.size() || code < 0 || code > 1071)
      fail("'" + code_word.substr(0, 40) + "' is no group code of a DXF file");
    const auto value_text = next_line();
    if (!value_text) fail("group code " + code_word + " has no value: the file ends here");
    const std::string value = trimmed(*value_text);
    if (value.size() > 900) fail("a value has " + std::to_string(value.size()) + " characters, may have 900");
    if (code == 999) continue;  // comment
    if (code == 0) {
      ended = value == "EOF";
      if (value == "ENDSEC") section.clear();
      const bool content = section == "BLOCKS" || section == "ENTITIES";
      keep = section.empty() || known.contains(value);
      // Styles, views and objects say nothing about pieces.
      if (section == "TABLES" || section == "OBJECTS" || section == "CLASSES") keep = value == "ENDSEC" || ended;
      if (!keep && content) ++out.unread[value];
    } else if (code == 2 && section.empty()) {
      section = value;
    }
    if (code == 90 || code == 70 || code == 71 || code == 72) {
      // Counts and flags: small whole numbers, and no count above what the file could hold.
      int claim = 0;
      const auto [claim_end, claim_error] = std::from_chars(value.data(), value.data() + value.size(), claim);
      if (keep && !section.empty() && section != "HEADER" &&
          (claim_error != std::errc() || claim < 0 ||
           (code == 90 && static_cast<std::size_t>(claim) > text.size() / 4)))
        fail("group code " + code_word + " is '" + value.substr(0, 40) +
             "', must be a whole number that the file can hold");
    }
    if (!keep) continue;
    if (code >= 10 && code <= 59 && section != "HEADER") {
      double number = 0;
      const std::string_view digits =
          value.starts_with('+') ? std::string_view(value).substr(1) : std::string_view(value);
      const auto [number_end, number_error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
      if (number_error != std::errc() || number_end != digits.data() + digits.size() || !std::isfinite(number) ||
          std::abs(number) > 1e100)
        fail("group code " + code_word + " is '" + value.substr(0, 40) + "', must be a number");
    }
    out.text += code_word + "\n" + value + "\n";
    if (code == 0 && announced.contains(value)) out.lines.push_back(line - 1);
  }
  return out;
}

struct Polyline {
  std::vector<Vector2d> points;
  std::vector<double> bulges;  // of the segment after each point
  double height = 0;
  bool closed = false;
};

struct Item {
  int line = 0;
  std::string layer;
  std::vector<Polyline> lines;  // a polyline, line or arc
  std::optional<Curve2> curve;  // an arc or circle
  std::optional<Vector2d> point;
  std::string text;
};

struct Block {
  std::string name;
  int line = 0;
  std::vector<Item> items;
};

class Listener : public DL_CreationAdapter {
 public:
  explicit Listener(const std::vector<int>& lines) : lines_(lines) { blocks.push_back({}); }
  std::vector<Block> blocks;  // the first: entities outside of blocks

  void addBlock(const DL_BlockData& data) override {
    blocks.push_back({data.name, next_line(), {}});
    current_ = blocks.size() - 1;
  }
  void endBlock() override { current_ = 0; }
  void addPoint(const DL_PointData& p) override { item().point = Vector2d(p.x, p.y); }
  void addLine(const DL_LineData& l) override {
    item().lines.push_back({{{l.x1, l.y1}, {l.x2, l.y2}}, {0, 0}, l.z1, false});
  }
  void addPolyline(const DL_PolylineData& p) override {
    item().lines.push_back({{}, {}, p.elevation, (p.flags & 1) != 0});
    // Meshes and fitted splines are other things in the same clothes.
    if ((p.flags & (16 | 64)) != 0) item_->lines.clear();
  }
  void addVertex(const DL_VertexData& v) override {
    if (!item_ || item_->lines.empty()) return;
    item_->lines.back().points.emplace_back(v.x, v.y);
    item_->lines.back().bulges.push_back(v.bulge);
  }
  void addArc(const DL_ArcData& a) override {
    double from = a.angle1 * std::numbers::pi / 180, to = a.angle2 * std::numbers::pi / 180;
    // One turn at most, counter-clockwise.
    to = from + std::fmod(to - from, 2 * std::numbers::pi);
    if (to <= from) to += 2 * std::numbers::pi;
    add_circle({a.cx, a.cy}, a.radius, from, to);
  }
  void addCircle(const DL_CircleData& c) override { add_circle({c.cx, c.cy}, c.radius, 0, 2 * std::numbers::pi); }
  void addText(const DL_TextData& t) override {
    Item& text = item();
    text.point = Vector2d(t.ipx, t.ipy);
    text.text = trimmed(t.text);
  }

 private:
  int next_line() { return announced_ < lines_.size() ? lines_[announced_++] : 0; }
  Item& item() {
    Block& block = blocks[current_];
    block.items.push_back({next_line(), attributes.getLayer(), {}, {}, {}, {}});
    item_ = &block.items.back();
    return *item_;
  }
  void add_circle(const Vector2d& centre, double radius, double from, double to) {
    Item& arc = item();
    if (radius > 0 && to > from) arc.curve = circular_arc(centre, radius, from, to);
  }

  const std::vector<int>& lines_;
  std::size_t announced_ = 0, current_ = 0;
  Item* item_ = nullptr;  // the newest; polyline vertices follow at once
};

double turn(const Vector2d& before, const Vector2d& after) {
  return std::abs(std::atan2(before.x() * after.y() - before.y() * after.x(), before.dot(after)));
}

Curve3 lifted(const Curve2& flat, double height) {
  Eigen::Matrix3Xd points(3, flat.points().cols());
  points.topRows<2>() = flat.points();
  points.row(2).setConstant(height);
  return Curve3(flat.knots(), std::move(points), flat.weights());
}

Curve2 polyline_curve(const std::vector<Vector2d>& points) {
  Curve2::Points p(2, static_cast<Eigen::Index>(points.size()));
  std::vector<double> knots{0};
  for (std::size_t k = 0; k < points.size(); ++k) {
    p.col(static_cast<Eigen::Index>(k)) = points[k];
    knots.push_back(static_cast<double>(k));
  }
  knots.push_back(static_cast<double>(points.size()) - 1);
  return Curve2(KnotVector(1, std::move(knots)), std::move(p));
}

// A polyline as curves: arcs where it bulges, polylines between corners.
std::vector<Curve3> curves_of(Polyline line, const std::vector<Vector2d>& turn_points) {
  // Points that repeat say nothing.
  Polyline clean;
  clean.closed = line.closed;
  for (std::size_t k = 0; k < line.points.size(); ++k) {
    if (!clean.points.empty() && clean.points.back() == line.points[k]) {
      clean.bulges.back() = line.bulges[k];
      continue;
    }
    clean.points.push_back(line.points[k]);
    clean.bulges.push_back(line.bulges[k]);
  }
  if (clean.points.size() > 2 && clean.points.front() == clean.points.back()) {
    clean.points.pop_back();
    clean.bulges.pop_back();
    clean.closed = true;
  }
  const std::size_t n = clean.points.size();
  if (n < 2) return {};
  const std::size_t segments = clean.closed ? n : n - 1;
  const auto point = [&](std::size_t k) { return clean.points[k % n]; };
  const auto corner = [&](std::size_t k) {
    if (!turn_points.empty()) return std::ranges::find(turn_points, point(k)) != turn_points.end();
    return turn(point(k) - point(k + n - 1), point(k + 1) - point(k)) > corner_angle;
  };
  // A closed one starts at its first corner, so that no curve is cut where the file happens to begin.
  std::size_t start = 0;
  if (clean.closed)
    while (start < n && !corner(start)) ++start;
  if (start == n) start = 0;
  std::vector<Curve3> out;
  std::vector<Vector2d> run{point(start)};
  const auto flush = [&] {
    if (run.size() > 1) out.push_back(lifted(polyline_curve(run), line.height));
    run = {run.back()};
  };
  for (std::size_t k = start; k < start + segments; ++k) {
    const double bulge = clean.bulges[k % n];
    if (bulge != 0 && std::abs(bulge) < 1e6) {
      flush();
      out.push_back(lifted(circular_arc_between(point(k), point(k + 1), 4 * std::atan(bulge)), line.height));
      run = {point(k + 1)};
      continue;
    }
    run.push_back(point(k + 1));
    if (k + 1 < start + segments && corner((k + 1) % n)) flush();
  }
  flush();
  return out;
}

std::vector<Curve3> curves_of(const Item& item, const std::vector<Vector2d>& turn_points) {
  std::vector<Curve3> out;
  if (item.curve) out.push_back(lifted(*item.curve, 0));
  for (const Polyline& line : item.lines) {
    const std::vector<Curve3> pieces = curves_of(line, turn_points);
    out.insert(out.end(), pieces.begin(), pieces.end());
  }
  return out;
}

// "Piece Name: FRONT" -> "FRONT" for the key "piece name".
std::optional<std::string> value_of(const std::string& text, std::string_view key) {
  if (text.size() <= key.size() || text[key.size()] != ':') return std::nullopt;
  for (std::size_t k = 0; k < key.size(); ++k)
    if (std::tolower(static_cast<unsigned char>(text[k])) != key[k]) return std::nullopt;
  return trimmed(std::string_view(text).substr(key.size() + 1));
}

// A mirror line (layer 6): a piece drawn as one half of itself, cut on the fold.
struct Mirror {
  Vector2d at, along;  // a point, the direction (a unit vector)

  Vector2d operator()(const Vector2d& p) const { return at + 2 * along.dot(p - at) * along - (p - at); }
  double distance(const Vector2d& p) const { return std::abs(along.x() * (p - at).y() - along.y() * (p - at).x()); }
};

std::optional<Mirror> mirror_of(const Item& item) {
  if (item.layer != "6" || item.point) return std::nullopt;
  const std::vector<Curve3> curves = curves_of(item, {});
  if (curves.size() != 1 || curves[0].degree() != 1 || curves[0].points().cols() != 2) return std::nullopt;
  const Vector2d a = curves[0].start().head<2>(), b = curves[0].end().head<2>();
  if (a == b) return std::nullopt;
  return Mirror{a, (b - a).normalized()};
}

Curve3 mirrored(const Mirror& mirror, const Curve3& curve) {
  Eigen::Matrix3Xd points = curve.points();
  for (Eigen::Index k = 0; k < points.cols(); ++k) points.col(k).head<2>() = mirror(points.col(k).head<2>());
  return Curve3(curve.knots(), std::move(points), curve.weights());
}

// The edges on the mirror line go, all others come a second time. False, and nothing done, where no edge lies on it.
bool unfold(std::vector<LooseCurve>& curves, const Mirror& mirror, double tolerance) {
  const auto on_line = [&](const Curve3& c) {
    for (Eigen::Index k = 0; k < c.points().cols(); ++k)
      if (mirror.distance(c.points().col(k).head<2>()) > tolerance) return false;
    return true;
  };
  std::size_t gone = 0;
  for (LooseCurve& loose : curves) gone += std::erase_if(loose.pieces, on_line);
  if (gone == 0) return false;
  const std::size_t drawn = curves.size();
  for (std::size_t k = 0; k < drawn; ++k) {
    LooseCurve image = curves[k];
    for (Curve3& c : image.pieces) c = mirrored(mirror, c);
    curves.push_back(std::move(image));
  }
  return true;
}

class DxfReader {
 public:
  DxfReader(const std::string& name, PanelFile& out) : name_(name), out_(out) { out_.path = name; }
  void read(std::string_view text);

 private:
  void find_unit(const std::vector<Block>& blocks);
  void piece(const Block& block);
  void add_mark(std::vector<TrimmedSurface>& panels, const Item& item, const std::optional<Mirror>& mirror);
  void warn(int line, const std::string& what) {
    out_.warnings.push_back(name_ + ":" + std::to_string(line) + ": " + what);
  }

  const std::string& name_;
  PanelFile& out_;
  std::vector<std::string> sizes_;  // of out_.panels
};

void DxfReader::find_unit(const std::vector<Block>& blocks) {
  out_.unit = "MM";
  out_.metres_per_unit = 1e-3;
  for (const Block& block : blocks) {
    for (const Item& item : block.items) {
      const std::optional<std::string> unit = value_of(item.text, "units");
      if (!unit) continue;
      std::string word = *unit;
      std::ranges::transform(word, word.begin(), [](unsigned char c) { return std::toupper(c); });
      if (word == "ENGLISH") {
        out_.unit = "INCH";
        out_.metres_per_unit = 0.0254;
        return;
      }
      if (word != "METRIC")
        warn(item.line, "the units are '" + *unit + "', neither METRIC nor ENGLISH; millimetres are assumed");
      return;
    }
  }
  out_.warnings.push_back(name_ + ": no text 'Units: METRIC' or 'Units: ENGLISH'; millimetres are assumed");
}

// On an unfolded piece notches, holes and lines come twice; grain lines and texts don't.
void DxfReader::add_mark(std::vector<TrimmedSurface>& panels, const Item& item, const std::optional<Mirror>& mirror) {
  // A block has one piece as a rule; else the first whose box holds the mark.
  const auto add_one = [&](PanelMark mark) {
    for (TrimmedSurface& panel : panels) {
      const Interval u = panel.surface.u().domain(), v = panel.surface.v().domain();
      if (panels.size() > 1 && !(u.contains(mark.at.x()) && v.contains(mark.at.y()))) continue;
      panel.marks.push_back(std::move(mark));
      return;
    }
  };
  const auto add = [&](const PanelMark& mark) {
    add_one(mark);
    if (!mirror || item.layer == "6" || mark.kind == MarkKind::grain || mark.kind == MarkKind::text) return;
    PanelMark image = mark;
    image.at = (*mirror)(mark.at);
    if (image.curve) {
      Curve2::Points points = image.curve->points();
      for (Eigen::Index k = 0; k < points.cols(); ++k) points.col(k) = (*mirror)(points.col(k));
      image.curve = Curve2(image.curve->knots(), std::move(points), image.curve->weights());
    }
    add_one(std::move(image));
  };
  PanelMark mark;
  const std::string& layer = item.layer;
  const bool notch = layer == "4" || layer == "80" || layer == "81" || layer == "82" || layer == "83";
  if (item.point) {
    mark.at = *item.point;
    mark.text = item.text;
    if (!item.text.empty()) {
      mark.kind = MarkKind::text;
    } else if (notch) {
      mark.kind = MarkKind::notch;
    } else if (layer == "13") {
      mark.kind = MarkKind::drill;
    } else {
      return;  // turn, curve and grading points are how the boundary is drawn
    }
    add(mark);
    return;
  }
  for (const Curve3& curve : curves_of(item, {})) {
    mark.curve = Curve2(curve.knots(), curve.points().topRows<2>(), curve.weights());
    mark.at = mark.curve->start();
    mark.kind = layer == "7" && mark.curve->degree() == 1 ? MarkKind::grain : notch ? MarkKind::notch : MarkKind::line;
    add(mark);
  }
}

void DxfReader::piece(const Block& block) {
  std::vector<Vector2d> turn_points;
  for (const Item& item : block.items)
    if (item.layer == "2" && item.point) turn_points.push_back(*item.point);
  const auto boundary = [](const Item& item) { return item.layer == "1" || item.layer == "11"; };
  std::vector<LooseCurve> curves;
  std::string name = block.name, size;
  for (const Item& item : block.items) {
    if (const auto value = value_of(item.text, "piece name")) name = *value;
    if (const auto value = value_of(item.text, "size")) size = *value;
    if (!boundary(item) || item.point) continue;
    LooseCurve loose{static_cast<int>(&item - block.items.data()), {}, curves_of(item, turn_points)};
    if (!loose.pieces.empty()) curves.push_back(std::move(loose));
  }
  if (curves.empty()) return;
  std::optional<Mirror> mirror;
  for (const Item& item : block.items) {
    const std::optional<Mirror> line = mirror_of(item);
    if (!line || mirror) continue;
    if (unfold(curves, *line, 10 * out_.resolution)) {
      mirror = line;
    } else {
      warn(item.line, "piece '" + name + "': no edge lies on its mirror line; it stays as it is drawn");
    }
  }
  Outlines found = find_outlines(std::move(curves), {}, 0);
  for (const OutlineNote& note : found.notes)
    warn(block.items[static_cast<std::size_t>(note.id)].line, "piece '" + name + "': " + note.what);
  if (found.panels.empty()) warn(block.line, "piece '" + name + "' has no closed boundary and is left out");
  for (const Item& item : block.items)
    if (!boundary(item) || item.point) add_mark(found.panels, item, mirror);
  for (std::size_t k = 0; k < found.panels.size(); ++k) {
    TrimmedSurface& panel = found.panels[k];
    panel.name = name;
    panel.metres_per_unit = out_.metres_per_unit;
    panel.resolution = out_.resolution;
    panel.source = name_ + ":" + std::to_string(block.items[static_cast<std::size_t>(found.ids[k])].line);
    out_.panels.push_back(std::move(panel));
    sizes_.push_back(size);
  }
}

void DxfReader::read(std::string_view text) {
  const Cut pairs = cut(text, name_);
  Listener listener(pairs.lines);
  DL_Dxf dxf;
  std::istringstream stream(pairs.text);
  try {
    if (!dxf.in(stream, &listener)) throw InputError(name_ + ": dxflib could not read it");
  } catch (const GeometryError& error) {
    throw InputError(name_ + ": an arc: " + error.what());
  }
  find_unit(listener.blocks);
  out_.resolution = out_.unit == "MM" ? 1e-3 : 1e-4;
  for (const Block& block : listener.blocks) {
    try {
      piece(block);
    } catch (const GeometryError& error) {
      warn(block.line, "piece '" + block.name + "': " + error.what() + "; it is left out");
    }
  }
  for (const auto& [type, count] : pairs.unread)
    out_.warnings.push_back(name_ + ": " + type + ": " + std::to_string(count) + " not read");
  if (out_.panels.empty()) throw InputError(name_ + ": no piece with a closed boundary on layer 1");
  // Names that several pieces share get their size, then a number.
  std::map<std::string, int> seen;
  for (const TrimmedSurface& panel : out_.panels) ++seen[panel.name];
  std::map<std::string, int> again;
  for (std::size_t k = 0; k < out_.panels.size(); ++k) {
    std::string& name = out_.panels[k].name;
    if (name.empty()) name = "piece";
    if (seen[name] > 1 && !sizes_[k].empty()) name += " " + sizes_[k];
    const int n = ++again[name];
    if (n > 1) name += " " + std::to_string(n);
  }
}

}  // namespace

PanelFile parse_dxf(std::string_view text, const std::string& name) {
  PanelFile out;
  DxfReader(name, out).read(text);
  return out;
}

PanelFile read_dxf(const std::filesystem::path& path) {
  return parse_dxf(read_file(path, max_bytes), path.string());
}

}  // namespace toile
