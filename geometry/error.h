// SPDX-License-Identifier: GPL-3.0-or-later
// The kinds of failure that a caller can tell apart. The program maps each to an exit code (pipeline/base/README.md,
// "Exit codes").
#pragma once

#include <stdexcept>
#include <string>

namespace toile {

class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// An input file is missing, unreadable or says something impossible. The message starts with `file:line:` where known
// and names the entity or key and what was expected.
class InputError : public Error {
 public:
  using Error::Error;
};

// Readable numbers that make no valid geometry: names panel, loop and place.
class GeometryError : public Error {
 public:
  using Error::Error;
};

// The solver could not continue: says why, where and what to change.
class SolverError : public Error {
 public:
  using Error::Error;
};

// An output could not be written; what stood there before is unchanged.
class OutputError : public Error {
 public:
  using Error::Error;
};

}  // namespace toile
