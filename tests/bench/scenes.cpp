// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/scenes.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <string>

#include "geometry/clock.h"
#include "pipeline/run/measures.h"
#include "pipeline/run/run.h"

namespace toile::bench {
namespace {

Build kidnapped(const std::filesystem::path& samples, const std::vector<std::string>& settings) {
  return build(read_scene(samples / "kidnapped_a" / "scene.toml", settings));
}

Build kidnapped(const std::filesystem::path& samples, int per_direction) {
  const std::string n = std::to_string(per_direction);
  return kidnapped(samples, {"panel.0.refine.control_points=[" + n + "," + n + "]"});
}

// Bending bounds the step by h^2; half of what 8 x 8 cells allow.
double small_step(int per_direction) {
  return 2e-3 * std::pow(8.0 / (per_direction - 2), 2);
}

}  // namespace

double median(std::vector<double> times) {
  const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
  std::nth_element(times.begin(), middle, times.end());
  return *middle;
}

std::vector<DrapeCost> kidnapped_by_step(const std::filesystem::path& samples,
                                         const std::vector<int>& steps_per_frame) {
  std::vector<DrapeCost> costs;
  std::vector<Eigen::Vector3d> corners;
  for (const int count : steps_per_frame) {
    DrapeCost cost;
    cost.steps_per_frame = count;
    cost.dt = 1.0 / (30 * count);
    const Build scene = kidnapped(samples, {"solver.dt=" + std::to_string(cost.dt)});
    RunResult result;
    std::vector<double> times;
    for (int k = 0; k < (count <= 128 ? 5 : 1); ++k) {
      result = run(scene);
      times.push_back((result.force_seconds + result.projection_seconds) / (30 * result.time));
    }
    cost.finished = result.exit == RunExit::ok && result.redone_steps == 0;
    cost.per_frame = median(times);
    corners.push_back(measure(scene, *result.system, result.state, result.dt_last).points.at(0));
    costs.push_back(cost);
  }
  for (std::size_t k = 0; k < costs.size(); ++k) costs[k].to_finest = (corners[k] - corners.back()).norm();
  return costs;
}

std::size_t quadrature_points(const Build& build) {
  std::size_t count = 0;
  for (const ClothPanel& panel : build.model->panels()) count += panel.quadrature.points.size();
  return count;
}

StepCost step_cost(const std::filesystem::path& samples, int per_direction, int threads) {
  constexpr double least_seconds = 0.5;
  constexpr int least_steps = 5;
  const Build scene = kidnapped(samples, per_direction);
  Workers workers(threads);
  const auto system = assemble(scene, 0, &workers);
  const double dt = small_step(per_direction);
  StepCost cost;
  cost.control_points = per_direction * per_direction;
  cost.quadrature_points = quadrature_points(scene);

  const Eigen::VectorXd still = Eigen::VectorXd::Zero(scene.start.size());
  DynamicState state = state_from(*system, scene.start, still, 0);
  initialise(system->dynamic, state);
  const DynamicState start = state;
  std::vector<double> motion, projection, solution, factorisation;
  double spent = 0;
  for (int k = 0; k < least_steps || spent < least_seconds; ++k) {
    const StepReport report = step(system->dynamic, state, dt);
    const double iterations = report.projection.iterations;
    spent += report.projection_seconds;
    const double factor = report.projection.factor_seconds, solve = report.projection.solve_seconds;
    projection.push_back((report.projection_seconds - factor - solve) / iterations);
    solution.push_back(solve / iterations);
    factorisation.push_back(factor / iterations);
  }
  cost.projection = median(projection);
  cost.solution = median(solution);
  cost.factorisation = median(factorisation);
  cost.fill =
      static_cast<double>(system->projection->factor_nonzeros()) / (system->strain_rows + 3 * system->place_rows);

  MechanicalSystem free = system->dynamic;
  free.projection = nullptr;
  state = start;
  for (spent = 0; static_cast<int>(motion.size()) < least_steps || spent < least_seconds; spent += motion.back()) {
    const Clock::time_point begin = Clock::now();
    step(free, state, dt);
    motion.push_back(since(begin));
  }
  cost.motion = median(motion);
  return cost;
}

RunCost run_cost(const std::filesystem::path& samples, int per_direction, int threads) {
  constexpr int control_point_steps = 1000000;
  const Build scene = kidnapped(samples, per_direction);
  Workers workers(threads);
  const auto system = assemble(scene, 0, &workers);
  DynamicState state = state_from(*system, scene.start, Eigen::VectorXd::Zero(scene.start.size()), 0);
  StepWork work;
  const Clock::time_point begin = Clock::now();
  const std::clock_t cpu = std::clock();
  const int steps = control_point_steps / (per_direction * per_direction);
  for (int k = 0; k < steps; ++k) step(system->dynamic, state, small_step(per_direction), work);
  return {since(begin), static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC};
}

double exponent(const std::vector<double>& size, const std::vector<double>& cost) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  const double n = static_cast<double>(size.size());
  for (std::size_t k = 0; k < size.size(); ++k) {
    const double x = std::log(size[k]), y = std::log(cost[k]);
    sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

}  // namespace toile::bench
