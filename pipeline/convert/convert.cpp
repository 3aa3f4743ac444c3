// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/convert/convert.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <map>
#include <numbers>

#include "geometry/error.h"
#include "io/file_formats.h"
#include "io/obj.h"
#include "io/panel_file.h"
#include "pipeline/scene/scene.h"
#include "pipeline/scene/toml_table.h"
#include "trimming/triangulation.h"

namespace toile {
namespace {

bool asks(const InspectOptions& options) {
  return options.degree || options.span || options.spans;
}

// New records for everything: the panels alone.
std::string new_iges(PanelFile file, const InspectOptions& options, const std::string& name, Conversion& out) {
  std::vector<OutputFace> faces;
  for (TrimmedSurface& panel : file.panels) {
    if (asks(options)) panel.surface = refined(panel, options);
    faces.push_back({std::move(panel), {}, 0, std::nullopt});
  }
  IgesHeader header;
  header.product = name;
  if (!file.unit.empty()) header.unit = file.unit;
  if (file.resolution > 0) header.resolution = file.resolution;
  const IgesOutput written = format_iges(faces, header);
  out.notes.push_back(
      fmt::format("model curves follow the surfaces within {:.2g} {}", written.largest_curve_fit, header.unit));
  return written.text;
}

// The source's records with refined surfaces; empty where a panel's surface isn't a record of its own.
std::string refined_iges(const PanelFile& file, const InspectOptions& options) {
  TrimmedSurface face;
  face.metres_per_unit = file.metres_per_unit;
  face.resolution = file.resolution;
  face.source = file.path;
  face.name = "of a surface (128)";
  std::string text = format_iges(file, [&](const NurbsSurface& surface) {
    face.surface = surface;
    return refined(face, options);
  });
  const PanelFile again = parse_iges(text, file.path);
  const bool all = std::ranges::equal(again.panels, file.panels, [&](const auto& written, const auto& panel) {
    const NurbsSurface wanted = refined(panel, options);
    return written.surface.u() == wanted.u() && written.surface.v() == wanted.v();
  });
  return all ? text : std::string();
}

std::string iges_text(const PanelFile& file, const std::string& name, const InspectOptions& options, bool some,
                      Conversion& out) {
  if (!file.file || some) return new_iges(file, options, name, out);
  if (!asks(options)) {
    out.notes.push_back("every record is the source's own");
    return format_iges(file);
  }
  std::string text = refined_iges(file, options);
  if (!text.empty()) {
    out.notes.push_back("surfaces are refined, every other record is the source's own");
    return text;
  }
  out.warnings.push_back(
      fmt::format("{}: not every panel lies on a B-spline surface (128) of its own; the panels are written anew, other "
                  "entities are not carried over",
                  file.path));
  return new_iges(file, options, name, out);
}

// The panels asked for; all where none is.
std::vector<std::size_t> chosen(const PanelFile& file, const std::vector<std::string>& only) {
  std::vector<std::string> names;
  for (const TrimmedSurface& panel : file.panels) names.push_back(panel.name);
  for (const std::string& name : only) {
    if (std::ranges::find(names, name) == names.end())
      throw InputError(fmt::format("{}: no panel is called '{}'{}", file.path, name, suggestion(name, names)));
  }
  std::vector<std::size_t> out;
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (only.empty() || std::ranges::find(only, names[k]) != only.end()) out.push_back(k);
  }
  return out;
}

bool same_domain(const TrimmedSurface& a, const TrimmedSurface& b) {
  if (!(a.surface.u() == b.surface.u() && a.surface.v() == b.surface.v() && a.surface.weights() == b.surface.weights()))
    return false;
  return std::ranges::equal(a.loops, b.loops, [](const TrimLoop& l, const TrimLoop& m) {
    return l.kind == m.kind && std::ranges::equal(l.curves, m.curves, [](const TrimCurve& c, const TrimCurve& d) {
             return c.curve == d.curve && c.reversed == d.reversed;
           });
  });
}

// The panel whose pattern this one has: "front flat" for "front draped", else itself.
std::size_t pattern_of(const PanelFile& file, std::size_t k) {
  const std::string& name = file.panels[k].name;
  if (!name.ends_with(draped_suffix)) return k;
  const std::string flat = name.substr(0, name.size() - draped_suffix.size()) + std::string(flat_suffix);
  for (std::size_t i = 0; i < file.panels.size(); ++i) {
    if (file.panels[i].name == flat && same_domain(file.panels[i], file.panels[k])) return i;
  }
  return k;
}

// A panel with a valid trim, in metres, and its triangles.
struct MeshedPanel {
  TrimmedSurface face;
  NurbsSurface surface;
  TrimmedTriangles triangles;
  std::vector<ConstraintPoint> points;
};

MeshedPanel mesh(const TrimmedSurface& panel, const InspectOptions& options, Conversion& conversion) {
  MeshedPanel out{panel, {}, {}, {}};
  out.face.surface = refined(panel, options);
  for (const LoopRepair& repair : validate_loops(out.face))
    (repair.note ? conversion.details : conversion.warnings)
        .push_back(fmt::format("panel '{}': loop {}: {}", panel.name, repair.loop, repair.what));
  const TrimTopology topology = trace_trims(out.face);
  out.triangles = triangulate(out.face, topology);
  out.points = constraint_points(out.face, topology);
  const NurbsSurface& surface = out.face.surface;
  out.surface = surface.with_points(panel.metres_per_unit * surface.points());
  return out;
}

// A drape on the triangles of its pattern.
MeshedPanel mesh_like(const TrimmedSurface& panel, const MeshedPanel& pattern, const InspectOptions& options) {
  MeshedPanel out = pattern;
  const NurbsSurface surface = refined(panel, options);
  out.face.name = panel.name;
  out.face.surface = surface;
  out.surface = surface.with_points(panel.metres_per_unit * surface.points());
  return out;
}

// The chosen panels and the patterns that they need, and what a frame shows of them.
struct Meshes {
  std::map<std::size_t, MeshedPanel> of_panel;
  std::vector<FramePanel> panels;
};

Meshes mesh(const PanelFile& file, const std::vector<std::size_t>& chosen, const InspectOptions& options,
            Conversion& conversion) {
  Meshes out;
  std::size_t count = 0;
  double smallest_angle = std::numbers::pi, shortest = std::numeric_limits<double>::infinity(), longest = 0;
  for (const std::size_t k : chosen) {
    const std::size_t pattern = pattern_of(file, k);
    if (out.of_panel.count(pattern) == 0)
      out.of_panel.emplace(pattern, mesh(file.panels[pattern], options, conversion));
    if (pattern != k) out.of_panel.emplace(k, mesh_like(file.panels[k], out.of_panel.at(pattern), options));
    const MeshedPanel& meshed = out.of_panel.at(k);
    const TriangleQuality& quality = meshed.triangles.quality;
    count += meshed.triangles.triangles.size();
    smallest_angle = std::min(smallest_angle, quality.smallest_angle);
    shortest = std::min(shortest, meshed.face.metres_per_unit * quality.shortest_edge);
    longest = std::max(longest, meshed.face.metres_per_unit * quality.longest_edge);
    FramePanel panel;
    panel.name = meshed.face.name;
    panel.surface = &meshed.surface;
    panel.flat = &out.of_panel.at(pattern).surface;
    panel.face = &meshed.face;
    panel.triangles = &meshed.triangles;
    panel.points = meshed.points;
    out.panels.push_back(std::move(panel));
  }
  conversion.notes.push_back(
      fmt::format("{} triangles in {} panels, metres; smallest angle {:.3g} degrees, edges {:.3g} to {:.3g} m", count,
                  out.panels.size(), smallest_angle * 180 / std::numbers::pi, shortest, longest));
  return out;
}

// Nets need no valid trim: they are written as they are.
std::string net_text(const PanelFile& file, const std::vector<std::size_t>& chosen, const InspectOptions& options,
                     const NamedFormat& format) {
  std::vector<NurbsSurface> surfaces;
  for (const std::size_t k : chosen) {
    const NurbsSurface surface = refined(file.panels[k], options);
    surfaces.push_back(surface.with_points(file.panels[k].metres_per_unit * surface.points()));
  }
  std::vector<FramePanel> panels;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    FramePanel& panel = panels.emplace_back();
    panel.name = file.panels[chosen[i]].name;
    panel.surface = &surfaces[i];
    panel.face = &file.panels[chosen[i]];
  }
  return format.text({0, 0, panels}, {});
}

std::filesystem::path material_path(std::filesystem::path target) {
  return target.replace_extension(".mtl");
}

const NamedFormat& format_of(const std::filesystem::path& target) {
  const std::string ending = target.extension().string();
  if (const auto format = format_with_ending(ending)) return named_format(*format);
  std::vector<std::string_view> endings;
  for (const NamedFormat& format : file_formats()) endings.push_back(format.ending);
  throw InputError(
      fmt::format("{}: can't write '{}' files; use one of {}", target.string(), ending, fmt::join(endings, ", ")));
}

Eigen::Vector3d up_of(const PanelFile& file, const ConvertOptions& options) {
  if (options.up) return *options.up;
  if (file.up) return *file.up;
  return file.file ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitY();
}

}  // namespace

std::optional<Eigen::Vector3d> axis_named(std::string_view word) {
  const double sign = word.starts_with('-') ? -1 : 1;
  if (word.starts_with('-') || word.starts_with('+')) word.remove_prefix(1);
  if (word.size() != 1 || word[0] < 'x' || word[0] > 'z') return std::nullopt;
  return Eigen::Vector3d(sign * Eigen::Vector3d::Unit(word[0] - 'x'));
}

std::vector<std::filesystem::path> conversion_targets(const std::filesystem::path& out) {
  if (format_with_ending(out.extension().string()) == FileFormat::obj) return {out, material_path(out)};
  return {out};
}

Conversion convert(const PanelFile& source, const std::filesystem::path& target, const ConvertOptions& options) {
  const NamedFormat& format = format_of(target);
  const bool iges = format.what == FormatContent::faces;
  PanelFile file = source;
  leave_out_invalid(file);
  const std::vector<std::size_t> panels = chosen(file, options.only);
  const bool some = panels.size() < file.panels.size();
  Conversion out;
  out.warnings = file.warnings;
  out.details = file.notes;
  out.refused = file.refused;
  out.panels = panels.size();
  if (iges || format.what == FormatContent::drawing) {
    PanelFile part = file;
    if (some) part.panels.clear();
    for (std::size_t k = 0; some && k < panels.size(); ++k) part.panels.push_back(file.panels[panels[k]]);
    if (iges) {
      out.bytes = iges_text(part, target.stem().string(), options.refine, some, out);
    } else {
      out.bytes = print_svg(part);
      out.notes.push_back("print at 100 %: one unit is a millimetre");
    }
  } else if (format.what == FormatContent::nets) {
    out.bytes = net_text(file, panels, options.refine, format);
    out.notes.push_back("control nets in metres");
  } else {
    const Meshes meshes = mesh(file, panels, options.refine, out);
    const Frame frame{0, 0, meshes.panels, up_of(file, options)};
    out.bytes = format.text(frame, material_path(target).filename().string());
    if (format.format == FileFormat::obj) out.beside.emplace_back(material_path(target), format_mtl());
    if (format.format == FileFormat::glb) out.notes.push_back("turned so that +Y is up");
  }
  return out;
}

}  // namespace toile
