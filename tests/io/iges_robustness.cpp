#include <gtest/gtest.h>

#include <random>

#include "geometry/error.h"
#include "io/iges_corpus.h"

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
      std::string text = source;
      const int flips = 1 + static_cast<int>(random() % 3);
      for (int i = 0; i < flips; ++i) {
        const std::size_t at = random() % text.size();
        if (random() % 2 == 0) {
          text[at] = static_cast<char>(text[at] ^ (1 << (random() % 8)));
        } else {
          text[at] = "0123456789.,;HDSGPT-+ \n"[random() % 23];
        }
      }
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

}  // namespace
}  // namespace toile
