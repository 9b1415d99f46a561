#!/usr/bin/env bash
# The demonstration: bakes the 300k rock, the 300k cliff and a rock whose texture lies in 5,000 fragments, flies through all of them and
# through smoke over the rock with every backend, and leaves a report of each.
set -euo pipefail
cd "$(dirname "$0")/.."
program=build/release/bin/lodestone
out=build/demo
mkdir -p "$out"
export XDG_CACHE_HOME="${XDG_CACHE_HOME:-$PWD/build/cache}"

# Flights first: what they bake is what the pictures are drawn from. At any of these errors the cliff is drawn whole by all but vgi, so one
# tells as much as three.
backends=(--backends full,discrete,lod,vgi)
options=("${backends[@]}" --frames 16 --quality-frames 3)
"$program" bench assets/cliff.scene.json "${options[@]}" --pixel-error 2 -o "$out/cliff"
# Smoke takes most of a frame here, whatever draws the scene: few frames.
"$program" bench assets/smoke.scene.json "${backends[@]}" --frames 8 --quality-frames 2 --pixel-error 1 -o "$out/smoke"
"$program" bench assets/scan.scene.json "${backends[@]}" --frames 8 --quality-frames 2 --pixel-error 2 -o "$out/scan"
# Scenes bake on first use, and keep texture coordinates. Here its textures are baked into the atlas.
"$program" -q generate scan --triangles 100000 --seed 7 -o "$out/scan.glb"
"$program" -q bake "$out/scan.glb" --backends full,lod,vgi -o "$out/scan.lode"
"$program" bench "$out/scan.lode" --backends full,lod,vgi --frames 8 --quality-frames 2 --pixel-error 2 -o "$out/scan-baked"
"$program" bench assets/rock.scene.json "${options[@]}" --orders keyframe,greedy --pixel-error 1,2,4 -o "$out"
for backend in full discrete lod vgi; do
  "$program" -q render assets/rock.scene.json --backend "$backend" --camera assets/rock.path.json@0.35 -o "$out/rock-$backend.png"
done
"$program" -q render assets/rock.scene.json --backend lod --camera assets/rock.path.json@0.35 --debug triangle -o "$out/rock-lod-triangles.png"
"$program" -q render assets/rock.scene.json --backend vgi --camera assets/rock.path.json@0.35 --debug chart -o "$out/rock-vgi-charts.png"
