// SPDX-License-Identifier: GPL-3.0-or-later
// Where an address lies on a built panel.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <string>
#include <vector>

#include "geometry/trimmed_surface.h"
#include "pipeline/scene/addresses.h"
#include "trimming/topology.h"

namespace toile {

// A trim curve laid on a surface, measured by arc length in space. Pieces end where the curve meets knot lines, so that
// what is integrated over a piece is smooth.
class CurveOnSurface {
 public:
  // `curve` of `face` (positions, not the file's numbers) on `surface`, which has face's parameters.
  CurveOnSurface(const TrimmedSurface& face, const TrimTopology& topology, int loop, int curve,
                 const NurbsSurface& surface);

  double length() const { return sum_.back(); }
  double parameter(double fraction) const;  // of the curve at a fraction of the length
  Eigen::Vector2d uv(double t) const;
  double speed(double t) const;  // |dx/dt|
  double cells(double t) const;  // the same where spans of the knots, du and dv, count 1
  // Ends of smooth pieces within [from, to] (fractions), both included, ascending.
  std::vector<double> breaks(double from, double to) const;

 private:
  const Curve2& curve_;
  const NurbsSurface& surface_;
  std::vector<double> t_, sum_;  // piece ends and the length up to each
};

struct PanelPlaces;
struct PathPart;

// Trim curves of a panel one after the other, by fractions of their length in space.
class CurveChain {
 public:
  // `curves`: the file's numbers in the file's loop, each run in the file's direction; of the whole the part from one
  // fraction of its length to another. Throws GeometryError where a curve doesn't exist.
  CurveChain(int loop, std::span<const int> curves, double from, double to, const PanelPlaces& panel,
             const std::string& who);
  ~CurveChain();

  double length() const { return length_; }                  // m
  Eigen::Vector2d at(double fraction) const;                 // parameters
  double cells_per_metre(double fraction) const;             // where spans of the knots count 1
  const std::vector<double>& ends() const { return ends_; }  // fractions where curves end, 0 and 1 left out

 private:
  struct Place {
    const PathPart* part;
    double t;
  };
  Place place(double fraction) const;

  std::vector<PathPart> parts_;
  std::vector<double> before_;  // m, up to each part
  std::vector<double> ends_;
  double length_ = 0;
};

// Points on a curve or edge with their share of its length: integrates a line load.
struct LinePoint {
  Eigen::Vector2d uv;
  double weight = 0;  // m
};

// What a pin holds: control points (exactly), or material points, which become rows.
//
// Along a curve the points are even in cells: one a span where it is open, one per 1.15 spans where it closes. A spline
// that vanishes along a curve is divisible by the curve's polynomial, so that denser rows hold the slope across the
// curve too, at some places more than at others. Curves of few spans have at least degree + 1 points, closed ones
// 2 degree + 1.
struct HeldPlace {
  std::vector<int> control_points;         // of the panel's net, ascending
  std::vector<std::array<int, 2>> across;  // of a clamped edge: each of its control points and the next one inwards
  std::vector<Eigen::Vector2d> points;     // parameters
  // The first so many of `points` must be held by rows, the others only where they are independent enough. For a curve:
  // both ends where it is open, three points where it closes.
  std::size_t required = 0;
  std::vector<Eigen::Vector2d> curve;  // 200 places or more along the curve: what rows don't hold shows as gaps there
};

// A panel as addresses see it.
struct PanelPlaces {
  const std::string& name;
  const TrimmedSurface& face;
  const TrimTopology& topology;
  const NurbsSurface& rest;       // SI
  const Eigen::Matrix3Xd& start;  // net, SI, scene axes
  const std::vector<bool>& carries_cloth;
};

// Is the point in the material, or on its border within 1e-9 of the domain's size? Corners of trims are rarely doubles.
bool in_material(const TrimmedSurface& face, const TrimTopology& topology, const Eigen::Vector2d& uv);

// Parameters of a corner: or uv: address, in the material or not.
Eigen::Vector2d point_uv(const Address& at, const NurbsSurface& surface);

// `who` starts the messages: "scene.toml:12: pin 0 (corner:0,0)". Throws GeometryError where the place is trimmed away,
// outside the panel or doesn't exist; InputError for a clamp that this place can't have.
HeldPlace held_place(const Address& at, bool clamp, const PanelPlaces& panel, const std::string& who);
std::vector<LinePoint> line_points(const Address& along, const PanelPlaces& panel, const std::string& who);

}  // namespace toile
