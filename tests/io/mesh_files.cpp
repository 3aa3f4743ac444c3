// Panels as triangles, read back by assimp: an independent reader of every format.
#include "io/mesh_files.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <assimp/Importer.hpp>
#include <filesystem>
#include <set>

#include "geometry/error.h"
#include "io/file.h"
#include "io/obj.h"
#include "io/pattern_json.h"
#include "io/triangle_mesh.h"
#include "support/near.h"
#include "trimming/loops.h"
#include "trimming/quadrature.h"

namespace toile {
namespace {

using Eigen::Vector3d;

// Two panels in metres, the first with a hole.
struct Meshes {
  std::vector<TrimmedSurface> faces;
  std::vector<TrimmedTriangles> triangles;
  std::vector<FramePanel> panels;
  double area = 0;  // of the trims, m2

  Meshes() {
    const std::string name = "bodice_and_cuff.json";
    faces = parse_pattern(read_file(std::filesystem::path(TOILE_TEST_DATA) / "patterns" / name), name).file.panels;
    for (TrimmedSurface& face : faces) {
      face.surface = face.surface.with_points(face.metres_per_unit * face.surface.points());
      face.metres_per_unit = 1;
      validate_loops(face);
      const TrimTopology topology = trace_trims(face);
      triangles.push_back(triangulate(face, topology));
      area += measure(face, topology).area;
    }
    for (std::size_t k = 0; k < faces.size(); ++k) {
      FramePanel panel;
      panel.name = faces[k].name;
      panel.surface = &faces[k].surface;
      panel.face = &faces[k];
      panel.triangles = &triangles[k];
      panels.push_back(panel);
    }
  }
  Frame frame() const { return {0, 0, panels}; }
};

std::filesystem::path written(const std::string& ending, const std::string& bytes) {
  const auto path = std::filesystem::temp_directory_path() / ("toile_mesh_" + std::to_string(::getpid()) + ending);
  write_file(path, bytes);
  return path;
}

TEST(MeshFiles, EveryFormatReadsBackWithItsAreaOrientationAndPlace) {
  const Meshes meshes;
  std::size_t count = 0;
  for (const TrimmedTriangles& t : meshes.triangles) count += t.triangles.size();
  for (const auto& [ending, bytes] : {std::pair<std::string, std::string>{".obj", format_obj(meshes.frame())},
                                      {".ply", format_ply(meshes.frame())},
                                      {".stl", format_stl(meshes.frame())},
                                      {".glb", format_glb(meshes.frame())}}) {
    SCOPED_TRACE(ending);
    const auto path = written(ending, bytes);
    const TriangleMesh mesh = read_mesh(path);
    std::filesystem::remove(path);
    EXPECT_EQ(mesh.triangles.size(), count);
    double area = 0;
    for (const auto& [a, b, c] : mesh.triangles) {
      const Vector3d p = mesh.vertices.col(a), q = mesh.vertices.col(b), r = mesh.vertices.col(c);
      const Vector3d normal = (q - p).cross(r - p) / 2;
      EXPECT_GE(normal.z(), 0);
      area += normal.z();
    }
    expect_near_rel(area, meshes.area, 5e-3);  // chords stand for the curves
    // Metres: the bodice is 0.32 m wide, the cuff lies beside it.
    expect_near_rel(mesh.vertices.row(0).minCoeff(), -0.32, 1e-6);
    EXPECT_NEAR(mesh.vertices.row(0).maxCoeff(), 0.32, 0.01);
    EXPECT_EQ(mesh.vertices.row(2).cwiseAbs().maxCoeff(), 0);
  }
}

TEST(MeshFiles, NamesArriveWhereTheFormatHasThem) {
  const Meshes meshes;
  for (const auto& [ending, bytes] : {std::pair<std::string, std::string>{".obj", format_obj(meshes.frame())},
                                      {".glb", format_glb(meshes.frame())}}) {
    Assimp::Importer importer;
    const aiScene* scene =
        importer.ReadFileFromMemory(bytes.data(), bytes.size(), aiProcess_ValidateDataStructure, ending.c_str() + 1);
    ASSERT_NE(scene, nullptr) << ending << importer.GetErrorString();
    std::set<std::string> names;
    for (unsigned k = 0; k < scene->mNumMeshes; ++k) names.insert(scene->mMeshes[k]->mName.C_Str());
    EXPECT_EQ(names, (std::set<std::string>{"bodice", "cuff"})) << ending;
    for (unsigned k = 0; k < scene->mNumMeshes; ++k) EXPECT_TRUE(scene->mMeshes[k]->HasTextureCoords(0)) << ending;
  }
  EXPECT_NE(format_ply(meshes.frame()).find("comment panel 1 cuff\n"), std::string::npos);
}

TEST(MeshFiles, TheSameFrameGivesTheSameBytes) {
  const Meshes meshes;
  for (const auto format : {format_ply, format_stl, format_glb})
    EXPECT_EQ(format(meshes.frame()), format(meshes.frame()));
}

TEST(TriangleMesh, WhatIsNoMeshIsRefusedWithItsName) {
  for (const auto& [ending, bytes] : {std::pair<std::string, std::string>{".obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"},
                                      {".obj", "hello\n"},
                                      {".stl", "solid nothing\nendsolid\n"},
                                      {".ply", "ply\nformat ascii 1.0\n"},
                                      {".xyz", "1 2 3"}}) {
    const auto path = written(ending, bytes);
    try {
      read_mesh(path);
      ADD_FAILURE() << "accepted " << ending << ": " << bytes;
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).find(path.string()), 0u) << error.what();
    }
    std::filesystem::remove(path);
  }
  EXPECT_THROW(read_mesh("/nowhere/body.obj"), InputError);
}

}  // namespace
}  // namespace toile
