// SPDX-License-Identifier: GPL-3.0-or-later
// A file on its way from records to panels: pointers followed, matrices applied, and what becomes of every entity.
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <string>

#include "geometry/nurbs_curve.h"
#include "io/iges.h"
#include "io/iges/file.h"
#include "io/iges/parameters.h"
#include "io/iges/topology.h"

namespace toile::iges {

// Composite curves within composite curves, transformations of transformations: deeper means a cycle.
constexpr int max_depth = 16;

class Reading {
 public:
  // Every entity starts in `ledger` as kept.
  Reading(const File& file, std::vector<LedgerEntry>& ledger);

  const File& file;
  Notes notes;

  // What `from` points to; InputError where nothing is there or it is no entity `type`.
  const Entry& entry(int sequence, const Entry& from, const char* role) const;
  const Entry& entry(int sequence, const Entry& from, const char* role, int type) const;
  // Counts a record's characters. Surfaces and curves may be shared, but a small file that shares a large record ten
  // thousand times is an attack: InputError.
  void spend(const Entry& e);
  // The entry's own matrix, with the matrices that it is defined under.
  Eigen::Affine3d transform(const Entry& e);
  // What follows an entity's own parameters: associativities, then properties; the first name (406 form 15) among them.
  std::string name_property(Parameters& in);
  const EdgeList& edges_of(const Entry& e);
  // How far a fitted curve or surface of this size may lie from what the file means.
  double fit_tolerance(double size) const;

  // The ledger. Quarantined stays quarantined, converted doesn't become read.
  void mark(const Entry& e, Disposition disposition, std::string why = {});
  void quarantine(const Entry& e, const std::string& why);
  const std::string& first_failure() const { return first_failure_; }
  void note(const Entry& e, const std::string& kind, const std::string& what);
  // The panel's unit, resolution and where it came from.
  void sign(TrimmedSurface& panel, const Entry& e) const;

 private:
  LedgerEntry& row(const Entry& e) { return ledger_[static_cast<std::size_t>((e.sequence - 1) / 2)]; }

  std::vector<LedgerEntry>& ledger_;
  std::map<int, EdgeList> edge_lists_;
  std::string first_failure_;
  std::size_t spent_ = 0;
};

bool is_identity(const Eigen::Affine3d& t);
Curve3 transformed(const Eigen::Affine3d& t, const Curve3& curve);

// 402 forms that hold members: 1, 7, 9, 14, 15.
bool is_group(const Entry& e);

}  // namespace toile::iges
