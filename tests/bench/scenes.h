// SPDX-License-Identifier: GPL-3.0-or-later
// Whole scenes, timed: what no loop over one function can say.
#pragma once

#include <filesystem>
#include <vector>

namespace toile::bench {

// Example 4.1(a) at one step size, one core. `per_frame` is the wall time of force and projection for 1/30 s of motion;
// building the scene, measuring the step bound and writing are excluded.
struct DrapeCost {
  int steps_per_frame = 0;
  double dt = 0;          // s
  double per_frame = 0;   // s
  double to_finest = 0;   // m, free corner at 0.6 s against that of the smallest step
  bool finished = false;  // false: the run was redone with smaller steps or stopped
};
std::vector<DrapeCost> kidnapped_by_step(const std::filesystem::path& samples, const std::vector<int>& steps_per_frame);

// One step of the same cloth on n x n control points, p = 2, 3 x 3 Gauss points a cell.
struct StepCost {
  int control_points = 0;
  std::size_t quadrature_points = 0;
  double motion = 0;         // s, a step without projection
  double projection = 0;     // s, one iteration of the projection without its linear system: rows, matrix, correction
  double solution = 0;       // s, of one iteration by the factor: two triangular solves
  double factorisation = 0;  // s, of one iteration
  double fill = 0;           // nonzeros of the factor per row
};
StepCost step_cost(const std::filesystem::path& samples, int per_direction, int threads = 1);

// A number of steps of the same cloth with its strain limit, all together.
struct RunCost {
  double wall = 0, cpu = 0;  // s
};
RunCost run_cost(const std::filesystem::path& samples, int per_direction, int threads);

// Of several timings: what other programs on the machine took doesn't count.
double median(std::vector<double> times);

// Slope of log(cost) over log(size) by least squares.
double exponent(const std::vector<double>& size, const std::vector<double>& cost);

}  // namespace toile::bench
