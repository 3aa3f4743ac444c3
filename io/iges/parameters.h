// SPDX-License-Identifier: GPL-3.0-or-later
// Parameters of a record: cut at delimiters, read as numbers and strings, errors with line, entity and what was
// expected.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/iges/file.h"

namespace toile::iges {

// One parameter as it stands: blanks trimmed; for a Hollerith string its characters without the count.
struct Token {
  std::string_view text;
  bool is_string = false;
};

struct Tokens {
  std::vector<Token> list;
  bool terminated = false;   // the record delimiter was found
  bool wrong_count = false;  // a Hollerith count did not fit; the nearest delimiter was taken
};

// Cuts `text` up to the record delimiter.
void tokenize(std::string_view text, Delimiters delimiters, Tokens& out);

// A number in any of the forms that files hold (leading +, D exponents, exponents without a letter as in "1.0+002",
// missing digits on one side of the point), never depending on the locale; nullopt for anything else and for values
// that are not finite.
std::optional<double> parse_real(std::string_view text);
std::optional<int> parse_integer(std::string_view text);

// Reads the parameters of one record in order. Defaulted parameters (nothing between two delimiters, or beyond the end
// of the record) give the default. Every error is an InputError: `panel.igs:412: entity 128: weight 7 is 'x', must be a
// number`.
class Parameters {
 public:
  // Throws where the record is missing, isn't terminated, or belongs to another entity type.
  // What is odd but readable goes to `notes`.
  Parameters(const File& file, const Entry& entry, Notes* notes = nullptr);

  double real(const char* what, int number = -1, double otherwise = 0);
  int integer(const char* what, int otherwise = 0);
  int pointer(const char* what) { return integer(what, 0); }
  std::string text(const char* what);
  bool defaulted() const;  // the next one

  int position() const { return static_cast<int>(next_); }  // index of the next parameter, the entity type being 0
  int size() const { return static_cast<int>(tokens_.list.size()); }
  int left() const { return size() - position(); }
  const Token& token(int i) const { return tokens_.list[static_cast<std::size_t>(i)]; }

  // Refuses a claimed number of parameters that the record doesn't hold, before anybody allocates for it.
  void expect(long long count, const std::string& claim) const;

  // Throws InputError at the last parameter read.
  [[noreturn]] void fail(const std::string& why) const;

  void note(const std::string& kind, const std::string& what) const;

  const Entry& entry() const { return entry_; }
  double resolution() const { return file_.global.resolution; }

 private:
  [[noreturn]] void fail_token(const char* what, int number, std::string_view text, const char* expected) const;

  const File& file_;
  const Entry& entry_;
  Notes* notes_;
  Tokens tokens_;
  std::size_t next_ = 1;
};

// A parameter record being written: 64 columns a line, numbers never broken over lines.
class Record {
 public:
  explicit Record(int type, Delimiters delimiters = {});
  // The global section: 72 columns, beginning with its delimiters.
  static Record global(Delimiters delimiters = {});
  Record& integer(long long value);
  Record& real(double value);  // shortest decimal that reads back to the same bits, with a point
  Record& string(std::string_view value);
  Record& token(const Token& value);  // as it stood
  Record& blank();
  int type() const { return type_; }
  // The lines, all of the same width, blank-padded.
  std::string finish();

 private:
  Record(Delimiters delimiters, std::size_t columns) : delimiters_(delimiters), columns_(columns) {}
  void put(std::string_view text, bool breakable);

  int type_ = 0;
  Delimiters delimiters_;
  std::size_t columns_ = 64;
  std::string text_;
  std::string pending_;
  bool first_ = true;
  bool pending_breakable_ = false;
};

// Shortest decimal with a point that reads back to the same bits ("1.", "0.1", "1.E-05").
std::string format_real(double value);

}  // namespace toile::iges
