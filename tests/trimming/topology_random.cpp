// SPDX-License-Identifier: GPL-3.0-or-later
// Random trims on a coarse lattice, where lines, vertices and runs are hit all the time, against exact rational
// arithmetic that shares nothing with the tracer.
#include <boost/multiprecision/cpp_int.hpp>
#include <random>

#include "trims.h"

namespace toile::test {
namespace {

using Rational = boost::multiprecision::cpp_rational;
struct Point {
  Rational x, y;
  bool operator<(const Point& o) const { return x != o.x ? x < o.x : y < o.y; }
  bool operator==(const Point& o) const { return x == o.x && y == o.y; }
};

Rational cross(const Point& a, const Point& b, const Point& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}
bool is_integer(const Rational& x) {
  return denominator(x) == 1;
}
int floor_of(const Rational& x) {
  const boost::multiprecision::cpp_int q = numerator(x) / denominator(x);
  return static_cast<int>(numerator(x) < 0 && !is_integer(x) ? q - 1 : q);
}

// Area of a polygon within the unit cell (i, j), by clipping.
Rational clipped_area(std::vector<Point> p, int i, int j) {
  const auto clip = [&p](const auto& depth) {
    std::vector<Point> out;
    for (std::size_t k = 0; k < p.size(); ++k) {
      const Point &a = p[k], &b = p[(k + 1) % p.size()];
      const Rational da = depth(a), db = depth(b);
      if (da >= 0) out.push_back(a);
      if (da * db < 0) out.push_back({a.x + (b.x - a.x) * da / (da - db), a.y + (b.y - a.y) * da / (da - db)});
    }
    p = out;
  };
  clip([&](const Point& q) -> Rational { return q.x - i; });
  clip([&](const Point& q) -> Rational { return i + 1 - q.x; });
  clip([&](const Point& q) -> Rational { return q.y - j; });
  clip([&](const Point& q) -> Rational { return j + 1 - q.y; });
  Rational area = 0;
  for (std::size_t k = 0; k < p.size(); ++k) {
    const Point &a = p[k], &b = p[(k + 1) % p.size()];
    area += a.x * b.y - a.y * b.x;
  }
  return area / 2;
}

// Does the open segment a-b meet the open unit cell (i, j)?
bool meets_open_cell(const Point& a, const Point& b, int i, int j) {
  Rational low = 0, high = 1;
  const auto restrict = [&](const Rational& at, const Rational& slope) {  // at + s slope > 0
    if (slope == 0) {
      if (at <= 0) high = -1;
    } else if (slope > 0) {
      low = std::max(low, Rational(-at / slope));
    } else {
      high = std::min(high, Rational(-at / slope));
    }
  };
  restrict(a.x - i, b.x - a.x);
  restrict(i + 1 - a.x, a.x - b.x);
  restrict(a.y - j, b.y - a.y);
  restrict(j + 1 - a.y, a.y - b.y);
  return low < high;
}

// Where the border of the polygon meets integer lines, by the contract: all stops along it (corners, crossings) that
// are on a line, without those in the middle of a run.
std::map<PointKind, int> expected_events(const std::vector<Point>& corners) {
  std::vector<Point> stops;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Point &a = corners[k], &b = corners[(k + 1) % corners.size()];
    std::vector<Rational> s{0};
    const auto add = [&s](const Rational& from, const Rational& to) {
      if (from == to) return;
      for (int line = floor_of(std::min(from, to)); line <= floor_of(std::max(from, to)); ++line) {
        const Rational at = (line - from) / (to - from);
        if (at > 0 && at < 1) s.push_back(at);
      }
    };
    add(a.x, b.x);
    add(a.y, b.y);
    std::sort(s.begin(), s.end());
    s.erase(std::unique(s.begin(), s.end()), s.end());
    for (const Rational& at : s) stops.push_back({a.x + at * (b.x - a.x), a.y + at * (b.y - a.y)});
  }
  std::map<PointKind, int> count;
  const std::size_t n = stops.size();
  for (std::size_t k = 0; k < n; ++k) {
    const Point& p = stops[k];
    if (is_integer(p.x) && is_integer(p.y)) ++count[PointKind::crossing_uv];
    if (is_integer(p.x) == is_integer(p.y)) continue;
    const auto coordinate = [&](const Point& q) { return is_integer(p.x) ? q.x : q.y; };
    // Stops next to this one that leave the line, before and after.
    std::size_t before = k + n - 1, after = k + 1;
    const bool runs_in = coordinate(stops[before % n]) == coordinate(p),
               runs_out = coordinate(stops[after % n]) == coordinate(p);
    if (runs_in && runs_out) continue;
    while (coordinate(stops[before % n]) == coordinate(p)) before += n - 1;
    while (coordinate(stops[after % n]) == coordinate(p)) ++after;
    const bool crosses =
        (coordinate(stops[before % n]) < coordinate(p)) != (coordinate(stops[after % n]) < coordinate(p));
    ++count[is_integer(p.x) ? (crosses ? PointKind::crossing_u : PointKind::tangent_u)
                            : (crosses ? PointKind::crossing_v : PointKind::tangent_v)];
  }
  return count;
}

// A star-shaped polygon with corners on the lattice of quarters in [0, size]^2.
std::vector<Point> random_star(std::mt19937& random, int size, int corners) {
  std::uniform_int_distribution<int> coordinate(0, 4 * size);
  const Point centre{Rational(size) / 2 + Rational(1, 8), Rational(size) / 2 + Rational(1, 16)};
  std::vector<Point> p;
  for (int k = 0; k < corners; ++k) p.push_back({Rational(coordinate(random), 4), Rational(coordinate(random), 4)});
  const auto upper = [&](const Point& q) { return q.y > centre.y || (q.y == centre.y && q.x > centre.x); };
  std::sort(p.begin(), p.end(),
            [&](const Point& a, const Point& b) { return upper(a) != upper(b) ? upper(a) : cross(centre, a, b) > 0; });
  p.erase(std::unique(p.begin(), p.end(),
                      [&](const Point& a, const Point& b) { return upper(a) == upper(b) && cross(centre, a, b) == 0; }),
          p.end());
  for (std::size_t k = 0; k < p.size(); ++k) {
    if (p.size() < 3 || cross(centre, p[k], p[(k + 1) % p.size()]) <= 0) return {};
  }
  return p;
}

// The segment as a line, or as a quadratic, rational quadratic or cubic that covers the same points at uneven speed.
Curve2 drawn(std::mt19937& random, const Vector2d& a, const Vector2d& b) {
  const auto at = [&](double s) { return Vector2d(a + s * (b - a)); };
  const double s = 0.25 * static_cast<double>(random() % 5);
  switch (random() % 4) {
    case 0:
      return line_segment<2>(a, b);
    case 1:
      return bezier_curve({a, at(s), b});
    case 2:
      return bezier_curve({a, at(s), b}, {1, 0.3 + static_cast<double>(random() % 7), 2.5});
    default:
      return bezier_curve({a, at(s / 2), at(0.5 + s / 2), b});
  }
}

void expect_as_exact(const std::vector<Point>& corners, int size, const TrimmedSurface& face) {
  const TrimTopology topology = trace_trims(face);
  std::map<PointKind, int> events;
  for (const TrimEvent& e : topology.events) ++events[e.kind];
  EXPECT_EQ(events, expected_events(corners));
  std::size_t cut = 0;
  for (int j = 0; j < size; ++j)
    for (int i = 0; i < size; ++i) {
      const Rational area = clipped_area(corners, i, j);
      bool meets = false;
      for (std::size_t k = 0; k < corners.size() && !meets; ++k)
        meets = meets_open_cell(corners[k], corners[(k + 1) % corners.size()], i, j);
      const CellKind kind = topology.cells[static_cast<std::size_t>(topology.mesh.cell(i, j))];
      ASSERT_EQ(kind, meets ? CellKind::cut : area == 1 ? CellKind::inside : CellKind::outside) << i << ", " << j;
      if (!meets) continue;
      ASSERT_LT(cut, topology.cut_cells.size());
      const CutCell& cell = topology.cut_cells[cut++];
      ASSERT_EQ(cell.i, i);
      ASSERT_EQ(cell.j, j);
      double traced = 0;
      for (const auto& chain : cell.loops)
        for (std::size_t k = 0; k < chain.size(); ++k) {
          const BoundaryPiece& p = chain[k];
          ASSERT_EQ(p.to, chain[(k + 1) % chain.size()].from);
          traced += ((p.from.x() - i) * (p.to.y() - j) - (p.from.y() - j) * (p.to.x() - i)) / 2;
        }
      EXPECT_NEAR(traced, area.convert_to<double>(), 1e-14) << i << ", " << j;
    }
  EXPECT_EQ(cut, topology.cut_cells.size());
}

TEST(TrimTopology, RandomTrimsAgreeWithRationalArithmetic) {
  constexpr unsigned seed = 20260601;
  std::mt19937 random(seed);
  int cases = 0, uv = 0, tangent = 0;
  while (cases < 2000 && !::testing::Test::HasFailure()) {
    const int size = 2 + static_cast<int>(random() % 3);
    const std::vector<Point> corners = random_star(random, size, 3 + static_cast<int>(random() % 8));
    if (corners.empty()) continue;
    SCOPED_TRACE("seed " + std::to_string(seed) + ", case " + std::to_string(cases));
    ++cases;
    std::vector<Vector2d> p;
    for (const Point& q : corners) p.emplace_back(q.x.convert_to<double>(), q.y.convert_to<double>());
    std::vector<Curve2> curves;
    for (std::size_t k = 0; k < p.size(); ++k) curves.push_back(drawn(random, p[k], p[(k + 1) % p.size()]));
    TrimLoop loop = loop_of(curves);
    const bool turned = random() % 2 == 0;
    if (turned) loop = backwards(loop);
    TrimmedSurface face = trimmed(unit_cells(size), {loop});
    const std::vector<LoopRepair> repairs = validate_loops(face);
    EXPECT_EQ(repairs.size(), turned ? 1u : 0u);
    expect_as_exact(corners, size, face);
    auto events = expected_events(corners);
    uv += events[PointKind::crossing_uv];
    tangent += events[PointKind::tangent_u] + events[PointKind::tangent_v];
  }
  // The lattice is coarse enough to mean something.
  EXPECT_GT(uv, 1000);
  EXPECT_GT(tangent, 500);
}

}  // namespace
}  // namespace toile::test
