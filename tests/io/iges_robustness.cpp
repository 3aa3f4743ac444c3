// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <ctime>
#include <filesystem>
#include <random>

#include "geometry/error.h"
#include "io/iges_corpus.h"
#include "support/flipped.h"

namespace toile {
namespace {

// A prefix of a file is refused, unless nothing but its terminate line is missing.
TEST(IgesRobustness, CutAtEveryByteAFileIsWholeOrRefused) {
  const std::string text = test::corpus_text("hole_and_composite");
  const PanelFile whole = parse_iges(text, "whole.igs");
  int refused = 0;
  for (std::size_t length = 0; length < text.size(); ++length) {
    try {
      const PanelFile cut = parse_iges(std::string_view(text).substr(0, length), "cut.igs");
      ASSERT_EQ(cut.panels.size(), whole.panels.size()) << length;
      EXPECT_EQ(cut.panels[0].surface, whole.panels[0].surface) << length;
      EXPECT_EQ(cut.entities, whole.entities) << length;
      if (length < text.size() - 8) {
        EXPECT_FALSE(cut.warnings.empty()) << length;
      }
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, static_cast<int>(text.size()) - 200);
}

// Any other exception than InputError fails the test; what is read is written and read again exactly.
TEST(IgesRobustness, FlippedBytesGiveErrorsOrFilesThatRoundTrip) {
  const std::uint32_t seed = 20261122;
  std::mt19937 random(seed);
  const std::vector<std::string> names{"hole_and_composite", "transforms", "delimiters", "model_curves_only",
                                       "quarantine"};
  int read = 0, refused = 0;
  for (const std::string& name : names) {
    const std::string source = test::corpus_text(name);
    for (int k = 0; k < 2000; ++k) {
      const std::string text = test::flipped(source, "0123456789.,;HDSGPT-+ \n", random);
      SCOPED_TRACE(name + ", flip " + std::to_string(k) + ", seed " + std::to_string(seed));
      try {
        const PanelFile file = parse_iges(text, "flipped.igs");
        const RoundtripReport report = roundtrip(file, IgesMode::rewrite);
        EXPECT_TRUE(report.exact()) << (report.differences.empty() ? "" : report.differences[0]);
        ++read;
      } catch (const InputError&) {
        ++refused;
      }
    }
  }
  EXPECT_EQ(read + refused, 10000);
  EXPECT_GT(read, 1000);
  EXPECT_GT(refused, 1000);
}

// Counts that a file of kilobytes can't hold, in every entity that has counts (entry 17): left out with the claim
// named, before anything is allocated for it; the face beside it stays. What follows uses it.
TEST(IgesRobustness, HugeCountsAreRefusedAndTheFaceBesideThemStays) {
  const std::string text = test::corpus_text("clockwise");
  const PanelFile plain = parse_iges(text, "plain.igs");
  const std::vector<std::string> as_curve{"142,1,1,17,0,1;", "144,1,1,0,19;"}, as_surface{"144,17,1,0,13;"};
  const std::vector<std::pair<std::string, std::vector<std::string>>> cases{
      {"102,2000000000,1;", as_curve},
      {"106,1,2000000000,0.;", as_curve},
      {"106,2,2147483647,0.;", as_curve},
      {"112,3,3,3,2000000000,0.;", as_curve},
      {"112,3,3,3,2147483647,0.;", as_curve},
      {"126,2000000000,3,0,0,1,0,0.;", as_curve},
      {"126,2147483647,15,0,0,1,0;", as_curve},
      {"114,3,3,2000000000,1,0.;", as_surface},
      {"114,3,3,65536,65536,0.;", as_surface},
      {"128,2000000000,1,3,3,0,0,1;", as_surface},
      {"128,65535,65535,3,3,0,0,1,0,0,0.;", as_surface},
      {"128,2147483647,2147483647,3,3,0,0,1;", as_surface},
      {"128,3,3,2147483647,3,0,0,1;", as_surface},
      {"141,0,1,1,2000000000,1;", {"143,0,1,1,17;"}},
      {"141,0,1,1,1,3,1,2000000000;", {"143,0,1,1,17;"}},
      {"143,0,1,2000000000,1;", {}},
      {"144,1,1,2000000000,13;", {}},
      {"186,1,1,2000000000;", {}},
      {"308,0,1Ha,2000000000;", {"408,17,0.,0.,0.,1.;"}},
      {"402,2000000000,1;", {}},
      {"504,2000000000,1;", {"508,1,0,17,1,1,0;", "510,1,1,1,19;"}},
      {"508,2000000000,1;", {"510,1,1,1,17;"}},
      {"508,1,0,1,1,1,2000000000;", {"510,1,1,1,17;"}},
      {"510,1,2000000000,1;", {}},
      {"514,2000000000,1;", {}}};
  for (const auto& [record, users] : cases) {
    SCOPED_TRACE(record);
    std::vector<std::string> records{record};
    records.insert(records.end(), users.begin(), users.end());
    const PanelFile file = parse_iges(test::with_entities(text, records), "huge.igs");
    ASSERT_EQ(file.panels.size(), 1u);
    EXPECT_EQ(file.panels[0].surface, plain.panels[0].surface);
    const auto left_out = std::ranges::find(file.ledger, Disposition::quarantined, &LedgerEntry::disposition);
    ASSERT_NE(left_out, file.ledger.end());
    EXPECT_GE(left_out->sequence, 17);
    EXPECT_TRUE(test::has_warning(file, "need") || test::has_warning(file, "must be"))
        << testing::PrintToString(file.warnings);
  }
}

// A surface of its own with these knots, weights and x of its corners.
std::string one_surface(const std::string& knots, const std::string& weight, const std::string& x) {
  const std::size_t last = knots.rfind(',');
  return test::with_entities(
      test::corpus_text("clockwise"),
      {"128,1,1,1,1,0,0,1,0,0," + knots + ",0,0,1,1," + weight + ",1,1,1,0,0,0," + x + ",0,0,0,9,0," + x + ",9,0," +
       knots.substr(0, knots.find(',')) + "," + knots.substr(last + 1) + ",0,1;"});
}

// Derivatives are lengths over spans: what has none that is finite is refused with its line and what to do.
TEST(IgesRobustness, NumbersWithoutFiniteDerivativesAreRefused) {
  const auto refused = [](const std::string& text, const std::string& reason) {
    const PanelFile file = parse_iges(text, "n.igs");
    EXPECT_EQ(file.panels.size(), 1u) << "the face beside it stays: " << reason;
    EXPECT_TRUE(test::has_warning(file, "entity 128: " + reason)) << testing::PrintToString(file.warnings);
  };
  EXPECT_EQ(parse_iges(one_surface("0,0,1,1", "1", "9"), "n.igs").panels.size(), 2u);
  EXPECT_EQ(parse_iges(one_surface("0,0,1e-9,1e-9", "1", "9"), "n.igs").panels.size(), 2u);
  refused(one_surface("0,0,1e-300,1e-300", "1", "9"), "knots 1 and 2 are 1.E-300 apart, must be equal or at least");
  refused(one_surface("0,0,1e-160,1e-160", "1", "9"), "knots 1 and 2 are 1.E-160 apart, must be equal or at least");
  refused(one_surface("1,1,1.00000000000001,1.00000000000001", "1", "9"), "knots run from 1. to 1.00000000000001, too");
  refused(one_surface("0,0,1e300,1e300", "1", "9"), "knot 2 is '1e300', must be a number of at most 1e25 in size");
  refused(one_surface("0,0,1,1", "1e-300", "9"), "weights run from 1.E-300 to 1., must be within a factor of 1e15");
  refused(one_surface("0,0,1,1", "1", "1e150"),
          "coordinate of control point 1 is '1e150', must be a number of at most");
}

// What tests/fuzz/run found, each within a second of processor time as the program ships; the name says what it was.
TEST(IgesRobustness, FindingsOfTheFuzzerStayFixed) {
#if defined(__OPTIMIZE__) && !defined(__SANITIZE_ADDRESS__) && !defined(__clang__)
  constexpr double longest = 1;
#else
  constexpr double longest = 20;
#endif
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(TOILE_TEST_DATA) / "fuzz" / "iges")) {
    SCOPED_TRACE(entry.path().filename().string());
    const std::clock_t start = std::clock();
    try {
      const PanelFile file = parse_iges(read_file(entry.path()), "found.igs");
      const RoundtripReport report = roundtrip(file, IgesMode::rewrite);
      EXPECT_TRUE(report.exact()) << (report.differences.empty() ? "" : report.differences[0]);
    } catch (const InputError&) {
    }
    EXPECT_LT(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC, longest);
  }
}

}  // namespace
}  // namespace toile
