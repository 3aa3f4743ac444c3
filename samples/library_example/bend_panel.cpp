// SPDX-License-Identifier: GPL-3.0-or-later
// Toile as a library: read a panel, look at its trim, roll its control net onto a cylinder, write it back trimmed.
#include <cmath>
#include <cstdio>

#include "toile/geometry/error.h"
#include "toile/io/file.h"
#include "toile/io/iges.h"
#include "toile/trimming/constraint_points.h"
#include "toile/trimming/loops.h"
#include "toile/trimming/quadrature.h"

int main(int argc, char** argv) try {
  if (argc < 3) return std::fputs("usage: bend_panel IN.igs OUT.igs\n", stderr), 2;
  const toile::PanelFile file = toile::read_iges(argv[1]);
  toile::TrimmedSurface panel = file.panels.at(0);
  toile::validate_loops(panel);
  const toile::TrimTopology topology = toile::trace_trims(panel);
  const double area = toile::measure(panel, topology).area * file.metres_per_unit * file.metres_per_unit;
  std::printf("%s: %.4f m2, %zu constraint points\n", panel.name.c_str(), area,
              toile::constraint_points(panel, topology).size());

  Eigen::Matrix3Xd net = panel.surface.points();
  const double radius = 0.5 / file.metres_per_unit;  // half a metre, in the file's unit
  for (auto point : net.colwise())
    point = Eigen::Vector3d(radius * std::sin(point.x() / radius), point.y(), radius * std::cos(point.x() / radius));
  panel.surface = panel.surface.with_points(net);
  const toile::OutputFace face{panel, panel.name + " rolled", 0, std::nullopt};
  toile::write_file(argv[2], toile::format_iges(std::span(&face, 1), {.unit = file.unit}).text);
} catch (const toile::Error& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 1;
}
