// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/build/seams.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "geometry/error.h"
#include "pipeline/build/build.h"
#include "pipeline/build/places.h"

namespace toile {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int least_places = 200;
constexpr double least_gap = 1e-9;  // m, that takes time to close
constexpr double near_gap = 5e-3;   // m, that rows close without springs

// A side with its panel.
struct Side {
  int panel;
  CurveChain chain;
  bool reverse;

  Vector2d at(double fraction) const { return chain.at(reverse ? 1 - fraction : fraction); }
  double cells(double fraction) const {  // per fraction
    return chain.length() * chain.cells_per_metre(reverse ? 1 - fraction : fraction);
  }
};

Side side_of(const Build& build, const SeamSide& side, const std::string& who) {
  const int k = build.panel(side.panel);
  const BuiltPanel& panel = build.panels[static_cast<std::size_t>(k)];
  const Eigen::Matrix3Xd start = build.net(k, build.start);
  const PanelPlaces places{panel.name, panel.face, panel.topology, build.rest(k), start, panel.carries_cloth};
  return {k, CurveChain(side.loop, side.curves, side.from, side.to, places, who), side.reverse};
}

std::string name_of(const SeamSide& side) {
  return fmt::format("panel '{}', {} {} of loop {}", side.panel, side.curves.size() == 1 ? "curve" : "curves",
                     fmt::join(side.curves, ", "), side.loop);
}

ScalarRow difference(const ScalarRow& a, const ScalarRow& b) {
  ScalarRow out = a;
  for (std::size_t k = 0; k < b.index.size(); ++k) {
    const auto found = std::ranges::find(out.index, b.index[k]);
    if (found != out.index.end()) {
      out.value[static_cast<std::size_t>(found - out.index.begin())] -= b.value[k];
    } else {
      out.index.push_back(b.index[k]);
      out.value.push_back(-b.value[k]);
    }
  }
  return out;
}

// Fractions 0 to 1 that are even in spans of the side that is coarser there, one a span.
std::vector<double> even_fractions(const Side& a, const Side& b, int least) {
  constexpr int parts = 256;
  std::vector<double> sum{0};
  for (int k = 0; k < parts; ++k) {
    const double middle = (k + 0.5) / parts;
    sum.push_back(sum.back() + std::min(a.cells(middle), b.cells(middle)) / parts);
  }
  const int n = std::max(least, static_cast<int>(std::lround(sum.back())));
  std::vector<double> out{0};
  std::size_t part = 0;
  for (int k = 1; k < n; ++k) {
    const double wanted = sum.back() * k / n;
    while (sum[part + 1] < wanted) ++part;
    out.push_back((static_cast<double>(part) + (wanted - sum[part]) / (sum[part + 1] - sum[part])) / parts);
  }
  out.push_back(1);
  return out;
}

// Fractions of a side at the Greville abscissae of the edge of the domain that it runs along, both ends included: as
// many as the edge has coefficients there. Nothing where it runs elsewhere.
std::vector<double> edge_fractions(const Side& side, const NurbsSurface& rest) {
  constexpr int parts = 64;
  std::vector<Vector2d> at;
  for (int k = 0; k <= parts; ++k) at.push_back(side.at(static_cast<double>(k) / parts));
  for (const int axis : {0, 1}) {  // of what changes
    const Interval across = (axis == 0 ? rest.v() : rest.u()).domain();
    const double line = at[0][1 - axis];
    if (line != across.min && line != across.max) continue;
    if (std::ranges::any_of(at, [&](const Vector2d& p) { return p[1 - axis] != line; })) continue;
    const double start = at.front()[axis], end = at.back()[axis], way = end - start;
    std::vector<double> out{0};
    const KnotVector& knots = axis == 0 ? rest.u() : rest.v();
    std::vector<double> greville;
    for (int i = 0; i < knots.control_point_count(); ++i) greville.push_back(knots.greville(i));
    if (way < 0) std::ranges::reverse(greville);
    for (const double t : greville) {
      const double wanted = (t - start) / way;  // of the way in parameters
      if (!(wanted > 1e-6 && wanted < 1 - 1e-6)) continue;
      const auto reached = [&](double fraction) { return (side.at(fraction)[axis] - start) / way - wanted; };
      std::size_t k = 0;
      while ((at[k + 1][axis] - start) / way < wanted) ++k;
      double low = static_cast<double>(k) / parts, high = low + 1.0 / parts;
      for (int step = 0; step < 30; ++step) {
        const double middle = (low + high) / 2;
        (reached(middle) < 0 ? low : high) = middle;
      }
      out.push_back((low + high) / 2);
    }
    out.push_back(1);
    return out;
  }
  return {};
}

BuiltSeam build_seam(const Build& build, const SceneSeam& seam, const std::string& who) {
  const Side a = side_of(build, seam.a, who), b = side_of(build, seam.b, who);
  for (const auto& [side, named] : {std::pair(&a, &seam.a), std::pair(&b, &seam.b)})
    if (!(side->chain.length() > 0)) throw GeometryError(fmt::format("{}: {} has no length", who, name_of(*named)));
  BuiltSeam out;
  out.a = a.panel, out.b = b.panel;
  out.length_a = a.chain.length(), out.length_b = b.chain.length();
  const auto place = [&](double fraction) {
    SeamPlace p{fraction, a.at(fraction), b.at(fraction), {}};
    p.row = difference(build.model->place(out.a, p.a.x(), p.a.y()), build.model->place(out.b, p.b.x(), p.b.y()));
    return p;
  };
  int degree = 1;
  for (const int k : {out.a, out.b})
    degree = std::max({degree, build.rest(k).u().degree(), build.rest(k).v().degree()});
  std::vector<double> fractions = even_fractions(a, b, degree);
  const std::size_t even = fractions.size();
  const std::vector<double> on_a = edge_fractions(a, build.rest(out.a)), on_b = edge_fractions(b, build.rest(out.b));
  // An edge has degree - 1 coefficients more than knots.
  const auto coarser = [&](const std::vector<double>& edge) {
    return !edge.empty() && edge.size() <= even + static_cast<std::size_t>(degree - 1);
  };
  if (coarser(on_a) && (on_b.empty() || on_a.size() <= on_b.size()))
    fractions = on_a;
  else if (coarser(on_b))
    fractions = on_b;
  const double spacing = 1.0 / static_cast<double>(fractions.size() - 1);
  // Where an edge bends sharply a place on each side of the bend would miss it.
  std::vector<double> bends = a.chain.ends();
  for (double& s : bends) s = a.reverse ? 1 - s : s;
  for (const double s : b.chain.ends()) bends.push_back(b.reverse ? 1 - s : s);
  for (const double s : bends) {
    const auto near = std::ranges::min_element(fractions, {}, [&](double f) { return std::abs(f - s); });
    if (std::abs(*near - s) < 0.5 * spacing && *near > 0 && *near < 1)
      *near = s;
    else if (std::abs(*near - s) > 0.25 * spacing)
      fractions.insert(std::ranges::upper_bound(fractions, s), s);
  }
  std::vector<std::size_t> order{0, fractions.size() - 1};
  out.required = 2;
  for (std::size_t k = 1; k + 1 < fractions.size(); ++k) order.push_back(k);
  for (const std::size_t k : order) {
    out.rows.push_back(place(fractions[k]));
    const double before = k > 0 ? fractions[k - 1] : fractions[k],
                 after = k + 1 < fractions.size() ? fractions[k + 1] : fractions[k];
    out.weight.push_back(0.25 * (after - before) * (out.length_a + out.length_b));
  }
  const int places = std::max(least_places, 3 * static_cast<int>(fractions.size()));
  for (int k = 0; k <= places; ++k) {
    out.along.push_back(place(static_cast<double>(k) / places));
    out.gap = std::max(out.gap, apply(out.along.back().row, build.start).norm());
  }
  return out;
}

// Of a point from a line of points, and how far along the line its foot is [m].
struct Foot {
  double distance = HUGE_VAL, along = 0;
};
Foot foot_on(const std::vector<Vector3d>& line, const Vector3d& x) {
  Foot best;
  double before = 0;
  for (std::size_t k = 0; k + 1 < line.size(); ++k) {
    const Vector3d edge = line[k + 1] - line[k];
    const double length = edge.norm();
    const double share = length > 0 ? std::clamp(edge.dot(x - line[k]) / (length * length), 0.0, 1.0) : 0;
    const double distance = (line[k] + share * edge - x).norm();
    if (distance < best.distance) best = {distance, before + share * length};
    before += length;
  }
  return best;
}

}  // namespace

std::vector<BuiltSeam> build_seams(const Build& build, std::vector<std::string>& warnings) {
  std::vector<BuiltSeam> out;
  const Scene& scene = build.scene;
  for (std::size_t s = 0; s < scene.seams.size(); ++s) {
    const SceneSeam& seam = scene.seams[s];
    const std::string who = fmt::format("{}: seam {}", seam.where, s);
    out.push_back(build_seam(build, seam, who));
    const BuiltSeam& built = out.back();
    const auto [shorter, longer] = std::minmax(built.length_a, built.length_b);
    if (longer > 1.5 * shorter)
      warnings.push_back(fmt::format("{}: {} is {:.4g} m long, {} {:.4g} m: it is gathered {:.3g} to 1", who,
                                     name_of(seam.a), built.length_a, name_of(seam.b), built.length_b,
                                     longer / shorter));
  }
  return out;
}

namespace {

double widest_gap(const std::vector<BuiltSeam>& seams, const Eigen::VectorXd& q) {
  double widest = 0;
  for (const BuiltSeam& seam : seams)
    for (const SeamPlace& place : seam.along) widest = std::max(widest, apply(place.row, q).norm());
  return widest;
}

// Of progress, where nothing holds a seam up [1/s].
double full_rate(const Scene& scene, double gap) {
  constexpr double peak = 1.875;  // of the speed, over the mean
  return scene.sewing.speed / (peak * gap);
}

double gap_at_start(const std::vector<BuiltSeam>& seams) {
  return seams.empty() ? 0 : std::ranges::max_element(seams, {}, &BuiltSeam::gap)->gap;
}

}  // namespace

double Sewing::progress_at(int seam, double t) const {
  const auto k = static_cast<std::size_t>(seam);
  return std::min(1.0, progress[k] + rate[k] * (t - since));
}

Sewing open_seams(const Scene& scene, const std::vector<BuiltSeam>& seams, const Eigen::VectorXd& start) {
  Sewing out;
  const double gap = gap_at_start(seams);
  out.progress.assign(seams.size(), 1);
  out.rate.assign(seams.size(), 0);
  out.force.assign(seams.size(), 0);
  out.most.assign(seams.size(), scene.sewing.force);
  if (gap <= least_gap) return out;
  if (gap <= near_gap) {
    begin_rows(out, scene, seams, start, 0);
    return out;
  }
  out.stage = Sewing::springs;
  out.progress.assign(seams.size(), 0);
  out.rate.assign(seams.size(), full_rate(scene, gap));
  return out;
}

void begin_rows(Sewing& sewing, const Scene& scene, const std::vector<BuiltSeam>& seams, const Eigen::VectorXd& q,
                double t) {
  sewing.stage = Sewing::rows;
  sewing.from = q;
  sewing.since = t;
  sewing.waiting = 0;
  sewing.progress.assign(seams.size(), 0);
  sewing.rate.assign(seams.size(), full_rate(scene, std::max(widest_gap(seams, q), near_gap)));
  sewing.force.assign(seams.size(), 0);
}

bool go_on(Sewing& sewing, const Scene& scene, const std::vector<BuiltSeam>& seams, const std::vector<double>& force,
           double t, double dt) {
  constexpr double memory = 0.02, patience = 0.3, recovery = 0.05;  // s
  constexpr double slow = 0.02;                                     // of the full rate
  const bool rows = sewing.stage == Sewing::rows;
  const double full = full_rate(scene, rows ? std::max(widest_gap(seams, sewing.from), near_gap) : gap_at_start(seams));
  bool moving = false, open = false;
  for (std::size_t k = 0; k < seams.size(); ++k) {
    sewing.progress[k] = sewing.progress_at(static_cast<int>(k), t);
    sewing.force[k] += std::min(1.0, dt / memory) * (force[k] - sewing.force[k]);
    if (sewing.progress[k] >= 1) {
      sewing.rate[k] = 0;
      continue;
    }
    open = true;
    // Springs are bounded by themselves.
    const double share = rows ? std::clamp(2 * (1 - sewing.force[k] / sewing.most[k]), 0.0, 1.0) : 1;
    sewing.rate[k] = std::min(full * share, sewing.rate[k] + full * dt / recovery);
    moving = moving || sewing.rate[k] > slow * full;
  }
  sewing.since = t;
  sewing.waiting = moving ? 0 : sewing.waiting + dt;
  if (rows) {
    if (open && sewing.waiting < patience) return false;
    sewing.stage = Sewing::closed;
    std::ranges::fill(sewing.rate, 0.0);
    return true;
  }
  // Pulled as far as they come.
  const double pulled = *std::ranges::max_element(sewing.force);
  return !open && (pulled < near_gap * spring_stiffness || sewing.waiting >= patience);
}

void hold_back(Sewing& sewing, const Scene& scene) {
  constexpr double little = 0.05;  // of what a seam may carry: it isn't to blame
  for (double& rate : sewing.rate) rate /= 2;
  const auto most = std::ranges::max_element(sewing.force);
  if (most == sewing.force.end() || *most < little * scene.sewing.force) return;
  const auto k = static_cast<std::size_t>(most - sewing.force.begin());
  sewing.most[k] = std::min(sewing.most[k], *most);
  sewing.rate[k] = 0;
}

double open_part(double progress) {
  const double s = std::clamp(progress, 0.0, 1.0);
  return 1 - s * s * s * (10 + s * (6 * s - 15));
}

std::vector<SewnChart> sewn_charts(const Build& build) {
  std::vector<SewnChart> out;
  if (build.proxies.empty()) return out;
  std::vector<int> first;  // proxy vertex of each panel
  int count = 0;
  double longest = 0;  // m, of the proxies' edges, and half as much again for what is thick
  std::vector<std::vector<Vector3d>> rest;
  for (std::size_t k = 0; k < build.proxies.size(); ++k) {
    const ProxyPanel& proxy = build.proxies[k];
    first.push_back(count);
    count += static_cast<int>(proxy.mesh.uv.size());
    rest.emplace_back();
    for (const Vector2d& uv : proxy.mesh.uv) rest[k].push_back(build.rest(static_cast<int>(k))(uv.x(), uv.y()));
    for (const auto& triangle : proxy.mesh.triangles)
      for (int c = 0; c < 3; ++c)
        longest = std::max(longest, (rest[k][static_cast<std::size_t>(triangle[static_cast<std::size_t>(c)])] -
                                     rest[k][static_cast<std::size_t>(triangle[static_cast<std::size_t>((c + 1) % 3)])])
                                        .norm());
  }
  const double reach = 2 * longest;
  struct Corner {
    int panel;
    Vector3d at;
    int group;
  };
  std::vector<Corner> corners;
  std::vector<int> group_of;  // of groups, as they merge
  const auto root = [&](int g) {
    while (group_of[static_cast<std::size_t>(g)] != g) g = group_of[static_cast<std::size_t>(g)];
    return g;
  };
  const auto corner = [&](int panel, const Vector3d& at) {
    for (const Corner& c : corners)
      if (c.panel == panel && (c.at - at).norm() < 1e-3) return root(c.group);
    group_of.push_back(static_cast<int>(group_of.size()));
    corners.push_back({panel, at, group_of.back()});
    return group_of.back();
  };
  for (const BuiltSeam& seam : build.seams) {
    SewnChart chart;
    for (const int side : {0, 1}) {
      const int k = side == 0 ? seam.a : seam.b;
      std::vector<Vector3d> line;
      for (const SeamPlace& place : seam.along) {
        const Vector2d& uv = side == 0 ? place.a : place.b;
        line.push_back(build.rest(k)(uv.x(), uv.y()));
      }
      // Along the seam in the length of the first side.
      const double scale = side == 0 ? 1 : seam.length_a / seam.length_b;
      for (std::size_t v = 0; v < rest[static_cast<std::size_t>(k)].size(); ++v) {
        const Foot foot = foot_on(line, rest[static_cast<std::size_t>(k)][v]);
        if (foot.distance > reach) continue;
        chart.places.emplace_back(first[static_cast<std::size_t>(k)] + static_cast<int>(v),
                                  Vector2d(scale * foot.along, side == 0 ? foot.distance : -foot.distance));
      }
    }
    std::ranges::stable_sort(chart.places, {}, &std::pair<int, Vector2d>::first);
    out.push_back(std::move(chart));
    for (const SeamPlace* end : {&seam.along.front(), &seam.along.back()}) {
      const int a = corner(seam.a, build.rest(seam.a)(end->a.x(), end->a.y())),
                b = corner(seam.b, build.rest(seam.b)(end->b.x(), end->b.y()));
      group_of[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
  }
  // Where seams meet, corners of more than two panels are one place: a chart for each two of them.
  for (std::size_t i = 0; i < corners.size(); ++i)
    for (std::size_t j = i + 1; j < corners.size(); ++j) {
      if (root(corners[i].group) != root(corners[j].group)) continue;
      SewnChart chart;
      for (const auto& [c, sign] : {std::pair(&corners[i], 1.0), std::pair(&corners[j], -1.0)}) {
        const auto k = static_cast<std::size_t>(c->panel);
        for (std::size_t v = 0; v < rest[k].size(); ++v) {
          const double distance = (rest[k][v] - c->at).norm();
          if (distance <= reach)
            chart.places.emplace_back(first[k] + static_cast<int>(v), Vector2d(0, sign * distance));
        }
      }
      std::ranges::stable_sort(chart.places, {}, &std::pair<int, Vector2d>::first);
      out.push_back(std::move(chart));
    }
  return out;
}

}  // namespace toile
