// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/mesh_files.h"

#include <Eigen/Geometry>
#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "geometry/error.h"
#include "io/file.h"
#include "io/mesh_vertices.h"

namespace toile {

namespace {

static_assert(std::endian::native == std::endian::little, "the formats are little endian");

template <class T>
void append(std::string& to, T value) {
  std::array<char, sizeof(T)> bytes;
  std::memcpy(bytes.data(), &value, sizeof(T));
  to.append(bytes.data(), bytes.size());
}

void append_floats(std::string& to, const Eigen::Vector3d& x) {
  for (int c = 0; c < 3; ++c) append(to, static_cast<float>(x[c]));
}

struct Counts {
  std::size_t vertices = 0, triangles = 0;
};
Counts counts(const Frame& frame) {
  Counts sum;
  for (const FramePanel& panel : frame.panels) {
    sum.vertices += panel.triangles->uv.size();
    sum.triangles += panel.triangles->triangles.size();
  }
  if (sum.vertices > std::numeric_limits<std::int32_t>::max() ||
      sum.triangles > std::numeric_limits<std::int32_t>::max())
    throw OutputError("too many triangles for one file");
  return sum;
}

// One line, printable: names come from files.
std::string printable(const std::string& name) {
  std::string out;
  for (const char c : name) out += static_cast<unsigned char>(c) < ' ' || c == 0x7f ? ' ' : c;
  return out;
}

// UTF-8 as it is, other bytes replaced.
std::string valid_text(const std::string& name) {
  const auto text = nlohmann::json(name).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return nlohmann::json::parse(text).get<std::string>();
}

// The rotation that takes `up` to +Y: exact where `up` is an axis.
Eigen::Matrix3d turned_upright(const Eigen::Vector3d& up) {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  const double x = up.x(), y = up.y(), z = up.z();
  if (1 + y < 1e-12) return Eigen::Vector3d(1, -1, -1).asDiagonal();
  // About up x Y, written out so that axes stay free of rounding.
  turn << 1 - x * x / (1 + y), -x, -x * z / (1 + y),  //
      x, y, z,                                        //
      -x * z / (1 + y), -z, 1 - z * z / (1 + y);
  return turn;
}

}  // namespace

std::string format_ply(const Frame& frame) {
  const Counts sum = counts(frame);
  const std::vector<MeshVertices> meshes = mesh_vertices(frame);
  std::string out = "ply\nformat binary_little_endian 1.0\ncomment toile, metres, axes of the scene\n";
  for (std::size_t k = 0; k < frame.panels.size(); ++k)
    out += "comment panel " + std::to_string(k) + " " + printable(frame.panels[k].name) + "\n";
  // Readers that take lists only as a face's last property are common: the panel stands at the vertices.
  out += "element vertex " + std::to_string(sum.vertices) +
         "\nproperty double x\nproperty double y\nproperty double z\nproperty double s\nproperty double t\n"
         "property int panel\nelement face " +
         std::to_string(sum.triangles) + "\nproperty list uchar int vertex_indices\nend_header\n";
  for (std::size_t k = 0; k < meshes.size(); ++k) {
    for (std::size_t i = 0; i < meshes[k].position.size(); ++i) {
      for (int c = 0; c < 3; ++c) append(out, meshes[k].position[i][c]);
      for (int c = 0; c < 2; ++c) append(out, meshes[k].texture[i][c]);
      append(out, static_cast<std::int32_t>(k));
    }
  }
  std::int32_t first = 0;
  for (const FramePanel& panel : frame.panels) {
    for (const std::array<int, 3>& triangle : panel.triangles->triangles) {
      append(out, std::uint8_t{3});
      for (const int vertex : triangle) append(out, static_cast<std::int32_t>(first + vertex));
    }
    first += static_cast<std::int32_t>(panel.triangles->uv.size());
  }
  return out;
}

std::string format_stl(const Frame& frame) {
  std::string out = "toile, metres";  // must not begin with "solid", which means text
  out.resize(80, ' ');
  append(out, static_cast<std::uint32_t>(counts(frame).triangles));
  for (const FramePanel& panel : frame.panels) {
    std::vector<Eigen::Vector3d> x;
    for (const Eigen::Vector2d& uv : panel.triangles->uv) x.push_back((*panel.surface)(uv.x(), uv.y()));
    for (const auto& [a, b, c] : panel.triangles->triangles) {
      const Eigen::Vector3d &p = x[static_cast<std::size_t>(a)], &q = x[static_cast<std::size_t>(b)],
                            &r = x[static_cast<std::size_t>(c)];
      append_floats(out, (q - p).cross(r - p).stableNormalized());
      for (const Eigen::Vector3d* corner : {&p, &q, &r}) append_floats(out, *corner);
      append(out, std::uint16_t{0});
    }
  }
  return out;
}

std::string format_glb(const Frame& frame) {
  using Json = nlohmann::ordered_json;
  counts(frame);
  constexpr int float_type = 5126, index_type = 5125, vertex_target = 34962, index_target = 34963;
  std::string binary;
  Json gltf = {{"asset", {{"version", "2.0"}, {"generator", "toile"}}},
               {"scene", 0},
               {"scenes", {{{"nodes", Json::array()}}}},
               {"nodes", Json::array()},
               {"meshes", Json::array()},
               {"materials", {{{"name", "cloth"}, {"doubleSided", true}}}},
               {"accessors", Json::array()},
               {"bufferViews", Json::array()},
               {"buffers", Json::array()}};
  const auto accessor = [&](const std::string& bytes, int target, int component, std::size_t count, const char* type) {
    gltf["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", bytes.size()}, {"target", target}});
    gltf["accessors"].push_back({{"bufferView", gltf["bufferViews"].size() - 1},
                                 {"componentType", component},
                                 {"count", count},
                                 {"type", type}});
    binary += bytes;
    return gltf["accessors"].size() - 1;
  };
  const Eigen::Matrix3d upright = turned_upright(frame.up);
  const std::vector<MeshVertices> meshes = mesh_vertices(frame);
  for (std::size_t k = 0; k < frame.panels.size(); ++k) {
    const FramePanel& panel = frame.panels[k];
    const TrimmedTriangles& mesh = *panel.triangles;
    if (mesh.triangles.empty()) continue;
    std::string corners, normals, uv, indices;
    Eigen::Vector3f low = Eigen::Vector3f::Constant(std::numeric_limits<float>::infinity()), high = -low;
    for (std::size_t i = 0; i < mesh.uv.size(); ++i) {
      const Eigen::Vector3d x = upright * meshes[k].position[i];
      low = low.cwiseMin(x.cast<float>()), high = high.cwiseMax(x.cast<float>());
      append_floats(corners, x);
      append_floats(normals, upright * meshes[k].normal[i]);
      append(uv, static_cast<float>(meshes[k].texture[i].x()));
      append(uv, static_cast<float>(1 - meshes[k].texture[i].y()));
    }
    for (const std::array<int, 3>& triangle : mesh.triangles)
      for (const int vertex : triangle) append(indices, static_cast<std::uint32_t>(vertex));
    const auto position = accessor(corners, vertex_target, float_type, mesh.uv.size(), "VEC3");
    gltf["accessors"][position]["min"] = {low.x(), low.y(), low.z()};
    gltf["accessors"][position]["max"] = {high.x(), high.y(), high.z()};
    const auto normal = accessor(normals, vertex_target, float_type, mesh.uv.size(), "VEC3");
    const auto texture = accessor(uv, vertex_target, float_type, mesh.uv.size(), "VEC2");
    const auto index = accessor(indices, index_target, index_type, 3 * mesh.triangles.size(), "SCALAR");
    const std::string name = panel.name.empty() ? "panel_" + std::to_string(k) : valid_text(panel.name);
    gltf["scenes"][0]["nodes"].push_back(gltf["nodes"].size());
    gltf["nodes"].push_back({{"name", name}, {"mesh", gltf["meshes"].size()}});
    gltf["meshes"].push_back({{"name", name},
                              {"primitives",
                               {{{"attributes", {{"POSITION", position}, {"NORMAL", normal}, {"TEXCOORD_0", texture}}},
                                 {"indices", index},
                                 {"material", 0}}}}});
  }
  if (binary.empty()) throw OutputError("there is no triangle to write");
  gltf["buffers"].push_back({{"byteLength", binary.size()}});
  std::string text = gltf.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  if (binary.size() > std::numeric_limits<std::uint32_t>::max() - text.size() - 64)
    throw OutputError("too many triangles for one GLB file");
  std::string out = "glTF";
  append(out, std::uint32_t{2});
  append(out, static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + binary.size()));
  append(out, static_cast<std::uint32_t>(text.size()));
  out += "JSON" + text;
  append(out, static_cast<std::uint32_t>(binary.size()));
  out += std::string("BIN\0", 4) + binary;
  return out;
}

FileSink::FileSink(std::filesystem::path folder, std::string ending, Format format, int next)
    : folder_(std::move(folder)), ending_(std::move(ending)), format_(std::move(format)), next_(next) {}

void FileSink::write(const Frame& frame) {
  if (frame.number != next_)
    throw std::logic_error("FileSink: frame " + std::to_string(frame.number) + " where " + std::to_string(next_) +
                           " was due");
  const std::string digits = std::to_string(frame.number);
  const std::string name = "frame_" + std::string(digits.size() < 4 ? 4 - digits.size() : 0, '0') + digits + ending_;
  write_file(folder_ / name, format_(frame), Flush::no);
  ++next_;
}

}  // namespace toile
