// SPDX-License-Identifier: GPL-3.0-or-later
// A run on disk, to be taken up again by another process.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "geometry/fields.h"
#include "pipeline/run/run.h"

namespace toile {

// One file: a line with the format's number, then binary numbers of this machine, then a checksum. Holds the program's
// version, the keys of the scene with the contents of its files, and the run.
//   (1) read back, `run` goes on with the same bits;
//   (2) a file that is cut short or has a changed byte, of another version, or of a scene that differs in more than
//       [output], until, rest and time_limit, is refused with what differs.
struct SceneMark {
  std::map<std::string, std::string> keys;  // that change what the cloth does; contents in place of file names
  std::uint64_t control_points = 0;         // other programs may make others of the same files
};
void fields(auto& archive, Like<SceneMark> auto& s) {
  archive(s.keys, s.control_points);
}
SceneMark scene_mark(const Build& build);

std::string format_checkpoint(const SceneMark& scene, const RunState& state, const System& system);

// Throws InputError naming `name`, and the key that differs.
RunResult parse_checkpoint(std::string_view bytes, const std::string& name, const Build& build,
                           Workers* workers = nullptr);
RunResult read_checkpoint(const std::filesystem::path& path, const Build& build, Workers* workers = nullptr);

}  // namespace toile
