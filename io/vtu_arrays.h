// SPDX-License-Identifier: GPL-3.0-or-later
// The arrays of a VTU file, appended and compressed: what the writer packs and the reader unpacks.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace toile {

// How the arrays are stored: attributes of <VTKFile>, and what stands between the XML and the first array.
inline constexpr std::string_view vtu_storage =
    "byte_order=\"LittleEndian\" header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\"";
inline constexpr std::string_view vtu_data_mark = "<AppendedData encoding=\"raw\">\n_";

struct VtuArray {
  std::string name, type;  // type: Float64, Float32, Int32 or UInt8
  int components = 1;
  std::string bytes;  // little endian
};

// Appends the <DataArray> of an array to `head` and its data to `body`, which follows the mark.
void append_vtu_array(std::string& head, std::string& body, const char* type, const std::string& name, int components,
                      std::string_view bytes);

// Every appended array, in the order of the file. Throws InputError where the file isn't stored as above, or an array
// runs out of the file or doesn't unpack; the message names the array, not the file.
std::vector<VtuArray> read_vtu_arrays(std::string_view file);

}  // namespace toile
