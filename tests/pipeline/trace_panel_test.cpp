// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/build/trace_panel.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>
#include <tuple>

#include "analysis/constraint/select_rows.h"
#include "geometry/error.h"
#include "io/panel_file.h"
#include "pipeline/build/build.h"
#include "pipeline/inspect/inspect.h"
#include "pipeline/panels.h"

namespace toile {
namespace {

namespace fs = std::filesystem;

using Listed = std::tuple<PointKind, double, double, int, int, double, bool, std::string>;

std::vector<Listed> listed(const std::vector<ConstraintPoint>& points) {
  std::vector<Listed> out;
  for (const ConstraintPoint& p : points) out.emplace_back(p.kind, p.u, p.v, p.loop, p.curve, p.t, p.used, p.why);
  return out;
}

// Compares what a drape of face `k` without pins takes with what its inspection shows. False: a drape refuses the face.
bool compare(const PanelFile& file, std::size_t k, const Scene& scene) {
  SCOPED_TRACE(file.path + ", face " + std::to_string(k));
  PanelFile one = file;
  one.panels = {file.panels[k]};
  Scene alone = scene;
  alone.panels = {scene.panels[k]};
  Build built;
  try {
    built = build(alone);
  } catch (const GeometryError&) {
    return false;  // torn, or with a pole
  }
  InspectOptions options;
  options.degree = 2;
  options.span = scene.panels[k].span;
  const Inspection inspection = inspect(one, options);
  EXPECT_EQ(inspection.panels.size(), 1u);
  const InspectedPanel& shown = inspection.panels[0];
  BuiltPanel& taken = built.panels[0];
  merge_near_points(built.rest(0), taken.points);
  EXPECT_EQ(listed(taken.points), listed(shown.points));
  EXPECT_EQ(taken.topology.cells, shown.topology.cells);
  EXPECT_EQ(taken.face.surface.points().cols(), shown.face.surface.points().cols());
  if (testing::Test::HasFailure()) return true;  // matrices of other sizes don't compare
  EXPECT_EQ(taken.face.surface.points(), shown.face.surface.points());
  EXPECT_EQ(taken.closure.u, shown.closure.u);
  EXPECT_EQ(taken.closure.v, shown.closure.v);
  return true;
}

int compare_file(const fs::path& path) {
  QuickScene request;
  request.file = path;
  request.degree = 2;
  int compared = 0;
  try {
    Scene scene = quick_scene(request);
    scene.strain_limit.points = PointRule::knot_mesh;
    const PanelFile file = scene.read->file;
    if (scene.panels.size() != file.panels.size()) return 0;  // drapes beside their flat panels
    for (std::size_t k = 0; k < file.panels.size(); ++k) compared += compare(file, k, scene);
  } catch (const Error&) {
    return compared;  // no panel is read
  }
  return compared;
}

int compare_files_below(const fs::path& folder, const std::string& ending) {
  int compared = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
    if (entry.path().extension() == ending) compared += compare_file(entry.path());
  return compared;
}

TEST(TracePanel, InspectShowsWhatADrapeTakesOverTheCorpus) {
  EXPECT_GE(compare_files_below(fs::path(TOILE_TEST_DATA) / "iges", ".igs"), 40);
}

TEST(TracePanel, InspectShowsWhatADrapeTakesOverTheSamples) {
  EXPECT_GE(compare_files_below(fs::path(TOILE_SAMPLES), ".igs"), 3);
}

// A tube, closed in u, of 8 x 3 spans.
TrimmedSurface tube() {
  constexpr int around = 11, rows = 5;
  const KnotVector u = uniform_knots(2, 9, {0, 9}), v = uniform_knots(2, 3, {0, 3});
  Eigen::Matrix3Xd points(3, around * rows);
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < around; ++i) {
      const double angle = 2 * std::numbers::pi * (i % (around - 1)) / (around - 1);
      points.col(i + around * j) << 60 * std::cos(angle), 60 * std::sin(angle), 80 * v.greville(j);
    }
  TrimmedSurface face = untrimmed(NurbsSurface(u, v, points));
  face.name = "tube";
  face.metres_per_unit = 1e-3;
  return face;
}

TrimmedSurface trimmed(TrimmedSurface face, const std::vector<Eigen::Vector2d>& corners) {
  face.natural_bounds = false;
  face.loops[0].curves.clear();
  for (std::size_t k = 0; k < corners.size(); ++k)
    face.loops[0].curves.push_back(
        {line_segment<2>(corners[k], corners[(k + 1) % corners.size()]), static_cast<int>(k), false, {}});
  return face;
}

TEST(TracePanel, InspectShowsWhatADrapeTakesOfClosedPanels) {
  const test::Folder folder("trace_panel");
  const TrimmedSurface whole = tube();
  // Cloth that reaches the seam on one side only, on both along a part, and on neither.
  const std::vector<TrimmedSurface> faces{whole, trimmed(whole, {{0, 0.2}, {8.5, 0.2}, {8.5, 2.7}, {0, 2.7}}),
                                          trimmed(whole, {{0, 0.2}, {9, 0.2}, {9, 1.4}, {6.2, 2.7}, {0, 2.7}}),
                                          trimmed(whole, {{0.3, 0.2}, {8.5, 0.2}, {8.5, 2.7}, {0.3, 2.7}})};
  for (std::size_t k = 0; k < faces.size(); ++k) {
    const fs::path path = folder / ("tube_" + std::to_string(k) + ".igs");
    test::write_panels(path, {faces[k]});
    EXPECT_EQ(compare_file(path), 1) << k;
  }
}

TEST(TracePanel, ASeamThatIsTrimmedApartIsNotGlued) {
  const TrimmedSurface apart = trimmed(tube(), {{0, 0.2}, {8.5, 0.2}, {8.5, 2.7}, {0, 2.7}});
  EXPECT_FALSE(trace_panel(apart, PointRule::knot_mesh).closure.u);
  EXPECT_TRUE(trace_panel(tube(), PointRule::knot_mesh).closure.u);
}

}  // namespace
}  // namespace toile
