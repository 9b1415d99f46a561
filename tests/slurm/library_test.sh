#!/usr/bin/env bash
# A library baked over a real Slurm on this machine while a node, a task, a bake and the controller are killed: the
# same bytes as one run makes. library_test.sh PROGRAM SOURCE. Ends with 77 where there is no Slurm to be had.
set -eu
program=$1 source=$2
here=$(cd "$(dirname "$0")" && pwd)
for tool in slurmctld-wlm slurmd-wlm slurmstepd-wlm munged sbatch; do
  command -v "$tool" >/dev/null || {
    echo "SKIPPED: $tool is not installed; make test-slurm installs Slurm (scripts/install-deps.sh --slurm)"
    exit 77
  }
done
[ "$(id -u)" = 0 ] || { echo "SKIPPED: the virtual nodes of Slurm need root"; exit 77; }

work=$(mktemp -d)
export SLURM_CONF=$work/cluster/slurm.conf LODESTONE=$program
cluster() { local what=$1; shift; "$here/cluster.sh" "$what" "$work/cluster" "$@"; }
trap 'cluster stop || true; rm -rf "$work"' EXIT
chmod 755 "$work"
say() { echo "$SECONDS s: $*"; }
options=(--order static,keyframe --error-samples 150000) # each bake takes long enough to be met and killed

make_scans() { # 60: 53 that can be baked, one content twice, a space and an umlaut in names, 7 that cannot
  mkdir -p "$work/scans/a b" "$work/scans/deep"
  local i=0 shape n
  for shape in rock terrain torus sphere cliff vase grid; do
    for n in 300 600 900 1200 1500 1800 2400; do
      i=$((i + 1))
      "$program" -q generate "$shape" --triangles "$n" --seed "$i" -o "$work/scans/$shape-$n.ply"
    done
  done
  "$program" -q generate rock --triangles 9000 --seed 3 -o "$work/scans/a b/mit Leerzeichen ü.obj"
  "$program" -q generate rock --triangles 6000 --seed 4 -o "$work/scans/deep/large.glb"
  "$program" -q generate vase --triangles 6000 --seed 5 -o "$work/scans/deep/vase.ply"
  cp "$work/scans/rock-300.ply" "$work/scans/deep/rock-300.ply"
  head -c 3000 "$work/scans/rock-2400.ply" >"$work/scans/cut.ply"
  : >"$work/scans/empty.ply"
  head -c 5000 /dev/zero >"$work/scans/zeros.stl"
  echo hello >"$work/scans/text.obj"
  printf 'OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n' >"$work/scans/index.off"
  gzip -c "$work/scans/rock-600.ply" | head -c 2000 >"$work/scans/cut.ply.gz"
  ln -s nowhere.ply "$work/scans/link.ply"
}

sums() { (cd "$1/assets" && find . -name '*.lode' -exec sha256sum {} + | sort -k2); }

a_bake() { # the id of a process that bakes into $work/lib, if there is one
  pgrep -f -- "^$program bake --json -o $work/lib/" | head -1
}

running() { squeue -h -r -j "$job" -t R -o '%K %N' 2>/dev/null; }

wait_for() { # wait_for COMMAND...: until it prints something; prints that
  local said
  for _ in $(seq 300); do
    said=$("$@")
    [ -z "$said" ] || { echo "$said"; return; }
    sleep 0.05
  done
  echo "nothing came of: $*" >&2
  return 1
}

break_things() {
  local bake task node
  bake=$(wait_for a_bake)
  kill -9 "$bake" 2>/dev/null && say "killed bake $bake"
  read -r task node < <(wait_for running)
  scancel --batch --signal=TERM "${job}_$task" & # it may take ten seconds to come back, when all would be done
  say "telling shard $task on $node to end"
  sleep 0.5
  node=$(wait_for running | tail -1 | cut -d' ' -f2)
  cluster die "$node"
  scontrol update NodeName="$node" State=DOWN Reason=dead # which Slurm notices by itself in 16 s
  say "node $node is dead"
  cluster controller
  say "controller killed and started again"
  cluster node "$node"
}

go_on() { # sends what is left, and waits for it
  job=$(sbatch --parsable --mem=1000 --array="$1%2" -o "$work/log-%a" "$source/scripts/library.sbatch" "$work/plan")
  say "sent shards $1 as job $job"
}

wait_for_job() {
  for _ in $(seq 600); do
    [ -n "$(squeue -h -j "$job" -t PD,R,CG,RQ 2>/dev/null || echo unknown)" ] || return 0
    # Held where a node came back too early: nothing will come of it.
    [ -z "$(squeue -h -r -j "$job" -o %r 2>/dev/null | grep -x 'launch failed requeued held')" ] || return 0
    sleep 0.25
  done
}

make_scans
"$program" -q library "$work/scans" -o "$work/serial" --jobs 1 "${options[@]}"
say "the serial run is done"
cluster start 3
say "the cluster is up"
"$program" library "$work/scans" -o "$work/lib" --plan "$work/plan" --shard-meshes 5 "${options[@]}"
last=$(tail -1 "$work/plan/arrays" | sed 's/ .*//; s/.*-//')
go_on "0-$last"
break_things
code=4
for _ in 1 2 3; do
  wait_for_job
  said=$("$program" library --merge "$work/plan" 2>&1) && code=0 || code=$?
  say "$said"
  [ "$code" = 4 ] || break
  go_on "$(echo "$said" | sed -n 's/.*--array=\([0-9,]*\).*/\1/p')"
done
cat "$work"/log-* | sort | uniq -c | sort -rn | head -30
[ "$code" = 0 ] || { echo "FAILED: the library ended with $code"; exit 1; }
diff <(sums "$work/serial") <(sums "$work/lib") || { echo "FAILED: other bytes than the serial run"; exit 1; }
[ "$(wc -l <"$work/lib/results.jsonl")" = 60 ] || { echo "FAILED: not 60 results"; exit 1; }
[ "$(grep -c '"outcome":"refused"' "$work/lib/results.jsonl")" = 7 ] || { echo "FAILED: not 7 refused"; exit 1; }
[ -z "$(find "$work/lib" -name '*.part*')" ] || { echo "FAILED: parts are left"; exit 1; }
"$program" library "$work/scans" -o "$work/lib" --check "${options[@]}"
say "the same bytes as the serial run, 60 results, 7 refused"
