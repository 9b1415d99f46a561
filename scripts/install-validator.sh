#!/usr/bin/env bash
# Puts Khronos' glTF validator beside the build, from npm's registry: tests then validate each kind of GLB that is written. Without npm or
# without a network they skip that, and nothing fails. NO_INSTALL=1 skips it.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=build/npm
version=$(sed -n 's/.*"gltf-validator": "\([^"]*\)".*/\1/p' tests/tiles/viewers/package.json)
if [ -n "${NO_INSTALL:-}" ] || [ -d "$folder/node_modules/gltf-validator" ]; then exit 0; fi
if ! command -v npm >/dev/null; then
  echo "install-validator: there is no npm; the test that needs gltf-validator will be skipped"
  exit 0
fi
mkdir -p "$folder"
timeout 120 npm install --silent --no-audit --no-fund --prefix "$folder" "gltf-validator@$version" >/dev/null 2>&1 ||
  echo "install-validator: npm could not install gltf-validator $version; the test that needs it will be skipped"
