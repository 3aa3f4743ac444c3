// SPDX-License-Identifier: GPL-3.0-or-later
// Addresses of places on a panel: corner:U,V | edge:u0 | curve:LOOP,K[,FROM,TO] | uv:U,V | cp:I,J | box:[..],[..].
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>

namespace toile {

struct Address {
  enum class Kind { corner, edge, curve, uv, control_point, box };
  Kind kind = Kind::corner;
  int a = 0, b = 0;          // corner: ends (0, 1) in u and v; edge: direction (0 = u, 1 = v) and end;
                             // curve: loop and curve as the file numbers them; cp: indices in the refined net
  double from = 0, to = 1;   // curve: fractions of its arc length in space, in the file's direction
  Eigen::Vector2d uv{0, 0};  // file parameters
  Eigen::Vector3d min{0, 0, 0}, max{0, 0, 0};  // box, scene axes [m]
  std::string text;                            // as written
};

// Throws InputError (without a place) that says what was expected.
Address parse_address(std::string_view text);

}  // namespace toile
