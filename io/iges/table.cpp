// SPDX-License-Identifier: GPL-3.0-or-later
// The dispatch table: every entity type that is known, with its reader and its writer.
#include <algorithm>
#include <array>

#include "geometry/refine.h"
#include "io/iges/entity.h"
#include "io/iges/surfaces.h"
#include "io/iges/topology.h"

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

bool rewrite_direction(Parameters& in, Record& out) {
  write_direction(read_direction(in), out);
  return true;
}

bool rewrite_group(Parameters& in, Record& out) {
  const int form = in.entry().form;
  const bool known = form == 1 || form == 7 || form == 9 || form == 14 || form == 15;
  if (known) write_group(read_group(in), form, out);
  return known;
}

Curve3 arc_curve(Parameters& in) {
  return to_curve(read_arc(in));
}
Curve3 conic_curve(Parameters& in) {
  return to_curve(read_conic(in));
}
Curve3 power_curve(Parameters& in) {
  return to_curve(read_power_spline(in), in.resolution()).curve;
}

// Forms 20 to 40 are drawings: centre lines, hatching, witness lines.
Curve3 copious_curve(Parameters& in) {
  const int form = in.entry().form;
  if (form >= 20 && form <= 40)
    in.fail("form " + std::to_string(form) + " is no curve, must be 1 to 3, 11 to 13 or 63");
  return to_curve(read_copious(in), form == 63);
}

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

constexpr std::array<Kind, 39> kinds{{
    {0, "null", nullptr, nullptr, false},
    {100, "circular arc", rewrite_as<read_arc>, arc_curve, true},
    {102, "composite curve", rewrite_composite, nullptr, false},
    {104, "conic arc", rewrite_as<read_conic>, conic_curve, true},
    {106, "polyline", rewrite_as<read_copious>, copious_curve, true},
    {108, "plane", rewrite_as<read_plane>, nullptr, false},
    {110, "line", rewrite_as<read_segment>, segment_curve, true},
    {112, "parametric spline", rewrite_as<read_power_spline>, power_curve, true},
    {114, "parametric spline surface", rewrite_as<read_power_surface>, nullptr, false},
    {116, "point", rewrite_as<read_point>, nullptr, false},
    {118, "ruled surface", rewrite_as<read_ruled>, nullptr, false},
    {120, "surface of revolution", rewrite_as<read_revolution>, nullptr, false},
    {122, "tabulated cylinder", rewrite_as<read_tabulated>, nullptr, false},
    {123, "direction", rewrite_direction, nullptr, false},
    {124, "transformation", rewrite_as<read_transform>, nullptr, false},
    {126, "B-spline curve", rewrite_as<read_spline_curve>, spline_curve, false},
    {128, "B-spline surface", rewrite_as<read_spline_surface>, nullptr, false},
    {130, "offset curve", rewrite_as<read_offset_curve>, nullptr, false},
    {140, "offset surface", rewrite_as<read_offset_surface>, nullptr, false},
    {141, "boundary", rewrite_as<read_boundary_list>, nullptr, false},
    {142, "curve on a surface", rewrite_as<read_boundary>, nullptr, false},
    {143, "bounded surface", rewrite_as<read_bounded_surface>, nullptr, false},
    {144, "trimmed surface", rewrite_as<read_face>, nullptr, false},
    {186, "solid", rewrite_as<read_solid>, nullptr, false},
    {190, "plane surface", rewrite_as<read_analytic>, nullptr, false},
    {192, "cylinder", rewrite_as<read_analytic>, nullptr, false},
    {194, "cone", rewrite_as<read_analytic>, nullptr, false},
    {196, "sphere", rewrite_as<read_analytic>, nullptr, false},
    {198, "torus", rewrite_as<read_analytic>, nullptr, false},
    {308, "subfigure definition", rewrite_as<read_definition>, nullptr, false},
    {314, "colour", rewrite_as<read_colour>, nullptr, false},
    {402, "group", rewrite_group, nullptr, false},
    {406, "property", rewrite_property, nullptr, false},
    {408, "subfigure instance", rewrite_as<read_instance>, nullptr, false},
    {502, "vertex list", rewrite_as<read_vertex_list>, nullptr, false},
    {504, "edge list", rewrite_as<read_edge_list>, nullptr, false},
    {508, "loop", rewrite_as<read_edge_loop>, nullptr, false},
    {510, "face", rewrite_as<read_topological_face>, nullptr, false},
    {514, "shell", rewrite_as<read_shell>, nullptr, false},
}};

}  // namespace

const Kind* find_kind(int type) {
  const auto found = std::find_if(kinds.begin(), kinds.end(), [type](const Kind& kind) { return kind.type == type; });
  return found == kinds.end() ? nullptr : &*found;
}

}  // namespace toile::iges
