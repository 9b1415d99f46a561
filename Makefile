# Thin: every target does its own set-up and hands over to CMake, ctest and the program.
#   make demo    bakes and measures the 300k rock and landscape; leaves reports and pictures in build/demo
#   make test    builds and tests; ends with ctest's summary
#   make test-long  as test, with the tests that take long
#   make test-slurm  installs Slurm and bakes a library over a cluster of virtual nodes, some of which are killed
#   make packages       the Debian packages: build/packages/*.deb
#   make test-packages  installs them on a clean Debian 12, made by debootstrap as root, and tries each there
#   make test-viewers  draws tiles in CesiumJS and 3DTilesRendererJS, by a headless Chromium; needs chromium, node and npm
#   make check   clang with address and undefined-behaviour sanitizers, the tests labelled fast in it, each driver of fuzz/ for some
#                seconds, and clang-tidy
#   make bench   runs the benchmarks and writes docs/figures.md
#   make reference  the pages of the public headers: build/release/reference/html/index.html
#   make fuzz    runs each driver of fuzz/ for FUZZ_SECONDS (60); needs clang
#   make fuzz-coverage  how many lines of the readers the inputs of those drivers reach
#   make soak    draws SOAK_FRAMES (10000) frames that change at random, with sanitizers
#   make view    the interactive demo, on the demonstration's rock; SCENE=... for another
JOBS ?= $(shell nproc)
LODESTONE := build/release/bin/lodestone

.PHONY: all program demo test test-long test-slurm test-viewers packages test-packages check bench fuzz fuzz-coverage soak reference view deps build clean
all: build

deps:
	@scripts/install-deps.sh

build: deps
	cmake --preset release
	cmake --build --preset release -j $(JOBS)

program: deps
	cmake --preset release
	cmake --build --preset release -j $(JOBS) --target lodestone

demo: program
	scripts/demo.sh

test: build
	@scripts/install-npm-checks.sh
	ctest --preset release -j $(JOBS) -LE "long|slurm|slow"

test-long: build
	ctest --preset release -j $(JOBS)

test-slurm: program
	@scripts/install-deps.sh --slurm
	tests/slurm/library_test.sh $(CURDIR)/$(LODESTONE) $(CURDIR)

packages: build
	cpack --config build/release/CPackConfig.cmake -B build/packages

test-packages: packages
	tests/packages/try.sh build/packages examples

test-viewers: program
	ctest --preset release -L slow

check:
	@scripts/install-deps.sh --checks
	cmake --preset check
	cmake --build --preset check -j $(JOBS) --target fast_tests fuzz_drivers
	@scripts/install-npm-checks.sh
	ctest --preset check -j $(JOBS)
	FUZZ_SECONDS=4 scripts/fuzz.sh
	scripts/tidy.sh

bench: build
	scripts/figures.py measure
	scripts/figures.py write

reference: deps
	cmake --preset release
	cmake --build --preset release --target reference

fuzz:
	@scripts/install-deps.sh --checks
	JOBS=$(JOBS) FUZZ_SECONDS=$(or $(FUZZ_SECONDS),60) scripts/fuzz.sh

fuzz-coverage:
	@scripts/install-deps.sh --checks
	JOBS=$(JOBS) scripts/fuzz-coverage.sh

soak:
	@scripts/install-deps.sh --checks
	JOBS=$(JOBS) scripts/soak.sh

SCENE ?= assets/rock.scene.json
view: program
	$(LODESTONE) view $(SCENE)

clean:
	rm -rf build
