// SPDX-License-Identifier: GPL-3.0-or-later
// A DXF file as blocks of items, by dxflib: what pieces are made of, in the file's own numbers.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/nurbs_curve.h"

namespace toile::dxf {

// x -> linear x + shift.
struct Affine {
  Eigen::Matrix2d linear = Eigen::Matrix2d::Identity();
  Eigen::Vector2d shift{0, 0};
  Eigen::Vector2d operator()(const Eigen::Vector2d& x) const { return linear * x + shift; }
  bool mirrors() const { return linear.determinant() < 0; }
  bool similar() const;  // keeps angles up to their sense: circles stay circles
};
Affine operator*(const Affine& outer, const Affine& inner);
Curve2 mapped(const Affine& map, const Curve2& curve);

struct Polyline {
  std::vector<Eigen::Vector2d> points;
  std::vector<double> bulges;  // of the segment after each point
  double height = 0;
  bool closed = false;
};

struct Insert {
  std::string block;
  Affine map;  // of the block's own coordinates
};

struct Item {
  int line = 0;
  std::string type;  // "POLYLINE", ...
  std::string layer;
  std::vector<Polyline> lines;           // a polyline or line
  std::vector<Curve2> curves;            // an arc, circle, ellipse or spline
  std::optional<Eigen::Vector2d> point;  // a point or text
  std::string text;                      // UTF-8
  std::optional<Insert> insert;
};
Item mapped(const Affine& map, Item item);

struct Block {
  std::string name;
  int line = 0;
  Eigen::Vector2d base{0, 0};
  std::vector<Item> items;
};

struct Drawing {
  std::map<std::string, std::string> header;
  std::vector<Block> blocks;  // the first: entities outside of blocks
  std::map<std::string, int> unread;
  std::vector<std::string> warnings;  // with line
};

// Throws InputError `name:line: ...`.
Drawing read_drawing(std::string_view text, const std::string& name);

}  // namespace toile::dxf
