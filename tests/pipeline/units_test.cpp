// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/scene/units.h"

#include <gtest/gtest.h>

#include <numbers>
#include <string>

#include "geometry/error.h"
#include "support/near.h"

namespace toile {
namespace {

std::string refusal(std::string_view text, const Dimension& dimension) {
  try {
    parse_quantity(text, dimension);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Units, ConvertToSi) {
  expect_near_rel(parse_quantity("2 mm", dimension::length), 0.002, 1e-15);
  expect_near_rel(parse_quantity("120 g/m2", dimension::area_density), 0.12, 1e-15);
  expect_near_rel(parse_quantity("120gsm", dimension::area_density), 0.12, 1e-15);
  expect_near_rel(parse_quantity("30 deg", dimension::angle), std::numbers::pi / 6, 1e-15);
  expect_near_rel(parse_quantity("0.351 kg/(m2 s)", dimension::area_drag), 0.351, 1e-15);
  expect_near_rel(parse_quantity("1 gf cm", dimension::moment), 9.80665e-5, 1e-14);
  expect_near_rel(parse_quantity("30 1/m", dimension::curvature), 30, 1e-15);
  expect_near_rel(parse_quantity("0.3 /cm", dimension::curvature), 30, 1e-15);
  expect_near_rel(parse_quantity("30 m^-1", dimension::curvature), 30, 1e-15);
  expect_near_rel(parse_quantity("11.7 N/m", dimension::force_per_length), 11.7, 1e-15);
  expect_near_rel(parse_quantity("1 %", dimension::none), 0.01, 1e-15);
}

TEST(Units, AFractionIsANumber) {
  EXPECT_EQ(parse_quantity("1/30 s", dimension::time), 1.0 / 30);
}

TEST(Units, ABareNumberIsSi) {
  EXPECT_EQ(parse_quantity("0.25", dimension::length), 0.25);
}

TEST(Units, AnotherDimensionIsRefused) {
  EXPECT_NE(refusal("20 kg", dimension::length).find("is in kg, expected m"), std::string::npos);
  EXPECT_NE(refusal("30 deg", dimension::length).find("is in rad, expected m"), std::string::npos);
  EXPECT_NE(refusal("1 %", dimension::length), "accepted");
}

TEST(Units, TwoReadingsAreRefused) {
  EXPECT_NE(refusal("0.3 kg/m2 s", dimension::area_drag).find("two readings"), std::string::npos);
}

TEST(Units, NonsenseIsRefused) {
  for (const char* text :
       {"", "mm", "2 parsec", "2 m)", "2 (m", "1/0 s", "nan m", "inf m", "2 m^", "1e999 m", "2 m/", "--2 m"}) {
    EXPECT_NE(refusal(text, dimension::length), "accepted") << text;
  }
}

TEST(Units, DeepNestingIsRefused) {
  EXPECT_EQ(parse_quantity("2 ((((mm))))", dimension::length), 0.002);
  EXPECT_NE(refusal("2 " + std::string(100'000, '(') + "m", dimension::length).find("nested"), std::string::npos);
}

TEST(Units, DegreesShowNoRoundingErrors) {
  EXPECT_EQ(degrees_text(-1e-17), "0");
  EXPECT_EQ(degrees_text(std::atan2(1, -1e-16)), "90");
  EXPECT_EQ(degrees_text(-std::atan(1.0) / 2), "-22.5");
}

}  // namespace
}  // namespace toile
