// SPDX-License-Identifier: GPL-3.0-or-later
// Control nets as text, for programs of one's own.
#pragma once

#include <string>

#include "io/frame.h"

namespace toile {

// Metres, scene axes, every number with all its digits. One object:
//   {"unit": "m", "time": 0, "panels": [{"name": "front", "degree": [p, q], "control_points": [n, m],
//     "knots": [[...], [...]], "points": [[[x, y, z], ...], ...], "weights": [[...], ...],
//     "loops": [{"kind": "outer", "curves": [{"degree": p, "knots": [...], "points": [[u, v], ...],
//                                             "weights": [...], "reversed": false}]}]}]}
// points[i][j] and weights[i][j] belong to control point i along u and j along v; weights are left out where all are 1.
std::string format_net_json(const Frame& frame);

// The nets alone, a row a control point: panel,i,j,x,y,z,weight,cloth (1 where it carries cloth, empty where unknown).
std::string format_net_csv(const Frame& frame);

}  // namespace toile
