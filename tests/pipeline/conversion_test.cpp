// SPDX-License-Identifier: GPL-3.0-or-later
// Panels to other files: which panels, on which triangles, which way up.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "geometry/error.h"
#include "pipeline/convert/convert.h"
#include "pipeline/panels.h"

namespace toile {
namespace {

TrimmedSurface folded(TrimmedSurface face, const std::string& name) {
  Eigen::Matrix3Xd points = face.surface.points();
  for (Eigen::Index k = 0; k < points.cols(); ++k) points(2, k) = 60 * std::sin(points(0, k) / 50);
  face.surface = face.surface.with_points(points);
  face.name = name;
  return face;
}

// As draped.igs has them: two panels, each flat and draped.
PanelFile drape_of_two() {
  std::vector<OutputFace> faces;
  for (const char* name : {"front", "back"}) {
    const TrimmedSurface sheet =
        std::string(name) == "front" ? test::trimmed_sheet("front flat") : test::sheet("back flat");
    faces.push_back({sheet, sheet.name, 1, {}});
    faces.push_back({folded(sheet, ""), std::string(name) + " draped", 2, {}});
  }
  return parse_iges(format_iges(faces, IgesHeader{}).text, "draped.igs");
}

struct Obj {
  std::vector<std::string> objects;
  std::vector<Eigen::Vector3d> vertices;
  std::string textures, faces;
  explicit Obj(const std::string& text) {
    std::istringstream lines(text);
    for (std::string line, word; std::getline(lines, line);) {
      std::istringstream words(line);
      words >> word;
      Eigen::Vector3d x;
      if (word == "o" && words >> word) objects.push_back(word);
      if (word == "v" && words >> x[0] >> x[1] >> x[2]) vertices.push_back(x);
      if (line.starts_with("vt ")) textures += line + '\n';
      if (line.starts_with("f ")) faces += line + '\n';
    }
  }
};

TEST(Convert, OnlyTheNamedPanelsAreWritten) {
  const PanelFile file = drape_of_two();
  ConvertOptions options;
  options.only = {"back draped", "front flat"};
  const Conversion obj = convert(file, "out.obj", options);
  EXPECT_EQ(obj.panels, 2u);
  EXPECT_EQ(Obj(obj.bytes).objects, (std::vector<std::string>{"front_flat", "back_draped"}));
  const PanelFile back = parse_iges(convert(file, "out.igs", options).bytes, "out.igs");
  ASSERT_EQ(back.panels.size(), 2u);
  EXPECT_EQ(back.panels[0].name, "front flat");
  EXPECT_EQ(back.panels[1].surface, file.panels[3].surface);
  options.only = {"front drapd"};
  try {
    convert(file, "out.obj", options);
    ADD_FAILURE() << "a name that no panel has";
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "draped.igs: no panel is called 'front drapd'; did you mean 'front draped'?");
  }
}

TEST(Convert, AFileWithoutPanelsGivesNone) {
  PanelFile file;
  file.path = "in.dxf";
  for (const char* target : {"out.igs", "out.svg", "out.obj", "out.json"})
    EXPECT_THROW(convert(file, target), InputError);
  file.refused = {"in.dxf:3: the outline is open", "in.dxf:9: it crosses itself"};
  for (const char* target : {"out.igs", "out.svg", "out.obj", "out.json"}) {
    try {
      convert(file, target);
      ADD_FAILURE() << target;
    } catch (const GeometryError& error) {
      EXPECT_EQ(std::string(error.what()), file.refused[0]);
    }
  }
}

TEST(Convert, ADrapeHasTheTrianglesAndTheTextureOfItsPattern) {
  const PanelFile file = drape_of_two();
  const auto alone = [&](const char* name) {
    ConvertOptions options;
    options.only = {name};
    return Obj(convert(file, "out.obj", options).bytes);
  };
  const Obj flat = alone("front flat"), draped = alone("front draped");
  ASSERT_GT(flat.vertices.size(), 100u);
  EXPECT_EQ(flat.faces, draped.faces);
  EXPECT_EQ(flat.textures, draped.textures);
  ASSERT_EQ(flat.vertices.size(), draped.vertices.size());
  double apart = 0;
  for (std::size_t k = 0; k < flat.vertices.size(); ++k) {
    // One material point: the fold moves it along z alone, as far as the spline follows it.
    EXPECT_LT((flat.vertices[k] - draped.vertices[k]).head<2>().norm(), 1e-12);
    apart = std::max(apart, std::abs(draped.vertices[k].z()));
  }
  EXPECT_GT(apart, 0.03);
  // On its own the fold would be cut into other triangles.
  PanelFile lone = file;
  lone.panels = {file.panels[1]};
  EXPECT_NE(Obj(convert(lone, "out.obj").bytes).faces, draped.faces);
}

// y of the GLB's first position accessor, least and largest.
std::pair<double, double> heights(const std::string& glb) {
  const auto json = nlohmann::json::parse(glb.substr(20, glb.find("BIN") - 24));
  const auto& positions = json["accessors"][json["meshes"][0]["primitives"][0]["attributes"]["POSITION"].get<int>()];
  return {positions["min"][1], positions["max"][1]};
}

TEST(Convert, GlbTakesUpFromTheOptionTheFileOrItsKind) {
  PanelFile file = drape_of_two();
  ConvertOptions options;
  options.only = {"front flat"};
  // A sheet in the plane of x and y, 20 to 380 mm in y: lying where z is up, standing where y is.
  const auto height = [&] {
    const auto [low, high] = heights(convert(file, "out.glb", options).bytes);
    return high - low;
  };
  EXPECT_NEAR(height(), 0, 1e-12);
  file.up = Eigen::Vector3d::UnitY();
  EXPECT_NEAR(height(), 0.36, 1e-6);
  options.up = axis_named("z");
  EXPECT_NEAR(height(), 0, 1e-12);
  options.up = std::nullopt, file.up = std::nullopt;
  file.file = nullptr;  // no records: a pattern, which is drawn upright
  EXPECT_NEAR(height(), 0.36, 1e-6);
  EXPECT_EQ(*axis_named("-x"), Eigen::Vector3d(-1, 0, 0));
  EXPECT_FALSE(axis_named("w"));
  EXPECT_FALSE(axis_named("xy"));
}

TEST(Convert, AFileSaysWhichWayIsUp) {
  const std::vector<OutputFace> faces{{test::sheet("a"), "a", 0, {}}};
  IgesHeader header;
  EXPECT_FALSE(parse_iges(format_iges(faces, header).text, "a.igs").up);
  header.up = Eigen::Vector3d(0.6, 0, -0.8);
  EXPECT_EQ(*parse_iges(format_iges(faces, header).text, "a.igs").up, *header.up);
}

TEST(Convert, ObjComesWithItsMaterial) {
  const Conversion obj = convert(drape_of_two(), "dir/coat.obj");
  ASSERT_EQ(obj.beside.size(), 1u);
  EXPECT_EQ(obj.beside[0].first, "dir/coat.mtl");
  EXPECT_NE(obj.bytes.find("mtllib coat.mtl\n"), std::string::npos);
  EXPECT_EQ(conversion_targets("dir/coat.obj").size(), 2u);
  EXPECT_EQ(conversion_targets("dir/coat.glb").size(), 1u);
}

TEST(Convert, NetsAreTheFilesInMetres) {
  const PanelFile file = drape_of_two();
  const auto json = nlohmann::json::parse(convert(file, "net.json").bytes);
  ASSERT_EQ(json["panels"].size(), 4u);
  const NurbsSurface& s = file.panels[1].surface;
  const auto& panel = json["panels"][1];
  EXPECT_EQ(panel["name"], "front draped");
  EXPECT_EQ(panel["loops"][0]["curves"].size(), 4u);
  for (const auto& [i, j] : {std::pair{0, 0}, {3, 1}, {6, 6}}) {
    const auto x = panel["points"][std::size_t(i)][std::size_t(j)].get<std::vector<double>>();
    EXPECT_EQ(Eigen::Vector3d(x[0], x[1], x[2]), 1e-3 * s.points().col(s.index(i, j)));
  }
  EXPECT_TRUE(convert(file, "net.csv").bytes.starts_with("panel,i,j,x,y,z,weight,cloth\nfront flat,0,0,0,0,0,1,\n"));
}

}  // namespace
}  // namespace toile
