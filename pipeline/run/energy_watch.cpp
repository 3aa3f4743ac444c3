// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/run/energy_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace toile {
namespace {

// Of the energy exchanged: in a step, in all, and since a step was last refused.
constexpr double step_rise = 0.05, total_rise = 0.2, small_rise = 0.005;

}  // namespace

std::string why_refused(EnergyWatch& watch, const EnergyBalance& before, const StepReport& report, double dt_before,
                        bool careful) {
  if (!report.finite) return "the numbers are no longer finite";
  const EnergyBalance& e = before;
  const double elastic = report.elastic.total() + report.limit_energy;
  const double now =
      report.at_end ? report.kinetic_end - report.kick_end + elastic : report.kinetic + 0.5 * (e.elastic() + elastic);
  const double work = e.load_work + e.drag_work + e.motion_work +
                      (report.at_end ? 1 : 0.5) * (report.load_work + report.drag_work + report.motion_work);
  const double balance = now - e.start - work;
  const double exchanged = std::max({watch.exchanged, std::abs(e.load_work + report.load_work),
                                     std::abs(e.motion_work + report.motion_work), std::abs(e.drag_work), e.now()});
  const double smaller_step = report.dt < (1 - 1e-9) * dt_before ? watch.kick : 0;
  const double rise = balance - (careful ? watch.trough : watch.balance);
  if (rise > (careful ? small_rise : step_rise) * exchanged + smaller_step + watch.rounding) {
    return fmt::format("energy grew by {:.3g} J with no matching work ({:.3g} J exchanged so far)", rise, exchanged);
  }
  // What the end of the step holds can't exceed the budget either.
  const double stored = report.kinetic_end + elastic - e.start - e.load_work - e.drag_work - e.motion_work -
                        report.load_work - report.drag_work - report.motion_work;
  if (std::max(balance, stored) > total_rise * exchanged + watch.rounding) {
    return fmt::format("energy has grown by {:.3g} J with no matching work ({:.3g} J exchanged so far)",
                       std::max(balance, stored), exchanged);
  }
  watch.exchanged = exchanged;
  watch.kick = report.at_end ? report.kick_end : report.kick;
  // What a smaller step seems to gain is no rise.
  watch.trough += std::clamp(balance - watch.balance, 0.0, smaller_step);
  watch.trough = careful ? std::min(watch.trough, balance) : balance;
  watch.balance = balance;
  return {};
}

void add_step(EnergyBalance& energy, const StepReport& report, const EnergyWatch& watch) {
  energy.kinetic = report.at_end ? report.kinetic_end : report.kinetic;
  energy.stored = report.elastic.energy;
  energy.stored.set("limit", report.limit_energy);
  energy.load_work += report.load_work;
  energy.drag_work += report.drag_work;
  energy.motion_work += report.motion_work;
  energy.injected = std::max(energy.injected, watch.balance);
}

double rounding_energy(const MechanicalSystem& system, const Eigen::VectorXd& q, double dt) {
  constexpr double epsilon = std::numeric_limits<double>::epsilon();
  const double speed = q.lpNorm<Eigen::Infinity>() * (1e-8 + (dt > 0 ? 64 * epsilon / dt : 0));
  return 0.5 * system.node_mass.sum() * speed * speed;
}

}  // namespace toile
