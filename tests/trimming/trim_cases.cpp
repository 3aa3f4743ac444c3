// SPDX-License-Identifier: GPL-3.0-or-later
#include "trim_cases.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "geometry/error.h"
#include "geometry/refine.h"
#include "trimming/loops.h"

namespace toile::test {
namespace {

using Eigen::Vector2d;

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed * 0x9e3779b97f4a7c15u + 1) {}
  int below(int n) { return static_cast<int>(engine_() % static_cast<std::uint64_t>(n)); }
  int between(int a, int b) { return a + below(b - a + 1); }
  bool chance(int percent) { return below(100) < percent; }
  double unit() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  template <class T>
  T one_of(std::initializer_list<T> list) {
    return *(list.begin() + below(static_cast<int>(list.size())));
  }

 private:
  std::mt19937_64 engine_;
};

double cross(const Vector2d& a, const Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

double weight(Random& random) {
  return random.one_of({1.0, 1.0, 1.0, 2.0, 0.5, 0.25, 4.0, 3.0, 0.75});
}

ExactPiece piece_of(const std::vector<Vector2d>& points) {
  ExactPiece piece;
  for (const Vector2d& p : points) {
    piece.u.push_back(p.x());
    piece.v.push_back(p.y());
    piece.w.push_back(1);
  }
  return piece;
}

void make_rational(Random& random, ExactPiece& piece) {
  for (double& w : piece.w) w = weight(random);
}

// The segment, of degree 1 to 5, at uneven speed. Eighths of it must be exact.
ExactPiece drawn(Random& random, const Vector2d& a, const Vector2d& b) {
  const int degree = random.chance(40) ? 1 : random.between(2, 5);
  std::vector<int> eighths;
  for (int k = 1; k < degree; ++k) eighths.push_back(random.between(0, 8));
  std::sort(eighths.begin(), eighths.end());
  std::vector<Vector2d> points{a};
  for (const int e : eighths) points.push_back(a + (b - a) * (e / 8.0));
  points.push_back(b);
  ExactPiece piece = piece_of(points);
  if (random.chance(30)) make_rational(random, piece);
  return piece;
}

ExactLoop drawn(Random& random, const std::vector<Vector2d>& corners) {
  ExactLoop loop;
  for (std::size_t k = 0; k < corners.size(); ++k)
    loop.push_back(drawn(random, corners[k], corners[(k + 1) % corners.size()]));
  return loop;
}

ExactLoop reversed(ExactLoop loop) {
  std::reverse(loop.begin(), loop.end());
  for (ExactPiece& piece : loop) {
    for (auto* x : {&piece.u, &piece.v, &piece.w}) std::reverse(x->begin(), x->end());
  }
  return loop;
}

// A loop that winds once around the centre: control points ascend by angle, so each piece does, and pieces keep to
// sectors of their own.
ExactLoop star(Random& random, const Vector2d& centre, std::vector<Vector2d> points) {
  const auto upper = [&](const Vector2d& p) {
    return p.y() > centre.y() || (p.y() == centre.y() && p.x() > centre.x());
  };
  std::sort(points.begin(), points.end(), [&](const Vector2d& a, const Vector2d& b) {
    return upper(a) != upper(b) ? upper(a) : cross(a - centre, b - centre) > 0;
  });
  points.erase(std::unique(points.begin(), points.end(),
                           [&](const Vector2d& a, const Vector2d& b) {
                             return upper(a) == upper(b) && std::abs(cross(a - centre, b - centre)) < 1e-9;
                           }),
               points.end());
  const std::size_t n = points.size();
  for (std::size_t k = 0; k < n; ++k)
    if (n < 3 || !(cross(points[k] - centre, points[(k + 1) % n] - centre) > 1e-9)) return {};
  ExactLoop loop;
  for (std::size_t k = 0; k < n;) {
    const std::size_t degree = static_cast<std::size_t>(random.one_of({1, 1, 2, 2, 3, 3, 4, 5}));
    std::vector<Vector2d> control{points[k]};
    while (control.size() <= degree && k + control.size() <= n &&
           cross(points[k] - centre, points[(k + control.size()) % n] - centre) > 1e-9)
      control.push_back(points[(k + control.size()) % n]);
    k += control.size() - 1;
    loop.push_back(piece_of(control));
    if (random.chance(35)) make_rational(random, loop.back());
  }
  return loop;
}

// The next double, but for 0.
double beside(double x, bool above) {
  return x == 0 ? (above ? 0x1p-60 : -0x1p-60) : std::nextafter(x, above ? 1e9 : -1e9);
}

std::vector<double> steps(int n, double h = 1) {
  std::vector<double> x;
  for (int k = 0; k <= n; ++k) x.push_back(h * k);
  return x;
}

void add_line(std::vector<double>& lines, double x) {
  if (!(lines.front() < x && x < lines.back())) return;
  const auto at = std::lower_bound(lines.begin(), lines.end(), x);
  if (*at != x) lines.insert(at, x);
}

// Fewer lines, more lines, thin cells.
void vary_lines(Random& random, std::vector<double>& lines) {
  while (lines.size() > 2 && random.chance(25))
    lines.erase(lines.begin() + random.between(1, static_cast<int>(lines.size()) - 2));
  while (random.chance(30))
    add_line(lines, lines.front() + (lines.back() - lines.front()) * random.between(1, 15) / 16);
  if (random.chance(20)) {
    const double x = lines[static_cast<std::size_t>(random.below(static_cast<int>(lines.size())))];
    const double step = std::pow(10.0, -random.between(3, 12));
    add_line(lines, random.chance(50) ? x + step : x - step);
  }
  if (random.chance(10)) {
    const double x = lines[static_cast<std::size_t>(random.below(static_cast<int>(lines.size())))];
    add_line(lines, beside(x, random.chance(50)));
  }
}

TrimCase lattice_star(Random& random) {
  TrimCase out{"star", {}, {}, {}};
  const int n = random.between(2, 4), q = random.one_of({1, 2, 4, 8});
  const Vector2d centre(n / 2.0 + 0.0625, n / 2.0 + 0.03125);
  std::vector<Vector2d> points;
  for (int k = random.between(4, 20); k > 0; --k)
    points.emplace_back(random.between(0, n * q) / static_cast<double>(q),
                        random.between(0, n * q) / static_cast<double>(q));
  out.loops = {star(random, centre, points)};
  out.u = out.v = steps(n);
  vary_lines(random, out.u);
  vary_lines(random, out.v);
  return out;
}

Vector2d point_at(const ExactPiece& p, double s) {
  std::vector<Eigen::Vector3d> d;
  for (std::size_t i = 0; i < p.u.size(); ++i) d.emplace_back(p.u[i] * p.w[i], p.v[i] * p.w[i], p.w[i]);
  for (std::size_t k = d.size() - 1; k > 0; --k)
    for (std::size_t i = 0; i < k; ++i) d[i] = (1 - s) * d[i] + s * d[i + 1];
  return d[0].head<2>() / d[0].z();
}

double an_ulp_or_so(Random& random, double x) {
  for (int k = random.below(4); k > 0; --k) x = beside(x, random.chance(50));
  return x;
}

// Arbitrary doubles; knot lines through rounded points of the curve and through its extremes, an ulp or so beside them.
TrimCase extremes(Random& random) {
  TrimCase out{"extremes", {}, {}, {}};
  std::vector<Vector2d> points;
  for (int k = random.between(5, 16); k > 0; --k) points.emplace_back(random.unit() * 4, random.unit() * 4);
  out.loops = {star(random, {2.01, 1.98}, points)};
  if (out.loops[0].empty()) return out;
  out.u = out.v = {0, 4};
  for (int k = random.between(1, 6); k > 0; --k) {
    const ExactPiece& piece =
        out.loops[0][static_cast<std::size_t>(random.below(static_cast<int>(out.loops[0].size())))];
    if (random.chance(30)) {
      const Vector2d x = point_at(piece, random.chance(30) ? random.below(9) / 8.0 : random.unit());
      add_line(out.u, an_ulp_or_so(random, x.x()));
      add_line(out.v, an_ulp_or_so(random, x.y()));
      continue;
    }
    const int axis = random.below(2);
    const double sign = random.chance(50) ? 1 : -1;
    double best = 0;
    for (int i = 1; i < 64; ++i)
      if (sign * point_at(piece, i / 64.0)[axis] > sign * point_at(piece, best)[axis]) best = i / 64.0;
    double lo = std::max(0.0, best - 1 / 64.0), hi = std::min(1.0, best + 1 / 64.0);
    for (int i = 0; i < 80; ++i) {
      const double a = lo + (hi - lo) / 3, b = hi - (hi - lo) / 3;
      (sign * point_at(piece, a)[axis] < sign * point_at(piece, b)[axis] ? lo : hi) =
          sign * point_at(piece, a)[axis] < sign * point_at(piece, b)[axis] ? a : b;
    }
    add_line(axis == 0 ? out.u : out.v, an_ulp_or_so(random, point_at(piece, lo)[axis]));
  }
  return out;
}

using Polynomial = std::vector<double>;  // Bernstein coefficients, small integers over a power of 2

Polynomial product(const Polynomial& p, const Polynomial& q) {
  const auto binomial = [](std::size_t n, std::size_t k) {
    double b = 1;
    for (std::size_t i = 1; i <= k; ++i) b = b * static_cast<double>(n - k + i) / static_cast<double>(i);
    return b;
  };
  const std::size_t m = p.size() - 1, n = q.size() - 1;
  Polynomial r(m + n + 1, 0);
  for (std::size_t i = 0; i <= m; ++i)
    for (std::size_t j = 0; j <= n; ++j) r[i + j] += binomial(m, i) * binomial(n, j) * p[i] * q[j];
  for (std::size_t k = 0; k <= m + n; ++k) r[k] /= binomial(m + n, k);
  return r;
}

// All entries times one number, so that they are whole; nothing where they don't become so.
Polynomial whole(Polynomial p) {
  for (const double factor : {1.0, 2.0, 3.0, 6.0, 5.0, 10.0, 30.0, 60.0, 120.0}) {
    Polynomial scaled = p;
    bool all = true;
    for (double& c : scaled) {
      c = std::round(c * factor * 720) / 720;
      all = all && std::abs(c - std::round(c)) < 1e-9;
      c = std::round(c);
    }
    if (all) return scaled;
  }
  return {};
}

// A piece from x0 on, u ascending, that meets v = c at s = b / a with a multiplicity of 1 to 5, and often u = x0 + ...
// there too; the coordinates are exact.
ExactPiece designed(Random& random, double x0, double c, std::vector<double>& lines_u) {
  while (true) {
    const int a = random.one_of({2, 3, 4, 5, 7, 3, 6}), b = random.between(1, a - 1);
    const Polynomial linear{static_cast<double>(-b), static_cast<double>(a - b)};
    Polynomial v = linear;
    const int multiplicity = random.one_of({1, 2, 2, 2, 3, 4, 5});
    for (int k = 1; k < multiplicity; ++k) v = product(v, linear);
    if (multiplicity < 4 && random.chance(40)) {
      Polynomial other{static_cast<double>(random.between(-3, 3)), static_cast<double>(random.between(-3, 3))};
      if (other[0] == 0 && other[1] == 0) other[0] = 1;
      v = product(v, other);
      if (multiplicity < 3 && random.chance(30)) v = product(v, other);
    }
    v = whole(v);
    if (v.empty()) continue;
    double size = 0;
    for (const double x : v) size = std::max(size, std::abs(x));
    const double scale = std::ldexp(random.chance(50) ? 1.0 : -1.0, -std::ilogb(size) - 1);
    const std::size_t degree = v.size() - 1;
    ExactPiece piece;
    std::vector<double> w(degree + 1, 1.0);
    if (random.chance(40))
      for (double& x : w) x = random.one_of({1.0, 2.0, 0.5, 0.25, 1.0});
    // N_u = a s - b over the weights: u = x + h N_u / w.
    bool ascending = true;
    const double h = 0.5 / 16, x = x0 + 1;
    Polynomial u = linear;
    for (std::size_t k = 1; k < degree; ++k) u = product(u, {1.0, 1.0});
    // Degree elevation of a linear function divides by the degree; steps that stay whole are taken instead.
    if (random.chance(50) && degree > 1) {
      u = whole(u);
    } else {
      for (std::size_t k = 0; k <= degree; ++k) u[k] = static_cast<double>(k) * a - static_cast<double>(degree) * b;
    }
    if (u.empty()) continue;
    for (std::size_t k = 0; k <= degree; ++k) {
      piece.u.push_back(x + h * u[k] / (std::abs(u[degree] - u[0]) > 32 ? 8 : 1) / w[k]);
      piece.v.push_back(c + scale * v[k] / w[k] / 4);
      piece.w.push_back(w[k]);
      ascending = ascending && (k == 0 || piece.u[k] > piece.u[k - 1]);
    }
    if (!ascending || piece.u.front() < x0 + 0.0625 || piece.u.back() > x0 + 1.9375) continue;
    if (random.chance(60)) lines_u.push_back(x);
    return piece;
  }
}

// Below a chain of designed pieces, above another or a line: chains that ascend in u don't meet.
TrimCase touching_graph(Random& random) {
  TrimCase out{"graph", {0}, {0, 8}, {}};
  const int n = random.between(1, 3);
  const double width = 2.0 * n;
  std::vector<double> more;
  const auto chain = [&](double c) {
    ExactLoop pieces;
    Vector2d last(0, c + random.between(-4, 4) / 8.0);
    for (int k = 0; k < n; ++k) {
      const ExactPiece piece = designed(random, 2.0 * k, c, more);
      const Vector2d start(piece.u.front(), piece.v.front());
      pieces.push_back(piece_of({last, start}));
      pieces.push_back(piece);
      last = {piece.u.back(), piece.v.back()};
    }
    pieces.push_back(piece_of({last, {width, c + random.between(-4, 4) / 8.0}}));
    return pieces;
  };
  out.u.push_back(width);
  ExactLoop loop = chain(2);
  ExactLoop top;
  if (random.chance(50)) {
    top = reversed(chain(6));
  } else {
    top = {drawn(random, {width, 5.5}, {0, 5.5})};
  }
  const auto first = [](const ExactPiece& p) { return Vector2d(p.u.front(), p.v.front()); };
  const auto last = [](const ExactPiece& p) { return Vector2d(p.u.back(), p.v.back()); };
  const Vector2d a = last(loop.back()), b = first(top.front()), c = last(top.back()), d = first(loop.front());
  loop.push_back(drawn(random, a, b));
  loop.insert(loop.end(), top.begin(), top.end());
  loop.push_back(drawn(random, c, d));
  out.loops = {loop};
  for (const double x : {2.0, 6.0}) add_line(out.v, x);
  for (const double x : more) add_line(out.u, x);
  vary_lines(random, out.u);
  vary_lines(random, out.v);
  return out;
}

// Steps along lattice lines: runs, corners on lines and vertices.
TrimCase histogram(Random& random) {
  TrimCase out{"histogram", {}, {}, {}};
  const int n = random.between(2, 4), q = random.one_of({1, 2, 2, 4});
  std::vector<Vector2d> corners;
  const auto at = [&](int k) { return k / static_cast<double>(q); };
  std::vector<int> stops{0, n * q};
  for (int k = random.between(0, 4); k > 0; --k) stops.push_back(random.between(0, n * q));
  std::sort(stops.begin(), stops.end());
  stops.erase(std::unique(stops.begin(), stops.end()), stops.end());
  const auto add = [&](double x, double y) {
    if (corners.empty() || corners.back() != Vector2d(x, y)) corners.emplace_back(x, y);
  };
  const int middle = n * q / 2;
  const int slope = random.chance(50) ? 1 : 0;
  for (std::size_t k = 0; k + 1 < stops.size(); ++k) {
    const int y = random.between(0, middle);
    add(at(stops[k]), at(y));
    add(at(stops[k + 1]), at(slope ? random.between(0, middle) : y));
  }
  std::reverse(stops.begin(), stops.end());
  for (std::size_t k = 0; k + 1 < stops.size(); ++k) {
    const int y = random.between(middle + 1, n * q);
    add(at(stops[k]), at(y));
    add(at(stops[k + 1]), at(slope ? random.between(middle + 1, n * q) : y));
  }
  if (corners.front() == corners.back()) corners.pop_back();
  out.loops = {drawn(random, corners)};
  out.u = out.v = steps(n);
  vary_lines(random, out.u);
  vary_lines(random, out.v);
  return out;
}

ExactLoop star_in_box(Random& random, double x0, double y0, double size) {
  while (true) {
    std::vector<Vector2d> points;
    for (int k = random.between(4, 9); k > 0; --k)
      points.emplace_back(x0 + size * random.between(1, 15) / 16, y0 + size * random.between(1, 15) / 16);
    ExactLoop loop = star(random, {x0 + size * 0.51171875, y0 + size * 0.4921875}, points);
    if (!loop.empty()) return loop;
  }
}

ExactLoop border(Random& random, double n) {
  return drawn(random, {{0, 0}, {n, 0}, {n, n}, {0, n}});
}

// Holes in boxes of their own, several in one cell.
TrimCase holes(Random& random) {
  TrimCase out{"holes", {}, {}, {}};
  const int n = random.between(1, 3), boxes = random.between(1, 4);
  out.loops = {border(random, n)};
  out.u = out.v = steps(n);
  const double size = std::ldexp(n, -2);
  for (int j = 0; j < boxes; ++j)
    for (int i = 0; i < boxes; ++i)
      if (random.chance(50)) out.loops.push_back(reversed(star_in_box(random, i * size, j * size, size)));
  vary_lines(random, out.u);
  vary_lines(random, out.v);
  return out;
}

// Holes that share one point, there tangent to each other or not; the point may lie on the outline.
TrimCase touching_holes(Random& random) {
  TrimCase out{"touching holes", {}, {}, {}};
  const int n = random.between(1, 3);
  const bool on_outline = random.chance(30);
  const Vector2d apex(n * random.between(6, 10) / 16.0, on_outline ? 0 : n * random.between(6, 10) / 16.0);
  if (on_outline && random.chance(50)) {
    out.loops = {drawn(random, {{0, 0},
                                apex,
                                {static_cast<double>(n), 0},
                                {static_cast<double>(n), static_cast<double>(n)},
                                {0, static_cast<double>(n)}})};
  } else {
    out.loops = {border(random, n)};
  }
  // Directions ascending by angle, on a square around the apex.
  std::vector<Vector2d> around;
  const int total = on_outline ? 13 : 24;
  const auto place = [](int i) -> Vector2d {  // 24 places on the square of half size 3, from (3, 0)
    if (i < 3) return {3, i};
    if (i < 9) return {6 - i, 3};
    if (i < 15) return {-3, 12 - i};
    if (i < 21) return {i - 18, -3};
    return {3, i - 24};
  };
  for (int k = 0; k < total; ++k) around.push_back(place(k));
  const double h = n / 64.0;
  std::size_t k = on_outline ? 1 : 0;
  const std::size_t end = around.size() - (on_outline ? 1 : 0);
  while (k + 4 <= end) {
    std::array<Vector2d, 4> d;
    bool narrow = true;
    std::size_t last = k;
    for (std::size_t i = 0; i < 4; ++i) {
      if (i > 0) last += static_cast<std::size_t>(random.between(1, 2));
      if (last >= end) {
        narrow = false;
        break;
      }
      d[i] = around[last] * (h * random.between(1, 4));
    }
    if (!narrow) break;
    if (random.chance(80)) {
      ExactLoop loop;
      if (random.chance(70)) {
        loop = {piece_of({apex, apex + d[0], apex + d[1]}), drawn(random, apex + d[1], apex + d[2]),
                piece_of({apex + d[2], apex + d[3], apex})};
        for (ExactPiece& p : loop)
          if (random.chance(30)) make_rational(random, p);
      } else {
        loop = drawn(random, {apex, apex + d[1], apex + d[2]});
      }
      out.loops.push_back(reversed(loop));
    }
    k = random.chance(40) ? last : last + 1;
  }
  out.u = out.v = steps(n);
  if (random.chance(50)) add_line(out.u, apex.x());
  if (random.chance(50)) add_line(out.v, apex.y());
  vary_lines(random, out.u);
  vary_lines(random, out.v);
  return out;
}

ExactLoop square_around(const Vector2d& c, double h) {
  const Vector2d corner[] = {c + Vector2d(h, h), c + Vector2d(-h, h), c + Vector2d(-h, -h), c + Vector2d(h, -h)};
  ExactLoop loop;
  for (int k = 0; k < 4; ++k) loop.push_back(piece_of({corner[k], corner[(k + 1) % 4]}));
  return loop;
}

// Whether no place on a loop, of a thousand a piece, lies in a square.
bool keeps_clear(const ExactLoop& loop, const Vector2d& centre, double half) {
  constexpr int places = 1024;
  for (const ExactPiece& p : loop)
    for (int k = 0; k < places; ++k)
      if ((point_at(p, k / static_cast<double>(places)) - centre).cwiseAbs().maxCoeff() <= half) return false;
  return true;
}

// Holes that cross the outline or another hole; and, to be refused, holes outside and holes in holes.
TrimCase invalid(Random& random) {
  TrimCase out{"invalid", {}, {}, {}};
  out.valid = false;
  out.u = out.v = steps(4);
  switch (random.below(4)) {
    case 0: {  // around a point of another hole
      const ExactLoop hole = star_in_box(random, 1, 1, 2);
      const ExactPiece& p = hole[static_cast<std::size_t>(random.below(static_cast<int>(hole.size())))];
      const Vector2d c = point_at(p, random.chance(50) ? 0 : 0.4375);
      out.family = "crossing";
      out.loops = {border(random, 4), reversed(hole), reversed(square_around(c, 0.0625))};
      break;
    }
    case 1: {  // around a point of the outline
      const ExactLoop outline = star_in_box(random, 0.5, 0.5, 3);
      const ExactPiece& p = outline[static_cast<std::size_t>(random.below(static_cast<int>(outline.size())))];
      const Vector2d c = point_at(p, random.chance(50) ? 0 : 0.5625);
      out.family = "crossing";
      out.loops = {outline, reversed(square_around(c, 0.0625))};
      break;
    }
    case 2:
      out.loops = {star_in_box(random, 0, 0, 2), reversed(star_in_box(random, 2, random.between(0, 2), 2))};
      break;
    default: {
      const double size = 0.015625;
      const Vector2d corner(2.015625, 1.9765625);
      ExactLoop hole = star_in_box(random, 1, 1, 2);
      while (!keeps_clear(hole, corner + Vector2d::Constant(size / 2), size)) hole = star_in_box(random, 1, 1, 2);
      out.loops = {border(random, 4), reversed(hole), reversed(star_in_box(random, corner.x(), corner.y(), size))};
    }
  }
  return out;
}

// Single coordinates moved by an ulp or a little more: touches become crossings or none, runs leave their line.
void nudge(Random& random, TrimCase& given) {
  const auto moved = [&](double x) {
    if (random.chance(60)) return beside(x, random.chance(50));
    return x + std::ldexp(random.chance(50) ? 1.0 : -1.0, -random.between(30, 48));
  };
  for (int k = random.between(1, 4); k > 0; --k) {
    // A border with a run along itself would be no loop.
    const int first = given.family == "holes" ? 1 : 0, count = static_cast<int>(given.loops.size()) - first;
    if (count == 0) return;
    ExactLoop& loop = given.loops[static_cast<std::size_t>(first + random.below(count))];
    const std::size_t at = static_cast<std::size_t>(random.below(static_cast<int>(loop.size())));
    ExactPiece& piece = loop[at];
    const std::size_t i = static_cast<std::size_t>(random.below(piece.degree() + 1));
    const int axis = random.below(2);
    const auto coordinate = [&](ExactPiece& p, std::size_t j) -> double& { return (axis == 0 ? p.u : p.v)[j]; };
    const std::vector<double>& lines = axis == 0 ? given.u : given.v;
    // Nor would a run along a line that turns back.
    const auto runs = [](const ExactPiece& p) {
      const auto constant = [](const std::vector<double>& x) {
        return std::all_of(x.begin(), x.end(), [&](double y) { return y == x[0]; });
      };
      return p.degree() > 1 && (constant(p.u) || constant(p.v));
    };
    const ExactPiece &previous = loop[(at + loop.size() - 1) % loop.size()], &next = loop[(at + 1) % loop.size()];
    if (runs(piece) || (i == 0 && runs(previous)) || (i + 1 == piece.u.size() && runs(next))) continue;
    const double x = moved(coordinate(piece, i));
    if (x < lines.front() || x > lines.back()) continue;
    if (i == 0) {
      ExactPiece& before = loop[(at + loop.size() - 1) % loop.size()];
      coordinate(before, before.u.size() - 1) = x;
    }
    if (i + 1 == piece.u.size()) coordinate(loop[(at + 1) % loop.size()], 0) = x;
    coordinate(piece, i) = x;
  }
}

// ---- a case as a surface ----

NurbsSurface plane(const std::vector<double>& u, const std::vector<double>& v) {
  Eigen::Matrix3Xd net(3, static_cast<Eigen::Index>(u.size() * v.size()));
  for (std::size_t j = 0; j < v.size(); ++j)
    for (std::size_t i = 0; i < u.size(); ++i) net.col(static_cast<Eigen::Index>(i + u.size() * j)) << u[i], v[j], 0;
  return {clamped_knots(1, u), clamped_knots(1, v), net};
}

Curve2 curve_of(const ExactPiece& piece, Interval range) {
  Curve2::Points points(2, piece.degree() + 1);
  for (int i = 0; i <= piece.degree(); ++i)
    points.col(i) << piece.u[static_cast<std::size_t>(i)], piece.v[static_cast<std::size_t>(i)];
  return Curve2(uniform_knots(piece.degree(), 1, range), points, piece.w);
}

// Neighbouring pieces of one degree and one weight at the joint, as one curve with full knots.
Curve2 joined(const ExactLoop& loop, std::size_t first, std::size_t count) {
  if (count == 1) return curve_of(loop[first], {0, 1});
  const int p = loop[first].degree();
  std::vector<double> knots(static_cast<std::size_t>(p) + 1, 0.0), weights;
  std::vector<Vector2d> points;
  for (std::size_t k = 0; k < count; ++k) {
    const ExactPiece& piece = loop[first + k];
    for (int i = k == 0 ? 0 : 1; i <= p; ++i) {
      points.emplace_back(piece.u[static_cast<std::size_t>(i)], piece.v[static_cast<std::size_t>(i)]);
      weights.push_back(piece.w[static_cast<std::size_t>(i)]);
    }
    for (int i = k + 1 == count ? 0 : 1; i <= p; ++i) knots.push_back(static_cast<double>(k + 1));
  }
  Curve2::Points net(2, static_cast<Eigen::Index>(points.size()));
  for (std::size_t k = 0; k < points.size(); ++k) net.col(static_cast<Eigen::Index>(k)) = points[k];
  return Curve2(KnotVector(p, knots), net, weights);
}

TrimmedSurface surface_of(const TrimCase& given, bool join) {
  TrimmedSurface out;
  out.name = "panel";
  out.surface = plane(given.u, given.v);
  for (std::size_t l = 0; l < given.loops.size(); ++l) {
    TrimLoop loop;
    loop.index = static_cast<int>(l);
    loop.kind = l == 0 ? LoopKind::outer : LoopKind::hole;
    const ExactLoop& pieces = given.loops[l];
    for (std::size_t k = 0; k < pieces.size();) {
      std::size_t count = 1;
      while (join && k + count < pieces.size() && pieces[k + count].degree() == pieces[k].degree() &&
             pieces[k + count].w.front() == pieces[k + count - 1].w.back())
        ++count;
      TrimCurve trim;
      trim.curve = joined(pieces, k, count);
      trim.index = static_cast<int>(loop.curves.size());
      loop.curves.push_back(trim);
      k += count;
    }
    out.loops.push_back(loop);
  }
  return out;
}

Curve2 backwards(const Curve2& curve) {
  const Interval d = curve.domain();
  std::vector<double> knots(curve.knots().knots().begin(), curve.knots().knots().end());
  std::reverse(knots.begin(), knots.end());
  for (double& k : knots) k = d.min + d.max - k;
  std::vector<double> weights(curve.weights().rbegin(), curve.weights().rend());
  return Curve2(KnotVector(curve.degree(), knots), curve.points().rowwise().reverse(), weights);
}

Curve2 with_knots(const Curve2& curve, double factor, double shift) {
  std::vector<double> knots(curve.knots().knots().begin(), curve.knots().knots().end());
  for (double& k : knots) k = (k + shift) * factor;
  return Curve2(KnotVector(curve.degree(), knots), curve.points(), curve.weights());
}

// ---- signed permutations of the plane ----

struct Turn {
  bool swap = false;    // then (u, v) -> (v, u) first
  double u = 1, v = 1;  // factors of the new coordinates
  double shift_u = 0, shift_v = 0;
  bool mirrors() const { return (u < 0) != ((v < 0) != swap); }
};

// Nothing where a coordinate is rounded.
std::optional<TrimCase> turned(const TrimCase& given, const Turn& turn) {
  bool exact = true;
  const auto map = [&](double x, double factor, double shift) {
    const double y = x * factor, z = y + shift;
    exact = exact && z - shift == y && (shift == 0 || z - y == shift);
    return z;
  };
  TrimCase out = given;
  if (turn.swap) std::swap(out.u, out.v);
  for (double& x : out.u) x = map(x, turn.u, turn.shift_u);
  for (double& x : out.v) x = map(x, turn.v, turn.shift_v);
  std::sort(out.u.begin(), out.u.end());
  std::sort(out.v.begin(), out.v.end());
  for (ExactLoop& loop : out.loops) {
    for (ExactPiece& piece : loop) {
      if (turn.swap) std::swap(piece.u, piece.v);
      for (double& x : piece.u) x = map(x, turn.u, turn.shift_u);
      for (double& x : piece.v) x = map(x, turn.v, turn.shift_v);
    }
    if (turn.mirrors()) loop = reversed(loop);
  }
  if (!exact) return std::nullopt;
  return out;
}

ExactTopology turned(const ExactTopology& given, const Turn& turn, int nu, int nv) {
  ExactTopology out = given;
  const int mu = turn.swap ? nv : nu, mv = turn.swap ? nu : nv;
  const auto index = [&](int i, int j, int n, int m, int width) {
    if (turn.swap) std::swap(i, j);
    if (turn.u < 0) i = n - i;
    if (turn.v < 0) j = m - j;
    return static_cast<std::size_t>(i + width * j);
  };
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i) {
      const std::size_t from = static_cast<std::size_t>(i + nu * j), to = index(i, j, mu - 1, mv - 1, mu);
      out.cells[to] = given.cells[from];
      out.areas[to] = given.areas[from] * std::abs(turn.u * turn.v);
    }
  for (int j = 0; j <= nv; ++j)
    for (int i = 0; i <= nu; ++i)
      out.vertices[index(i, j, mu, mv, mu + 1)] = given.vertices[static_cast<std::size_t>(i + (nu + 1) * j)];
  for (auto& events : out.events) {
    for (ExactEvent& e : events) {
      if (turn.swap) {
        std::swap(e.line_u, e.line_v);
        std::swap(e.u, e.v);
        switch (e.kind) {
          case PointKind::crossing_u:
            e.kind = PointKind::crossing_v;
            break;
          case PointKind::crossing_v:
            e.kind = PointKind::crossing_u;
            break;
          case PointKind::tangent_u:
            e.kind = PointKind::tangent_v;
            break;
          case PointKind::tangent_v:
            e.kind = PointKind::tangent_u;
            break;
          default:
            break;
        }
      }
      if (turn.u < 0 && e.line_u >= 0) e.line_u = mu - e.line_u;
      if (turn.v < 0 && e.line_v >= 0) e.line_v = mv - e.line_v;
      e.u = e.u * turn.u + turn.shift_u;
      e.v = e.v * turn.v + turn.shift_v;
    }
    if (turn.mirrors()) std::reverse(events.begin(), events.end());
  }
  return out;
}

// ---- comparison ----

std::string text(const ExactEvent& e) {
  return std::string(name(e.kind)) + "(" + std::to_string(e.line_u) + "," + std::to_string(e.line_v) + ")";
}
std::string text(const TrimEvent& e) {
  return std::string(name(e.kind)) + "(" + std::to_string(e.line_u) + "," + std::to_string(e.line_v) + ")";
}

// Integral of (u - u0) dv along a piece of a chain.
double swept(const TrimmedSurface& surface, const BoundaryPiece& piece, double u0) {
  if (piece.loop < 0) return ((piece.from.x() + piece.to.x()) / 2 - u0) * (piece.to.y() - piece.from.y());
  const Curve2& curve =
      surface.loops[static_cast<std::size_t>(piece.loop)].curves[static_cast<std::size_t>(piece.curve)].curve;
  const double lo = std::min(piece.t0, piece.t1), hi = std::max(piece.t0, piece.t1);
  std::vector<double> stops{lo};
  for (const double k : curve.knots().breaks())
    if (lo < k && k < hi) stops.push_back(k);
  stops.push_back(hi);
  long double sum = 0;
  for (std::size_t s = 0; s + 1 < stops.size(); ++s)
    sum += integral(
        [&](long double t) {
          const auto jet = evaluate(curve, static_cast<double>(t));
          return (jet.x.x() - u0) * jet.d1.y();
        },
        stops[s], stops[s + 1], curve.rational());
  return static_cast<double>(piece.t0 <= piece.t1 ? sum : -sum);
}

std::string difference(const TrimmedSurface& surface, const TrimTopology& traced, const ExactTopology& exact) {
  const KnotMesh& mesh = traced.mesh;
  const double size = std::max({mesh.u.back() - mesh.u.front(), mesh.v.back() - mesh.v.front(), std::abs(mesh.u.back()),
                                std::abs(mesh.u.front()), std::abs(mesh.v.back()), std::abs(mesh.v.front())});
  for (std::size_t l = 0; l < exact.events.size(); ++l) {
    std::vector<TrimEvent> events;
    for (const TrimEvent& e : traced.events)
      if (e.loop == static_cast<int>(l)) events.push_back(e);
    const std::vector<ExactEvent>& expected = exact.events[l];
    bool same = events.size() == expected.size();
    if (same && !events.empty()) {
      same = false;
      for (std::size_t r = 0; r < events.size() && !same; ++r) {
        same = true;
        for (std::size_t k = 0; k < events.size() && same; ++k) {
          const ExactEvent& e = expected[(k + r) % events.size()];
          same = events[k].kind == e.kind && events[k].line_u == e.line_u && events[k].line_v == e.line_v &&
                 std::abs(static_cast<double>(e.u) - events[k].uv.x()) <= 1e-7 * size &&
                 std::abs(static_cast<double>(e.v) - events[k].uv.y()) <= 1e-7 * size;
        }
      }
    }
    if (!same) {
      std::string out = "events of loop " + std::to_string(l) + ":";
      for (const TrimEvent& e : events) out += " " + text(e);
      out += "; expected";
      for (const ExactEvent& e : expected) out += " " + text(e);
      return out;
    }
  }
  for (int j = 0; j < mesh.cells_v(); ++j)
    for (int i = 0; i < mesh.cells_u(); ++i) {
      const std::size_t cell = static_cast<std::size_t>(mesh.cell(i, j));
      if (traced.cells[cell] != exact.cells[cell])
        return "cell " + std::to_string(i) + ", " + std::to_string(j) + " is " +
               std::to_string(static_cast<int>(traced.cells[cell])) + ", expected " +
               std::to_string(static_cast<int>(exact.cells[cell]));
    }
  for (std::size_t k = 0; k < exact.vertices.size(); ++k)
    if (traced.vertices[k] != exact.vertices[k])
      return "vertex " + std::to_string(k) + " is " + std::to_string(static_cast<int>(traced.vertices[k])) +
             ", expected " + std::to_string(static_cast<int>(exact.vertices[k]));
  for (const CutCell& cell : traced.cut_cells) {
    double area = 0;
    for (const auto& chain : cell.loops)
      for (std::size_t k = 0; k < chain.size(); ++k) {
        if (chain[k].to != chain[(k + 1) % chain.size()].from) return "a chain is broken";
        area += swept(surface, chain[k], mesh.u[static_cast<std::size_t>(cell.i)]);
      }
    const double width = mesh.u[static_cast<std::size_t>(cell.i) + 1] - mesh.u[static_cast<std::size_t>(cell.i)],
                 height = mesh.v[static_cast<std::size_t>(cell.j) + 1] - mesh.v[static_cast<std::size_t>(cell.j)];
    const double expected = exact.areas[static_cast<std::size_t>(mesh.cell(cell.i, cell.j))];
    // Ends of a chain and places between are rounded to some ulps of the coordinates, times the sides of the cell.
    if (!(std::abs(area - expected) <= 1e-9 * width * height + 4e-14 * size * (width + height)))
      return "area of cell " + std::to_string(cell.i) + ", " + std::to_string(cell.j) + " is " +
             std::to_string(area / width / height) + " of it, wrong by " +
             std::to_string(1e9 * (area - expected) / width / height) + "e-9";
  }
  return "";
}

std::string traced_difference(TrimmedSurface surface, const ExactTopology& exact) {
  try {
    validate_loops(surface);
    return difference(surface, trace_trims(surface), exact);
  } catch (const Error& e) {
    return e.what();
  }
}

bool refused(TrimmedSurface surface) {
  try {
    validate_loops(surface);
    return false;
  } catch (const GeometryError&) {
    return true;
  }
}

std::vector<ExactLoop> traced_loops(const TrimmedSurface& surface) {
  std::vector<ExactLoop> loops;
  for (const TrimLoop& loop : surface.loops) {
    ExactLoop& pieces = loops.emplace_back();
    for (const TrimCurve& c : loop.curves) {
      ExactLoop own;
      for (const TrimSpan& span : trim_spans(c.curve)) {
        ExactPiece& piece = own.emplace_back();
        const auto n = static_cast<std::ptrdiff_t>(span.degree) + 1;
        piece.u.assign(span.u.begin(), span.u.begin() + n);
        piece.v.assign(span.v.begin(), span.v.begin() + n);
        piece.w.assign(span.w.begin(), span.w.begin() + n);
      }
      if (c.reversed) own = reversed(own);
      pieces.insert(pieces.end(), own.begin(), own.end());
    }
  }
  return loops;
}

std::string wrong_point(Random& random, const TrimCase& given, TrimmedSurface surface) {
  validate_loops(surface);
  const TrimTopology traced = trace_trims(surface);
  for (int k = 0; k < 6; ++k) {
    const ExactLoop& loop = given.loops[static_cast<std::size_t>(random.below(static_cast<int>(given.loops.size())))];
    const ExactPiece& piece = loop[static_cast<std::size_t>(random.below(static_cast<int>(loop.size())))];
    Vector2d x = point_at(piece, random.chance(50) ? random.below(9) / 8.0 : random.unit());
    if (random.chance(30)) x.x() = given.u[static_cast<std::size_t>(random.below(static_cast<int>(given.u.size())))];
    if (random.chance(30)) x.y() = given.v[static_cast<std::size_t>(random.below(static_cast<int>(given.v.size())))];
    x = {an_ulp_or_so(random, x.x()), an_ulp_or_so(random, x.y())};
    const std::optional<int> n = exact_winding(given.loops, x.x(), x.y());
    if (contains(surface, traced, x) != (!n || *n == 1)) {
      char out[120];
      std::snprintf(out, sizeof out, "point (%a, %a) is %s", x.x(), x.y(),
                    n ? (*n == 1 ? "inside" : "outside") : "on the trim");
      return out;
    }
  }
  return "";
}

// Holes that cross: a place is material where the outer loop holds it and no hole does, whatever loops come out.
// Places within 1e-6 of a loop may be on either side of where it was cut.
std::string wrong_material(Random& random, TrimmedSurface surface) {
  const std::vector<ExactLoop> given = traced_loops(surface);
  const auto material = [&](double u, double v) -> std::optional<bool> {
    bool in = true;
    for (std::size_t l = 0; l < given.size(); ++l) {
      const std::optional<int> n = exact_winding({given[l]}, u, v);
      if (!n) return std::nullopt;
      in = in && (*n != 0) == (l == 0);
    }
    return in;
  };
  try {
    validate_loops(surface);
    const TrimTopology traced = trace_trims(surface);
    const Interval u = surface.surface.u().domain(), v = surface.surface.v().domain();
    const double du = 1e-6 * u.length(), dv = 1e-6 * v.length();
    for (int k = 0; k < 40; ++k) {
      const ExactLoop& loop = given[static_cast<std::size_t>(random.below(static_cast<int>(given.size())))];
      Vector2d x = point_at(loop[static_cast<std::size_t>(random.below(static_cast<int>(loop.size())))], random.unit());
      const double away = std::ldexp(1.0, -random.between(2, 14));
      x += away * Vector2d((random.unit() - 0.5) * u.length(), (random.unit() - 0.5) * v.length());
      if (!u.contains(x.x()) || !v.contains(x.y())) continue;
      const std::optional<bool> in = material(x.x(), x.y());
      bool clear = in.has_value();
      for (const double a : {-du, du})
        for (const double b : {-dv, dv}) clear = clear && material(x.x() + a, x.y() + b) == in;
      if (clear && contains(surface, traced, x) != *in)
        return "point (" + std::to_string(x.x()) + ", " + std::to_string(x.y()) + ") is " + (*in ? "material" : "none");
    }
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

}  // namespace

TrimCase random_trim_case(std::uint64_t seed) {
  Random random(seed);
  while (true) {
    TrimCase made;
    switch (random.below(12)) {
      case 0:
      case 1:
      case 2:
        made = lattice_star(random);
        break;
      case 3:
      case 4:
        made = extremes(random);
        break;
      case 5:
      case 6:
      case 7:
        made = touching_graph(random);
        break;
      case 8:
        made = histogram(random);
        break;
      case 9:
        made = holes(random);
        break;
      case 10:
        made = touching_holes(random);
        break;
      default:
        made = invalid(random);
    }
    if (made.loops[0].empty()) continue;
    if ((made.family == "star" || made.family == "graph" || made.family == "holes") && random.chance(35)) {
      nudge(random, made);
      made.family += ", nudged";
    }
    return made;
  }
}

TrimmedSurface surface_of(const TrimCase& given) {
  return surface_of(given, false);
}

std::string wrong_decision(const TrimCase& given, std::uint64_t seed) {
  Random random(seed + 1);
  const int nu = static_cast<int>(given.u.size()) - 1, nv = static_cast<int>(given.v.size()) - 1;
  const ExactTopology exact = given.valid ? exact_topology(given.u, given.v, given.loops) : ExactTopology{};
  const auto wrong = [&](const TrimmedSurface& surface, const ExactTopology& expected) {
    if (given.family == "crossing") return wrong_material(random, surface);
    if (!given.valid) return refused(surface) ? std::string() : std::string("accepted");
    return traced_difference(surface, expected);
  };
  const TrimmedSurface plain = surface_of(given, false);
  std::string problem = wrong(plain, exact);
  if (!problem.empty()) return problem;
  if (given.valid) problem = wrong_point(random, given, plain);
  if (!problem.empty()) return problem;

  const double far = static_cast<double>(random.between(-64, 64));
  const std::pair<const char*, Turn> turns[] = {
      {"mirrored in u", {false, -1, 1}},          {"mirrored in v", {false, 1, -1}},
      {"turned by 90 degrees", {true, -1, 1}},    {"transposed", {true, 1, 1}},
      {"scaled up", {false, 0x1p20, 0x1p20}},     {"scaled down", {false, 0x1p-20, 0x1p-20}},
      {"scaled apart", {false, 0x1p-20, 0x1p20}}, {"shifted", {false, 1, 1, far, 3}}};
  for (const auto& [what, turn] : turns) {
    const std::optional<TrimCase> variant = turned(given, turn);
    if (!variant) continue;
    problem = wrong(surface_of(*variant, random.chance(50)), given.valid ? turned(exact, turn, nu, nv) : exact);
    if (!problem.empty()) return std::string(what) + ": " + problem;
  }

  TrimmedSurface variant = surface_of(given, random.chance(50));
  for (TrimLoop& loop : variant.loops) {
    const bool whole_loop = random.chance(50);
    for (TrimCurve& c : loop.curves) {
      c.curve = backwards(c.curve);
      c.reversed = !whole_loop;
    }
    if (whole_loop) std::reverse(loop.curves.begin(), loop.curves.end());
  }
  problem = wrong(variant, exact);
  if (!problem.empty()) return "reversed: " + problem;

  variant = surface_of(given, true);
  for (TrimLoop& loop : variant.loops)
    for (TrimCurve& c : loop.curves)
      c.curve = with_knots(c.curve, std::ldexp(1.0, random.between(-20, 20)), random.between(-8, 8));
  problem = wrong(variant, exact);
  if (!problem.empty()) return "parameters scaled: " + problem;

  // A knot more in every span. The points of the finer curve are rounded unless they are short; the finer curve is what
  // counts then.
  variant = surface_of(given, true);
  for (TrimLoop& loop : variant.loops)
    for (TrimCurve& c : loop.curves) {
      const std::vector<double> breaks = c.curve.knots().breaks();
      std::vector<double> added;
      for (std::size_t k = 0; k + 1 < breaks.size(); ++k) added.push_back((breaks[k] + breaks[k + 1]) / 2);
      c.curve = insert_knots(c.curve, added);
    }
  const bool polynomial = std::all_of(given.loops.begin(), given.loops.end(), [](const ExactLoop& loop) {
    return std::all_of(loop.begin(), loop.end(), [](const ExactPiece& p) {
      return std::all_of(p.w.begin(), p.w.end(), [](double w) { return w == 1; });
    });
  });
  const bool exactly_halved =
      polynomial && given.family.find("nudged") == std::string::npos && given.family != "extremes";
  if (given.valid) {
    try {
      validate_loops(variant);  // closes the gaps that rounding has opened
    } catch (const GeometryError& e) {
      return std::string("knot-refined: ") + e.what();
    }
  }
  problem =
      wrong(variant, exactly_halved || !given.valid ? exact : exact_topology(given.u, given.v, traced_loops(variant)));
  if (!problem.empty()) return "knot-refined: " + problem;
  return "";
}

std::string text_of(const TrimCase& given) {
  const auto list = [](const std::vector<double>& x) {
    std::string out = "{";
    for (const double value : x) {
      char number[40];
      std::snprintf(number, sizeof number, value == std::round(value * 1024) / 1024 ? "%.12g" : "%a", value);
      out += (out.size() > 1 ? ", " : "") + std::string(number);
    }
    return out + "}";
  };
  std::string out = "{\"";
  out += given.family + "\", " + list(given.u) + ", " + list(given.v) + ", {";
  for (const ExactLoop& loop : given.loops) {
    out += "\n  {";
    for (const ExactPiece& p : loop) out += "{" + list(p.u) + ", " + list(p.v) + ", " + list(p.w) + "},\n   ";
    out += "},";
  }
  return out + "}}";
}

}  // namespace toile::test
