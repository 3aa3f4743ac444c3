// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces that are no B-spline in the file: their records, and the NURBS that they become with the map of the file's
// parameters onto its own.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "geometry/nurbs_curve.h"
#include "geometry/nurbs_surface.h"
#include "io/iges/parameter_map.h"
#include "io/iges/parameters.h"

namespace toile::iges {

// A curve whose parameter is the file's own along it, but for turns (arcs count angles).
struct NaturalCurve {
  Curve3 curve;
  std::vector<Turn> turns = {};
};
// One after the other, domains added up; the pieces' ends must meet within `tolerance` (else GeometryError).
NaturalCurve joined(const std::vector<NaturalCurve>& pieces, double tolerance);

// Where the surface stands: z is the plane's normal or the axis, x the reference direction made perpendicular to it.
struct Frame {
  Eigen::Vector3d origin{0, 0, 0}, x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  Eigen::Vector3d local(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d d = p - origin;
    return {d.dot(x), d.dot(y), d.dot(z)};
  }
  Frame placed(const Eigen::Affine3d& t) const { return {t * origin, t.linear() * x, t.linear() * y, t.linear() * z}; }
};

// What a surface of the file became. Several `maps`: exporters disagree (degrees or radians, angles from 0 or from
// where an arc starts, lengths or fractions); the first is the standard's.
struct FileSurface {
  NurbsSurface surface;
  std::vector<ParameterMap> maps = {{}};
  bool degrees_or_radians = false;  // the first two maps differ in the unit of angles alone
  double error = 0;                 // of a surface that no NURBS is exactly
  std::string how;                  // empty: the file's own numbers
  std::optional<Frame> plane = {};  // of a plane: its parameters are x and y there
};

// 118: straight rulings between two curves, u along both, v from the first (0) to the second (1).
struct Ruled {
  int first = 0, second = 0;
  int direction = 0;  // 1: the second curve is run backwards
  int developable = 0;
};
Ruled read_ruled(Parameters& in);
void write(const Ruled& ruled, Record& out);
// `by_length` (form 0): points at equal fractions of arc length are joined, else at equal parameters.
FileSurface to_surface(const Ruled& ruled, NaturalCurve first, NaturalCurve second, bool by_length, double tolerance);

// 120: u along the generatrix, v the angle about the axis (a line).
struct Revolution {
  int axis = 0, generatrix = 0;
  double start = 0, end = 0;
};
Revolution read_revolution(Parameters& in);
void write(const Revolution& revolution, Record& out);
FileSurface to_surface(const Revolution& revolution, const Curve3& axis, const NaturalCurve& generatrix);

// 122: u along the directrix (0 to 1), v towards the point that the directrix' start is moved to.
struct Tabulated {
  int directrix = 0;
  Eigen::Vector3d end{0, 0, 0};
};
Tabulated read_tabulated(Parameters& in);
void write(const Tabulated& tabulated, Record& out);
FileSurface to_surface(const Tabulated& tabulated, const NaturalCurve& directrix);

// 140: each point moved along the normal by `distance`; the indicator says to which side.
struct OffsetSurface {
  Eigen::Vector3d indicator{0, 0, 1};
  double distance = 0;
  int surface = 0;
};
OffsetSurface read_offset_surface(Parameters& in);
void write(const OffsetSurface& offset, Record& out);
FileSurface to_surface(const OffsetSurface& offset, const FileSurface& base, double tolerance);

// 130: a curve moved sideways in a plane, by one distance (flag 1), one that varies linearly (2), or by a coordinate (1
// to 3) of another curve (3: function).
struct OffsetCurve {
  int flag = 1, curve = 0, function = 0, coordinate = 0, kind = 0;
  std::array<double, 4> distances{};  // D1, TD1, D2, TD2
  Eigen::Vector3d normal{0, 0, 1};
  Interval range;
};
OffsetCurve read_offset_curve(Parameters& in);
void write(const OffsetCurve& offset, Record& out);
struct FittedCurve {
  Curve3 curve;
  double error = 0;
};
// `function`: the curve that flag 3 names, else null.
FittedCurve to_curve(const OffsetCurve& offset, const Curve3& base, const Curve3* function, double tolerance);

// 108: A x + B y + C z = D, with a bounding curve (forms 1 and -1) or none.
struct Plane {
  std::array<double, 4> coefficients{};
  int boundary = 0;
  Eigen::Vector3d place{0, 0, 0};
  double size = 0;
};
Plane read_plane(Parameters& in);
void write(const Plane& plane, Record& out);

// 190 to 198. Pointers to 116 and 123; `reference` is 0 in form 0.
struct Analytic {
  int type = 190;
  int location = 0, axis = 0, reference = 0;
  double radius = 0;  // 192, 194, 196; the larger of 198
  double second = 0;  // 194: half angle [degrees]; 198: smaller radius
};
Analytic read_analytic(Parameters& in);
void write(const Analytic& surface, Record& out);

// Throws GeometryError for directions of no length.
Frame frame(const Eigen::Vector3d& origin, const Eigen::Vector3d& axis,
            const std::optional<Eigen::Vector3d>& reference);
Frame frame(const Plane& plane);

// The rectangle of the plane that holds `reach` (x, y in the frame), its parameters being x and y.
FileSurface plane_patch(const Frame& frame, const Eigen::AlignedBox2d& reach);
// All the way round; cylinders and cones over `height` along the axis. Cones end at their apex.
FileSurface to_surface(const Analytic& surface, const Frame& frame, Interval height);

// The profile turned about an axis: u along it, v the angle, knots at the arcs' ends.
NurbsSurface revolved(const Curve3& profile, const Eigen::Vector3d& origin, const Eigen::Vector3d& axis,
                      Interval angle);
NurbsSurface transposed(const NurbsSurface& surface);

}  // namespace toile::iges
