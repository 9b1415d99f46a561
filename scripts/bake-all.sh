#!/usr/bin/env bash
# Bakes every mesh below a folder by both backends, verifies what was baked, and prints a line for each: read, at what
# cost and repaired how, or refused why.
#   scripts/bake-all.sh FOLDER [PROGRAM]
# BAKE_OPTIONS: further options of bake. Fails where a file ends the program in any way but 0 or 3, where 3 comes
# without exactly one line, or where what was baked is not in order.
set -uo pipefail
folder="${1:?folder with meshes}"
program="${2:-build/release/bin/lodestone}"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
failed=0
# What a report says, in one line.
summary() {
  python3 - "$work/report.json" <<'PY'
import json, sys
r = json.load(open(sys.argv[1]))
triangles = r["input"]["triangles"]
parts = [f"{triangles} triangles"]
if "lod" in r: parts.append(f"base {r['lod']['base_triangles']}")
if "vgi" in r: parts.append(f"{r['vgi']['charts']} charts")
parts.append(f"{r['seconds']:.1f} s")
parts.append(f"{r['peak_rss_bytes'] / 2**20:.0f} MiB")
changes = ", ".join(f"{k} {v}" for k, v in r["repair"].items() if v) or "nothing to repair"
notes = f"; {len(r['warnings'])} warnings" if r["warnings"] else ""
print(", ".join(parts) + ": " + changes + notes)
PY
}
while IFS= read -r file; do
  name="${file#"$folder"/}"
  "$program" -q bake "$file" -o "$work/out.lode" --backends lod,vgi --report "$work/report.json" ${BAKE_OPTIONS:-} >"$work/out" 2>"$work/err"
  code=$?
  lines=$(wc -l <"$work/err")
  if [ $code -eq 0 ]; then
    said="$(summary)"
    "$program" -q verify "$work/out.lode" >/dev/null 2>"$work/err" || { failed=1; said="VERIFY FAILED: $(tail -1 "$work/err")"; }
    printf '%-48s read     %s\n' "$name" "$said"
  elif [ $code -eq 3 ] && [ "$lines" -eq 1 ]; then
    printf '%-48s refused  %s\n' "$name" "$(sed "s|$folder/||" "$work/err")"
  else
    failed=1
    printf '%-48s CODE %s  %s lines: %s\n' "$name" "$code" "$lines" "$(tail -1 "$work/err")"
  fi
  rm -f "$work/out.lode"
done < <(find "$folder" -type f | grep -iE '\.(ply|obj|stl|off|gltf|glb|png|tiff?)(\.gz)?$' | grep -viE '(normal|albedo|occlusion|metallic|rough|emissive|basecolor|texture).*\.png$' | sort)
exit $failed
