// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/iges/parameters.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>

#include "geometry/error.h"
#include "io/limits.h"

namespace toile::iges {

namespace {

bool is_blank(char c) {
  return static_cast<unsigned char>(c) <= ' ';
}
bool is_digit(char c) {
  return '0' <= c && c <= '9';
}

std::string_view trim(std::string_view s) {
  while (!s.empty() && is_blank(s.front())) s.remove_prefix(1);
  while (!s.empty() && is_blank(s.back())) s.remove_suffix(1);
  return s;
}

// Where a Hollerith string that starts at `begin` and claims `count` characters ends: there, if a delimiter follows
// (after blanks); else at the delimiter nearest to the claim; else the first one.
std::size_t hollerith_end(std::string_view text, std::size_t begin, std::size_t count, Delimiters delimiters,
                          bool& wrong_count) {
  const char either[] = {delimiters.parameter, delimiters.record, 0};
  auto is_delimiter = [&](std::size_t i) { return text[i] == delimiters.parameter || text[i] == delimiters.record; };
  if (count <= text.size() - begin) {
    std::size_t after = begin + count;
    while (after < text.size() && is_blank(text[after])) ++after;
    if (after < text.size() && is_delimiter(after)) return begin + count;
  }
  wrong_count = true;
  if (count > text.size() - begin) {
    const std::size_t first = text.find_first_of(either, begin);
    return first == std::string_view::npos ? text.size() : first;
  }
  // Outwards from the claim, so that the search costs no more than what it skips.
  const std::size_t claim = begin + count;
  for (std::size_t d = 0; claim + d < text.size() || d <= count; ++d) {
    if (d <= count && claim - d < text.size() && is_delimiter(claim - d)) return claim - d;
    if (claim + d < text.size() && is_delimiter(claim + d)) return claim + d;
  }
  return text.size();
}

}  // namespace

void tokenize(std::string_view text, Delimiters delimiters, Tokens& out) {
  out.list.clear();
  out.terminated = out.wrong_count = false;
  std::size_t i = 0;
  while (i < text.size()) {
    while (i < text.size() && is_blank(text[i])) ++i;
    std::size_t begin = i;
    std::size_t end;
    bool is_string = false;
    std::size_t digits = i;
    while (digits < text.size() && is_digit(text[digits]) && digits - i < 9) ++digits;
    if (digits > i && digits < text.size() && (text[digits] == 'H' || text[digits] == 'h')) {
      std::size_t count = 0;
      std::from_chars(text.data() + i, text.data() + digits, count);
      begin = digits + 1;
      end = hollerith_end(text, begin, count, delimiters, out.wrong_count);
      is_string = true;
      i = end;
      while (i < text.size() && is_blank(text[i])) ++i;
    } else {
      i = digits;
      while (i < text.size() && text[i] != delimiters.parameter && text[i] != delimiters.record) ++i;
      end = i;
      while (end > begin && is_blank(text[end - 1])) --end;
    }
    out.list.push_back({text.substr(begin, end - begin), is_string});
    if (i >= text.size()) return;
    if (text[i] == delimiters.record) {
      out.terminated = true;
      return;
    }
    ++i;
  }
}

std::optional<double> parse_real(std::string_view text) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  if (text.empty()) return std::nullopt;
  std::array<char, 64> buffer;
  const char* begin = text.data();
  const char* end = begin + text.size();
  double value = 0;
  auto result = std::from_chars(begin, end, value);
  if (result.ptr != end && text.size() + 1 < buffer.size()) {
    // Fortran writes the exponent behind a D, or behind its sign alone where it takes three digits.
    const auto mantissa = static_cast<std::size_t>(result.ptr - begin);
    const bool letter = *result.ptr == 'D' || *result.ptr == 'd';
    const bool sign =
        (*result.ptr == '+' || *result.ptr == '-') && text.substr(0, mantissa).find('.') != std::string_view::npos;
    if (letter || sign) {
      char* at = std::copy_n(begin, mantissa, buffer.data());
      *at++ = 'E';
      end = std::copy(begin + mantissa + (letter ? 1 : 0), end, at);
      begin = buffer.data();
      result = std::from_chars(begin, end, value);
    }
  }
  if (result.ptr != end) return std::nullopt;
  if (result.ec == std::errc::result_out_of_range) {
    // Too small to be told from zero is zero; too large is no number.
    const std::string_view read(begin, static_cast<std::size_t>(end - begin));
    const std::size_t e = read.find_first_of("Ee");
    if (e != std::string_view::npos && read.find('-', e) != std::string_view::npos) return 0.0;
    return std::nullopt;
  }
  if (result.ec != std::errc() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<int> parse_integer(std::string_view text) {
  text = trim(text);
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  int value = 0;
  auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec == std::errc() && result.ptr == text.data() + text.size()) return value;
  // "1." and "2.0" occur where integers belong.
  const std::optional<double> real = parse_real(text);
  if (real && *real == std::floor(*real) && std::abs(*real) <= std::numeric_limits<int>::max())
    return static_cast<int>(*real);
  return std::nullopt;
}

Parameters::Parameters(const File& file, const Entry& entry, Notes* notes) : file_(file), entry_(entry), notes_(notes) {
  if (entry.count == 0) throw InputError(file.place(entry) + "its parameter record is missing");
  tokenize(file.record(entry), file.delimiters, tokens_);
  if (!tokens_.terminated) fail("the parameter record has no end ('" + std::string(1, file.delimiters.record) + "')");
  const std::optional<int> type = tokens_.list.empty() ? std::nullopt : parse_integer(tokens_.list[0].text);
  if (!type || *type != entry.type)
    fail("the parameter record says '" + std::string(tokens_.list.empty() ? "" : tokens_.list[0].text.substr(0, 20)) +
         "', must be " + std::to_string(entry.type));
  if (tokens_.wrong_count) note("hollerith", "a string count is wrong; the string ends at the nearest delimiter");
}

void Parameters::note(const std::string& kind, const std::string& what) const {
  if (notes_) notes_->add(kind, file_.place(entry_) + what);
}

bool Parameters::defaulted() const {
  return next_ >= tokens_.list.size() || tokens_.list[next_].text.empty();
}

double Parameters::real(const char* what, int number, double otherwise) {
  if (next_ >= tokens_.list.size()) {
    ++next_;
    return otherwise;
  }
  const Token& token = tokens_.list[next_++];
  if (token.text.empty()) return otherwise;
  const std::optional<double> value = token.is_string ? std::nullopt : parse_real(token.text);
  if (!value) fail_token(what, number, token.text, "a finite number");
  if (std::abs(*value) > largest_number) fail_token(what, number, token.text, "a number of at most 1e25 in size");
  return *value;
}

int Parameters::integer(const char* what, int otherwise) {
  if (next_ >= tokens_.list.size()) {
    ++next_;
    return otherwise;
  }
  const Token& token = tokens_.list[next_++];
  if (token.text.empty()) return otherwise;
  const std::optional<int> value = token.is_string ? std::nullopt : parse_integer(token.text);
  if (!value) fail_token(what, -1, token.text, "an integer");
  return *value;
}

std::string Parameters::text(const char* what) {
  if (next_ >= tokens_.list.size()) {
    ++next_;
    return {};
  }
  const Token& token = tokens_.list[next_++];
  if (!token.is_string && !token.text.empty()) fail_token(what, -1, token.text, "a string (nH...)");
  return std::string(token.text);
}

void Parameters::expect(long long count, const std::string& claim) const {
  if (count > left())
    fail(claim + " need " + std::to_string(count) + " more parameters, the record has " +
         std::to_string(std::max(0, left())));
}

void Parameters::fail(const std::string& why) const {
  int line = 0;
  if (entry_.count > 0 && next_ > 0 && next_ - 1 < tokens_.list.size()) {
    const char* at = tokens_.list[next_ - 1].text.data();
    const auto offset = static_cast<std::size_t>(at - file_.parameters.data());
    const auto begin = file_.parameter_lines.begin() + entry_.first;
    const auto found = std::upper_bound(begin, begin + entry_.count, offset,
                                        [](std::size_t o, const ParameterLine& l) { return o < l.begin; });
    line = (found == begin ? begin : found - 1)->line;
  }
  throw InputError(file_.place(entry_, line) + why);
}

void Parameters::fail_token(const char* what, int number, std::string_view text, const char* expected) const {
  std::string shown;
  for (char c : text.substr(0, 24)) shown += 32 <= c && c < 127 ? c : '?';
  fail(std::string(what) + (number >= 0 ? " " + std::to_string(number) : "") + " is '" + shown + "', must be " +
       expected);
}

Record::Record(int type, Delimiters delimiters) : type_(type), delimiters_(delimiters) {
  integer(type);
}

Record Record::global(Delimiters delimiters) {
  Record record(delimiters, 72);
  record.string(std::string_view(&delimiters.parameter, 1));
  record.string(std::string_view(&delimiters.record, 1));
  return record;
}

// A token is held back until its delimiter is known, so that both stand on one line.
void Record::put(std::string_view text, bool breakable) {
  const std::size_t columns = columns_;
  const std::size_t used = text_.size() % columns;
  if (!breakable) {
    if (used + text.size() > columns && used > 0) text_.append(columns - used, ' ');
    text_ += text;
    return;
  }
  // Strings may run over line ends, but their count stands whole.
  const std::size_t head = std::min(text.find('H') + 1, text.size());
  if (used + head > columns && used > 0) text_.append(columns - used, ' ');
  text_ += text;
}

Record& Record::token(const Token& value) {
  if (value.is_string) return string(value.text);
  if (!first_) put(pending_ += delimiters_.parameter, pending_breakable_);
  first_ = false;
  pending_ = value.text;
  pending_breakable_ = false;
  return *this;
}

Record& Record::integer(long long value) {
  return token({std::to_string(value), false});
}
Record& Record::real(double value) {
  return token({format_real(value), false});
}
Record& Record::blank() {
  return token({"", false});
}

Record& Record::string(std::string_view value) {
  if (!first_) put(pending_ += delimiters_.parameter, pending_breakable_);
  first_ = false;
  pending_ = value.empty() ? std::string() : std::to_string(value.size()) + "H" + std::string(value);
  pending_breakable_ = true;
  return *this;
}

std::string Record::finish() {
  put(pending_ += delimiters_.record, pending_breakable_);
  pending_.clear();
  if (text_.size() % columns_ != 0) text_.append(columns_ - text_.size() % columns_, ' ');
  return std::move(text_);
}

std::string format_real(double value) {
  std::array<char, 40> buffer;
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  std::string text(buffer.data(), end);
  const std::size_t e = text.find('e');
  if (e != std::string::npos) text[e] = 'E';
  if (text.find('.') == std::string::npos) text.insert(e == std::string::npos ? text.size() : e, 1, '.');
  return text;
}

}  // namespace toile::iges
