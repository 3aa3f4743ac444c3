#include "geometry/trimmed_surface.h"

namespace toile {

TrimLoop natural_loop(const NurbsSurface& surface) {
  const Interval u = surface.u().domain(), v = surface.v().domain();
  const Eigen::Vector2d corners[] = {{u.min, v.min}, {u.max, v.min}, {u.max, v.max}, {u.min, v.max}};
  TrimLoop loop;
  for (int k = 0; k < 4; ++k) {
    TrimCurve curve;
    curve.curve = line_segment<2>(corners[k], corners[(k + 1) % 4]);
    curve.index = k;
    loop.curves.push_back(std::move(curve));
  }
  return loop;
}

}  // namespace toile
