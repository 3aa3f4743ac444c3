// SPDX-License-Identifier: GPL-3.0-or-later
// Files as nobody should write them, with the one answer that they can mean.
#include <gtest/gtest.h>

#include <numbers>
#include <ostream>

#include "geometry/error.h"
#include "io/iges_corpus.h"
#include "io/panel_facts.h"
#include "support/near.h"

namespace toile {
namespace {

struct OddFile {
  const char* name;
  const char* warning;  // null: it is as it should be
  double area;          // mm2, of the one panel
};

void PrintTo(const OddFile& file, std::ostream* out) {
  *out << file.name;
}

class OddIges : public testing::TestWithParam<OddFile> {};

TEST_P(OddIges, IsReadWithAWarningAndWrittenAgain) {
  const PanelFile file = test::read_corpus(GetParam().name);
  ASSERT_EQ(file.panels.size(), 1u);
  expect_near_rel(test::area(file.panels[0]), GetParam().area, 1e-12);
  EXPECT_EQ(file.metres_per_unit, 0.001);
  if (GetParam().warning) {
    EXPECT_TRUE(test::has_warning(file, GetParam().warning)) << testing::PrintToString(file.warnings);
  } else {
    EXPECT_TRUE(file.warnings.empty()) << testing::PrintToString(file.warnings);
  }
  EXPECT_TRUE(roundtrip(file, IgesMode::replay).exact());
  EXPECT_TRUE(roundtrip(file, IgesMode::rewrite).exact());
}

// 60 mm x 30 mm of a sheet; the wall of a tube of radius 2 and height 3.
INSTANTIATE_TEST_SUITE_P(Corpus, OddIges,
                         testing::Values(OddFile{"directory_gaps", "numbers have gaps", 1800},
                                         OddFile{"wrong_owners", "numbers on the parameter lines are wrong", 1800},
                                         OddFile{"no_owners_wrong_counts", "claims 1 parameter lines, has 3", 1800},
                                         OddFile{"lower_case", "letter is lower case", 1800},
                                         OddFile{"no_sequence_numbers", "no sequence number", 1800},
                                         OddFile{"shifted_right", "does not stand in column 73", 1800},
                                         OddFile{"shifted_globals", "fields are shifted", 1800},
                                         OddFile{"curves_out_of_order", "sorted by their ends", 1800},
                                         OddFile{"parameter_curves_out_of_order", "sorted by their ends", 1800},
                                         OddFile{"points_in_composite", nullptr, 1800},
                                         OddFile{"idle_boundaries", "a pointer to a boundary is 0", 1800},
                                         OddFile{"bounded_108", "there are no parameter curves", 1800},
                                         OddFile{"columns_65", "65 columns of data", 8400},
                                         OddFile{"exponents_without_letter", nullptr, 8400},
                                         OddFile{"promised_outer", "N1 is 1 though no outer boundary", 8400},
                                         OddFile{"seam_there_and_back", "the seam there and back",
                                                 12 * std::numbers::pi}),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(OddIges, SortedCurvesKeepTheFilesNumbers) {
  const TrimLoop loop = test::read_corpus("parameter_curves_out_of_order").panels[0].loops[0];
  std::vector<int> numbers;
  for (const TrimCurve& c : loop.curves) numbers.push_back(c.index);
  EXPECT_EQ(numbers, (std::vector<int>{0, 2, 1, 3}));
}

// Else the face would come untrimmed.
TEST(OddIges, ABoundaryOfPointsOnlyIsRefused) {
  std::string text = test::corpus_text("points_in_composite");
  const std::string composite = "102,5,11,3,5,7,9;";
  text.replace(text.find(composite), composite.size(), "102,1,11;        ");
  try {
    parse_iges(text, "points.igs");
    FAIL() << "a face came back";
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "points.igs:35: entity 142: its curves are points only");
  }
}

}  // namespace
}  // namespace toile
