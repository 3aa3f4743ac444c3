// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/build/contact.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace toile {
namespace {

constexpr double fold_radius = 0.05;   // m, of folds that the chord is stated for
constexpr double most_divisions = 16;  // of a span

// Of a span in each direction: the longest [m], and its parts so that points are no farther apart than `spacing`, if
// that is not too fine.
struct Division {
  double longest = 0;
  int parts = 1;
  double reached() const { return longest / parts; }
};
Division division(const NurbsSurface& rest, Direction d, double spacing) {
  const KnotVector &along = rest.knots(d), &across = rest.knots(d == Direction::u ? Direction::v : Direction::u);
  const std::vector<double> breaks = along.breaks();
  Division out;
  for (const double c : across.breaks())
    for (std::size_t k = 0; k + 1 < breaks.size(); ++k) {
      const auto at = [&](double t) { return d == Direction::u ? rest(t, c) : rest(c, t); };
      out.longest = std::max(out.longest, (at(breaks[k + 1]) - at(breaks[k])).norm());
    }
  out.parts = static_cast<int>(std::clamp(std::ceil(out.longest / spacing - 1e-6), 1.0, most_divisions));
  return out;
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

std::vector<ProxyPanel> contact_proxies(const Build& build, std::vector<std::string>& warnings,
                                        std::vector<std::string>& notes) {
  const SceneContact& contact = build.scene.contact;
  const double spacing = contact.spacing.value_or(std::sqrt(8 * contact.chord * fold_radius));
  std::vector<ProxyPanel> out;
  std::size_t points = 0;
  double widest = 0;
  for (std::size_t k = 0; k < build.panels.size(); ++k) {
    const BuiltPanel& panel = build.panels[k];
    const NurbsSurface& rest = build.rest(static_cast<int>(k));
    const Fabric& fabric = build.model->panels()[k].fabric;
    const Division u = division(rest, Direction::u, spacing), v = division(rest, Direction::v, spacing);
    const double reached = std::max(u.reached(), v.reached());
    widest = std::max(widest, reached);
    if (reached > spacing * (1 + 1e-6))
      warnings.push_back(fmt::format(
          "{}: panel '{}': contact samples the cloth every {:.3g} mm, not every {:.3g} mm: its spans are too long for "
          "that; a smaller span (refine) helps",
          build.scene.panels[k].where, panel.name, 1e3 * reached, 1e3 * spacing));
    out.push_back(
        {triangulate_cells(panel.face, panel.topology, {u.parts, v.parts}), fabric.thickness / 2, fabric.friction});
    points += out.back().mesh.uv.size();
  }
  notes.push_back(
      fmt::format("contact: {} points of the cloth, {:.3g} mm apart at most along its net", points, 1e3 * widest));
  return out;
}

std::unique_ptr<ContactProjection> with_contact(const Build& build, bool sewn, const AffineMap& map,
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
  if (!sewn && !scene.sewing.friction) {
    options.search.friction.setZero();
    options.search.friction_of_panels.setZero();
  }
  options.search.charts = build.charts;
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
