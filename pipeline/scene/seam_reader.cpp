// SPDX-License-Identifier: GPL-3.0-or-later
// [[seam]] and [sewing].
#include <fmt/format.h>

#include <algorithm>

#include "geometry/error.h"
#include "pipeline/scene/readers.h"
#include "pipeline/scene/units.h"

namespace toile {
namespace {

// curves = [0, 1, 2]; empty where there is no such key.
std::vector<int> read_curves(Table& table) {
  const toml::node* node = table.find("curves");
  if (!node) return {};
  std::vector<int> out;
  const toml::array* array = node->as_array();
  for (std::size_t k = 0; array && k < array->size(); ++k) {
    const auto number = (*array)[k].value<std::int64_t>();
    if (!number || *number < 0 || *number > 1000000) array = nullptr;
    if (number) out.push_back(static_cast<int>(*number));
  }
  if (!array || out.empty())
    table.fail(*node, "curves must be an array of the curves' numbers in their loop, such as [0, 1]");
  return out;
}

SeamSide read_seam_side(Table& seam, const char* key, const std::vector<ScenePanel>& panels) {
  auto table = seam.table(key, fmt::format("{} of [[seam]]", key));
  if (!table) seam.missing(key, "one side, such as { panel = \"front\", loop = 0, curve = 1 }");
  SeamSide side;
  side.panel = panel_key(*table, panels);
  side.loop = table->integer("loop", 0, 1000000).value_or(0);
  const auto curve = table->integer("curve", 0, 1000000);
  side.curves = read_curves(*table);
  if (curve && !side.curves.empty())
    table->fail(*table->raw().get("curves"), "a side has a curve or curves = [...], not both");
  if (curve) side.curves = {*curve};
  if (side.curves.empty()) table->missing("curve", "its number in the loop; toile inspect shows it");
  table->number(side.from, "from", dimension::none, Range::nonnegative);
  table->number(side.to, "to", dimension::none, Range::positive);
  if (!(side.from < side.to && side.to <= 1)) {
    throw InputError(
        fmt::format("{}: a side runs from {} to {} of its length, must be fractions of 0 to 1, from below to",
                    table->where(), side.from, side.to));
  }
  side.reverse = table->boolean("reverse").value_or(false);
  table->done();
  return side;
}

SceneSeam read_seam(Table table, const std::vector<ScenePanel>& panels) {
  SceneSeam seam;
  seam.where = table.where();
  seam.a = read_seam_side(table, "a", panels);
  seam.b = read_seam_side(table, "b", panels);
  table.done();
  for (const int curve : seam.a.curves) {
    const bool there = std::ranges::find(seam.b.curves, curve) != seam.b.curves.end();
    const bool apart = seam.a.to <= seam.b.from || seam.b.to <= seam.a.from;
    const bool part = seam.a.curves == seam.b.curves && apart;
    if (seam.a.panel != seam.b.panel || seam.a.loop != seam.b.loop || !there || part) continue;
    throw InputError(fmt::format("{}: the seam joins curve {},{} of panel '{}' with itself", seam.where, seam.a.loop,
                                 curve, seam.a.panel));
  }
  return seam;
}

}  // namespace

void read_seams(Table& top, Scene& scene) {
  for (Table& table : top.tables("seam", "[[seam]]")) scene.seams.push_back(read_seam(table, scene.panels));
  auto table = top.table("sewing", "[sewing]");
  if (!table) return;
  table->number(scene.sewing.speed, "speed", dimension::velocity, Range::positive);
  table->number(scene.sewing.force, "force", dimension::force_per_length, Range::positive);
  scene.sewing.gravity = table->boolean("gravity").value_or(false);
  scene.sewing.friction = table->boolean("friction").value_or(false);
  table->done();
}

}  // namespace toile
