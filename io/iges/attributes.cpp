// Entities 124 (transformation), 314 (colour), 406 form 15 (name). [IGES 5.3, 4.21, 4.77, 4.98]
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

void write_name(const std::string& name, Record& out) { out.integer(1).string(name); }

}  // namespace toile::iges
