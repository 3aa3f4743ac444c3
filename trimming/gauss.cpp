// SPDX-License-Identifier: GPL-3.0-or-later
#include "trimming/gauss.h"

#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

namespace toile {
namespace {

// Newton on P_n from the asymptotic guess cos(pi (i + 3/4) / (n + 1/2)); quadratic convergence from there.
GaussRule make_rule(int n) {
  using Real = long double;
  GaussRule rule;
  rule.node.resize(n);
  rule.weight.resize(n);
  for (int i = 0; i < (n + 1) / 2; ++i) {
    Real x = 2 * i + 1 == n ? 0 : std::cos(std::numbers::pi_v<Real> * (i + Real(0.75)) / (n + Real(0.5)));
    Real slope = 1;
    for (int step = 0; step < 12; ++step) {
      Real before = 1, value = x;
      for (int k = 2; k <= n; ++k) {
        const Real next = ((2 * k - 1) * x * value - (k - 1) * before) / k;
        before = value;
        value = next;
      }
      slope = n * (x * value - before) / (x * x - 1);
      if (2 * i + 1 == n) break;
      const Real change = value / slope;
      x -= change;
      if (std::abs(change) < Real(1e-19)) break;
    }
    const Real weight = 2 / ((1 - x * x) * slope * slope);
    rule.node[n - 1 - i] = x;
    rule.node[i] = -x;
    rule.weight[n - 1 - i] = rule.weight[i] = weight;
  }
  for (int i = 0; i < n; ++i) {
    rule.x.push_back(static_cast<double>(rule.node[i]));
    rule.w.push_back(static_cast<double>(rule.weight[i]));
  }
  return rule;
}

}  // namespace

const GaussRule& gauss_rule(int n) {
  assert(1 <= n && n <= max_gauss_points);
  static const std::array<GaussRule, max_gauss_points + 1> table = [] {
    std::array<GaussRule, max_gauss_points + 1> rules;
    for (int k = 1; k <= max_gauss_points; ++k) rules[k] = make_rule(k);
    return rules;
  }();
  return table[n];
}

}  // namespace toile
