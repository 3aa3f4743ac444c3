#include "pipeline/program/program.h"

int main(int argc, char** argv) {
  return toile::run_program(argc, argv);
}
