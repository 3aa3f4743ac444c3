#include "pipeline/convert.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <limits>
#include <numbers>

#include "geometry/error.h"
#include "io/mesh_files.h"
#include "io/obj.h"
#include "io/vtu.h"
#include "trimming/triangulation.h"

namespace toile {
namespace {

std::string ending_of(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending;
}

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

std::string iges_text(const PanelFile& file, const std::string& name, const InspectOptions& options, Conversion& out) {
  if (!file.file || file.panels.empty()) return new_iges(file, options, name, out);
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

// Panels as they lie in the file, in metres, with their triangles.
struct MeshedPanels {
  std::vector<TrimmedSurface> faces;
  std::vector<NurbsSurface> surfaces;
  std::vector<TrimmedTriangles> triangles;
  std::vector<std::vector<ConstraintPoint>> points;
  std::vector<FramePanel> panels;
};

void mesh(const PanelFile& file, const InspectOptions& options, MeshedPanels& out, Conversion& conversion) {
  std::size_t count = 0;
  double smallest_angle = std::numbers::pi, shortest = std::numeric_limits<double>::infinity(), longest = 0;
  for (const TrimmedSurface& panel : file.panels) {
    TrimmedSurface face = panel;
    face.surface = refined(face, options);
    for (const LoopRepair& repair : validate_loops(face))
      conversion.warnings.push_back(fmt::format("panel '{}': loop {}: {}", face.name, repair.loop, repair.what));
    const TrimTopology topology = trace_trims(face);
    out.triangles.push_back(triangulate(face, topology));
    const TrimmedTriangles& triangles = out.triangles.back();
    count += triangles.triangles.size();
    smallest_angle = std::min(smallest_angle, triangles.quality.smallest_angle);
    shortest = std::min(shortest, face.metres_per_unit * triangles.quality.shortest_edge);
    longest = std::max(longest, face.metres_per_unit * triangles.quality.longest_edge);
    out.points.push_back(constraint_points(face, topology));
    out.surfaces.push_back(face.surface.with_points(face.metres_per_unit * face.surface.points()));
    out.faces.push_back(std::move(face));
  }
  for (std::size_t k = 0; k < out.faces.size(); ++k) {
    FramePanel panel;
    panel.name = out.faces[k].name;
    panel.surface = &out.surfaces[k];
    panel.face = &out.faces[k];
    panel.triangles = &out.triangles[k];
    panel.points = out.points[k];
    out.panels.push_back(std::move(panel));
  }
  conversion.notes.push_back(
      fmt::format("{} triangles in {} panels, metres; smallest angle {:.3g} degrees, edges {:.3g} to {:.3g} m", count,
                  out.panels.size(), smallest_angle * 180 / std::numbers::pi, shortest, longest));
}

using Format = std::string (*)(const Frame&);
Format mesh_format(const std::string& ending) {
  static constexpr std::array<std::pair<const char*, Format>, 5> formats{
      {{".obj", format_obj},
       {".ply", format_ply},
       {".stl", format_stl},
       {".glb", format_glb},
       {".vtu", [](const Frame& frame) { return format_vtu(frame).triangles; }}}};
  const auto found = std::ranges::find(formats, ending, [](const auto& f) { return std::string_view(f.first); });
  return found == formats.end() ? nullptr : found->second;
}

}  // namespace

Conversion convert(const PanelFile& file, const std::filesystem::path& target, const InspectOptions& options) {
  const std::string ending = ending_of(target);
  const bool iges = ending == ".igs" || ending == ".iges";
  const Format format = mesh_format(ending);
  if (!iges && !format && ending != ".svg") {
    throw InputError(fmt::format("{}: can't write '{}' files; use .igs, .svg, .obj, .ply, .stl, .glb or .vtu",
                                 target.string(), ending));
  }
  if (file.panels.empty() && !iges) throw InputError(fmt::format("{}: holds no face and no surface", file.path));
  Conversion out;
  out.warnings = file.warnings;
  if (iges) {
    out.bytes = iges_text(file, target.stem().string(), options, out);
  } else if (format) {
    MeshedPanels meshed;
    mesh(file, options, meshed, out);
    out.bytes = format({0, 0, meshed.panels});
  } else {
    out.bytes = print_svg(file);
    out.notes.push_back("print at 100 %: one unit is a millimetre");
  }
  return out;
}

}  // namespace toile
