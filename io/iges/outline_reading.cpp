// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/iges/outline_reading.h"

#include <array>
#include <map>
#include <set>

#include "geometry/error.h"
#include "io/iges/curve_reading.h"
#include "io/iges/entity.h"
#include "io/iges/topology.h"
#include "io/outlines.h"

namespace toile::iges {

bool holds_faces(const File& file) {
  constexpr std::array<int, 19> types{108, 114, 118, 120, 122, 128, 140, 141, 142, 143,
                                      144, 186, 190, 192, 194, 196, 198, 510, 514};
  return std::ranges::any_of(file.entries,
                             [&](const Entry& e) { return std::ranges::find(types, e.type) != types.end(); });
}

std::vector<TrimmedSurface> outline_panels(Reading& reading, std::vector<std::string>& refused) {
  std::set<int> parts;  // of composite curves and of definitions
  for (const Entry& e : reading.file.entries) {
    if (e.type != 102 && e.type != 308) continue;
    try {
      Parameters in(reading.file, e);
      for (const int sequence : e.type == 102 ? read_composite(in) : read_definition(in).members)
        parts.insert(sequence);
    } catch (const InputError&) {
      // Reported where the entity itself is read.
    }
  }
  std::map<std::string, int> names;
  std::vector<LooseCurve> curves;
  std::vector<LoosePoint> points;
  for (const Entry& e : reading.file.entries) {
    const Kind* kind = find_kind(e.type);
    const bool curve = e.type == 102 || e.type == 130 || (kind && kind->curve);
    const bool drawing = e.type == 106 && e.form >= 20 && e.form != 63;  // centre lines, hatching, witness lines
    if (parts.count(e.sequence) != 0 || drawing || !(curve || e.type == 116 || e.type == 212)) continue;
    try {
      Parameters in(reading.file, e, &reading.notes);
      const auto add_point = [&](const Eigen::Vector3d& at, const std::string& words) {
        points.push_back({e.sequence, e.label, reading.transform(e) * at, words});
        reading.mark(e, Disposition::read);
      };
      if (e.type == 116) {
        add_point(read_point(in).x, "");
      } else if (e.type == 212) {
        for (const NoteString& line : read_note(in)) add_point(line.at, line.text);
      } else if (e.type == 106 && e.form <= 3) {
        const CopiousData data = read_copious(in);
        const std::size_t width = data.kind == 1 ? 2 : data.kind == 2 ? 3 : 6;
        for (std::size_t k = 0; k + width <= data.numbers.size(); k += width)
          add_point({data.numbers[k], data.numbers[k + 1], data.kind == 1 ? data.height : data.numbers[k + 2]}, "");
      } else {
        LooseCurve loose{e.sequence, {}, curves_of(reading, e.sequence, e, "curve")};
        // The pointers to properties stand behind the entity's own parameters.
        if (kind && kind->curve) {
          kind->curve(in);
          loose.name = reading.name_property(in);
        } else if (e.type == 102) {
          read_composite(in);
          loose.name = reading.name_property(in);
        }
        if (loose.name.empty()) loose.name = e.label;
        ++names[loose.name];
        curves.push_back(std::move(loose));
      }
    } catch (const Error& error) {
      reading.quarantine(e, error.what());
    }
  }
  if (curves.empty()) return {};
  Outlines found = find_outlines(std::move(curves), points, reading.file.global.resolution);
  for (const OutlineNote& n : found.notes) {
    const Entry& e = *reading.file.find(n.id);
    if (n.refused) {
      TrimmedSurface of;
      reading.sign(of, e);
      refused.push_back(of.source + ": " + n.what);
    } else {
      reading.note(e, "outline " + n.what, n.what);
    }
  }
  for (std::size_t k = 0; k < found.panels.size(); ++k) {
    TrimmedSurface& panel = found.panels[k];
    const Entry& e = *reading.file.find(found.ids[k]);
    // A label that many entities carry ("LINE", "COMPCURV") is no name.
    if (names[panel.name] > 1) panel.name.clear();
    reading.sign(panel, e);
  }
  return std::move(found.panels);
}

}  // namespace toile::iges
