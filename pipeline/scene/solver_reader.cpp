// SPDX-License-Identifier: GPL-3.0-or-later
// [strain_limit] and [solver].
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "analysis/scheme/implicit.h"
#include "geometry/error.h"
#include "pipeline/scene/readers.h"

namespace toile {
namespace {

LimitSolver read_limit_solver(Table& table) {
  const std::string variant = table.choice("variant", {"newton", "paper", "second-order"}, {}).value_or("newton");
  // "fast" is another word for the projection.
  const std::string solver =
      table.choice("solver", {"projection", "fast", "substeps", "lagrange"}, {"springs"}).value_or("projection");
  if (solver == "substeps") {
    table.refuse("variant", "variant belongs to solver = \"projection\"");
    return LimitSolver::substeps;
  }
  if (solver == "lagrange") {
    for (const char* key : {"stiffness", "variant"})
      table.refuse(
          key,
          fmt::format("{} belongs to solver = \"projection\"; \"lagrange\" holds the limit as hard equalities", key));
    return LimitSolver::lagrange;
  }
  return variant == "paper" ? LimitSolver::paper : LimitSolver::newton;
}

}  // namespace

// "mode": inextensible resists from the first strain on and stays within the tolerance; band lets cloth strain freely
// to 90 % of the limits, each direction and sign its own.
void read_limit(Table table, Scene& scene) {
  constexpr double band_slack = 0.9, band_tolerance = 0.01;  // of the limits
  StrainLimit& limit = scene.strain_limit;
  const auto mode = table.choice("mode", {"inextensible", "band", "off"}, {});
  limit.on = !mode || *mode != "off";
  const bool band = mode && *mode == "band";
  table.number(limit.tolerance, "tolerance", dimension::none, Range::positive);
  constexpr double free = 0.5;  // C = -1/2 is a thread of no length
  if (limit.tolerance > free)
    table.fail(
        *table.raw().get("tolerance"),
        fmt::format("tolerance in [strain_limit] is {}, must be at most {}: a strain of -{} is a thread of no length",
                    limit.tolerance, free, free));
  limit.weft = limit.warp = {limit.tolerance, limit.tolerance};
  if (band) {
    const auto stretch = table.vector<2>("stretch", dimension::none),
               compress = table.vector<2>("compress", dimension::none);
    if (!stretch && !compress)
      throw InputError(table.where() +
                       ": mode = \"band\" needs stretch = [weft, warp], compress = [weft, warp], or both");
    limit.stretched = stretch.has_value();
    for (int k : {0, 1}) {
      StrainBand& b = k == 0 ? limit.weft : limit.warp;
      b = {stretch ? (*stretch)[k] : 1e3, compress ? (*compress)[k] : free, band_slack};
      if (!(b.stretch > 0 && b.compress > 0))
        throw InputError(table.where() +
                         ": stretch and compress are strains above 0 in weft and warp, such as [0.05, 0.02]");
      if (b.compress > free)
        throw InputError(fmt::format("{}: compress is {}, must be at most {}: a strain of -{} is a thread of no length",
                                     table.where(), b.compress, free, free));
    }
    if (!table.find("tolerance"))
      limit.tolerance =
          band_tolerance * std::min({limit.weft.stretch, limit.weft.compress, limit.warp.stretch, limit.warp.compress});
  } else {
    for (const char* key : {"stretch", "compress"})
      table.refuse(key, fmt::format("{} belongs to mode = \"band\"", key));
  }
  if (table.find("stiffness")) {
    double stiffness = 0;
    table.number(stiffness, "stiffness", dimension::force_per_length, Range::positive);
    limit.stiffness = stiffness;
  }
  limit.solver = read_limit_solver(table);
  if (band && hard(limit.solver))
    throw InputError(fmt::format("{}: {} has no bands", table.where(), setting_of(limit.solver)));
  table.number(limit.percentile, "percentile", dimension::none, Range::positive);
  if (limit.percentile > 100)
    table.fail(*table.raw().get("percentile"),
               fmt::format("percentile in [strain_limit] is {}, must be at most 100", limit.percentile));
  if (limit.solver != LimitSolver::substeps)
    table.refuse("percentile", "percentile belongs to solver = \"substeps\"; the others limit every constraint point");
  std::vector<std::string> rules;
  for (const NamedRule& rule : point_rules()) rules.emplace_back(rule.name);
  if (const auto points = table.choice("points", rules, {})) limit.points = *point_rule(*points);
  table.number(limit.regularisation, "regularisation", dimension::none, Range::nonnegative);
  if (const auto n = table.integer("max_iterations", 1, 10000)) limit.max_iterations = *n;
  table.done();
}

void read_solver(Table table, Scene& scene) {
  table.choice("model", {"shell"}, {"hinge", "solid", "spring", "fem"});
  std::vector<std::string> names;
  for (const NamedScheme& scheme : time_schemes()) names.emplace_back(scheme.name);
  if (const auto word = table.choice("scheme", names, {}))
    scene.scheme = time_schemes()[static_cast<std::size_t>(std::ranges::find(names, *word) - names.begin())].scheme;
  if (const toml::node* node = table.find("dt")) {
    if (!(node->is_string() && *node->value<std::string>() == "auto")) {
      scene.dt = table.quantity(*node, "dt in [solver]", dimension::time, Range::positive);
    }
  }
  if (const toml::node* node = table.find("until")) {
    if (node->is_string() && *node->value<std::string>() == "rest") {
      scene.rest.emplace();
      scene.until = std::numeric_limits<double>::infinity();
    } else {
      scene.until = table.quantity(*node, "until in [solver]", dimension::time, Range::positive);
    }
  }
  if (auto rest = table.table("rest", "rest in [solver]")) {
    if (!scene.rest) table.fail(*table.raw().get("rest"), "rest in [solver] belongs to until = \"rest\"");
    if (const auto method = rest->choice("method", {"relaxation", "newton"}, {}))
      scene.rest->method = *method == "newton" ? RestMethod::newton : RestMethod::relaxation;
    scene.rest->tolerance = rest->number("tolerance", dimension::length, Range::positive);
    if (const auto n = rest->integer("max_steps", 1, 1000000000)) scene.rest->max_steps = *n;
    scene.rest->load_steps = rest->integer("load_steps", 1, 1000000);
    scene.rest->arc_length = rest->boolean("arc_length").value_or(false);
    if (scene.rest->arc_length && !scene.rest->load_steps) scene.rest->load_steps = 10;
    for (const char* key : {"load_steps", "arc_length"}) {
      const toml::node* node = rest->raw().get(key);
      if (!node) continue;
      if (scene.rest->method != RestMethod::newton)
        rest->fail(*node, fmt::format("{} in rest belongs to method = \"newton\"", key));
      if (scene.strain_limit.on)
        rest->fail(*node,
                   fmt::format("{} in rest knows no strain limit in this version: strain_limit.mode = \"off\"", key));
      for (const ScenePin& pin : scene.pins)
        if (pin.move || pin.release)
          rest->fail(*node,
                     fmt::format("{} in rest: {} moves or is released, which load steps can't follow", key, pin.where));
    }
    rest->done();
  }
  if (implicit(scene) && scene.strain_limit.on && !has_law(scene.strain_limit.solver))
    throw InputError(table.where() +
                     ": implicit schemes and equilibrium by Newton's method take the strain limit as a law: solver = "
                     "\"projection\", variant = \"newton\" in [strain_limit]");
  table.number(scene.energy_gain, "energy_gain", dimension::none, Range::positive);
  scene.time_limit = table.number("time_limit", dimension::time, Range::positive);
  table.done();
}

// The tables that don't depend on the panels' own tables.
const char* name(LimitSolver solver) {
  switch (solver) {
    case LimitSolver::newton:
    case LimitSolver::paper:
      return "projection";
    case LimitSolver::substeps:
      return "substeps";
    case LimitSolver::lagrange:
      return "lagrange";
  }
  return "";
}

const char* setting_of(LimitSolver solver) {
  switch (solver) {
    case LimitSolver::newton:
      return "solver = \"projection\"";
    case LimitSolver::substeps:
      return "solver = \"substeps\"";
    case LimitSolver::paper:
      return "variant = \"paper\"";
    case LimitSolver::lagrange:
      return "solver = \"lagrange\"";
  }
  return "";
}

bool hard(LimitSolver solver) {
  return solver == LimitSolver::paper || solver == LimitSolver::lagrange;
}

bool has_law(LimitSolver solver) {
  return solver == LimitSolver::newton;
}

bool implicit(const Scene& scene) {
  return named_scheme(scene.scheme).rule || (scene.rest && scene.rest->method == RestMethod::newton);
}

std::span<const NamedScheme> time_schemes() {
  static constexpr NamedScheme schemes[] = {
      {TimeScheme::verlet, "verlet", std::nullopt},
      {TimeScheme::backward_euler, "backward-euler", ImplicitRule::backward_euler},
      {TimeScheme::bdf2, "bdf2", ImplicitRule::bdf2},
      {TimeScheme::newmark, "newmark", ImplicitRule::newmark},
  };
  return schemes;
}

const NamedScheme& named_scheme(TimeScheme scheme) {
  return time_schemes()[static_cast<std::size_t>(scheme)];
}

}  // namespace toile
