// A scene from a pattern: `toile init --pattern`.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/pattern_json.h"

namespace toile {

struct PatternScene {
  std::string text;                   // scene.toml
  std::vector<std::string> notes;     // what was decided, for the console
  std::vector<std::string> warnings;  // what the user should look at
};

// Complete and valid: panels in their places, each hung by its highest edges; a seam for every stitch, its direction
// the one that brings the placed ends together; the body as obstacle, the pattern moved to it; how the free upper edges
// compare with the body's girth there. Names of files are written relative to the scene where they lie below it.
// `pattern` is any panel file: without placements and stitches the panels keep their places in it.
PatternScene pattern_scene(const std::filesystem::path& pattern, const std::optional<std::filesystem::path>& body,
                           const std::filesystem::path& scene);

// Should side b run against its curve, so that the ends of the two placed curves meet? `doubt` where both ways are
// nearly as good.
struct SeamDirection {
  bool reverse = false, doubt = false;
};
SeamDirection seam_direction(const Pattern& pattern, const Stitch& stitch);

}  // namespace toile
