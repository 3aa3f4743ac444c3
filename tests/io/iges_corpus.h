// The files of tests/corpus/iges: each shows one thing that exporters do (its name says which).
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "io/file.h"
#include "io/iges.h"

namespace toile::test {

inline std::filesystem::path corpus(const std::string& name) {
  return std::filesystem::path(TOILE_TEST_DATA) / "iges" / (name + ".igs");
}

inline std::string corpus_text(const std::string& name) {
  return read_file(corpus(name));
}

inline PanelFile read_corpus(const std::string& name) {
  return parse_iges(corpus_text(name), name + ".igs");
}

// Names of all files in a folder of the corpus, sorted.
inline std::vector<std::string> corpus_names(const std::string& folder = "") {
  std::vector<std::string> names;
  const std::filesystem::path root = std::filesystem::path(TOILE_TEST_DATA) / "iges";
  for (const auto& entry : std::filesystem::directory_iterator(root / folder))
    if (entry.path().extension() == ".igs")
      names.push_back((folder.empty() ? "" : folder + "/") + entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

inline bool has_warning(const PanelFile& file, const std::string& part) {
  return std::any_of(file.warnings.begin(), file.warnings.end(),
                     [&](const std::string& w) { return w.find(part) != std::string::npos; });
}

// What the call throws as InputError; empty if it doesn't.
template <class Error, class Call>
std::string message_of(Call&& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

}  // namespace toile::test
