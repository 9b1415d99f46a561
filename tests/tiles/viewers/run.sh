#!/usr/bin/env bash
# run.sh PROGRAM FOLDER [VIEWS]: tiles in real viewers, CesiumJS and 3DTilesRendererJS in headless Chromium: no pixel shows
# the back of a tile without a front, settled or loading, and an asymmetric mesh stands the right way up at its place on the Earth. Every
# tile passes gltf-validator. FOLDER: for node_modules, which npm installs from package.json where they are not there, and for
# tilesets. Skipped, with 77, where there is no Chromium (CHROMIUM names another), no npm, or nothing that npm can reach.
set -euo pipefail
program=$1
work=$2
views=${3:-150}
here=$(cd "$(dirname "$0")" && pwd)
checkout=$(cd "$here/../../.." && pwd)
skip() {
  echo "SKIPPED: tiles are not drawn by real viewers: $*" >&2
  exit 77
}
export CHROMIUM=${CHROMIUM:-$(command -v chromium || true)}
[ -n "$CHROMIUM" ] || skip "there is no chromium; apt-get install chromium"
command -v node >/dev/null && command -v npm >/dev/null || skip "there is no node with npm; apt-get install nodejs npm"
mkdir -p "$work"
cd "$work"
if ! cmp -s "$here/package.json" package.json || [ ! -d node_modules/puppeteer-core ]; then
  [ -z "${NO_INSTALL:-}" ] || skip "node modules are not in $work, and NO_INSTALL is set"
  cp "$here/package.json" package.json
  npm install --ignore-scripts --no-audit --no-fund --no-package-lock >npm.log 2>&1 || { rm package.json; skip "npm cannot install: $(tail -1 npm.log)"; }
fi

export XDG_CACHE_HOME=$work/cache
"$program" -q generate rock --triangles 60000 --seed 3 -o rock.ply
"$program" -q bake rock.ply -o rock.lode --backends vgi --clusters 8 --resolution 65
"$program" -q generate terrain --triangles 20000 --seed 3 -o terrain.ply
"$program" -q bake terrain.ply -o terrain.lode --backends vgi --clusters 8 --resolution 33
cat >pyramid.obj <<OBJ
v 0 0 0
v 3 0 0
v 0 0 -2
v 0 1 0
f 1 3 2
f 1 2 4
f 2 3 4
f 3 1 4
OBJ
"$program" -q bake pyramid.obj -o pyramid.lode --backends vgi --clusters 1 --resolution 9
place=(--lon 8.5 --lat 47.4 --height 500)
for encoding in meshopt quantised plain; do
  "$program" -q tile rock.lode -o "rock-$encoding" --tile-triangles 512 --encoding $encoding
done
"$program" -q tile rock.lode -o rock-placed --tile-triangles 512 "${place[@]}"
"$program" -q tile terrain.lode -o terrain --tile-triangles 512 "${place[@]}"
"$program" -q tile pyramid.lode -o pyramid "${place[@]}"

failed=0
run() { node "$here/$1" "${@:2}" || failed=1; }
"$checkout/scripts/install-npm-checks.sh"
NODE_PATH=${NODE_PATH:-$checkout/build/npm/node_modules} run ../../npm/validate.mjs rock-meshopt rock-quantised rock-plain terrain pyramid
run leaks.mjs three rock-meshopt --views "$views" --loading 10
run leaks.mjs three rock-quantised --views $((views / 5))
run leaks.mjs three rock-plain --views $((views / 5))
run leaks.mjs cesium rock-placed --views "$views" --loading 10
run leaks.mjs cesium rock-plain --views $((views / 10))
run leaks.mjs three pyramid --orientation
run leaks.mjs cesium pyramid --orientation
exit $failed
