#!/usr/bin/env bash
# Installs what Lodestone is built from and tested with on Debian 12: prints the apt line, installs only what is missing, as root or
# through sudo, and never asks. NO_INSTALL=1 skips it. `--checks` adds what `make check` needs; `--slurm` installs what `make
# test-slurm` does, alone. `--list` prints the packages and does nothing else.
set -euo pipefail

packages=(
  # to build
  g++ cmake ninja-build ccache pkg-config git
  libopenmesh-dev libeigen3-dev libglm-dev libmeshoptimizer-dev
  libtinygltf-dev nlohmann-json3-dev libcli11-dev libexpected-dev libxxhash-dev
  libjs-chart.js
  libdraco-dev libwebp-dev libstb-dev
  libpng-dev libjpeg-dev libtiff-dev zlib1g-dev libzstd-dev libproj-dev
  libopenvdb-dev
  libvulkan-dev glslang-dev glslang-tools spirv-tools libglfw3-dev libimgui-dev
  # to test and measure
  libgtest-dev libgmock-dev libbenchmark-dev python3
  # to build the Python module and run its examples
  python3-dev pybind11-dev python3-numpy python3-matplotlib
  # to fuzz
  clang
  # to draw without a GPU, and to check what is drawn
  mesa-vulkan-drivers vulkan-validationlayers xvfb xauth
  # to draw the plots of docs/ (scripts/plot-orders.sh, scripts/plot-history.py)
  gnuplot-nox
  # to make the reference of the public headers (make reference), and to test that it is whole
  doxygen
)

checks=(clang libclang-rt-14-dev clang-tidy llvm)
# a cluster of virtual nodes, and what docs/library.md shows beside it
slurm=(slurm-wlm munge parallel jq procps)
if [ "${1:-}" = --checks ]; then
  packages+=("${checks[@]}")
elif [ "${1:-}" = --slurm ]; then
  packages=("${slurm[@]}")
fi

if [ "${1:-}" = --list ]; then
  printf '%s\n' "${packages[@]}" "${checks[@]}"
  exit 0
fi
if [ -n "${NO_INSTALL:-}" ]; then
  exit 0
fi
if ! command -v dpkg-query >/dev/null; then
  echo "install-deps: not a Debian system; install the equivalents of: ${packages[*]}" >&2
  echo "install-deps: then run again with NO_INSTALL=1" >&2
  exit 4
fi

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query -W -f='${Status}' "$package" 2>/dev/null || true)
  [ "$status" = 'install ok installed' ] || missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then
  echo "install-deps: everything is installed"
  exit 0
fi

run=()
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo >/dev/null || ! sudo -n true 2>/dev/null; then
    echo "install-deps: needs root or sudo without a password; run this yourself, then try again:" >&2
    echo "  apt-get install -y --no-install-recommends ${missing[*]}" >&2
    exit 4
  fi
  run=(sudo -n)
fi
echo "apt-get install -y --no-install-recommends ${missing[*]}"
export DEBIAN_FRONTEND=noninteractive
"${run[@]}" apt-get update -q
"${run[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}"
