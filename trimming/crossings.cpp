// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/crossings.h"

#include <CGAL/Gmpq.h>
#include <CGAL/Gmpzf.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/error.h"
#include "geometry/finite.h"

namespace toile {
namespace {

using Rational = CGAL::Gmpq;
using Dyadic = CGAL::Gmpzf;  // exact binary floating point: +, -, * and halving without greatest common divisors
using Polynomial = std::vector<Rational>;  // power basis, no trailing zero; empty: the zero polynomial
using Coefficients = std::array<double, max_degree + 1>;

constexpr double epsilon = std::numeric_limits<double>::epsilon() / 2;  // unit roundoff

template <class T>
int sign_of(const T& x) {
  return static_cast<int>(CGAL::sign(x));
}
int sign_of(double x) {
  return (x > 0) - (x < 0);
}

template <class T>
T exact_coefficient(const LineForm& form, int i) {
  return T(form.span().w[static_cast<std::size_t>(i)]) * (T(form.coordinate(i)) - T(form.line()));
}

template <class T>
std::vector<T> exact_coefficients(const LineForm& form) {
  std::vector<T> b;
  for (int i = 0; i <= form.degree(); ++i) b.push_back(exact_coefficient<T>(form, i));
  return b;
}

// Value at s and, through `bound`, the largest error of it: each of n de Casteljau steps rounds three times, the
// coefficients twice.
double filtered_value(const LineForm& form, double s, double& bound) {
  Coefficients d = form.coefficients();
  const std::size_t n = static_cast<std::size_t>(form.degree());
  const double r = 1 - s;
  for (std::size_t k = n; k > 0; --k) {
    for (std::size_t i = 0; i < k; ++i) d[i] = r * d[i] + s * d[i + 1];
  }
  bound = (4 * static_cast<double>(n) + 4) * epsilon * form.magnitude();
  return d[0];
}

int filtered_sign(const LineForm& form, double s) {
  double bound = 0;
  const double x = filtered_value(form, s, bound);
  return std::abs(x) > bound ? sign_of(x) : 0;
}

// ---- polynomials over the rationals ----

void trim(Polynomial& p) {
  while (!p.empty() && sign_of(p.back()) == 0) p.pop_back();
}

void make_monic(Polynomial& p) {
  trim(p);
  if (p.empty()) return;
  const Rational lead = p.back();
  for (Rational& c : p) c /= lead;
}

Polynomial derivative(const Polynomial& p) {
  Polynomial d;
  for (std::size_t i = 1; i < p.size(); ++i) d.push_back(p[i] * Rational(static_cast<int>(i)));
  return d;
}

// a = quotient * b + remainder; a becomes the remainder.
Polynomial divide(Polynomial& a, const Polynomial& b) {
  trim(a);
  if (a.size() < b.size()) return {};
  Polynomial quotient(a.size() - b.size() + 1);
  for (std::size_t k = quotient.size(); k-- > 0;) {
    const Rational q = a[k + b.size() - 1] / b.back();
    quotient[k] = q;
    for (std::size_t i = 0; i < b.size(); ++i) a[k + i] -= q * b[i];
  }
  trim(a);
  return quotient;
}

Polynomial greatest_common_divisor(Polynomial a, Polynomial b) {
  make_monic(a);
  make_monic(b);
  while (!b.empty()) {
    divide(a, b);
    make_monic(a);
    std::swap(a, b);
  }
  return a;
}

Polynomial quotient(Polynomial a, const Polynomial& b) {
  return divide(a, b);
}

Polynomial subtract(Polynomial a, const Polynomial& b) {
  a.resize(std::max(a.size(), b.size()));
  for (std::size_t i = 0; i < b.size(); ++i) a[i] -= b[i];
  trim(a);
  return a;
}

Rational value(const Polynomial& p, const Rational& x) {
  Rational y(0);
  for (std::size_t i = p.size(); i-- > 0;) y = y * x + p[i];
  return y;
}

Rational binomial(int n, int k) {
  Rational b(1);
  for (int i = 1; i <= k; ++i) b = b * Rational(n - k + i) / Rational(i);
  return b;
}

Polynomial power_basis(const LineForm& form) {
  const int n = form.degree();
  const std::vector<Rational> b = exact_coefficients<Rational>(form);
  Polynomial p(static_cast<std::size_t>(n + 1));
  for (int k = 0; k <= n; ++k) {
    Rational c(0);
    for (int i = 0; i <= k; ++i) {
      const Rational term = binomial(k, i) * b[static_cast<std::size_t>(i)];
      c = (k - i) % 2 == 0 ? c + term : c - term;
    }
    p[static_cast<std::size_t>(k)] = binomial(n, k) * c;
  }
  trim(p);
  return p;
}

std::vector<Rational> bernstein_basis(const Polynomial& p) {
  const int n = static_cast<int>(p.size()) - 1;
  std::vector<Rational> b;
  for (int i = 0; i <= n; ++i) {
    Rational c(0);
    for (int k = 0; k <= i; ++k) c += binomial(i, k) / binomial(n, k) * p[static_cast<std::size_t>(k)];
    b.push_back(c);
  }
  return b;
}

// Square-free factors: entry m - 1 holds the roots of multiplicity m. [Yun 1976]
std::vector<Polynomial> square_free_factors(const Polynomial& p) {
  const Polynomial dp = derivative(p);
  const Polynomial a = greatest_common_divisor(p, dp);
  Polynomial b = quotient(p, a);
  Polynomial d = subtract(quotient(dp, a), derivative(b));
  std::vector<Polynomial> factors;
  while (b.size() > 1) {
    const Polynomial f = greatest_common_divisor(b, d);
    factors.push_back(f);
    b = quotient(b, f);
    d = subtract(quotient(d, f), derivative(b));
  }
  return factors;
}

// ---- variation counting ----

template <class T>
int variations(const std::vector<T>& b) {
  int count = 0, last = 0;
  for (const T& c : b) {
    const int s = sign_of(c);
    if (s == 0) continue;
    if (last != 0 && s != last) ++count;
    last = s;
  }
  return count;
}

// b becomes its left half; the right half is returned.
template <class T>
std::vector<T> halve(std::vector<T>& b) {
  const T half(0.5);
  std::vector<T> right = b;
  const std::size_t n = b.size() - 1;
  for (std::size_t k = 1; k <= n; ++k) {
    // right[i] holds level k of point i + k; its last entries are final.
    for (std::size_t i = 0; i + k <= n; ++i) right[i] = (right[i] + right[i + 1]) * half;
    b[k] = right[0];
  }
  return right;
}

struct TooDeep {};

// Roots in the open (lo, hi) of exact Bernstein coefficients. Throws TooDeep when several variations remain at
// max_depth.
template <class T>
void isolate(std::vector<T> b, double lo, double hi, int depth, int max_depth, std::vector<LineRoot>& out) {
  const int count = variations(b);
  if (count == 0) return;
  if (count == 1 && sign_of(b.front()) != 0 && sign_of(b.back()) != 0) {
    out.push_back({lo, hi, true, nullptr});
    return;
  }
  if (depth >= max_depth && count > 1) throw TooDeep();
  const double mid = lo + (hi - lo) / 2;
  if (!(lo < mid && mid < hi)) throw TooDeep();
  const std::vector<T> right = halve(b);
  isolate(b, lo, mid, depth + 1, max_depth, out);
  if (sign_of(right.front()) == 0) {
    std::size_t multiplicity = 0;
    while (multiplicity < right.size() && sign_of(right[multiplicity]) == 0) ++multiplicity;
    out.push_back({mid, mid, multiplicity % 2 == 1, nullptr});
  }
  isolate(right, mid, hi, depth + 1, max_depth, out);
}

// The same in plain arithmetic; false where a sign is in doubt.
bool isolate_filtered(const Coefficients& b, std::size_t n, double bound, double magnitude, double lo, double hi,
                      std::vector<LineRoot>& out) {
  // Exact zeros at the ends of the span stay exact zeros under halving; any other small number is in doubt.
  std::size_t begin = 0, end = n + 1;
  if (lo == 0) {
    while (begin < end && b[begin] == 0) ++begin;
  }
  if (hi == 1) {
    while (end > begin && b[end - 1] == 0) --end;
  }
  int count = 0, last = 0;
  for (std::size_t i = begin; i < end; ++i) {
    if (!(std::abs(b[i]) > bound)) return false;
    const int s = sign_of(b[i]);
    if (last != 0 && s != last) ++count;
    last = s;
  }
  if (count == 0) return true;
  if (count == 1) {
    out.push_back({lo, hi, true, nullptr});
    return true;
  }
  if (hi - lo < 1e-6) return false;
  Coefficients left = b, right = b;
  for (std::size_t k = 1; k <= n; ++k) {
    for (std::size_t i = 0; i + k <= n; ++i) right[i] = 0.5 * (right[i] + right[i + 1]);
    left[k] = right[0];
  }
  const double next = bound + static_cast<double>(n) * epsilon * magnitude;
  const double mid = lo + (hi - lo) / 2;
  return isolate_filtered(left, n, next, magnitude, lo, mid, out) &&
         isolate_filtered(right, n, next, magnitude, mid, hi, out);
}

}  // namespace

// A square-free polynomial over the rationals on s in [0, 1].
class ExactFactor {
 public:
  explicit ExactFactor(Polynomial p) : p_(std::move(p)) {}
  int sign_at(double s) const { return sign_of(value(p_, Rational(s))); }
  const Polynomial& polynomial() const { return p_; }

 private:
  Polynomial p_;
};

namespace {

int refining_sign(const LineForm& form, const LineRoot& root, double s, PredicateCounts& counts) {
  return root.factor ? root.factor->sign_at(s) : sign_at(form, s, counts);
}

// Halves the interval of a root; false where doubles are too coarse.
bool bisect(const LineForm& form, LineRoot& root, PredicateCounts& counts) {
  const double mid = root.s();
  if (!(root.lo < mid && mid < root.hi)) return false;
  const int s = refining_sign(form, root, mid, counts);
  if (s == 0) {
    root.lo = root.hi = mid;
  } else if (s == refining_sign(form, root, root.lo, counts)) {
    root.lo = mid;
  } else {
    root.hi = mid;
  }
  return true;
}

// Narrows the interval (lo, hi) of a simple root of the form to where plain arithmetic still certifies the signs.
void narrow(const LineForm& form, LineRoot& root, PredicateCounts& counts) {
  if (root.exact()) return;
  const int before = root.lo == 0 ? form.sign_after_start() : sign_at(form, root.lo, counts);
  double lo = root.lo, hi = root.hi, bound = 0;
  // Illinois steps, halving where they stall. [Dowell & Jarratt 1971]
  double f_lo = filtered_value(form, lo, bound), f_hi = filtered_value(form, hi, bound);
  double r = lo + (hi - lo) / 2;
  int side = 0;
  for (int step = 0; step < 100 && hi - lo > 4 * epsilon; ++step) {
    const bool regular = step < 40 && f_lo * f_hi < 0;
    r = regular ? lo + (hi - lo) * (f_lo / (f_lo - f_hi)) : lo + (hi - lo) / 2;
    if (!(lo < r && r < hi)) r = lo + (hi - lo) / 2;
    if (!(lo < r && r < hi)) break;
    const double f = filtered_value(form, r, bound);
    if (std::abs(f) <= bound) break;
    if (sign_of(f) == before) {
      lo = r;
      f_lo = f;
      if (side == -1) f_hi /= 2;
      side = -1;
    } else {
      hi = r;
      f_hi = f;
      if (side == 1) f_lo /= 2;
      side = 1;
    }
  }
  if (filtered_value(form, r, bound) == 0 && sign_at(form, r, counts) == 0) {
    root.lo = root.hi = r;
    return;
  }
  for (double delta = 4 * epsilon; delta < 1e-10; delta *= 4) {
    const double a = std::max(root.lo, r - delta), b = std::min(root.hi, r + delta);
    if (a < b && filtered_sign(form, a) == before && filtered_sign(form, b) == -before) {
      root.lo = a;
      root.hi = b;
      return;
    }
  }
  // An ill-conditioned root, or one beside a root at an end of the span: signs are exact from here on.
  while (!root.exact() && (sign_at(form, root.lo, counts) == 0 || sign_at(form, root.hi, counts) == 0 ||
                           root.hi - root.lo > 4 * epsilon)) {
    const double mid = root.s();
    if (!(root.lo < mid && mid < root.hi)) break;
    const int s = sign_at(form, mid, counts);
    if (s == 0) {
      root.lo = root.hi = mid;
    } else if (s == before) {
      root.lo = mid;
    } else {
      root.hi = mid;
    }
  }
}

// Roots in the open (0, 1) where some may be multiple.
std::vector<LineRoot> algebraic_roots(const Polynomial& p) {
  std::vector<LineRoot> out;
  const std::vector<Polynomial> factors = square_free_factors(p);
  for (std::size_t m = 0; m < factors.size(); ++m) {
    if (factors[m].size() < 2) continue;
    const auto factor = std::make_shared<const ExactFactor>(factors[m]);
    std::vector<LineRoot> found;
    try {
      isolate(bernstein_basis(factors[m]), 0.0, 1.0, 0, 2000, found);
    } catch (const TooDeep&) {
      throw GeometryError("a trim curve meets a knot line at parameters closer than doubles can tell");
    }
    for (LineRoot& root : found) {
      root.crosses = m % 2 == 0;
      root.factor = factor;
      while (root.hi - root.lo > 4 * epsilon) {
        const double mid = root.s();
        if (!(root.lo < mid && mid < root.hi)) break;
        const int s = factor->sign_at(mid);
        if (s == 0) {
          root.lo = root.hi = mid;
        } else if (s == factor->sign_at(root.lo)) {
          root.lo = mid;
        } else {
          root.hi = mid;
        }
      }
      out.push_back(root);
    }
  }
  std::sort(out.begin(), out.end(), [](const LineRoot& a, const LineRoot& b) { return a.s() < b.s(); });
  return out;
}

bool have_common_root(const LineForm& f, const LineForm& g, double lo, double hi, PredicateCounts& counts) {
  ++counts.algebraic;
  Polynomial h = greatest_common_divisor(power_basis(f), power_basis(g));
  if (h.size() < 2) return false;
  h = quotient(h, greatest_common_divisor(h, derivative(h)));
  return sign_of(value(h, Rational(lo))) * sign_of(value(h, Rational(hi))) < 0;
}

// A root's interval with rational ends, for roots that differ by less than doubles can tell.
struct DeepRoot {
  Polynomial p;
  Rational lo, hi;
  DeepRoot(const LineForm& form, const LineRoot& root)
      : p(root.factor ? root.factor->polynomial() : power_basis(form)), lo(root.lo), hi(root.hi) {}
  Rational mid() const { return (lo + hi) * Rational(0.5); }
  void bisect() {
    const Rational m = mid();
    const int s = sign_of(value(p, m));
    if (s == 0) {
      lo = hi = m;
    } else if (s == sign_of(value(p, lo))) {
      lo = m;
    } else {
      hi = m;
    }
  }
};

}  // namespace

LineForm::LineForm(const TrimSpan& span, Axis axis, double c) : span_(&span), axis_(axis), line_(c) {
  const auto& x = axis == Axis::u ? span.u : span.v;
  for (std::size_t i = 0; i <= static_cast<std::size_t>(span.degree); ++i) {
    b_[i] = span.w[i] * (x[i] - c);
    magnitude_ = std::max(magnitude_, std::abs(b_[i]));
  }
  require_finite(c, "a line of constant u or v");
  require_finite(magnitude_, "the distance of a trim from a line of constant u or v");
}

// A difference and a product, each rounded once.
double LineForm::coefficient_error() const {
  return 2.5 * epsilon * magnitude_;
}

double LineForm::coordinate(int i) const {
  return (axis_ == Axis::u ? span_->u : span_->v)[static_cast<std::size_t>(i)];
}

int LineForm::coefficient_sign(int i) const {
  const double x = coordinate(i);
  return (x > line_) - (x < line_);
}

int LineForm::sign_after_start() const {
  for (int i = 0; i <= degree(); ++i) {
    if (const int s = coefficient_sign(i)) return s;
  }
  return 0;
}

int LineForm::sign_before_end() const {
  for (int i = degree(); i >= 0; --i) {
    if (const int s = coefficient_sign(i)) return s;
  }
  return 0;
}

int sign_at(const LineForm& form, double s, PredicateCounts& counts) {
  if (s <= 0) return form.coefficient_sign(0);
  if (s >= 1) return form.coefficient_sign(form.degree());
  if (const int quick = filtered_sign(form, s)) {
    ++counts.interval;
    return quick;
  }
  require_finite(s, "a parameter on a trim");
  ++counts.exact;
  std::vector<Dyadic> d = exact_coefficients<Dyadic>(form);
  const Dyadic t(s), r = Dyadic(1) - t;
  for (std::size_t k = d.size() - 1; k > 0; --k) {
    for (std::size_t i = 0; i < k; ++i) d[i] = r * d[i] + t * d[i + 1];
  }
  return sign_of(d[0]);
}

std::vector<LineRoot> roots(const LineForm& form, PredicateCounts& counts) {
  std::vector<LineRoot> out;
  int count = 0, last = 0;
  for (int i = 0; i <= form.degree(); ++i) {
    const int s = form.coefficient_sign(i);
    if (s == 0) continue;
    if (last != 0 && s != last) ++count;
    last = s;
  }
  if (count <= 1) {
    ++counts.coefficient_signs;
    if (count == 1) out.push_back({0, 1, true, nullptr});
  } else {
    if (isolate_filtered(form.coefficients(), static_cast<std::size_t>(form.degree()), form.coefficient_error(),
                         form.magnitude(), 0, 1, out)) {
      ++counts.interval;
    } else {
      out.clear();
      try {
        ++counts.exact;
        isolate(exact_coefficients<Dyadic>(form), 0.0, 1.0, 0, 10, out);
      } catch (const TooDeep&) {
        ++counts.algebraic;
        return algebraic_roots(power_basis(form));
      }
    }
  }
  for (LineRoot& root : out) narrow(form, root, counts);
  return out;
}

int sign_at_root(const LineForm& form, const LineForm& of, LineRoot& root, PredicateCounts& counts) {
  double slope = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(form.degree()); ++i) {
    slope = std::max(slope, std::abs(form.coefficients()[i + 1] - form.coefficients()[i]));
  }
  slope *= 1.01 * form.degree();
  bool tested = false;
  while (true) {
    if (root.exact()) return sign_at(form, root.lo, counts);
    double bound = 0;
    const double x = filtered_value(form, root.s(), bound);
    if (std::abs(x) > bound + slope * (root.hi - root.lo)) {
      ++counts.interval;
      return sign_of(x);
    }
    if (!tested && root.hi - root.lo < 1e-9) {
      tested = true;
      if (have_common_root(of, form, root.lo, root.hi, counts)) return 0;
    }
    if (!bisect(of, root, counts)) break;
  }
  if (!tested && have_common_root(of, form, root.lo, root.hi, counts)) return 0;
  DeepRoot deep(of, root);
  const Polynomial g = power_basis(form);
  Rational steep(0);
  for (const Rational& c : derivative(g)) steep += CGAL::abs(c);
  while (true) {
    const Rational x = value(g, deep.mid());
    if (CGAL::abs(x) > steep * (deep.hi - deep.lo)) return sign_of(x);
    deep.bisect();
  }
}

int compare(const LineForm& f, LineRoot& a, const LineForm& g, LineRoot& b, PredicateCounts& counts) {
  bool tested = f.axis() == g.axis();  // two lines of one family share no point
  while (true) {
    if (a.exact() && b.exact()) return (a.lo > b.lo) - (a.lo < b.lo);
    if (a.hi <= b.lo) return -1;
    if (b.hi <= a.lo) return 1;
    if (a.exact() || b.exact()) {
      const bool swap = b.exact();
      const LineForm& form = swap ? f : g;
      LineRoot& open = swap ? a : b;
      const double s = swap ? b.lo : a.lo;
      const int at = refining_sign(form, open, s, counts);
      if (at == 0) return 0;
      const bool open_after = at == refining_sign(form, open, open.lo, counts);
      (open_after ? open.lo : open.hi) = s;
      continue;
    }
    if (!tested) {
      tested = true;
      if (have_common_root(f, g, std::max(a.lo, b.lo), std::min(a.hi, b.hi), counts)) return 0;
    }
    const bool first = a.hi - a.lo >= b.hi - b.lo;
    if (!(first ? bisect(f, a, counts) : bisect(g, b, counts)) &&
        !(first ? bisect(g, b, counts) : bisect(f, a, counts)))
      break;
  }
  DeepRoot x(f, a), y(g, b);
  while (x.hi > y.lo && y.hi > x.lo) {
    if (x.hi - x.lo >= y.hi - y.lo) {
      x.bisect();
    } else {
      y.bisect();
    }
  }
  return x.hi <= y.lo ? -1 : 1;
}

int orientation(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  const double left = (b.x() - a.x()) * (c.y() - a.y()), right = (b.y() - a.y()) * (c.x() - a.x());
  const double det = left - right;
  // [Shewchuk 1997, orient2d: (3 + 16 eps) eps]
  if (std::abs(det) > 4 * epsilon * (std::abs(left) + std::abs(right))) return sign_of(det);
  // What isn't finite makes one of the products infinite or no number, and comes here.
  for (const Eigen::Vector2d* x : {&a, &b, &c}) require_finite(*x, "a point of a triangle");
  return sign_of((Dyadic(b.x()) - Dyadic(a.x())) * (Dyadic(c.y()) - Dyadic(a.y())) -
                 (Dyadic(b.y()) - Dyadic(a.y())) * (Dyadic(c.x()) - Dyadic(a.x())));
}

}  // namespace toile
