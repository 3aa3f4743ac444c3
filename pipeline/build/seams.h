// SPDX-License-Identifier: GPL-3.0-or-later
// Seams: which places of two edges are one place of the garment, and how they come together.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "analysis/contact/self_search.h"
#include "analysis/model/body.h"
#include "geometry/fields.h"
#include "pipeline/scene/scene.h"

namespace toile {

struct Build;

// A place of both sides, which are paired by fractions of their lengths at rest.
struct SeamPlace {
  double fraction = 0;
  Eigen::Vector2d a, b;  // parameters
  ScalarRow row;         // place on a less place on b
};

// Rows along an edge of n spans hold n + degree coefficients at most; both edges meet the same rows, so that more of
// them than the coarser one can follow would hold what neither can: the seam would lock. They are therefore even in
// spans of the side that is coarser there, one each, with both ends and the ends of curves.
struct BuiltSeam {
  int a = 0, b = 0;                   // panels
  double length_a = 0, length_b = 0;  // m, at rest
  std::vector<SeamPlace> rows;        // the ends first
  std::size_t required = 0;           // so many of them, as HeldPlace::required
  std::vector<SeamPlace> along;       // 200 places or more, in order: what rows don't hold shows here
  std::vector<double> weight;         // m, of the length of both sides' mean that each row stands for
  double gap = 0;                     // m, at most at the start
};

// Throws GeometryError where a curve doesn't exist, or a side has no length.
std::vector<BuiltSeam> build_seams(const Build& build, std::vector<std::string>& warnings);

// How far the seams are closed. All close together, the widest gap at the scene's speed; a seam that carries more than
// its force waits: there the garment is too small for what it goes around.
struct Sewing {
  std::vector<double> progress, rate, force;  // per seam: 0 to 1, 1/s, N/m that it carried of late
  std::vector<double> most;                   // N/m, that it may carry
  double since = 0;                           // s, when that was noted
  double waiting = 0;                         // s, that all open ones have hardly moved
  bool done = true;                           // closed, or no longer waited for

  double progress_at(int seam, double t) const;
};
void fields(auto& archive, Like<Sewing> auto& s) {
  archive(s.progress, s.rate, s.force, s.most, s.since, s.waiting, s.done);
}
// Of the start.
Sewing open_seams(const Scene& scene, const std::vector<BuiltSeam>& seams);
// After a step of dt to t in which the seams carried `force` [N/m].
void go_on(Sewing& sewing, const Scene& scene, const std::vector<BuiltSeam>& seams, const std::vector<double>& force,
           double t, double dt);

// After a step that found no balance: the seam that carries most may carry no more than that.
void hold_back(Sewing& sewing, const Scene& scene);

// What is left of a gap, 1 to 0, with a speed and an acceleration that rise and fall smoothly.
double open_part(double progress);

// Where both sides of seams lie in one plane: places that are neighbours there don't meet.
std::vector<SewnChart> sewn_charts(const Build& build);

}  // namespace toile
