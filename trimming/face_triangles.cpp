// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/face_triangles.h"

#include <algorithm>
#include <cmath>

#include "geometry/error.h"
#include "geometry/measure.h"
#include "trimming/triangulation.h"

namespace toile {

namespace {

double measured_chord_error(const NurbsSurface& surface, const TrimmedTriangles& triangles,
                            const Eigen::Matrix3Xd& vertices) {
  double most = 0;
  const auto look = [&](const Eigen::Vector2d& uv, const Eigen::Vector3d& x) {
    most = std::max(most, (surface(uv.x(), uv.y()) - x).norm());
  };
  for (const Triangle& t : triangles.triangles) {
    const auto uv = [&](int k) { return triangles.uv[t[k % 3]]; };
    const auto x = [&](int k) { return vertices.col(t[k % 3]); };
    for (int k = 0; k < 3; ++k)
      if (t[k] < t[(k + 1) % 3]) look(0.5 * (uv(k) + uv(k + 1)), 0.5 * (x(k) + x(k + 1)));
    look((uv(0) + uv(1) + uv(2)) / 3, (x(0) + x(1) + x(2)) / 3);
  }
  return most;
}

}  // namespace

FaceTriangles face_triangles(const TrimmedSurface& face, double chord_error) {
  if (!(chord_error > 0) || !std::isfinite(chord_error))
    throw GeometryError("the chord error of a face must be positive");
  const TrimTopology topology = trace_trims(face);
  const double extent = bounding_box(face.surface).diagonal().norm();
  TriangulationOptions options;
  constexpr int most_rounds = 8;
  constexpr double coarsest = 0.25, coarsest_chord = 0.02;
  double size = coarsest * extent;
  FaceTriangles out;
  for (int round = 0; round < most_rounds; ++round) {
    options.size = size;
    options.chord = std::min(coarsest_chord, chord_error / (4 * size));
    TrimmedTriangles triangles;
    try {
      triangles = triangulate(face, topology, options);
    } catch (const GeometryError&) {
      if (round == 0) throw;
      break;  // too many: the round before is what can be had
    }
    out.mesh.triangles = triangles.triangles;
    out.mesh.vertices.resize(3, static_cast<Eigen::Index>(triangles.uv.size()));
    for (std::size_t k = 0; k < triangles.uv.size(); ++k)
      out.mesh.vertices.col(static_cast<Eigen::Index>(k)) = face.surface(triangles.uv[k].x(), triangles.uv[k].y());
    out.chord_error = measured_chord_error(face.surface, triangles, out.mesh.vertices);
    if (out.chord_error <= chord_error) break;
    // The error goes with the square of the size.
    size *= std::clamp(0.9 * std::sqrt(chord_error / out.chord_error), 0.1, 0.8);
  }
  return out;
}

}  // namespace toile
