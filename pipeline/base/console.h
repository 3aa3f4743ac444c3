// SPDX-License-Identifier: GPL-3.0-or-later
// Messages of the program: to stderr, coloured and live only on a terminal.
#pragma once

#include <chrono>
#include <string>

namespace toile {

class Console {
 public:
  bool quiet = false, verbose = false, progress = true;
  bool colour = false;    // messages in colour
  bool terminal = false;  // stderr is a terminal: progress is one live line; else a line every 10 s

  // Colour unless `never`, NO_COLOR or no terminal.
  void detect(const std::string& colour_mode);

  void error(const std::string& text);
  void warning(const std::string& text);
  void note(const std::string& text);    // not when quiet
  void detail(const std::string& text);  // only when verbose
  void live(const std::string& text);    // progress
  void end_live();

 private:
  void start_line();
  bool live_ = false;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace toile
