// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/dxf/drawing.h"

#include <dxflib/dl_creationadapter.h>
#include <dxflib/dl_dxf.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <sstream>

#include "geometry/error.h"
#include "geometry/refine.h"
#include "io/dxf/pairs.h"
#include "io/encoding.h"
#include "io/flat_panel.h"
#include "io/limits.h"

namespace toile::dxf {

namespace {

using Eigen::Vector2d;

constexpr double degree = std::numbers::pi / 180;

// "\M+5BAF3": the two bytes of a letter in the code page that the digit says.
std::string with_page_escapes(const std::string& text) {
  constexpr std::array<const char*, 5> pages{"CP932", "CP950", "CP949", "CP1361", "GB18030"};
  std::string out;
  for (std::size_t k = 0; k < text.size(); ++k) {
    const bool escape = text.compare(k, 3, "\\M+") == 0 && k + 8 <= text.size() && text[k + 3] >= '1' &&
                        text[k + 3] <= '5' && text.find_first_not_of("0123456789abcdefABCDEF", k + 4) >= k + 8;
    if (!escape) {
      out += text[k];
      continue;
    }
    const unsigned long code = std::stoul(text.substr(k + 4, 4), nullptr, 16);
    const std::string bytes{static_cast<char>(code >> 8), static_cast<char>(code & 0xffu)};
    out += from_codepage(bytes, pages[static_cast<std::size_t>(text[k + 3] - '1')]);
    k += 7;
  }
  return out;
}

// "\U+00D6" is a letter by its number.
std::string with_escapes(const std::string& escaped) {
  const std::string text = with_page_escapes(escaped);
  std::string out;
  for (std::size_t k = 0; k < text.size(); ++k) {
    unsigned code = 0;
    const bool escape = text.compare(k, 3, "\\U+") == 0 && k + 7 <= text.size() &&
                        text.find_first_not_of("0123456789abcdefABCDEF", k + 3) >= k + 7;
    if (escape) code = static_cast<unsigned>(std::stoul(text.substr(k + 3, 4), nullptr, 16));
    if (!escape || code == 0 || (code >= 0xd800 && code < 0xe000)) {
      out += text[k];
      continue;
    }
    if (code < 0x80) {
      out += static_cast<char>(code);
    } else if (code < 0x800) {
      out += static_cast<char>(0xc0u | (code >> 6));
      out += static_cast<char>(0x80u | (code & 0x3fu));
    } else {
      out += static_cast<char>(0xe0u | (code >> 12));
      out += static_cast<char>(0x80u | ((code >> 6) & 0x3fu));
      out += static_cast<char>(0x80u | (code & 0x3fu));
    }
    k += 6;
  }
  return out;
}

// Derivatives that are finite (io/limits.h).
void require_moderate(const Spline& s) {
  if (s.degree < 1) throw GeometryError("its degree is " + std::to_string(s.degree) + ", must be at least 1");
  for (std::size_t k = 1; k < s.knots.size(); ++k)
    if (const double span = s.knots[k] - s.knots[k - 1]; span > 0 && span < smallest_span)
      throw GeometryError("its knots " + std::to_string(k - 1) + " and " + std::to_string(k) +
                          " must be equal or at least 1e-25 apart");
  if (s.weights.empty()) return;
  const auto [least, most] = std::ranges::minmax(s.weights);
  if (least > 0 && most > largest_weight_ratio * least)
    throw GeometryError("its weights must be within a factor of 1e15");
}

class Listener : public DL_CreationAdapter {
 public:
  Listener(const Pairs& pairs, const std::string& name, Drawing& out) : pairs_(pairs), name_(name), out_(out) {
    out_.blocks.emplace_back();
    const auto codepage = pairs.header.find("$DWGCODEPAGE");
    if (codepage != pairs.header.end()) codepage_ = codepage_of_dxf(codepage->second);
    of_codepage_ = several_bytes(codepage_) && !valid_utf8(pairs.text);
  }

  void addBlock(const DL_BlockData& data) override {
    out_.blocks.push_back({decoded(data.name), next_line(), {data.bpx, data.bpy}, {}});
    current_ = out_.blocks.size() - 1;
    item_ = nullptr;
  }
  void endBlock() override {
    current_ = 0;
    item_ = nullptr;
  }
  void addPoint(const DL_PointData& p) override { item("POINT").point = Vector2d(p.x, p.y); }
  void addLine(const DL_LineData& l) override {
    item("LINE").lines.push_back({{{l.x1, l.y1}, {l.x2, l.y2}}, {0, 0}, l.z1, false});
  }
  void addPolyline(const DL_PolylineData& p) override {
    item("POLYLINE").lines.push_back({{}, {}, p.elevation, (p.flags & 1) != 0});
    // Meshes are other things in the same clothes.
    if ((p.flags & (16 | 64)) != 0) item_->lines.clear();
    below_ = from_below();  // the vertices of a POLYLINE are entities of their own that don't say it
  }
  void addVertex(const DL_VertexData& v) override {
    if (!item_ || item_->lines.empty()) return;
    item_->lines.back().points.emplace_back(below_ ? -v.x : v.x, v.y);
    item_->lines.back().bulges.push_back(below_ ? -v.bulge : v.bulge);
  }
  void addArc(const DL_ArcData& a) override {
    // One turn at most, counter-clockwise.
    const double from = a.angle1 * degree;
    double to = from + std::fmod(a.angle2 * degree - from, 2 * std::numbers::pi);
    if (to <= from) to += 2 * std::numbers::pi;
    add_circle("ARC", {a.cx, a.cy}, a.radius, from, to);
  }
  void addCircle(const DL_CircleData& c) override {
    add_circle("CIRCLE", {c.cx, c.cy}, c.radius, 0, 2 * std::numbers::pi);
  }
  // The affine image of an arc of the unit circle.
  void addEllipse(const DL_EllipseData& e) override {
    Item& ellipse = item("ELLIPSE");
    const bool turned = from_below();
    Affine map;
    map.linear.col(0) = Vector2d(e.mx, e.my);
    map.linear.col(1) = (turned ? -e.ratio : e.ratio) * Vector2d(-e.my, e.mx);
    map.shift = {e.cx, e.cy};
    double to = e.angle1 + std::fmod(e.angle2 - e.angle1, 2 * std::numbers::pi);
    if (to <= e.angle1 + 1e-12) to += 2 * std::numbers::pi;
    if (map.linear.determinant() != 0 && std::isfinite(to))
      ellipse.curves.push_back(mapped(map, circular_arc({0, 0}, 1, e.angle1, to)));
  }
  void addSpline(const DL_SplineData&) override {
    Item& item_of_spline = item("SPLINE");
    if (splines_ >= pairs_.splines.size()) return;
    const Spline& s = pairs_.splines[splines_++];
    const std::string where = name_ + ":" + std::to_string(item_of_spline.line) + ": SPLINE: ";
    if (s.points.empty()) {
      out_.warnings.push_back(where + "it has " + std::to_string(s.fit_points) +
                              " fit points and no control points; it is not read");
      return;
    }
    try {
      Curve2::Points points(2, static_cast<Eigen::Index>(s.points.size()));
      for (std::size_t k = 0; k < s.points.size(); ++k)
        points.col(static_cast<Eigen::Index>(k)) = s.points[k].head<2>();
      if (!s.weights.empty() && s.weights.size() != s.points.size())
        throw GeometryError("it has " + std::to_string(s.weights.size()) + " weights for " +
                            std::to_string(s.points.size()) + " control points");
      require_moderate(s);
      item_of_spline.curves.push_back(clamp(Curve2(KnotVector(s.degree, s.knots), std::move(points), s.weights)));
    } catch (const GeometryError& error) {
      out_.warnings.push_back(where + error.what() + "; it is not read");
    }
  }
  void addInsert(const DL_InsertData& i) override {
    Insert insert;
    insert.block = decoded(i.name);
    const double angle = i.angle * degree;
    const bool turned = from_below();
    // Exact for right angles, which is what pieces are turned by.
    const auto round = [](double x) { return std::abs(x - std::round(x)) < 1e-15 ? std::round(x) : x; };
    const double c = round(std::cos(angle)), s = round(std::sin(angle));
    insert.map.linear << c * i.sx, -s * i.sy, s * i.sx, c * i.sy;
    insert.map.shift = {i.ipx, i.ipy};
    if (turned) {
      insert.map.linear.row(0) *= -1;
      insert.map.shift.x() *= -1;
    }
    Item& placed = item("INSERT");
    const auto warn = [&](const std::string& what) {
      out_.warnings.push_back(name_ + ":" + std::to_string(placed.line) + ": INSERT: block '" + insert.block + "' " +
                              what);
    };
    if (i.sx == 0 || i.sy == 0) warn("has the scale 0 and so no area");
    if (current_ != 0 && (i.cols > 1 || i.rows > 1))
      warn("is inserted " + std::to_string(i.cols) + " x " + std::to_string(i.rows) +
           " times; the first is read: explode it before exporting");
    placed.insert = std::move(insert);
  }
  void addText(const DL_TextData& t) override { add_text("TEXT", {t.ipx, t.ipy}, t.text); }
  void addMTextChunk(const std::string& chunk) override { mtext_ += chunk; }
  void addMText(const DL_MTextData& t) override {
    add_text("MTEXT", {t.ipx, t.ipy}, mtext_ + t.text);
    mtext_.clear();
  }

 private:
  int next_line() { return announced_ < pairs_.lines.size() ? pairs_.lines[announced_++] : 0; }
  std::string decoded(const std::string& text) const {
    return with_escapes(of_codepage_ ? from_codepage(text, codepage_) : to_utf8(text, codepage_));
  }
  // Plane entities may be seen from below: x runs the other way.
  bool from_below() { return getExtrusion() && getExtrusion()->getDirection()[2] < 0; }
  Item& item(const char* type) {
    Block& block = out_.blocks[current_];
    Item fresh;
    fresh.line = next_line();
    fresh.type = type;
    fresh.layer = decoded(attributes.getLayer());
    block.items.push_back(std::move(fresh));
    item_ = &block.items.back();
    return *item_;
  }
  void add_circle(const char* type, const Vector2d& centre, double radius, double from, double to) {
    Item& arc = item(type);
    if (!(radius > 0 && to > from)) return;
    arc.curves.push_back(circular_arc(centre, radius, from, to));
    if (from_below()) arc.curves.back() = mapped({Vector2d(-1, 1).asDiagonal(), {0, 0}}, arc.curves.back());
  }
  void add_text(const char* type, const Vector2d& at, const std::string& words) {
    Item& text = item(type);
    text.point = Vector2d(from_below() ? -at.x() : at.x(), at.y());
    text.text = trimmed(decoded(words));
  }

  const Pairs& pairs_;
  const std::string& name_;
  Drawing& out_;
  std::string codepage_, mtext_;
  bool below_ = false, of_codepage_ = false;
  std::size_t announced_ = 0, splines_ = 0, current_ = 0;
  Item* item_ = nullptr;  // the newest; polyline vertices follow at once
};

}  // namespace

bool Affine::similar() const {
  const double a = linear.col(0).norm(), b = linear.col(1).norm();
  return std::abs(a - b) <= 1e-12 * a && std::abs(linear.col(0).dot(linear.col(1))) <= 1e-12 * a * b;
}

Affine operator*(const Affine& outer, const Affine& inner) {
  return {outer.linear * inner.linear, outer(inner.shift)};
}

Curve2 mapped(const Affine& map, const Curve2& curve) {
  Curve2::Points points = curve.points();
  for (Eigen::Index k = 0; k < points.cols(); ++k) points.col(k) = map(points.col(k));
  return Curve2(curve.knots(), std::move(points), curve.weights());
}

Item mapped(const Affine& map, Item item) {
  const bool similar = map.similar();
  std::vector<Polyline> lines;
  for (Polyline& line : item.lines) {
    bool straight = true;
    for (const double bulge : line.bulges) straight = straight && bulge == 0;
    if (similar || straight) {
      for (Vector2d& p : line.points) p = map(p);
      if (map.mirrors())
        for (double& bulge : line.bulges) bulge = -bulge;
      lines.push_back(std::move(line));
      continue;
    }
    // Arcs become parts of ellipses, which no bulge says: each segment is a curve of its own.
    const std::size_t n = line.points.size();
    for (std::size_t k = 0; k + (line.closed ? 0 : 1) < n; ++k) {
      const Vector2d a = line.points[k], b = line.points[(k + 1) % n];
      if (a == b) continue;
      item.curves.push_back(line.bulges[k] == 0 ? polyline_curve({a, b})
                                                : circular_arc_between(a, b, 4 * std::atan(line.bulges[k])));
    }
  }
  item.lines = std::move(lines);
  for (Curve2& curve : item.curves) curve = mapped(map, curve);
  if (item.point) item.point = map(*item.point);
  if (item.insert) item.insert->map = map * item.insert->map;
  return item;
}

Drawing read_drawing(std::string_view text, const std::string& name) {
  Drawing out;
  Pairs pairs = cut(text, name);
  Listener listener(pairs, name, out);
  DL_Dxf dxf;
  std::istringstream stream(pairs.text);
  try {
    if (!dxf.in(stream, &listener)) throw InputError(name + ": dxflib could not read it");
  } catch (const GeometryError& error) {
    throw InputError(name + ": an arc: " + error.what());
  }
  const auto page = pairs.header.find("$DWGCODEPAGE");
  if (page != pairs.header.end() && !valid_utf8(pairs.text) && codepage_of_dxf(page->second).empty())
    out.warnings.push_back(name + ": $DWGCODEPAGE '" + to_utf8(page->second) +
                           "' is not known; text that isn't UTF-8 is read as Latin-1");
  out.header = std::move(pairs.header);
  out.unread = std::move(pairs.unread);
  return out;
}

}  // namespace toile::dxf
