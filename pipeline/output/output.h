// SPDX-License-Identifier: GPL-3.0-or-later
// What a run leaves behind: draped.igs, frames, the picture, the report.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "io/frame.h"
#include "io/iges.h"
#include "pipeline/run/measures.h"
#include "pipeline/run/run.h"

namespace toile {

// The file of a state: per panel the flat face (level 1, "NAME flat", as the source has it on the run's knots) and the
// draped one (level 2, "NAME draped", scene axes), in the source's unit with the source's trims. Panels of several
// units come in the first one's. Other programs show the flat faces beside the drape (OutputFace::aside).
//   (1) S_draped(u, v) times the unit is the state's place of that material point within rounding;
//   (2) both faces have the same knots and weights, and contain the file's knots.
IgesOutput draped_file(const Build& build, const Eigen::VectorXd& q);

// Frames to DIR/frames in the scene's formats; `written`: times of those that a resumed run has made before.
class FrameWriter {
 public:
  FrameWriter(const Build& build, std::filesystem::path directory, const std::vector<double>& written = {});
  ~FrameWriter();
  void write(const RunFrame& frame);
  // Bytes of preview.png of a state; empty where the program draws no pictures.
  std::string preview(const System& system, const Eigen::VectorXd& q) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// report.json as pipeline/output/README.md, "The report", says. Only `seconds`, `counters` and `wall_*` differ between
// runs of one scene.
nlohmann::ordered_json report_json(const Build& build, const RunResult& result, const StateMeasures& measures,
                                   double write_seconds);

// Names and joules, as report.json and history.csv have them.
std::vector<std::pair<const char*, double>> energy_entries(const EnergyBalance& energy);

// Makes the directory, or empties a former run's files out of it where `overwrite` allows; nothing else in it is
// touched. Throws OutputError where it holds anything and overwrite is false.
void prepare_directory(const std::filesystem::path& directory, bool overwrite);

}  // namespace toile
