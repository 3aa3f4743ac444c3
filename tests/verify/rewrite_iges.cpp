// rewrite_iges IN OUT: read, and write every known record from the model instead of replaying it.
#include <cstdio>
#include <exception>

#include "io/file.h"
#include "io/iges.h"

int main(int count, char** arguments) {
  if (count != 3) {
    std::fprintf(stderr, "usage: rewrite_iges IN OUT\n");
    return 2;
  }
  try {
    toile::write_file(arguments[2], toile::format_iges(toile::read_iges(arguments[1]), toile::IgesMode::rewrite));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
