// SPDX-License-Identifier: GPL-3.0-or-later
// An IGES file as it stands: sections, directory entries and parameter records, before anybody asks what they mean.
// [IGES 5.3, section 2.2]
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace toile::iges {

struct Delimiters {
  char parameter = ',';
  char record = ';';
};

// Global section, fields 3 to 25; absent fields keep the standard's defaults.
struct Global {
  std::vector<std::string> fields;  // 3 to the last, strings without their count, numbers as written
  std::vector<bool> is_text;        // which of them were Hollerith strings
  std::string product, system, preprocessor;
  std::string unit;  // canonical name: "MM", "INCH", ...
  int unit_flag = 1;
  double scale = 1;                 // field 13: length in the model / length in the world
  double metres_per_unit = 0.0254;  // of a model length: the unit divided by the scale
  double resolution = 0;            // field 19
};

// One directory entry (two lines) and where its parameter record stands.
struct Entry {
  int sequence = 0;  // odd: 1, 3, 5, ... by position
  int line = 0;      // of the file
  int type = 0, form = 0;
  int level = 0, transform = 0, colour = 0;
  int subordinate = 0;  // status digits 3-4: 0 independent, 1 physically, 2 logically dependent, 3 both
  std::string label;    // with its subscript
  std::array<std::string_view, 2> cards;  // columns 1 to 72, or less
  int first = 0, count = 0;  // parameter lines [first, first + count) of File::parameter_lines; count 0: none found
};

struct ParameterLine {
  std::size_t begin = 0;  // in File::parameters; every line takes at least 64 characters there
  int line = 0;           // of the file
  int owner = 0;          // columns 65 to 72: the directory entry that it belongs to
};

// What a reader noticed, once per kind: the first message and how often.
class Notes {
 public:
  void add(const std::string& kind, std::string message);
  std::vector<std::string> list() const;  // in the order of first appearance

 private:
  struct Note {
    std::string message;
    int count = 0;
  };
  std::vector<Note> notes_;
  std::map<std::string, std::size_t> index_;  // by kind
};

struct File {
  File() = default;
  File(const File&) = delete;  // views point into `text`
  File& operator=(const File&) = delete;

  std::string name;  // for messages
  std::string text;  // the bytes as read
  Delimiters delimiters;
  std::vector<std::string_view> start;
  Global global;
  std::vector<Entry> entries;
  std::string parameters;  // columns 1 to 64 (or 65) of all parameter lines, one after another
  std::vector<ParameterLine> parameter_lines;
  int global_line = 1;
  bool terminated = false;  // a terminate line was there
  Notes notes;

  // The entry with this directory number; null for 0, even or foreign numbers.
  const Entry* find(int sequence) const;
  // Text of an entry's record, comments included.
  std::string_view record(const Entry& entry) const;
  // `panel.igs:412: entity 128: ` for an entry, at its directory line or a given line.
  std::string place(const Entry& entry, int line = 0) const;
};

// Splits bytes into sections: any line ends or none, misaligned columns, lines after T, control-Z, wrong counts.
// Throws InputError where there is no directory to speak of, or where the file was cut off before its last record
// ended.
std::shared_ptr<const File> parse_file(std::string text, const std::string& name);

// Length units by flag (1 to 11) or by name.
struct Unit {
  int flag;
  const char* name;
  double metres;
};
std::optional<Unit> unit_of_flag(int flag);
std::optional<Unit> unit_of_name(std::string_view name);

}  // namespace toile::iges
