// SPDX-License-Identifier: GPL-3.0-or-later
// Obstacles of a scene: files, their faults, where they are put, how they move.
#include "pipeline/build/obstacles.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "geometry/error.h"
#include "geometry/mesh_repair.h"
#include "io/file.h"
#include "pipeline/build/iges_body.h"
#include "pipeline/panels.h"
#include "support/bodies.h"

namespace toile {
namespace {

using Eigen::Vector3d;
using test::Folder;

const std::filesystem::path corpus = TOILE_TEST_DATA;
constexpr double infinite = std::numeric_limits<double>::infinity();

std::string obj_text(const TriangleMesh& mesh) {
  std::string out;
  for (Eigen::Index k = 0; k < mesh.vertices.cols(); ++k)
    out += fmt::format("v {} {} {}\n", mesh.vertices(0, k), mesh.vertices(1, k), mesh.vertices(2, k));
  for (const Triangle& t : mesh.triangles) out += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  return out;
}

// A folder with meshes, and a scene around its obstacles.
struct Bodies : Folder {
  explicit Bodies(const std::string& name) : Folder(name) {
    write_file(*this / "panel.txt", "");
    write_file(*this / "box.obj", obj_text(test::box_mesh({0.25, 0.5, 0.125})));
  }
  Scene scene(const std::string& obstacle, const std::string& rest = "") const {
    return parse_scene(fmt::format("obstacle = [{{ {} }}]\n[[panel]]\nfile = \"panel.txt\"\n{}", obstacle, rest),
                       *this / "scene.toml");
  }
  BuiltObstacle build(const std::string& obstacle, const std::string& rest = "") const {
    const Scene s = scene(obstacle, rest);
    return build_obstacle(s, s.obstacles[0]);
  }
  std::string refusal(const std::string& obstacle) const {
    try {
      build(obstacle);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }
};

bool says(const std::vector<std::string>& lines, const std::string& words) {
  return std::ranges::any_of(lines, [&](const std::string& line) { return line.find(words) != std::string::npos; });
}

double distance(const BuiltObstacle& built, const Vector3d& p) {
  return built.obstacle->nearest(p, infinite)->distance;
}

TEST(Obstacles, AMeshIsPutWhereTheSceneSays) {
  const Bodies folder("obstacle_mesh");
  const BuiltObstacle box = folder.build("mesh = \"box.obj\", name = \"box\", friction = 0.5");
  EXPECT_EQ(box.obstacle->name(), "box");
  EXPECT_EQ(box.obstacle->friction(), 0.5);
  EXPECT_EQ(box.obstacle->thickness(), 0.003);
  EXPECT_TRUE(box.obstacle->still());
  EXPECT_EQ(box.about, "obstacle 'box': 12 triangles, closed, 0.5 x 1 x 0.25 m");
  EXPECT_TRUE(box.warnings.empty() && box.notes.empty());
  EXPECT_NEAR(distance(box, {0, 0.6, 0}), 0.1, 1e-7);
  // 10 cm for 1 m, a quarter turn about z, then 1 m up.
  const BuiltObstacle placed =
      folder.build("mesh = \"box.obj\", unit = \"dm\", place = { translate = [0, 0, 1], rotate_deg = [0, 0, 90] }");
  EXPECT_NEAR(distance(placed, {0.06, 0, 1}), 0.01, 1e-7);
  EXPECT_NEAR(distance(placed, {0, 0.03, 1}), 0.005, 1e-7);
  // y of the file goes up, wherever that is in the scene.
  EXPECT_NEAR(distance(folder.build("mesh = \"box.obj\", up = \"y\""), {0, 0, 0.6}), 0.1, 1e-7);
  EXPECT_NEAR(distance(folder.build("mesh = \"box.obj\", up = \"z\""), {0, 0.6, 0}), 0.1, 1e-7);
  const std::string y_up = "[load]\ngravity = [0, -9.81, 0]\n";
  EXPECT_NEAR(distance(folder.build("mesh = \"box.obj\", up = \"y\"", y_up), {0, 0.6, 0}), 0.1, 1e-7);
  EXPECT_NEAR(distance(folder.build("mesh = \"box.obj\", up = \"z\"", y_up), {0, 0.225, 0}), 0.1, 1e-7);
}

// Up is against gravity, whichever way that points. The box's corner of all its greatest coordinates has a spike.
TEST(Obstacles, UpIsAgainstGravity) {
  const Bodies folder("obstacle_up");
  TriangleMesh cone = test::box_mesh({0.25, 0.5, 0.125});
  cone.vertices.col(7).y() = 1;
  write_file(folder / "spike.obj", obj_text(cone));
  const Vector3d tip(0.25, 1, 0.125);
  for (const auto& [gravity, way] : {std::pair{"[0, 0, -9.81]", Vector3d(0, 0, 1)},
                                     {"[0, 0, 9.81]", Vector3d(0, 0, -1)},
                                     {"[0, 9.81, 0]", Vector3d(0, -1, 0)},
                                     {"[-9.81, 0, 0]", Vector3d(1, 0, 0)},
                                     {"[0, -3, -4]", Vector3d(0, 0.6, 0.8)}}) {
    SCOPED_TRACE(gravity);
    const BuiltObstacle built =
        folder.build("mesh = \"spike.obj\", up = \"y\"", fmt::format("[load]\ngravity = {}\n", gravity));
    // The spike reaches 1 m up; nothing else of the box is higher than 0.5 m or wider than 0.3 m.
    const auto highest = built.obstacle->nearest(3 * way, infinite);
    ASSERT_TRUE(highest);
    EXPECT_NEAR(highest->distance, (Vector3d(0, 3, 0) - tip).norm(), 1e-7);
    EXPECT_NEAR(distance(built, -3 * way), 2.5, 1e-7);
  }
}

// Each seen from a place whose distance is known; turned a quarter about x, which takes y to z, then 1 m along x.
TEST(Obstacles, ShapesArePutAndMovedAsMeshesAre) {
  const Bodies folder("obstacle_shapes");
  struct Case {
    const char* keys;
    Vector3d p;
    double distance;
  };
  for (const Case& c :
       {Case{"shape = \"plane\", point = [0, 1, 0], normal = [0, 1, 0]", {9, 9, 1.5}, 0.5},
        Case{"shape = \"sphere\", centre = [0, 1, 0], radius = 0.25", {1, 0, 1.5}, 0.25},
        Case{"shape = \"cylinder\", from = [0, 0, 0], to = [0, 1, 0], radius = 0.25", {1.5, 0, 0.5}, 0.25},
        Case{"shape = \"capsule\", from = [0, 0, 0], to = [0, 1, 0], radius = 0.25", {1, 0, 1.5}, 0.25},
        Case{"shape = \"box\", centre = [0, 1, 0], size = [1, 2, 3]", {1, 0, 2.5}, 0.5}}) {
    SCOPED_TRACE(c.keys);
    const std::string keys = c.keys + std::string(", place = { translate = [1, 0, 0], rotate_deg = [90, 0, 0] }");
    const BuiltObstacle still = folder.build(keys + ", friction = 0.6");
    EXPECT_TRUE(still.obstacle->still());
    EXPECT_EQ(still.obstacle->friction(), 0.6);
    EXPECT_EQ(still.obstacle->thickness(), 0);
    EXPECT_NEAR(distance(still, c.p), c.distance, 1e-12);
    const BuiltObstacle moved = folder.build(keys + ", move = { translate = [0, 0, 2], end = 1 }");
    moved.obstacle->move(0, 1);
    EXPECT_NEAR(distance(moved, c.p + Vector3d(0, 0, 2)), c.distance, 1e-12);
  }
}

TEST(Obstacles, MoveAboutTheMiddleAndThroughShapes) {
  const Bodies folder("obstacle_motion");
  TriangleMesh wide = test::box_mesh({0.5, 0.5, 0.125});
  write_file(folder / "wide.obj", obj_text(wide));
  const std::string middle = "place = { translate = [2, 0, 0] }, move = { rotate_deg = [0, 0, 90], end = 1 }";
  const BuiltObstacle turned = folder.build("mesh = \"box.obj\", " + middle);
  EXPECT_FALSE(turned.obstacle->still());
  turned.obstacle->move(0, 1);
  EXPECT_NEAR(distance(turned, {2.6, 0, 0}), 0.1, 1e-7);
  EXPECT_LT((turned.obstacle->carry({2, 0.5, 0}, 0) - Vector3d(1.5, 0, 0)).norm(), 1e-12);

  const BuiltObstacle morph = folder.build("mesh = \"box.obj\", morph = { to = \"wide.obj\", start = 1, end = 2 }");
  morph.obstacle->move(0, 1);
  EXPECT_NEAR(distance(morph, {1, 0, 0}), 0.75, 1e-7);
  morph.obstacle->move(1, 1.5);
  EXPECT_NEAR(distance(morph, {1, 0, 0}), 0.625, 1e-7);
  const BuiltObstacle sequence =
      folder.build("sequence = [\"box.obj\", \"wide.obj\", \"box.obj\"], times = [0, 1, 2], up = \"y\"");
  sequence.obstacle->move(1, 1.25);
  EXPECT_NEAR(distance(sequence, {1, 0, 0}), 0.5625, 1e-7);
}

TEST(Obstacles, FaultsOfAMeshAreRepairedAndSaidOrRefusedWithTheirPlace) {
  const Bodies folder("obstacle_faults");
  TriangleMesh mesh = test::box_mesh({0.25, 0.5, 0.125});
  for (Triangle& t : mesh.triangles) std::swap(t[0], t[1]);
  write_file(folder / "inside_out.obj", obj_text(mesh));
  const BuiltObstacle turned = folder.build("mesh = \"inside_out.obj\"");
  EXPECT_TRUE(says(turned.notes, "scene.toml:1: obstacle 'obstacle_1': ")) << turned.notes[0];
  EXPECT_TRUE(says(turned.notes, "inside out")) << turned.notes[0];
  EXPECT_LT(distance(turned, {0, 0, 0}), 0);

  mesh = test::box_mesh({0.25, 0.5, 0.125});
  mesh.triangles.pop_back();
  write_file(folder / "open.obj", obj_text(mesh));
  EXPECT_TRUE(says(folder.build("mesh = \"open.obj\"").warnings, "the mesh is open: 1 border"));

  mesh.triangles.push_back({3, 7, 5});
  TriangleMesh two = mesh;
  two.vertices.conservativeResize(3, 16);
  two.vertices.rightCols(8) = mesh.vertices.colwise() + Vector3d(0.1, 0.2, 0.05);
  for (const Triangle& t : mesh.triangles) two.triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
  write_file(folder / "two.obj", obj_text(two));
  EXPECT_TRUE(says(folder.build("mesh = \"two.obj\"").warnings, "passes through itself"));

  two = mesh;
  two.vertices.conservativeResize(3, 9);
  two.vertices.col(8) << 0, -1, -1;
  two.triangles.push_back({0, 1, 8});
  write_file(folder / "fin.obj", obj_text(two));
  const BuiltObstacle fin = folder.build("mesh = \"fin.obj\"");
  EXPECT_TRUE(says(fin.warnings, "scene.toml:1: obstacle 'obstacle_1': ")) << fin.warnings[0];
  EXPECT_TRUE(says(fin.warnings,
                   "fin.obj: at 1 edge no two triangles go on in each other, the first where 3 meet from "
                   "(-0.25, -0.5, -0.125)"))
      << fin.warnings[0];
  write_file(folder / "nan.obj", "v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n");
  EXPECT_NE(folder.refusal("mesh = \"nan.obj\"").find("scene.toml:1: obstacle 'obstacle_1': "), std::string::npos);
  write_file(folder / "nothing.obj", "v 0 0 0\n");
  EXPECT_NE(folder.refusal("mesh = \"nothing.obj\"").find("scene.toml:1: obstacle 'obstacle_1': "), std::string::npos);
  EXPECT_NE(folder.refusal("sequence = [\"box.obj\", \"two.obj\"], times = [0, 1]").find("write both from one mesh"),
            std::string::npos);

  // Of a scene all faults at once.
  const Scene scene = parse_scene(
      "obstacle = [{ mesh = \"nan.obj\" }, { mesh = \"box.obj\" }, { mesh = \"nothing.obj\" }]\n[[panel]]\nfile = "
      "\"panel.txt\"\n",
      folder / "scene.toml");
  const BuiltObstacles check = build_obstacles(scene);
  EXPECT_EQ(check.faults.size(), 2u);
  EXPECT_EQ(check.about.size(), 1u);
}

TEST(Obstacles, AnAbsurdSizeIsAdvisedOn) {
  const Bodies folder("obstacle_size");
  write_file(folder / "mm.obj", obj_text(test::box_mesh({200, 850, 150})));
  EXPECT_TRUE(says(folder.build("mesh = \"mm.obj\"").warnings,
                   "it is 1700 m large: is the file's unit another one? unit = \"mm\" would make it 1.7 m"));
  EXPECT_TRUE(folder.build("mesh = \"mm.obj\", unit = \"mm\"").warnings.empty());
  EXPECT_TRUE(says(folder.build("mesh = \"box.obj\", unit = \"mm\"").warnings, "unit = \"m\" would make it 1 m"));
}

// A can of radius 100 and height 300: its side in two patches, its lids planes cut by arcs that end elsewhere.
std::vector<TrimmedSurface> can() {
  std::vector<TrimmedSurface> faces;
  const double parts[] = {0, 2.5, 2 * std::numbers::pi};
  for (int k = 0; k < 2; ++k) {
    const Curve2 arc = circular_arc({0, 0}, 100, parts[k], parts[k + 1]);
    const Eigen::Index n = arc.points().cols();
    Eigen::Matrix3Xd net(3, 2 * n);
    std::vector<double> weights;
    for (Eigen::Index i = 0; i < 2 * n; ++i) {
      net.col(i) << arc.points().col(i % n), i < n ? 0 : 300;
      weights.push_back(arc.weights()[i % n]);
    }
    faces.push_back(untrimmed(NurbsSurface(arc.knots(), uniform_knots(1, 1), net, weights)));
  }
  for (const double z : {0.0, 300.0}) {
    const AffinePatch plane{{-150, -150, z}, {1, 0, 0}, {0, 1, 0}, 0};
    TrimmedSurface lid = untrimmed(rebuild(plane, uniform_knots(2, 3, {0, 300}), uniform_knots(2, 3, {0, 300})));
    lid.natural_bounds = false;
    TrimLoop loop;
    for (const double from : {1.0, 1.0 + std::numbers::pi}) {
      TrimCurve trim;
      trim.curve = circular_arc({150, 150}, 100, from, from + std::numbers::pi);
      trim.index = static_cast<int>(loop.curves.size());
      loop.curves.push_back(trim);
    }
    lid.loops = {loop};
    faces.push_back(lid);
  }
  for (std::size_t k = 0; k < faces.size(); ++k) {
    faces[k].name = fmt::format("face {}", k);
    faces[k].metres_per_unit = 1e-3;
  }
  return faces;
}

TEST(Obstacles, AnAbsurdSizeOfAnIgesBodyIsTheFilesUnit) {
  const Bodies folder("obstacle_iges_size");
  std::vector<TrimmedSurface> small = can();
  for (TrimmedSurface& face : small) face.metres_per_unit = 1e-6;
  test::write_panels(folder / "can.igs", small);
  const BuiltObstacle built = folder.build("mesh = \"can.igs\", chord_error = \"1 um\"");
  EXPECT_TRUE(says(built.warnings, "as its file says that a unit is 1e-06 m")) << built.warnings.size();
  for (const std::string& warning : built.warnings) EXPECT_EQ(warning.find("unit = "), std::string::npos) << warning;
}

// Off by no more than the area times the chord error, whatever the faces' own points along their common edges.
TEST(Obstacles, FacesOfAnIgesFileBecomeOneClosedBody) {
  constexpr double pi = std::numbers::pi;
  const Bodies folder("obstacle_iges");
  test::write_panels(folder / "can.igs", can());
  struct Case {
    std::filesystem::path file;
    double volume, area;  // mm3, mm2
  };
  for (const auto& [file, exact, area] :
       {Case{folder / "can.igs", pi * 1e4 * 300, 2 * pi * 100 * 400},
        Case{corpus / "iges/solid_186.igs", 30 * 40 * 50 / 6.0, 5000},
        Case{corpus / "iges/sphere_and_torus.igs", 4 * pi / 3 * 21 * 21 * 21 + 2 * pi * pi * 30 * 8 * 8,
             4 * pi * 21 * 21 + 4 * pi * pi * 30 * 8}})
    for (const double chord_error : {0.25, 0.1}) {
      SCOPED_TRACE(file);
      SCOPED_TRACE(chord_error);
      const IgesBody body = read_iges_body(file, 1e-3 * chord_error);
      const RepairedMesh repaired = repair_mesh(body.mesh);
      ASSERT_TRUE(repaired.closed) << repaired.warnings[0];
      EXPECT_NEAR(test::volume(repaired.mesh), exact, area * chord_error);
    }
  const BuiltObstacle built = folder.build("mesh = \"can.igs\", up = \"y\"");
  EXPECT_NE(built.about.find("closed, 0.2 x 0.3 x 0.2 m"), std::string::npos) << built.about;
  EXPECT_NEAR(distance(built, {0, -0.01, 0.01}), -0.01, 1e-9);
  EXPECT_NEAR(distance(built, {0.15, -0.15, 0}), 0.05, 0.00025);
}

}  // namespace
}  // namespace toile
