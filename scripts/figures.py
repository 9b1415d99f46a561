#!/usr/bin/env python3
"""Measures what docs/figures.md says, and writes that page.

  scripts/figures.py measure [NAME...]   runs measurements (all without a name) and keeps what they found in bench/results/NAME.json
  scripts/figures.py write               writes docs/figures.md from bench/results, and bench/history/COMMIT.csv
  scripts/figures.py check               fails unless docs/figures.md is what `write` would write
  scripts/figures.py list                names the measurements and their commands
  scripts/figures.py take NAME REPORT    keeps a report.json that `bench` of the same program made on another machine, with a GPU

Every measurement is one or several commands of the release build. A result keeps the commands, the commit, the machine and the
figures; nothing in the page is typed by hand. Measurements on scans need LODESTONE_DATA and leave the scans out without it.
"""
import argparse
import csv
import json
import math
import os
import pathlib
import platform
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
BIN = "build/release/bin/"
RESULTS = ROOT / "bench" / "results"
HISTORY = ROOT / "bench" / "history"
PAGE = ROOT / "docs" / "figures.md"

# ---------------------------------------------------------------------------------------------------------------- measuring


def result_path(name):
    """Where a result is kept: pictures from all around in a folder of their own."""
    return RESULTS / ("around" if name.startswith("around-") else "") / f"{name}.json"


def run(command):
    """Runs a command of the project's root and returns what it prints; ends the script where the command fails."""
    print("$ " + " ".join(command), file=sys.stderr, flush=True)
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"figures: exit code {done.returncode} from: {' '.join(command)}")
    return done.stdout


def google_benchmark(program, *options):
    """Rows of a Google Benchmark program: name, milliseconds (wall clock and CPU, as the benchmark defines them), counters."""

    def measured():
        command = [BIN + program, *options, "--benchmark_format=json"]
        rows = {}
        text = run(command)
        for row in json.loads(text[text.index("{"):])["benchmarks"]:
            if row.get("run_type") == "aggregate" and row.get("aggregate_name") != "median":
                continue
            if row.get("error_occurred"):
                sys.exit(f"figures: {row['name']}: {row.get('error_message')}")
            to_ms = {"ns": 1e-6, "us": 1e-3, "ms": 1.0, "s": 1e3}[row["time_unit"]]
            known = {"name", "family_index", "per_family_instance_index", "run_name", "run_type", "repetitions", "threads", "iterations",
                     "real_time", "cpu_time", "time_unit", "repetition_index", "aggregate_name", "aggregate_unit", "label"}
            counters = {key: value for key, value in row.items() if key not in known and isinstance(value, (int, float))}
            name = re.sub(r"/(iterations:\d+|repeats:\d+|manual_time|process_time|real_time|min_time:[\d.]+)", "", row["run_name"])
            rows[name] = {"ms": row["real_time"] * to_ms, "cpu_ms": row["cpu_time"] * to_ms, **counters}
        return [command], rows

    return measured


def quality():
    command = [BIN + "simplify_quality", "--json"]
    rows = {}
    for line in run(command).splitlines():
        row = json.loads(line)
        rows[f"{row.pop('mesh')}/{row['share']:g}"] = row
    return [command], rows


def asset_size():
    command = [BIN + "asset_size", "--json"]
    rows = {}
    for line in run(command).splitlines():
        row = json.loads(line)
        rows[row.pop("mesh")] = row
    return [command], rows


def bake(shape, triangles, *options):
    """The report of a bake of a generated mesh."""

    def measured():
        with tempfile.TemporaryDirectory() as folder:
            mesh, report = f"{folder}/{shape}.ply", f"{folder}/report.json"
            commands = [[BIN + "lodestone", "-q", "generate", shape, "--triangles", str(triangles), "--seed", "7", "-o", mesh],
                        [BIN + "lodestone", "-q", "bake", mesh, "-o", f"{folder}/{shape}.lode", *options, "--report", report]]
            for command in commands:
                run(command)
            found = json.loads(pathlib.Path(report).read_text())
        shown = [[word.replace(folder + "/", "") for word in command] for command in commands]
        flat = {}
        for room in ("lod", "vgi", "discrete"):
            for key, value in found.get(room, {}).items():
                if isinstance(value, dict):
                    flat.update({f"{room}.{key}.{inner}": number for inner, number in value.items()})
                elif isinstance(value, (int, float)):
                    flat[f"{room}.{key}"] = value
        flat.update({key: found[key] for key in ("seconds", "peak_rss_bytes", "out_bytes")})
        flat["triangles"] = found["input"]["triangles"]
        return shown, {f"{shape} {triangles}": flat}

    return measured


def orders(*objectives):
    """ATVR of orders of a generated rock, by objective and moves, at levels spaced evenly and by logarithm."""

    def measured():
        commands, rows = [], {}
        with tempfile.TemporaryDirectory() as folder:
            lodestone = [BIN + "lodestone", "-q"]
            mesh, asset = f"{folder}/rock.ply", f"{folder}/rock.lode"
            run([*lodestone, "generate", "rock", "--triangles", "100000", "-o", mesh])
            for order, cache, moves in objectives:
                made = [*lodestone, "bake", mesh, "-o", asset, "--backends", "lod", "--order", order, "--cache", cache, "--moves-per-ecol",
                        str(moves), "--report", f"{folder}/report.json"]
                run(made)
                uniform = json.loads(run([*lodestone, "acmr", asset, "--cache", cache, "--compare", "--json"]))
                log = json.loads(run([*lodestone, "acmr", asset, "--cache", cache, "--spacing", "log", "--json"]))
                report = json.loads(pathlib.Path(f"{folder}/report.json").read_text())
                rows[f"{order} {cache} {moves}"] = {
                    "moved_per_ecol": uniform["moved_per_ecol"], "atvr_mean": uniform["atvr_mean"], "atvr_worst": uniform["atvr_worst"],
                    "atvr_log": log["atvr_mean"], "cache_lines_per_ecol": uniform["cache_lines_per_ecol"],
                    "bytes_per_ecol": uniform["bytes_per_ecol"],
                    "atvr_random": uniform["compare"]["random"]["atvr_mean"],
                    "atvr_worst_case": uniform["compare"]["worst_case"]["atvr_mean"],
                    "atvr_fresh_meshoptimizer": uniform["compare"]["fresh_meshoptimizer"]["atvr_mean"],
                    "order_seconds": report["lod"]["order_seconds"]}
        commands = [["lodestone", "generate", "rock", "--triangles", "100000", "-o", "rock.ply"],
                    ["lodestone", "bake", "rock.ply", "-o", "rock.lode", "--backends", "lod", "--order", "O", "--cache", "C", "--moves-per-ecol", "N"],
                    ["lodestone", "acmr", "rock.lode", "--cache", "C", "--compare", "--json"]]
        return commands, rows

    return measured


def flight(scene, *options):
    """The rows of a bench report: flights through a scene by every backend."""

    def measured():
        with tempfile.TemporaryDirectory() as folder:
            command = [BIN + "lodestone", "-q", "bench", scene, *options, "-o", folder]
            run(command)
            report = json.loads((pathlib.Path(folder) / "report.json").read_text())
        return [command[:-2]], flown(report, FLOWN), report["machine"]

    return measured


FLOWN = ("ms_median", "ms_p99", "ms_jolt", "fps_mean", "cpu_plan_ms", "cpu_ms", "triangles", "vertex_invocations", "acmr", "psnr_db", "ssim",
         "max_pixel_deviation", "background_leaks", "resident_bytes")


def flown(report, keep):
    """By the name of each row of a report, what is kept of it; what was not measured is left out."""
    rows = {}
    for row in report["rows"]:
        name = " ".join(word for word in (row["backend"], row["order"], row["raster"]) if word)
        name += "" if row["backend"] == "full" else f", {row['pixel_error']:g} px"
        rows[name] = {key: row[key] for key in keep if row.get(key) is not None}
    return rows


def all_around(views, distance):
    """A camera path with a key a view, spread evenly over a sphere."""
    keys = []
    for k in range(views):
        height, turn = 1 - (2 * k + 1) / views, k * math.pi * (3 - math.sqrt(5))
        aside = math.sqrt(1 - height * height)
        keys.append({"eye": [distance * aside * math.cos(turn), distance * height, distance * aside * math.sin(turn)], "target": [0, 0, 0]})
    return {"lodestone": "camera-path", "version": 1, "fov_y_degrees": 45, "near": 0.01, "far": 60, "frames": views, "keys": keys}


def made_or_given(mesh, make, folder):
    """The path of a mesh: made into the folder by a command of the program, or of the data set where there is no command."""
    if make:
        run([BIN + "lodestone", "-q", *make, "-o", f"{folder}/{mesh}"])
        return f"{folder}/{mesh}"
    if "LODESTONE_DATA" not in os.environ:
        sys.exit(f"figures: {mesh} needs LODESTONE_DATA")
    return f"{os.environ['LODESTONE_DATA']}/{mesh}"


def textures(mesh, *make):
    """Pictures of a mesh whose textures are kept by the atlas as they are, and baked into it; make: the command for the mesh, or none."""

    def measured():
        views, rows = 7, {}
        with tempfile.TemporaryDirectory() as folder:
            lodestone, asset, scene = [BIN + "lodestone", "-q"], f"{folder}/baked.lode", f"{folder}/around.scene.json"
            source = made_or_given(mesh, make, folder)
            pathlib.Path(scene).write_text(json.dumps({
                "lodestone": "scene", "version": 1, "assets": [{"name": "mesh", "file": "baked.lode"}], "instances": [{"asset": "mesh"}],
                "camera": all_around(views, 2.6)}))
            for backends, kept in (("vgi,full", "--keep-uv"), ("vgi", "--texture-quality lossless"), ("vgi", "")):
                run([*lodestone, "bake", source, "-o", asset, "--backends", "vgi", *kept.split()])
                size = {"vgi": os.path.getsize(asset), "full": os.path.getsize(source)}
                run([*lodestone, "bake", source, "-o", asset, "--backends", "vgi,full", *kept.split()])
                for picture in ("640x360", "1280x720"):
                    run([*lodestone, "bench", scene, "--backends", backends, "--size", picture, "--frames", str(views), "--quality-frames",
                         str(views), "--resident-mib", "4000", "-o", folder])
                    for row in json.loads((pathlib.Path(folder) / "report.json").read_text())["rows"]:
                        name = f"full, {picture}" if row["backend"] == "full" else f"vgi {kept or 'baked'}, {picture}"
                        rows[name] = {**{key: row[key] for key in ("ssim", "psnr_db", "triangles")}, "bytes": size[row["backend"]]}
        shown = [["lodestone", *make, "-o", mesh]] if make else []
        return [*shown, ["lodestone", "bake", mesh, "-o", "baked.lode", "--backends", "vgi,full", "[--keep-uv | --texture-quality lossless]"],
                ["lodestone", "bench", "around.scene.json", "--backends", "vgi,full", "--size", "S", "--resident-mib", "4000"]], rows

    return measured


def texture_memory():
    """What four scans of 4096 x 4096 texels hold of their textures, from far to near, with and without blocks."""
    rows, centres = {}, ((-1.2, -1.2), (1.2, -1.2), (-1.2, 1.2), (1.2, 1.2))
    with tempfile.TemporaryDirectory() as folder:
        lodestone, stats = [BIN + "lodestone", "-q"], f"{folder}/stats.json"
        assets, instances = [], []
        for k, (x, z) in enumerate(centres):
            run([*lodestone, "generate", "scan", "--triangles", "100000", "--seed", str(k + 1), "-o", f"{folder}/scan.glb"])
            run([*lodestone, "bake", f"{folder}/scan.glb", "-o", f"{folder}/{k}.lode", "--backends", "vgi"])
            assets.append({"name": f"scan {k}", "file": f"{k}.lode"})
            instances.append({"asset": f"scan {k}", "position": [x, 0, z]})
        keys = [{"eye": eye, "target": target} for eye, target in (
            ([5, 3, 5], [0, 0, 0]), ([3, 1.5, 3], [0, 0, 0]), ([1, 1.5, 3], [-1, 0, 0]), ([-1.2, 0.5, 2.9], [-1.2, 0, 1.2]), ([5, 3, 5], [0, 0, 0]))]
        scene = {"lodestone": "scene", "version": 1, "assets": assets, "instances": instances, "camera": {
            "lodestone": "camera-path", "version": 1, "fov_y_degrees": 45, "near": 0.01, "far": 100, "frames": 24, "keys": keys}}
        pathlib.Path(f"{folder}/scans.scene.json").write_text(json.dumps(scene))
        for where, at in (("far", "0"), ("nearer", "0.5"), ("near", "0.75")):
            for blocks in ("off", "on"):
                run([*lodestone, "render", f"{folder}/scans.scene.json", "--backend", "vgi", "--camera", f"@{at}", "--texture-blocks", blocks,
                     "-o", f"{folder}/picture.png", "--stats", stats])
                found = json.loads(pathlib.Path(stats).read_text())["rows"][0]
                rows[f"{where}, blocks {blocks}"] = {"mib": found["backend_figures"]["attribute_bytes_resident"] / 2**20,
                                                     "pages": int(found["backend_figures"]["pages_resident"])}
    return [["lodestone", "generate", "scan", "--triangles", "100000", "--seed", "1", "..", "4"],
            ["lodestone", "render", "scans.scene.json", "--backend", "vgi", "--texture-blocks", "off|on", "--stats", "stats.json"]], rows


def around(mesh, *make):
    """Pictures of a mesh from cameras all around it, half of them 0.02 to 0.6 radii off the sphere around it and half up to 200, with all
    leaves there; make: the command for the mesh, or none."""

    def measured():
        views, near, middle, far = 200, 0.02, 0.6, 200
        with tempfile.TemporaryDirectory() as folder:
            lodestone, asset = [BIN + "lodestone", "-q"], f"{folder}/mesh.lode"
            run([*lodestone, "bake", made_or_given(mesh, make, folder), "-o", asset, "--backends", "vgi,full"])
            *centre, radius = json.loads(run([*lodestone, "info", asset, "--json"]))["bounds"]
            path = all_around(views, 1)
            for k, key in enumerate(path["keys"]):
                low, high = (near, middle) if k % 2 == 0 else (middle, far)
                away = radius * (1 + low * (high / low) ** ((k // 2 + 0.5) / (views // 2)))
                key["eye"], key["target"] = [c + away * e for c, e in zip(centre, key["eye"])], centre
            path["near"], path["far"] = 0.001 * radius, 300 * radius
            scene = {"lodestone": "scene", "version": 1, "assets": [{"name": "mesh", "file": "mesh.lode"}], "instances": [{"asset": "mesh"}],
                     "camera": path}
            pathlib.Path(f"{folder}/around.scene.json").write_text(json.dumps(scene))
            run([*lodestone, "bench", f"{folder}/around.scene.json", "--backends", "vgi", "--pixel-error", "0.25,1,4", "--size", "640x360",
                 "--frames", str(views), "--quality-frames", str(views), "-o", folder])
            report = json.loads((pathlib.Path(folder) / "report.json").read_text())
        rows = {f"{mesh.split('/')[-1]}, {row['pixel_error']:g} px": {
            key: row[key] for key in ("max_pixel_deviation", "background_leaks", "cracks", "ssim", "triangles")} for row in report["rows"] if
            row["backend"] == "vgi"}
        shown = [["lodestone", *make, "-o", mesh]] if make else []
        return [*shown, ["lodestone", "bake", mesh, "-o", "mesh.lode", "--backends", "vgi,full"],
                ["lodestone", "bench", "around.scene.json", "--backends", "vgi", "--pixel-error", "0.25,1,4", "--size", "640x360"]], rows

    return measured


def unwrapped(*meshes):
    """Reports of `unwrap`; meshes: name, options of unwrap, and the command that makes it, or none."""

    def measured():
        rows = {}
        with tempfile.TemporaryDirectory() as folder:
            for mesh, options, *make in meshes:
                if not make and "LODESTONE_DATA" not in os.environ:
                    continue
                out = f"{folder}/out.{'glb' if '--bake' in options else 'ply'}"
                report = json.loads(run([BIN + "lodestone", "-q", "unwrap", made_or_given(mesh, make, folder), "-o", out, *options, "--json"]))
                report.update({f"{part}_seconds": seconds for part, seconds in report.pop("seconds").items()})
                rows[" ".join([mesh.split("/")[-1], *options])] = {k: v for k, v in report.items() if isinstance(v, (int, float))}
        return [["lodestone", "unwrap", "MESH", "-o", "out.ply", "[--bake]", "--json"]], rows

    return measured


def retextured():
    """The coarsest levels of a scan with its texture in fragments, and with the texture in new squares."""
    rows = {}
    with tempfile.TemporaryDirectory() as folder:
        lodestone, mesh, asset = [BIN + "lodestone", "-q"], f"{folder}/scan.glb", f"{folder}/scan.lode"
        make = ["generate", "scan", "--triangles", "400000", "--seed", "7"]
        run([*lodestone, *make, "-o", mesh])
        options = ["--backends", "lod", "--order", "classic"]
        for name, how in (("as it is", []), ("retextured", ["--retexture"])):
            run([*lodestone, "bake", mesh, "-o", asset, *options, *how])
            lod = json.loads(run([*lodestone, "info", asset, "--json"]))["lod"]
            rows[name] = {"triangles": lod["errors"][0]["triangles"], "base_triangles": lod["base_triangles"]}
    return [["lodestone", *make, "-o", "scan.glb"], ["lodestone", "bake", "scan.glb", "-o", "scan.lode", *options, "[--retexture]"]], rows


def models(*meshes):
    """Models of some ten thousand to some hundred thousand triangles, by every backend, on `bench`'s own flight."""

    def measured():
        rows = {}
        bake_options = ["--backends", "vgi,lod,discrete,full"]
        options = ["--backends", "full,discrete,lod,vgi", "--pixel-error", "1", "--size", "640x360", "--frames", "60", "--quality-frames", "6",
                   "--equal-error", "ssim"]
        with tempfile.TemporaryDirectory() as folder:
            lodestone, asset = [BIN + "lodestone", "-q"], f"{folder}/model.lode"
            for mesh in meshes:
                run([*lodestone, "bake", made_or_given(mesh, (), folder), "-o", asset, *bake_options])
                run([*lodestone, "bench", asset, *options, "-o", folder])
                report = json.loads((pathlib.Path(folder) / "report.json").read_text())
                full = next(row for row in report["rows"] if row["backend"] == "full")
                found = flown(report, (*FLOWN, "throughput_fps"))
                vgi = found["vgi bintree, 1 px"]
                for other in ("lod", "discrete"):
                    as_good = [row for row in report["rows"] if row["backend"] == other and row["ssim"] >= vgi["ssim"]]
                    if as_good:
                        coarsest = max(as_good, key=lambda row: row["pixel_error"])
                        vgi[f"over_{other}_as_good"] = vgi["throughput_fps"] / coarsest["throughput_fps"]
                for name, row in found.items():
                    row.update(full_triangles=full["triangles"], full_fps=full["throughput_fps"])
                    rows[f"{mesh.split('/')[-1]}: {name}"] = row
        return [["lodestone", "bake", "MODEL", "-o", "model.lode", *bake_options], ["lodestone", "bench", "model.lode", *options]], rows

    return measured


def generated(shape, triangles=100000):
    return f"{shape}.ply", "generate", shape, "--triangles", str(triangles), "--seed", "1"


AROUND = {f"around-{name}": around(*mesh) for name, mesh in (
    ("cliff", generated("cliff")), ("rock", generated("rock")), ("vase", generated("vase")), ("terrain", generated("terrain")),
    ("helmet", ["gltf/DamagedHelmet/DamagedHelmet.glb"]), ("bunny", ["scans/stanford-bunny.obj"]), ("laurana", ["scans/laurana.ply"]),
    ("lucy", ["scans/lucy.ply"]), ("blade", ["scans/turbineblade.ply"]), ("rocker-arm", ["scans/rockerArm.ply"]),
    ("falcon", ["scans/falconstatue_boundary.obj"]))}
FLIGHT = ("--backends", "full,discrete,lod,vgi", "--pixel-error", "1,2,4", "--frames", "30", "--quality-frames", "3")
MEASUREMENTS = {
    "read": google_benchmark("bench_read"),
    "simplify": google_benchmark("bench_simplify", "--benchmark_min_time=1"),
    "simplify-quality": quality,
    "asset-size": asset_size,
    "orders": orders(("keyframe", "fifo16", 8), ("keyframe", "fifo16", 2), ("keyframe", "fifo32", 8), ("keyframe", "nvidia", 8),
                     ("greedy", "fifo16", 8), ("greedy", "fifo16", 6)),
    "cursor": google_benchmark("bench_cursor"),
    "cut": google_benchmark("bench_cut"),
    "plan": google_benchmark("bench_plan", "--benchmark_repetitions=9", "--benchmark_enable_random_interleaving=true"),
    "bake-rock-300k": bake("rock", 300000, "--backends", "lod,vgi"),
    "bake-rock-3m": bake("rock", 3000000, "--backends", "vgi", "--clusters", "130"),
    "bake-terrain-3m": bake("terrain", 3000000, "--backends", "vgi", "--clusters", "130"),
    "flight-rock": flight("assets/rock.scene.json", *FLIGHT),
    "flight-cliff": flight("assets/cliff.scene.json", *FLIGHT),
    "flight-field": flight("assets/field-10k.scene.json", "--backends", "discrete,lod,vgi", "--pixel-error", "1", "--frames", "60",
                           "--quality-frames", "0"),
    "flight-far": flight("assets/far.scene.json", "--backends", "full,discrete,lod,vgi", "--pixel-error", "1", "--frames", "30", "--quality-frames", "6"),
    "textures-helmet": textures("gltf/DamagedHelmet/DamagedHelmet.glb"),
    "unwrap": unwrapped(
        *((f"{shape}-{triangles // 1000}k.ply", (), "generate", shape, "--triangles", str(triangles), "--seed", "7")
          for shape, triangles in (("rock", 1000000), ("rock", 3000000), ("terrain", 1000000), ("cliff", 300000), ("vase", 300000))),
        *(("scan-400k.glb", how, "generate", "scan", "--triangles", "400000", "--seed", "7") for how in ((), ("--bake",))),
        *((mesh, ()) for mesh in ("scans/stanford-bunny.obj", "scans/lucy.ply", "scans/laurana.ply", "scans/igea.ply", "scans/turbineblade.ply",
                                  "scans/rockerArm.ply", "scans/falconstatue_boundary.obj", "nasty/brain.ply")),
        ("gltf/DamagedHelmet/DamagedHelmet.glb", ("--bake",))),
    "retexture": retextured,
    "models": models("gltf/DamagedHelmet/DamagedHelmet.glb", "gltf/ToyCar/ToyCar.gltf", "scans/laurana.ply", "scans/lucy.ply", "scans/igea.ply",
                     "scans/turbineblade.ply"),
    "texture-memory": texture_memory,
    "textures-scan": textures("scan.glb", "generate", "scan", "--triangles", "100000", "--seed", "7"),
    **AROUND,
}


# What was flown on a GPU, by the scene; `take` keeps it.
ON_A_GPU = {f"gpu-{scene}": f"build/release/bin/lodestone bench assets/{scene}.scene.json {options}" for scene, options in (
    ("rock", "--pixel-error 1,2,4 --frames 60 --quality-frames 2"),
    ("cliff", "--pixel-error 1,2,4 --frames 60 --quality-frames 2"),
    ("far", "--frames 60 --quality-frames 2"),
    ("rock-3m", "--backends discrete,vgi --pixel-error 1,4 --frames 60 --quality-frames 0"),
    ("field-10k", "--backends discrete,lod,vgi --frames 60 --quality-frames 0"))}


def take(name, path):
    report = json.loads(pathlib.Path(path).read_text())
    if report["machine"]["software"]:
        sys.exit(f"figures: {path} is of {report['machine']['device']}, which is no GPU")
    made_at = report["machine"]["commit"]
    result = {"commit": made_at, "date": run(["git", "show", "-s", "--format=%cs", made_at]).strip(), "commands": [ON_A_GPU[name]],
              "machine": report["machine"], "rows": flown(report, (*FLOWN, "gpu_ms", "throughput_fps"))}
    result_path(name).write_text(json.dumps(result, indent=1) + "\n")


def processor():
    for line in open("/proc/cpuinfo", encoding="utf-8"):
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return platform.processor()


def commit():
    return dict(zip(("commit", "date"), run(["git", "show", "-s", "--format=%h %cs", "--abbrev=12", "HEAD"]).split()))


def measure(names):
    RESULTS.mkdir(parents=True, exist_ok=True)
    for name in names or MEASUREMENTS:
        commands, rows, *machine = MEASUREMENTS[name]()
        result = {**commit(), "commands": [" ".join(words) for words in commands],
                  "machine": machine[0] if machine else {"cpu": processor()}, "rows": rows}
        result_path(name).write_text(json.dumps(result, indent=1) + "\n")


# ------------------------------------------------------------------------------------------------------------------ writing


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return lines + ["| " + " | ".join(row) + " |" for row in rows]


def number(value, digits=3):
    """A figure as the page shows it: `digits` significant digits, whole numbers whole."""
    if value is None:
        return "-"
    if isinstance(value, int) or float(value).is_integer() and abs(value) < 1e9:
        return str(int(value))
    if abs(value) >= 10 ** digits:
        return str(round(value))
    return f"{value:.{digits}g}"


def columns(rows, names):
    """A table of all rows; `names`: (head, key or function of a row)."""
    body = []
    for name, row in rows.items():
        body.append([name] + [number(key(row) if callable(key) else row.get(key)) for _, key in names])
    return table(["", *(head for head, _ in names)], body)


def read_section(result):
    return columns(result["rows"], [("ms", "ms"), ("CPU, ms", "cpu_ms")])


def simplify_section(result):
    by_mesh = {}
    for name, row in result["rows"].items():
        who, _, mesh = name.partition("/")
        by_mesh.setdefault(mesh, {})[who] = row
    body = []
    for mesh, sides in by_mesh.items():
        ours = next((row for who, row in sides.items() if who != "openmesh"), None)
        rival = sides.get("openmesh")
        body.append([mesh, number(ours["cpu_ms"] if ours else None), number(rival["cpu_ms"] if rival else None),
                     number(rival["cpu_ms"] / ours["cpu_ms"]) if ours and rival else "-"])
    return table(["mesh", "CPU, ms", "OpenMesh, CPU, ms", "ratio"], body)


def quality_section(result):
    return columns(result["rows"], [("triangles", "triangles"), ("rms against OpenMesh", "rms_ratio"), ("largest against meshoptimizer", "max_ratio")])


def asset_size_section(result):
    return columns(result["rows"], [("triangles", "triangles"), ("bytes a triangle", "bytes_per_triangle"), ("connectivity", "connectivity"),
                                    ("vertices", "vertices"), ("orders", "orders"), ("errors", "errors"),
                                    ("opened, M triangles/s", "open_mtri_per_s"), ("prefix, any n", "prefix"),
                                    ("prefix, at block ends", "prefix_at_ends")])


def orders_section(result):
    return columns(result["rows"], [("moves per ecol", "moved_per_ecol"), ("ATVR, even levels", "atvr_mean"), ("worst level", "atvr_worst"),
                                    ("ATVR, log levels", "atvr_log"), ("fresh meshoptimizer", "atvr_fresh_meshoptimizer"), ("random order", "atvr_random"),
                                    ("worst case", "atvr_worst_case"), ("lines of index buffer per ecol", "cache_lines_per_ecol"), ("bytes per ecol", "bytes_per_ecol"),
                                    ("s per 100k", "order_seconds")])


def timed_section(result):
    keys = []
    for row in result["rows"].values():
        keys += [key for key in row if key not in keys and key not in ("ms", "cpu_ms", "items_per_second")]
    return columns(result["rows"], [("ms", "ms"), *((key.replace("_", " "), key) for key in keys)])


def plan_section(result):
    lines = timed_section(result)
    pairs = [(name, name[:-len("10000")] + "20") for name in result["rows"] if name.endswith("/10000")]
    pairs += [("vgi/rocks_in_one_atlas/16", "vgi/rocks_in_one_atlas/1"), ("vgi/arrival/900", "vgi/arrival/6")]
    ratios = [[big, small, number(result["rows"][big]["ms"] / result["rows"][small]["ms"])] for big, small in pairs
              if big in result["rows"] and small in result["rows"]]
    return lines + ["", "What grows where only what is out of view grows:", ""] + table(["", "against", "ratio"], ratios)


def bake_section(result):
    (name, row), = result["rows"].items()
    triangles = row["triangles"]
    body = [["whole bake, s", number(row["seconds"])], ["peak memory, MB", number(row["peak_rss_bytes"] / 1e6)],
            ["bytes per source triangle", number(row["out_bytes"] / triangles)]]
    for key, value in row.items():
        if "." in key and key.split(".", 1)[0] in ("lod", "vgi"):
            body.append([f"`{key}`", number(value)])
    return table([name.replace(" ", ", ") + " triangles", ""], body)


def flight_section(result):
    full = result["rows"].get("full", {}).get("ms_median")
    return columns(result["rows"], [
        ("triangles", "triangles"), ("ms, median", "ms_median"), ("`full` over it", lambda row: full / row["ms_median"] if full else None),
        ("p99", "ms_p99"), ("jolt", "ms_jolt"), ("plan, CPU ms", "cpu_plan_ms"), ("other threads, CPU ms", "cpu_ms"), ("ACMR", "acmr"),
        ("PSNR, dB", "psnr_db"), ("SSIM", "ssim"), ("deviation, px", "max_pixel_deviation"), ("leaks", "background_leaks"),
        ("MB held", lambda row: row["resident_bytes"] / 1e6)])


def textures_section(result):
    return columns(result["rows"], [("SSIM", "ssim"), ("PSNR, dB", "psnr_db"), ("triangles", "triangles"), ("bytes of mesh or atlas", "bytes")])


def texture_memory_section(result):
    return columns(result["rows"], [("MiB of textures", "mib"), ("pages", "pages")])


def unwrap_section(result):
    seconds = lambda part: lambda row: row.get(f"{part}_seconds")
    return columns(result["rows"], [
        ("triangles", "source_triangles"), ("charts", "charts"), ("cut, %", lambda row: 100 * row["cut_share"]), ("stretch, L2", "l2_stretch_rms"),
        ("worst chart", "l2_stretch_worst"), ("covered, %", lambda row: 100 * row["coverage"]), ("turned over", "flipped_triangles"),
        ("overlaps", "overlapping_pairs"), ("s, all", seconds("all")), ("clusters", seconds("cluster")), ("charts", seconds("lay_out")),
        ("textures", seconds("bake")), ("reading", seconds("read")), ("writing", seconds("write"))])


def models_section(result):
    return columns(result["rows"], [
        ("triangles", "triangles"), ("of `full`'s", lambda row: row["triangles"] / row["full_triangles"]), ("SSIM", "ssim"),
        ("PSNR, dB", "psnr_db"), ("deviation, px", "max_pixel_deviation"), ("ms, median", "ms_median"), ("frames/s, overlapping", "throughput_fps"),
        ("of `full`'s", lambda row: row["throughput_fps"] / row["full_fps"]), ("of those of a `lod` as good", "over_lod_as_good"),
        ("of a `discrete` as good", "over_discrete_as_good")])


def retexture_section(result):
    return columns(result["rows"], [("triangles", "triangles"), ("of the coarsest level", "base_triangles")])


def around_section(result):
    return columns(result["rows"], [("deviation, px", "max_pixel_deviation"), ("leaks", "background_leaks"), ("cracks", "cracks"), ("SSIM", "ssim"),
                                    ("triangles", "triangles")])


def gpu_section(result):
    full = result["rows"].get("full", {}).get("throughput_fps")
    return columns(result["rows"], [
        ("triangles", "triangles"), ("ms, median", "ms_median"), ("device ms", "gpu_ms"), ("frames/s, overlapping", "throughput_fps"),
        ("of `full`'s", lambda row: row["throughput_fps"] / full if full else None), ("other threads, CPU ms", "cpu_ms"), ("ACMR", "acmr"),
        ("SSIM", "ssim"), ("deviation, px", "max_pixel_deviation"), ("MB held", lambda row: row["resident_bytes"] / 1e6)])


SECTIONS = [
    ("Reading", "Binary PLY with normals and texture coordinates, 3M triangles.", [("read", read_section)]),
    ("Simplification", "To the coarsest level, attributes included; OpenMesh's `ModQuadric` to 1% of the triangles.",
     [("simplify", simplify_section)]),
    ("Quality of simplification", "Two-sided distances at a share of the triangles, ours over a rival's: below 1 is better.",
     [("simplify-quality", quality_section)]),
    ("Size of progressive meshes", "Positions alone, one order `keyframe`, nothing rounded. Bytes of the whole file, by what they tell; triangles "
     "opened a second of CPU on one core; the share of the file that the coarsest n of N triangles need, over n / N, at worst from 1% on.",
     [("asset-size", asset_size_section)]),
    ("Vertex-cache orders", "A generated rock of 100k triangles; objective, then the moves per collapse that were asked for. ATVR counts "
     "vertex shader runs per vertex, in a simulated cache of the objective.", [("orders", orders_section)]),
    ("Steps of progressive meshes", "The cursor through levels.", [("cursor", timed_section)]),
    ("Cuts of geometry images", "A rock of a million triangles, all pages there, one thread; `go_on` continues from the cut before.",
     [("cut", timed_section)]),
    ("Plans", "CPU of all our threads a frame; N instances of which 20 are in view, still or 1% of them moving. Medians of 9 "
     "interleaved repetitions.", [("plan", plan_section)]),
    ("Bakes", "Fields are those of the bake report ([cli.md](cli.md)).",
     [("bake-rock-300k", bake_section), ("bake-rock-3m", bake_section), ("bake-terrain-3m", bake_section)]),
    ("Flights", "1280x720, every backend through the same scene. Columns are those of the report ([cli.md](cli.md)).",
     [("flight-rock", flight_section), ("flight-cliff", flight_section), ("flight-far", flight_section),
      ("flight-field", flight_section)]),
    ("Models", "640x360, `bench`'s own flight at a pixel, textures baked into the atlas. As good: at the largest pixel error tried at which the "
     "SSIM is no less than that of `vgi` at a pixel; none where it never is.", [("models", models_section)]),
    ("Textures", "Seven views all around at a pixel, lit, against `full` with 16 samples a pixel. `--keep-uv` looks the source's textures up; otherwise "
     "what they hold is in the atlas ([materials.md](materials.md)).", [(name, textures_section) for name in ("textures-helmet", "textures-scan")]),
    ("Texture memory", "1280x720, a pixel: what is held of baked textures, small levels included, and pages of any kind. Four scans of 100k triangles with "
     "64 million texels together.", [("texture-memory", texture_memory_section)]),
    ("Unwrapping", "Two cores. One square, 4096 texels a side with 4 between charts ([unwrap.md](unwrap.md)).", [("unwrap", unwrap_section)]),
    ("Simplification through fragments", "A generated scan with its texture in 20,000 fragments, `lod`.", [("retexture", retexture_section)]),
    ("From all around", "`vgi`, 200 cameras all around, half of them 0.02 to 0.6 radii off the sphere around the mesh and half 0.6 to 200. The largest "
     "deviation of any.", [(name, around_section) for name in AROUND]),
    ("Flights on a GPU", "1280x720. ACMR is counted by the device. An H200 is made for computing: of an H100's units two draw "
     "(NVIDIA, *H100 Tensor Core GPU Architecture*). The shadow map takes 0.7 ms or more of every frame.", [(name, gpu_section) for name in ON_A_GPU]),
]


def results():
    return {path.stem: json.loads(path.read_text()) for path in sorted(RESULTS.rglob("*.json"))}


def page(found):
    lines = ["# Figures", "",
             "`scripts/figures.py write` made this page from `bench/results`; `scripts/figures.py measure` makes those. Times are of a shared "
             "machine with two cores: compare them within one table. Values of earlier commits are in `bench/history`; "
             "`scripts/plot-history.py` draws them."]
    for title, text, parts in SECTIONS:
        parts = [(name, section) for name, section in parts if name in found]
        if not parts:
            continue
        lines += ["", f"## {title}", "", text]
        for name, section in parts:
            result = found[name]
            machine = ", ".join(str(result["machine"][key]) for key in ("cpu", "device") if result["machine"].get(key))
            lines += ["", *(f"`{command}`  " for command in result["commands"]), f"{machine}; commit {result['commit']}", "", *section(result)]
    return "\n".join(lines) + "\n"


def write_history(found):
    """One CSV for each commit of the results. What was measured at that commit and is measured anew since stays in it."""
    HISTORY.mkdir(parents=True, exist_ok=True)
    by_commit = {}
    for name, result in found.items():
        for row, figures in result["rows"].items():
            for figure, value in figures.items():
                by_commit.setdefault(result["commit"], []).append((result["date"], name, row, figure, f"{value:.6g}"))
    for made_at, rows in by_commit.items():
        path = next(HISTORY.rglob(f"{made_at}.csv"), HISTORY / f"{made_at}.csv")
        measured = {row[1] for row in rows}
        if path.exists():
            with open(path, newline="", encoding="utf-8") as before:
                rows += [tuple(row) for row in list(csv.reader(before))[1:] if row[1] not in measured]
        with open(path, "w", newline="", encoding="utf-8") as out:
            writer = csv.writer(out, lineterminator="\n")
            writer.writerow(("date", "measurement", "row", "figure", "value"))
            writer.writerows(sorted(rows))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("verb", choices=("measure", "write", "check", "list", "take"))
    parser.add_argument("names", nargs="*", metavar="NAME")
    given = parser.parse_args()
    unknown = [name for name in given.names if name not in MEASUREMENTS]
    if given.verb == "take":
        if len(given.names) != 2 or given.names[0] not in ON_A_GPU:
            sys.exit(f"figures: take NAME REPORT; names are {', '.join(ON_A_GPU)}")
        take(*given.names)
    elif unknown:
        sys.exit(f"figures: no measurement is named {unknown[0]}; there are {', '.join(MEASUREMENTS)}")
    elif given.verb == "list":
        print("\n".join(MEASUREMENTS))
    elif given.verb == "measure":
        measure(given.names)
    elif given.verb == "write":
        found = results()
        PAGE.write_text(page(found), encoding="utf-8")
        write_history(found)
    elif PAGE.read_text(encoding="utf-8") != page(results()):
        sys.exit("figures: docs/figures.md is not what bench/results says; run scripts/figures.py write")


if __name__ == "__main__":
    main()
