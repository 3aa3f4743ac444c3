// SPDX-License-Identifier: GPL-3.0-or-later
// The table of formats that are written.
#include "io/file_formats.h"

#include <gtest/gtest.h>

#include <set>
#include <string_view>

namespace toile {
namespace {

TEST(FileFormats, EachHasARowANameAndAnEndingOfItsOwn) {
  std::set<std::string_view> names, endings;
  int next = 0;
  for (const NamedFormat& format : file_formats()) {
    EXPECT_EQ(static_cast<int>(format.format), next++);
    EXPECT_EQ(&named_format(format.format), &format);
    EXPECT_EQ(format_with_ending(format.ending), format.format);
    EXPECT_TRUE(names.insert(format.name).second) << format.name;
    EXPECT_TRUE(endings.insert(format.ending).second) << format.ending;
  }
  EXPECT_EQ(next, 9);
}

// What writes a frame by itself is triangles or nets.
TEST(FileFormats, TrianglesAndNetsAreWrittenFromAFrame) {
  for (const NamedFormat& format : file_formats()) {
    const bool from_a_frame = format.what == FormatContent::triangles || format.what == FormatContent::nets;
    EXPECT_EQ(format.text != nullptr, from_a_frame) << format.name;
  }
}

TEST(FileFormats, EndingsAreTakenInAnyCase) {
  EXPECT_EQ(format_with_ending(".IGES"), FileFormat::iges);
  EXPECT_EQ(format_with_ending(".Igs"), FileFormat::iges);
  EXPECT_EQ(format_with_ending(".step"), std::nullopt);
  EXPECT_EQ(format_with_ending(""), std::nullopt);
}

}  // namespace
}  // namespace toile
