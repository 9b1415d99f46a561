#!/usr/bin/env bash
# Builds the drivers of fuzz/ (preset check) and runs each for FUZZ_SECONDS (60 unless given), or those that are named:
# scripts/fuzz.sh gltf ply. Corpora grow in build/fuzz/corpus; an input that breaks a promise is left in build/fuzz/found, and the
# exit code is then 1. FUZZ_RUNS, where given, ends a driver after so many inputs.
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=${FUZZ_SECONDS:-60}
jobs=${JOBS:-$(nproc)}
cmake --preset check >/dev/null
cmake --build --preset check -j "$jobs" --target fuzz_drivers
mkdir -p build/fuzz/found
build/check/bin/make_seeds build/fuzz/seeds
cp assets/*.json build/fuzz/seeds/scene/

# One driver, by its name.
run_driver() {
  local name=$1
  mkdir -p "build/fuzz/corpus/$name" "build/fuzz/seeds/$name"  # not all begin with some
  if ASAN_OPTIONS=allocator_may_return_null=0:detect_leaks=1 UBSAN_OPTIONS=print_stacktrace=1 \
    "build/check/bin/fuzz_$name" -max_total_time="$seconds" -runs="${FUZZ_RUNS:--1}" -rss_limit_mb=2048 -timeout=20 -max_len=65536 \
    -print_final_stats=1 -artifact_prefix="build/fuzz/found/$name-" "build/fuzz/corpus/$name" "build/fuzz/seeds/$name" \
    >"build/fuzz/$name.log" 2>&1; then
    echo "fuzz_$name: ${seconds} s, $(sed -n 's/^stat::number_of_executed_units: *//p' "build/fuzz/$name.log") inputs"
  else
    echo "fuzz_$name: FAILED"
    tail -n 30 "build/fuzz/$name.log"
    return 1
  fi
}
export -f run_driver
export seconds

names=("$@")
if [ ${#names[@]} -eq 0 ]; then
  for driver in build/check/bin/fuzz_*; do names+=("${driver##*/fuzz_}"); done
fi
# xargs ends with 123 where a driver failed, after all have run.
printf "%s\n" "${names[@]}" | xargs -P "$jobs" -I{} bash -c 'run_driver {}' || exit 1
