// SPDX-License-Identifier: GPL-3.0-or-later
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

// The file with more entities at its end, each a record ("102,2,1,3;").
inline std::string with_entities(const std::string& text, const std::vector<std::string>& records) {
  std::vector<std::string> lines;
  for (std::size_t at = 0, end = 0; at < text.size(); at = end + 1) {
    end = std::min(text.find('\n', at), text.size());
    lines.push_back(text.substr(at, end - at));
  }
  const auto is = [](char section) {
    return [=](const std::string& line) { return line.size() > 72 && line[72] == section; };
  };
  for (const std::string& record : records) {
    const auto directory = std::count_if(lines.begin(), lines.end(), is('D'));
    const auto parameters = std::count_if(lines.begin(), lines.end(), is('P'));
    const auto padded = [](std::string field, std::size_t width) {
      return std::string(width - std::min(width, field.size()), ' ') + field;
    };
    const std::string type = padded(record.substr(0, record.find(',')), 8), one = padded("1", 8), none = padded("0", 8);
    const auto line = [&](std::string data, char section, std::ptrdiff_t number) {
      data.resize(72, ' ');
      return data + section + padded(std::to_string(number), 7);
    };
    const std::string first = type + padded(std::to_string(parameters + 1), 8) + std::string(48, ' ') + "00000000";
    std::vector<std::string> data{""};
    for (std::size_t at = 0, end = 0; at < record.size(); at = end) {
      end = std::min(record.find(',', at), record.size() - 1) + 1;
      if (data.back().size() + end - at > 64) data.emplace_back();
      data.back() += record.substr(at, end - at);
    }
    const std::string count = padded(std::to_string(data.size()), 8);
    const std::string second = type + none + none + count + (type == padded("406", 8) ? padded("15", 8) : one);
    const auto after_directory = std::find_if(lines.begin(), lines.end(), is('P'));
    const auto at = lines.insert(after_directory, line(first, 'D', directory + 1));
    lines.insert(at + 1, line(second, 'D', directory + 2));
    for (std::size_t k = 0; k < data.size(); ++k) {
      data[k].resize(64, ' ');
      const auto after_parameters = std::find_if(lines.rbegin(), lines.rend(), is('P')).base();
      lines.insert(after_parameters, line(data[k] + padded(std::to_string(directory + 1), 8), 'P',
                                          parameters + 1 + static_cast<std::ptrdiff_t>(k)));
    }
  }
  std::string out;
  for (const std::string& line : lines) out += line + '\n';
  return out;
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
