// SPDX-License-Identifier: GPL-3.0-or-later
// Evaluation allocates nothing: every call of operator new is counted here.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "geometry/grid_evaluation.h"
#include "random_geometry.h"

namespace {
std::atomic<long> allocations{0};
}

void* operator new(std::size_t size) {
  ++allocations;
  if (void* p = std::malloc(size ? size : 1)) return p;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {  // what delete frees must come from here
  ++allocations;
  return std::malloc(size ? size : 1);
}
void operator delete(void* p) noexcept {
  std::free(p);
}
void operator delete(void* p, std::size_t) noexcept {
  std::free(p);
}

namespace toile {
namespace {

template <class Call>
long allocations_of(Call&& call) {
  const long before = allocations;
  call();
  return allocations - before;
}

TEST(Evaluation, AllocatesNothing) {
  SCOPED_TRACE("seed 41");
  test::Random random(41);
  ASSERT_GT(allocations_of([] {
              std::vector<double> v(100);
              EXPECT_EQ(v[3], 0);
            }),
            0)
      << "the counter doesn't count";
  for (auto kind : {test::Kind::polynomial, test::Kind::rational})
    for (int degree : {1, 2, 3, 7}) {
      const NurbsSurface s = test::random_surface(random, degree, degree, 3, test::Ends::unclamped, kind);
      const Curve3 c = test::random_curve<3>(random, degree, 3, test::Ends::clamped, kind);
      const Interval du = s.u().domain(), dv = s.v().domain();
      const std::vector<double> grid = test::spread(du, 9);
      const auto table_u = tabulate_basis(s.u(), grid), table_v = tabulate_basis(s.v(), test::spread(dv, 9));
      std::vector<SurfaceJet> jets(table_u.size() * table_v.size());
      std::vector<Eigen::Vector2d> points(jets.size(), Eigen::Vector2d(du.min, dv.min));
      const int su = s.u().find_span(du.min), sv = s.v().find_span(dv.min);
      double sum = 0;
      const long count = allocations_of([&] {
        SurfaceBasis functions;
        BasisValues basis;
        for (int k = 0; k <= 100; ++k) {
          const double u = du.min + du.length() * k / 100, v = dv.min + dv.length() * k / 100;
          sum += evaluate(s, u, v).uv.norm() + s(u, v).norm();
          evaluate_basis(s, u, v, functions);
          evaluate_basis(s.u(), u, 2, basis);
          sum += functions.value[5][0] + basis.value[2][0];
          const double t = c.domain().min + c.domain().length() * k / 100;
          sum += evaluate(c, t).d2.norm() + c(t).norm();
        }
        evaluate_grid(s, table_u, table_v, jets);
        evaluate_on_span(s, su, sv, points, jets);
      });
      EXPECT_EQ(count, 0) << "degree " << degree;
      EXPECT_TRUE(std::isfinite(sum));
    }
}

}  // namespace
}  // namespace toile
