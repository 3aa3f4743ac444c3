// SPDX-License-Identifier: GPL-3.0-or-later
// Text of files that don't say how it is encoded, or say it in old ways.
#pragma once

#include <string>
#include <string_view>

namespace toile {

bool valid_utf8(std::string_view text);

// UTF-8 stays as it is, whatever the code page says: newer files are written so. Other text is read in the code page,
// an iconv name such as "CP1252", else as Latin-1, in which every byte is a letter.
std::string to_utf8(const std::string& text, const std::string& codepage = {});

// Text that is surely of this code page. Where it isn't, as above.
std::string from_codepage(const std::string& text, const std::string& codepage);

// Letters of Chinese, Japanese and Korean code pages take two bytes, which may be UTF-8 by chance: whether a file is of
// its code page or UTF-8 is decided by all of its text.
bool several_bytes(std::string_view codepage);

// The iconv name of a DXF file's $DWGCODEPAGE: "ANSI_1252" is CP1252, "dos850" CP850, "iso8859-1" ISO8859-1; empty
// where it isn't known.
std::string codepage_of_dxf(std::string_view name);

}  // namespace toile
