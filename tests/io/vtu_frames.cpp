// SPDX-License-Identifier: GPL-3.0-or-later
// Frames as VTU: what a reader finds in the bytes.
#include <gtest/gtest.h>
#include <zlib.h>

#include <Eigen/Geometry>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>

#include "geometry/error.h"
#include "geometry/refine.h"
#include "io/file.h"
#include "io/mesh_files.h"
#include "io/obj.h"
#include "io/polyline.h"
#include "io/vtu.h"
#include "support/draped.h"
#include "support/near.h"

namespace toile {
namespace {

// The array that starts `bytes`: number of blocks, their size, that of a shorter last one (0: none), compressed sizes,
// then zlib streams. [VTK file formats, "compressed appended data"]
std::string inflated(std::string_view bytes, const std::string& name) {
  const auto word = [&](std::size_t k) {
    if (bytes.size() < 8 * (k + 1)) throw std::runtime_error("array " + name + " runs out of the file");
    std::uint64_t value = 0;
    std::memcpy(&value, bytes.data() + 8 * k, sizeof value);
    return value;
  };
  const std::uint64_t blocks = word(0), size = word(1), last = word(2);
  std::string out;
  std::size_t at = 8 * (3 + blocks);
  for (std::uint64_t k = 0; k < blocks; ++k) {
    const std::uint64_t packed = word(3 + k);
    if (at + packed > bytes.size()) throw std::runtime_error("array " + name + " runs out of the file");
    std::string block(k + 1 == blocks && last > 0 ? last : size, '\0');
    uLongf length = block.size();
    if (uncompress(reinterpret_cast<Bytef*>(block.data()), &length, reinterpret_cast<const Bytef*>(bytes.data() + at),
                   packed) != Z_OK ||
        length != block.size())
      throw std::runtime_error("array " + name + ": a block is broken");
    out += block;
    at += packed;
  }
  return out;
}

// A reader of its own for what we write: arrays by name as doubles, found through the offsets in the head.
struct Vtu {
  std::map<std::string, std::vector<double>> arrays;
  std::map<std::string, int> components;
  int points = 0, cells = 0;

  explicit Vtu(const std::string& bytes) {
    const std::size_t mark = bytes.find("<AppendedData encoding=\"raw\">\n_");
    if (mark == std::string::npos) throw std::runtime_error("no appended data");
    const std::size_t base = mark + std::strlen("<AppendedData encoding=\"raw\">\n_");
    const std::string head = bytes.substr(0, mark);
    std::smatch size;
    if (!std::regex_search(head, size, std::regex("NumberOfPoints=\"(\\d+)\" NumberOfCells=\"(\\d+)\"")))
      throw std::runtime_error("no piece");
    points = std::stoi(size[1]), cells = std::stoi(size[2]);
    const std::regex array(
        "<DataArray type=\"(\\w+)\" Name=\"(\\w+)\" NumberOfComponents=\"(\\d)\" format=\"appended\" "
        "offset=\"(\\d+)\"/>");
    for (std::sregex_iterator it(head.begin(), head.end(), array), end; it != end; ++it) {
      const std::string type = (*it)[1], name = (*it)[2];
      const std::size_t at = base + std::stoul((*it)[4]);
      const std::string data = inflated(std::string_view(bytes).substr(at), name);
      auto& out = arrays[name];
      const auto read = [&]<class T>(T value) {
        for (std::size_t k = 0; k < data.size() / sizeof(T); ++k) {
          std::memcpy(&value, data.data() + k * sizeof(T), sizeof(T));
          out.push_back(static_cast<double>(value));
        }
      };
      if (type == "Float64")
        read(double{});
      else if (type == "Int32")
        read(std::int32_t{});
      else if (type == "Float32")
        read(float{});
      else
        read(std::uint8_t{});
      components[name] = std::stoi((*it)[3]);
    }
  }
  const std::vector<double>& operator[](const std::string& name) const { return arrays.at(name); }
  Eigen::Vector3d vector(const std::string& name, std::size_t k) const {
    const auto& a = arrays.at(name);
    return {a[3 * k], a[3 * k + 1], a[3 * k + 2]};
  }
};

double bernstein(int n, int i, double t) {
  double binomial = 1;
  for (int k = 1; k <= i; ++k) binomial *= double(n - i + k) / k;
  return binomial * std::pow(t, i) * std::pow(1 - t, n - i);
}

struct Folder {
  std::filesystem::path path = std::filesystem::temp_directory_path() /
                               ("toile_vtu_" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) + "_" +
                                ::testing::UnitTest::GetInstance()->current_test_info()->name());
  Folder() { std::filesystem::remove_all(path); }
  ~Folder() { std::filesystem::remove_all(path); }
};

// Where VTK puts control point (i, j) of a quadrilateral of degrees p, q. Written from the rule of
// vtkHigherOrderQuadrilateral::PointIndexFromIJK, not from the code under test.
int vtk_index(int i, int j, int p, int q) {
  const bool border_i = i == 0 || i == p, border_j = j == 0 || j == q;
  if (border_i && border_j) return i ? (j ? 2 : 1) : (j ? 3 : 0);
  if (border_j) return 4 + (i - 1) + (j ? p - 1 + q - 1 : 0);
  if (border_i) return 4 + (j - 1) + (i ? p - 1 : 2 * (p - 1) + q - 1);
  return 4 + 2 * (p - 1 + q - 1) + (i - 1) + (p - 1) * (j - 1);
}

TEST(Vtu, RationalBezierCellsAreTheSurfaceAndItsVelocity) {
  // Degrees 3 and 4: from cubic on, the order along each edge matters.
  test::Draped draped(true);
  const auto elevated = [](const NurbsSurface& s) {
    return elevate_degree(elevate_degree(s, Direction::u, 3), Direction::v, 4);
  };
  const NurbsSurface velocity = elevated(draped.surface.with_points(draped.panel.velocity));
  draped.surface = elevated(draped.surface);
  draped.panel.carries_cloth.clear();  // counted the net before
  draped.panel.velocity = velocity.points();
  const std::string bytes = format_vtu(draped.frame()).surface;
  EXPECT_NE(bytes.find("<PointData RationalWeights=\"RationalWeights\">"), std::string::npos);
  EXPECT_NE(bytes.find("<CellData HigherOrderDegrees=\"HigherOrderDegrees\">"), std::string::npos);
  const Vtu vtu(bytes);
  const auto u = draped.surface.u().breaks(), v = draped.surface.v().breaks();
  ASSERT_EQ(vtu.cells, int((u.size() - 1) * (v.size() - 1)));
  ASSERT_EQ(vtu["types"].size(), std::size_t(vtu.cells));
  std::size_t first = 0;
  for (std::size_t c = 0; c < std::size_t(vtu.cells); ++c) {
    ASSERT_EQ(vtu["types"][c], 77);
    const int p = int(vtu["HigherOrderDegrees"][3 * c]), q = int(vtu["HigherOrderDegrees"][3 * c + 1]);
    ASSERT_EQ(p, 3);
    ASSERT_EQ(q, 4);
    const std::size_t i0 = c % (u.size() - 1), j0 = c / (u.size() - 1);
    for (const auto& [a, b] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {0.3, 1.0}, {0.25, 0.7}, {0.9, 0.45}}) {
      Eigen::Vector3d x = Eigen::Vector3d::Zero(), dx = x;
      double weight = 0;
      for (int j = 0; j <= q; ++j)
        for (int i = 0; i <= p; ++i) {
          const auto k = std::size_t(vtu["connectivity"][first + std::size_t(vtk_index(i, j, p, q))]);
          const double w = bernstein(p, i, a) * bernstein(q, j, b) * vtu["RationalWeights"][k];
          x += w * vtu.vector("Points", k);
          dx += w * vtu.vector("velocity", k);
          weight += w;
        }
      const double at_u = u[i0] + a * (u[i0 + 1] - u[i0]), at_v = v[j0] + b * (v[j0 + 1] - v[j0]);
      EXPECT_LT((x / weight - draped.surface(at_u, at_v)).norm(), 1e-14);
      EXPECT_LT((dx / weight - velocity(at_u, at_v)).norm(), 1e-6);  // single precision, of some m/s
    }
    first = std::size_t(vtu["offsets"][c]);
  }
}

TEST(Vtu, TrianglesLieOnTheSurfaceAndCarryTheirFields) {
  const test::Draped draped(true);
  const Vtu vtu(format_vtu(draped.frame()).triangles);
  ASSERT_EQ(vtu.points, int(draped.triangles.uv.size()));
  ASSERT_EQ(vtu.cells, int(draped.triangles.triangles.size()));
  for (std::size_t k = 0; k < draped.triangles.uv.size(); k += 37) {
    const Eigen::Vector2d p = draped.triangles.uv[k];
    EXPECT_EQ(vtu["uv"][2 * k], p[0]);
    EXPECT_EQ(vtu["uv"][2 * k + 1], p[1]);
    EXPECT_LT((vtu.vector("Points", k) - draped.surface(p[0], p[1])).norm(), 1e-14);
    const SurfaceJet jet = evaluate(draped.surface, p[0], p[1]);
    EXPECT_NEAR(vtu.vector("normal", k).dot(jet.u.cross(jet.v).normalized()), 1, 1e-6);
    EXPECT_EQ(vtu["strain_weft"][k], float(draped.panel.fields.strain[k][0]));
    EXPECT_EQ(vtu["strain"][k], std::max(vtu["strain_weft"][k], vtu["strain_warp"][k]));
    EXPECT_EQ(vtu["strain_shear"][k], float(draped.panel.fields.strain[k][2]));
    EXPECT_EQ(vtu["second_pk_warp"][k], float(draped.panel.fields.second_pk[k][1]));
    EXPECT_EQ(vtu["nominal_stress_weft"][k], float(draped.panel.fields.nominal[k][0]));
    EXPECT_EQ(vtu["curvature_warp"][k], float(draped.panel.fields.curvature[k][1]));
  }
}

TEST(Vtu, NetTrimsAndPointsSayWhatTheyAre) {
  const test::Draped draped;
  const VtuBlocks blocks = format_vtu(draped.frame());
  const Vtu net(blocks.net), trims(blocks.trims), points(blocks.points);
  const int n = draped.surface.count_u();
  EXPECT_EQ(net.points, n * n);
  EXPECT_EQ(net.cells, 2 * n * (n - 1));
  for (std::size_t k = 0; k < std::size_t(net.points); ++k) {
    EXPECT_EQ(net["carries_cloth"][k], draped.panel.carries_cloth[k]);
    EXPECT_EQ(net.vector("Points", k), draped.surface.points().col(Eigen::Index(k)));
    EXPECT_EQ(draped.surface.index(int(net["ij"][2 * k]), int(net["ij"][2 * k + 1])), int(k));
  }
  ASSERT_EQ(trims.cells, 4);
  EXPECT_EQ(trims["curve"], (std::vector<double>{0, 1, 2, 3}));
  // Each trim starts where the one before ends.
  std::size_t first = 0;
  for (std::size_t c = 0; c < 4; ++c) {
    const auto end = std::size_t(trims["offsets"][c]);
    const Eigen::Vector2d corner = draped.face.loops[0].curves[c].curve.start();
    EXPECT_EQ(trims.vector("Points", first), draped.surface(corner[0], corner[1]));
    const auto next = c == 3 ? 0 : end;
    EXPECT_EQ(trims.vector("Points", end - 1), trims.vector("Points", next));
    first = end;
  }
  ASSERT_EQ(points.cells, 2);
  EXPECT_EQ(points["used"], (std::vector<double>{1, 0}));
  EXPECT_EQ(points["kind"], (std::vector<double>{double(PointKind::vertex), double(PointKind::crossing_v)}));
  EXPECT_EQ(points["strain_warp"], (std::vector<double>{0.002f, -0.001f}));
  EXPECT_EQ(points["nominal_stress_warp"], (std::vector<double>{2, -2}));
  EXPECT_EQ(points["raw_nominal_stress_weft"], (std::vector<double>{3, -3}));
}

TEST(Vtu, SameFrameSameBytes) {
  const test::Draped one(true), two(true);
  const VtuBlocks a = format_vtu(one.frame(3, 0.1)), b = format_vtu(two.frame(3, 0.1));
  EXPECT_EQ(a.surface, b.surface);
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(a.net + a.trims + a.points, b.net + b.trims + b.points);
}

TEST(Vtu, ArraysOfManyBlocksComeBackWhole) {
  // The triangles of this frame take 120 kB of positions, two blocks; a frame without points has empty arrays.
  const test::Draped draped;
  const Vtu vtu(format_vtu(draped.frame()).triangles);
  ASSERT_GT(3 * 8 * vtu.points, 1 << 16);
  for (std::size_t k = 0; k < std::size_t(vtu.points); ++k) {
    const auto& p = draped.triangles.uv[k];
    ASSERT_LT((vtu.vector("Points", k) - draped.surface(p[0], p[1])).norm(), 1e-14);
    ASSERT_EQ(vtu["strain_weft"][k], float(draped.panel.fields.strain[k][0]));
  }
  const Vtu nothing(format_vtu({0, 0, {}}).points);
  EXPECT_EQ(nothing.points, 0);
  EXPECT_TRUE(nothing["connectivity"].empty());
}

TEST(Vtu, RepeatedNumbersTakeLittleRoom) {
  // Lines of a net of 200 x 200 with one weight and one panel: mostly counting.
  const test::Draped draped(false, 0, 0.02, 200);
  EXPECT_LT(format_vtu(draped.frame()).net.size(), 2u * 3 * 8 * 200 * 200);
}

TEST(Vtu, AFieldThatOnePanelLacksIsLeftOut) {
  test::Draped draped;
  draped.panel.fields.strain.pop_back();
  draped.panel.velocity.resize(3, 0);
  const VtuBlocks blocks = format_vtu(draped.frame());
  EXPECT_EQ(Vtu(blocks.triangles).arrays.count("strain_weft"), 0u);
  EXPECT_EQ(Vtu(blocks.triangles).arrays.count("velocity"), 0u);
  EXPECT_EQ(Vtu(blocks.triangles).arrays.count("curvature_weft"), 1u);
  EXPECT_EQ(Vtu(blocks.surface).arrays.count("velocity"), 0u);
}

std::vector<std::string> files_named_in(const std::string& xml) {
  std::vector<std::string> out;
  const std::regex file("file=\"([^\"]+)\"");
  for (std::sregex_iterator it(xml.begin(), xml.end(), file), end; it != end; ++it) out.push_back((*it)[1]);
  return out;
}

TEST(VtuSink, TheCollectionNamesOnlyFilesThatAreThere) {
  const Folder folder;
  const test::Draped draped;
  VtuSink sink(folder.path, "skirt");
  for (int k = 0; k < 3; ++k) {
    sink.write(draped.frame(k, k / 30.0));
    for (const char* name : {"skirt.pvd", "skirt_parts.pvd"}) {
      const std::string collection = read_file(folder.path / name);
      const auto frames = files_named_in(collection);
      ASSERT_EQ(frames.size(), std::size_t(k + 1));
      for (const std::string& frame : frames) EXPECT_TRUE(std::filesystem::exists(folder.path / frame)) << frame;
      EXPECT_NE(collection.find("timestep=\"" +
                                std::string(k ? k == 1 ? "0.03333333333333333" : "0.06666666666666667" : "0")),
                std::string::npos);
    }
  }
}

TEST(VtuSink, TheFirstIndexShowsTheColouredClothAloneTheSecondAllParts) {
  const Folder folder;
  const test::Draped draped;
  VtuSink(folder.path, "skirt").write(draped.frame(0));
  const auto cloth = files_named_in(read_file(folder.path / "skirt.pvd"));
  EXPECT_EQ(cloth, (std::vector<std::string>{"skirt_0000/triangles.vtu"}));
  const std::string bytes = read_file(folder.path / cloth[0]);
  EXPECT_NE(bytes.find("<PointData Scalars=\"strain\" Normals=\"normal\">"), std::string::npos);
  const auto frames = files_named_in(read_file(folder.path / "skirt_parts.pvd"));
  ASSERT_EQ(frames.size(), 1u);
  const auto parts = files_named_in(read_file(folder.path / frames[0]));
  EXPECT_EQ(parts.size(), 5u);
  for (const std::string& part : parts) EXPECT_TRUE(std::filesystem::exists(folder.path / part)) << part;
  // Nothing else lies there: the file in which the next index grows is gone with the sink.
  for (const auto& entry : std::filesystem::directory_iterator(folder.path))
    EXPECT_NE(entry.path().filename().string()[0], '.') << entry.path();
}

// Bytes that this process has handed to the system for writing.
long written_so_far() {
  std::istringstream in(read_file("/proc/self/io"));
  std::string word;
  long value = 0;
  while (in >> word >> value)
    if (word == "wchar:") return value;
  return -1;
}

TEST(PvdIndex, AnAppendWritesNoMoreAtTheThousandthFrameThanAtTheFirst) {
  const Folder folder;
  std::filesystem::create_directories(folder.path);
  PvdIndex index(folder.path / "skirt.pvd");
  long early = 0, late = 0;
  for (int k = 0; k < 2000; ++k) {
    const long before = written_so_far();
    index.append({k / 30.0, "skirt_" + std::to_string(1000 + k) + ".vtm"});
    const long took = written_so_far() - before;
    if (k >= 2 && k < 102) early += took;
    if (k >= 1900) late += took;
    if (k % 100 != 0 && k < 1995) continue;
    // Whole and in order at any time.
    const std::string text = read_file(folder.path / "skirt.pvd");
    EXPECT_TRUE(text.ends_with("</Collection>\n</VTKFile>\n"));
    const auto files = files_named_in(text);
    ASSERT_EQ(files.size(), std::size_t(k + 1));
    EXPECT_EQ(files.front(), "skirt_1000.vtm");
    EXPECT_EQ(files.back(), "skirt_" + std::to_string(1000 + k) + ".vtm");
  }
  ASSERT_GT(early, 0);
  EXPECT_LT(10 * late, 11 * early);
}

// A reader that opened an index goes on reading that index, whatever is appended meanwhile.
TEST(PvdIndex, AReaderKeepsAWholeFile) {
  const Folder folder;
  std::filesystem::create_directories(folder.path);
  PvdIndex index(folder.path / "skirt.pvd");
  for (int k = 0; k < 5; ++k) index.append({double(k), "a.vtu"});
  std::ifstream reader(folder.path / "skirt.pvd");
  const std::string before = read_file(folder.path / "skirt.pvd");
  index.append({5, "b.vtu"});
  const std::string seen{std::istreambuf_iterator<char>(reader), {}};
  EXPECT_EQ(seen, before);
  EXPECT_EQ(files_named_in(read_file(folder.path / "skirt.pvd")).size(), 6u);
}

TEST(VtuSink, TakesFramesOnceAndInOrder) {
  const Folder folder;
  const test::Draped draped;
  VtuSink sink(folder.path, "skirt");
  EXPECT_THROW(sink.write(draped.frame(1)), std::logic_error);
  sink.write(draped.frame(0));
  EXPECT_THROW(sink.write(draped.frame(0)), std::logic_error);
  VtuSink resumed(folder.path, "skirt", {0.0});
  resumed.write(draped.frame(1, 0.5));
  EXPECT_EQ(files_named_in(read_file(folder.path / "skirt.pvd")).size(), 2u);
}

TEST(VtuSink, AFailedWriteThrowsAndLeavesTheCollectionAsItWas) {
  const Folder folder;
  const test::Draped draped;
  VtuSink sink(folder.path, "skirt");
  sink.write(draped.frame(0));
  const std::string before = read_file(folder.path / "skirt.pvd");
  // A file stands where the next frame's folder should go.
  write_file(folder.path / "skirt_0001", "in the way");
  EXPECT_THROW(sink.write(draped.frame(1)), OutputError);
  EXPECT_EQ(read_file(folder.path / "skirt.pvd"), before);
  std::filesystem::remove(folder.path / "skirt_0001");
  sink.write(draped.frame(1));
  EXPECT_EQ(files_named_in(read_file(folder.path / "skirt.pvd")).size(), 2u);
}

TEST(Polyline, FollowsTheTrimWithinItsChord) {
  const test::Draped draped;
  TrimCurve circle{circular_arc({0.5, 0.5}, 0.3, 0, 2 * std::numbers::pi), 0, true, {}};
  const auto parameters = polyline_parameters(draped.surface, circle, 1e-3);
  EXPECT_EQ(parameters.front(), circle.curve.domain().max);
  EXPECT_EQ(parameters.back(), circle.curve.domain().min);
  double worst = 0;
  for (std::size_t k = 0; k + 1 < parameters.size(); ++k) {
    ASSERT_GT(parameters[k], parameters[k + 1]);
    const auto at = [&](double t) {
      const auto p = circle.curve(t);
      return draped.surface(p[0], p[1]);
    };
    const Eigen::Vector3d a = at(parameters[k]), b = at(parameters[k + 1]);
    for (const double s : {0.1, 0.4, 0.6, 0.9}) {
      const Eigen::Vector3d x = at(parameters[k] + s * (parameters[k + 1] - parameters[k])) - a;
      worst = std::max(worst, (x - x.dot((b - a).normalized()) * (b - a).normalized()).norm());
    }
  }
  EXPECT_LT(worst, 1.5e-3 * 1.4);
}

TEST(FileSink, ObjHoldsTheTrianglesInMetres) {
  const Folder folder;
  const test::Draped draped;
  FileSink sink(folder.path, ".obj", [](const Frame& frame) { return format_obj(frame, "cloth.mtl"); });
  EXPECT_THROW(sink.write(draped.frame(2)), std::logic_error);
  sink.write(draped.frame(0));
  std::istringstream in(read_file(folder.path / "frame_0000.obj"));
  std::string line, word;
  std::size_t vertices = 0, normals = 0, faces = 0, objects = 0;
  while (std::getline(in, line)) {
    std::istringstream words(line);
    words >> word;
    if (word == "o") ++objects;
    if (word == "v") {
      Eigen::Vector3d x;
      words >> x[0] >> x[1] >> x[2];
      const Eigen::Vector2d p = draped.triangles.uv[vertices++];
      ASSERT_EQ(x, draped.surface(p[0], p[1]));
    }
    if (word == "vn") {
      Eigen::Vector3d n;
      words >> n[0] >> n[1] >> n[2];
      const Eigen::Vector2d p = draped.triangles.uv[normals++];
      const SurfaceJet jet = evaluate(draped.surface, p[0], p[1]);
      ASSERT_LT((n - jet.u.cross(jet.v).normalized()).norm(), 1e-6);
    }
    if (word == "f") {
      const auto& t = draped.triangles.triangles[faces++];
      for (const int vertex : t) {
        words >> word;
        const std::string index = std::to_string(vertex + 1);
        ASSERT_EQ(word, index + '/' + index + '/' + index);
      }
    }
  }
  EXPECT_EQ(objects, 1u);
  EXPECT_EQ(vertices, draped.triangles.uv.size());
  EXPECT_EQ(normals, vertices);
  EXPECT_EQ(faces, draped.triangles.triangles.size());
}

}  // namespace
}  // namespace toile
