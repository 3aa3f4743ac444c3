// SPDX-License-Identifier: GPL-3.0-or-later
// IGES 5.3: reading panels from any exporter's file, writing files that every system reads.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/trimmed_surface.h"

namespace toile {

namespace iges {
struct File;
}  // namespace iges

enum class Disposition { read, converted, kept, quarantined };

// What happened to an entity of the file.
struct LedgerEntry {
  int sequence = 0;  // number of its directory entry (odd, as the file counts)
  int line = 0;      // line of the file where the directory entry stands
  int type = 0, form = 0;
  Disposition disposition = Disposition::kept;
  std::string why;  // for converted and quarantined
};

struct PanelFile {
  std::string path;
  std::string unit;  // "MM", "INCH", ... as the file names it
  double metres_per_unit = 1;
  double resolution = 0;               // global field 19, unit of the file
  std::string exporter;                // the program: global fields 5 and 6
  std::map<int, int> entities;         // type -> count
  std::vector<TrimmedSurface> panels;  // every face (144) and every free-standing 128, in file order
  std::vector<LedgerEntry> ledger;
  std::optional<Eigen::Vector3d> up;       // unit vector that points up in the file's axes, where it says so
  std::vector<std::string> warnings;       // one per kind of oddity, with line and entity
  std::vector<std::string> notes;          // decisions that say nothing against the file
  std::string size;                        // of a pattern in several sizes: the one read, "all", or empty
  std::vector<std::string> sizes;          // that the file has
  std::vector<std::string> refused;        // panels that the file means and that can't be: name, place and reason
  std::shared_ptr<const iges::File> file;  // the records, for replay
};

// Throws InputError with file, line, entity and what was expected.
PanelFile read_iges(const std::filesystem::path& path);
PanelFile parse_iges(std::string_view text, const std::string& name);

// How records that the model knows are written: the bytes of the source, or made anew from the model.
enum class IgesMode { replay, rewrite };
std::string format_iges(const PanelFile& file, IgesMode mode = IgesMode::replay);

// The records that were read, each B-spline surface (128) replaced by what `change` makes of it; the geometry must
// stay, for boundaries and model curves are replayed with all the rest. `file` must have its records.
using SurfaceChange = std::function<NurbsSurface(const NurbsSurface&)>;
std::string format_iges(const PanelFile& file, const SurfaceChange& change);

// A face for a new file: net and trims in `face`'s unit; faces of one file share it.
struct OutputFace {
  TrimmedSurface face;
  std::string name;  // 406 form 15
  int level = 0;
  std::optional<std::array<double, 3>> colour;  // rgb, 0..1 (314)
  // For viewing: other programs show the face moved by this [unit of the file], a 124 labelled ASIDE; read_iges()
  // leaves it where it is, to the bit.
  Eigen::Vector3d aside{0, 0, 0};
};
struct IgesHeader {
  std::string product = "toile";
  std::string unit = "MM";   // IGES unit name that agrees with the faces' metres_per_unit
  double resolution = 1e-6;  // unit of the file; raised to the fit error of the model curves where that is larger
  std::optional<Eigen::Vector3d> up;  // said in the start section, for PanelFile::up
  std::map<int, std::string> levels;  // what each level holds, by name (406 form 3)
  std::optional<std::string> date;    // YYYYMMDD.HHNNSS; unset: SOURCE_DATE_EPOCH, else 19700101.000000
};
struct IgesOutput {
  std::string text;
  double largest_curve_fit = 0;  // largest |C3(t) - S(c(t))| over all model curves, unit of the file
};
// Several faces are one group (402 form 7) of the product's name, a face with marks by the group of the two: a file has
// one free shape, for readers that import them one by one.
IgesOutput format_iges(std::span<const OutputFace> faces, const IgesHeader& header);

// Read, write, read: what `toile roundtrip` reports.
struct RoundtripReport {
  int faces = 0, faces_lost = 0, entities = 0, entities_lost = 0;
  bool knots_equal = true, weights_equal = true, points_equal = true, parameter_curves_equal = true;
  std::vector<std::string> differences;  // first of each kind, with panel and entity
  bool exact() const;
};
RoundtripReport roundtrip(const PanelFile& original, IgesMode mode);

}  // namespace toile
