// SPDX-License-Identifier: GPL-3.0-or-later
// Text of old files becomes UTF-8; what is UTF-8 stays.
#include "io/encoding.h"

#include <gtest/gtest.h>

namespace toile {
namespace {

TEST(Encoding, Utf8StaysWhateverTheCodePage) {
  for (const char* text : {"", "plain", "\u00c4rmel", "\u540e\u7247", "\U0001f9f5"}) {
    EXPECT_TRUE(valid_utf8(text));
    EXPECT_EQ(to_utf8(text, "CP1251"), text);
  }
}

TEST(Encoding, WhatIsNoUtf8IsReadInItsCodePage) {
  EXPECT_EQ(to_utf8("\xc4rmel"), "\u00c4rmel");
  EXPECT_EQ(to_utf8("\xd0\xf3\xea\xe0\xe2", "CP1251"), "\u0420\u0443\u043a\u0430\u0432");
  EXPECT_EQ(to_utf8("\xc4rmel", "no such page"), "\u00c4rmel");
  // Overlong forms, surrogates and numbers beyond the last are no UTF-8.
  for (const char* text : {"\xc0\x80", "\xe0\x80\x80", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xff", "\xc4"}) {
    EXPECT_FALSE(valid_utf8(text));
    EXPECT_TRUE(valid_utf8(to_utf8(text, "CP1252")));
  }
}

TEST(Encoding, CodePagesOfDxfHaveNames) {
  EXPECT_EQ(codepage_of_dxf("ANSI_1252"), "CP1252");
  EXPECT_EQ(codepage_of_dxf("dos850"), "CP850");
  EXPECT_EQ(codepage_of_dxf("iso8859-1"), "ISO-8859-1");
  // Every page that such files name is one that the system converts: its letters aren't Latin-1's.
  for (const char* page : {"ANSI_874",  "ANSI_932",  "ANSI_936",  "ANSI_949",  "ANSI_950",  "ANSI_1250", "ANSI_1251",
                           "ANSI_1253", "ANSI_1254", "ANSI_1256", "ANSI_1257", "ANSI_1258", "gb2312",    "big5",
                           "ksc5601",   "dos437",    "dos850",    "dos866",    "iso8859-5", "mac-roman"})
    EXPECT_NE(to_utf8("\xbb\xd0\xe3\xbd\xda\xe9\xd0\xd0", codepage_of_dxf(page)),
              to_utf8("\xbb\xd0\xe3\xbd\xda\xe9\xd0\xd0"))
        << page;
  EXPECT_EQ(codepage_of_dxf("ascii"), "");
  EXPECT_EQ(codepage_of_dxf("ANSI_"), "");
}

}  // namespace
}  // namespace toile
