// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/picture/stroke_font.h"

#include <algorithm>
#include <array>
#include <string>

#include "pipeline/base/json_text.h"

namespace toile {

namespace {

// Strokes separated by blanks; a point is a digit (x, 0 to 8) and a letter (y: e baseline, m height of an x, q height
// of a digit, a descender). `~` marks a stroke whose corners are rounded.
struct Glyph {
  char character;
  int advance;
  std::string_view strokes;
};

constexpr std::array<Glyph, 87> glyphs{{
    {'0', 8, "~3q0q0e6e6q3q"},
    {'1', 8, "1o3q3e"},
    {'2', 8, "~0o0q6q6k0e 0e6e"},
    {'3', 8, "~0o0q6q6k2k ~2k6k6e0e0g"},
    {'4', 8, "4e4q0h6h"},
    {'5', 8, "5q1q0l ~0l6n6e0e0g"},
    {'6', 8, "~5q0q0e6e6l0l0h"},
    {'7', 8, "0q6q2e"},
    {'8', 8, "~3q0q0k6k6q3q ~3k0k0e6e6k3k"},
    {'9', 8, "~1e6e6q0q0j6j6n"},
    {'.', 4, "1e1f"},
    {',', 4, "1f0c"},
    {':', 4, "1e1f 1l1m"},
    {'-', 7, "1i5i"},
    {'+', 8, "0i6i 3f3l"},
    {'=', 8, "0g6g 0k6k"},
    {'%', 10, "~1q0q0m3m3q1q ~6i5i5e8e8i6i 7q1e"},
    {'/', 7, "0c5q"},
    {'_', 8, "0d6d"},
    {'(', 5, "~3q0o0e3c"},
    {')', 5, "~0q3o3e0c"},
    {'<', 8, "6l0i6f"},
    {'>', 8, "0l6i0f"},
    {'|', 4, "1c1q"},
    {' ', 6, ""},
    {'a', 8, "~6i6e0e0m6m6i 6m6e"},
    {'b', 8, "~0i0e6e6m0m0i 0q0e"},
    {'c', 7, "~5k5m0m0e5e5g"},
    {'d', 8, "~6i6e0e0m6m6i 6q6e"},
    {'e', 8, "0i6i ~6i6m0m0e6e6f"},
    {'f', 6, "~5q2q2m 2m2e 0m4m"},
    {'g', 8, "~6i6e0e0m6m6i 6m6e ~6e6a0a0b"},
    {'h', 8, "0q0e ~0i0m6m6i 6i6e"},
    {'i', 4, "1m1e 1o1p"},
    {'j', 5, "2m2e ~2e2a0a 2o2p"},
    {'k', 7, "0q0e 5m0h 2j5e"},
    {'l', 4, "1q1e"},
    {'m', 10, "0m0e ~0i0m4m4i 4i4e ~4i4m8m8i 8i8e"},
    {'n', 8, "0m0e ~0i0m6m6i 6i6e"},
    {'o', 8, "~3m0m0e6e6m3m"},
    {'p', 8, "~0i0e6e6m0m0i 0m0a"},
    {'q', 8, "~6i6e0e0m6m6i 6m6a"},
    {'r', 6, "0m0e ~0i0m4m"},
    {'s', 7, "~5k5m0m0i5i5e0e0g"},
    {'t', 7, "2p2g ~2g2e5e 0m5m"},
    {'u', 8, "0m0i ~0i0e6e6i 6m6e"},
    {'v', 8, "0m3e6m"},
    {'w', 10, "0m2e4m6e8m"},
    {'x', 8, "0m6e 6m0e"},
    {'y', 8, "0m3e 6m2a"},
    {'z', 8, "0m6m0e6e"},
    {'*', 8, "0k6k 1h5n 5h1n"},
    {'A', 8, "0e3q6e 1i5i"},
    {'B', 8, "0e0q ~0q5q5k0k ~0k6k6e0e"},
    {'C', 8, "~6n6q0q0e6e6h"},
    {'D', 8, "~0q6q6e0e 0e0q"},
    {'E', 8, "6q0q0e6e 0k5k"},
    {'F', 8, "6q0q0e 0k5k"},
    {'G', 8, "~6n6q0q0e6e6k 6k3k"},
    {'H', 8, "0e0q 6e6q 0k6k"},
    {'I', 5, "1e1q 0e2e 0q2q"},
    {'J', 7, "~5h5e0e0h 5h5q"},
    {'K', 8, "0e0q 6q0j 2l6e"},
    {'L', 8, "0q0e6e"},
    {'M', 10, "0e0q4h8q8e"},
    {'N', 8, "0e0q6e6q"},
    {'O', 10, "~4q0q0e8e8q4q"},
    {'P', 8, "0e0q ~0q6q6j0j"},
    {'Q', 10, "~4q0q0e8e8q4q 5h8d"},
    {'R', 8, "0e0q ~0q6q6j0j 3j6e"},
    {'S', 8, "~6n6q0q0k6k6e0e0h"},
    {'T', 8, "0q6q 3q3e"},
    {'U', 8, "0q0i ~0i0e6e6i 6i6q"},
    {'V', 8, "0q3e6q"},
    {'W', 10, "0q2e4n6e8q"},
    {'X', 8, "0q6e 6q0e"},
    {'Y', 8, "0q3k6q 3k3e"},
    {'Z', 8, "0q6q0e6e"},
    {'\'', 4, "1q1n"},
    {'"', 6, "1q1n 3q3n"},
    {'#', 9, "2e3q 5e6q 0i7i 1m8m"},
    {'&', 9, "~7j6e0e0j5m5q1q1n7e"},
    {'!', 4, "1q1h 1e1f"},
    {'?', 8, "~0o0q6q6l3k3h 3e3f"},
    {';', 4, "1f0c 1l1m"},
    {'[', 5, "3q1q1c3c"},
    {']', 5, "0q2q2c0c"},
}};

// Cuts corners: towards the quadratic B-spline of the polygon, its ends kept. [Chaikin 1974]
std::vector<Eigen::Vector2f> rounded(std::vector<Eigen::Vector2f> line) {
  for (int pass = 0; pass < 3; ++pass) {
    std::vector<Eigen::Vector2f> next{line.front()};
    for (std::size_t k = 0; k + 1 < line.size(); ++k) {
      if (k > 0) next.push_back(0.75f * line[k] + 0.25f * line[k + 1]);
      if (k + 2 < line.size()) next.push_back(0.25f * line[k] + 0.75f * line[k + 1]);
    }
    next.push_back(line.back());
    line = std::move(next);
  }
  return line;
}

const Glyph* find_glyph(char32_t character) {
  const auto glyph = std::ranges::find_if(glyphs, [=](const Glyph& g) {
    return static_cast<char32_t>(static_cast<unsigned char>(g.character)) == character;
  });
  return glyph == glyphs.end() ? nullptr : &*glyph;
}

}  // namespace

std::vector<char32_t> code_points(std::string_view text) {
  const std::string valid = utf8(std::string(text));
  std::vector<char32_t> out;
  for (const char c : valid) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte & 0xc0) == 0x80) {
      out.back() = (out.back() << 6) | (byte & 0x3f);
    } else {
      out.push_back(byte < 0x80 ? byte : byte & (byte < 0xe0 ? 0x1f : byte < 0xf0 ? 0x0f : 0x07));
    }
  }
  return out;
}

bool has_strokes(std::string_view text) {
  return std::ranges::all_of(code_points(text), find_glyph);
}

TextStrokes text_strokes(std::string_view text, float size) {
  constexpr float digit_height = 12;
  static constexpr Glyph box{'?', 8, "0e6e6q0q0e"};
  const float scale = size / digit_height;
  TextStrokes out;
  for (const char32_t character : code_points(text)) {
    const Glyph* found = find_glyph(character);
    const Glyph& glyph = found ? *found : box;
    std::string_view rest = glyph.strokes;
    while (!rest.empty()) {
      const std::size_t blank = std::min(rest.find(' '), rest.size());
      std::string_view stroke = rest.substr(0, blank);
      rest.remove_prefix(std::min(blank + 1, rest.size()));
      const bool round = stroke.front() == '~';
      if (round) stroke.remove_prefix(1);
      std::vector<Eigen::Vector2f> line;
      for (std::size_t k = 0; k + 1 < stroke.size(); k += 2)
        line.emplace_back(out.width + scale * static_cast<float>(stroke[k] - '0'),
                          -scale * static_cast<float>(stroke[k + 1] - 'e'));
      out.lines.push_back(round ? rounded(std::move(line)) : line);
    }
    out.width += scale * static_cast<float>(glyph.advance);
  }
  return out;
}

}  // namespace toile
