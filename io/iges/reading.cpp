// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/iges/reading.h"

#include <algorithm>
#include <set>

#include "geometry/error.h"
#include "io/iges/cards.h"
#include "io/iges/entity.h"

namespace toile::iges {

Reading::Reading(const File& f, std::vector<LedgerEntry>& ledger) : file(f), notes(f.notes), ledger_(ledger) {
  for (const Entry& e : file.entries)
    ledger_.push_back({e.sequence, e.line, e.type, e.form, Disposition::kept,
                       find_kind(e.type) ? "no face uses it" : "not known here; its record is kept as it stands"});
}

const Entry& Reading::entry(int sequence, const Entry& from, const char* role) const {
  const Entry* found = file.find(sequence);
  if (!found)
    throw InputError(file.place(from) + "pointer " + std::to_string(sequence) + " to its " + role +
                     " leads nowhere, must be an odd number up to " + std::to_string(2 * file.entries.size() - 1));
  return *found;
}

const Entry& Reading::entry(int sequence, const Entry& from, const char* role, int type) const {
  const Entry& found = entry(sequence, from, role);
  if (found.type != type)
    throw InputError(file.place(from) + "its " + role + " is an entity " + std::to_string(found.type) + ", must be " +
                     std::to_string(type));
  return found;
}

void Reading::spend(const Entry& e) {
  const std::size_t limit = (std::size_t{64} << 20) + 16 * file.text.size();
  spent_ += file.record(e).size();
  if (spent_ > limit) throw InputError(file.place(e) + "its record is shared too often for the size of the file");
}

Eigen::Affine3d Reading::transform(const Entry& e) {
  Eigen::Affine3d result = Eigen::Affine3d::Identity();
  const Entry* at = &e;
  for (int depth = 0; at->transform != 0; ++depth) {
    if (depth == max_depth) throw InputError(file.place(e) + "its transformations form a cycle");
    const Entry& matrix = entry(at->transform, *at, "transformation");
    if (matrix.type != 124)
      throw InputError(file.place(*at) + "its transformation is an entity " + std::to_string(matrix.type) +
                       ", must be 124");
    Parameters in(file, matrix, &notes);
    const Eigen::Affine3d own = read_transform(in);
    if (matrix.label == aside_label) {
      mark(matrix, Disposition::converted, "moves panels aside for viewing: they are read where they would be without");
    } else {
      result = own * result;
      mark(matrix, Disposition::read);
    }
    at = &matrix;
  }
  return result;
}

std::string Reading::name_property(Parameters& in) {
  std::string name;
  try {
    for (int list = 0; list < 2; ++list) {
      if (in.left() <= 0) return name;
      const int n = in.integer("number of associated entities");
      if (n < 0 || n > in.left()) return name;
      for (int i = 0; i < n; ++i) {
        const Entry* e = file.find(std::abs(in.pointer("pointer to an associated entity")));
        if (!e || e->type != 406 || e->form != 15 || !name.empty()) continue;
        Parameters property(file, *e, &notes);
        name = read_name(property).value_or("");
        mark(*e, Disposition::read);
      }
    }
  } catch (const InputError& error) {
    notes.add("bad property", error.what());
  }
  return name;
}

const EdgeList& Reading::edges_of(const Entry& e) {
  const auto found = edge_lists_.find(e.sequence);
  if (found != edge_lists_.end()) return found->second;
  Parameters in(file, e, &notes);
  const EdgeList& list = edge_lists_[e.sequence] = read_edge_list(in);
  mark(e, Disposition::read);
  std::set<int> vertex_lists;
  for (const Edge& edge : list.edges) vertex_lists.insert({edge.vertices[0], edge.vertices[2]});
  for (const int sequence : vertex_lists)
    if (const Entry* vertices = file.find(sequence); vertices && vertices->type == 502)
      mark(*vertices, Disposition::read);
  return list;
}

double Reading::fit_tolerance(double size) const {
  const double resolution = file.global.resolution > 0 ? file.global.resolution : 1e-7 * size;
  return std::clamp(resolution, 1e-9 * size, 1e-5 * size);
}

void Reading::mark(const Entry& e, Disposition disposition, std::string why) {
  LedgerEntry& row = this->row(e);
  if (row.disposition == Disposition::quarantined) return;
  if (row.disposition == Disposition::converted && disposition == Disposition::read) return;
  row.disposition = disposition;
  row.why = std::move(why);
}

void Reading::quarantine(const Entry& e, const std::string& why) {
  LedgerEntry& row = this->row(e);
  row.disposition = Disposition::quarantined;
  row.why = why;
  notes.add("quarantine " + std::to_string(e.sequence), why + " (directory entry " + std::to_string(e.sequence) +
                                                            ", entity " + std::to_string(e.type) + ", is left out)");
  if (first_failure_.empty()) first_failure_ = why;
}

void Reading::note(const Entry& e, const std::string& kind, const std::string& what) {
  notes.add(kind, file.place(e) + what);
}

void Reading::sign(TrimmedSurface& panel, const Entry& e) const {
  panel.metres_per_unit = file.global.metres_per_unit;
  panel.resolution = file.global.resolution;
  panel.source = file.name + ":" + std::to_string(e.line) + ": entity " + std::to_string(e.type);
}

bool is_identity(const Eigen::Affine3d& t) {
  return t.linear() == Eigen::Matrix3d::Identity() && t.translation() == Eigen::Vector3d::Zero();
}

Curve3 transformed(const Eigen::Affine3d& t, const Curve3& curve) {
  if (is_identity(t)) return curve;
  return Curve3(curve.knots(), t * curve.points(), curve.weights());
}

bool is_group(const Entry& e) {
  return e.type == 402 && (e.form == 1 || e.form == 7 || e.form == 9 || e.form == 14 || e.form == 15);
}

}  // namespace toile::iges
