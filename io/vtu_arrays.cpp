// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/vtu_arrays.h"

#include <zlib.h>

#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <new>

#include "geometry/error.h"

namespace toile {
namespace {

static_assert(std::endian::native == std::endian::little, "VTU files are written as little endian");

std::string deflated(std::string_view part, int level) {
  uLongf size = compressBound(part.size());
  std::string out(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(part.data()), part.size(),
                level) != Z_OK)
    throw std::bad_alloc();  // the one reason left: the output fits and the level exists
  out.resize(size);
  return out;
}

// Appends `bytes` as VTK wants compressed data: the number of blocks, the size of a block and of a last shorter one
// (0: none), the compressed sizes, then a zlib stream a block. A block whose first bytes hardly shrink, such as most
// numbers that were computed, is stored: deflating it would cost its time and save nothing.
// [VTK file formats, "compressed appended data"]
void append_compressed(std::string& to, std::string_view bytes) {
  constexpr std::size_t block = std::size_t{1} << 16, probe = std::size_t{1} << 12;
  std::vector<std::uint64_t> head{(bytes.size() + block - 1) / block, block, bytes.size() % block};
  std::string body;
  for (std::size_t first = 0; first < bytes.size(); first += block) {
    const std::string_view part = bytes.substr(first, block), start = part.substr(0, probe);
    const bool shrinks = deflated(start, Z_BEST_SPEED).size() < start.size() - start.size() / 8;
    const std::string packed = deflated(part, shrinks ? Z_BEST_SPEED : Z_NO_COMPRESSION);
    head.push_back(packed.size());
    body += packed;
  }
  to.append(reinterpret_cast<const char*>(head.data()), head.size() * sizeof head[0]).append(body);
}

// The inverse: the array at the start of `data`.
std::string uncompressed(std::string_view data, const std::string& name) {
  const auto cut_short = [&] { return InputError("array " + name + " is cut short"); };
  const auto take = [&](std::uint64_t length) {
    if (length > data.size()) throw cut_short();
    const std::string_view out = data.substr(0, length);
    data.remove_prefix(length);
    return out;
  };
  const auto word = [&] {
    std::uint64_t value = 0;
    std::memcpy(&value, take(sizeof value).data(), sizeof value);
    return value;
  };
  const std::uint64_t blocks = word(), size = word(), last = word();
  if (blocks > data.size() / sizeof(std::uint64_t)) throw cut_short();
  std::vector<std::uint64_t> packed(blocks);
  for (std::uint64_t& length : packed) length = word();
  std::string out;
  for (std::uint64_t k = 0; k < blocks; ++k) {
    const std::string_view stream = take(packed[k]);
    const std::uint64_t expected = k + 1 == blocks && last > 0 ? last : size;
    // zlib shrinks at most 1032 times: a size beyond that is damage, not a reason to ask for memory.
    if (expected / 1100 > stream.size()) throw InputError("array " + name + " is damaged");
    std::string block(expected, '\0');
    uLongf length = block.size();
    if (uncompress(reinterpret_cast<Bytef*>(block.data()), &length, reinterpret_cast<const Bytef*>(stream.data()),
                   stream.size()) != Z_OK ||
        length != block.size())
      throw InputError("array " + name + " is damaged");
    out += block;
  }
  return out;
}

// The value of an attribute of a tag; empty where it has none.
std::string attribute(std::string_view tag, std::string_view name) {
  std::string key(" ");
  key.append(name).append("=\"");
  const std::size_t at = tag.find(key);
  if (at == std::string_view::npos) return "";
  const std::size_t from = at + key.size();
  return std::string(tag.substr(from, tag.find('"', from) - from));
}

std::uint64_t whole_number(const std::string& text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) throw InputError("'" + text + "' is no whole number");
  return value;
}

}  // namespace

void append_vtu_array(std::string& head, std::string& body, const char* type, const std::string& name, int components,
                      std::string_view bytes) {
  head += std::string("<DataArray type=\"") + type + "\" Name=\"" + name + "\" NumberOfComponents=\"" +
          std::to_string(components) + "\" format=\"appended\" offset=\"" + std::to_string(body.size()) + "\"/>\n";
  append_compressed(body, bytes);
}

std::vector<VtuArray> read_vtu_arrays(std::string_view file) {
  const std::size_t mark = file.find(vtu_data_mark);
  if (mark == std::string_view::npos || file.substr(0, mark).find(vtu_storage) == std::string_view::npos)
    throw InputError("no VTU file with appended, compressed arrays");
  const std::string_view head = file.substr(0, mark), data = file.substr(mark + vtu_data_mark.size());
  std::vector<VtuArray> arrays;
  for (std::size_t at = 0; (at = head.find("<DataArray", at)) != std::string_view::npos; ++at) {
    const std::string_view tag = head.substr(at, head.find('>', at) - at);
    if (attribute(tag, "format") != "appended") continue;
    VtuArray array{attribute(tag, "Name"), attribute(tag, "type"), 1, ""};
    array.components = static_cast<int>(whole_number(attribute(tag, "NumberOfComponents")));
    const std::uint64_t offset = whole_number(attribute(tag, "offset"));
    if (offset > data.size()) throw InputError("array " + array.name + " is cut short");
    array.bytes = uncompressed(data.substr(offset), array.name);
    arrays.push_back(std::move(array));
  }
  return arrays;
}

}  // namespace toile
