# SPDX-License-Identifier: GPL-3.0-or-later
# Everything a newcomer needs; each target installs what it lacks.
#   make demo     build, drape a real panel file, say where the results are
#   make test     build with warnings as errors, run all tests
#   make bench    benchmarks: speed as ratios and as cost against size
#   make verify   read what we write with OpenCASCADE, FreeCAD, ParaView and Blender and compare; trace hard trims
#                 against exact arithmetic; count what unused features cost; run what reads files under the address and
#                 undefined-behaviour sanitizers
#   make format   clang-format on all sources
#   make install  to PREFIX (default /usr/local)
PREFIX ?= /usr/local
JOBS ?= $(shell nproc)
TOILE = build/native/pipeline/toile

.PHONY: all demo test bench verify format install clean

all: build/native/build.ninja
	cmake --build --preset native -j $(JOBS) --target toile

build/%/build.ninja:
	.ci/install build $(if $(filter bench,$*),bench) $(if $(filter verify,$*),verify) test
	cmake --preset $*

demo: all
	$(TOILE) drape samples/skirt_panel/scene.toml --overwrite

test: build/native/build.ninja
	cmake --build --preset native -j $(JOBS)
	ctest --preset native -j $(JOBS)

bench: build/bench/build.ninja
	cmake --build --preset bench -j $(JOBS)
	tests/bench/run build/bench

verify: build/verify/build.ninja
	cmake --build --preset verify -j $(JOBS)
	tests/verify/run build/verify
	cmake --preset callgrind
	cmake --build --preset callgrind -j $(JOBS) --target toile
	tests/verify/instructions build/callgrind/pipeline/toile
	cmake --preset asan
	cmake --build --preset asan -j $(JOBS) --target test_geometry test_trimming test_io
	ctest --preset asan -j $(JOBS) -L 'geometry|trimming|io'

format:
	.ci/install format
	git ls-files '*.h' '*.cpp' | xargs clang-format -i

# For any machine of its kind: without the instructions that only this one may have.
install: build/release/build.ninja
	cmake --build --preset release -j $(JOBS) --target toile
	cmake --install build/release --prefix $(PREFIX)

clean:
	rm -rf build out
