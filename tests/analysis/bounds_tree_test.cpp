// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/contact/bounds_tree.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <set>

#include "geometry/error.h"

namespace toile {
namespace {

using Eigen::Vector3d;

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double no_number = std::numeric_limits<double>::quiet_NaN();

class Boxes {
 public:
  explicit Boxes(unsigned seed) : random_(seed) {}
  double operator()(double least, double most) { return std::uniform_real_distribution(least, most)(random_); }
  Vector3d place(double size) { return {(*this)(-size, size), (*this)(-size, size), (*this)(-size, size)}; }
  // Of every kind: points, rods, plates, many equal ones, all on one line.
  std::vector<Box> make(int count, int kind) {
    std::vector<Box> boxes;
    for (int k = 0; k < count; ++k) {
      Vector3d centre = place(1), half = 0.2 * place(1).cwiseAbs();
      if (kind == 1) half.setZero();
      if (kind == 2) half[k % 3] = 0;
      if (kind == 3) centre = Vector3d::Constant(k % 3), half.setConstant(0.5);
      if (kind == 4) centre = {0.25 * k, 0, 0}, half.setConstant(0.125);
      if (kind == 5) centre.setZero(), half.setZero();
      boxes.emplace_back(centre - half, centre + half);
    }
    return boxes;
  }

 private:
  std::mt19937 random_;
};

void expect_as_a_search_of_all(const BoundsTree& tree, const std::vector<Box>& boxes, Boxes& random) {
  const int count = static_cast<int>(boxes.size());
  for (int k = 0; k < 20; ++k) {
    const Vector3d p = random.place(1.5);
    const Box asked = random.make(1, k % 3).front();
    const double gap = k % 2 == 0 ? 0 : random(-0.05, 0.2);
    std::multiset<int> found, expected;
    tree.meeting(asked, gap, [&](int i) { found.insert(i); });
    for (int i = 0; i < count; ++i)
      if (within(boxes[i], asked, gap)) expected.insert(i);
    EXPECT_EQ(found, expected);

    // What the boxes bound: their centres.
    const auto distance = [&](int i) { return (boxes[i].center() - p).squaredNorm(); };
    const double reach = k % 4 == 0 ? infinite : random(0, 2);
    double least = infinite;
    for (int i = 0; i < count; ++i) least = std::min(least, distance(i));
    const auto nearest = tree.nearest(p, reach, distance);
    ASSERT_EQ(nearest.has_value(), count > 0 && least <= reach * reach);
    if (nearest) {
      EXPECT_EQ(nearest->distance_squared, least);
      EXPECT_EQ(distance(nearest->box), least);
    }
  }
  for (const double gap : {0.0, 0.1}) {
    std::multiset<std::pair<int, int>> found, expected;
    tree.own_pairs(gap, [&](int i, int j) { found.emplace(i, j); });
    for (int i = 0; i < count; ++i)
      for (int j = i + 1; j < count; ++j)
        if (within(boxes[i], boxes[j], gap)) expected.emplace(i, j);
    EXPECT_EQ(found, expected);
  }
}

TEST(BoundsTree, FindsWhatASearchOfAllBoxesFinds) {
  Boxes random(3);
  for (const int count : {0, 1, 2, 3, 4, 5, 8, 9, 33, 100, 257})
    for (int kind = 0; kind < 6; ++kind) {
      SCOPED_TRACE(::testing::Message() << count << " boxes of kind " << kind);
      const std::vector<Box> boxes = random.make(count, kind);
      BoundsTree tree(boxes);
      ASSERT_EQ(tree.size(), count);
      expect_as_a_search_of_all(tree, boxes, random);
      // The same tree over boxes that are elsewhere and have other neighbours.
      const std::vector<Box> moved = random.make(count, (kind + 1) % 6);
      tree.refit(moved);
      expect_as_a_search_of_all(tree, moved, random);
    }
}

TEST(BoundsTree, PairsAreWithinTheGapHoweverItIsReached) {
  // Corner to corner, 0.125 m apart along each axis.
  const std::vector<Box> two{Box(Vector3d::Zero(), Vector3d::Ones()),
                             Box(Vector3d::Constant(1.125), Vector3d::Constant(2))};
  const BoundsTree tree(two);
  const auto count = [&](double gap) {
    int n = 0;
    tree.own_pairs(gap, [&](int, int) { ++n; });
    return n;
  };
  EXPECT_EQ(count(0.125), 1);
  EXPECT_EQ(count(std::nextafter(0.125, 0)), 0);
}

TEST(BoundsTree, TellsTheSameOrderWhateverItsBoxesBecome) {
  Boxes random(5);
  const std::vector<Box> boxes = random.make(300, 0);
  const BoundsTree tree(boxes);
  BoundsTree moved(boxes);
  moved.refit(random.make(300, 2));
  moved.refit(boxes);
  const auto order = [](const BoundsTree& of) {
    std::vector<std::pair<int, int>> out;
    of.own_pairs(0.05, [&](int i, int j) { out.emplace_back(i, j); });
    of.meeting(Box(Vector3d::Constant(-0.5), Vector3d::Constant(0.5)), 0, [&](int i) { out.emplace_back(i, i); });
    return out;
  };
  EXPECT_EQ(order(tree), order(moved));
  EXPECT_GT(order(tree).size(), 300u);
}

TEST(BoundsTree, LooksAtFewBoxesForTheNearest) {
  Boxes random(7);
  const std::vector<Box> boxes = random.make(20000, 1);
  const BoundsTree tree(boxes);
  long looks = 0;
  for (int k = 0; k < 100; ++k) {
    const Vector3d p = random.place(1);
    tree.nearest(p, infinite, [&](int i) {
      ++looks;
      return (boxes[i].center() - p).squaredNorm();
    });
  }
  EXPECT_LT(looks, 100 * 30);
}

TEST(BoundsTree, RefusesWhatIsNotFiniteAndStaysAsItWas) {
  Boxes random(9);
  const std::vector<Box> boxes = random.make(50, 0);
  BoundsTree tree(boxes);
  for (const double bad : {no_number, infinite, -infinite})
    for (int axis = 0; axis < 3; ++axis)
      for (const bool low : {false, true}) {
        std::vector<Box> wrong = random.make(50, 0);
        (low ? wrong[31].min() : wrong[31].max())[axis] = bad;
        EXPECT_THROW(BoundsTree{wrong}, GeometryError);
        EXPECT_THROW(tree.refit(wrong), GeometryError);
        EXPECT_THROW(tree.meeting(wrong[31], 0, [](int) {}), GeometryError);
        Vector3d p = Vector3d::Zero();
        p[axis] = bad;
        EXPECT_THROW(tree.nearest(p, 1, [](int) { return 0.0; }), GeometryError);
      }
  std::vector<Box> inside_out = boxes;
  std::swap(inside_out[3].min(), inside_out[3].max());
  EXPECT_THROW(tree.refit(inside_out), GeometryError);
  EXPECT_THROW(tree.refit(std::span(boxes).first(49)), GeometryError);
  EXPECT_THROW(tree.own_pairs(no_number, [](int, int) {}), GeometryError);
  EXPECT_THROW(tree.nearest(Vector3d::Zero(), no_number, [](int) { return 0.0; }), GeometryError);
  expect_as_a_search_of_all(tree, boxes, random);
}

}  // namespace
}  // namespace toile
