// SPDX-License-Identifier: GPL-3.0-or-later
// Entities one by one: each family has a file with its reader and its writer side by side; the table below names them.
// To add one: a file in this folder, a row in table.cpp, a file in tests/corpus/iges.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "geometry/nurbs_curve.h"
#include "geometry/nurbs_surface.h"
#include "io/iges/parameters.h"

namespace toile::iges {

// Readers stop after the entity's own parameters: what follows are pointers to associativities and properties.
// They refuse (InputError) counts that the record doesn't hold before they allocate for them.

// 126: knots, weights and points as they stand; `range` is the part of the domain that is meant.
struct SplineCurve {
  Curve3 curve;
  Interval range;
};
SplineCurve read_spline_curve(Parameters& in);
void write(const SplineCurve& curve, Record& out);

// 128, alike.
struct SplineSurface {
  NurbsSurface surface;
  Interval u, v;
  bool covers_domain() const;
};
SplineSurface read_spline_surface(Parameters& in);
void write(const SplineSurface& surface, Record& out);
// The part of the surface over the ranges, its domain being exactly those.
NurbsSurface restricted(const SplineSurface& surface);

// 100: an arc in the plane z = height, counter-clockwise from start to end; equal ends mean the full circle.
struct Arc {
  double height = 0;
  Eigen::Vector2d centre{0, 0}, start{0, 0}, end{0, 0};
};
Arc read_arc(Parameters& in);
void write(const Arc& arc, Record& out);
Curve3 to_curve(const Arc& arc);
// The file's parameter along it: from its start's angle, in [0, 2 pi), to its end's [rad].
Interval arc_angles(const Arc& arc);

// 110
struct Segment {
  Eigen::Vector3d start{0, 0, 0}, end{0, 0, 0};
};
Segment read_segment(Parameters& in);
void write(const Segment& segment, Record& out);

// 106: points (forms 1 to 3), polylines (11 to 13) and closed ones (63). Vectors are kept for writing, not used.
struct CopiousData {
  int kind = 1;  // 1: x, y in the plane z = height; 2: x, y, z; 3: with vectors
  double height = 0;
  std::vector<double> numbers;  // 2, 3 or 6 a point
};
CopiousData read_copious(Parameters& in);
void write(const CopiousData& data, Record& out);
// The polyline through the points, neighbours that coincide taken once; `closed`: back to the first point.
Curve3 to_curve(const CopiousData& data, bool closed);

// 104: the points where A x^2 + B x y + C y^2 + D x + E y + F = 0 in the plane z = height, from start to end: an
// ellipse counter-clockwise (all of it where the ends are equal), a parabola or one branch of a hyperbola.
struct Conic {
  std::array<double, 6> coefficients{};  // A to F
  double height = 0;
  Eigen::Vector2d start{0, 0}, end{0, 0};
};
Conic read_conic(Parameters& in);
void write(const Conic& conic, Record& out);
// Rational quadratic. GeometryError where the ends lie on no common piece of the conic.
Curve3 to_curve(const Conic& conic);

// 112: polynomials in powers of the distance from each breakpoint; 12 coefficients a segment (x: 1, s, s^2, s^3; y; z).
struct PowerSpline {
  int kind = 3, continuity = 1, dimension = 3;
  std::vector<double> breaks, coefficients, terminal;
};
PowerSpline read_power_spline(Parameters& in);
void write(const PowerSpline& spline, Record& out);
// Over the breakpoints' range, with every breakpoint a knot as often as the degree. Jumps up to `tolerance`, and up to
// 1e-6 of the size in any case, are closed; `gap` is the largest. GeometryError where it jumps further.
struct JoinedCurve {
  Curve3 curve;
  double gap = 0;
};
JoinedCurve to_curve(const PowerSpline& spline, double tolerance);

// 114, alike: 48 coefficients a patch (x, y, z: 16 each, powers of s fastest), patches v fastest with one more row and
// column than there are spans.
struct PowerSurface {
  int kind = 3, patch_kind = 1;
  std::vector<double> u, v, coefficients;
};
PowerSurface read_power_surface(Parameters& in);
void write(const PowerSurface& surface, Record& out);
struct JoinedSurface {
  NurbsSurface surface;
  double gap = 0;
};
JoinedSurface to_surface(const PowerSurface& surface, double tolerance);

// 212: the strings of a general note, each where it begins. [IGES 5.3, 4.60]
struct NoteString {
  Eigen::Vector3d at{0, 0, 0};
  std::string text;
};
std::vector<NoteString> read_note(Parameters& in);
void write(const NoteString& note, double height, Record& out);

// 102: directory numbers of its curves, in order.
std::vector<int> read_composite(Parameters& in);
void write_composite(const std::vector<int>& curves, Record& out);

// 124: x -> R x + t
Eigen::Affine3d read_transform(Parameters& in);
void write(const Eigen::Affine3d& transform, Record& out);

// 142
struct Boundary {
  int creation = 0;
  int surface = 0, parameter_curve = 0, model_curve = 0;  // directory numbers, 0 for none
  int preference = 0;                                     // 1 parameter curve, 2 model curve, 3 either, 0 unsaid
};
Boundary read_boundary(Parameters& in);
void write(const Boundary& boundary, Record& out);

// 144. An outer pointer counts even where the file says that the outer boundary is the domain's (N1 = 0); where it
// promises one (N1 = 1) and names none, the domain's border is meant.
struct Face {
  int surface = 0;
  int outer = 0;  // 0: the border of the surface's domain
  bool outer_was_denied = false, outer_is_missing = false;
  std::vector<int> holes;
};
Face read_face(Parameters& in);
void write(const Face& face, Record& out);

// 314: red, green, blue in percent, and a name.
struct Colour {
  double red = 0, green = 0, blue = 0;
  std::string name;
};
Colour read_colour(Parameters& in);
void write(const Colour& colour, Record& out);

// 406 form 15; nullopt for other forms.
std::optional<std::string> read_name(Parameters& in);
void write_name(const std::string& name, Record& out);
// 406 form 3: what its level holds.
void write_level_function(const std::string& words, Record& out);

// What the dispatch table knows of an entity type.
struct Kind {
  int type;
  const char* name;
  // Reads the entity's own parameters and writes them anew; false: this form is only ever replayed. Null: never.
  bool (*rewrite)(Parameters& in, Record& out);
  // The entity as a NURBS curve in its own definition space (its 124 not applied); null for what isn't one curve.
  Curve3 (*curve)(Parameters& in);
  bool converted;  // the curve is another representation of what the record says
};
const Kind* find_kind(int type);

}  // namespace toile::iges
