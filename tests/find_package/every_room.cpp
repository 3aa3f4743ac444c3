// SPDX-License-Identifier: GPL-3.0-or-later
// every_room SCENE.toml: runs a scene for a moment through the installed libraries; the linker needs every one.
#include <cstdio>

#include "toile/geometry/error.h"
#include "toile/pipeline/run/run.h"

int main(int argc, char** argv) try {
  if (argc != 2) return 2;
  const std::string settings[] = {"solver.until=0.05"};
  const toile::Build build = toile::build(toile::read_scene(argv[1], settings));
  const toile::RunResult result = toile::run(build);
  std::printf("%d steps: %s\n", result.steps, toile::name(result.exit));
  return result.steps > 0 && result.exit == toile::RunExit::ok ? 0 : 1;
} catch (const toile::Error& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 1;
}
