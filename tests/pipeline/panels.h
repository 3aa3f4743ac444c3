// SPDX-License-Identifier: GPL-3.0-or-later
// Small panels and scenes for the tests of this room, written anew into a folder of their own.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

#include "geometry/refine.h"
#include "geometry/trimmed_surface.h"
#include "io/file.h"
#include "io/iges.h"

namespace toile::test {

// A folder under the system's temporary one that is empty at the start and removed at the end.
class Folder {
 public:
  explicit Folder(const std::string& name)
      : path_(std::filesystem::temp_directory_path() / ("toile_test_" + name + "_" + std::to_string(::getpid()))) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

// 0.4 m x 0.4 m in millimetres, degree 2 on 5 x 5 spans.
inline TrimmedSurface sheet(const std::string& name) {
  const AffinePatch plane{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0};
  TrimmedSurface face = untrimmed(rebuild(plane, uniform_knots(2, 5, {0, 400}), uniform_knots(2, 5, {0, 400})));
  face.name = name;
  face.metres_per_unit = 1e-3;
  return face;
}

// The sheet cut to a quadrilateral whose curve 2 is a curved waist; corner (0, 0) and three edges are trimmed away.
inline TrimmedSurface trimmed_sheet(const std::string& name) {
  TrimmedSurface face = sheet(name);
  face.natural_bounds = false;
  const Eigen::Vector2d a(30, 20), b(370, 20), c(310, 380), d(90, 380);
  Eigen::Matrix2Xd waist(2, 3);
  waist << c, Eigen::Vector2d(200, 340), d;
  TrimLoop loop;
  for (const Curve2& curve :
       {line_segment<2>(a, b), line_segment<2>(b, c), Curve2(uniform_knots(2, 1), waist), line_segment<2>(d, a)}) {
    TrimCurve trim;
    trim.curve = curve;
    trim.index = static_cast<int>(loop.curves.size());
    loop.curves.push_back(trim);
  }
  face.loops = {loop};
  return face;
}

inline void write_panels(const std::filesystem::path& file, const std::vector<TrimmedSurface>& faces) {
  std::vector<OutputFace> output;
  for (const TrimmedSurface& face : faces) output.push_back({face, face.name, 0, std::nullopt});
  IgesHeader header;
  header.product = "test";
  write_file(file, format_iges(output, header).text);
}

// A scene on "panel.igs" in the same folder: heavy enough to move, small enough to be quick.
inline std::string scene_text(const std::string& pins, const std::string& more = "") {
  return "[[panel]]\nname = \"cloth\"\nfile = \"panel.igs\"\n" + pins + "\n[strain_limit]\ntolerance = 0.01\n" +
         "[solver]\nuntil = 0.1\n[output]\nevery = 0.05\npreview = false\nformats = []\n" + more;
}

}  // namespace toile::test
