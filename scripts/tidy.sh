#!/usr/bin/env bash
# clang-tidy over every source file of src and apps, or over those given: scripts/tidy.sh BUILD [FILE...]. BUILD is a folder configured with
# clang, whose generated headers are built. Prints each finding once; ends with 1 if there is one.
set -euo pipefail
cd "$(dirname "$0")/.."
command -v clang-tidy >/dev/null || { echo "tidy: clang-tidy is not installed: scripts/install-deps.sh --checks" >&2; exit 4; }
build=$1
shift
files=("$@")
if [ ${#files[@]} -eq 0 ]; then
  mapfile -t files < <(git ls-files "src/*.cpp" "apps/*.cpp")
  # The Python module is not built with sanitizers; where it is not, its headers may not even be there.
  if ! grep -q apps/python/ "$build/compile_commands.json"; then
    mapfile -t files < <(printf "%s\n" "${files[@]}" | grep -v "^apps/python/")
    echo "clang-tidy: $build has no Python module, so apps/python is left out"
  fi
fi
found=$(mktemp)
trap 'rm -f "$found"' EXIT
printf '%s\n' "${files[@]}" | xargs -P "$(nproc)" -n 4 clang-tidy -p "$build" --quiet 2>/dev/null >"$found" || true
if grep -E '(warning|error): ' "$found" | sort -u | grep .; then
  echo "clang-tidy: see above" >&2
  exit 1
fi
echo "clang-tidy: nothing found in ${#files[@]} files"
