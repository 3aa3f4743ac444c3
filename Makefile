# Everything a newcomer needs; each target installs what it lacks.
#   make demo     build, drape a real panel file, say where the results are
#   make test     build with warnings as errors, run all tests
#   make bench    benchmarks: speed as ratios and as cost against size
#   make verify   read what we write with OpenCASCADE and compare; trace hard trims against exact arithmetic; count what
#                 unused features cost
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
	@echo
	@echo "Open out/skirt_panel/draped.igs in FreeCAD, out/skirt_panel/frames/skirt_panel.pvd in ParaView,"
	@echo "or look at out/skirt_panel/preview.png."

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

format:
	.ci/install format
	git ls-files '*.h' '*.cpp' | xargs clang-format -i

install: all
	cmake --install build/native --prefix $(PREFIX)

clean:
	rm -rf build out
