// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipeline/program/program.h"

int main(int argc, char** argv) {
  return toile::run_program(argc, argv);
}
