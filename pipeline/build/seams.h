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

// How far the seams are closed. First springs pull the sides to each other, around a body if need be: all together, the
// widest gap at the scene's speed. Then rows close what is left, along the way that it has then. A seam that carries
// more than its force waits: there the garment is too small for what it goes around.
struct Sewing {
  enum Stage : int { springs, rows, closed };  // closed, or no longer waited for
  int stage = closed;
  std::vector<double> progress, rate, force;  // of the stage, per seam: 0 to 1, 1/s, N/m that it carried of late
  std::vector<double> most;                   // N/m, that it may carry
  double since = 0;                           // s, when that was noted
  double waiting = 0;                         // s, that all open ones have hardly moved
  Eigen::VectorXd from;                       // control points at the start of the stage of rows [m]

  bool done() const { return stage == closed; }
  double progress_at(int seam, double t) const;
};
void fields(auto& archive, Like<Sewing> auto& s) {
  archive(s.stage, s.progress, s.rate, s.force, s.most, s.since, s.waiting, s.from);
}
// Of the start; then at each end of a stage, with the control points there.
Sewing open_seams(const Scene& scene, const std::vector<BuiltSeam>& seams, const Eigen::VectorXd& start);
void begin_rows(Sewing& sewing, const Scene& scene, const std::vector<BuiltSeam>& seams, const Eigen::VectorXd& q,
                double t);
// After a step of dt to t in which the seams carried `force` [N/m]. True where the stage is over.
bool go_on(Sewing& sewing, const Scene& scene, const std::vector<BuiltSeam>& seams, const std::vector<double>& force,
           double t, double dt);
// After a step that found no balance: all close at half the rate, which grows again in the steps that follow, and the
// seam that carries most may carry no more than that.
void hold_back(Sewing& sewing, const Scene& scene);

constexpr double spring_stiffness = 1000;  // N/m2: 10 N/m, as of a tight waist, leave 10 mm to the rows
constexpr double spring_period = 2e-3;     // s / (2 pi), of what a spring pulls, at least

// What is left of a gap, 1 to 0, with a speed and an acceleration that rise and fall smoothly.
double open_part(double progress);

// Where both sides of seams lie in one plane: places that are neighbours there don't meet.
std::vector<SewnChart> sewn_charts(const Build& build);

}  // namespace toile
