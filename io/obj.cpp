// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/obj.h"

#include <array>
#include <charconv>

#include "io/mesh_vertices.h"

namespace toile {

namespace {

template <class Number>
void append_number(std::string& to, Number value) {
  std::array<char, 32> text;
  to += ' ';
  to.append(text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr);
}

template <class Vector>
void append_line(std::string& to, const char* word, const Vector& x) {
  to += word;
  for (const auto value : x) append_number(to, value);
  to += '\n';
}

// Names are one word.
std::string object_name(const std::string& name, std::size_t number) {
  std::string out;
  for (const char c : name) out += static_cast<unsigned char>(c) <= ' ' ? '_' : c;
  return out.empty() ? "panel_" + std::to_string(number) : out;
}

// " 0 0 1".
std::string axis_text(const Eigen::Vector3d& axis) {
  std::string out;
  for (const double value : axis) append_number(out, value);
  return out;
}

}  // namespace

std::string format_obj(const Frame& frame, std::string_view material_file) {
  const std::vector<MeshVertices> meshes = mesh_vertices(frame);
  std::string out = "# toile: metres, axes of the scene, up is" + axis_text(frame.up) + "\n";
  out += "mtllib " + std::string(material_file) + '\n';
  std::size_t first = 1;
  for (std::size_t k = 0; k < frame.panels.size(); ++k) {
    const FramePanel& panel = frame.panels[k];
    // Objects for those who import by object, groups for those who import by group.
    const std::string name = object_name(panel.name, k);
    out += "o " + name + "\ng " + name + '\n';
    for (const Eigen::Vector3d& x : meshes[k].position) append_line(out, "v", x);
    for (const Eigen::Vector2d& x : meshes[k].texture) append_line(out, "vt", x);
    for (const Eigen::Vector3d& x : meshes[k].normal) append_line(out, "vn", x.cast<float>().eval());
    out += "usemtl cloth\ns 1\n";
    for (const std::array<int, 3>& triangle : panel.triangles->triangles) {
      out += 'f';
      for (const int vertex : triangle) {
        const std::string index = std::to_string(first + static_cast<std::size_t>(vertex));
        out += ' ' + index + '/' + index + '/' + index;
      }
      out += '\n';
    }
    first += panel.triangles->uv.size();
  }
  return out;
}

std::string format_mtl() {
  // A matt, light grey: seen in every program, easily replaced.
  return "# toile\nnewmtl cloth\nKa 0.8 0.8 0.8\nKd 0.8 0.8 0.8\nKs 0 0 0\nd 1\nillum 1\n";
}

}  // namespace toile
