// SPDX-License-Identifier: GPL-3.0-or-later
// A ParaView collection (.pvd): files and their times.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace toile {

// (1) Whoever opens PATH, at any time, finds a whole collection: of the frames before an append or of those after it
//     (and has until the next append but one to read it);
// (2) an append writes two lines, however many there are already. The next collection grows in a hidden file beside
//     PATH and then takes its name, while the former one becomes the hidden file, one line behind. (Where the file
//     system knows no hard links, an append copies the file.)
// A failed append throws OutputError and leaves the collection as it was.
class PvdIndex {
 public:
  struct Entry {
    double time = 0;  // s
    std::string file;
  };
  // `entries`: of a former run; PATH isn't touched before the first append, which lists them too.
  explicit PvdIndex(std::filesystem::path path, std::vector<Entry> entries = {});
  ~PvdIndex();
  PvdIndex(const PvdIndex&) = delete;
  PvdIndex& operator=(const PvdIndex&) = delete;

  void append(const Entry& entry);

 private:
  void prepare_next();
  void exchange();

  std::filesystem::path path_, next_, last_;
  std::string pending_;   // lines that the hidden file lacks
  bool written_ = false;  // PATH is ours
  bool ready_ = false;    // the hidden file is a collection that lacks `pending_` alone
};

}  // namespace toile
