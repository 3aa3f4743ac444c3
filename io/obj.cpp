#include "io/obj.h"

#include <array>
#include <charconv>
#include <stdexcept>

#include "io/file.h"

namespace toile {

namespace {

void append_number(std::string& to, double value) {
  std::array<char, 32> text;
  to += ' ';
  to.append(text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr);
}

// A group name is one word.
std::string group_name(const std::string& name, std::size_t number) {
  std::string out;
  for (const char c : name) out += static_cast<unsigned char>(c) <= ' ' ? '_' : c;
  return out.empty() ? "panel_" + std::to_string(number) : out;
}

}  // namespace

std::string format_obj(const Frame& frame) {
  std::string out = "# toile, metres\n";
  std::size_t first = 1;
  for (std::size_t k = 0; k < frame.panels.size(); ++k) {
    const FramePanel& panel = frame.panels[k];
    out += "g " + group_name(panel.name, k) + '\n';
    for (const Eigen::Vector2d& p : panel.triangles->uv) {
      const Eigen::Vector3d x = (*panel.surface)(p[0], p[1]);
      out += 'v';
      for (int c = 0; c < 3; ++c) append_number(out, x[c]);
      out += '\n';
    }
    for (const Eigen::Vector2d& p : panel.triangles->uv) {
      out += "vt";
      append_number(out, p[0]);
      append_number(out, p[1]);
      out += '\n';
    }
    for (const std::array<int, 3>& triangle : panel.triangles->triangles) {
      out += 'f';
      for (const int vertex : triangle) {
        const std::string index = std::to_string(first + static_cast<std::size_t>(vertex));
        out += ' ' + index + '/' + index;
      }
      out += '\n';
    }
    first += panel.triangles->uv.size();
  }
  return out;
}

ObjSink::ObjSink(std::filesystem::path folder, int next) : folder_(std::move(folder)), next_(next) {}

void ObjSink::write(const Frame& frame) {
  if (frame.number != next_)
    throw std::logic_error("ObjSink: frame " + std::to_string(frame.number) + " where " + std::to_string(next_) +
                           " was due");
  const std::string digits = std::to_string(frame.number);
  const std::string name = "frame_" + std::string(digits.size() < 4 ? 4 - digits.size() : 0, '0') + digits + ".obj";
  write_file(folder_ / name, format_obj(frame), Flush::no);
  ++next_;
}

}  // namespace toile
