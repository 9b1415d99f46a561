#!/usr/bin/env bash
# Draws SOAK_FRAMES (10000) frames that change at random by SOAK_SEED (1), with address and undefined-behaviour sanitizers and then
# with the thread sanitizer: tests/soak. Leaks of ours are errors; those of drivers are left out by the name of their library.
set -euo pipefail
cd "$(dirname "$0")/.."
export LODESTONE_SOAK=${SOAK_FRAMES:-10000} LODESTONE_SOAK_SEED=${SOAK_SEED:-1}
# lavapipe frees much in every frame: the quarantine is kept small.
export ASAN_OPTIONS="quarantine_size_mb=16:thread_local_quarantine_size_kb=64:detect_leaks=1"
export LSAN_OPTIONS="suppressions=$PWD/cmake/drivers.lsan:print_suppressions=0"
export TSAN_OPTIONS="suppressions=$PWD/cmake/drivers.tsan:halt_on_error=1"
for preset in check tsan; do
  cmake --preset "$preset" >/dev/null
  cmake --build --preset "$preset" -j "${JOBS:-$(nproc)}" --target test_soak
  "build/$preset/bin/test_soak"
done
