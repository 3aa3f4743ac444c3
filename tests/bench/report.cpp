// SPDX-License-Identifier: GPL-3.0-or-later
// bench_report SAMPLES BENCHMARKS.json...: the numbers that the project promises, each with its target, what it is
// measured on and what is excluded. Reads what Google Benchmark wrote (medians), and times whole scenes itself. A
// target that is missed is printed as such and is no error: machines differ.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "bench/busy_cores.h"
#include "bench/scenes.h"
#include "geometry/error.h"

namespace {

using namespace toile::bench;

void row(const std::string& what, const std::string& value, const std::string& target, bool met,
         const std::string& how) {
  fmt::print("{:<50} {:>16}  {:<22} {:<7} {}\n", what, value, target, target.empty() ? "" : (met ? "met" : "MISSED"),
             how);
}

void note(const std::string& what, const std::string& value, const std::string& how) {
  row(what, value, "", true, how);
}

// Medians by benchmark name.
class Medians {
 public:
  void read(const std::string& path) {
    std::ifstream file(path);
    const auto json = nlohmann::json::parse(file);
    for (const auto& entry : json.at("benchmarks"))
      if (entry.value("aggregate_name", "") == "median") entries_[entry.at("run_name")] = entry;
  }
  double operator()(const std::string& name, const std::string& field) const {
    const auto found = entries_.find(name);
    if (found == entries_.end()) throw std::runtime_error("no benchmark " + name);
    const auto& entry = found->second;
    const double value = entry.at(field);
    if (field != "cpu_time") return value;
    const std::string unit = entry.at("time_unit");
    return value * (unit == "ns" ? 1e-9 : unit == "us" ? 1e-6 : unit == "ms" ? 1e-3 : 1);
  }

 private:
  std::map<std::string, nlohmann::json> entries_;
};

void functions(const Medians& median) {
  for (const int n : {10, 32, 100, 316}) {
    const double time = median(fmt::format("shell_force/p:2/n:{}", n), "per_point");
    row(fmt::format("force per quadrature point, p = 2, {0} x {0}", n), fmt::format("{:.4f} us", 1e6 * time),
        "<= 0.1 us", time <= 1e-7, "1 core; 3 x 3 Gauss points a cell; without building the tables");
  }
  for (const int rational : {0, 1}) {
    const double rate = median(fmt::format("grouped_by_span/p:3/rational:{}", rational), "items_per_second");
    row(fmt::format("surface points, p = 3{}", rational ? ", rational" : ""), fmt::format("{:.1f} M/s", rate / 1e6),
        rational ? "" : ">= 5 M/s", rate >= 5e6,
        "1 core; with 1st and 2nd derivatives; 16 points a span, basis included");
  }
  const double read = median("read_100_faces", "cpu_time"), size = median("read_100_faces", "MB");
  row("IGES of 100 trimmed faces read", fmt::format("{:.3f} s", read), "< 0.3 s", read < 0.3,
      fmt::format("1 core; {:.1f} MB from memory to panels; without the disk", size));
  const double points = median("constraint_points_of_a_large_face", "cpu_time");
  row("constraint points, 200 x 200 spans, 500-span trim", fmt::format("{:.4f} s", points), "< 0.1 s", points < 0.1,
      fmt::format("1 core; validation, tracing and listing of {} points; without making the face",
                  median("constraint_points_of_a_large_face", "points")));
}

// What bounds each kernel, and the share of it that is reached. Bytes: tables and factors alone, each time they are
// read.
void bounds(const Medians& median) {
  const double most_operations = median("machine_operations", "items_per_second");
  const double most_bytes = median("machine_reading", "bytes_per_second");
  note("this core at most", fmt::format("{:.1f} GFlop/s", most_operations / 1e9),
       fmt::format("reads {:.1f} GB/s of main memory", most_bytes / 1e9));
  const auto share = [&](const std::string& what, double seconds, double operations, double bytes) {
    const double of_operations = operations / seconds / most_operations, of_bytes = bytes / seconds / most_bytes;
    note(what,
         fmt::format("{:.0f} % of {}", 100 * std::max(of_operations, of_bytes),
                     of_bytes > of_operations ? "bytes" : "flops"),
         fmt::format("{:.1f} GFlop/s, {:.1f} GB/s", operations / seconds / 1e9, bytes / seconds / 1e9));
  };
  for (const int p : {2, 3})
    for (const int n : {10, 100, 316}) {
      const std::string name = fmt::format("shell_force/p:{}/n:{}", p, n);
      share(fmt::format("  force, p = {0}, {1} x {1}", p, n), median(name, "per_point"),
            median(fmt::format("force_at_a_point/p:{}", p), "operations"), median(name, "bytes_per_point"));
    }
  for (const char* kernel : {"factorisation", "solution"})
    for (const int n : {10, 32, 100}) {
      const std::string name = fmt::format("{}/n:{}", kernel, n);
      share(fmt::format("  {}, {:.0f} rows", kernel, median(name, "rows")), median(name, "cpu_time"),
            median(name, "operations"), median(name, "bytes"));
    }
  // Products with 16 functions of position and five derivatives, 3 components; the basis comes on top.
  share("  surface points, p = 3", 1 / median("grouped_by_span/p:3/rational:0", "items_per_second"), 6 * 16 * 3 * 2, 0);
}

void limits(const Medians& median) {
  for (const int n : {10, 32, 100}) {
    const auto iteration = [&](const std::string& solver) {
      return median(fmt::format("limit_iteration<{}>/n:{}", solver, n), "cpu_time");
    };
    const double projection = iteration("FastProjection");
    note(fmt::format("an iteration of eq. (27), condensed, {0} x {0}", n),
         fmt::format("{:.2f} ms", 1e3 * iteration("LagrangeNewton")),
         fmt::format("one of the projection takes {:.3f} ms", 1e3 * projection));
    if (n < 100)
      note(fmt::format("  as the paper writes it, {0} x {0}", n),
           fmt::format("{:.2f} ms", 1e3 * median(fmt::format("eq_27_as_written/n:{}", n), "cpu_time")),
           "sparse LU, without assembly and analysis");
  }
  for (const int n : {4, 6, 8, 10, 12}) {
    const auto factor = [&](const char* kind) {
      return median(fmt::format("small_factor_{}/n:{}", kind, n), "cpu_time");
    };
    const double ours = factor("ours"), best = std::min(factor("simplicial"), factor("dense"));
    row(fmt::format("refactor and solve, {:.0f} rows", median(fmt::format("small_factor_ours/n:{}", n), "rows")),
        fmt::format("{:.1f} us", 1e6 * ours), fmt::format("<= {:.1f} us", 1e6 * best), ours <= best,
        "1 core; the better of Eigen's simplicial and dense factors");
  }
}

void kidnapped(const std::string& samples) {
  constexpr double frame_target = 2e-3, place_target = 5e-3;
  const auto costs = kidnapped_by_step(samples, {8, 12, 16, 24, 32, 48, 64, 128, 256, 1024});
  const std::string how = "1 core; 10 x 10, p = 2, 2 x 2 Gauss points a cell; without building, bound, writing";
  const DrapeCost* chosen = nullptr;
  for (const DrapeCost& cost : costs) {
    note(
        fmt::format("example 4.1(a), dt = 1/{} s", 30 * cost.steps_per_frame),
        cost.finished ? fmt::format("{:.2f} ms a frame", 1e3 * cost.per_frame) : "no such step",
        cost.finished ? fmt::format("free corner {:.2f} mm from that of the smallest step", 1e3 * cost.to_finest) : "");
    if (!chosen && cost.finished && cost.to_finest <= place_target) chosen = &cost;
  }
  if (!chosen) throw std::runtime_error("no step of example 4.1(a) ends");
  row(fmt::format("  largest step within 5 mm: dt = 1/{} s", 30 * chosen->steps_per_frame),
      fmt::format("{:.2f} ms a frame", 1e3 * chosen->per_frame), "<= 2 ms at <= 5 mm",
      chosen->per_frame <= frame_target, how);
}

void growth(const std::string& samples) {
  constexpr double linear = 1.1;  // an exponent that still counts as linear, with the caches' steps in it
  std::vector<double> size, motion, projection, solution, factorisation;
  for (const int n : {10, 32, 100, 316}) {
    const StepCost cost = step_cost(samples, n);
    size.push_back(cost.control_points);
    motion.push_back(cost.motion);
    projection.push_back(cost.projection);
    solution.push_back(cost.solution);
    factorisation.push_back(cost.factorisation);
    note(fmt::format("one step, {} control points", cost.control_points), fmt::format("{:.4f} ms", 1e3 * cost.motion),
         fmt::format("without projection; a projection iteration {:.4f} ms, solving by its factor {:.4f} ms ({:.0f} "
                     "nonzeros a row), factorisation {:.4f} ms",
                     1e3 * cost.projection, 1e3 * cost.solution, cost.fill, 1e3 * cost.factorisation));
  }
  const auto grows = [&](const std::string& what, const std::vector<double>& cost, bool judged) {
    const double power = exponent(size, cost);
    std::string steps;
    for (std::size_t k = 0; k + 1 < size.size(); ++k)
      steps += fmt::format(" {:.2f}", exponent({size[k], size[k + 1]}, {cost[k], cost[k + 1]}));
    row("  " + what, fmt::format("n^{:.2f}", power), judged ? "<= n^1.1" : "", power <= linear,
        "1 core; fitted over 10^2 to 10^5 control points; from size to size" + steps);
  };
  grows("step without projection", motion, true);
  grows("projection without its linear system", projection, true);
  grows("solving by the factor", solution, false);
  grows("factorisation", factorisation, false);
}

constexpr int pairs = 7;  // one after the other, as a shared machine has fast and slow minutes

void threads(const std::string& samples) {
  constexpr double least_gain = 1.6;
  for (const int n : {50, 100, 316}) {
    std::vector<double> motion, projection, solution, factorisation, outside;
    int control_points = 0;
    for (int k = 0; k < pairs; ++k) {
      const StepCost one = step_cost(samples, n, 1), two = step_cost(samples, n, 2);
      control_points = one.control_points;
      motion.push_back(one.motion / two.motion);
      projection.push_back(one.projection / two.projection);
      solution.push_back(one.solution / two.solution);
      factorisation.push_back(one.factorisation / two.factorisation);
      outside.push_back((one.motion + one.projection + one.solution) / (two.motion + two.projection + two.solution));
    }
    row(fmt::format("two cores over one, step of {} control points", control_points),
        fmt::format("{:.2f}", median(outside)), ">= 1.6", median(outside) >= least_gain,
        fmt::format(
            "without factorisation, median of {} pairs; motion {:.2f}, projection {:.2f}, solving by the factor "
            "{:.2f}, factorisation {:.2f}",
            pairs, median(motion), median(projection), median(solution), median(factorisation)));
  }
}

// Threads that wait for each other lose where others want the cores too: by the wall time and CPU time of whole runs.
void threads_among_others(const std::string& samples) {
  constexpr double least = 0.9;
  const BusyCores others;
  for (const int n : {50, 100}) {
    std::vector<double> wall, cpu;
    for (int k = 0; k < pairs; ++k) {
      const RunCost one = run_cost(samples, n, 1), two = run_cost(samples, n, 2);
      wall.push_back(one.wall / two.wall);
      cpu.push_back(two.cpu / one.cpu);
    }
    row(fmt::format("two threads over one, busy cores, {} control points", n * n), fmt::format("{:.2f}", median(wall)),
        ">= 0.9", median(wall) >= least,
        fmt::format("speed of steps beside a busy process on every core, median of {} pairs; CPU time {:.2f}", pairs,
                    median(cpu)));
  }
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 3) {
    std::fprintf(stderr, "usage: bench_report SAMPLES BENCHMARKS.json...\n");
    return 2;
  }
  try {
    Medians median;
    for (int k = 2; k < count; ++k) median.read(arguments[k]);
    fmt::print("{:<50} {:>16}  {:<22} {:<7} {}\n", "what", "measured", "target", "", "how");
    functions(median);
    limits(median);
    bounds(median);
    kidnapped(arguments[1]);
    growth(arguments[1]);
    threads(arguments[1]);
    threads_among_others(arguments[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
