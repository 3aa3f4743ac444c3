// SPDX-License-Identifier: GPL-3.0-or-later
// The preview as a picture: pixels are read back from the PNG.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "geometry/error.h"
#include "pipeline/picture/colour.h"
#include "pipeline/picture/colour_scale.h"
#include "pipeline/picture/font.h"
#include "pipeline/picture/image.h"
#include "pipeline/picture/preview.h"
#include "pipeline/picture/stroke_font.h"
#include "support/draped.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wunused-function"
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

namespace toile {
namespace {

struct Picture {
  int width = 0, height = 0;
  std::vector<std::array<double, 3>> rgb;
  explicit Picture(const std::string& png) {
    int channels = 0;
    stbi_uc* bytes = stbi_load_from_memory(reinterpret_cast<const stbi_uc*>(png.data()), static_cast<int>(png.size()),
                                           &width, &height, &channels, 3);
    if (!bytes) return;
    for (int k = 0; k < width * height; ++k)
      rgb.push_back({double(bytes[3 * k]), double(bytes[3 * k + 1]), double(bytes[3 * k + 2])});
    stbi_image_free(bytes);
  }
  const std::array<double, 3>& at(int x, int y) const {
    return rgb[static_cast<std::size_t>(x) + static_cast<std::size_t>(width) * static_cast<std::size_t>(y)];
  }
};

double saturation(const std::array<double, 3>& c) {
  const auto [low, high] = std::minmax_element(c.begin(), c.end());
  return *high > 0 ? (*high - *low) / *high : 0;
}

// Angle between colours as directions: what shading leaves as it is, nearly.
double hue_distance(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double x = std::pow(a[c] / 255, 2.2), y = std::pow(b[c] / 255, 2.2);
    ab += x * y, aa += x * x, bb += y * y;
  }
  return std::acos(std::clamp(ab / std::sqrt(aa * bb), -1.0, 1.0));
}

class Preview : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!preview_available()) GTEST_SKIP() << "built without TOILE_PREVIEW";
  }
};

// The bar is the column of saturated pixels furthest to the right.
struct Bar {
  int x = -1, top = -1, bottom = -1;
};
Bar find_bar(const Picture& picture) {
  Bar bar;
  for (int x = picture.width - 1; x >= 0 && bar.x < 0; --x) {
    int saturated = 0;
    for (int y = 0; y < picture.height; ++y) saturated += saturation(picture.at(x, y)) > 0.35;
    if (saturated > picture.height / 3) bar.x = x - 3;
  }
  if (bar.x < 0) return bar;
  for (int y = 0; y < picture.height; ++y)
    if (saturation(picture.at(bar.x, y)) > 0.35) {
      if (bar.top < 0) bar.top = y;
      bar.bottom = y;
    }
  return bar;
}

TEST_F(Preview, ShowsTheClothAndBothEndsOfTheScaleOnIt) {
  const test::Draped draped;
  const Picture picture(preview_png(draped.frame()));
  ASSERT_EQ(picture.width, 900);
  ASSERT_EQ(picture.height, 700);
  const Bar bar = find_bar(picture);
  ASSERT_GT(bar.x, 700);
  const auto high = picture.at(bar.x, bar.top + 3), low = picture.at(bar.x, bar.bottom - 3);
  EXPECT_GT(hue_distance(high, low), 0.5) << "the ends of the scale differ";
  int cloth = 0, like_high = 0, like_low = 0;
  double high_row = 0, low_row = 0;
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < bar.x - 60; ++x) {
      const auto& pixel = picture.at(x, y);
      if (saturation(pixel) < 0.3) continue;
      ++cloth;
      if (hue_distance(pixel, high) < 0.05) ++like_high, high_row += y;
      if (hue_distance(pixel, low) < 0.05) ++like_low, low_row += y;
    }
  EXPECT_GT(cloth, picture.width * picture.height / 10);
  ASSERT_GT(like_high, 200);
  ASSERT_GT(like_low, 200);
  // The strain of this cloth grows downwards, and up is up.
  EXPECT_GT(high_row / like_high, low_row / like_low + 100);
}

TEST_F(Preview, IsTheSameBytesEachTime) {
  const test::Draped draped;
  PreviewOptions small;
  small.width = 320, small.height = 240;
  EXPECT_EQ(preview_png(draped.frame(), small), preview_png(draped.frame(), small));
}

TEST_F(Preview, KeepsTheClothInsideThePictureFromEverySide) {
  const test::Draped draped;
  PreviewOptions options;
  options.width = 240, options.height = 180;
  for (const Eigen::Vector3d& from :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, -1, 0.2), Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 1, -1)}) {
    options.towards_camera = from;
    const Picture picture(preview_png(draped.frame(), options));
    int inside = 0;
    for (int y = 0; y < picture.height; ++y)
      for (int x = 0; x < picture.width; ++x) {
        if (saturation(picture.at(x, y)) < 0.4) continue;
        ++inside;
        EXPECT_TRUE(x > 4 && y > 4 && x < picture.width - 4 && y < picture.height - 4) << from.transpose();
      }
    EXPECT_GT(inside, 500) << from.transpose();
  }
}

TEST_F(Preview, DrawsAClothWithoutStrainsInGreyAndWithoutAScale) {
  test::Draped draped;
  draped.panel.fields = {};
  PreviewOptions small;
  small.width = 240, small.height = 180;
  const Picture picture(preview_png(draped.frame(), small));
  int dark = 0;
  for (const auto& pixel : picture.rgb) {
    EXPECT_LT(saturation(pixel), 0.3);
    dark += pixel[1] < 215;
  }
  EXPECT_GT(dark, 2000);
}

TEST_F(Preview, RefusesAFrameWithNothingToDraw) {
  EXPECT_THROW(preview_png(Frame{}), OutputError);
  test::Draped draped;
  draped.surface = draped.surface.with_points(draped.surface.points() * 1e300);
  EXPECT_THROW(preview_png(draped.frame()), OutputError);
}

TEST(ColourScale, ZeroIsOnItAndSignsCountByOneMeasure) {
  const auto values = [](double low, double high) {
    std::vector<float> out;
    for (int k = 0; k <= 1000; ++k) out.push_back(static_cast<float>(low + (high - low) * k / 1000));
    return out;
  };
  const ColourScale positive = scale_of(values(0.004, 0.02)), both = scale_of(values(-0.01, 0.02)),
                    negative = scale_of(values(-0.03, -0.01)), nearly = scale_of(values(-0.0001, 0.02));
  EXPECT_FALSE(positive.both_signs);
  EXPECT_EQ(positive.low, 0);
  EXPECT_EQ(positive.colour(0.0), strain_colour(0));
  EXPECT_FALSE(nearly.both_signs);
  EXPECT_TRUE(both.both_signs);
  EXPECT_TRUE(negative.both_signs);
  EXPECT_EQ(negative.high, 0);
  for (const ColourScale& scale : {both, negative}) {
    EXPECT_EQ(scale.colour(0), signed_colour(0));
    EXPECT_LE(scale.low, 0);
    EXPECT_GE(scale.high, 0);
  }
  // Half a percent at each end is clipped, and known.
  EXPECT_NEAR(both.high, 0.02 - 0.005 * 0.03, 1e-5);
  EXPECT_EQ(both.most, 0.02f);
  EXPECT_EQ(both.least, -0.01f);
  // Equal amounts of both signs are equally light; zero is the lightest and hardly coloured.
  const auto light = [&](double x) { return signed_colour(x).dot(Eigen::Vector3f(0.2126f, 0.7152f, 0.0722f)); };
  for (const double x : {0.2, 0.5, 1.0}) {
    EXPECT_NEAR(light(x), light(-x), 0.06 * light(x) + 0.02) << x;
    EXPECT_LT(light(x), light(0.8 * x));
    EXPECT_GT(signed_colour(x)[0], signed_colour(x)[2]);
    EXPECT_LT(signed_colour(-x)[0], signed_colour(-x)[2]);
  }
  EXPECT_LT(signed_colour(0).maxCoeff() - signed_colour(0).minCoeff(), 0.02);
}

TEST(ColourScale, TicksAreRoundAndHaveZeroAmongThem) {
  EXPECT_EQ(round_ticks(-0.011, 0.024, 6), (std::vector<double>{-0.01, 0, 0.01, 0.02}));
  for (const auto& [low, high] : {std::pair{-3.7e-5, 1.1e-4}, {0.0, 0.0199}, {-0.3, 0.0}, {0.0, 7.0}, {-1e-7, 1e-7}}) {
    const std::vector<double> ticks = round_ticks(low, high, 6);
    EXPECT_GE(ticks.size(), 3u);
    EXPECT_LE(ticks.size(), 7u);
    EXPECT_NE(std::ranges::find(ticks, 0.0), ticks.end());
    for (const double tick : ticks) {
      EXPECT_GE(tick, low - 1e-9 * (high - low));
      EXPECT_LE(tick, high + 1e-9 * (high - low));
    }
    const double step = ticks[1] - ticks[0], leading = step / std::pow(10.0, std::floor(std::log10(step) + 1e-9));
    EXPECT_TRUE(std::abs(leading - 1) < 1e-6 || std::abs(leading - 2) < 1e-6 || std::abs(leading - 5) < 1e-6) << step;
  }
}

TEST_F(Preview, OfAFieldOfBothSignsShowsBothColoursAndAPaleZero) {
  const test::Draped draped(false, -0.02, 0.02);
  // strain_weft rises from the top to the hem, strain_warp is its least: the larger of both is weft.
  const Picture picture(preview_png(draped.frame()));
  int blue = 0, orange = 0;
  for (const auto& pixel : picture.rgb) {
    if (saturation(pixel) < 0.3) continue;
    (pixel[2] > pixel[0] ? blue : orange) += 1;
  }
  EXPECT_GT(blue, 10000);
  EXPECT_GT(orange, 10000);
}

TEST(StrokeFont, CapitalsStandFromTheBaselineToTheHeightOfADigit) {
  for (char c = 'A'; c <= 'Z'; ++c) {
    float low = -100, high = 100;
    for (const auto& line : text_strokes(std::string(1, c), 30).lines)
      for (const Eigen::Vector2f& p : line) low = std::max(low, p.y()), high = std::min(high, p.y());
    EXPECT_NEAR(high, -30, 1) << c;
    EXPECT_NEAR(low, 0, c == 'Q' ? 3 : 1) << c;
  }
}

TEST(StrokeFont, AnUnknownCharacterIsOneBox) {
  for (const char* text : {"\xc3\xa9", "\xe5\x90\x8e", "\xf0\x9f\x91\x95", "\xff"}) {
    const TextStrokes shape = text_strokes(text, 12);
    ASSERT_EQ(shape.lines.size(), 1u);
    EXPECT_EQ(shape.lines[0].front(), shape.lines[0].back());
    EXPECT_EQ(shape.width, 8);
    EXPECT_FALSE(has_strokes(text));
  }
  EXPECT_TRUE(has_strokes("front draped, 3.5 %"));
}

TEST(Text, LettersBeyondTheStrokeFontShowAsOutlinesOrBoxes) {
  // Whatever fonts this machine has, no letter vanishes: with each the line has more ink, and more width.
  float width = 0;
  std::size_t parts = 0;
  for (const char* text : {"R", "R\xc3\xbc",
                           "R\xc3\xbc"
                           "ckenteil",
                           "R\xc3\xbc"
                           "ckenteil \xe5\x90\x8e",
                           "R\xc3\xbc"
                           "ckenteil \xe5\x90\x8e\xe7\x89\x87"}) {
    const TextShape shape = text_shape(text, 20);
    EXPECT_GT(shape.width, width) << text;
    EXPECT_GT(shape.strokes.size() + shape.outlines.size(), parts) << text;
    width = shape.width, parts = shape.strokes.size() + shape.outlines.size();
    for (const auto& outline : shape.outlines)
      for (const Eigen::Vector2f& p : outline) EXPECT_TRUE(p.x() >= -10 && p.x() <= shape.width + 10 && p.y() > -40);
  }
  Image with(300, 40), without(300, 40);
  draw_text(with, 5, 30, 20, "\xc3\xbc", {1, 1, 1});
  EXPECT_NE(png(with), png(without));
}

// Outlines stand on the baseline and are as high as a digit of the stroke font, so that labels mix.
TEST(Text, OutlinesHaveTheHeightOfADigit) {
  const auto outlines = text_outlines("H", 30);
  if (!outlines) GTEST_SKIP() << "no fonts on this machine";
  float low = -100, high = 100;
  for (const auto& polygon : outlines->polygons)
    for (const Eigen::Vector2f& p : polygon) low = std::max(low, p.y()), high = std::min(high, p.y());
  EXPECT_NEAR(high, -30, 0.1);
  EXPECT_NEAR(low, 0, 0.1);
}

}  // namespace
}  // namespace toile
