// SPDX-License-Identifier: GPL-3.0-or-later
#include "support/allocation_count.h"

#include <cstddef>
#include <cstdlib>

// Sanitizers bring a heap of their own; clang says so by __has_feature.
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define TOILE_OWN_HEAP
#endif
#endif

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && !defined(TOILE_OWN_HEAP)

namespace {
thread_local long count = 0;
}

// glibc calls a program's own definitions of these everywhere, and keeps its own under other names.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t number, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  ++count;
  return __libc_malloc(size);
}
void* calloc(std::size_t number, std::size_t size) {
  ++count;
  return __libc_calloc(number, size);
}
void* realloc(void* old, std::size_t size) {
  ++count;
  return __libc_realloc(old, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++count;
  return __libc_memalign(alignment, size);
}
}

namespace toile::test {
std::optional<long> allocation_count() {
  return count;
}
}  // namespace toile::test

#else

namespace toile::test {
std::optional<long> allocation_count() {
  return std::nullopt;
}
}  // namespace toile::test

#endif
