#!/usr/bin/env bash
# clang-tidy over every source file of src and apps, in the units a build compiles, which costs a third of one file at a time; or over the
# files given, each by itself: scripts/tidy.sh [FILE...]. Prints each finding once; ends with 1 if there is one.
set -euo pipefail
cd "$(dirname "$0")/.."
command -v clang-tidy >/dev/null || { echo "tidy: clang-tidy is not installed: scripts/install-deps.sh --checks" >&2; exit 4; }
if [ $# -eq 0 ]; then build=build/tidy unity=ON; else build=build/tidy-files unity=OFF; fi
cmake --preset check -B "$build" -DCMAKE_UNITY_BUILD="$unity" -DLODESTONE_TESTS=OFF -DLODESTONE_BENCH=OFF -DLODESTONE_FUZZ=OFF >/dev/null
files=("$@")
# All but what a build would make first.
if [ $# -eq 0 ]; then
  mapfile -t files < <(grep '"file":' "$build/compile_commands.json" | cut -d '"' -f 4 | grep -E "^$PWD/(src|apps)/|/Unity/")
fi
# The Python module is not built with sanitizers; where it is not, its headers may not even be there.
if ! grep -q apps/python/ "$build/compile_commands.json"; then
  mapfile -t files < <(printf "%s\n" "${files[@]}" | grep -v "^apps/python/")
  echo "clang-tidy: $build has no Python module, so apps/python is left out"
fi
found=$(mktemp)
trap 'rm -f "$found"' EXIT
# A unit includes source files and so does nothing wrong. A build of units does not warn of shadows, this does.
printf '%s\n' "${files[@]}" |
  xargs -P "$(nproc)" -n 1 clang-tidy -p "$build" --quiet --checks=-bugprone-suspicious-include --extra-arg=-Wshadow 2>/dev/null >"$found" || true
if grep -E '(warning|error): ' "$found" | sort -u | grep .; then
  echo "clang-tidy: see above" >&2
  exit 1
fi
echo "clang-tidy: nothing found in ${#files[@]} files or units"
