// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/scene/scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include "geometry/error.h"
#include "io/file.h"
#include "support/near.h"

namespace toile {
namespace {

const std::filesystem::path scene_path = std::filesystem::path(TOILE_SAMPLES) / "kidnapped_a" / "scene.toml";

// A scene that is valid, line by line, so that a test can break one line.
std::vector<std::string> valid_lines() {
  return {
      /* 1 */ "[[panel]]",
      /* 2 */ "name = \"cloth\"",
      /* 3 */ "file = \"scene.toml\"",  // any file that exists
      /* 4 */ "grain_deg = 30",
      /* 5 */ "fabric = \"linen\"",
      /* 6 */ "refine = { degree = 2, span = \"20 mm\" }",
      /* 7 */ "[fabric.linen]",
      /* 8 */ "density = \"150 g/m2\"",
      /* 9 */ "bending = { b0 = 1e-4, kappa0 = 30 }",
      /* 10 */ "[strain_limit]",
      /* 11 */ "tolerance = 0.01",
      /* 12 */ "[[pin]]",
      /* 13 */ "at = \"corner:0,0\"",
      /* 14 */ "[solver]",
      /* 15 */ "until = 0.6",
      /* 16 */ "[output]",
      /* 17 */ "every = \"1/30 s\"",
  };
}

std::string text_of(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

Scene parse(const std::vector<std::string>& lines, std::vector<std::string> settings = {}) {
  return parse_scene(text_of(lines), scene_path, settings);
}

// The message without the path, with one line (from 1) replaced: "4: unknown key ...".
std::string refusal(std::size_t line, const std::string& replacement) {
  std::vector<std::string> lines = valid_lines();
  lines[line - 1] = replacement;
  try {
    parse(lines);
  } catch (const InputError& error) {
    const std::string message = error.what(), prefix = scene_path.string() + ":";
    return message.starts_with(prefix) ? message.substr(prefix.size()) : message;
  }
  return "accepted";
}

void expect_message(std::size_t line, const std::string& replacement, const std::vector<std::string>& parts) {
  const std::string message = refusal(line, replacement);
  EXPECT_TRUE(message.starts_with(std::to_string(line) + ":")) << message;
  for (const std::string& part : parts)
    EXPECT_NE(message.find(part), std::string::npos) << message << "\nlacks " << part;
}

TEST(Scene, ComesOutInSi) {
  const Scene scene = parse(valid_lines());
  ASSERT_EQ(scene.panels.size(), 1u);
  const ScenePanel& panel = scene.panels[0];
  expect_near_rel(panel.grain.value(), std::numbers::pi / 6, 1e-15);
  expect_near_rel(panel.fabric.density, 0.15, 1e-15);
  expect_near_rel(panel.span.value(), 0.02, 1e-15);
  EXPECT_EQ(panel.fabric.bending.kappa_reg, 0.03);
  EXPECT_TRUE(scene.strain_limit.on);
  EXPECT_EQ(scene.every, 1.0 / 30);
  EXPECT_EQ(scene.until, 0.6);
  EXPECT_EQ(scene.name, "kidnapped_a");
  EXPECT_EQ(scene.pins[0].panel, "cloth");
}

TEST(Scene, ATypoNamesLineAndNearestKey) {
  expect_message(4, "grian_deg = 30", {"unknown key 'grian_deg' in [[panel]]", "did you mean 'grain_deg'?"});
  expect_message(8, "densty = 1", {"unknown key 'densty' in [fabric.linen]", "did you mean 'density'?"});
  expect_message(9, "bending = { b0 = 1e-4, kapa0 = 30 }", {"unknown key 'kapa0' in bending", "'kappa0'"});
  expect_message(14, "[solvr]", {"unknown key 'solvr' in the scene", "'solver'"});
  expect_message(11, "mode = \"inextensibel\"", {"unknown mode", "did you mean 'inextensible'?"});
  expect_message(5, "fabric = \"linnen\"", {"unknown fabric 'linnen'", "did you mean 'linen'?"});
}

TEST(Scene, WrongTypesAndUnitsNameLineAndKey) {
  expect_message(4, "grain_deg = true", {"grain_deg in [[panel]]", "not true or false"});
  expect_message(8, "density = \"150 N\"", {"density in [fabric.linen]", "expected kg/m2"});
  expect_message(6, "refine = { degree = 2.5 }", {"degree in refine", "whole number"});
  expect_message(2, "name = 3", {"name in [[panel]] must be a string"});
  expect_message(9, "bending = 3", {"bending must be a table"});
  expect_message(13, "at = \"corner:0,2\"", {"corner:U,V with U and V 0 or 1"});
}

TEST(Scene, ValuesOutOfRangeNameLineAndKey) {
  expect_message(8, "density = -0.1", {"density", "-0.1, must be positive"});
  expect_message(8, "density = inf", {"must be finite"});
  expect_message(11, "tolerance = 0", {"tolerance", "must be positive"});
  expect_message(11, "tolerance = 0.6", {"tolerance", "must be at most 0.5"});
  EXPECT_NE(refusal(11, "mode = \"band\"\ncompress = [0.1, 10]").find("must be at most 0.5"), std::string::npos);
  EXPECT_NE(refusal(14, "[load]\ngravity = [0, 0, -1e300]\n[solver]").find("must be below"), std::string::npos);
  expect_message(15, "until = -1", {"until", "must be positive"});
  EXPECT_NE(refusal(15, "until = 0.6\ndt = 1e-17").find("million steps"), std::string::npos);
  expect_message(9, "bending = { b0 = 1e-4, kappa0 = 30, kappa_reg = 31 }", {"kappa_reg", "must not exceed kappa0"});
  expect_message(6, "refine = { degree = 1 }", {"degree in refine is 1, must be 2 to 5"});
  expect_message(6, "refine = { span = 0.1, spans = [3, 3] }", {"one of span, spans and control_points"});
}

TEST(Scene, MissingKeysAndFilesAreNamed) {
  expect_message(3, "file = \"nowhere.igs\"", {"nowhere.igs", "does not exist"});
  std::vector<std::string> lines = valid_lines();
  lines[2] = "";
  try {
    parse(lines);
    FAIL() << "a panel without a file was accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("[[panel]] needs file"), std::string::npos) << error.what();
  }
}

TEST(Scene, SeamsAndObstaclesAreReadAndChecked) {
  expect_message(3, "pattern = \"a.json\"", {"pattern", "a.json", "does not exist"});
  const auto top = [](const std::string& tables) { return tables + "\n[[panel]]"; };
  expect_message(1, top("seam = [{}]"), {"[[seam]] needs a"});
  expect_message(1, top("seam = [{ a = { panel = \"cloth\" } }]"), {"a of [[seam]] needs curve"});
  expect_message(1, top("seam = [{ a = { curve = 1, revers = true } }]"), {"unknown key 'revers'", "reverse"});
  expect_message(1, top("seam = [{ a = { panel = \"clothh\", curve = 1 } }]"), {"no panel is called 'clothh'"});
  expect_message(1, top("seam = [{ a = { curve = 1 }, b = { loop = 0, curve = 1 } }]"), {"with itself"});
  expect_message(1, top("obstacle = [{}]"), {"[[obstacle]] needs mesh", "shape = \"plane\""});
  expect_message(1, top("obstacle = [{ mesh = \"nobody.obj\" }]"), {"nobody.obj", "does not exist"});
  expect_message(1, top("obstacle = [{ mesh = \"scene.toml\", unit = \"kg\" }]"), {"must be a length unit"});
  std::vector<std::string> lines = valid_lines();
  lines[0] =
      top("seam = [{ a = { curve = 1 }, b = { loop = 1, curve = 2, reverse = true } }]\n"
          "obstacle = [{ mesh = \"scene.toml\", unit = \"cm\", thickness = \"1 mm\" }]");
  const Scene scene = parse(lines);
  ASSERT_EQ(scene.seams.size(), 1u);
  EXPECT_EQ(scene.seams[0].a.panel, "cloth");
  EXPECT_TRUE(scene.seams[0].b.reverse);
  ASSERT_EQ(scene.obstacles.size(), 1u);
  EXPECT_EQ(scene.obstacles[0].metres_per_unit, 0.01);
}

// The scene with these tables before its panel.
Scene with_tables(const std::string& tables) {
  std::vector<std::string> lines = valid_lines();
  lines[0] = tables + "\n[[panel]]";
  return parse(lines);
}

TEST(Scene, ObstaclesAreMeshesSequencesOrShapes) {
  const Scene scene = with_tables(
      "obstacle = [{ mesh = \"scene.toml\", up = \"y\", morph = { to = \"square.igs\", start = 1, end = \"2 s\" } },"
      "{ name = \"walker\", sequence = [\"scene.toml\", \"square.igs\"], times = [0, \"500 ms\"], unit = \"mm\" },"
      "{ mesh = \"square.igs\" },"
      "{ name = \"floor\", shape = \"plane\", point = [0, 0, \"-5 cm\"], normal = [0, 3, 4] },"
      "{ shape = \"capsule\", from = [0, 0, 0], to = [0, 0, 1], radius = \"8 cm\", thickness = \"1 mm\" },"
      "{ shape = \"box\", centre = [0, 0, 1], size = [1, 2, 3], place = { rotate_deg = [0, 0, 90] } }]\n"
      "contact_pair = [{ a = \"cloth\", b = \"floor\", friction = 0.7 }, { a = \"cloth\", b = \"cloth\", friction = 0 "
      "}]");
  ASSERT_EQ(scene.obstacles.size(), 6u);
  const SceneObstacle &morph = scene.obstacles[0], &walker = scene.obstacles[1], &iges = scene.obstacles[2],
                      &plane = scene.obstacles[3], &capsule = scene.obstacles[4], &box = scene.obstacles[5];
  EXPECT_EQ(morph.name, "obstacle_1");
  EXPECT_EQ(morph.up, 'y');
  EXPECT_EQ(morph.morph->end, 2);
  EXPECT_EQ(morph.thickness, 0.003);
  EXPECT_EQ(walker.sequence.size(), 2u);
  EXPECT_EQ(walker.mesh, walker.sequence[0]);
  EXPECT_EQ(walker.times, (std::vector{0, 0.5}));
  EXPECT_EQ(walker.metres_per_unit, 0.001);
  EXPECT_EQ(iges.chord_error, 0.00025);
  EXPECT_EQ(plane.kind, ObstacleKind::plane);
  EXPECT_EQ(plane.point, Eigen::Vector3d(0, 0, -0.05));
  EXPECT_EQ(plane.normal, Eigen::Vector3d(0, 0.6, 0.8));
  EXPECT_EQ(plane.thickness, 0);
  EXPECT_EQ(capsule.kind, ObstacleKind::capsule);
  EXPECT_EQ(capsule.radius, 0.08);
  EXPECT_EQ(capsule.thickness, 0.001);
  EXPECT_EQ(box.kind, ObstacleKind::box);
  ASSERT_EQ(scene.contact_pairs.size(), 2u);
  EXPECT_EQ(scene.contact_pairs[0].friction, 0.7);
  // The thickness that nobody chose is said, once for each body.
  EXPECT_EQ(std::ranges::count_if(scene.notes, [](const std::string& n) { return n.find("keeps 3 mm") != n.npos; }), 3);
}

TEST(Scene, ObstaclesThatMakeNoSenseAreRefused) {
  const auto expect_refused = [](const std::string& tables, const std::string& words) {
    try {
      with_tables(tables);
      ADD_FAILURE() << tables << " was accepted";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  };
  const auto obstacle = [](const std::string& keys) { return "obstacle = [{ " + keys + " }]"; };
  const std::string mesh = "mesh = \"scene.toml\"", plane = "shape = \"plane\", point = [0, 0, 0], normal = ";
  expect_refused(obstacle(mesh + ", shape = \"plane\""), "one of mesh, sequence and shape");
  expect_refused(obstacle("shape = \"sfere\""), "did you mean 'sphere'");
  expect_refused(obstacle("shape = \"sphere\", centre = [0, 0, 0]"), "needs radius");
  expect_refused(obstacle("shape = \"sphere\", centre = [0, 0, 0], radius = 0"), "must be positive");
  expect_refused(obstacle("shape = \"sphere\", centre = [0, 0, 0], radius = 1, unit = \"mm\""),
                 "unit belongs to a mesh");
  expect_refused(obstacle(plane + "[0, 0, 0]"), "must not be zero");
  expect_refused(obstacle(plane + "[0, 0, nan]"), "must be finite");
  expect_refused(obstacle(plane + "[0, 0, 1], radius = 2"), "unknown key 'radius'");
  expect_refused(obstacle("shape = \"cylinder\", radius = 1, from = [1, 0, 0], to = [1, 0, 0]"),
                 "the axis needs a length");
  expect_refused(obstacle("shape = \"box\", centre = [1, 0, 0], size = [1, 0, 1]"), "three lengths above 0");
  expect_refused(obstacle(mesh + ", up = \"x\""), "unknown up");
  expect_refused(obstacle(mesh + ", chord_error = 1"), "belongs to IGES bodies");
  expect_refused(obstacle("mesh = \"square.igs\", unit = \"mm\""), "an IGES file says its own");
  expect_refused(obstacle("sequence = [\"scene.toml\"]"), "two mesh files or more");
  expect_refused(obstacle("sequence = [\"scene.toml\", \"nobody.obj\"], times = [0, 1]"), "nobody.obj' does not exist");
  expect_refused(obstacle("sequence = [\"scene.toml\", \"scene.toml\"]"), "as many times");
  expect_refused(obstacle("sequence = [\"scene.toml\", \"scene.toml\"], times = [1, 1]"), "must ascend");
  expect_refused(obstacle(mesh + ", times = [1, 1]"), "belong to sequence");
  expect_refused(obstacle(mesh + ", morph = { to = \"scene.toml\" }"), "needs end");
  expect_refused(obstacle(mesh + ", morph = { to = \"scene.toml\", start = 2, end = 1 }"), "must come after start");
  expect_refused(obstacle(mesh + ", name = \"cloth\""), "is called 'cloth'");
  const std::string floor = obstacle("name = \"floor\", " + plane + "[0, 0, 1]") + "\n";
  expect_refused(floor + "contact_pair = [{ a = \"cloth\", b = \"flor\", friction = 1 }]", "did you mean 'floor'");
  expect_refused(floor + "contact_pair = [{ a = \"cloth\", b = \"floor\" }]", "needs friction");
  expect_refused(floor + "contact_pair = [{ a = \"floor\", b = \"floor\", friction = 1 }]", "must be a panel");
  expect_refused(floor +
                     "contact_pair = [{ a = \"cloth\", b = \"floor\", friction = 1 }, { a = \"floor\", b = "
                     "\"cloth\", friction = 1 }]",
                 "are a pair already");
}

TEST(Scene, ABandNamesWhatItNeeds) {
  EXPECT_NE(refusal(11, "mode = \"band\"").find("stretch = [weft, warp]"), std::string::npos);
  EXPECT_EQ(refusal(11, "mode = \"band\"\nstretch = [0.05, 0.02]"), "accepted");
  EXPECT_NE(refusal(11, "mode = \"band\"\nstretch = [0.05, -0.02]").find("above 0"), std::string::npos);
  EXPECT_NE(refusal(11, "stretch = [0.05, 0.02]").find("belongs to mode"), std::string::npos);
}

TEST(Scene, TheLagrangeNewtonTakesHardLimitsOnly) {
  EXPECT_EQ(refusal(11, "solver = \"lagrange\""), "accepted");
  EXPECT_EQ(refusal(11, "solver = \"projection\"\nvariant = \"paper\""), "accepted");
  for (const char* key : {"stiffness = 1000", "variant = \"paper\""})
    EXPECT_NE(refusal(11, std::string("solver = \"lagrange\"\n") + key).find("belongs to solver"), std::string::npos);
  EXPECT_EQ(refusal(11, "solver = \"substeps\"\npercentile = 99"), "accepted");
  EXPECT_NE(refusal(11, "solver = \"substeps\"\npercentile = 101").find("at most 100"), std::string::npos);
  EXPECT_NE(refusal(11, "solver = \"substeps\"\nvariant = \"paper\"").find("belongs to solver"), std::string::npos);
  EXPECT_NE(refusal(11, "percentile = 99").find("belongs to solver = \"substeps\""), std::string::npos);
  EXPECT_NE(refusal(11, "solver = \"lagrange\"\nmode = \"band\"\nstretch = [0.05, 0.02]").find("no bands"),
            std::string::npos);
}

TEST(Scene, EverySamplingRuleIsKnownByItsName) {
  for (const NamedRule& rule : point_rules()) {
    const Scene scene = parse(valid_lines(), {"strain_limit.points=" + std::string(rule.name)});
    EXPECT_EQ(scene.strain_limit.points, rule.rule) << rule.name;
  }
  expect_message(11, "points = \"grevile\"", {"unknown points", "greville"});
}

TEST(Scene, LaterFeaturesAreRefusedByName) {
  expect_message(11, "solver = \"springs\"", {"not supported by this version", "projection", "lagrange"});
  expect_message(15, "model = \"hinge\"", {"not supported by this version", "shell"});
  expect_message(15, "scheme = \"newmarc\"", {"unknown scheme", "newmark"});
}

TEST(Scene, BrokenTomlNamesItsLine) {
  expect_message(8, "density = = 3", {});
}

TEST(Scene, SettingsOverrideAndAdd) {
  const Scene scene = parse(
      valid_lines(), {"panel.0.grain_deg=45", "strain_limit.mode=off", "fabric.linen.density=200 g/m2",
                      "load.gravity=[0, 0, -1.62]", "pin.1.at=corner:1,0", "panel[0].refine={control_points=[5,6]}"});
  expect_near_rel(scene.panels[0].grain.value(), std::numbers::pi / 4, 1e-15);
  EXPECT_FALSE(scene.strain_limit.on);
  expect_near_rel(scene.panels[0].fabric.density, 0.2, 1e-15);
  EXPECT_EQ(scene.gravity.z(), -1.62);
  ASSERT_EQ(scene.pins.size(), 2u);
  EXPECT_EQ(scene.pins[1].at.text, "corner:1,0");
  EXPECT_EQ((*scene.panels[0].control_points)[1], 6);
  EXPECT_FALSE(scene.panels[0].span);
}

TEST(Scene, ASettingWithATypoIsRefused) {
  EXPECT_THROW(parse(valid_lines(), {"panel.0.grian_deg=45"}), InputError);
  EXPECT_THROW(parse(valid_lines(), {"panel.7.grain_deg=45"}), InputError);
  EXPECT_THROW(parse(valid_lines(), {"solver.until.x=45"}), InputError);
}

TEST(Scene, AMotionRisesSmoothlyAndIsRigid) {
  PinMotion motion;
  motion.translate = {0, 0, 1};
  motion.rotate = {0, 0, std::numbers::pi / 2};
  motion.start = 1;
  motion.end = 3;
  const Eigen::Vector3d mean(1, 0, 0), a(2, 0, 0), b(1, 1, 0);
  EXPECT_EQ(motion(a, mean, 0.5), a);
  EXPECT_LT((motion(a, mean, 3) - Eigen::Vector3d(1, 1, 1)).norm(), 1e-14);
  EXPECT_EQ(motion(a, mean, 9), motion(a, mean, 3));
  for (const double t : {1.2, 1.9, 2.5}) {
    expect_near_rel((motion(a, mean, t) - motion(b, mean, t)).norm(), (a - b).norm(), 1e-14);
  }
  const double h = 1e-4;
  for (const double t : {1.0, 3.0}) {
    EXPECT_LT((motion(a, mean, t + h) - motion(a, mean, t - h)).norm() / h, 1e-5) << "velocity at " << t;
  }
}

TEST(Address, FormsAreRead) {
  EXPECT_EQ(parse_address("corner:1,0").a, 1);
  EXPECT_EQ(parse_address("edge:v1").b, 1);
  const Address curve = parse_address("curve:0, 2, 0.25, 0.5");
  EXPECT_EQ(curve.b, 2);
  EXPECT_EQ(curve.from, 0.25);
  EXPECT_EQ(parse_address("curve:1,3").to, 1);
  EXPECT_EQ(parse_address("uv:0.25,-3").uv.y(), -3);
  EXPECT_EQ(parse_address("cp:4,5").b, 5);
  EXPECT_EQ(parse_address("box:[-1,-1,-1],[1,2,3]").max.z(), 3);
}

TEST(Address, OthersAreRefused) {
  for (const char* text : {"",
                           "corner",
                           "corner:0",
                           "corner:0,2",
                           "corner:0,0,0",
                           "edge:w0",
                           "edge:u2",
                           "curve:0",
                           "curve:0,-1",
                           "curve:0,1,0.5",
                           "curve:0,1,0.5,0.5",
                           "curve:0,1,-0.1,0.5",
                           "curve:0,1.5",
                           "uv:1",
                           "uv:nan,0",
                           "cp:1",
                           "cp:-1,0",
                           "box:[0,0,0]",
                           "box:[0,0,0],[1,1]",
                           "box:[1,0,0],[0,1,1]",
                           "corners:0,0"}) {
    EXPECT_THROW(parse_address(text), InputError) << text;
  }
}

// What tests/fuzz/run found; the name says what it was.
TEST(Scene, FindingsOfTheFuzzerStayFixed) {
  int read = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(TOILE_TEST_DATA) / "fuzz" / "scene")) {
    SCOPED_TRACE(entry.path().filename().string());
    EXPECT_THROW(parse_scene(read_file(entry.path()), scene_path), InputError);
    ++read;
  }
  EXPECT_GE(read, 1);
}

// Explicit schemes, verlet alone, are held to the stable step; equilibrium by Newton's method is not, whatever the
// scheme.
TEST(Scene, SchemesAreImplicitWhereTheyHaveARule) {
  for (const NamedScheme& scheme : time_schemes()) {
    const Scene read = parse(valid_lines(), {std::string("solver.scheme=") + scheme.name});
    EXPECT_EQ(read.scheme, scheme.scheme) << scheme.name;
    EXPECT_EQ(&named_scheme(scheme.scheme), &scheme) << scheme.name;
    EXPECT_EQ(implicit(read), std::string(scheme.name) != "verlet") << scheme.name;
  }
  EXPECT_TRUE(implicit(parse(valid_lines(), {"solver.until=rest", "solver.rest.method=newton"})));
}

}  // namespace
}  // namespace toile
