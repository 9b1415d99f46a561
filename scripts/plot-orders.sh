#!/bin/sh
# Draws docs/atvr-by-moves.svg and docs/atvr-by-level.svg for a mesh: how ATVR falls with the faces moved per collapse,
# and what it is at each level for each order and model.
#   scripts/plot-orders.sh PROGRAM MESH NAME FOLDER
set -eu
program=$1 mesh=$2 name=$3 folder=$4
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
bake() { "$program" -q bake "$mesh" -o "$work/$1.lode" --error-samples 1000 --order "$2" --cache "$3" --moves-per-ecol "$4" >/dev/null; }
# ASSET ORDER CACHE: a line "moved ATVR"
mean() {
    "$program" -q acmr "$work/$1.lode" --order "$2" --cache "$3" --json |
        python3 -c 'import json,sys; d=json.load(sys.stdin); print(d["moved_per_ecol"], d["atvr_mean"])'
}
# ASSET ORDER CACHE: a line "triangles ATVR" per level
levels() {
    "$program" -q acmr "$work/$1.lode" --order "$2" --cache "$3" --json |
        python3 -c 'import json,sys; [print(l["triangles"], l["atvr"]) for l in json.load(sys.stdin)["levels"]]'
}
for moves in 0.5 1 2 4 8 16 32; do
    bake "m$moves" keyframe fifo16 "$moves"
    mean "m$moves" keyframe fifo16 >>"$work/keyframe"
done
bake all keyframe,greedy,static,classic fifo16 8
bake batches keyframe nvidia 8
for order in classic static greedy; do mean all "$order" fifo16 >"$work/$order"; done
mean batches keyframe fifo16 >"$work/clusters"
fresh=$("$program" -q acmr "$work/all.lode" --compare --json |
    python3 -c 'import json,sys; print(json.load(sys.stdin)["compare"]["fresh_meshoptimizer"]["atvr_mean"])')
for order in classic static greedy keyframe; do levels all "$order" fifo16 >"$work/level-$order"; done
levels batches keyframe fifo16 >"$work/level-clusters"
levels batches keyframe nvidia >"$work/level-clusters-nvidia"
levels all keyframe nvidia >"$work/level-keyframe-nvidia"
gnuplot <<PLOT
set terminal svg size 760,420 font "sans-serif,13" background rgb "white"
set grid lc rgb "#dddddd"
set key outside right
set output "$folder/atvr-by-moves.svg"
set title "$name: transforms per vertex, mean of 60 levels, FIFO-16"
set logscale x 2
set xlabel "faces moved per collapse"
set ylabel "ATVR"
set xrange [0.4:40]
set yrange [1.15:1.75]
plot "$work/keyframe" with linespoints pt 7 lw 2 title "keyframe", \
     "$work/clusters" with points pt 5 ps 1.3 title "keyframe, --cache auto", \
     "$work/static" with points pt 9 ps 1.3 title "static", \
     "$work/greedy" with points pt 11 ps 1.3 title "greedy", \
     $fresh with lines dt 2 lc rgb "#666666" title "fresh meshoptimizer"
set output "$folder/atvr-by-level.svg"
set title "$name: transforms per vertex by level"
unset logscale x
set xlabel "triangles"
set xrange [0:*]
set yrange [1:2.2]
plot "$work/level-static" with lines lw 2 title "static, FIFO-16", \
     "$work/level-greedy" with lines lw 2 title "greedy, FIFO-16", \
     "$work/level-keyframe" with lines lw 2 title "keyframe, FIFO-16", \
     "$work/level-clusters" with lines lw 2 title "auto, FIFO-16", \
     "$work/level-clusters-nvidia" with lines lw 2 dt 2 title "auto, NVIDIA", \
     "$work/level-keyframe-nvidia" with lines lw 2 dt 2 title "keyframe, NVIDIA"
PLOT
echo "classic, off the scale: $(cat "$work/classic")"
