// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers of a state whose values are known.
#include "pipeline/run/measures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "pipeline/panels.h"

namespace toile {
namespace {

using test::Folder;

// Rows see a uniform strain as it is, along both threads at once.
TEST(Measures, AUniformStrainHidesNoEnergyWhateverTheFabric) {
  const Folder folder("unseen");
  test::write_panels(folder / "panel.igs", {test::sheet("cloth")});
  for (const char* law : {"", "law='isotropic',youngs_modulus=1e4,poissons_ratio=0.4,"}) {
    const std::vector<std::string> settings = {std::string("fabric.sheet={") + law + "thickness=0.001}",
                                               "panel.0.fabric=sheet", "pin=[{at='corner:0,0'}]"};
    const Build b = build(parse_scene(test::scene_text(""), folder / "scene.toml", settings));
    const std::unique_ptr<System> system = assemble(b, 0);
    Eigen::VectorXd q = b.start;
    for (Eigen::Index k = 0; k < q.size(); k += 3) q[k] *= 1.006, q[k + 1] *= 1.004;
    const DynamicState state = state_from(*system, q, Eigen::VectorXd::Zero(q.size()), 0);
    Eigen::VectorXd force(q.size());
    const double stored = internal_force(system->dynamic.potentials, q, force).total();
    EXPECT_LT(std::abs(measure(b, *system, state, 1e-3).unseen_energy), 1e-9 * stored) << law;
  }
}

}  // namespace
}  // namespace toile
