// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>

#include "geometry/error.h"
#include "io/iges/file.h"
#include "io/iges/parameters.h"

namespace toile::iges {

namespace {

constexpr std::size_t section_column = 72;  // 0-based column of the section letter
constexpr double smallest_scale = 1e-12;    // of a model, and its inverse the largest

bool is_blank(char c) {
  return static_cast<unsigned char>(c) <= ' ';
}
bool is_digit(char c) {
  return '0' <= c && c <= '9';
}
bool is_section(char c) {
  return c == 'S' || c == 'G' || c == 'D' || c == 'P' || c == 'T';
}

std::string_view trim(std::string_view s) {
  while (!s.empty() && is_blank(s.front())) s.remove_prefix(1);
  while (!s.empty() && is_blank(s.back())) s.remove_suffix(1);
  return s;
}

std::string printable(std::string_view s, std::size_t most = 30) {
  std::string shown;
  for (char c : s.substr(0, most)) shown += 32 <= c && c < 127 ? c : '?';
  return shown;
}

struct Line {
  std::string_view data;  // what stands before the section letter
  char section = 0;       // 0: none found
  bool aligned = true;
  int number = 0;  // what stands behind it; 0: nothing readable
};

char upper(char c) {
  return 'a' <= c && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
}

bool ends_number(std::string_view line, std::size_t at) {
  return at + 1 < line.size() && is_digit(line[at]) && !is_digit(line[at + 1]);
}

Line classify(std::string_view line) {
  while (!line.empty() && is_blank(line.back())) line.remove_suffix(1);
  const char letter = line.size() > section_column ? upper(line[section_column]) : ' ';
  if (is_section(letter)) {
    const std::string_view number = line.substr(section_column + 1, 7);
    if (std::all_of(number.begin(), number.end(), [](char c) { return is_digit(c) || c == ' '; }))
      return {line.substr(0, section_column), letter, true, parse_integer(number).value_or(0)};
  }
  // Elsewhere: a letter followed by up to seven digits (blank-padded) at the end of the line.
  std::size_t i = line.size();
  while (i > 0 && is_digit(line[i - 1])) --i;
  const std::string_view number = line.substr(i);
  while (i > 0 && line[i - 1] == ' ' && line.size() - i < 7) --i;
  if (!number.empty() && i > 0 && is_section(line[i - 1]) && line.size() - i <= 7) {
    const std::size_t shift = i - 1 > section_column ? i - 1 - section_column : 0;
    std::string_view data = line.substr(0, i - 1);
    // The whole line stands further right: then the first field of a directory line, a number, ends there too.
    if (line[i - 1] == 'D' && shift <= 8 && trim(data.substr(0, shift)).empty() && !ends_number(data, 7) &&
        ends_number(data, 7 + shift))
      data.remove_prefix(shift);
    return {data, line[i - 1], false, parse_integer(number).value_or(0)};
  }
  // The letter stands where it should, with anything but a number behind it.
  if (is_section(letter) && line.size() <= 80) return {line.substr(0, section_column), letter, true, 0};
  return {line, 0, false, 0};
}

// Calls visit(line, number) for every line: ended by CR, LF or both, or 80 columns each where there are no line ends.
template <class Visit>
void for_each_line(std::string_view text, Visit&& visit) {
  int number = 0;
  std::size_t i = 0;
  // The next end of each kind, sought once: a file has one kind or both.
  std::size_t cr = text.find('\r'), lf = text.find('\n');
  while (i < text.size()) {
    if (text[i] == '\x1A') return;
    if (cr < i) cr = text.find('\r', i);
    if (lf < i) lf = text.find('\n', i);
    const std::size_t end = std::min({cr, lf, text.size()});
    std::string_view line = text.substr(i, end - i);
    while (line.size() > 80 + section_column && is_section(line[section_column]) &&
           is_section(line[80 + section_column])) {
      if (!visit(line.substr(0, 80), ++number)) return;
      line.remove_prefix(80);
    }
    if (!visit(line, ++number)) return;
    i = end + 1;
    if (end + 1 < text.size() && text[end] == '\r' && text[end + 1] == '\n') ++i;
  }
}

std::string_view field(std::string_view card, std::size_t index) {
  return card.size() > 8 * index ? trim(card.substr(8 * index, 8)) : std::string_view();
}

int integer_field(std::string_view card, std::size_t index) {
  const std::string_view text = field(card, index);
  return text.empty() ? 0 : parse_integer(text).value_or(0);
}

Entry read_entry(std::string_view first, std::string_view second, int line, int sequence) {
  Entry entry;
  entry.sequence = sequence;
  entry.line = line;
  entry.cards = {first, second};
  entry.type = parse_integer(field(first, 0)).value_or(integer_field(second, 0));
  entry.first = integer_field(first, 1);  // as the file says, from 1; resolved later
  entry.count = integer_field(second, 3);
  entry.level = integer_field(first, 4);
  entry.transform = integer_field(first, 6);
  std::string status(first.size() > 64 ? first.substr(64, 8) : std::string_view());
  if (status.size() == 8 && (is_digit(status[3]) || is_digit(status[2])))
    entry.subordinate = (is_digit(status[2]) ? status[2] - '0' : 0) * 10 + (is_digit(status[3]) ? status[3] - '0' : 0);
  entry.colour = integer_field(second, 2);
  entry.form = integer_field(second, 4);
  entry.label = field(second, 7);
  const std::string_view subscript = field(second, 8);
  if (!entry.label.empty() && !subscript.empty() && subscript != "0") entry.label += subscript;
  return entry;
}

// A string with a wrong count may swallow the next fields or fall in two. The unit's flag and name tell by how much the
// fields are shifted; blanks before the scale, or one field less, put them right. False: nothing to do.
bool align_fields(Global& g) {
  constexpr std::size_t flag =
      14 - 3;  // the standard's number of the unit's flag; its name follows, the scale precedes
  const auto names_unit = [&](std::size_t k) {
    return k + 1 < g.fields.size() && unit_of_flag(parse_integer(g.fields[k]).value_or(0)) && g.is_text[k + 1] &&
           unit_of_name(g.fields[k + 1]);
  };
  if (names_unit(flag) || (flag + 1 < g.fields.size() && unit_of_name(g.fields[flag + 1]))) return false;
  for (std::size_t k = flag - 4; k <= flag + 4; ++k) {
    if (!names_unit(k)) continue;
    const auto scale = static_cast<std::ptrdiff_t>(std::min(k, flag)) - 1;
    if (k < flag) {
      g.fields.insert(g.fields.begin() + scale, flag - k, std::string());
      g.is_text.insert(g.is_text.begin() + scale, flag - k, false);
    } else {
      g.fields.erase(g.fields.begin() + scale, g.fields.begin() + static_cast<std::ptrdiff_t>(k) - 1);
      g.is_text.erase(g.is_text.begin() + scale, g.is_text.begin() + static_cast<std::ptrdiff_t>(k) - 1);
    }
    return true;
  }
  return false;
}

void read_global(File& file, std::string_view text) {
  std::size_t i = 0;
  auto skip_blanks = [&] {
    while (i < text.size() && is_blank(text[i])) ++i;
  };
  auto delimiter = [&](char otherwise) {
    skip_blanks();
    if (i + 2 < text.size() && text[i] == '1' && (text[i + 1] == 'H' || text[i + 1] == 'h')) {
      const char c = text[i + 2];
      i += 3;
      if (is_blank(c) || is_digit(c) || std::string_view("+-.DEHdeh").find(c) != std::string_view::npos)
        throw InputError(file.name + ":" + std::to_string(file.global_line) + ": global section: the delimiter is '" +
                         printable({&c, 1}) + "', must be none of digits, blanks, + - . D E H");
      return c;
    }
    return otherwise;
  };
  Delimiters& d = file.delimiters;
  d.parameter = delimiter(',');
  skip_blanks();
  if (i < text.size() && text[i] == d.parameter) ++i;
  d.record = delimiter(';');
  skip_blanks();
  bool ended = i < text.size() && text[i] == d.record;
  if (i < text.size() && text[i] == d.parameter) ++i;
  if (d.parameter == d.record)
    throw InputError(file.name + ":" + std::to_string(file.global_line) +
                     ": global section: parameter and record delimiter are the same");
  Tokens tokens;
  if (!ended) {
    tokenize(text.substr(std::min(i, text.size())), d, tokens);
    if (!tokens.terminated)
      file.notes.add("global end", file.name + ":" + std::to_string(file.global_line) +
                                       ": global section: no record delimiter at its end");
    if (tokens.wrong_count)
      file.notes.add("global hollerith",
                     file.name + ":" + std::to_string(file.global_line) + ": global section: a string count is wrong");
  }
  Global& g = file.global;
  for (const Token& t : tokens.list) {
    g.fields.emplace_back(t.text);
    g.is_text.push_back(t.is_string);
  }
  auto at = [&](std::size_t number) {  // by the standard's numbers, 3 to 26
    return number - 3 < g.fields.size() ? std::string(trim(g.fields[number - 3])) : std::string();
  };
  auto note = [&](const std::string& what) {
    file.notes.add(what, file.name + ":" + std::to_string(file.global_line) + ": global section: " + what);
  };
  if (align_fields(g)) note("a string has a wrong count; the unit's name shows by how much the fields are shifted");
  g.product = at(3);
  g.system = at(5);
  g.preprocessor = at(6);
  if (const std::string scale = at(13); !scale.empty()) {
    const std::optional<double> value = parse_real(scale);
    if (value && *value >= smallest_scale && *value <= 1 / smallest_scale) {
      g.scale = *value;
    } else {
      note("model scale is '" + printable(scale) + "', must be from 1e-12 to 1e12; 1 taken");
    }
  }
  const std::string flag = at(14), name = at(15);
  g.unit_flag = flag.empty() ? 0 : parse_integer(flag).value_or(-1);
  std::optional<Unit> by_name = unit_of_name(name);
  std::optional<Unit> unit = unit_of_flag(g.unit_flag);
  if (unit) {
    if (by_name && by_name->flag != unit->flag)
      note("unit flag " + flag + " and unit name '" + printable(name) + "' disagree; the flag is taken");
  } else {
    unit = by_name;
    if (!unit) {
      unit = unit_of_flag(1);
      note(flag.empty() && name.empty() ? "no unit given; inches taken, as the standard says"
                                        : "unit flag '" + printable(flag) + "' and unit name '" + printable(name) +
                                              "' are not known; inches taken");
    } else if (g.unit_flag != 3) {
      note("unit flag '" + printable(flag) + "' is not known; the unit name '" + printable(name) + "' is taken");
    }
    g.unit_flag = unit->flag;
  }
  g.unit = unit->name;
  g.metres_per_unit = unit->metres / g.scale;
  if (const std::string resolution = at(19); !resolution.empty()) {
    const std::optional<double> value = parse_real(resolution);
    if (value && *value >= 0) {
      g.resolution = *value;
    } else {
      note("resolution is '" + printable(resolution) + "', must not be negative; 0 taken");
    }
  }
}

// Whether a parameter line begins a record of this type.
bool begins_record(const File& file, int line, int type) {
  if (line < 0 || line >= static_cast<int>(file.parameter_lines.size())) return false;
  const std::string_view text =
      std::string_view(file.parameters).substr(file.parameter_lines[static_cast<std::size_t>(line)].begin, 64);
  return parse_integer(
             text.substr(0, text.find_first_of(std::string{file.delimiters.parameter, file.delimiters.record})))
             .value_or(-1) == type;
}

// Parameter lines of every entry: from its pointer as long as the lines carry its number; where the pointer leads
// elsewhere, the first line that carries its number; where lines carry no number of an entry, up to the next entry's.
// No line belongs to two entries. Where more of the pointers lead to a record of the right type than of the numbers on
// the lines, no number on a line counts.
void resolve_records(File& file) {
  auto& lines = file.parameter_lines;
  const int total = static_cast<int>(lines.size());
  auto owner = [&](int i) { return lines[static_cast<std::size_t>(i)].owner; };
  std::vector<int> first_of_owner(file.entries.size(), -1);  // by entry
  for (int i = total - 1; i >= 0; --i)
    if (const Entry* e = file.find(owner(i))) first_of_owner[static_cast<std::size_t>(e - file.entries.data())] = i;
  std::size_t by_pointer = 0, by_number = 0;
  for (std::size_t k = 0; k < file.entries.size(); ++k) {
    by_pointer += begins_record(file, file.entries[k].first - 1, file.entries[k].type) ? 1 : 0;
    by_number += begins_record(file, first_of_owner[k], file.entries[k].type) ? 1 : 0;
  }
  if (by_pointer > by_number) {
    if (by_number > 0 || std::ranges::any_of(first_of_owner, [](int i) { return i >= 0; }))
      file.notes.add("owners", file.name + ":" + std::to_string(lines.front().line) +
                                   ": the directory numbers on the parameter lines are wrong; the directory's "
                                   "pointers are taken");
    for (ParameterLine& line : lines) line.owner = 0;
    std::ranges::fill(first_of_owner, -1);
  }
  std::set<int> anonymous_starts;
  auto anonymous = [&](int i) { return file.find(owner(i)) == nullptr; };
  for (const Entry& entry : file.entries)
    if (0 < entry.first && entry.first <= total && anonymous(entry.first - 1)) anonymous_starts.insert(entry.first - 1);
  for (Entry& entry : file.entries) {
    const int pointer = entry.first - 1;
    const int claimed = entry.count;
    entry.first = entry.count = 0;
    if (const int own = first_of_owner[static_cast<std::size_t>((entry.sequence - 1) / 2)]; own >= 0) {
      entry.first = own;
      int end = entry.first;
      while (end < total && owner(end) == entry.sequence) ++end;
      entry.count = end - entry.first;
      if (entry.first != pointer)
        file.notes.add(
            "parameter pointer",
            file.place(entry) + "its parameter pointer is wrong; the lines marked with its number are taken");
    } else if (anonymous_starts.erase(pointer) != 0) {
      const auto next = anonymous_starts.upper_bound(pointer);
      const int limit = next == anonymous_starts.end() ? total : *next;
      entry.first = pointer;
      int end = pointer;
      while (end < limit && anonymous(end)) ++end;
      entry.count = end - pointer;
    }
    if (entry.count > 0 && entry.count != claimed)
      file.notes.add("line count", file.place(entry) + "claims " + std::to_string(claimed) + " parameter lines, has " +
                                       std::to_string(entry.count));
  }
}

// Some exporters write 65 columns of data and seven of the directory number: then only the latter names an entry.
bool holds_65_columns(std::string_view line, std::size_t directory_lines) {
  if (is_blank(line[64])) return false;
  const auto names_entry = [&](std::string_view text) {
    const int number = parse_integer(text).value_or(0);
    return number % 2 == 1 && 0 < number && static_cast<std::size_t>(number) <= directory_lines;
  };
  return !names_entry(line.substr(64)) && names_entry(line.substr(65));
}

// The lines so far, which left their last column blank, to this many columns.
void widen(File& file, std::size_t columns) {
  std::string wider;
  wider.reserve(file.parameters.capacity());
  for (std::size_t i = 0; i < file.parameter_lines.size(); ++i) {
    const std::size_t begin = file.parameter_lines[i].begin;
    const std::size_t end =
        i + 1 < file.parameter_lines.size() ? file.parameter_lines[i + 1].begin : file.parameters.size();
    file.parameter_lines[i].begin = wider.size();
    wider.append(file.parameters, begin, end - begin);
    wider.append(columns - std::min(columns, end - begin), ' ');
  }
  file.parameters = std::move(wider);
}

struct DirectoryCard {
  std::string_view data;
  int line, number;
};

// Entries by position. Where entries were cut out of a file, what is left keeps its numbers, and pointers go by them:
// if the parameter lines carry numbers beyond the positions and only such as stand in the directory, the gaps are
// filled with null entities.
void read_directory(File& file, const std::vector<DirectoryCard>& cards) {
  const std::size_t count = cards.size() / 2;
  std::set<int> numbers;
  bool ordered = true;
  for (std::size_t k = 0; k < count; ++k) {
    const int n = cards[2 * k].number;
    ordered = ordered && n % 2 == 1 && (numbers.empty() || n > *numbers.rbegin());
    numbers.insert(n);
  }
  const int last = static_cast<int>(2 * count) - 1;
  bool beyond = false, known = true;
  for (const ParameterLine& line : file.parameter_lines) {
    beyond = beyond || line.owner > last;
    known = known && numbers.count(line.owner) != 0;
  }
  const bool gaps = ordered && beyond && known && *numbers.rbegin() / 2 < static_cast<int>(4 * count + 1000);
  file.entries.reserve(count);
  for (std::size_t k = 0; k < count; ++k) {
    auto sequence = [&] { return static_cast<int>(2 * file.entries.size()) + 1; };
    while (gaps && sequence() < cards[2 * k].number) {
      Entry& null = file.entries.emplace_back();
      null.sequence = sequence() - 2;
      null.line = cards[2 * k].line;
    }
    const int number = sequence();
    file.entries.push_back(read_entry(cards[2 * k].data, cards[2 * k + 1].data, cards[2 * k].line, number));
  }
  if (gaps)
    file.notes.add("directory gaps", file.name + ":" + std::to_string(cards.front().line) +
                                         ": the directory's numbers have gaps; null entities fill them");
}

}  // namespace

void Notes::add(const std::string& kind, std::string message) {
  const auto [found, added] = index_.try_emplace(kind, notes_.size());
  if (added) notes_.push_back({std::move(message), 0});
  ++notes_[found->second].count;
}

std::vector<std::string> Notes::list() const {
  std::vector<std::string> out;
  for (const Note& note : notes_)
    out.push_back(note.count == 1 ? note.message : note.message + " (" + std::to_string(note.count) + " times)");
  return out;
}

const Entry* File::find(int sequence) const {
  if (sequence < 1 || sequence % 2 == 0) return nullptr;
  const auto i = static_cast<std::size_t>((sequence - 1) / 2);
  return i < entries.size() ? &entries[i] : nullptr;
}

std::string_view File::record(const Entry& entry) const {
  if (entry.count == 0) return {};
  const std::size_t begin = parameter_lines[static_cast<std::size_t>(entry.first)].begin;
  const auto last = static_cast<std::size_t>(entry.first + entry.count);
  const std::size_t end = last < parameter_lines.size() ? parameter_lines[last].begin : parameters.size();
  return std::string_view(parameters).substr(begin, end - begin);
}

std::string File::place(const Entry& entry, int line) const {
  return name + ":" + std::to_string(line > 0 ? line : entry.line) + ": entity " + std::to_string(entry.type) + ": ";
}

std::shared_ptr<const File> parse_file(std::string text, const std::string& name) {
  auto result = std::make_shared<File>();
  File& file = *result;
  file.name = name;
  file.text = std::move(text);
  if (trim(file.text).empty()) throw InputError(name + ": the file is empty, must be IGES");

  std::string global;
  std::vector<DirectoryCard> directory;
  std::string_view terminate;
  int sections = 0, last_line = 0, global_lines = 0;
  std::array<int, 4> counts{};  // S, G, D, P
  std::size_t columns = 64;     // of data on a parameter line
  file.parameters.reserve(file.text.size());
  auto note = [&](const std::string& kind, int line, const std::string& what) {
    file.notes.add(kind, name + ":" + std::to_string(line) + ": " + what);
  };
  for_each_line(file.text, [&](std::string_view raw, int number) {
    if (file.terminated) {
      if (!trim(raw).empty()) note("after T", number, "text after the terminate line is ignored");
      return true;
    }
    if (trim(raw).empty()) return true;
    last_line = number;
    if (sections == 0 && raw.size() > section_column && (raw[section_column] == 'C' || raw[section_column] == 'B') &&
        raw.size() <= 80 &&
        trim(raw.substr(section_column + 1)).find_first_not_of("0123456789") == std::string_view::npos)
      throw InputError(name + ":" + std::to_string(number) + ": " +
                       (raw[section_column] == 'C' ? "compressed" : "binary") +
                       " IGES is not read, must be fixed-length ASCII");
    const Line line = classify(raw);
    if (line.section == 0) {
      note("no section", number, "no section letter in column 73; the line is ignored");
      return true;
    }
    ++sections;
    if (!line.aligned) {
      note("misaligned", number, "the section letter does not stand in column 73");
    } else if (raw[section_column] != line.section) {
      note("lower case", number, "the section letter is lower case");
    }
    if (line.number == 0) note("no number", number, "no sequence number behind the section letter");
    switch (line.section) {
      case 'S':
        ++counts[0];
        file.start.push_back(line.data);
        break;
      case 'G':
        ++counts[1];
        if (global_lines++ == 0) file.global_line = number;
        global += line.data;
        if (line.aligned && line.data.size() < section_column) global.append(section_column - line.data.size(), ' ');
        break;
      case 'D':
        ++counts[2];
        directory.push_back({line.data, number, line.number});
        break;
      case 'P': {
        ++counts[3];
        std::string_view data = line.data;
        std::string_view owner;
        if (line.aligned) {
          if (columns == 64 && holds_65_columns(data, directory.size())) {
            note("65 columns", number, "parameter lines hold 65 columns of data before a pointer of seven");
            widen(file, ++columns);
          }
          owner = data.substr(columns);
          data = data.substr(0, columns);
        } else {
          const std::size_t at = data.size() > 8 ? data.size() - 8 : 0;
          owner = data.substr(at);
          data = data.substr(0, at);
        }
        file.parameter_lines.push_back({file.parameters.size(), number, parse_integer(owner).value_or(0)});
        file.parameters += data;
        if (data.size() < columns) file.parameters.append(columns - data.size(), ' ');
        break;
      }
      default:
        file.terminated = true;
        terminate = line.data;
    }
    return true;
  });

  if (sections == 0) throw InputError(name + ": no line has a section letter in column 73: this is no IGES file");
  if (global_lines == 0) throw InputError(name + ": the global section is missing");
  read_global(file, global);
  if (directory.empty())
    throw InputError(name + ":" + std::to_string(last_line) + ": the directory section is missing");
  read_directory(file, directory);
  if (directory.size() % 2 != 0) {
    if (!file.terminated)
      throw InputError(name + ":" + std::to_string(last_line) + ": the file ends in its directory section");
    note("odd directory", directory.back().line, "the directory has an odd number of lines; the last is ignored");
  }
  resolve_records(file);

  if (file.terminated) {
    const char letters[] = "SGDP";
    for (std::size_t k = 0; k < 4; ++k) {
      const std::string_view part = terminate.size() >= 8 * (k + 1) ? terminate.substr(8 * k, 8) : std::string_view();
      if (part.empty() || part[0] != letters[k] || parse_integer(part.substr(1)).value_or(-1) != counts[k])
        note("T counts", last_line, "the counts in the terminate line don't match the sections");
    }
  } else {
    // Without its end a file is whole only if every record is.
    Tokens tokens;
    for (const Entry& entry : file.entries) {
      if (entry.count > 0) tokenize(file.record(entry), file.delimiters, tokens);
      if (entry.type != 0 && (entry.count == 0 || !tokens.terminated))
        throw InputError(name + ":" + std::to_string(last_line) +
                         ": the file ends early: no terminate line, and the record of " + "directory entry " +
                         std::to_string(entry.sequence) + " (entity " + std::to_string(entry.type) +
                         ") is not complete");
    }
    note("no T", last_line, "the terminate line is missing");
  }
  return result;
}

namespace {
constexpr std::array<Unit, 10> units{{{1, "INCH", 0.0254},
                                      {2, "MM", 0.001},
                                      {4, "FT", 0.3048},
                                      {5, "MI", 1609.344},
                                      {6, "M", 1},
                                      {7, "KM", 1000},
                                      {8, "MIL", 2.54e-5},
                                      {9, "UM", 1e-6},
                                      {10, "CM", 0.01},
                                      {11, "UIN", 2.54e-8}}};
}

std::optional<Unit> unit_of_flag(int flag) {
  for (const Unit& unit : units)
    if (unit.flag == flag) return unit;
  return std::nullopt;
}

std::optional<Unit> unit_of_name(std::string_view name) {
  std::string word;
  for (char c : trim(name)) word += upper(c);
  if (word.size() > 3 && word.back() == 'S') word.pop_back();
  if (word.size() > 3 && word.ends_with("TRE")) word.replace(word.size() - 2, 2, "ER");
  constexpr std::array<std::array<const char*, 2>, 14> synonyms{{{"IN", "INCH"},
                                                                 {"INCHE", "INCH"},
                                                                 {"MILLIMETER", "MM"},
                                                                 {"CENTIMETER", "CM"},
                                                                 {"METER", "M"},
                                                                 {"FOOT", "FT"},
                                                                 {"FEET", "FT"},
                                                                 {"MILE", "MI"},
                                                                 {"KILOMETER", "KM"},
                                                                 {"MICRON", "UM"},
                                                                 {"MICROMETER", "UM"},
                                                                 {"MICROINCH", "UIN"},
                                                                 {"MICROINCHE", "UIN"},
                                                                 {"MILS", "MIL"}}};
  for (const auto& [long_name, short_name] : synonyms)
    if (word == long_name) word = short_name;
  for (const Unit& unit : units)
    if (word == unit.name) return unit;
  return std::nullopt;
}

}  // namespace toile::iges
