// SPDX-License-Identifier: GPL-3.0-or-later
// history.csv: how a run went, a row a frame or a step.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "pipeline/run/measures.h"
#include "pipeline/run/run.h"

namespace toile {

// Columns, SI: frame (last one shown), step, t, dt (of the last step); energies by the names of report.json
// [J]; largest and least strain, weft and warp, over the grid of report.json; iterations of the last step's
// projection, and of all steps; steps redone so far; contacts of the last step (empty where the scene
// has nothing to touch); reaction_K_x, _y, _z: force of pin K on the cloth [N]; point_K_x, _y, _z: the scene's output
// points [m].
//   (1) a row is whole before it is followed by another or by a checkpoint;
//   (2) a run that was taken up has the bytes of one that was never stopped, if it had the history so far.
class History {
 public:
  // `former`: the history of the run that is taken up, of which the rows up to `state` stay; a file that isn't there
  // has none. Throws OutputError.
  History(const Build& build, std::filesystem::path path, const std::filesystem::path& former, const RunState& state);

  // Writes a row where a frame, or a step, has come since the last. For RunHooks::resumable.
  void add(const RunResult& now);

 private:
  std::string header() const;
  std::string row(const RunResult& now) const;
  void append(const std::string& text);

  const Build& build_;
  std::filesystem::path path_;
  std::ofstream out_;
  std::vector<GridSample> samples_;
  int frame_ = -1, step_ = -1;  // of the last row
};

}  // namespace toile
