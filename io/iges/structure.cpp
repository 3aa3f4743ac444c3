// SPDX-License-Identifier: GPL-3.0-or-later
// Entities 116 (point), 123 (direction), 308 and 408 (subfigure and its instance), 402 (group).
// [IGES 5.3, 4.16, 4.20, 4.75, 4.139, 4.81]
#include "io/iges/topology.h"

namespace toile::iges {

PlacePoint read_point(Parameters& in) {
  PlacePoint point;
  for (int axis = 0; axis < 3; ++axis) point.x[axis] = in.real("coordinate of the point");
  point.symbol = in.pointer("PTR");
  return point;
}

void write(const PlacePoint& point, Record& out) {
  for (int axis = 0; axis < 3; ++axis) out.real(point.x[axis]);
  out.integer(point.symbol);
}

Eigen::Vector3d read_direction(Parameters& in) {
  Eigen::Vector3d direction;
  for (int axis = 0; axis < 3; ++axis) direction[axis] = in.real("coordinate of the direction");
  return direction;
}

void write_direction(const Eigen::Vector3d& direction, Record& out) {
  for (int axis = 0; axis < 3; ++axis) out.real(direction[axis]);
}

namespace {

std::vector<int> read_members(Parameters& in, int n) {
  if (n < 0) in.fail("N is " + std::to_string(n) + ", must not be negative");
  in.expect(n, std::to_string(n) + " members");
  std::vector<int> members;
  for (int i = 0; i < n; ++i) members.push_back(in.pointer("pointer to a member"));
  return members;
}

}  // namespace

Definition read_definition(Parameters& in) {
  Definition definition;
  definition.depth = in.integer("DEPTH");
  definition.name = in.text("NAME");
  definition.members = read_members(in, in.integer("N"));
  return definition;
}

void write(const Definition& definition, Record& out) {
  out.integer(definition.depth).string(definition.name).integer(static_cast<long long>(definition.members.size()));
  for (const int member : definition.members) out.integer(member);
}

Instance read_instance(Parameters& in) {
  Instance instance;
  instance.definition = in.pointer("DE");
  for (int axis = 0; axis < 3; ++axis) instance.translation[axis] = in.real("coordinate of the translation");
  instance.scale = in.real("S", -1, 1);
  if (!(instance.scale != 0)) in.fail("the scale of the instance is 0");
  return instance;
}

void write(const Instance& instance, Record& out) {
  out.integer(instance.definition);
  for (int axis = 0; axis < 3; ++axis) out.real(instance.translation[axis]);
  out.real(instance.scale);
}

Eigen::Affine3d placement(const Instance& instance) {
  Eigen::Affine3d t = Eigen::Affine3d::Identity();
  t.linear() *= instance.scale;
  t.translation() = instance.translation;
  return t;
}

std::vector<int> read_group(Parameters& in) {
  if (in.entry().form != 9) return read_members(in, in.integer("N"));
  // Form 9: the number of parents (1), the number of children, then all of them.
  const int parents = in.integer("number of parents"), children = in.integer("number of children");
  if (parents != 1) in.fail("a family has " + std::to_string(parents) + " parents, must be 1");
  if (children < 0) in.fail("a family has " + std::to_string(children) + " children, must not be negative");
  in.expect(1LL + children, std::to_string(children) + " children");
  return read_members(in, 1 + children);
}

void write_group(const std::vector<int>& members, int form, Record& out) {
  if (form == 9) {
    out.integer(1).integer(static_cast<long long>(members.size()) - 1);
  } else {
    out.integer(static_cast<long long>(members.size()));
  }
  for (const int member : members) out.integer(member);
}

}  // namespace toile::iges
