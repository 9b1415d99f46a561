# Thin: every target does its own set-up and hands over to CMake, ctest and the program.
#   make demo    bakes and measures the 300k rock; leaves pictures and a table in build/demo
#   make test    builds and tests; ends with ctest's summary
#   make bench   runs the benchmarks
JOBS ?= $(shell nproc)
LODESTONE := build/release/bin/lodestone

.PHONY: all demo test bench deps build clean
all: build

deps:
	@scripts/install-deps.sh

build: deps
	cmake --preset release
	cmake --build --preset release -j $(JOBS)

demo: build
	scripts/demo.sh

test: build
	ctest --preset release -j $(JOBS)

bench: build
	scripts/bench.sh

clean:
	rm -rf build
