// SPDX-License-Identifier: GPL-3.0-or-later
// Entities 124 (transformation), 212 (general note), 314 (colour), 406 forms 3 (what a level holds) and 15 (name).
// [IGES 5.3, 4.21, 4.60, 4.77, 4.98]
#include <numbers>

#include "io/iges/entity.h"

namespace toile::iges {

Eigen::Affine3d read_transform(Parameters& in) {
  Eigen::Affine3d t = Eigen::Affine3d::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) t.linear()(row, column) = in.real("R");
    t.translation()[row] = in.real("T");
  }
  return t;
}

void write(const Eigen::Affine3d& t, Record& out) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) out.real(t.linear()(row, column));
    out.real(t.translation()[row]);
  }
}

std::vector<NoteString> read_note(Parameters& in) {
  constexpr long long width = 12;
  const int n = in.integer("NS");
  if (n < 1) in.fail("NS is " + std::to_string(n) + ", must be positive");
  in.expect(width * n, std::to_string(n) + " strings");
  std::vector<NoteString> strings;
  for (int i = 0; i < n; ++i) {
    NoteString line;
    in.integer("NC");
    for (const char* what : {"WT", "HT"}) in.real(what);
    in.integer("FC", 1);
    for (const char* what : {"SL", "A"}) in.real(what);
    for (const char* what : {"M", "VH"}) in.integer(what);
    for (int axis = 0; axis < 3; ++axis) line.at[axis] = in.real("coordinate of the text");
    line.text = in.text("text");
    strings.push_back(std::move(line));
  }
  return strings;
}

void write(const NoteString& note, double height, Record& out) {
  const auto count = static_cast<long long>(note.text.size());
  // One string in font 1, upright (the slant angle is a right angle), along x.
  out.integer(1).integer(count).real(height * static_cast<double>(count)).real(height).integer(1);
  out.real(std::numbers::pi / 2).real(0).integer(0).integer(0);
  for (int axis = 0; axis < 3; ++axis) out.real(note.at[axis]);
  out.string(note.text);
}

Colour read_colour(Parameters& in) {
  Colour colour;
  colour.red = in.real("red");
  colour.green = in.real("green");
  colour.blue = in.real("blue");
  if (in.left() > 0 && (in.defaulted() || in.token(in.position()).is_string)) colour.name = in.text("colour name");
  return colour;
}

void write(const Colour& colour, Record& out) {
  out.real(colour.red).real(colour.green).real(colour.blue);
  if (!colour.name.empty()) out.string(colour.name);
}

std::optional<std::string> read_name(Parameters& in) {
  if (in.entry().form != 15) return std::nullopt;
  in.integer("NP");
  return in.text("name");
}

void write_name(const std::string& name, Record& out) {
  out.integer(1).string(name);
}

void write_level_function(const std::string& words, Record& out) {
  out.integer(2).integer(0).string(words);
}

}  // namespace toile::iges
