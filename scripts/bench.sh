#!/usr/bin/env bash
# Every benchmark, in one run: times side by side, quality of simplification.
set -euo pipefail
cd "$(dirname "$0")/.."
bin=build/release/bin
"$bin/bench_read"
"$bin/bench_cursor"
"$bin/bench_simplify" --benchmark_min_time=1
"$bin/bench_frame"
"$bin/simplify_quality"
"$bin/level_errors" --zoom 0 --zoom 0.333 rock:100000 vase:100000
