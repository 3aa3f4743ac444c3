// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/run/drape_panel.h"

#include <fmt/format.h>

#include <memory>

#include "analysis/parallel/workers.h"
#include "geometry/error.h"
#include "pipeline/run/run.h"

namespace toile {

TrimmedSurface drape(const TrimmedSurface& panel, const std::vector<std::string>& pins, const PanelDrape& how) {
  QuickScene request;
  request.file = panel.name.empty() ? "panel" : panel.name;
  request.pins = pins;
  request.degree = how.degree;
  request.span = how.span;
  request.fabric = how.fabric;
  ReadFile read;
  read.file.path = request.file.string();
  read.file.metres_per_unit = panel.metres_per_unit;
  read.file.panels = {panel};
  std::vector<std::string> settings{how.until ? fmt::format("solver.until={}", *how.until) : "solver.until=\"rest\""};
  settings.insert(settings.end(), how.settings.begin(), how.settings.end());
  const Build built = build(quick_scene(request, std::make_shared<const ReadFile>(std::move(read)), settings));

  Workers workers(how.threads);
  RunHooks hooks;
  if (how.threads > 1) hooks.workers = &workers;
  const RunResult end = run(built, hooks);
  if (end.exit != RunExit::ok) throw SolverError(end.reason);
  TrimmedSurface draped = built.panels[0].face;
  draped.surface =
      draped.surface.with_points(built.net(0, control_points(*end.system, end.state)) / panel.metres_per_unit);
  return draped;
}

}  // namespace toile
