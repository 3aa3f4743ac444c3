// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/picture/font.h"

#include <fontconfig/fontconfig.h>
#include <ft2build.h>
#include <unistd.h>
#include FT_FREETYPE_H
#include FT_OUTLINE_H

#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "pipeline/picture/stroke_font.h"

namespace toile {

namespace {

using Eigen::Vector2f;
using Polygons = std::vector<std::vector<Vector2f>>;

struct PatternFree {
  void operator()(FcPattern* pattern) const { FcPatternDestroy(pattern); }
};
struct CharSetFree {
  void operator()(FcCharSet* set) const { FcCharSetDestroy(set); }
};
using Pattern = std::unique_ptr<FcPattern, PatternFree>;
using CharSet = std::unique_ptr<FcCharSet, CharSetFree>;

// FreeType hands an outline over piece by piece; curves become eight chords.
struct OutlineSink {
  Polygons polygons;
  static constexpr int chords = 8;

  static Vector2f point(const FT_Vector* p) { return {static_cast<float>(p->x), static_cast<float>(p->y)}; }
  static int move(const FT_Vector* to, void* self) {
    static_cast<OutlineSink*>(self)->polygons.push_back({point(to)});
    return 0;
  }
  static int line(const FT_Vector* to, void* self) {
    static_cast<OutlineSink*>(self)->polygons.back().push_back(point(to));
    return 0;
  }
  static int conic(const FT_Vector* control, const FT_Vector* to, void* self) {
    auto& polygon = static_cast<OutlineSink*>(self)->polygons.back();
    const Vector2f a = polygon.back(), b = point(control), c = point(to);
    for (int k = 1; k <= chords; ++k) {
      const float t = static_cast<float>(k) / chords, s = 1 - t;
      polygon.push_back(s * s * a + 2 * s * t * b + t * t * c);
    }
    return 0;
  }
  static int cubic(const FT_Vector* first, const FT_Vector* second, const FT_Vector* to, void* self) {
    auto& polygon = static_cast<OutlineSink*>(self)->polygons.back();
    const Vector2f a = polygon.back(), b = point(first), c = point(second), d = point(to);
    for (int k = 1; k <= chords; ++k) {
      const float t = static_cast<float>(k) / chords, s = 1 - t;
      polygon.push_back(s * s * s * a + 3 * s * s * t * b + 3 * s * t * t * c + t * t * t * d);
    }
    return 0;
  }
};

// The machine's fonts. Faces are opened once and kept; calls come one at a time.
class Fonts {
 public:
  Fonts() {
    if (FT_Init_FreeType(&library_) != 0) library_ = nullptr;
    // Without a configuration fontconfig complains on standard error; it has nothing to offer then anyway.
    if (library_ && ::access("/etc/fonts/fonts.conf", R_OK) == 0) config_ = FcInitLoadConfigAndFonts();
    if (config_) main_ = face_with(U'H');
    if (main_) capital_ = capital_height();
  }
  ~Fonts() {
    for (const auto& [file, face] : faces_)
      if (face) FT_Done_Face(face);
    if (library_) FT_Done_FreeType(library_);
    if (config_) FcConfigDestroy(config_);
  }
  Fonts(const Fonts&) = delete;
  Fonts& operator=(const Fonts&) = delete;

  bool any() const { return main_ && capital_ > 0; }

  TextOutlines shape(std::string_view text, float size) {
    TextOutlines out;
    for (const char32_t character : code_points(text)) {
      FT_Face face = FT_Get_Char_Index(main_, character) != 0 ? main_ : face_with(character);
      if (face) {
        add_glyph(face, character, size, out);
      } else {
        add_box(size, out);
      }
    }
    return out;
  }

 private:
  // In ems; 0 where the font has no H.
  float capital_height() {
    if (FT_Load_Char(main_, U'H', FT_LOAD_NO_SCALE) != 0) return 0;
    return static_cast<float>(main_->glyph->metrics.height) / static_cast<float>(main_->units_per_EM);
  }

  // A scalable sans-serif face that has the character; null where there is none.
  FT_Face face_with(char32_t character) {
    const auto known = by_character_.find(character);
    if (known != by_character_.end()) return known->second;
    FT_Face& found = by_character_[character];
    const CharSet wanted(FcCharSetCreate());
    const Pattern pattern(FcPatternCreate());
    if (!wanted || !pattern) return nullptr;
    FcCharSetAddChar(wanted.get(), character);
    FcPatternAddCharSet(pattern.get(), FC_CHARSET, wanted.get());
    FcPatternAddString(pattern.get(), FC_FAMILY, reinterpret_cast<const FcChar8*>("sans-serif"));
    FcPatternAddBool(pattern.get(), FC_SCALABLE, FcTrue);
    FcConfigSubstitute(config_, pattern.get(), FcMatchPattern);
    FcDefaultSubstitute(pattern.get());
    FcResult result = FcResultNoMatch;
    const Pattern match(FcFontMatch(config_, pattern.get(), &result));
    FcChar8* file = nullptr;
    int index = 0;
    if (!match || FcPatternGetString(match.get(), FC_FILE, 0, &file) != FcResultMatch) return nullptr;
    FcPatternGetInteger(match.get(), FC_INDEX, 0, &index);
    FT_Face face = opened(reinterpret_cast<const char*>(file), index & 0xffff);
    if (face && FT_IS_SCALABLE(face) && FT_Get_Char_Index(face, character) != 0) found = face;
    return found;
  }

  FT_Face opened(const std::string& file, int index) {
    const auto [at, made] = faces_.try_emplace({file, index}, nullptr);
    if (made && FT_New_Face(library_, file.c_str(), index, &at->second) != 0) at->second = nullptr;
    return at->second;
  }

  void add_glyph(FT_Face face, char32_t character, float size, TextOutlines& out) const {
    if (FT_Load_Char(face, character, FT_LOAD_NO_SCALE) != 0) return add_box(size, out);
    static constexpr FT_Outline_Funcs calls{
        OutlineSink::move, OutlineSink::line, OutlineSink::conic, OutlineSink::cubic, 0, 0};
    OutlineSink sink;
    FT_Outline_Decompose(&face->glyph->outline, &calls, &sink);
    const float scale = size / capital_ / static_cast<float>(face->units_per_EM);
    for (std::vector<Vector2f>& polygon : sink.polygons) {
      for (Vector2f& p : polygon) p = {out.width + scale * p.x(), -scale * p.y()};
      out.polygons.push_back(std::move(polygon));
    }
    out.width += scale * static_cast<float>(face->glyph->metrics.horiAdvance);
  }

  // A frame as high as a capital: what programs show for a character that they can't.
  static void add_box(float size, TextOutlines& out) {
    const float left = out.width + 0.1f * size, right = out.width + 0.7f * size, line = 0.1f * size;
    out.polygons.push_back({{left, 0}, {right, 0}, {right, -size}, {left, -size}});
    out.polygons.push_back(
        {{left + line, -line}, {left + line, line - size}, {right - line, line - size}, {right - line, -line}});
    out.width += 0.8f * size;
  }

  FT_Library library_ = nullptr;
  FcConfig* config_ = nullptr;
  FT_Face main_ = nullptr;
  float capital_ = 0;
  std::map<std::pair<std::string, int>, FT_Face> faces_;
  std::map<char32_t, FT_Face> by_character_;
};

}  // namespace

std::optional<TextOutlines> text_outlines(std::string_view text, float size) {
  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  static Fonts fonts;
  if (!fonts.any()) return std::nullopt;
  return fonts.shape(text, size);
}

}  // namespace toile
