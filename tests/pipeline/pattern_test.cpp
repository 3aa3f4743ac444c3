// SPDX-License-Identifier: GPL-3.0-or-later
// From a pattern file to a scene, to other files and to paper.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "geometry/error.h"
#include "io/file_formats.h"
#include "io/panel_file.h"
#include "pipeline/build/build.h"
#include "pipeline/convert/convert.h"
#include "pipeline/panels.h"
#include "pipeline/scene/body_fit.h"
#include "pipeline/scene/pattern_scene.h"
#include "pipeline/scene/scene.h"
#include "support/near.h"

namespace toile {
namespace {

using test::Folder;
const std::filesystem::path corpus = TOILE_TEST_DATA;

std::string skirt_text() {
  return read_file(corpus / "patterns/skirt.jsonc");
}

std::string replaced(std::string text, const std::string& old, const std::string& replacement) {
  return text.replace(text.find(old), old.size(), replacement);
}

// A box of 0.3 m x 1.666 m x 0.2 m with its soles at y = -1.
void write_box(const std::filesystem::path& file) {
  std::string text;
  for (const char* y : {"-1", "0.666"})
    for (const char* xz : {"-0.15 {} -0.1", "0.15 {} -0.1", "0.15 {} 0.1", "-0.15 {} 0.1"})
      text += "v " + replaced(xz, "{}", y) + "\n";
  text += "f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n";
  write_file(file, text);
}

int run(const Folder& folder, const std::string& arguments) {
  const int status = std::system(
      ("cd '" + folder.path().string() + "' && '" TOILE_PROGRAM "' " + arguments + " >stdout.txt 2>stderr.txt")
          .c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// Squares of 40 cm called a, b, c.
std::string squares(const std::string& stitches, const std::string& more = "") {
  std::string panels;
  for (const char* name : {"a", "b", "c"}) {
    panels += std::string(panels.empty() ? "" : ", ") + "\"" + name +
              "\": {\"vertices\": [[0, 0], [40, 0], [40, 40], [0, 40]], \"edges\": [{\"endpoints\": [0, 1]}, "
              "{\"endpoints\": [1, 2]}, {\"endpoints\": [2, 3]}, {\"endpoints\": [3, 0]}]}";
  }
  return "{\"properties\": {\"units_in_meter\": 100}, \"pattern\": {\"panels\": {" + panels + more +
         "}, \"stitches\": [" + stitches + "]}}";
}
std::string edge(const std::string& panel, int number) {
  return "{\"panel\": \"" + panel + "\", \"edge\": " + std::to_string(number) + "}";
}
const std::string bow =
    ", \"bow\": {\"vertices\": [[0, 0], [40, 0], [0, 60], [40, 60]], \"edges\": [{\"endpoints\": [0, 1]}, "
    "{\"endpoints\": [1, 2]}, {\"endpoints\": [2, 3]}, {\"endpoints\": [3, 0]}]}";

TEST(PatternScene, SeamsRunAsTheirStitchesSay) {
  const Folder folder("seams");
  const auto scene = [&](const std::string& text) {
    write_file(folder / "p.json", text);
    return parse_scene(pattern_scene(folder / "p.json", {}, folder / "scene.toml").text, folder / "scene.toml");
  };
  // The panels lie on each other: placement says nothing, the format does.
  Scene plain = scene(squares("[" + edge("a", 1) + "," + edge("b", 3) + "], [" + edge("b", 1) + "," + edge("c", 3) +
                              ", \"right_wrong\"]"));
  ASSERT_EQ(plain.seams.size(), 2u);
  EXPECT_TRUE(plain.seams[0].b.reverse);
  EXPECT_FALSE(plain.seams[1].b.reverse);
}

TEST(PatternScene, OneEdgeSewnToSeveralIsASeamOfCurvesOrOfShares) {
  const Folder folder("several");
  const auto scene = [&](const std::string& text) {
    write_file(folder / "p.json", text);
    return parse_scene(pattern_scene(folder / "p.json", {}, folder / "scene.toml").text, folder / "scene.toml");
  };
  // Two edges of one panel: one seam.
  const Scene one = scene(squares("[" + edge("a", 2) + "," + edge("b", 0) + "," + edge("b", 1) + "]"));
  ASSERT_EQ(one.seams.size(), 1u);
  EXPECT_EQ(one.seams[0].b.curves, (std::vector<int>{0, 1}));
  EXPECT_TRUE(one.seams[0].b.reverse);
  // Of two panels: each to its share, from the end of a's edge on, for the first begins where a's edge ends.
  const Scene two = scene(squares("[" + edge("a", 2) + "," + edge("b", 0) + "," + edge("c", 0) + "]"));
  ASSERT_EQ(two.seams.size(), 2u);
  EXPECT_EQ(two.seams[0].b.panel, "b");
  EXPECT_NEAR(two.seams[0].a.from, 0.5, 1e-9);
  EXPECT_NEAR(two.seams[0].a.to, 1, 1e-9);
  EXPECT_NEAR(two.seams[1].a.to, 0.5, 1e-9);
  EXPECT_TRUE(two.seams[1].b.reverse);
}

TEST(PatternScene, EveryCommandLeavesOutTheSamePanel) {
  const Folder folder("refused");
  write_file(folder / "p.json", squares("", bow));
  for (const char* command : {"inspect p.json", "convert p.json p.igs", "init --pattern p.json -o scene.toml"}) {
    EXPECT_EQ(run(folder, command), 4) << command;
    EXPECT_NE(read_file(folder / "stderr.txt").find("panel 'bow': the outline crosses itself at (20, 30)"),
              std::string::npos)
        << command;
  }
  EXPECT_EQ(read_panels(folder / "p.igs").panels.size(), 3u) << "the others are written";
  EXPECT_EQ(run(folder, "check scene.toml"), 0) << read_file(folder / "stderr.txt");
  write_file(folder / "bad.toml", "[[panel]]\nname = \"bow\"\npattern = \"p.json\"\n[[pin]]\nat = \"curve:0,0\"\n");
  EXPECT_EQ(run(folder, "check bad.toml"), 3);
  EXPECT_NE(read_file(folder / "stderr.txt").find("crosses itself"), std::string::npos);
  // Alone there is nothing to go on with, and nothing is written.
  std::string alone = squares("", bow);
  alone.erase(alone.find("\"a\": {"), alone.find("\"bow\"") - alone.find("\"a\": {"));
  write_file(folder / "alone.json", alone);
  for (const char* command :
       {"inspect alone.json", "convert alone.json alone.igs", "init --pattern alone.json -o alone.toml"})
    EXPECT_EQ(run(folder, command), 4) << command;
  EXPECT_FALSE(std::filesystem::exists(folder / "alone.igs"));
  EXPECT_FALSE(std::filesystem::exists(folder / "alone.toml"));
}

TEST(PatternScene, AFaultlessPatternGivesNoWarning) {
  const Folder folder("faultless");
  write_file(folder / "p.json", squares("[" + edge("a", 1) + "," + edge("b", 3) + "]"));
  ASSERT_EQ(run(folder, "init --pattern p.json -o scene.toml"), 0);
  EXPECT_EQ(read_file(folder / "stderr.txt").find("warning"), std::string::npos) << read_file(folder / "stderr.txt");
  ASSERT_EQ(run(folder, "check scene.toml --set 'seam=[]'"), 0);
  EXPECT_EQ(read_file(folder / "stderr.txt").find("warning"), std::string::npos) << read_file(folder / "stderr.txt");
  // A panel drawn clockwise is turned round, which is worth a note only.
  std::string clockwise = squares("");
  clockwise.replace(clockwise.find("[[0, 0], [40, 0], [40, 40], [0, 40]]"), 36, "[[0, 0], [0, 40], [40, 40], [40, 0]]");
  write_file(folder / "c.json", clockwise);
  ASSERT_EQ(run(folder, "inspect c.json --json"), 0);
  const auto json = nlohmann::json::parse(read_file(folder / "stdout.txt"));
  EXPECT_TRUE(json["warnings"].empty()) << json["warnings"].dump();
  EXPECT_EQ(json["notes"].size(), 1u);
}

TEST(PatternScene, PanelsOfADrawingHangUprightByTheirGrain) {
  const Folder folder("upright");
  // As pattern systems draw: the grain along x, two pieces one on the other.
  const auto piece = [](const std::string& name, const char* width) {
    const auto at = [](const std::string& x, const std::string& y) { return " 10\n" + x + "\n 20\n" + y + "\n"; };
    std::string out =
        "  0\nBLOCK\n  8\n0\n  2\n" + name + "\n" + at("0", "0") + "  0\nLWPOLYLINE\n  8\n1\n 90\n4\n 70\n1\n";
    for (const auto& p : {at("0", "0"), at("600", "0"), at("600", width), at("0", width)}) out += p;
    return out + "  0\nLINE\n  8\n7\n" + at("100", "50") + " 11\n500\n 21\n50\n  0\nENDBLK\n  8\n0\n";
  };
  write_file(
      folder / "p.dxf",
      "  0\nSECTION\n  2\nBLOCKS\n" + piece("A", "300") + piece("B", "200") +
          "  0\nENDSEC\n  0\nSECTION\n  2\nENTITIES\n  0\nTEXT\n  8\n1\n 10\n0\n 20\n0\n 40\n5\n  1\nUnits: METRIC\n"
          "  0\nENDSEC\n  0\nEOF\n");
  if (run(folder, "init --pattern p.dxf -o scene.toml") == 3) GTEST_SKIP() << "built without dxflib";
  const Build built = build(read_scene(folder / "scene.toml"));
  double left = 0;
  for (std::size_t k = 0; k < 2; ++k) {
    const Eigen::Matrix3Xd net = built.net(static_cast<int>(k), built.start);
    const double width = k == 0 ? 0.3 : 0.2;
    expect_near_rel(net.row(1).maxCoeff(), 0, 0, 1e-9);
    expect_near_rel(net.row(1).minCoeff(), -0.6, 1e-9);
    expect_near_rel(net.row(0).minCoeff(), left, 1e-9, 1e-9);
    expect_near_rel(net.row(0).maxCoeff(), left + width, 1e-9);
    left += width + 0.05;
  }
  EXPECT_EQ(built.scene.pins.size(), 2u) << "each by its upper edge";
}

TEST(BodyFit, ABoxHoldsWhatLiesInIt) {
  const Folder folder("box");
  write_box(folder / "body.obj");
  const TriangleMesh box = read_mesh(folder / "body.obj");
  EXPECT_EQ(count_inside(
                box, {{0, 0, 0}, {0.149, 0.6, 0.099}, {0.151, 0, 0}, {0, 0.7, 0}, {0, 0, -0.101}, {0.1, -0.9, 0.05}}),
            3);
  expect_near_rel(trunk_section(box, 0.1).girth, 1, 1e-7);  // meshes are read in single precision
  EXPECT_EQ(trunk_section(box, 2).girth, 0);
  expect_near_rel(turns_around({{1, 0}, {0, 1}, {-1, 0}, {0, -1}}, {0.2, 0.1}), 1, 1e-12);
  expect_near_rel(turns_around({{1, 0}, {0, 1}, {-1, 0}, {0, -1}}, {2, 0}), 0, 0, 1e-12);
}

TEST(PatternScene, SaysHowMuchLiesInTheBody) {
  const Folder folder("inside");
  write_box(folder / "body.obj");
  // The front half way into the box: its plane at z = 0, from x = -0.4 to 0.4 at the hem; the back stays behind it.
  write_file(folder / "skirt.jsonc",
             replaced(skirt_text(), "\"translation\": [0, 0, 60]", "\"translation\": [0, 0, 0]"));
  const PatternScene scene = pattern_scene(folder / "skirt.jsonc", folder / "body.obj", folder / "scene.toml");
  EXPECT_NE(scene.text.find("% of the panels lies inside the body, of 'front' "), std::string::npos) << scene.text;
  write_file(folder / "skirt.jsonc", skirt_text());
  EXPECT_NE(pattern_scene(folder / "skirt.jsonc", folder / "body.obj", folder / "scene.toml")
                .text.find("# 0.0 % of the panels lies inside the body."),
            std::string::npos);
}

TEST(PatternScene, TheSceneIsCompleteAndValid) {
  const Folder folder("pattern_scene");
  write_file(folder / "skirt.jsonc", skirt_text());
  write_box(folder / "body.obj");
  const PatternScene written = pattern_scene(folder / "skirt.jsonc", folder / "body.obj", folder / "scene.toml");
  const Scene scene = parse_scene(written.text, folder / "scene.toml");
  ASSERT_EQ(scene.panels.size(), 2u);
  EXPECT_EQ(scene.panels[0].name, "front");
  EXPECT_EQ(scene.panels[0].file, folder / "skirt.jsonc");
  ASSERT_EQ(scene.seams.size(), 2u);
  EXPECT_TRUE(scene.seams[0].b.reverse);
  ASSERT_EQ(scene.obstacles.size(), 1u);
  EXPECT_EQ(scene.obstacles[0].mesh, folder / "body.obj");
  EXPECT_EQ(scene.gravity, Eigen::Vector3d(0, -9.81, 0));
  // The origin of this dialect goes to 1.04 m of 1.666 m above the soles: y = -1 + 1.04.
  expect_near_rel(scene.panels[0].place.translate.y(), 0.04, 1e-12, 1e-12);
  expect_near_rel(scene.panels[0].place.translate.z(), 0.2, 1e-12);
  EXPECT_TRUE(scene.pins.empty()) << "the body alone holds it";
  // The box is 2 (0.3 + 0.2) m around.
  EXPECT_NE(written.text.find("the body measures 1.000 m there"), std::string::npos) << written.text;
  const Build built = build(scene);
  EXPECT_EQ(built.panels.size(), scene.panels.size());
  EXPECT_GT(built.model->lumped_mass().sum(), 0);
}

TEST(PatternScene, AWrittenSceneIsSewnAroundTheBody) {
  const Folder folder("pattern_drape");
  write_file(folder / "skirt.jsonc", skirt_text());
  write_box(folder / "body.obj");
  ASSERT_EQ(run(folder, "init --pattern skirt.jsonc --body body.obj -o scene.toml"), 0)
      << read_file(folder / "stderr.txt");
  EXPECT_EQ(run(folder, "init --pattern skirt.jsonc -o scene.toml"), 8) << "it overwrites nothing";
  const std::string coarse = " --set 'panel.0.refine={spans=[3,3]}' --set 'panel.1.refine={spans=[3,3]}'";
  EXPECT_EQ(run(folder, "check scene.toml" + coarse), 0) << read_file(folder / "stderr.txt");
  EXPECT_NE(read_file(folder / "stdout.txt").find("valid"), std::string::npos);
  EXPECT_EQ(run(folder, "drape scene.toml -o out --until 0.02 --set output.preview=false" + coarse), 6);
  EXPECT_NE(read_file(folder / "stderr.txt").find("still open"), std::string::npos) << read_file(folder / "stderr.txt");
  EXPECT_EQ(run(folder, "check scene.toml --set seam.0.a.curve=17"), 4);
  EXPECT_NE(read_file(folder / "stderr.txt").find("panel 'front' has curves"), std::string::npos);
}

TEST(PatternScene, APanelsGrainLineTurnsItsFabric) {
  const Folder folder("grain");
  std::filesystem::copy_file(corpus / "iges/outlines_only.igs", folder / "panel.igs");
  const std::string text = "[[panel]]\nname = \"FRONT\"\nfile = \"panel.igs\"\nrefine = { spans = [2, 2] }\n";
  const std::string pin = "[[pin]]\nat = \"curve:0,0\"\n";
  const auto grain = [&](const std::string& more) {
    return build(parse_scene(text + more + pin, folder / "scene.toml")).model->panels()[0].grain;
  };
  expect_near_rel(grain(""), -std::atan2(50, 200), 1e-14);
  expect_near_rel(grain("grain_deg = 45\n"), std::numbers::pi / 4, 1e-15);
}

TEST(Convert, PatternsBecomeIgesWithTheSameNumbers) {
  const Folder folder("convert");
  write_file(folder / "skirt.jsonc", skirt_text());
  ASSERT_EQ(run(folder, "convert skirt.jsonc panels.igs"), 0) << read_file(folder / "stderr.txt");
  const PanelFile source = read_panels(folder / "skirt.jsonc"), panels = read_panels(folder / "panels.igs");
  ASSERT_EQ(panels.panels.size(), 2u);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(panels.panels[k].name, source.panels[k].name);
    EXPECT_EQ(panels.panels[k].surface, source.panels[k].surface);
    for (std::size_t c = 0; c < source.panels[k].loops[0].curves.size(); ++c)
      EXPECT_EQ(panels.panels[k].loops[0].curves[c].curve, source.panels[k].loops[0].curves[c].curve);
  }
  ASSERT_EQ(run(folder, "convert skirt.jsonc fine.igs --degree 3 --span '50 mm'"), 0);
  const NurbsSurface fine = read_panels(folder / "fine.igs").panels[0].surface;
  EXPECT_EQ(fine.u().degree(), 3);
  // 240 and 195 units of 1/300 m: 0.8 m and 0.65 m; the hem's control point lies 30 units below.
  EXPECT_EQ(fine.u().spans().size(), 16u);
  EXPECT_EQ(run(folder, "roundtrip fine.igs"), 0);
}

TEST(Convert, IgesKeepsEveryRecordButRefinedSurfaces) {
  const Folder folder("replay");
  const auto source = corpus / "iges/hole_and_composite.igs";
  std::filesystem::copy_file(source, folder / "in.igs");
  ASSERT_EQ(run(folder, "convert in.igs out.igs"), 0);
  EXPECT_EQ(read_file(folder / "out.igs"), read_file(source));
  ASSERT_EQ(run(folder, "convert in.igs fine.igs --spans 5"), 0) << read_file(folder / "stderr.txt");
  const PanelFile before = read_panels(source), after = read_panels(folder / "fine.igs");
  EXPECT_EQ(after.entities, before.entities);
  EXPECT_EQ(after.unit, before.unit);
  EXPECT_EQ(after.panels[0].surface.u().spans().size(), 5u);
  for (std::size_t l = 0; l < before.panels[0].loops.size(); ++l)
    for (std::size_t c = 0; c < before.panels[0].loops[l].curves.size(); ++c)
      EXPECT_EQ(after.panels[0].loops[l].curves[c].curve, before.panels[0].loops[l].curves[c].curve);
  EXPECT_EQ(run(folder, "convert in.igs in.igs"), 8) << "the input is kept";
}

TEST(Convert, EveryEndingWritesItsFormat) {
  const Folder folder("formats");
  write_file(folder / "bodice.json", read_file(corpus / "patterns/bodice_and_cuff.json"));
  std::vector<std::string> endings{".iges", ".IGS"};
  for (const NamedFormat& format : file_formats()) endings.emplace_back(format.ending);
  for (const std::string& ending : endings) {
    EXPECT_EQ(run(folder, "convert bodice.json out" + ending), 0) << ending << read_file(folder / "stderr.txt");
    EXPECT_TRUE(std::filesystem::exists(folder / ("out" + ending)));
  }
  EXPECT_EQ(run(folder, "convert bodice.json out.step"), 3);
  EXPECT_NE(read_file(folder / "stderr.txt").find("can't write '.step' files"), std::string::npos);
  EXPECT_EQ(run(folder, "convert nowhere.json out.igs"), 3);
  write_file(folder / "broken.json", "{\"pattern\": [\n");
  EXPECT_EQ(run(folder, "convert broken.json broken.igs"), 3);
  EXPECT_FALSE(std::filesystem::exists(folder / "broken.igs"));
  EXPECT_NE(read_file(folder / "stderr.txt").find("broken.json:1: no valid JSON"), std::string::npos);
}

TEST(Convert, ThePrintIsMillimetres) {
  const std::string svg = print_svg(parse_pattern(skirt_text(), "skirt.jsonc").file);
  // Two panels of 800 mm in two rows, with margins of 20 mm.
  EXPECT_NE(svg.find("width=\"840mm\""), std::string::npos) << svg.substr(0, 200);
  EXPECT_NE(svg.find("viewBox=\"0 0 840 "), std::string::npos);
  EXPECT_NE(svg.find("100 mm"), std::string::npos);
  // The front's waist is one quadratic from (60, 0) to (-60, 0) by way of (0, -30), 10/3 mm a unit.
  EXPECT_NE(svg.find("Q420 132 220 32"), std::string::npos) << svg;
  TrimmedSurface bent = parse_pattern(skirt_text(), "skirt.jsonc").file.panels[0];
  Eigen::Matrix3Xd points = bent.surface.points();
  points(2, 4) += 50;
  bent.surface = bent.surface.with_points(points);
  PanelFile file;
  file.panels = {bent};
  EXPECT_THROW(print_svg(file), GeometryError);
}

TEST(Inspect, DrawingsOfAPatternAreWhole) {
  const Folder folder("looking");
  std::filesystem::copy_file(corpus / "iges/outlines_only.igs", folder / "panel.igs");
  ASSERT_EQ(run(folder, "inspect panel.igs --svg a.svg --html a.html --spans 4"), 0)
      << read_file(folder / "stderr.txt");
  const std::string page = read_file(folder / "a.html"), text = read_file(folder / "stdout.txt");
  EXPECT_NE(page.find("<svg "), std::string::npos);
  EXPECT_EQ(page.find("http://"), page.find("http://www.w3.org/2000/svg")) << "nothing is loaded from elsewhere";
  EXPECT_NE(page.find("FRONT"), std::string::npos);
  EXPECT_NE(page.find("grain line"), std::string::npos) << "warnings are on the page";
  std::size_t widest = 0, at = 0;
  for (std::size_t end; (end = text.find('\n', at)) != std::string::npos; at = end + 1) {
    const std::string line = text.substr(at, end - at);  // warnings and reasons are as long as they are
    if (!line.starts_with("  warning") && line.find("line ") == std::string::npos)
      widest = std::max(widest, line.size());
  }
  EXPECT_LE(widest, 110u) << text;
  if (run(folder, "inspect panel.igs --png a.png") == 8) GTEST_SKIP() << "built without stb";
  const std::string picture = read_file(folder / "a.png");
  EXPECT_EQ(picture.substr(1, 3), "PNG");
}

}  // namespace
}  // namespace toile
