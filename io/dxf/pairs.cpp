// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/dxf/pairs.h"

#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>
#include <set>

#include "geometry/error.h"
#include "io/limits.h"

namespace toile::dxf {

namespace {

using Words = std::set<std::string, std::less<>>;

const Words& read_entities() {
  static const Words words{"SECTION", "ENDSEC", "EOF",    "BLOCK",   "ENDBLK", "POLYLINE",
                           "VERTEX",  "SEQEND", "LINE",   "POINT",   "TEXT",   "MTEXT",
                           "ARC",     "CIRCLE", "INSERT", "ELLIPSE", "SPLINE", "LWPOLYLINE"};
  return words;
}
const Words& announced_entities() {
  static const Words words{"BLOCK", "POLYLINE", "LWPOLYLINE", "LINE",    "POINT",  "TEXT",
                           "MTEXT", "ARC",      "CIRCLE",     "ELLIPSE", "SPLINE", "INSERT"};
  return words;
}

class Cutter {
 public:
  Cutter(std::string_view text, const std::string& name) : text_(text), name_(name) {
    if (text_.starts_with("\xEF\xBB\xBF")) text_.remove_prefix(3);  // a byte order mark
  }

  Pairs run() {
    while (!ended_) {
      const auto code_text = next_line();
      if (!code_text) fail("the file ends without EOF");
      const std::string word = trimmed(*code_text);
      int code = -1;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), code);
      if (error != std::errc() || end != word.data() + word.size() || code < 0 || code > 1071)
        fail("'" + word.substr(0, 40) + "' is no group code of a DXF file");
      const auto value_text = next_line();
      if (!value_text) fail("group code " + word + " has no value: the file ends here");
      const std::string value = trimmed(*value_text);
      if (value.size() > 900) fail("a value has " + std::to_string(value.size()) + " characters, may have 900");
      if (code != 999) pair(code, value);  // 999: a comment
    }
    return std::move(out_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(name_ + ":" + std::to_string(line_) + ": " + what);
  }
  std::optional<std::string_view> next_line() {
    if (text_.empty()) return std::nullopt;
    const std::size_t end = text_.find('\n');
    std::string_view line = text_.substr(0, end);
    text_.remove_prefix(end == std::string_view::npos ? text_.size() : end + 1);
    if (line.ends_with('\r')) line.remove_suffix(1);
    ++line_;
    return line;
  }

  void pair(int code, const std::string& value) {
    if (code == 0) {
      entity(value);
    } else if (code == 2 && section_.empty()) {
      section_ = value;
    }
    if (section_ == "HEADER" && code == 9) variable_ = value;
    if (section_ == "HEADER" && code != 9 && code != 0 && code != 2) out_.header.try_emplace(variable_, value);
    check_count(code, value);
    if (!keep_) return;
    const double number = code >= 10 && code <= 59 && section_ != "HEADER" ? checked_number(code, value) : 0;
    if (entity_ == "SPLINE" && code != 0 && !spline(code, number, value)) return;
    if (code == 0) entity_begin_ = out_.text.size();
    out_.text += std::to_string(code) + "\n" + value + "\n";
    if (entity_ == "VERTEX" && code == 70 && is_frame(value)) {
      out_.text.resize(entity_begin_);
      keep_ = false;
    }
    if (code == 0 && announced_entities().contains(value)) out_.lines.push_back(line_ - 1);
  }

  void entity(const std::string& value) {
    entity_ = value;
    ended_ = value == "EOF";
    if (value == "ENDSEC") section_.clear();
    const bool content = section_ == "BLOCKS" || section_ == "ENTITIES";
    keep_ = section_.empty() || read_entities().contains(value);
    // Styles, views and objects say nothing about pieces.
    if (section_ == "TABLES" || section_ == "OBJECTS" || section_ == "CLASSES") keep_ = value == "ENDSEC" || ended_;
    if (!keep_ && content) ++out_.unread[value];
    if (keep_ && value == "SPLINE") out_.splines.emplace_back();
  }

  // Counts and flags are small whole numbers, and no count is above what the file could hold.
  void check_count(int code, const std::string& value) const {
    if (code != 90 && code != 70 && code != 71 && code != 72) return;
    if (!keep_ || section_.empty() || section_ == "HEADER") return;
    int claim = 0;
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), claim);
    if (error != std::errc() || claim < 0 || (code == 90 && static_cast<std::size_t>(claim) > text_.size() / 4))
      fail("group code " + std::to_string(code) + " is '" + value.substr(0, 40) +
           "', must be a whole number that the file can hold");
  }

  double checked_number(int code, const std::string& value) const {
    double number = 0;
    const std::string_view digits =
        value.starts_with('+') ? std::string_view(value).substr(1) : std::string_view(value);
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
    if (error != std::errc() || end != digits.data() + digits.size() || !std::isfinite(number) ||
        std::abs(number) > largest_number)
      fail("group code " + std::to_string(code) + " is '" + value.substr(0, 40) +
           "', must be a number of at most 1e25 in size");
    return number;
  }

  // A control point of the curve that a spline-fitted polyline also gives as vertices.
  static bool is_frame(const std::string& value) {
    int flags = 0;
    std::from_chars(value.data(), value.data() + value.size(), flags);
    return (flags & 16) != 0;
  }

  // False for pairs that dxflib shall not see: the numbers themselves, and what they are counted by.
  bool spline(int code, double number, const std::string& value) {
    Spline& s = out_.splines.back();
    switch (code) {
      case 71:
        std::from_chars(value.data(), value.data() + value.size(), s.degree);
        return false;
      case 40:
        s.knots.push_back(number);
        return false;
      case 41:
        s.weights.push_back(number);
        return false;
      case 10:
        s.points.emplace_back(number, 0, 0);
        return false;
      case 20:
      case 30:
        if (!s.points.empty()) s.points.back()[code / 10 - 1] = number;
        return false;
      case 11:
        ++s.fit_points;
        return false;
      default:
        return code == 8 || code == 70;
    }
  }

  std::string_view text_;
  const std::string& name_;
  int line_ = 0;
  std::string section_, entity_, variable_;
  bool keep_ = true, ended_ = false;
  std::size_t entity_begin_ = 0;  // of out_.text
  Pairs out_;
};

}  // namespace

std::string trimmed(std::string_view text) {
  const auto space = [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; };
  while (!text.empty() && space(text.front())) text.remove_prefix(1);
  while (!text.empty() && space(text.back())) text.remove_suffix(1);
  return std::string(text);
}

Pairs cut(std::string_view text, const std::string& name) {
  return Cutter(text, name).run();
}

}  // namespace toile::dxf
