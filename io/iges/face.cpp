// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/iges/face.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "geometry/error.h"
#include "io/iges/continuation.h"
#include "io/iges/entity.h"
#include "io/iges/loop_curves.h"
#include "io/iges/parameter_reading.h"
#include "io/iges/seams.h"
#include "trimming/loop_closing.h"
#include "trimming/material.h"

namespace toile::iges {

namespace {

using Eigen::Vector2d;

class FaceMaker {
 public:
  FaceMaker(const FileSurface& surface, std::vector<BoundaryCurves>& boundaries, const FaceOptions& options)
      : plane_(surface, options), boundaries_(boundaries) {}

  std::vector<TrimmedSurface> run() {
    const ParameterMap& map = best_map(plane_, boundaries_);
    for (std::size_t i = 0; i < boundaries_.size(); ++i) {
      TrimLoop loop;
      loop.index = static_cast<int>(i);
      loop.kind = i == 0 ? LoopKind::outer : LoopKind::hole;
      loop.curves = loop_curves(plane_, map, boundaries_[i]);
      loops_.push_back(std::move(loop));
    }
    join_across_seams(plane_, boundaries_, loops_);
    loops_[0].kind = LoopKind::outer;
    std::vector<TrimmedSurface> out;
    for (Material::Panel& panel : panels()) {
      TrimmedSurface face;
      face.surface = plane_.surface;
      face.loops = std::move(panel.loops);
      face.marks = std::move(panel.marks);
      fit_into_domain(plane_, boundaries_, face);
      for (TrimLoop& loop : face.loops)
        for (std::size_t i = 0; i < loop.curves.size(); ++i) {
          const Vector2d jump = first(loop.curves[(i + 1) % loop.curves.size()]) - last(loop.curves[i]);
          loop.gap = std::max(loop.gap, jump.norm());
        }
      out.push_back(std::move(face));
    }
    return out;
  }

 private:
  // The loops of each panel, cut where they meet. Loops that don't close stay as the file says, for validation to
  // refuse with the place.
  std::vector<Material::Panel> panels() {
    Material::Panel as_said;
    as_said.loops = loops_;
    if (loops_.size() == 1) return {as_said};
    gather(plane_, loops_);
    TrimmedSurface closed;
    closed.surface = plane_.surface;
    closed.resolution = plane_.options.resolution;
    closed.loops = loops_;
    try {
      close_loops(closed, {}, false);
    } catch (const GeometryError&) {
      return {as_said};
    }
    Material material;
    try {
      material = material_of(closed.loops, {plane_.options.outer_known, meeting_tolerance(closed)});
    } catch (const GeometryError& error) {
      plane_.fail(boundaries_[0], error.what());
    }
    for (Material::Panel& panel : material.panels)
      for (std::size_t l = 0; l < panel.loops.size(); ++l)
        if (panel.source[l] >= 0)
          panel.loops[l].curves = std::move(loops_[static_cast<std::size_t>(panel.source[l])].curves);
    report(material);
    return std::move(material.panels);
  }

  void report(const Material& material) {
    if (plane_.options.outer_known && material.panels.size() > 1) {
      plane_.note(
          boundaries_[0], "outer loop",
          std::to_string(material.panels.size()) + " loops lie beside each other on one surface; each becomes a panel");
    } else if (plane_.options.outer_known && material.panels[0].source[0] > 0) {
      plane_.note(boundaries_[0], "outer loop",
                  "the loop that the file calls the outer one lies within another; that one is taken");
    }
    for (const LoopRepair& change : material.changes) {
      BoundaryCurves& boundary = boundaries_[static_cast<std::size_t>(change.loop)];
      plane_.note(boundary, "loops that meet",
                  change.what + " (at " + format_real(change.place.x()) + ", " + format_real(change.place.y()) + ")");
      boundary.converted = change.what;
    }
  }

  FacePlane plane_;
  std::vector<BoundaryCurves>& boundaries_;
  std::vector<TrimLoop> loops_;
};

}  // namespace

std::vector<TrimmedSurface> make_faces(const FileSurface& surface, std::vector<BoundaryCurves>& boundaries,
                                       const FaceOptions& options) {
  double by = 0;
  const std::optional<FileSurface> wider = continued_surface(surface, boundaries, options, by);
  if (!wider) return FaceMaker(surface, boundaries, options).run();
  options.note("continued surface", boundaries[0].place + "it goes " + format_real(by) +
                                        " of the domain beyond the surface, which is "
                                        "continued");
  return FaceMaker(*wider, boundaries, options).run();
}

Eigen::AlignedBox3d reach(const Frame& frame, const std::vector<BoundaryCurves>& boundaries) {
  Eigen::AlignedBox3d box;
  for (const BoundaryCurves& b : boundaries)
    for (const Curve3& c : b.model)
      for (const auto& p : c.points().colwise()) box.extend(frame.local(p));
  return box;
}

}  // namespace toile::iges
