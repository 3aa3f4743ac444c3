// The dispatch table: every entity type that is known, with its reader and its writer.
#include <algorithm>
#include <array>

#include "geometry/refine.h"
#include "io/iges/entity.h"

namespace toile::iges {

namespace {

template <auto read>
bool rewrite_as(Parameters& in, Record& out) {
  write(read(in), out);
  return true;
}

bool rewrite_composite(Parameters& in, Record& out) {
  write_composite(read_composite(in), out);
  return true;
}

bool rewrite_property(Parameters& in, Record& out) {
  const std::optional<std::string> name = read_name(in);
  if (name) write_name(*name, out);
  return name.has_value();
}

Curve3 arc_curve(Parameters& in) { return to_curve(read_arc(in)); }
Curve3 copious_curve(Parameters& in) { return to_curve(read_copious(in)); }

Curve3 segment_curve(Parameters& in) {
  const Segment s = read_segment(in);
  return line_segment<3>(s.start, s.end);
}

Curve3 spline_curve(Parameters& in) {
  const SplineCurve s = read_spline_curve(in);
  const Interval domain = s.curve.domain();
  if (s.range.min == domain.min && s.range.max == domain.max) return s.curve;
  return sub_curve(s.curve, s.range);
}

constexpr std::array<Kind, 13> kinds{{
    {0, "null", nullptr, nullptr, false},
    {100, "circular arc", rewrite_as<read_arc>, arc_curve, true},
    {102, "composite curve", rewrite_composite, nullptr, false},
    {106, "copious data", rewrite_as<read_copious>, copious_curve, true},
    {110, "line", rewrite_as<read_segment>, segment_curve, true},
    {124, "transformation", rewrite_as<read_transform>, nullptr, false},
    {126, "B-spline curve", rewrite_as<read_spline_curve>, spline_curve, false},
    {128, "B-spline surface", rewrite_as<read_spline_surface>, nullptr, false},
    {142, "curve on a surface", rewrite_as<read_boundary>, nullptr, false},
    {144, "trimmed surface", rewrite_as<read_face>, nullptr, false},
    {314, "colour", rewrite_as<read_colour>, nullptr, false},
    {402, "group", nullptr, nullptr, false},
    {406, "property", rewrite_property, nullptr, false},
}};

}  // namespace

const Kind* find_kind(int type) {
  const auto found = std::find_if(kinds.begin(), kinds.end(), [type](const Kind& kind) { return kind.type == type; });
  return found == kinds.end() ? nullptr : &*found;
}

}  // namespace toile::iges
