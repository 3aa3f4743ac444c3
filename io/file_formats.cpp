// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/file_formats.h"

#include <algorithm>
#include <cctype>

#include "io/mesh_files.h"
#include "io/net_files.h"
#include "io/obj.h"
#include "io/vtu.h"

namespace toile {
namespace {

template <std::string (*format)(const Frame&)>
std::string text(const Frame& frame, std::string_view) {
  return format(frame);
}

std::string cloth_of_vtu(const Frame& frame, std::string_view) {
  return format_vtu(frame).triangles;
}

constexpr NamedFormat formats[] = {
    {FileFormat::iges, "iges", ".igs", FormatContent::faces, true, nullptr},
    {FileFormat::svg, "svg", ".svg", FormatContent::drawing, false, nullptr},
    {FileFormat::obj, "obj", ".obj", FormatContent::triangles, true, format_obj},
    {FileFormat::ply, "ply", ".ply", FormatContent::triangles, true, text<format_ply>},
    {FileFormat::stl, "stl", ".stl", FormatContent::triangles, true, text<format_stl>},
    {FileFormat::glb, "glb", ".glb", FormatContent::triangles, true, text<format_glb>},
    {FileFormat::vtu, "vtu", ".vtu", FormatContent::triangles, true, cloth_of_vtu},
    {FileFormat::json, "json", ".json", FormatContent::nets, true, text<format_net_json>},
    {FileFormat::csv, "csv", ".csv", FormatContent::nets, true, text<format_net_csv>},
};

}  // namespace

std::span<const NamedFormat> file_formats() {
  return formats;
}

const NamedFormat& named_format(FileFormat format) {
  return *std::ranges::find(formats, format, &NamedFormat::format);
}

std::optional<FileFormat> format_with_ending(std::string_view ending) {
  std::string lower(ending);
  std::ranges::transform(lower, lower.begin(), [](unsigned char c) { return std::tolower(c); });
  if (lower == ".iges") return FileFormat::iges;
  const auto* found = std::ranges::find(formats, lower, &NamedFormat::ending);
  return found == std::end(formats) ? std::nullopt : std::optional(found->format);
}

std::vector<std::string> frame_format_names() {
  std::vector<std::string> names;
  for (const NamedFormat& format : formats)
    if (format.of_frames) names.emplace_back(format.name);
  return names;
}

}  // namespace toile
