// SPDX-License-Identifier: GPL-3.0-or-later
// Panels as triangles, read back by assimp: an independent reader of every format.
#include "io/mesh_files.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <stdexcept>

#include "geometry/error.h"
#include "io/file.h"
#include "io/mesh_vertices.h"
#include "io/net_files.h"
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
  // The pattern is drawn in the plane of x and y; GLB takes it as it is where y is up.
  Frame upright = meshes.frame();
  upright.up = Vector3d::UnitY();
  for (const auto& [ending, bytes] :
       {std::pair<std::string, std::string>{".obj", format_obj(meshes.frame(), "cloth.mtl")},
        {".ply", format_ply(meshes.frame())},
        {".stl", format_stl(meshes.frame())},
        {".glb", format_glb(upright)}}) {
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
  for (const auto& [ending, bytes] :
       {std::pair<std::string, std::string>{".obj", format_obj(meshes.frame(), "cloth.mtl")},
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

// Vertices of a GLB, by assimp, and texture coordinates as the file has them: assimp counts them from below.
struct Glb {
  Assimp::Importer importer;
  const aiScene* scene = nullptr;
  explicit Glb(const Frame& frame) {
    const std::string bytes = format_glb(frame);
    scene = importer.ReadFileFromMemory(bytes.data(), bytes.size(), aiProcess_ValidateDataStructure, "glb");
    if (!scene) throw std::runtime_error(importer.GetErrorString());
  }
  static Vector3d vector(const aiVector3D& x) { return {x.x, x.y, x.z}; }
};

TEST(MeshFiles, GlbStandsUpright) {
  const Meshes meshes;
  Frame frame = meshes.frame();
  const Eigen::Vector3d tilted = Vector3d(0.36, 0.48, 0.8);
  for (const Vector3d& up :
       {Vector3d(0, 0, 1), Vector3d(0, 1, 0), Vector3d(1, 0, 0), Vector3d(0, 0, -1), Vector3d(0, -1, 0), tilted}) {
    SCOPED_TRACE(up.transpose());
    frame.up = up;
    const Glb glb(frame);
    ASSERT_EQ(glb.scene->mNumMeshes, 2u);
    // A rotation: heights become y, distances and handedness stay.
    for (unsigned m = 0; m < 2; ++m) {
      const aiMesh& mesh = *glb.scene->mMeshes[m];
      const auto& uv = meshes.triangles[m].uv;
      ASSERT_EQ(mesh.mNumVertices, uv.size());
      const auto source = [&](std::size_t k) { return meshes.faces[m].surface(uv[k].x(), uv[k].y()); };
      for (unsigned k = 0; k + 2 < mesh.mNumVertices; k += 5) {
        const Vector3d x = Glb::vector(mesh.mVertices[k]), n = Glb::vector(mesh.mNormals[k]);
        EXPECT_NEAR(x.y(), source(k).dot(up), 1e-6);
        EXPECT_NEAR(n.y(), Vector3d::UnitZ().dot(up), 1e-6);
        const Vector3d a = Glb::vector(mesh.mVertices[k + 1]) - x, b = Glb::vector(mesh.mVertices[k + 2]) - x;
        const Vector3d c = source(k + 1) - source(k), d = source(k + 2) - source(k);
        EXPECT_NEAR(a.norm(), c.norm(), 1e-6);
        EXPECT_NEAR(a.cross(b).dot(n), c.cross(d).z(), 1e-6);
      }
    }
  }
  frame.up = Vector3d::UnitZ();
  const Glb glb(frame);
  const Vector3d x = Glb::vector(glb.scene->mMeshes[0]->mVertices[0]);
  const Eigen::Vector2d uv = meshes.triangles[0].uv[0];
  const Vector3d source = meshes.faces[0].surface(uv.x(), uv.y());
  EXPECT_EQ(x, Vector3d(source.x(), source.z(), -source.y()).cast<float>().cast<double>());
}

TEST(MeshFiles, TexturesAreThePatternsAtOneScaleNoneOverAnother) {
  const Meshes meshes;
  const auto texture = pattern_coordinates(meshes.frame());
  Eigen::AlignedBox2d all;
  std::vector<Eigen::AlignedBox2d> boxes(2);
  std::vector<double> scales;
  for (std::size_t k = 0; k < 2; ++k) {
    const TrimmedTriangles& mesh = meshes.triangles[k];
    for (const Eigen::Vector2d& t : texture[k]) boxes[k].extend(t), all.extend(t);
    for (const auto& [a, b, c] : mesh.triangles) {
      // Flat panels: lengths and senses of rotation are those of the cloth.
      const auto at = [](int v) { return static_cast<std::size_t>(v); };
      const Eigen::Vector2d p = texture[k][at(b)] - texture[k][at(a)], q = texture[k][at(c)] - texture[k][at(a)];
      EXPECT_GE(p.x() * q.y() - p.y() * q.x(), 0);
      const auto place = [&](int v) { return meshes.faces[k].surface(mesh.uv[at(v)].x(), mesh.uv[at(v)].y()); };
      scales.push_back(p.norm() / (place(b) - place(a)).norm());
    }
  }
  EXPECT_GE(all.min().minCoeff(), 0);
  EXPECT_LE(all.max().maxCoeff(), 1);
  EXPECT_NEAR(all.max().maxCoeff(), 1, 1e-12);
  EXPECT_FALSE(boxes[0].intersects(boxes[1]));
  for (const double scale : scales) expect_near_rel(scale, scales[0], 1e-9);

  // The same in every format; glTF counts from the upper edge, assimp turns that back.
  const Glb glb(meshes.frame());
  for (unsigned k = 0; k < texture[0].size(); k += 7) {
    EXPECT_NEAR(glb.scene->mMeshes[0]->mTextureCoords[0][k].x, texture[0][k].x(), 1e-6);
    EXPECT_NEAR(glb.scene->mMeshes[0]->mTextureCoords[0][k].y, texture[0][k].y(), 1e-6);
  }
  const std::string bytes = format_glb(meshes.frame());
  const auto json = nlohmann::json::parse(bytes.substr(20, bytes.find("BIN") - 24));
  const auto& accessor = json["accessors"][json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"].get<int>()];
  const std::size_t at =
      bytes.find("BIN") + 4 + json["bufferViews"][accessor["bufferView"].get<int>()]["byteOffset"].get<std::size_t>();
  std::array<float, 2> first;
  std::memcpy(first.data(), bytes.data() + at, sizeof first);
  EXPECT_EQ(first[0], float(texture[0][0].x()));
  EXPECT_EQ(first[1], float(1 - texture[0][0].y()));
}

TEST(MeshFiles, ADrapeSharesTheTextureOfItsPattern) {
  Meshes meshes;
  // Bent: lengths change, the pattern's don't.
  Eigen::Matrix3Xd bent = meshes.faces[0].surface.points();
  for (Eigen::Index k = 0; k < bent.cols(); ++k) bent(2, k) += 0.3 * bent(0, k) * bent(0, k);
  const NurbsSurface drape = meshes.faces[0].surface.with_points(bent);
  const NurbsSurface flat = meshes.faces[0].surface;
  std::vector<FramePanel> both{meshes.panels[0], meshes.panels[0]};
  both[0].flat = both[1].flat = both[0].surface = &flat;
  both[1].surface = &drape;
  const auto texture = pattern_coordinates({0, 0, both});
  EXPECT_EQ(texture[0], texture[1]);
  EXPECT_EQ(texture[0], pattern_coordinates({0, 0, {&both[1], 1}})[0]);
}

TEST(MeshFiles, ObjHasAnObjectAPanelWithNormalsAndMaterial) {
  const Meshes meshes;
  const std::string text = format_obj(meshes.frame(), "coat.mtl");
  EXPECT_NE(text.find("metres, axes of the scene, up is 0 0 1\n"), std::string::npos);
  EXPECT_NE(text.find("\nmtllib coat.mtl\n"), std::string::npos);
  EXPECT_NE(text.find("\no bodice\n"), std::string::npos);
  EXPECT_NE(text.find("\no cuff\n"), std::string::npos);
  EXPECT_NE(text.find("\nvn 0 0 1\n"), std::string::npos);
  EXPECT_NE(format_mtl().find("newmtl cloth\n"), std::string::npos);
  EXPECT_NE(text.find("\nusemtl cloth\n"), std::string::npos);
}

// The rule of readers such as meshio, which take numbers at vertices and lists, not both, at faces.
TEST(MeshFiles, PlyFacesHoldTheirVerticesAlone) {
  const std::string bytes = format_ply(Meshes().frame());
  const std::string head = bytes.substr(0, bytes.find("end_header"));
  const std::string faces = head.substr(head.find("element face"));
  EXPECT_EQ(faces.substr(faces.find('\n') + 1), "property list uchar int vertex_indices\n");
  EXPECT_LT(head.find("property int panel"), head.find("element face"));
}

TEST(MeshFiles, NetsComeBackDigitByDigit) {
  const Meshes meshes;
  const auto json = nlohmann::json::parse(format_net_json(meshes.frame()));
  std::istringstream csv(format_net_csv(meshes.frame()));
  std::string line;
  std::getline(csv, line);
  EXPECT_EQ(line, "panel,i,j,x,y,z,weight,cloth");
  ASSERT_EQ(json["panels"].size(), 2u);
  for (std::size_t k = 0; k < 2; ++k) {
    const NurbsSurface& s = meshes.faces[k].surface;
    const auto& panel = json["panels"][k];
    EXPECT_EQ(panel["name"], meshes.faces[k].name);
    EXPECT_EQ(panel["degree"], (std::vector<int>{s.u().degree(), s.v().degree()}));
    EXPECT_EQ(panel["knots"][1].size(), s.v().knots().size());
    EXPECT_EQ(panel["loops"].size(), meshes.faces[k].loops.size());
    EXPECT_EQ(panel["loops"][0]["curves"].size(), meshes.faces[k].loops[0].curves.size());
    for (int i = 0; i < s.count_u(); ++i)
      for (int j = 0; j < s.count_v(); ++j) {
        const Vector3d x = s.points().col(s.index(i, j));
        const auto at = panel["points"][std::size_t(i)][std::size_t(j)].get<std::vector<double>>();
        EXPECT_EQ(Vector3d(at[0], at[1], at[2]), x);
        ASSERT_TRUE(std::getline(csv, line));
        std::replace(line.begin(), line.end(), ',', ' ');
        std::istringstream cells(line);
        std::string name, a, b, c;
        int row = -1, column = -1;
        cells >> name >> row >> column >> a >> b >> c;
        EXPECT_EQ(row, i);
        EXPECT_EQ(column, j);
        EXPECT_EQ(Vector3d(std::stod(a), std::stod(b), std::stod(c)), x);
      }
  }
  EXPECT_FALSE(std::getline(csv, line));
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
