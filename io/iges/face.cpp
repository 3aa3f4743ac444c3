#include "io/iges/face.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "io/iges/loop_curves.h"
#include "io/iges/seams.h"

namespace toile::iges {

namespace {

using Eigen::Vector2d;

double signed_area(const std::vector<Vector2d>& p) {
  double sum = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Vector2d &a = p[i] - p[0], &b = p[(i + 1) % p.size()] - p[0];
    sum += a.x() * b.y() - a.y() * b.x();
  }
  return sum / 2;
}

bool contains(const std::vector<Vector2d>& p, const Vector2d& x) {
  bool in = false;
  for (std::size_t i = 0, j = p.size() - 1; i < p.size(); j = i++)
    if ((p[i].y() > x.y()) != (p[j].y() > x.y()) &&
        x.x() < (p[j].x() - p[i].x()) * (x.y() - p[i].y()) / (p[j].y() - p[i].y()) + p[i].x())
      in = !in;
  return in;
}

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
    std::vector<TrimmedSurface> out;
    for (std::vector<TrimLoop>& group : classified()) {
      TrimmedSurface face;
      face.surface = plane_.surface;
      face.loops = std::move(group);
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
  // Outer loops with their holes. A loop within an odd number of others is a hole.
  std::vector<std::vector<TrimLoop>> classified() {
    const std::size_t n = loops_.size();
    if (n == 1) {
      loops_[0].kind = LoopKind::outer;
      return {std::move(loops_)};
    }
    std::vector<std::vector<Vector2d>> polygons;
    std::vector<double> areas;
    for (const TrimLoop& loop : loops_) {
      polygons.push_back(polygon(loop.curves));
      areas.push_back(std::abs(signed_area(polygons.back())));
    }
    // By a place on the inner loop; touching loops agree on most of theirs.
    const auto within = [&](std::size_t inner, std::size_t outer) {
      if (areas[inner] >= areas[outer]) return false;
      std::size_t in = 0;
      for (const Vector2d& x : polygons[inner])
        in += contains(polygons[outer], shifted_into(x, polygons[outer])) ? 1 : 0;
      return 2 * in > polygons[inner].size();
    };
    std::vector<std::vector<std::size_t>> around(n);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j)
        if (i != j && within(i, j)) around[i].push_back(j);
    std::size_t outers = 0;
    for (std::size_t i = 0; i < n; ++i) outers += around[i].size() % 2 == 0 ? 1 : 0;
    const bool as_said = outers == 1 && around[0].empty();
    if (plane_.options.outer_known && as_said) return {std::move(loops_)};
    if (plane_.options.outer_known) {
      // Loops beside each other where the file names one outer loop: a panel each.
      plane_.note(boundaries_[0], "outer loop",
                  outers == 1
                      ? "the loop that the file calls the outer one lies within another; that one is taken"
                      : std::to_string(outers) + " loops lie beside each other on one surface; each becomes a panel");
    }
    std::vector<std::vector<TrimLoop>> out;
    std::vector<std::size_t> group(n);
    for (std::size_t i = 0; i < n; ++i)
      if (around[i].size() % 2 == 0) {
        group[i] = out.size();
        out.emplace_back();
        out.back().push_back(loops_[i]);
        out.back().back().kind = LoopKind::outer;
      }
    for (std::size_t i = 0; i < n; ++i) {
      if (around[i].size() % 2 == 0) continue;
      // Its panel is the innermost loop around it.
      const std::size_t parent = *std::min_element(around[i].begin(), around[i].end(),
                                                   [&](std::size_t x, std::size_t y) { return areas[x] < areas[y]; });
      loops_[i].kind = LoopKind::hole;
      out[group[parent]].push_back(std::move(loops_[i]));
    }
    return out;
  }

  Vector2d shifted_into(Vector2d x, const std::vector<Vector2d>& of) const {
    for (int k = 0; k < 2; ++k)
      if (const double period = plane_.period[static_cast<std::size_t>(k)]; period > 0) {
        double low = std::numeric_limits<double>::infinity();
        for (const Vector2d& p : of) low = std::min(low, p[k]);
        x[k] -= period * std::floor((x[k] - low) / period);
      }
    return x;
  }

  FacePlane plane_;
  std::vector<BoundaryCurves>& boundaries_;
  std::vector<TrimLoop> loops_;
};

}  // namespace

std::vector<TrimmedSurface> make_faces(const FileSurface& surface, std::vector<BoundaryCurves>& boundaries,
                                       const FaceOptions& options) {
  return FaceMaker(surface, boundaries, options).run();
}

Eigen::AlignedBox3d reach(const Frame& frame, const std::vector<BoundaryCurves>& boundaries) {
  Eigen::AlignedBox3d box;
  for (const BoundaryCurves& b : boundaries)
    for (const Curve3& c : b.model)
      for (const auto& p : c.points().colwise()) box.extend(frame.local(p));
  return box;
}

}  // namespace toile::iges
