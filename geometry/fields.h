// SPDX-License-Identifier: GPL-3.0-or-later
// What of a struct a checkpoint keeps, declared beside it: written and read by one function
//   void fields(auto& archive, Like<MyStruct> auto& s) { archive(s.first, s.second); }
// An archive takes numbers, strings, Eigen vectors, lists, and structs that have such a function.
#pragma once

#include <concepts>
#include <type_traits>

namespace toile {

template <class T, class U>
concept Like = std::same_as<std::remove_const_t<T>, U>;

}  // namespace toile
