// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/base/json_writer.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <random>

namespace toile {
namespace {

using Json = nlohmann::ordered_json;

TEST(JsonWriter, ReadsBackAsWhatWasWritten) {
  std::string text;
  JsonWriter json(text);
  json.begin_object().member("truth", true).member("count", 3).member("number", 2.0);
  json.key("rows").begin_array();
  json.begin_object(JsonWriter::Layout::one_line).member("a", 1).key("b").values(std::vector<double>{0.5, 1e300});
  json.end_object().begin_array().end_array().begin_object().end_object().end_array();
  json.member("last", "x").end_object();
  const Json expected = {{"truth", true},
                         {"count", 3},
                         {"number", 2.0},
                         {"rows", {{{"a", 1}, {"b", {0.5, 1e300}}}, Json::array(), Json::object()}},
                         {"last", "x"}};
  EXPECT_EQ(Json::parse(text), expected) << text;
  EXPECT_TRUE(Json::parse(text)["number"].is_number_float());
}

TEST(JsonWriter, NumbersKeepTheirBitsAndWhatIsNotFiniteIsNull) {
  std::mt19937_64 rng(5);
  for (int k = 0; k < 10000; ++k) {
    const double number = std::bit_cast<double>(rng());
    std::string text;
    JsonWriter(text).value(number);
    const Json read = Json::parse(text);
    if (std::isfinite(number)) {
      ASSERT_EQ(std::bit_cast<std::uint64_t>(read.get<double>()), std::bit_cast<std::uint64_t>(number)) << text;
    } else {
      ASSERT_TRUE(read.is_null());
    }
  }
}

TEST(JsonWriter, TextsOfAnyBytesBecomeValidStrings) {
  std::string all;
  for (int c = 1; c < 256; ++c) all += static_cast<char>(c);
  for (const std::string& name : {all,
                                  std::string("R\xfc"
                                              "ckenteil \"1\"\\\n\t"),
                                  std::string("\xe5\x90\x8e\xe7\x89\x87")}) {
    std::string text;
    JsonWriter(text).begin_array().value(name).end_array();
    EXPECT_TRUE(Json::accept(text)) << text;
  }
  std::string text;
  JsonWriter(text).value(std::string("\xe5\x90\x8e \"\\\n"));
  EXPECT_EQ(Json::parse(text).get<std::string>(), "\xe5\x90\x8e \"\\\n");
}

TEST(JsonWriter, APieceWrittenAloneStandsAsIfWrittenInPlace) {
  const auto piece = [](JsonWriter& json) { json.begin_object().member("a", 1).member("b", 2).end_object(); };
  std::string whole, alone, joined;
  JsonWriter in_place(whole);
  in_place.begin_array();
  piece(in_place);
  in_place.end_array();
  JsonWriter writer(alone, 1);
  piece(writer);
  JsonWriter(joined).begin_array().text(alone).end_array();
  EXPECT_EQ(joined, whole);
}

}  // namespace
}  // namespace toile
