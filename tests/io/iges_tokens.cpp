// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <cstring>
#include <limits>
#include <locale>
#include <random>

#include "geometry/error.h"
#include "io/iges/parameters.h"

namespace toile::iges {
namespace {

std::vector<std::string> texts(const std::string& record, Delimiters delimiters = {}) {
  Tokens tokens;
  tokenize(record, delimiters, tokens);
  std::vector<std::string> out;
  for (const Token& t : tokens.list) out.emplace_back(t.text);
  return out;
}

using List = std::vector<std::string>;

TEST(IgesTokens, DelimitersInsideStringsDoNotCut) {
  EXPECT_EQ(texts("406,1,7Ha;b,c;d;comment"), (List{"406", "1", "a;b,c;d"}));
}

TEST(IgesTokens, BlanksAroundParametersFall) {
  EXPECT_EQ(texts(" 1 ,  2.5 , 3H a ;"), (List{"1", "2.5", " a "}));
}

TEST(IgesTokens, NothingBetweenDelimitersIsADefault) {
  EXPECT_EQ(texts("1,,,4;"), (List{"1", "", "", "4"}));
}

TEST(IgesTokens, WrongStringCountEndsAtTheNearestDelimiter) {
  EXPECT_EQ(texts("1,9Hshort,2;"), (List{"1", "short", "2"}));
  EXPECT_EQ(texts("1,3Hlonger,2;"), (List{"1", "longer", "2"}));
  EXPECT_EQ(texts("1,99999Hhuge,2;"), (List{"1", "huge", "2"}));
}

TEST(IgesTokens, OtherDelimitersAreHonoured) {
  EXPECT_EQ(texts("1/2,5/3#4", {'/', '#'}), (List{"1", "2,5", "3"}));
}

TEST(IgesTokens, TheRecordDelimiterEndsTheRecord) {
  Tokens tokens;
  tokenize("1,2", {}, tokens);
  EXPECT_FALSE(tokens.terminated);
  tokenize("1,2;3", {}, tokens);
  EXPECT_TRUE(tokens.terminated);
  EXPECT_EQ(tokens.list.size(), 2u);
}

TEST(IgesReal, ReadsEveryFormThatExportersWrite) {
  for (const auto& [text, value] : std::vector<std::pair<std::string, double>>{{"1", 1},
                                                                               {"1.", 1},
                                                                               {".5", 0.5},
                                                                               {"+2.5", 2.5},
                                                                               {"-0.", 0},
                                                                               {"1.5E2", 150},
                                                                               {"1.5E+02", 150},
                                                                               {"1.5D2", 150},
                                                                               {"1.5d-02", 0.015},
                                                                               {"-1D+00", -1},
                                                                               {"1.0+002", 100},
                                                                               {"-2.5-003", -0.0025},
                                                                               {".5-1", 0.05},
                                                                               {"1.0-400", 0},
                                                                               {"1E-400", 0}}) {
    const std::optional<double> read = parse_real(text);
    ASSERT_TRUE(read) << text;
    EXPECT_EQ(*read, value) << text;
  }
}

TEST(IgesReal, RefusesWhatIsNoFiniteNumber) {
  for (const char* text : {"", "abc", "1..2", "1,5", "nan", "inf", "1E400", "0x10", "1 2", "--1", "1E", "1.0+400",
                           "1+2", "1.0+", "1.0+-2", "1.5-2.5"})
    EXPECT_FALSE(parse_real(text)) << text;
}

TEST(IgesReal, EveryDoubleComesBackBitForBit) {
  std::mt19937_64 random(20261122);
  for (int i = 0; i < 20000; ++i) {
    const std::uint64_t bits = random();
    double value;
    std::memcpy(&value, &bits, sizeof value);
    if (!std::isfinite(value) || (value != 0 && std::abs(value) < std::numeric_limits<double>::min())) continue;
    const std::string text = format_real(value);
    EXPECT_NE(text.find('.'), std::string::npos) << text;
    const std::optional<double> back = parse_real(text);
    ASSERT_TRUE(back) << text;
    EXPECT_EQ(std::memcmp(&*back, &value, sizeof value), 0) << text << " seed 20261122";
  }
}

TEST(IgesReal, SignOfZeroAndDenormalsComeBack) {
  EXPECT_TRUE(std::signbit(*parse_real(format_real(-0.0))));
  const double smallest = std::numeric_limits<double>::denorm_min();
  EXPECT_EQ(*parse_real(format_real(smallest)), smallest);
}

TEST(IgesReal, DoesNotDependOnTheLocale) {
  // A numeric facet with a decimal comma stands in for a locale that may not be installed; C's is switched where it is.
  struct Comma : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
  };
  const std::locale before = std::locale::global(std::locale(std::locale::classic(), new Comma));
  const std::string c_before = std::setlocale(LC_NUMERIC, nullptr);
  for (const char* name : {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8"})
    if (std::setlocale(LC_NUMERIC, name)) break;
  const std::string written = format_real(1234567.25);
  const std::optional<double> read = parse_real("1234.5");
  std::setlocale(LC_NUMERIC, c_before.c_str());
  std::locale::global(before);
  EXPECT_EQ(written, "1234567.25");
  ASSERT_TRUE(read);
  EXPECT_EQ(*read, 1234.5);
}

TEST(IgesRecord, NumbersAreNotBrokenOverLines) {
  Record record(126);
  std::vector<double> numbers;
  std::mt19937 random(1);
  for (int i = 0; i < 500; ++i) numbers.push_back(std::uniform_real_distribution<double>(-1e3, 1e3)(random));
  for (double x : numbers) record.real(x);
  record.string(std::string(150, 'x') + ",;");
  const std::string lines = record.finish();
  ASSERT_EQ(lines.size() % 64, 0u);
  // Every line read alone gives whole numbers: nothing changes when blanks are put between lines.
  std::string spaced;
  const std::size_t numeric = lines.find('H') / 64;
  for (std::size_t i = 0; i < numeric; ++i) spaced += lines.substr(64 * i, 64) + "   ";
  spaced += lines.substr(64 * numeric);
  Tokens tokens;
  tokenize(spaced, {}, tokens);
  ASSERT_EQ(tokens.list.size(), numbers.size() + 2);
  for (std::size_t i = 0; i < numbers.size(); ++i) EXPECT_EQ(*parse_real(tokens.list[i + 1].text), numbers[i]);
  EXPECT_EQ(tokens.list.back().text, std::string(150, 'x') + ",;");
}

}  // namespace
}  // namespace toile::iges
