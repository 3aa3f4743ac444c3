// SPDX-License-Identifier: GPL-3.0-or-later
// Energies by name.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <string_view>

namespace toile {

// A few energies [J], each with the name that reports give it, in the order in which they came. Names are literals:
// they are kept by address. Allocates nothing.
class EnergyParts {
 public:
  static constexpr std::size_t capacity = 12;
  struct Part {
    const char* name = "";
    double value = 0;
  };

  // A name that is not there yet makes a new part.
  void add(const char* name, double value) { part(name) += value; }
  void set(const char* name, double value) { part(name) = value; }
  double of(std::string_view name) const {  // 0 where there is no such part
    for (const Part& part : *this)
      if (part.name == name) return part.value;
    return 0;
  }
  double total() const {
    double sum = 0;
    for (const Part& part : *this) sum += part.value;
    return sum;
  }
  std::size_t size() const { return count_; }
  const Part* begin() const { return parts_.data(); }
  const Part* end() const { return parts_.data() + count_; }

 private:
  double& part(std::string_view name) {
    for (std::size_t k = 0; k < count_; ++k)
      if (parts_[k].name == name) return parts_[k].value;
    assert(count_ < parts_.size());
    parts_[count_].name = name.data();
    return parts_[count_++].value;
  }

  std::array<Part, capacity> parts_;
  std::size_t count_ = 0;
};

}  // namespace toile
