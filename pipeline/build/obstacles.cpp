// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/build/obstacles.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "analysis/contact/mesh_obstacle.h"
#include "analysis/contact/self_crossings.h"
#include "analysis/contact/shapes.h"
#include "geometry/error.h"
#include "geometry/mesh_repair.h"
#include "io/triangle_mesh.h"
#include "pipeline/build/iges_body.h"

namespace toile {

namespace {

using Eigen::Vector3d;

std::string title(const SceneObstacle& obstacle) {
  return fmt::format("{}: obstacle '{}'", obstacle.where, obstacle.name);
}

// From the file's unit and axes to the scene's, at the start.
Eigen::Affine3d placing(const Scene& scene, const SceneObstacle& obstacle, double metres_per_unit) {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  if (obstacle.up) {
    // The smallest turn; a half turn, whose axis nothing chooses, goes about x.
    constexpr double opposite = -1 + 1e-12;  // a cosine; rounding leaves no axis below it
    const Vector3d from = *obstacle.up == 'y' ? Vector3d::UnitY() : Vector3d::UnitZ(), to = up(scene);
    turn = from.dot(to) < opposite ? Eigen::Matrix3d(Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitX()))
                                   : Eigen::Quaterniond::FromTwoVectors(from, to).toRotationMatrix();
  }
  Eigen::Affine3d out;
  out.linear() = metres_per_unit * obstacle.place.rotation() * turn;
  out.translation() = obstacle.place.translate;
  return out;
}

Eigen::Matrix3Xd placed(const Eigen::Affine3d& placing, const Eigen::Matrix3Xd& vertices) {
  return (placing.linear() * vertices).colwise() + placing.translation();
}

// Advice where no body that cloth is draped over has this size [m]. An IGES file says its own unit.
std::string size_advice(double size, double metres_per_unit, bool says_unit) {
  constexpr double least = 0.02, most = 50, usual = 1.7;
  if (size >= least && size <= most) return "";
  if (says_unit)
    return fmt::format(
        "it is {:.4g} m large, as its file says that a unit is {:.4g} m: if that is wrong, write the file again with "
        "the right unit in its global section",
        size, metres_per_unit);
  static constexpr std::array<std::pair<const char*, double>, 4> units{
      {{"mm", 1e-3}, {"cm", 1e-2}, {"inch", 0.0254}, {"m", 1}}};
  std::string advice;
  double nearest = 2;  // at most e^2 times larger or smaller than a person
  for (const auto& [unit, metres] : units) {
    const double would_be = size / metres_per_unit * metres, off = std::abs(std::log(would_be / usual));
    if (off >= nearest) continue;
    nearest = off;
    advice = fmt::format(" unit = \"{}\" would make it {:.4g} m", unit, would_be);
  }
  return fmt::format("it is {:.4g} m large: is the file's unit another one?{}", size, advice);
}

// Says the scene's line before what is wrong with a file.
template <class Read>
auto reading(const SceneObstacle& obstacle, const std::string& file, const Read& read) {
  try {
    return read();
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", title(obstacle), error.what()));
  } catch (const GeometryError& error) {
    throw InputError(fmt::format("{}: {}: {}", title(obstacle), file, error.what()));
  }
}

// The other meshes of a sequence or a morph: the vertices that the first one's became.
Eigen::Matrix3Xd other_shape(const SceneObstacle& obstacle, const std::filesystem::path& path,
                             const TriangleMesh& first, const std::vector<int>& vertex_of) {
  const TriangleMesh mesh = reading(obstacle, path.string(), [&] { return read_mesh(path); });
  if (mesh.triangles != first.triangles || mesh.vertices.cols() != first.vertices.cols())
    throw InputError(
        fmt::format("{}: {} has {} triangles with {} vertices, {} has {} with {}, or in another order; "
                    "write both from one mesh",
                    title(obstacle), path.string(), mesh.triangles.size(), mesh.vertices.cols(), obstacle.mesh.string(),
                    first.triangles.size(), first.vertices.cols()));
  Eigen::Matrix3Xd out(3, static_cast<Eigen::Index>(vertex_of.size()));
  for (std::size_t k = 0; k < vertex_of.size(); ++k)
    out.col(static_cast<Eigen::Index>(k)) = mesh.vertices.col(vertex_of[k]);
  return out;
}

MeshMotion motion_of(const SceneObstacle& obstacle, const Eigen::Affine3d& to_scene, const TriangleMesh& file,
                     const RepairedMesh& repaired, const Vector3d& middle) {
  MeshMotion out;
  if (obstacle.move) out.place = [move = *obstacle.move, middle](double t) { return move.at(t, middle); };
  std::vector<std::filesystem::path> files = obstacle.sequence;
  out.times = obstacle.times;
  if (obstacle.morph) {
    files = {obstacle.mesh, obstacle.morph->to};
    out.times = {obstacle.morph->start, obstacle.morph->end};
    out.smooth = true;
  }
  for (std::size_t k = 0; k < files.size(); ++k)
    out.shapes.push_back(
        placed(to_scene, k == 0 ? repaired.mesh.vertices : other_shape(obstacle, files[k], file, repaired.vertex_of)));
  return out;
}

// What the scene's obstacle says of its file.
struct BodyFile {
  TriangleMesh mesh;  // unit and axes of the file
  double metres_per_unit = 1;
  std::vector<std::string> warnings = {};
};

BodyFile read_body(const SceneObstacle& obstacle) {
  return reading(obstacle, obstacle.mesh.string(), [&]() -> BodyFile {
    if (obstacle.chord_error == 0) return {read_mesh(obstacle.mesh), obstacle.metres_per_unit};
    IgesBody body = read_iges_body(obstacle.mesh, obstacle.chord_error);
    return {std::move(body.mesh), body.metres_per_unit, std::move(body.warnings)};
  });
}

BuiltObstacle build_mesh(const Scene& scene, const SceneObstacle& obstacle) {
  const BodyFile file = read_body(obstacle);
  RepairedMesh repaired = reading(obstacle, obstacle.mesh.string(), [&] { return repair_mesh(file.mesh); });
  BuiltObstacle out;
  const std::string start = fmt::format("{}: {}: ", title(obstacle), obstacle.mesh.string());
  for (const std::string& warning : file.warnings) out.warnings.push_back(start + warning);
  for (const std::string& repair : repaired.repairs) out.notes.push_back(start + repair);
  for (const std::string& warning : repaired.warnings) out.warnings.push_back(start + warning);
  if (const std::vector<SelfCrossing> crossings = self_crossings(repaired.mesh); !crossings.empty()) {
    const Vector3d& at = crossings[0].place;
    out.warnings.push_back(
        fmt::format("{}the mesh passes through itself: {} pairs of triangles, the first at ({:.6g}, "
                    "{:.6g}, {:.6g}); there its inside can't be told",
                    start, crossings.size(), at.x(), at.y(), at.z()));
  }
  const Eigen::Affine3d to_scene = placing(scene, obstacle, file.metres_per_unit);
  const Eigen::Matrix3Xd vertices = placed(to_scene, repaired.mesh.vertices);
  const Eigen::AlignedBox3d box(vertices.rowwise().minCoeff(), vertices.rowwise().maxCoeff());
  const Vector3d size = box.diagonal();
  if (const std::string advice = size_advice(size.maxCoeff(), file.metres_per_unit, obstacle.chord_error > 0);
      !advice.empty())
    out.warnings.push_back(start + advice);
  out.about =
      fmt::format("obstacle '{}': {} triangles, {}, {:.3g} x {:.3g} x {:.3g} m", obstacle.name,
                  repaired.mesh.triangles.size(), repaired.closed ? "closed" : "open", size.x(), size.y(), size.z());
  MeshMotion motion = motion_of(obstacle, to_scene, file.mesh, repaired, box.center());
  repaired.mesh.vertices = vertices;
  out.obstacle = reading(obstacle, obstacle.mesh.string(), [&]() -> std::unique_ptr<Obstacle> {
    return std::make_unique<MeshObstacle>(
        std::move(repaired.mesh), std::move(motion),
        ObstacleOptions{.name = obstacle.name, .friction = obstacle.friction, .thickness = obstacle.thickness});
  });
  return out;
}

BuiltObstacle build_shape(const SceneObstacle& o) {
  const Eigen::Matrix3d turn = o.place.rotation();
  const auto at = [&](const Vector3d& x) -> Vector3d { return o.place.translate + turn * x; };
  const ObstacleOptions options{.name = o.name, .friction = o.friction, .thickness = o.thickness};
  const auto motion = [&](const Vector3d& middle) -> RigidMotion {
    if (!o.move) return nullptr;
    return [move = *o.move, middle](double t) { return move.at(t, middle); };
  };
  BuiltObstacle out;
  const auto take = [&](const auto& shape, const Vector3d& middle, const std::string& about) {
    out.obstacle = make_obstacle(shape, options, motion(middle));
    out.about = fmt::format("obstacle '{}': {}", o.name, about);
  };
  const Vector3d centre = at(o.centre), from = at(o.from), to = at(o.to);
  switch (o.kind) {
    case ObstacleKind::mesh:
      break;
    case ObstacleKind::plane:
      take(PlaneShape{at(o.point), turn * o.normal}, at(o.point), "a plane");
      break;
    case ObstacleKind::sphere:
      take(SphereShape{centre, o.radius}, centre, fmt::format("a sphere of radius {:.3g} m", o.radius));
      break;
    case ObstacleKind::cylinder:
      take(CylinderShape{from, to, o.radius}, 0.5 * (from + to),
           fmt::format("a cylinder of radius {:.3g} m, {:.3g} m long", o.radius, (to - from).norm()));
      break;
    case ObstacleKind::capsule:
      take(CapsuleShape{from, to, o.radius}, 0.5 * (from + to),
           fmt::format("a capsule of radius {:.3g} m, {:.3g} m long", o.radius, (to - from).norm()));
      break;
    case ObstacleKind::box:
      take(BoxShape{centre, o.size, turn}, centre,
           fmt::format("a box, {:.3g} x {:.3g} x {:.3g} m", o.size.x(), o.size.y(), o.size.z()));
      break;
  }
  return out;
}

}  // namespace

BuiltObstacle build_obstacle(const Scene& scene, const SceneObstacle& obstacle) {
  if (obstacle.kind != ObstacleKind::mesh) return reading(obstacle, "its shape", [&] { return build_shape(obstacle); });
  return build_mesh(scene, obstacle);
}

BuiltObstacles build_obstacles(const Scene& scene) {
  BuiltObstacles out;
  for (const SceneObstacle& obstacle : scene.obstacles) {
    try {
      BuiltObstacle built = build_obstacle(scene, obstacle);
      out.obstacles.push_back(std::move(built.obstacle));
      out.about.push_back(built.about);
      out.warnings.insert(out.warnings.end(), built.warnings.begin(), built.warnings.end());
      out.notes.insert(out.notes.end(), built.notes.begin(), built.notes.end());
    } catch (const InputError& error) {
      out.faults.push_back(error.what());
    }
  }
  return out;
}

}  // namespace toile
