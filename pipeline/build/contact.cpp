// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/build/contact.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace toile {
namespace {

constexpr double fold_radius = 0.05;  // m, of folds that the chord is stated for
constexpr int most_divisions = 16;

// Parts of the longest span in each direction, so that points are no farther apart than `spacing`.
std::pair<int, int> divisions(const NurbsSurface& rest, double spacing) {
  const auto parts = [&](const KnotVector& along, const KnotVector& across, bool u) {
    double longest = 0;
    const std::vector<double> breaks = along.breaks();
    for (const double c : across.breaks())
      for (std::size_t k = 0; k + 1 < breaks.size(); ++k) {
        const auto at = [&](double t) { return u ? rest(t, c) : rest(c, t); };
        longest = std::max(longest, (at(breaks[k + 1]) - at(breaks[k])).norm());
      }
    return std::clamp(static_cast<int>(std::ceil(longest / spacing - 1e-6)), 1, most_divisions);
  };
  return {parts(rest.u(), rest.v(), true), parts(rest.v(), rest.u(), false)};
}

// Of obstacles their own, of two panels the mean of theirs; of named pairs what the scene says.
void set_friction(const Build& build, ContactSearchOptions& options) {
  const auto panels = static_cast<Eigen::Index>(build.panels.size()),
             obstacles = static_cast<Eigen::Index>(build.obstacles.size());
  const auto own = [&](Eigen::Index k) { return build.proxies[static_cast<std::size_t>(k)].friction; };
  const auto panel = [&](Eigen::Index k) { return build.panels[static_cast<std::size_t>(k)].name; };
  const auto obstacle = [&](Eigen::Index k) { return build.obstacles[static_cast<std::size_t>(k)]->name(); };
  const auto of_pair = [&](const std::string& a, const std::string& b, double usual) {
    for (const SceneContactPair& pair : build.scene.contact_pairs)
      if ((pair.a == a && pair.b == b) || (pair.a == b && pair.b == a)) return pair.friction;
    return usual;
  };
  options.friction.resize(panels, obstacles);
  options.friction_of_panels.resize(panels, panels);
  for (Eigen::Index k = 0; k < panels; ++k) {
    for (Eigen::Index o = 0; o < obstacles; ++o)
      options.friction(k, o) = of_pair(panel(k), obstacle(o), build.obstacles[static_cast<std::size_t>(o)]->friction());
    for (Eigen::Index l = 0; l < panels; ++l)
      options.friction_of_panels(k, l) = of_pair(panel(k), panel(l), 0.5 * (own(k) + own(l)));
  }
}

}  // namespace

std::vector<ProxyPanel> contact_proxies(const Build& build, std::vector<std::string>& notes) {
  const SceneContact& contact = build.scene.contact;
  const double spacing = contact.spacing.value_or(std::sqrt(8 * contact.chord * fold_radius));
  std::vector<ProxyPanel> out;
  std::size_t points = 0;
  for (std::size_t k = 0; k < build.panels.size(); ++k) {
    const BuiltPanel& panel = build.panels[k];
    const Fabric& fabric = build.model->panels()[k].fabric;
    const auto parts = divisions(build.rest(static_cast<int>(k)), spacing);
    out.push_back({triangulate_cells(panel.face, panel.topology, parts), fabric.thickness / 2, fabric.friction});
    points += out.back().mesh.uv.size();
  }
  notes.push_back(fmt::format("contact: {} points of the cloth, {:.3g} mm apart at most", points, 1e3 * spacing));
  return out;
}

std::unique_ptr<ContactProjection> with_contact(const Build& build, const AffineMap& map,
                                                const Eigen::VectorXd& node_mass, const Eigen::VectorXd& node_drag,
                                                std::unique_ptr<ConstraintSolver> inner) {
  const Scene& scene = build.scene;
  ContactOptions options;
  options.push_out = scene.contact.push_out;
  // Without gravity forces are small beside those of a metre a second squared.
  options.acceleration = std::max(scene.gravity.norm(), 1.0);
  options.search.self = scene.contact.self;
  options.search.largest_chord = 2 * scene.contact.chord;
  set_friction(build, options.search);
  return std::make_unique<ContactProjection>(*build.model, map, node_mass, node_drag, build.proxies, build.obstacles,
                                             std::move(inner), options);
}

std::string describe_contact(const Build& build, const ContactProxy& proxy, const ContactRow& row) {
  const int vertex = row.vertices.front().first;
  const Eigen::Vector2d& uv = proxy.uv(vertex);
  const std::string place =
      fmt::format("panel '{}' at (u, v) = ({:.6g}, {:.6g})",
                  build.panels[static_cast<std::size_t>(proxy.panel(vertex))].name, uv.x(), uv.y());
  if (row.key[3] >= 0)
    return fmt::format("{} and obstacle '{}'", place, build.obstacles[static_cast<std::size_t>(row.key[3])]->name());
  const int other = row.vertices.back().first;
  return fmt::format("{} and panel '{}' at ({:.6g}, {:.6g})", place,
                     build.panels[static_cast<std::size_t>(proxy.panel(other))].name, proxy.uv(other).x(),
                     proxy.uv(other).y());
}

}  // namespace toile
