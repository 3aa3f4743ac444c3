// SPDX-License-Identifier: GPL-3.0-or-later
// Toile as a library: read a panel, look at its trim, hang it from pins, write it back draped and trimmed.
#include "toile/pipeline/run/drape_panel.h"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "toile/geometry/error.h"
#include "toile/io/file.h"
#include "toile/io/iges.h"
#include "toile/trimming/constraint_points.h"
#include "toile/trimming/quadrature.h"

int main(int argc, char** argv) try {
  if (argc < 4) return std::fputs("usage: drape_panel IN.igs OUT.igs PIN...\n", stderr), 2;
  const toile::PanelFile file = toile::read_iges(argv[1]);
  const toile::TrimmedSurface& panel = file.panels.at(0);
  const double area = toile::quadrature(panel).area * file.metres_per_unit * file.metres_per_unit;
  std::printf("%s: %.4f m2, %zu constraint points\n", panel.name.c_str(), area, toile::constraint_points(panel).size());

  const std::vector<std::string> pins(argv + 3, argv + argc);
  const toile::TrimmedSurface draped = toile::drape(panel, pins, {.span = 0.06});
  // Points of the cloth and its border: control points lie off it, and where there is no cloth anywhere.
  double lowest = std::numeric_limits<double>::infinity();
  for (const toile::ConstraintPoint& at : toile::constraint_points(draped))
    lowest = std::min(lowest, draped.surface(at.u, at.v).z());
  std::printf("hangs down to z = %.3f m\n", file.metres_per_unit * lowest);

  const toile::OutputFace face{draped, panel.name + " draped", 0, std::nullopt};
  toile::write_file(argv[2], toile::format_iges(std::span(&face, 1), {.unit = file.unit}).text);
} catch (const toile::Error& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 1;
}
