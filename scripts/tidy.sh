#!/usr/bin/env bash
# clang-tidy over every source file of src and apps, each compiled by itself, or over those given: scripts/tidy.sh [FILE...]. Prints each
# finding once; ends with 1 if there is one.
set -euo pipefail
cd "$(dirname "$0")/.."
command -v clang-tidy >/dev/null || { echo "tidy: clang-tidy is not installed: scripts/install-deps.sh --checks" >&2; exit 4; }
build=build/tidy
cmake --preset check -B "$build" -DCMAKE_UNITY_BUILD=OFF -DLODESTONE_TESTS=OFF -DLODESTONE_BENCH=OFF -DLODESTONE_FUZZ=OFF >/dev/null
files=("$@")
if [ ${#files[@]} -eq 0 ]; then mapfile -t files < <(git ls-files "src/*.cpp" "apps/*.cpp"); fi
# The Python module is not built with sanitizers; where it is not, its headers may not even be there.
if ! grep -q apps/python/ "$build/compile_commands.json"; then
  mapfile -t files < <(printf "%s\n" "${files[@]}" | grep -v "^apps/python/")
  echo "clang-tidy: $build has no Python module, so apps/python is left out"
fi
found=$(mktemp)
trap 'rm -f "$found"' EXIT
printf '%s\n' "${files[@]}" | xargs -P "$(nproc)" -n 4 clang-tidy -p "$build" --quiet 2>/dev/null >"$found" || true
if grep -E '(warning|error): ' "$found" | sort -u | grep .; then
  echo "clang-tidy: see above" >&2
  exit 1
fi
echo "clang-tidy: nothing found in ${#files[@]} files"
