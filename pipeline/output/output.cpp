// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/output/output.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "analysis/constraint/stress_recovery.h"
#include "geometry/error.h"
#include "geometry/measure.h"
#include "io/file.h"
#include "io/file_formats.h"
#include "io/mesh_files.h"
#include "io/obj.h"
#include "io/vtu.h"
#include "pipeline/picture/preview.h"
#include "trimming/triangulation.h"

namespace toile {
namespace {

constexpr const char* material_name = "cloth.mtl";  // of all frames

struct OutputUnit {
  std::string name;
  double metres = 1;
  double resolution = 1e-6;
};

// The first file's unit, where its name says all; a file with a model scale comes in metres.
OutputUnit output_unit(const Build& build) {
  static constexpr std::array<std::pair<const char*, double>, 11> units = {{{"MM", 1e-3},
                                                                            {"M", 1},
                                                                            {"INCH", 0.0254},
                                                                            {"IN", 0.0254},
                                                                            {"FT", 0.3048},
                                                                            {"CM", 0.01},
                                                                            {"KM", 1000},
                                                                            {"UM", 1e-6},
                                                                            {"MIL", 2.54e-5},
                                                                            {"UIN", 2.54e-8},
                                                                            {"MI", 1609.344}}};
  const PanelFile& file = build.files.front();
  const double metres = build.panels.front().source.metres_per_unit;
  for (const auto& [name, size] : units) {
    if (file.unit == name && std::abs(metres - size) <= 1e-12 * size) {
      return {file.unit == "IN" ? "INCH" : file.unit, metres, file.resolution > 0 ? file.resolution : 1e-6};
    }
  }
  return {"M", 1, 1e-9};
}

std::string base_name(const std::string& name) {
  if (name.size() > flat_suffix.size() && name.ends_with(flat_suffix))
    return name.substr(0, name.size() - flat_suffix.size());
  return name;
}

// A move of the flat faces (the even ones) that sets them beside the draped ones on a level line, by a round length.
Eigen::Vector3d beside_the_drape(const std::vector<OutputFace>& faces, const Eigen::Vector3d& up) {
  Eigen::AlignedBox3d flat, draped;
  for (std::size_t k = 0; k < faces.size(); ++k)
    (k % 2 == 0 ? flat : draped).extend(bounding_box(faces[k].face.surface));
  // Along x, or y where x is rather the height.
  const Eigen::Index axis = std::abs(up.x()) < 0.8 ? 0 : 1;
  const double size = flat.merged(draped).sizes().maxCoeff();
  const double overlap = flat.max()[axis] - draped.min()[axis] + 0.1 * size;
  const double step = std::pow(10.0, std::floor(std::log10(size))) / 10;
  const double length = step * std::ceil(overlap / step);
  Eigen::Vector3d move = Eigen::Vector3d::Zero();
  if (size > 0 && std::isfinite(length)) move[axis] = -length;
  return move;
}

}  // namespace

IgesOutput draped_file(const Build& build, const Eigen::VectorXd& q) {
  const OutputUnit unit = output_unit(build);
  std::vector<OutputFace> faces;
  for (std::size_t k = 0; k < build.panels.size(); ++k) {
    const BuiltPanel& panel = build.panels[k];
    TrimmedSurface flat = panel.source;
    for (TrimLoop& loop : flat.loops) {
      for (TrimCurve& trim : loop.curves) trim.model.reset();  // the flat panel's, in the file's unit
    }
    flat.surface = panel.face.surface;
    if (flat.metres_per_unit != unit.metres) {
      flat.surface = flat.surface.with_points(flat.metres_per_unit / unit.metres * flat.surface.points());
      flat.resolution *= flat.metres_per_unit / unit.metres;
      flat.metres_per_unit = unit.metres;
    }
    TrimmedSurface draped = flat;
    draped.surface = flat.surface.with_points(build.net(static_cast<int>(k), q) / unit.metres);
    const std::string name = base_name(panel.name);
    flat.name = name + std::string(flat_suffix);
    draped.name = name + std::string(draped_suffix);
    faces.push_back({flat, flat.name, 1, std::array<double, 3>{0.6, 0.6, 0.6}, {}});
    faces.push_back({draped, draped.name, 2, std::array<double, 3>{0.2, 0.4, 0.8}, {}});
  }
  const Eigen::Vector3d aside = beside_the_drape(faces, up(build.scene));
  for (std::size_t k = 0; k < faces.size(); k += 2) faces[k].aside = aside;
  IgesHeader header;
  header.product = build.scene.name;
  header.unit = unit.name;
  header.resolution = unit.resolution;
  header.up = up(build.scene);
  header.levels = {{1, "flat"}, {2, "draped"}};
  return format_iges(faces, header);
}

struct FrameWriter::Impl {
  const Build& build;
  std::filesystem::path frames;
  std::vector<TrimmedTriangles> triangles;  // made when they are first shown
  std::vector<std::unique_ptr<FrameSink>> sinks;
  bool iges = false;
  std::string material;  // of OBJ frames; empty: none

  // Deformed panels with fields; surfaces and points are kept alive beside them.
  struct Shown {
    std::vector<NurbsSurface> surfaces;
    std::vector<std::vector<ConstraintPoint>> points;
    std::vector<FramePanel> panels;
  };

  // Nominal stress of points as it is there: the fabric's, and what the rows there carry.
  std::vector<std::vector<Eigen::Vector2d>> raw_stress(const Shown& shown, const ConstraintRows& rows,
                                                       const std::vector<ThreadStress>& stress,
                                                       const Eigen::VectorXd& q) const {
    std::vector<std::vector<Eigen::Vector2d>> raw(shown.points.size());
    for (std::size_t k = 0; k < raw.size(); ++k) {
      for (const ConstraintPoint& point : shown.points[k])
        raw[k].push_back(build.model->state(static_cast<int>(k), point.u, point.v, q).nominal);
    }
    for (std::size_t r = 0; r < stress.size(); ++r) {
      const StrainRow& row = rows.strain[r];
      if (row.point < 0) continue;
      raw[static_cast<std::size_t>(row.panel)][static_cast<std::size_t>(row.point)][row.warp ? 1 : 0] =
          stress[r].nominal;
    }
    return raw;
  }

  Shown show(const System& system, const Eigen::VectorXd& q, const Eigen::VectorXd* velocity, double dt) {
    Shown shown;
    if (triangles.empty()) {
      for (const BuiltPanel& panel : build.panels) triangles.push_back(triangulate(panel.face, panel.topology));
    }
    shown.surfaces.reserve(build.panels.size());
    const Model& model = *build.model;
    for (std::size_t k = 0; k < build.panels.size(); ++k) {
      shown.points.push_back(system.points[k]);
      const auto& extra = system.extra_points[k];
      shown.points[k].insert(shown.points[k].end(), extra.begin(), extra.end());
    }
    std::optional<StressField> field;
    std::vector<std::vector<Eigen::Vector2d>> raw;
    if (system.strain_rows > 0) {
      const ConstraintRows& rows = system.projection->rows();
      field.emplace(stress_field(build, system, q, dt));
      const std::vector<ThreadStress> stress = row_stress(model, rows, row_forces(system, q, dt), q);
      raw = raw_stress(shown, rows, stress, q);
    }
    for (std::size_t k = 0; k < build.panels.size(); ++k) {
      const int index = static_cast<int>(k);
      const BuiltPanel& built = build.panels[k];
      shown.surfaces.push_back(build.rest(index).with_points(build.net(index, q)));
      FramePanel panel;
      panel.name = built.name;
      panel.surface = &shown.surfaces.back();
      panel.flat = &built.face.surface;
      panel.face = &built.face;
      panel.triangles = &triangles[k];
      for (const Eigen::Vector2d& uv : triangles[k].uv) {
        const MaterialState at = model.state(index, uv.x(), uv.y(), q);
        panel.fields.strain.push_back(at.strain);
        panel.fields.curvature.push_back(at.curvature);
        panel.fields.second_pk.push_back(at.second_pk);
        panel.fields.nominal.push_back(at.nominal);
        if (!field) continue;
        const auto [weft, warp] = field->at(index, uv.x(), uv.y());
        panel.fields.second_pk.back() = field->second_pk(index, uv.x(), uv.y());
        panel.fields.nominal.back() << weft.nominal, warp.nominal;
      }
      if (velocity) panel.velocity = build.net(index, *velocity);
      panel.carries_cloth = built.carries_cloth;
      panel.points = shown.points[k];
      for (std::size_t i = 0; i < panel.points.size(); ++i) {
        const ConstraintPoint& point = panel.points[i];
        panel.point_strain.emplace_back(model.state(index, point.u, point.v, q).strain.head<2>());
        if (!field) continue;
        const auto [weft, warp] = field->at(index, point.u, point.v);
        panel.point_stress.emplace_back(weft.nominal, warp.nominal, raw[k][i].x(), raw[k][i].y());
      }
      shown.panels.push_back(std::move(panel));
    }
    return shown;
  }
};

FrameWriter::FrameWriter(const Build& build, std::filesystem::path directory, const std::vector<double>& written)
    : impl_(new Impl{build, std::move(directory) / "frames", {}, {}, false, {}}) {
  const int next = static_cast<int>(written.size());
  for (const FileFormat format : build.scene.formats) {
    if (format == FileFormat::iges) {
      impl_->iges = true;
    } else if (format == FileFormat::vtu) {
      impl_->sinks.push_back(std::make_unique<VtuSink>(impl_->frames, build.scene.name, written));
    } else {
      const NamedFormat& file = named_format(format);
      const auto text = [&file](const Frame& frame) { return file.text(frame, material_name); };
      impl_->sinks.push_back(std::make_unique<FileSink>(impl_->frames, std::string(file.ending), text, next));
    }
    if (format == FileFormat::obj) impl_->material = material_name;
  }
}

FrameWriter::~FrameWriter() = default;

void FrameWriter::write(const RunFrame& frame) {
  if (impl_->iges) {
    write_file(impl_->frames / fmt::format("frame_{:04}.igs", frame.number), draped_file(impl_->build, frame.q).text,
               Flush::no);
  }
  if (impl_->sinks.empty()) return;
  if (!impl_->material.empty()) write_file(impl_->frames / impl_->material, format_mtl(), Flush::no);
  const Impl::Shown shown = impl_->show(frame.system, frame.q, &frame.velocity, frame.dt);
  const Frame picture{frame.number, frame.time, shown.panels, up(impl_->build.scene)};
  for (const auto& sink : impl_->sinks) sink->write(picture);
}

std::string FrameWriter::preview(const System& system, const Eigen::VectorXd& q) const {
  if (!preview_available()) return {};
  const Impl::Shown shown = impl_->show(system, q, nullptr, 0);
  PreviewOptions options;
  options.up = up(impl_->build.scene);
  options.title = impl_->build.scene.name;
  Eigen::AlignedBox3d cloth;
  for (Eigen::Index i = 0; i < q.size(); i += 3) cloth.extend(Eigen::Vector3d(q.segment<3>(i)));
  std::vector<FrameBody> bodies;
  for (const auto& obstacle : impl_->build.obstacles) bodies.push_back({obstacle->name(), obstacle->picture(cloth)});
  return preview_png({.panels = shown.panels, .bodies = bodies}, options);
}

void prepare_directory(const std::filesystem::path& directory, bool overwrite) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (fs::exists(directory, error)) {
    if (!fs::is_directory(directory)) throw OutputError(fmt::format("{} is not a directory", directory.string()));
    if (!fs::is_empty(directory) && !overwrite) {
      throw OutputError(fmt::format("{} is not empty; give --overwrite to replace a former run, or another -o DIR",
                                    directory.string()));
    }
    for (const char* name : {"draped.igs", "report.json", "report.html", "preview.png", "history.csv", "run.log",
                             "checkpoint", "frames"}) {
      fs::remove_all(directory / name, error);
      if (error) throw OutputError(fmt::format("{}: {}", (directory / name).string(), error.message()));
    }
  }
  fs::create_directories(directory, error);
  if (error) throw OutputError(fmt::format("{}: {}", directory.string(), error.message()));
}

}  // namespace toile
