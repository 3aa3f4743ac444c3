// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/scene/placement.h"

#include <fmt/format.h>

#include "geometry/smooth_step.h"
#include "pipeline/scene/readers.h"

namespace toile {

namespace {

// The part of a motion that is done.
double done_share(const PinMotion& motion, double t) {
  return smooth_step((t - motion.start) / (motion.end - motion.start));
}

}  // namespace

Eigen::Matrix3d Placement::rotation() const {
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  if (rotate.isZero(0)) return Eigen::Matrix3d::Identity();
  return (AngleAxisd(rotate[2], Vector3d::UnitZ()) * AngleAxisd(rotate[1], Vector3d::UnitY()) *
          AngleAxisd(rotate[0], Vector3d::UnitX()))
      .toRotationMatrix();
}

Eigen::Vector3d PinMotion::operator()(const Eigen::Vector3d& x, const Eigen::Vector3d& mean, double t) const {
  const double s = done_share(*this, t);
  if (s == 0) return x;
  const Eigen::Vector3d c = centre.value_or(mean);
  return c + Placement{{0, 0, 0}, s * rotate}.rotation() * (x - c) + s * translate;
}

Eigen::Isometry3d PinMotion::at(double t, const Eigen::Vector3d& mean) const {
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  const double s = done_share(*this, t);
  const Eigen::Vector3d c = centre.value_or(mean);
  out.linear() = Placement{{0, 0, 0}, s * rotate}.rotation();
  out.translation() = c - out.linear() * c + s * translate;
  return out;
}

Placement read_placement(Table table) {
  Placement place;
  if (const auto v = table.vector<3>("translate", dimension::length)) place.translate = *v;
  if (const auto v = table.vector<3>("rotate_deg", dimension::angle, degree_in_radians)) place.rotate = *v;
  table.done();
  return place;
}

PinMotion read_motion(Table& move) {
  PinMotion motion;
  if (const auto v = move.vector<3>("translate", dimension::length)) motion.translate = *v;
  if (const auto v = move.vector<3>("rotate_deg", dimension::angle, degree_in_radians)) motion.rotate = *v;
  motion.centre = move.vector<3>("centre", dimension::length);
  move.number(motion.start, "start", dimension::time, Range::nonnegative);
  const auto end = move.number("end", dimension::time, Range::positive);
  if (!end) move.missing("end", "the time at which the motion is complete");
  motion.end = *end;
  if (!(motion.start < motion.end)) {
    move.fail(*move.raw().get("end"),
              fmt::format("end in move is {} s, must come after start = {} s", motion.end, motion.start));
  }
  move.done();
  return motion;
}

std::filesystem::path beside(const std::filesystem::path& scene, const std::string& file) {
  const std::filesystem::path path(file);
  return path.is_absolute() ? path : scene.parent_path() / path;
}

}  // namespace toile
