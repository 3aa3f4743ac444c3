// SPDX-License-Identifier: GPL-3.0-or-later
// Arrays of VTU files: packed, read back, damaged.
#include "io/vtu_arrays.h"

#include <gtest/gtest.h>

#include <random>

#include "geometry/error.h"

namespace toile {
namespace {

std::string file_of(const std::vector<VtuArray>& arrays) {
  std::string head = "<VTKFile type=\"UnstructuredGrid\" " + std::string(vtu_storage) + ">\n", body;
  for (const VtuArray& a : arrays) append_vtu_array(head, body, a.type.c_str(), a.name, a.components, a.bytes);
  return head + std::string(vtu_data_mark) + body + "\n</AppendedData>\n</VTKFile>\n";
}

// Nothing, less than a block of 64 KiB, whole blocks and a rest; bytes that shrink and bytes that don't.
std::vector<VtuArray> arrays() {
  std::mt19937 random(7);
  std::string noise(200000, '\0'), steps(2 << 16, '\0');
  for (char& c : noise) c = static_cast<char>(random());
  for (std::size_t k = 0; k < steps.size(); ++k) steps[k] = static_cast<char>(k / 1000);
  return {{"noise", "Float64", 1, noise},
          {"steps", "Int32", 2, steps},
          {"none", "Float32", 3, ""},
          {"few", "UInt8", 1, "\x01\x02"}};
}

TEST(VtuArrays, WhatIsPackedIsReadBack) {
  const std::vector<VtuArray> packed = arrays(), read = read_vtu_arrays(file_of(packed));
  ASSERT_EQ(read.size(), packed.size());
  for (std::size_t k = 0; k < packed.size(); ++k) {
    EXPECT_EQ(read[k].name, packed[k].name);
    EXPECT_EQ(read[k].type, packed[k].type);
    EXPECT_EQ(read[k].components, packed[k].components);
    EXPECT_EQ(read[k].bytes, packed[k].bytes) << packed[k].name;
  }
}

TEST(VtuArrays, AFileCutAnywhereIsAnError) {
  const std::string file = file_of(arrays());
  const std::size_t end = file.find("\n</AppendedData>");
  std::mt19937 random(8);
  for (int k = 0; k < 200; ++k) {
    const std::size_t length = random() % end;
    EXPECT_THROW(read_vtu_arrays(file.substr(0, length)), InputError) << length << " of " << end;
  }
}

TEST(VtuArrays, DamageAsksForNoMemoryAndOverrunsNothing) {
  const std::string file = file_of(arrays());
  const std::size_t data = file.find(vtu_data_mark) + vtu_data_mark.size();
  std::mt19937 random(9);
  int refused = 0;
  for (int k = 0; k < 300; ++k) {
    std::string damaged = file;
    // The sizes of the first array and the start of its first stream.
    damaged[data + random() % 64] = static_cast<char>(random());
    try {
      read_vtu_arrays(damaged);
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 200);
}

TEST(VtuArrays, OtherStorageIsRefused) {
  EXPECT_THROW(read_vtu_arrays("<VTKFile><DataArray format=\"ascii\">1</DataArray></VTKFile>"), InputError);
  std::string other = file_of(arrays());
  other.replace(other.find("vtkZLib"), 7, "vtkLZ4D");
  EXPECT_THROW(read_vtu_arrays(other), InputError);
}

}  // namespace
}  // namespace toile
