// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/picture/image.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "geometry/error.h"
#include "pipeline/picture/colour.h"
#include "pipeline/picture/font.h"
#include "pipeline/picture/stroke_font.h"

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

using Eigen::Vector2d;
using Eigen::Vector2f;
using Eigen::Vector3f;

void Image::blend(int x, int y, const Vector3f& colour, float cover) {
  if (x < 0 || y < 0 || x >= width || y >= height) return;
  at(x, y) += std::clamp(cover, 0.0f, 1.0f) * (colour - at(x, y));
}

// Scan lines at five heights a pixel row; along x the cover is exact.
void fill_polygons(Image& image, const std::vector<std::vector<Vector2d>>& polygons, const Vector3f& colour,
                   float opacity, bool even_odd) {
  constexpr int samples = 5;
  // The part of the picture that the polygons reach.
  const Vector2d size(image.width, image.height);
  Vector2d low = size, high = Vector2d::Zero();
  for (const std::vector<Vector2d>& polygon : polygons)
    for (const Vector2d& p : polygon) low = low.cwiseMin(p), high = high.cwiseMax(p);
  low = low.cwiseMax(0), high = high.cwiseMin(size);
  const int first = static_cast<int>(low.y()), last = std::min(image.height - 1, static_cast<int>(high.y()));
  const int left = static_cast<int>(low.x()), right = std::min(image.width - 1, static_cast<int>(high.x()));
  // Edges by the row where they begin, so that a row looks at those that reach it.
  struct Edge {
    Vector2d a, b;
    int sign;
  };
  std::vector<Edge> edges;
  for (const std::vector<Vector2d>& polygon : polygons)
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      Vector2d a = polygon[k], b = polygon[(k + 1) % polygon.size()];
      if (a.y() == b.y()) continue;
      const int sign = a.y() < b.y() ? 1 : -1;
      if (sign < 0) std::swap(a, b);
      edges.push_back({a, b, sign});
    }
  std::ranges::sort(edges, {}, [](const Edge& e) { return e.a.y(); });
  std::vector<float> cover(static_cast<std::size_t>(image.width) + 2);
  std::vector<Edge> active;
  std::size_t next = 0;
  for (int row = first; row <= last; ++row) {
    for (; next < edges.size() && edges[next].a.y() < row + 1; ++next) active.push_back(edges[next]);
    std::erase_if(active, [&](const Edge& e) { return e.b.y() < row; });
    if (active.empty()) continue;
    std::fill(cover.begin() + left, cover.begin() + std::max(left, right) + 2, 0.0f);
    std::vector<std::pair<double, int>> meets;
    for (int k = 0; k < samples; ++k) {
      const double y = row + (k + 0.5) / samples;
      meets.clear();
      for (const Edge& e : active)
        if (e.a.y() <= y && y < e.b.y())
          meets.emplace_back(e.a.x() + (y - e.a.y()) / (e.b.y() - e.a.y()) * (e.b.x() - e.a.x()), e.sign);
      std::ranges::sort(meets);
      int winding = 0;
      for (std::size_t m = 0; m + 1 < meets.size(); ++m) {
        winding += even_odd ? 1 : meets[m].second;
        if (even_odd ? winding % 2 == 0 : winding == 0) continue;
        const double from = std::clamp(meets[m].first, 0.0, static_cast<double>(image.width));
        const double to = std::clamp(meets[m + 1].first, 0.0, static_cast<double>(image.width));
        const int x0 = static_cast<int>(from), x1 = static_cast<int>(to);
        const auto add = [&](int x, double amount) {
          cover[static_cast<std::size_t>(x)] += static_cast<float>(amount / samples);
        };
        if (x0 == x1) {
          add(x0, to - from);
        } else {
          add(x0, x0 + 1 - from);
          for (int x = x0 + 1; x < x1; ++x) add(x, 1);
          add(x1, to - x1);
        }
      }
    }
    for (int x = left; x <= right; ++x)
      if (cover[static_cast<std::size_t>(x)] > 0)
        image.blend(x, row, colour, opacity * std::min(1.0f, cover[static_cast<std::size_t>(x)]));
  }
}

TextShape text_shape(std::string_view text, float size) {
  if (!has_strokes(text)) {
    if (std::optional<TextOutlines> outlines = text_outlines(text, size))
      return {{}, std::move(outlines->polygons), outlines->width};
  }
  TextStrokes strokes = text_strokes(text, size);
  return {std::move(strokes.lines), {}, strokes.width};
}

void draw_text(Image& image, float x, float y, float size, std::string_view text, const Vector3f& colour) {
  const TextShape shape = text_shape(text, size);
  const Vector2f origin(x, y);
  std::vector<std::vector<Vector2d>> outlines;
  for (const auto& line : shape.outlines) {
    auto& polygon = outlines.emplace_back();
    for (const Vector2f& p : line) polygon.push_back((origin + p).cast<double>());
  }
  fill_polygons(image, outlines, colour);
  if (shape.strokes.empty()) return;
  const float half_width = std::max(0.6f, size / 16);
  const int left = static_cast<int>(x) - 3, right = static_cast<int>(x + shape.width) + 4;
  const int top = static_cast<int>(y - size) - 3, bottom = static_cast<int>(y + size / 2) + 4;
  for (int py = top; py < bottom; ++py)
    for (int px = left; px < right; ++px) {
      const Vector2f p = Vector2f(static_cast<float>(px) + 0.5f, static_cast<float>(py) + 0.5f) - origin;
      float nearest = size;
      for (const auto& line : shape.strokes)
        for (std::size_t k = 0; k + 1 < line.size(); ++k) {
          const Vector2f d = line[k + 1] - line[k];
          const float s = d.squaredNorm() > 0 ? std::clamp((p - line[k]).dot(d) / d.squaredNorm(), 0.0f, 1.0f) : 0.0f;
          nearest = std::min(nearest, (p - line[k] - s * d).norm());
        }
      image.blend(px, py, colour, half_width + 0.5f - nearest);
    }
}

float text_width(std::string_view text, float size) {
  return text_shape(text, size).width;
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
