// SPDX-License-Identifier: GPL-3.0-or-later
#include "exact_trace.h"

#include <gmpxx.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace toile::test {
namespace {

using Integer = mpz_class;
using Rational = mpq_class;
using Poly = std::vector<Integer>;  // power basis, no trailing zero; empty: zero

// ---- polynomials over the integers, each up to a positive factor ----

Poly primitive(Poly p) {
  while (!p.empty() && p.back() == 0) p.pop_back();
  Integer content = 0;
  for (const Integer& c : p) content = gcd(content, c);
  if (content > 1)
    for (Integer& c : p) mpz_divexact(c.get_mpz_t(), c.get_mpz_t(), content.get_mpz_t());
  return p;
}

Poly derivative(const Poly& p) {
  Poly d;
  for (std::size_t i = 1; i < p.size(); ++i) d.push_back(p[i] * static_cast<unsigned long>(i));
  return d;
}

// a times a positive number, modulo b.
Poly remainder(Poly a, const Poly& b) {
  const Integer lead = abs(b.back());
  while (a.size() >= b.size()) {
    const Integer top = a.back() * sgn(b.back());
    const std::size_t shift = a.size() - b.size();
    for (Integer& c : a) c *= lead;
    for (std::size_t i = 0; i < b.size(); ++i) a[i + shift] -= top * b[i];
    a = primitive(a);
  }
  return a;
}

Poly common_divisor(Poly a, Poly b) {
  while (!b.empty()) {
    Poly r = remainder(a, b);
    a = std::move(b);
    b = std::move(r);
  }
  return primitive(a);
}

// b divides a, both primitive.
Poly divided(Poly a, const Poly& b) {
  Poly q(a.size() - b.size() + 1);
  for (std::size_t k = q.size(); k-- > 0;) {
    mpz_divexact(q[k].get_mpz_t(), a[k + b.size() - 1].get_mpz_t(), b.back().get_mpz_t());
    for (std::size_t i = 0; i < b.size(); ++i) a[k + i] -= q[k] * b[i];
  }
  return primitive(q);
}

// k / 2^n
struct Place {
  Integer k = 0;
  unsigned long n = 0;
};
int compare(const Place& a, const Place& b) {
  Integer x = a.k, y = b.k;
  if (a.n < b.n) x <<= b.n - a.n;
  if (b.n < a.n) y <<= a.n - b.n;
  return cmp(x, y);
}
Place middle(const Place& a, const Place& b) {
  const unsigned long n = std::max(a.n, b.n);
  return {(a.k << (n - a.n)) + (b.k << (n - b.n)), n + 1};
}

Integer scaled_value(const Poly& p, const Place& s) {
  Integer y = 0;
  for (std::size_t i = p.size(); i-- > 0;) y = y * s.k + (p[i] << (s.n * (p.size() - 1 - i)));
  return y;  // p(s) 2^(n degree)
}
int sign_at(const Poly& p, const Place& s) {
  return p.empty() ? 0 : sgn(scaled_value(p, s));
}
Rational value(const Poly& p, const Place& s) {
  if (p.empty()) return 0;
  Rational r(scaled_value(p, s), Integer(1) << (s.n * (p.size() - 1)));
  r.canonicalize();
  return r;
}

// ---- roots ----

struct Root {
  Poly f;  // square-free, with this root alone in the open (lo, hi) and none at the ends; or lo = hi is the root
  Place lo, hi;
  int axis = 0, line = 0;
  bool exact() const { return compare(lo, hi) == 0; }
  void bisect() {
    if (exact()) return;
    const Place mid = middle(lo, hi);
    const int s = sign_at(f, mid);
    if (s == 0) {
      lo = hi = mid;
    } else if (s == sign_at(f, lo)) {
      lo = mid;
    } else {
      hi = mid;
    }
  }
};

std::vector<Poly> sturm_chain(const Poly& f) {
  std::vector<Poly> chain{f, primitive(derivative(f))};
  while (chain.back().size() > 1) {
    Poly r = remainder(chain[chain.size() - 2], chain.back());
    for (Integer& c : r) c = -c;
    chain.push_back(r);
  }
  return chain;
}
int variations(const std::vector<Poly>& chain, const Place& s) {
  int count = 0, last = 0;
  for (const Poly& p : chain) {
    const int now = sign_at(p, s);
    if (now != 0 && last != 0 && now != last) ++count;
    if (now != 0) last = now;
  }
  return count;
}

void isolate(const std::vector<Poly>& chain, const Place& lo, const Place& hi, std::vector<Root>& out) {
  const Poly& f = chain.front();
  const bool at_hi = sign_at(f, hi) == 0;
  const int count = variations(chain, lo) - variations(chain, hi) - at_hi;
  if (count == 0) return;
  if (count == 1 && !at_hi && sign_at(f, lo) != 0) {
    out.push_back({f, lo, hi, 0, 0});
    return;
  }
  const Place mid = middle(lo, hi);
  isolate(chain, lo, mid, out);
  if (sign_at(f, mid) == 0) out.push_back({f, mid, mid, 0, 0});
  isolate(chain, mid, hi, out);
}

Poly square_free(const Poly& p) {
  const Poly whole = primitive(p);
  if (whole.size() < 3) return whole;
  return divided(whole, common_divisor(whole, derivative(whole)));
}

const Place zero{0, 0}, one{1, 0};

// In the open (0, 1), ascending.
std::vector<Root> roots(const Poly& p) {
  std::vector<Root> out;
  if (p.size() < 2) return out;
  isolate(sturm_chain(square_free(p)), zero, one, out);
  return out;
}

bool has_root_between(const Poly& g, const Place& lo, const Place& hi) {
  return sign_at(g, lo) * sign_at(g, hi) < 0;
}

int compare(Root& a, Root& b) {
  Poly shared;
  bool known = false;
  while (true) {
    if (compare(a.hi, b.lo) < 0) return -1;
    if (compare(b.hi, a.lo) < 0) return 1;
    if (a.exact() && b.exact()) return compare(a.lo, b.lo);
    if (a.exact() || b.exact()) {
      Root& open = a.exact() ? b : a;
      const Root& point = a.exact() ? a : b;
      if (compare(open.lo, point.lo) < 0 && compare(point.lo, open.hi) < 0 && sign_at(open.f, point.lo) == 0)
        open.lo = open.hi = point.lo;
      else
        open.bisect();
      continue;
    }
    if (!known) shared = common_divisor(a.f, b.f);
    known = true;
    const Place& lo = compare(a.lo, b.lo) < 0 ? b.lo : a.lo;
    const Place& hi = compare(a.hi, b.hi) < 0 ? a.hi : b.hi;
    if (compare(lo, hi) < 0 && shared.size() > 1 && has_root_between(shared, lo, hi)) return 0;
    a.bisect();
    b.bisect();
  }
}

// ---- pieces ----

// x(s) = x / w, y(s) = y / w with one factor.
struct Piece {
  Poly x, y, w;
  const ExactPiece* given = nullptr;
};

Poly from_bernstein(std::vector<Rational> b, const Integer& factor) {
  const std::size_t n = b.size() - 1;
  Poly p;
  Integer binomial = 1;
  for (std::size_t k = 0; k <= n; ++k) {
    const Rational c = b[0] * factor * binomial;
    p.push_back(c.get_num());
    for (std::size_t i = 0; i + 1 < b.size(); ++i) b[i] = b[i + 1] - b[i];
    b.pop_back();
    binomial = binomial * static_cast<unsigned long>(n - k) / static_cast<unsigned long>(k + 1);
  }
  return p;
}

Piece exact_piece(const ExactPiece& given) {
  std::vector<Rational> x, y, w;
  Integer factor = 1;
  for (std::size_t i = 0; i < given.u.size(); ++i) {
    w.emplace_back(given.w[i]);
    x.emplace_back(Rational(given.u[i]) * w.back());
    y.emplace_back(Rational(given.v[i]) * w.back());
    for (const Rational* r : {&x.back(), &y.back(), &w.back()}) factor = lcm(factor, r->get_den());
  }
  return {from_bernstein(x, factor), from_bernstein(y, factor), from_bernstein(w, factor), &given};
}

// a x + b y + c w, up to a positive factor.
Poly combined(const Rational& a, const Rational& b, const Rational& c, const Piece& piece) {
  const Integer den = lcm(lcm(a.get_den(), b.get_den()), c.get_den());
  Poly r(piece.w.size());
  for (const auto& [factor, p] : {std::pair(&a, &piece.x), std::pair(&b, &piece.y), std::pair(&c, &piece.w)}) {
    const Integer k = factor->get_num() * (den / factor->get_den());
    for (std::size_t i = 0; i < r.size(); ++i) r[i] += k * (*p)[i];
  }
  return primitive(r);
}

bool is_point(const ExactPiece& p) {
  for (std::size_t i = 1; i < p.u.size(); ++i)
    if (p.u[i] != p.u[0] || p.v[i] != p.v[0]) return false;
  return true;
}

// Turns of the chain around the point by where it passes a ray in direction (dx, dy); nothing and `bad` where the ray
// isn't in general position; nothing and not bad where the point is on the chain.
std::optional<int> turns(const std::vector<std::vector<Piece>>& loops, const Rational& pu, const Rational& pv, int dx,
                         int dy, bool& bad) {
  bad = false;
  int total = 0;
  const Rational rx(dx), ry(dy);
  const double u = pu.get_d(), v = pv.get_d();
  for (const auto& loop : loops) {
    for (const Piece& piece : loop) {
      const ExactPiece& g = *piece.given;
      bool above = false, below = false, front = false;
      for (std::size_t i = 0; i < g.u.size(); ++i) {
        const double x = g.u[i] - u, y = g.v[i] - v,
                     size = (std::abs(g.u[i]) + std::abs(g.v[i]) + std::abs(u) + std::abs(v)) * (dx + std::abs(dy)) *
                            1e-12;
        above = above || dx * y - dy * x >= -size;
        below = below || dx * y - dy * x <= size;
        front = front || dx * x + dy * y >= -size;
      }
      if (!above || !below || !front) continue;
      const Poly left = combined(-ry, rx, ry * pu - rx * pv, piece),
                 along = combined(rx, ry, -rx * pu - ry * pv, piece);
      for (const Place& end : {zero, one}) {
        if (sign_at(left, end) != 0) continue;
        if (sign_at(along, end) == 0) return std::nullopt;
        if (sign_at(along, end) > 0) bad = true;
      }
      const std::vector<Poly> chain = along.size() > 1 ? sturm_chain(square_free(along)) : std::vector<Poly>{along};
      const Poly shared = left.empty() || along.empty() ? Poly{1} : square_free(common_divisor(left, along));
      if (left.empty()) {  // along the ray's line
        if (along.empty() || !roots(along).empty()) return std::nullopt;
        bad = true;
        continue;
      }
      for (Root& root : roots(left)) {
        while (true) {
          if (root.exact()) {
            if (sign_at(along, root.lo) == 0) return std::nullopt;
            break;
          }
          if (shared.size() > 1 && has_root_between(shared, root.lo, root.hi)) return std::nullopt;
          if (variations(chain, root.lo) == variations(chain, root.hi) && sign_at(along, root.lo) != 0) break;
          root.bisect();
        }
        if (sign_at(along, root.lo) < 0) continue;
        Place before = root.lo, after = root.hi;
        if (root.exact()) {
          before = {root.lo.k * 4 - 1, root.lo.n + 2};
          after = {root.lo.k * 4 + 1, root.lo.n + 2};
          // Is the root alone between them?
          const std::vector<Poly> f = sturm_chain(root.f);
          while (variations(f, before) - variations(f, after) != 1 || sign_at(root.f, after) == 0 ||
                 sign_at(root.f, before) == 0) {
            before = {before.k * 2 + 1, before.n + 1};
            after = {after.k * 2 - 1, after.n + 1};
          }
        }
        total += (sign_at(left, after) - sign_at(left, before)) / 2;
      }
    }
  }
  if (bad) return std::nullopt;
  return total;
}

std::optional<int> winding(const std::vector<std::vector<Piece>>& loops, const Rational& u, const Rational& v) {
  for (int attempt = 0; attempt < 400; ++attempt) {
    bool bad = false;
    const auto n = turns(loops, u, v, 1009 + 7 * attempt, attempt % 2 == 0 ? 37 + attempt : -113 - attempt, bad);
    if (!bad) return n;
  }
  throw std::logic_error("no ray in general position");
}

std::vector<std::vector<Piece>> exact_loops(const std::vector<ExactLoop>& loops) {
  std::vector<std::vector<Piece>> out;
  for (const ExactLoop& loop : loops) {
    std::vector<Piece>& pieces = out.emplace_back();
    for (const ExactPiece& piece : loop)
      if (!is_point(piece)) pieces.push_back(exact_piece(piece));
  }
  return out;
}

// ---- tracing ----

using Code = std::array<int, 2>;  // per axis: 2k on line k, 2k + 1 between k and k + 1

struct Node {
  Code at{};
  long double s = 0;  // on the piece that starts here or holds it
  const Piece* piece = nullptr;
};
struct Step {
  Node node;
  Code arc{};  // after the node
};

int code_of(const Rational& x, const std::vector<Rational>& lines) {
  const auto at = std::lower_bound(lines.begin(), lines.end(), x);
  const int k = static_cast<int>(at - lines.begin());
  return at != lines.end() && *at == x ? 2 * k : 2 * k - 1;
}

long double approximate(Root root) {
  // Until the interval is narrower than 2^-62.
  for (unsigned long n = std::max(root.lo.n, root.hi.n); !root.exact() && n < 64; n = std::max(root.lo.n, root.hi.n))
    root.bisect();
  const Place mid = middle(root.lo, root.hi);
  const mpf_class s(Rational(mid.k, Integer(1) << mid.n), 128);
  const double high = s.get_d();
  return static_cast<long double>(high) + mpf_class(s - high).get_d();
}

// x, y and dy/ds.
std::array<long double, 3> position(const ExactPiece& p, long double s) {
  const std::size_t n = p.u.size() - 1;
  std::vector<std::array<long double, 3>> d(n + 1);
  for (std::size_t i = 0; i <= n; ++i)
    d[i] = {static_cast<long double>(p.u[i]) * p.w[i], static_cast<long double>(p.v[i]) * p.w[i], p.w[i]};
  std::array<long double, 3> slope{};
  for (std::size_t k = n; k > 0; --k) {
    if (k == 1)
      for (std::size_t c = 0; c < 3; ++c) slope[c] = static_cast<long double>(n) * (d[1][c] - d[0][c]);
    for (std::size_t i = 0; i < k; ++i)
      for (std::size_t c = 0; c < 3; ++c) d[i][c] = (1 - s) * d[i][c] + s * d[i + 1][c];
  }
  const long double x = d[0][0] / d[0][2], y = d[0][1] / d[0][2];
  return {x, y, (slope[1] - y * slope[2]) / d[0][2]};
}

// Integral of (x - x0) dy.
long double swept(const ExactPiece& p, long double s0, long double s1, long double x0) {
  const bool quotient = std::any_of(p.w.begin(), p.w.end(), [&](double w) { return w != p.w[0]; });
  return integral(
      [&](long double s) {
        const auto [x, y, dy] = position(p, s);
        return (x - x0) * dy;
      },
      s0, s1, quotient);
}

class Tracer {
 public:
  Tracer(const std::vector<double>& lines_u, const std::vector<double>& lines_v, const std::vector<ExactLoop>& loops)
      : lines_{lines_u, lines_v}, loops_(exact_loops(loops)) {
    for (int axis = 0; axis < 2; ++axis)
      for (const double c : lines_[axis]) exact_lines_[axis].emplace_back(c);
  }

  ExactTopology run() {
    const int nu = static_cast<int>(lines_[0].size()) - 1, nv = static_cast<int>(lines_[1].size()) - 1;
    std::vector<char> cut(static_cast<std::size_t>(nu * nv), 0),
        border(static_cast<std::size_t>((nu + 1) * (nv + 1)), 0);
    out_.areas.assign(static_cast<std::size_t>(nu * nv), 0);
    for (const auto& loop : loops_) {
      std::vector<Step> steps;
      for (const Piece& piece : loop) add_steps(piece, steps);
      for (const Step& step : steps)
        if (step.node.at[0] % 2 == 0 && step.node.at[1] % 2 == 0)
          border[static_cast<std::size_t>(step.node.at[0] / 2 + (nu + 1) * (step.node.at[1] / 2))] = 1;
      for (std::size_t k = 0; k < steps.size(); ++k) add_area(steps, k, nu);
      merge(steps);
      for (const Step& step : steps)
        if (step.arc[0] % 2 == 1 && step.arc[1] % 2 == 1)
          cut[static_cast<std::size_t>(step.arc[0] / 2 + nu * (step.arc[1] / 2))] = 1;
      add_events(steps);
    }
    for (int j = 0; j < nv; ++j)
      for (int i = 0; i < nu; ++i) {
        const std::size_t cell = static_cast<std::size_t>(i + nu * j);
        const Rational share(7, 16);
        const Rational u = exact_lines_[0][i] + (exact_lines_[0][i + 1] - exact_lines_[0][i]) * share,
                       v = exact_lines_[1][j] + (exact_lines_[1][j + 1] - exact_lines_[1][j]) * share;
        out_.cells.push_back(cut[cell]                                ? CellKind::cut
                             : winding(loops_, u, v).value_or(0) == 1 ? CellKind::inside
                                                                      : CellKind::outside);
      }
    for (int j = 0; j <= nv; ++j)
      for (int i = 0; i <= nu; ++i) {
        const bool on = border[static_cast<std::size_t>(i + (nu + 1) * j)];
        out_.vertices.push_back(on ? VertexKind::border
                                : winding(loops_, exact_lines_[0][i], exact_lines_[1][j]).value_or(0) == 1
                                    ? VertexKind::inside
                                    : VertexKind::outside);
      }
    return out_;
  }

 private:
  Code code_at(const Piece& piece, const Place& s) const {
    const Rational w = value(piece.w, s);
    return {code_of(value(piece.x, s) / w, exact_lines_[0]), code_of(value(piece.y, s) / w, exact_lines_[1])};
  }

  void add_steps(const Piece& piece, std::vector<Step>& steps) const {
    std::vector<Root> all;
    for (int axis = 0; axis < 2; ++axis) {
      const std::vector<double>& x = axis == 0 ? piece.given->u : piece.given->v;
      const auto [low, high] = std::minmax_element(x.begin(), x.end());
      for (std::size_t l = 0; l < lines_[axis].size(); ++l) {
        if (lines_[axis][l] < *low || lines_[axis][l] > *high) continue;
        for (Root& root : roots(combined(axis == 0 ? 1 : 0, axis == 0 ? 0 : 1, -exact_lines_[axis][l], piece))) {
          root.axis = axis;
          root.line = static_cast<int>(l);
          all.push_back(root);
        }
      }
    }
    std::vector<std::vector<Root>> groups;
    for (Root& root : all) {
      std::size_t k = 0;
      int order = 1;
      while (k < groups.size() && (order = compare(root, groups[k].front())) > 0) ++k;
      if (k < groups.size() && order == 0) {
        groups[k].push_back(root);
      } else {
        groups.insert(groups.begin() + static_cast<std::ptrdiff_t>(k), {root});
      }
    }
    // Places strictly between neighbouring groups and the ends.
    std::vector<Place> between;
    Place last = zero;
    for (std::size_t k = 0; k <= groups.size(); ++k) {
      if (k == groups.size()) {
        between.push_back(middle(last, one));
        break;
      }
      Root& root = groups[k].front();
      Root* before = k > 0 ? &groups[k - 1].front() : nullptr;
      while (compare(before ? before->hi : zero, root.lo) >= 0) {
        root.bisect();
        if (before) before->bisect();
      }
      while (k + 1 == groups.size() && compare(root.hi, one) >= 0) root.bisect();
      between.push_back(middle(before ? before->hi : zero, root.lo));
      last = root.hi;
    }
    steps.push_back({{code_at(piece, zero), 0, &piece}, code_at(piece, between[0])});
    for (std::size_t k = 0; k < groups.size(); ++k) {
      const Code arc = code_at(piece, between[k + 1]);
      Node node{arc, approximate(groups[k].front()), &piece};
      for (const Root& root : groups[k]) node.at[static_cast<std::size_t>(root.axis)] = 2 * root.line;
      steps.push_back({node, arc});
    }
  }

  // Area of the material in each cell: integral of u dv along the trim drawn back onto the cell's closure, which keeps
  // the winding numbers of its inner points.
  void add_area(const std::vector<Step>& steps, std::size_t k, int nu) {
    const Step& step = steps[k];
    if (step.arc[1] % 2 == 0) return;
    const Piece* piece = step.node.piece;
    const Step& next = steps[(k + 1) % steps.size()];
    const long double s0 = step.node.s, s1 = next.node.piece == piece && next.node.s > 0 ? next.node.s : 1;
    const int j = step.arc[1] / 2;
    const long double dv = position(*piece->given, s1)[1] - position(*piece->given, s0)[1];
    for (int i = 0; i < nu; ++i) {
      const std::size_t cell = static_cast<std::size_t>(i + nu * j);
      const long double width = static_cast<long double>(lines_[0][i + 1]) - lines_[0][i];
      if (step.arc[0] > 2 * i + 1) out_.areas[cell] += static_cast<double>(width * dv);
      if (step.arc[0] == 2 * i + 1) out_.areas[cell] += static_cast<double>(swept(*piece->given, s0, s1, lines_[0][i]));
    }
  }

  // Nodes where nothing changes go.
  static void merge(std::vector<Step>& steps) {
    std::vector<Step> kept;
    for (std::size_t k = 0; k < steps.size(); ++k) {
      const Code& before = steps[(k + steps.size() - 1) % steps.size()].arc;
      if (steps[k].node.at != steps[k].arc || steps[k].node.at != before) kept.push_back(steps[k]);
    }
    if (kept.empty()) kept.push_back(steps[0]);
    steps = kept;
  }

  void add_events(const std::vector<Step>& steps) {
    std::vector<ExactEvent>& events = out_.events.emplace_back();
    const std::size_t n = steps.size();
    for (std::size_t k = 0; k < n; ++k) {
      const Code& at = steps[k].node.at;
      const bool on_u = at[0] % 2 == 0, on_v = at[1] % 2 == 0;
      if (!on_u && !on_v) continue;
      ExactEvent event;
      if (on_u) event.line_u = at[0] / 2;
      if (on_v) event.line_v = at[1] / 2;
      const auto [x, y, dy] = position(*steps[k].node.piece->given, steps[k].node.s);
      event.u = x;
      event.v = y;
      const auto crosses = [&](std::size_t axis) {
        std::size_t after = k, before = k + n - 1;
        while (steps[after % n].arc[axis] == at[axis]) ++after;
        while (steps[before % n].arc[axis] == at[axis]) before += n - 1;
        return steps[after % n].arc[axis] != steps[before % n].arc[axis];
      };
      event.kind = on_u && on_v ? PointKind::crossing_uv
                   : on_u       ? (crosses(0) ? PointKind::crossing_u : PointKind::tangent_u)
                                : (crosses(1) ? PointKind::crossing_v : PointKind::tangent_v);
      events.push_back(event);
    }
  }

  std::array<std::vector<double>, 2> lines_;
  std::array<std::vector<Rational>, 2> exact_lines_;
  std::vector<std::vector<Piece>> loops_;
  ExactTopology out_;
};

}  // namespace

long double integral(const std::function<long double(long double)>& f, long double a, long double b, bool quotient) {
  static const long double node[] = {0.1834346424956498049394761423601839806L, 0.5255324099163289858177390491892463490L,
                                     0.7966664774136267395915539364758304368L,
                                     0.9602898564975362316835608685694729905L};
  static const long double weight[] = {
      0.3626837833783619829651504492771956122L, 0.3137066458778872873379622019866013133L,
      0.2223810344533744705443559944262408844L, 0.1012285362903762591525313543099621901L};
  const int parts = quotient ? 10 : 0;
  long double sum = 0, low = a;
  const auto add = [&](long double from, long double to) {
    for (int q = 0; q < 4; ++q)
      for (const int side : {-1, 1})
        sum += weight[q] * (to - from) / 2 * f((from + to) / 2 + side * node[q] * (to - from) / 2);
  };
  for (int k = -parts; k <= parts; ++k) {  // up to 2^-11, ..., 1/4, 1/2, 3/4, ..., 1
    const long double share = k < 0 ? std::ldexp(1.0L, k - 1) : 1 - std::ldexp(1.0L, -k - 1);
    const long double high = k == parts ? b : a + (b - a) * share, middle = (low + high) / 2;
    if (quotient) {  // poles may be near
      add(low, middle);
      add(middle, high);
    } else {
      add(low, high);
    }
    low = high;
  }
  return sum;
}

ExactTopology exact_topology(const std::vector<double>& lines_u, const std::vector<double>& lines_v,
                             const std::vector<ExactLoop>& loops) {
  return Tracer(lines_u, lines_v, loops).run();
}

std::optional<int> exact_winding(const std::vector<ExactLoop>& loops, double u, double v) {
  return winding(exact_loops(loops), Rational(u), Rational(v));
}

}  // namespace toile::test
