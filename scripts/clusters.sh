#!/usr/bin/env bash
# Atlases of 6 to 500 clusters, each verified, coarsely sampled: scripts/clusters.sh PROGRAM MESH...
set -uo pipefail
program=$1
shift
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
bad=0
for mesh in "$@"; do
  for clusters in 6 20 60 150 500; do
    options=(--backends vgi --clusters "$clusters" --resolution 17 --error-samples 2000)
    if said=$("$program" -q bake "$mesh" "${options[@]}" -o "$out/atlas.lode" 2>&1 && "$program" -q verify "$out/atlas.lode" 2>&1); then
      echo "ok $mesh $clusters"
    else
      echo "BAD $mesh $clusters: $said"
      bad=1
    fi
  done
done
exit $bad
