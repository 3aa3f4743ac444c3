// The preview as a picture: pixels are read back from the PNG.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "geometry/error.h"
#include "pipeline/preview.h"
#include "pipeline/stroke_font.h"
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

TEST(StrokeFont, CapitalsStandFromTheBaselineToTheHeightOfADigit) {
  for (char c = 'A'; c <= 'Z'; ++c) {
    float low = -100, high = 100;
    for (const auto& line : text_strokes(std::string(1, c), 30).lines)
      for (const Eigen::Vector2f& p : line) low = std::max(low, p.y()), high = std::min(high, p.y());
    EXPECT_NEAR(high, -30, 1) << c;
    EXPECT_NEAR(low, 0, c == 'Q' ? 3 : 1) << c;
  }
}

TEST(StrokeFont, ACharacterOfSeveralBytesIsOneGap) {
  EXPECT_TRUE(text_strokes("é", 10).lines.empty());
  EXPECT_EQ(text_strokes("é", 10).width, text_strokes(" ", 10).width);
}

}  // namespace
}  // namespace toile
