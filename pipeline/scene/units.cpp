// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/scene/units.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>

#include "geometry/error.h"

namespace toile {
namespace {

struct Unit {
  std::string_view name;
  double factor;
  Dimension dimension;
};

constexpr double gravity = 9.80665;  // m/s2, standard

constexpr std::array units = {
    Unit{"m", 1, {1, 0, 0, 0}},       Unit{"km", 1e3, {1, 0, 0, 0}},
    Unit{"dm", 0.1, {1, 0, 0, 0}},    Unit{"cm", 0.01, {1, 0, 0, 0}},
    Unit{"mm", 1e-3, {1, 0, 0, 0}},   Unit{"um", 1e-6, {1, 0, 0, 0}},
    Unit{"in", 0.0254, {1, 0, 0, 0}}, Unit{"inch", 0.0254, {1, 0, 0, 0}},
    Unit{"ft", 0.3048, {1, 0, 0, 0}}, Unit{"yd", 0.9144, {1, 0, 0, 0}},
    Unit{"kg", 1, {0, 1, 0, 0}},      Unit{"g", 1e-3, {0, 1, 0, 0}},
    Unit{"mg", 1e-6, {0, 1, 0, 0}},   Unit{"oz", 0.028349523125, {0, 1, 0, 0}},
    Unit{"gsm", 1e-3, {-2, 1, 0, 0}}, Unit{"s", 1, {0, 0, 1, 0}},
    Unit{"ms", 1e-3, {0, 0, 1, 0}},   Unit{"us", 1e-6, {0, 0, 1, 0}},
    Unit{"min", 60, {0, 0, 1, 0}},    Unit{"h", 3600, {0, 0, 1, 0}},
    Unit{"N", 1, {1, 1, -2, 0}},      Unit{"kN", 1e3, {1, 1, -2, 0}},
    Unit{"cN", 1e-2, {1, 1, -2, 0}},  Unit{"mN", 1e-3, {1, 1, -2, 0}},
    Unit{"uN", 1e-6, {1, 1, -2, 0}},  Unit{"gf", 1e-3 * gravity, {1, 1, -2, 0}},
    Unit{"J", 1, {2, 1, -2, 0}},      Unit{"Pa", 1, {-1, 1, -2, 0}},
    Unit{"kPa", 1e3, {-1, 1, -2, 0}}, Unit{"MPa", 1e6, {-1, 1, -2, 0}},
    Unit{"rad", 1, {0, 0, 0, 1}},     Unit{"deg", std::numbers::pi / 180, {0, 0, 0, 1}},
    Unit{"%", 0.01, {0, 0, 0, 0}},
};

struct Value {
  double factor = 1;
  Dimension dimension;
};

class Parser {
 public:
  explicit Parser(std::string_view text) : text_(text) {}

  Value quantity() {
    Value value;
    skip();
    value.factor = number();
    skip();
    // "1/30 s" is a fraction; "1/m" is a unit.
    if (peek() == '/' && position_ + 1 < text_.size() && is_digit(text_[position_ + 1])) {
      ++position_;
      const double denominator = number();
      if (denominator == 0) fail("divides by zero");
      value.factor /= denominator;
      skip();
    }
    if (at_end()) return value;
    const Value unit = product(false);
    skip();
    if (!at_end()) fail(fmt::format("can't read '{}'", text_.substr(position_)));
    return {value.factor * unit.factor, unit.dimension};
  }

 private:
  static bool is_digit(char c) { return c >= '0' && c <= '9'; }
  static bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '%'; }
  bool at_end() const { return position_ >= text_.size(); }
  char peek() const { return at_end() ? '\0' : text_[position_]; }
  void skip() {
    while (peek() == ' ' || peek() == '\t') ++position_;
  }
  [[noreturn]] void fail(const std::string& why) const {
    throw InputError(fmt::format("\"{}\" is not a quantity: {}", text_, why));
  }

  double number() {
    if (peek() == '+') ++position_;
    double x = 0;
    const char* begin = text_.data() + position_;
    const auto [end, error] = std::from_chars(begin, text_.data() + text_.size(), x);
    if (error != std::errc() || !std::isfinite(x)) fail("a number must come first");
    position_ += static_cast<std::size_t>(end - begin);
    return x;
  }

  // A product of factors; at most one "/", which takes the next factor only, so nothing may follow it unbracketed.
  Value product(bool bracketed) {
    Value total;
    bool divided = false;
    while (true) {
      skip();
      if (at_end() || peek() == ')') {
        if (bracketed != (peek() == ')')) fail("brackets don't match");
        return total;
      }
      bool divide = false;
      if (peek() == '/') {
        divide = true;
        ++position_;
        skip();
      } else if (peek() == '*' || text_.substr(position_, 2) == "\xC2\xB7") {
        position_ += peek() == '*' ? 1 : 2;
        skip();
      }
      if (divided) fail("what follows '/' has two readings; put the denominator in brackets, as in kg/(m2 s)");
      divided = divide;
      const Value next = factor();
      const int sign = divide ? -1 : 1;
      total.factor *= divide ? 1 / next.factor : next.factor;
      total.dimension.length += sign * next.dimension.length;
      total.dimension.mass += sign * next.dimension.mass;
      total.dimension.time += sign * next.dimension.time;
      total.dimension.angle += sign * next.dimension.angle;
    }
  }

  Value factor() {
    if (peek() == '(') {
      if (++depth_ > deepest) fail("its brackets are nested too deeply");
      ++position_;
      const Value inner = product(true);
      ++position_;
      --depth_;
      return inner;
    }
    if (peek() == '1') {
      ++position_;
      return {};
    }
    const std::size_t begin = position_;
    while (is_letter(peek())) ++position_;
    const std::string_view name = text_.substr(begin, position_ - begin);
    if (name.empty()) fail(fmt::format("expected a unit at '{}'", text_.substr(begin)));
    const Unit* unit = nullptr;
    for (const Unit& u : units) {
      if (u.name == name) unit = &u;
    }
    if (!unit) fail(fmt::format("unknown unit '{}'", name));
    int power = 1;
    const bool caret = peek() == '^';
    if (caret) ++position_;
    if (caret || is_digit(peek()) || peek() == '-') {
      const char* start = text_.data() + position_;
      const auto [end, error] = std::from_chars(start, text_.data() + text_.size(), power);
      if (error != std::errc() || std::abs(power) > 9) fail("an exponent must be a small whole number");
      position_ += static_cast<std::size_t>(end - start);
    }
    const Dimension& d = unit->dimension;
    return {std::pow(unit->factor, power), {d.length * power, d.mass * power, d.time * power, d.angle * power}};
  }

  static constexpr int deepest = 8;
  std::string_view text_;
  std::size_t position_ = 0;
  int depth_ = 0;
};

}  // namespace

std::string unit_name(const Dimension& d) {
  if (d == dimension::none) return "a number";
  if (d == dimension::force) return "N";
  if (d == dimension::force_per_length) return "N/m";
  if (d == dimension::pressure) return "Pa";
  if (d == dimension::moment) return "N m";
  std::string above, below;
  int count_below = 0;
  const auto add = [&](const char* name, int power) {
    if (power == 0) return;
    std::string& side = power > 0 ? above : below;
    if (power < 0) ++count_below;
    if (!side.empty()) side += ' ';
    side += name;
    if (std::abs(power) != 1) side += std::to_string(std::abs(power));
  };
  add("kg", d.mass);
  add("m", d.length);
  add("s", d.time);
  add("rad", d.angle);
  if (below.empty()) return above;
  return (above.empty() ? "1" : above) + "/" + (count_below > 1 ? "(" + below + ")" : below);
}

double parse_quantity(std::string_view text, const Dimension& expected) {
  const Value value = Parser(text).quantity();
  if (value.dimension != expected) {
    // A bare number is SI.
    const bool bare = value.dimension == dimension::none && text.find('%') == std::string_view::npos;
    if (!bare) {
      throw InputError(
          fmt::format("\"{}\" is in {}, expected {}", text, unit_name(value.dimension), unit_name(expected)));
    }
  }
  return value.factor;
}

std::string degrees_text(double radians) {
  return fmt::format("{}", std::round(radians * 180 / std::numbers::pi * 1e6) / 1e6 + 0.0);
}

}  // namespace toile
