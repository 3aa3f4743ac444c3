// SPDX-License-Identifier: GPL-3.0-or-later
// Contact of a scene: the sampled panels, and the solver around the other constraints.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "analysis/contact/contact_projection.h"
#include "pipeline/build/build.h"

namespace toile {

// Sampled by [contact] spacing or chord; what is to be said is added to `warnings` and `notes`.
std::vector<ProxyPanel> contact_proxies(const Build& build, std::vector<std::string>& warnings,
                                        std::vector<std::string>& notes);

// `sewn`: the seams are closed; before that without friction, unless the scene wants it. `inner`: the other
// constraints, null for none. The result refers to `build` and `map`, which must outlive it.
std::unique_ptr<ContactProjection> with_contact(const Build& build, bool sewn, const AffineMap& map,
                                                const Eigen::VectorXd& node_mass, const Eigen::VectorXd& node_drag,
                                                std::unique_ptr<ConstraintSolver> inner);

// "panel 'front' at (u, v) = (0.2, 0.4) and obstacle 'body'".
std::string describe_contact(const Build& build, const ContactProxy& proxy, const ContactRow& row);

}  // namespace toile
