// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/pvd_index.h"

#include <fstream>
#include <string_view>
#include <system_error>

#include "geometry/error.h"
#include "geometry/text.h"
#include "io/file.h"
#include "io/xml_text.h"

namespace toile {

namespace {

constexpr std::string_view head =
    "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\" "
    "header_type=\"UInt64\">\n<Collection>\n";
constexpr std::string_view foot = "</Collection>\n</VTKFile>\n";

std::string line(const PvdIndex::Entry& entry) {
  return "<DataSet timestep=\"" + text(entry.time) + "\" part=\"0\" file=\"" + xml_text(entry.file) + "\"/>\n";
}

std::filesystem::path beside(const std::filesystem::path& path, const char* what) {
  std::string name(".");
  name += path.filename().string();
  name += what;
  return path.parent_path() / name;
}

// Puts `lines` before the foot of a collection. Closing tells whether everything arrived.
bool insert_lines(const std::filesystem::path& file, std::string_view lines) {
  std::fstream out(file, std::ios::in | std::ios::out | std::ios::binary);
  out.seekp(-static_cast<std::streamoff>(foot.size()), std::ios::end);
  out << std::string(lines) + std::string(foot);
  out.close();
  return !out.fail();
}

}  // namespace

PvdIndex::PvdIndex(std::filesystem::path path, std::vector<Entry> entries)
    : path_(std::move(path)), next_(beside(path_, ".next")), last_(beside(path_, ".last")) {
  for (const Entry& entry : entries) pending_ += line(entry);
}

PvdIndex::~PvdIndex() {
  std::error_code ignored;
  std::filesystem::remove(next_, ignored);
  std::filesystem::remove(last_, ignored);
}

void PvdIndex::prepare_next() {
  if (ready_) return;
  std::error_code error;
  if (written_) {
    std::filesystem::copy_file(path_, next_, std::filesystem::copy_options::overwrite_existing, error);
    if (error) throw OutputError(next_.string() + ": " + error.message());
  } else {
    write_file(next_, std::string(head) + std::string(foot), Flush::no);
  }
  ready_ = true;
}

// The hidden file becomes the collection, the collection the hidden file.
void PvdIndex::exchange() {
  std::error_code no_link, error;
  std::filesystem::remove(last_, error);
  if (written_) std::filesystem::create_hard_link(path_, last_, no_link);
  const bool kept = written_ && !no_link;
  std::filesystem::rename(next_, path_, error);
  if (error) throw OutputError(path_.string() + ": " + error.message());
  ready_ = false;
  if (!kept) return;
  std::filesystem::rename(last_, next_, error);
  ready_ = !error;
}

void PvdIndex::append(const Entry& entry) {
  const std::string added = line(entry);
  prepare_next();
  const bool inserted = insert_lines(next_, pending_ + added);
  if (!inserted) ready_ = false;
  if (!inserted) throw OutputError(next_.string() + ": can't be written");
  exchange();
  written_ = true;
  // A hidden file that has to be made anew starts as a copy.
  pending_ = ready_ ? added : std::string();
}

}  // namespace toile
