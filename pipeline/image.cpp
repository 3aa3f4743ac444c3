#include "pipeline/image.h"

#include <algorithm>
#include <cmath>

#include "geometry/error.h"
#include "pipeline/colour.h"
#include "pipeline/stroke_font.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#define STBI_WRITE_NO_STDIO
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

namespace toile {

using Eigen::Vector2f;
using Eigen::Vector3f;

void Image::blend(int x, int y, const Vector3f& colour, float cover) {
  if (x < 0 || y < 0 || x >= width || y >= height) return;
  at(x, y) += std::clamp(cover, 0.0f, 1.0f) * (colour - at(x, y));
}

void draw_text(Image& image, float x, float y, float size, std::string_view text, const Vector3f& colour) {
  const TextStrokes strokes = text_strokes(text, size);
  const float half_width = std::max(0.6f, size / 16);
  const Vector2f origin(x, y);
  const int left = static_cast<int>(x) - 3, right = static_cast<int>(x + strokes.width) + 4;
  const int top = static_cast<int>(y - size) - 3, bottom = static_cast<int>(y + size / 2) + 4;
  for (int py = top; py < bottom; ++py)
    for (int px = left; px < right; ++px) {
      const Vector2f p = Vector2f(static_cast<float>(px) + 0.5f, static_cast<float>(py) + 0.5f) - origin;
      float nearest = size;
      for (const auto& line : strokes.lines)
        for (std::size_t k = 0; k + 1 < line.size(); ++k) {
          const Vector2f d = line[k + 1] - line[k];
          const float s = d.squaredNorm() > 0 ? std::clamp((p - line[k]).dot(d) / d.squaredNorm(), 0.0f, 1.0f) : 0.0f;
          nearest = std::min(nearest, (p - line[k] - s * d).norm());
        }
      image.blend(px, py, colour, half_width + 0.5f - nearest);
    }
}

float text_width(std::string_view text, float size) {
  return text_strokes(text, size).width;
}

std::string png(const Image& image) {
  std::vector<unsigned char> bytes;
  bytes.reserve(3 * image.linear.size());
  for (const Vector3f& pixel : image.linear)
    for (int c = 0; c < 3; ++c) bytes.push_back(static_cast<unsigned char>(to_srgb(pixel[c])));
  std::string out;
  const auto append = [](void* context, void* data, int size) {
    static_cast<std::string*>(context)->append(static_cast<const char*>(data), static_cast<std::size_t>(size));
  };
  if (!stbi_write_png_to_func(append, &out, image.width, image.height, 3, bytes.data(), 3 * image.width))
    throw OutputError("preview: the picture could not be encoded");
  return out;
}

}  // namespace toile
