// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/base/console.h"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>

namespace toile {

void Console::detect(const std::string& colour_mode) {
  terminal = isatty(STDERR_FILENO) != 0;
  const char* no_colour = std::getenv("NO_COLOR");
  colour = terminal && colour_mode != "never" && !(no_colour && *no_colour);
}

void Console::error(const std::string& text) {
  start_line();
  std::fprintf(stderr, "%serror:%s %s\n", colour ? "\x1b[1;31m" : "", colour ? "\x1b[0m" : "", text.c_str());
}

void Console::warning(const std::string& text) {
  if (quiet) return;
  start_line();
  std::fprintf(stderr, "%swarning:%s %s\n", colour ? "\x1b[33m" : "", colour ? "\x1b[0m" : "", text.c_str());
}

void Console::note(const std::string& text) {
  if (quiet) return;
  start_line();
  std::fprintf(stderr, "%s\n", text.c_str());
}

void Console::detail(const std::string& text) {
  if (verbose) note(text);
}

void Console::live(const std::string& text) {
  if (quiet || !progress) return;
  using namespace std::chrono;
  const auto now = steady_clock::now();
  if (now - last_ < (terminal ? milliseconds(100) : milliseconds(10000))) return;
  last_ = now;
  if (terminal) {
    std::fprintf(stderr, "\r\x1b[K%s", text.c_str());
    std::fflush(stderr);
    live_ = true;
  } else {
    std::fprintf(stderr, "%s\n", text.c_str());
  }
}

// Standard output may be the same terminal or pipe: what was printed there comes first.
void Console::start_line() {
  std::fflush(stdout);
  end_live();
}

void Console::end_live() {
  if (!live_) return;
  std::fprintf(stderr, "\r\x1b[K");
  live_ = false;
}

}  // namespace toile
