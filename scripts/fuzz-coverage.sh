#!/usr/bin/env bash
# How much of the readers and of the opening of assets the inputs of fuzz/ reach: builds the drivers with counters (preset coverage),
# runs each over its seeds, what tests keep of it (tests/mesh/io/found) and the corpus that scripts/fuzz.sh has grown, if there is
# one, and prints lines by file. With FUZZ_COVERAGE=seeds without the corpus. docs/robustness.md has the figures.
set -euo pipefail
cd "$(dirname "$0")/.."
jobs=${JOBS:-$(nproc)}
llvm=$(dirname "$(readlink -f "$(command -v clang++)")")
out=build/coverage/profiles
cmake --preset coverage >/dev/null
cmake --build --preset coverage -j "$jobs" --target fuzz_drivers
rm -rf "$out" && mkdir -p "$out"
LLVM_PROFILE_FILE=$out/make_seeds.profraw build/coverage/bin/make_seeds build/fuzz/seeds
cp assets/*.json build/fuzz/seeds/scene/
rm "$out/make_seeds.profraw"

# One driver, by its name, over what there is, each input once.
reach() {
  local name=$1 folders=()
  mkdir -p "build/fuzz/seeds/$name"  # not all begin with some
  folders+=("build/fuzz/seeds/$name")
  if [ -z "${FUZZ_COVERAGE:-}" ] && [ -d "build/fuzz/corpus/$name" ]; then folders+=("build/fuzz/corpus/$name"); fi
  if [ "$name" = gltf ]; then folders+=(tests/mesh/io/found); fi
  LLVM_PROFILE_FILE=$out/$name.profraw "build/coverage/bin/fuzz_$name" -runs=0 "${folders[@]}" >"$out/$name.log" 2>&1 ||
    { echo "fuzz_$name: FAILED" && tail -n 30 "$out/$name.log" && return 1; }
}
export -f reach
export out FUZZ_COVERAGE

drivers=(build/coverage/bin/fuzz_*)
printf "%s\n" "${drivers[@]##*/fuzz_}" | xargs -P "$jobs" -I{} bash -c 'reach {}'
objects=("${drivers[0]}")
for driver in "${drivers[@]:1}"; do objects+=(-object "$driver"); done
"$llvm/llvm-profdata" merge -o "$out/all.profdata" "$out"/*.profraw

# Lines of a set of files, each and all together.
told() {
  echo "$1"
  shift
  "$llvm/llvm-cov" report "${objects[@]}" -instr-profile="$out/all.profdata" "$@" |
    awk '/^(src|apps|TOTAL)|\.(cpp|h) /{printf "%7d of %5d  %s  %s\n", $8 - $9, $8, $10, $1}'
}
mapfile -t readers < <(find src/mesh/io -name '*.cpp' ! -name 'write*.cpp' ! -name material_json.cpp | sort)
told "Readers: lines reached" "${readers[@]}"
told "Opening of assets: lines reached" src/base/files/chunk_file.cpp src/lod/asset/{keyframe_blocks,order_arrays,progressive_mesh,split_coder,split_mesh,stored_mesh}.cpp \
  src/vgi/asset/{atlas_chunks,corners,error_codes,leaves,pages}.cpp src/vgi/asset/codec/*.cpp
