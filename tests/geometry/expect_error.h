// SPDX-License-Identifier: GPL-3.0-or-later
// One check for errors that must say what is wrong.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "geometry/error.h"

namespace toile::test {

// The call throws GeometryError and its message contains every one of the words.
template <class Call, class... Words>
void expect_geometry_error(Call&& call, Words... words) {
  try {
    call();
    ADD_FAILURE() << "nothing was thrown";
  } catch (const GeometryError& error) {
    const std::string message = error.what();
    for (const std::string& word : {std::string(words)...})
      EXPECT_NE(message.find(word), std::string::npos) << '"' << message << "\" doesn't say \"" << word << '"';
  }
}

}  // namespace toile::test
