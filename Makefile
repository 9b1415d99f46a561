# Thin: every target does its own set-up and hands over to CMake, ctest and the program.
#   make demo    bakes and measures the 300k rock and landscape; leaves reports and pictures in build/demo
#   make test    builds and tests; ends with ctest's summary
#   make bench   runs the benchmarks
#   make fuzz    runs each driver of fuzz/ for FUZZ_SECONDS (60); needs clang
#   make view    the interactive demo, on the demonstration's rock; SCENE=... for another
JOBS ?= $(shell nproc)
LODESTONE := build/release/bin/lodestone

.PHONY: all demo test bench fuzz view deps build clean
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

fuzz: deps
	JOBS=$(JOBS) FUZZ_SECONDS=$(or $(FUZZ_SECONDS),60) scripts/fuzz.sh

SCENE ?= assets/rock.scene.json
view: build
	$(LODESTONE) view $(SCENE)

clean:
	rm -rf build
