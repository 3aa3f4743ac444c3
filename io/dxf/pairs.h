// SPDX-License-Identifier: GPL-3.0-or-later
// A DXF file as pairs of group code and value, cut down to what pieces are made of.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace toile::dxf {

// A SPLINE as the file says it. dxflib gives weights to the control point before them, where other programs list all
// weights first: so it is read here.
struct Spline {
  int degree = 3;
  std::vector<double> knots, weights;
  std::vector<Eigen::Vector3d> points;
  int fit_points = 0;
};

struct Pairs {
  std::string text;        // for dxflib: without what isn't read, which it would allocate for by the file's claims
  std::vector<int> lines;  // where each entity and block begins that dxflib announces
  std::vector<Spline> splines;
  std::map<std::string, std::string> header;  // first value of each variable: "$INSUNITS" -> "4"
  std::map<std::string, int> unread;          // entities by type
};

// Throws InputError `name:line: ...` for what is no DXF file.
Pairs cut(std::string_view text, const std::string& name);

std::string trimmed(std::string_view text);

}  // namespace toile::dxf
