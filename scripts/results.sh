#!/usr/bin/env bash
# What the program measures on this machine, scene after scene, as a page of Markdown: scripts/results.sh PROGRAM SCENE... > page.md
set -euo pipefail
program=$1
shift
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
echo "# Results"
echo
echo "\`scripts/results.sh\` made this page: flights through every scene by every backend, and by \`discrete\` at the pixel errors at which it"
echo "looks as good (SSIM against a picture of the whole mesh with 16 samples a pixel) as \`lod\` and \`vgi\` do. What the columns mean is told"
echo "in the report that \`lodestone bench\` leaves."
for scene in "$@"; do
  "$program" -q bench "$scene" --frames 30 --quality-frames 3 --pixel-error 1,2,4 --equal-error ssim -o "$out" > /dev/null
  echo
  cat "$out/report.md"
done
