// SPDX-License-Identifier: GPL-3.0-or-later
// Dense kernels for the small matrices of a sparse factor, column by column: no packing, as they fit the cache, and
// register tiles as wide as the machine's registers allow. They may read up to `overread` numbers past the last.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "analysis/parallel/lanes.h"

namespace toile {

inline constexpr int overread = 32;
inline constexpr int tile_columns = lane_count == 8 ? 8 : 4;  // accumulators that the registers hold beside three lanes

inline Lanes load_lanes(const double* p) {
  Lanes out;
  std::memcpy(&out, p, sizeof(out));
  return out;
}
inline void store_lanes(double* p, const Lanes& a) {
  std::memcpy(p, &a, sizeof(a));
}
// The first `count` of them.
inline void store_lanes(double* p, const Lanes& a, int count) {
  if (count >= lane_count) return store_lanes(p, a);
  for (int l = 0; l < count; ++l) p[l] = a[l];
}

// A tile of `packs` x `columns`: out = in - A B^T over `depth` columns of A and B, of which `rows` count.
template <int packs, int columns>
void minus_product_tile(const double* in, double* out, std::ptrdiff_t stride_in, std::ptrdiff_t stride_out,
                        const double* a, const double* b, std::ptrdiff_t stride, int depth, int rows) {
  Lanes sum[columns][packs];
  for (int c = 0; c < columns; ++c)
    for (int p = 0; p < packs; ++p) sum[c][p] = load_lanes(in + c * stride_in + p * lane_count);
  for (int k = 0; k < depth; ++k, a += stride, b += stride) {
    Lanes row[packs];
    for (int p = 0; p < packs; ++p) row[p] = load_lanes(a + p * lane_count);
    for (int c = 0; c < columns; ++c)
      for (int p = 0; p < packs; ++p) sum[c][p] -= row[p] * b[c];
  }
  for (int c = 0; c < columns; ++c)
    for (int p = 0; p < packs; ++p)
      if (rows > p * lane_count) store_lanes(out + c * stride_out + p * lane_count, sum[c][p], rows - p * lane_count);
}

template <int columns>
void minus_product_columns(const double* in, double* out, std::ptrdiff_t stride_in, std::ptrdiff_t stride_out,
                           const double* a, const double* b, std::ptrdiff_t stride, int depth, int rows) {
  int r = 0;
  for (; rows - r > 2 * lane_count; r += 3 * lane_count)
    minus_product_tile<3, columns>(in + r, out + r, stride_in, stride_out, a + r, b, stride, depth, rows - r);
  if (rows - r > lane_count)
    minus_product_tile<2, columns>(in + r, out + r, stride_in, stride_out, a + r, b, stride, depth, rows - r);
  else if (rows > r)
    minus_product_tile<1, columns>(in + r, out + r, stride_in, stride_out, a + r, b, stride, depth, rows - r);
}

// out = in - A B^T, rows x columns; A and B have `depth` columns, `stride` apart. in and out may be the same.
inline void minus_product(const double* in, double* out, std::ptrdiff_t stride_in, std::ptrdiff_t stride_out,
                          const double* a, const double* b, std::ptrdiff_t stride, int depth, int rows, int columns) {
  const auto at = [&](auto width, int c) {
    minus_product_columns<width()>(in + c * stride_in, out + c * stride_out, stride_in, stride_out, a, b + c, stride,
                                   depth, rows);
  };
  int c = 0;
  for (; c + tile_columns <= columns; c += tile_columns) at(std::integral_constant<int, tile_columns>(), c);
  if (tile_columns > 4 && c + 4 <= columns) at(std::integral_constant<int, 4>(), c), c += 4;
  if (c + 2 <= columns) at(std::integral_constant<int, 2>(), c), c += 2;
  if (c < columns) at(std::integral_constant<int, 1>(), c);
}

// Rows from n on of the n columns at `corner`, whose first n rows are a factor's. `width`: n, or 0.
template <int width>
void solve_below(double* corner, std::ptrdiff_t stride, const double* inverse, int rows, int columns) {
  const int n = width > 0 ? width : columns;
  for (int r = n; r < rows; r += lane_count) {
    Lanes x[tile_columns];
    for (int c = 0; c < n; ++c) {
      Lanes sum = load_lanes(corner + c * stride + r);
      for (int b = 0; b < c; ++b) sum -= x[b] * corner[b * stride + c];
      x[c] = sum * inverse[c];
    }
    for (int c = 0; c < n; ++c) store_lanes(corner + c * stride + r, x[c], rows - r);
  }
}

// The first `columns` columns of the Cholesky factor of a symmetric matrix, lower triangle, in place; the rows below
// with them. False where a pivot is not positive.
inline bool factorise_columns(double* l, std::ptrdiff_t stride, int rows, int columns) {
  constexpr int width = tile_columns;
  for (int j = 0; j < columns; j += width) {
    const int n = std::min(width, columns - j);
    double* const corner = l + j * stride + j;
    if (j > 0) minus_product(corner, corner, stride, stride, l + j, l + j, stride, j, rows - j, n);
    double inverse[width];
    for (int c = 0; c < n; ++c) {
      double* const column = corner + c * stride;
      for (int b = 0; b < c; ++b) {
        const double factor = corner[b * stride + c];
        for (int r = c; r < n; ++r) column[r] -= corner[b * stride + r] * factor;
      }
      if (!(column[c] > 0)) return false;
      column[c] = std::sqrt(column[c]);
      inverse[c] = 1 / column[c];
      for (int r = c + 1; r < n; ++r) column[r] *= inverse[c];
    }
    if (n == width)
      solve_below<width>(corner, stride, inverse, rows - j, n);
    else
      solve_below<0>(corner, stride, inverse, rows - j, n);
  }
  return true;
}

}  // namespace toile
