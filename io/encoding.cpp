// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/encoding.h"

#include <iconv.h>

#include <algorithm>
#include <array>
#include <cctype>

namespace toile {

namespace {

std::string from_latin1(std::string_view text) {
  std::string out;
  for (const char letter : text) {
    const auto c = static_cast<unsigned char>(letter);
    if (c < 0x80) {
      out += letter;
    } else {
      out += static_cast<char>(0xc0u | (c >> 6));
      out += static_cast<char>(0x80u | (c & 0x3fu));
    }
  }
  return out;
}

// Empty where the system doesn't know the code page or the text isn't of it.
std::string converted(std::string text, const std::string& codepage) {
  const iconv_t converter = iconv_open("UTF-8", codepage.c_str());
  if (converter == reinterpret_cast<iconv_t>(-1)) return {};
  std::string out(4 * text.size() + 4, '\0');
  char *from = text.data(), *to = out.data();
  std::size_t left = text.size(), room = out.size();
  const bool whole = iconv(converter, &from, &left, &to, &room) != static_cast<std::size_t>(-1) && left == 0;
  iconv_close(converter);
  out.resize(out.size() - room);
  return whole ? out : std::string();
}

}  // namespace

bool valid_utf8(std::string_view text) {
  const auto byte = [&](std::size_t k) { return k < text.size() ? static_cast<unsigned char>(text[k]) : 0u; };
  for (std::size_t k = 0; k < text.size();) {
    const unsigned lead = byte(k);
    const std::size_t length = lead < 0x80                   ? 1
                               : lead >= 0xc2 && lead < 0xe0 ? 2
                               : lead >= 0xe0 && lead < 0xf0 ? 3
                               : lead >= 0xf0 && lead < 0xf5 ? 4
                                                             : 0;
    if (length == 0) return false;
    for (std::size_t i = 1; i < length; ++i)
      if ((byte(k + i) & 0xc0u) != 0x80u) return false;
    // Overlong forms, surrogates and numbers beyond the last.
    const unsigned second = byte(k + 1);
    if ((lead == 0xe0 && second < 0xa0) || (lead == 0xed && second > 0x9f) || (lead == 0xf0 && second < 0x90) ||
        (lead == 0xf4 && second > 0x8f))
      return false;
    k += length;
  }
  return true;
}

std::string to_utf8(const std::string& text, const std::string& codepage) {
  return valid_utf8(text) ? text : from_codepage(text, codepage);
}

std::string from_codepage(const std::string& text, const std::string& codepage) {
  if (!codepage.empty()) {
    std::string out = converted(text, codepage);
    if (!out.empty()) return out;
  }
  return valid_utf8(text) ? text : from_latin1(text);
}

bool several_bytes(std::string_view codepage) {
  constexpr std::array<std::string_view, 8> names{"CP932", "CP949", "CP950",   "CP1361",
                                                  "BIG5",  "JOHAB", "GB18030", "EUC-JP"};
  return std::ranges::find(names, codepage) != names.end();
}

std::string codepage_of_dxf(std::string_view name) {
  std::string word;
  for (const char c : name) word += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const std::string_view prefix : {"ansi_", "dos", "cp", "windows-"}) {
    if (!word.starts_with(prefix)) continue;
    const std::string number = word.substr(prefix.size());
    const bool digits = !number.empty() && std::ranges::all_of(number, [](unsigned char c) { return std::isdigit(c); });
    if (number == "936" || number == "54936") return "GB18030";  // holds all of the older GBK
    return digits ? "CP" + number : std::string();
  }
  if (word.starts_with("iso8859-")) return "ISO-" + word.substr(3);
  constexpr std::array<std::pair<std::string_view, std::string_view>, 5> others{
      {{"big5", "BIG5"}, {"gb2312", "GB18030"}, {"ksc5601", "CP949"}, {"johab", "JOHAB"}, {"mac-roman", "MACINTOSH"}}};
  for (const auto& [dxf, iconv_name] : others)
    if (word == dxf) return std::string(iconv_name);
  return {};
}

}  // namespace toile
