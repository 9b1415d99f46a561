#!/bin/sh
# The figures of docs/progressive-meshes.md for some meshes: ATVR of the order `keyframe` by objective and moves, against
# a fresh meshoptimizer order at every level.
#   scripts/orders.sh PROGRAM MESH...
set -eu
program=$1
shift
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
echo "| mesh | objective | moves | model | ATVR | worst level | log levels | fresh meshoptimizer | ratio | s / 100k |"
echo "|---|---|---|---|---|---|---|---|---|---|"
for mesh in "$@"; do
    for what in "fifo16 8 fifo16" "fifo16 2 fifo16" "fifo24 8 fifo24" "fifo32 8 fifo32" "nvidia 8 nvidia" \
        "nvidia 8 fifo16" "nvidia 2 nvidia" "amd 8 amd" "amd 2 amd" "intel 8 intel" "intel 2 intel"; do
        set -- $what
        if [ ! -e "$work/$1-$2.lode" ]; then
            rm -f "$work"/*.lode
            "$program" -q bake "$mesh" -o "$work/$1-$2.lode" --order keyframe --cache "$1" --moves-per-ecol "$2" \
                --error-samples 1000 --report "$work/report.json" >/dev/null
        fi
        "$program" -q acmr "$work/$1-$2.lode" --cache "$3" --compare --json >"$work/uniform.json"
        "$program" -q acmr "$work/$1-$2.lode" --cache "$3" --spacing log --json >"$work/log.json"
        python3 - "$mesh" "$1" "$3" "$work" <<'PY'
import json, os, sys
mesh, objective, model, work = sys.argv[1:]
load = lambda name: json.load(open(os.path.join(work, name)))
u, l, r = load("uniform.json"), load("log.json"), load("report.json")
fresh = u["compare"]["fresh_meshoptimizer"]["atvr_mean"]
print("| %s | %s | %.2f | %s | %.3f | %.3f | %.3f | %.3f | %.3f | %.1f |" % (
    os.path.basename(mesh), objective, u["moved_per_ecol"], model, u["atvr_mean"],
    max(x["atvr"] for x in u["levels"]), l["atvr_mean"], fresh, u["atvr_mean"] / fresh,
    r["lod"]["order_seconds"] / (r["input"]["triangles"] / 1e5)), flush=True)
PY
    done
done
