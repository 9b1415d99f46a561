# Thin: every target does its own set-up and hands over to CMake, ctest and the program.
#   make demo    bakes and measures the 300k rock and landscape; leaves reports and pictures in build/demo
#   make test    builds and tests; ends with ctest's summary
#   make bench   runs the benchmarks
#   make reference  the pages of the public headers: build/release/reference/html/index.html
#   make view    the interactive demo, on the demonstration's rock; SCENE=... for another
JOBS ?= $(shell nproc)
LODESTONE := build/release/bin/lodestone

.PHONY: all demo test bench reference view deps build clean
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

reference: deps
	cmake --preset release
	cmake --build --preset release --target reference

SCENE ?= assets/rock.scene.json
view: build
	$(LODESTONE) view $(SCENE)

clean:
	rm -rf build
