#!/usr/bin/env bash
# Puts what tests/npm/package.json names beside the build, from npm's registry: encoders of Draco and meshopt, whose files tests read,
# and Khronos' glTF validator, which looks at each GLB that tests write. Without npm or without a network tests skip that, and nothing
# fails. NO_INSTALL=1 skips it.
set -euo pipefail
cd "$(dirname "$0")/.."
wanted=tests/npm/package.json
folder=build/npm
if [ -n "${NO_INSTALL:-}" ] || { [ -d "$folder/node_modules" ] && cmp -s "$wanted" "$folder/package.json"; }; then exit 0; fi
if ! command -v npm >/dev/null; then
  echo "install-npm-checks: there is no npm; tests that need its encoders or its glTF validator skip that"
  exit 0
fi
mkdir -p "$folder"
cp "$wanted" "$folder/package.json"
if ! timeout 120 npm install --ignore-scripts --silent --no-audit --no-fund --no-package-lock --prefix "$folder" >/dev/null 2>&1; then
  rm -f "$folder/package.json"
  echo "install-npm-checks: npm could not install what $wanted names; tests that need it skip that"
fi
