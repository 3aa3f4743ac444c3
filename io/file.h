// SPDX-License-Identifier: GPL-3.0-or-later
// Whole files in and out.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace toile {

// Throws InputError naming the file and the system's reason; refuses directories and files above `limit` bytes.
std::string read_file(const std::filesystem::path& path, std::uintmax_t limit = std::uintmax_t{4} << 30);

// Whether a file is on the disk before it takes its name. Without, it is whole whatever happens to the program, but a
// power cut in the next seconds may leave it empty; a flush costs some 5 ms, too much for each of a run's frames.
enum class Flush { yes, no };

// The file appears whole or not at all: written beside its place, flushed, renamed. Makes missing parent folders.
// Throws OutputError.
void write_file(const std::filesystem::path& path, std::string_view bytes, Flush flush = Flush::yes);

// Throws OutputError ("...; give --overwrite to replace it") where a file stands at `path` and `overwrite` is false.
void require_free(const std::filesystem::path& path, bool overwrite);

}  // namespace toile
