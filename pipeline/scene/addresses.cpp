// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/scene/addresses.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <vector>

#include "geometry/error.h"

namespace toile {
namespace {

std::string_view trim(std::string_view s) {
  while (!s.empty() && s.front() == ' ') s.remove_prefix(1);
  while (!s.empty() && s.back() == ' ') s.remove_suffix(1);
  return s;
}

// Numbers separated by commas; brackets must be balanced and are skipped where `bracketed`.
std::vector<double> numbers(std::string_view text, std::string_view whole) {
  std::vector<double> result;
  while (true) {
    const std::size_t comma = text.find(',');
    const std::string_view item = trim(text.substr(0, comma));
    double x = 0;
    const auto [end, error] = std::from_chars(item.data(), item.data() + item.size(), x);
    if (error != std::errc() || end != item.data() + item.size() || !std::isfinite(x)) {
      throw InputError(fmt::format("address \"{}\": '{}' is not a number", whole, item));
    }
    result.push_back(x);
    if (comma == std::string_view::npos) return result;
    text.remove_prefix(comma + 1);
  }
}

int whole_number(double x, std::string_view text) {
  if (x != std::floor(x) || x < 0 || x > 1e9) {
    throw InputError(fmt::format("address \"{}\": {} must be a whole number from 0", text, x));
  }
  return static_cast<int>(x);
}

Eigen::Vector3d vector(std::string_view text, std::string_view whole) {
  text = trim(text);
  if (text.size() < 2 || text.front() != '[' || text.back() != ']') {
    throw InputError(fmt::format("address \"{}\": expected box:[x,y,z],[x,y,z] in metres", whole));
  }
  const std::vector<double> x = numbers(text.substr(1, text.size() - 2), whole);
  if (x.size() != 3) throw InputError(fmt::format("address \"{}\": expected box:[x,y,z],[x,y,z] in metres", whole));
  return {x[0], x[1], x[2]};
}

}  // namespace

Address parse_address(std::string_view text) {
  Address address;
  address.text = text;
  const std::size_t colon = text.find(':');
  const std::string_view kind = trim(text.substr(0, colon));
  const std::string_view rest = colon == std::string_view::npos ? "" : trim(text.substr(colon + 1));
  const auto expected = [&](const char* form) {
    return InputError(fmt::format("address \"{}\": expected {}", text, form));
  };
  if (kind == "corner") {
    const std::vector<double> x = numbers(rest, text);
    if (x.size() != 2 || (x[0] != 0 && x[0] != 1) || (x[1] != 0 && x[1] != 1)) {
      throw expected("corner:U,V with U and V 0 or 1");
    }
    address.kind = Address::Kind::corner;
    address.a = static_cast<int>(x[0]);
    address.b = static_cast<int>(x[1]);
  } else if (kind == "edge") {
    if (rest != "u0" && rest != "u1" && rest != "v0" && rest != "v1") throw expected("edge:u0, u1, v0 or v1");
    address.kind = Address::Kind::edge;
    address.a = rest[0] == 'u' ? 0 : 1;
    address.b = rest[1] - '0';
  } else if (kind == "curve") {
    const std::vector<double> x = numbers(rest, text);
    if (x.size() != 2 && x.size() != 4) throw expected("curve:LOOP,K or curve:LOOP,K,FROM,TO");
    address.kind = Address::Kind::curve;
    address.a = whole_number(x[0], text);
    address.b = whole_number(x[1], text);
    if (x.size() == 4) {
      address.from = x[2];
      address.to = x[3];
      if (!(0 <= address.from && address.from < address.to && address.to <= 1)) {
        throw expected("0 <= FROM < TO <= 1, fractions of the curve's length");
      }
    }
  } else if (kind == "uv") {
    const std::vector<double> x = numbers(rest, text);
    if (x.size() != 2) throw expected("uv:U,V");
    address.kind = Address::Kind::uv;
    address.uv = {x[0], x[1]};
  } else if (kind == "cp") {
    const std::vector<double> x = numbers(rest, text);
    if (x.size() != 2) throw expected("cp:I,J");
    address.kind = Address::Kind::control_point;
    address.a = whole_number(x[0], text);
    address.b = whole_number(x[1], text);
  } else if (kind == "box") {
    const std::size_t split = rest.find(']');
    const std::size_t comma = split == std::string_view::npos ? split : rest.find(',', split);
    if (comma == std::string_view::npos) throw expected("box:[x,y,z],[x,y,z] in metres");
    address.kind = Address::Kind::box;
    address.min = vector(rest.substr(0, comma), text);
    address.max = vector(rest.substr(comma + 1), text);
    if ((address.min.array() > address.max.array()).any()) throw expected("the smaller corner of the box first");
  } else {
    throw InputError(
        fmt::format("address \"{}\": expected corner:U,V, edge:u0|u1|v0|v1, curve:LOOP,K[,FROM,TO], uv:U,V, cp:I,J or "
                    "box:[x,y,z],[x,y,z]",
                    text));
  }
  return address;
}

}  // namespace toile
