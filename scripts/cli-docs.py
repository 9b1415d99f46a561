#!/usr/bin/env python3
"""Writes docs/cli.md from what the program says of itself: scripts/cli-docs.py [--program PROGRAM] [--check]

Help texts come from --help, names of JSON fields from a bake of a tiny mesh. With --check nothing is written: exit 1
and a diff where docs/cli.md is not what would be written.
"""
import argparse
import difflib
import json
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "cli.md"

INTRODUCTION = """\
# The command line

`scripts/cli-docs.py` makes this page from `lodestone --help`, `lodestone SUBCOMMAND --help` and the JSON of a small bake; a test
compares them. To change a text here, change it in `apps/` or in that script, and run the script.

The program is `build/release/bin/lodestone`. [scenes.md](scenes.md) describes scenes and camera paths,
[glossary.md](glossary.md) explains the words, [architecture.md](architecture.md) the backends.
"""

STREAMS = """\
## Output

- Results go to stdout. `--json` makes them one JSON document. `-q` leaves out the summaries of `bake`, `extract`, `render` and `view`.
- Progress, warnings and errors go to stderr. A terminal shows progress in one line; elsewhere only `-v` shows it, a line per stage.
- An error is one line: the file, the place, what is wrong, what to do.
- A file that is written appears whole or not at all.
- `-v` and `-q` may stand before or after the subcommand.
"""

FIELDS = """\
## JSON

`--json` prints one document to stdout: {json_commands}.
`library --json` has `meshes`, `baked`, `there`, `refused`, `failed` and `left`; [library.md](library.md) tells what a line of `results.jsonl` has.
`bake --report` and `render --stats` write one to a file, `bench` writes `report.json`. Scripts may rely on the names; new ones may be added. Lengths and errors are in object units, times in seconds, sizes
in bytes, unless a name or the table says otherwise. `[]` stands for every element of a list.

`render --stats`, `bench` and `tune` name what they ran on in `machine` (`cpu`, `device`, `driver`, `software`, `commit`). `bench` has
a member of `rows` for each backend, face order, raster path and pixel error; [src/report/rows.h](../src/report/rows.h) tells what
each of its fields is. The row of `render --stats` has those that one frame can have. The most used:

| field | meaning |
|---|---|
| `ms_median`, `ms_p95`, `ms_p99`, `ms_max` | time of a frame, from its plan to its fence, all passes, milliseconds |
| `ms_floor` | the same for an empty scene |
| `throughput_fps`, `throughput_fps_min`, `throughput_fps_max` | frames a second of a flight on which frames overlap: of all its time, of the longest and of the shortest time from the end of a frame to that of the next; `frames_in_flight` are under way at once |
| `fps_mean`, `fps_min`, `fps_max` | frames a second where each frame is waited for: the same of `ms_*` |
| `period_median_ms`, `period_p95_ms`, `fps_median` | of `tune`: the time from the end of a frame to that of the next, where frames overlap, which is what it searches by; its `ms_*` are those of one frame in flight at the error found; `controlled.ms` are periods, too |
| `resident_bytes`, `buffer_bytes` | of all buffers of the backend, with what frames under way read of sizes that buffers had before: as the backend counts them, and as the renderer allocated them |
| `cpu_plan_ms`, `cpu_ms`, `gpu_ms` | processor time of the plan on the render thread, of the threads that cut, decode and read beside it; device time of all passes; milliseconds a frame |
| `stages_gpu_ms` | of `bench`: device time of each stage, by its name; medians |
| `triangles`, `vertex_invocations` | per frame; vertices are counted in all passes |
| `acmr`, `acmr_fifo16` | vertex shader runs per triangle of the colour pass: counted by the device; simulated for a FIFO of 16 |
| `psnr_db`, `ssim` | luminance against a picture of the whole mesh with 16 samples a pixel, over pixels that either covers |
| `max_pixel_deviation` | largest distance between the surfaces drawn and the whole mesh, both ways, in pixels at that depth |
| `background_leaks` | pixels that show the background inside the whole mesh, by at least two pixels more than the pixel error |
| `cracks` | those of them around which one sheet of the whole mesh covers every pixel; the others lie between two outlines, each of which may be off, or beside a rim |
"""

# What each field is, of the subcommands whose JSON is looked at here.
BAKE = {
    "bounds": "sphere around the mesh: centre, radius",
    "discrete.bytes": "size of the chain in the asset",
    "discrete.levels": "levels of the chain, full detail included",
    "discrete.seconds": "time to make it",
    "input.attributes": "which of normals, uvs, second_uvs, tangents, colours, materials the mesh has",
    "input.boundary_loops": "closed chains of boundary edges, after repair as all of `input`",
    "input.components": "pieces connected through shared vertices",
    "input.genus": "sum over components, with holes filled; -1 where the mesh is no oriented manifold",
    "input.seam_edges": "inner edges whose two triangles have different attributes",
    "input.triangles": "triangles",
    "input.vertices": "points of the surface; a vertex with several sets of attributes counts once",
    "lod.base_triangles": "triangles of the coarsest level",
    "lod.blocked_by_flips": "collapses refused at the end because they turn a triangle over",
    "lod.blocked_by_topology": "collapses refused at the end because they change the topology or tear a boundary or seam",
    "lod.bytes": "size of the progressive mesh in the asset",
    "lod.error_cpu_seconds": "processor time to measure the errors of levels",
    "lod.error_seconds": "time of that",
    "lod.levels": "levels; the last is the coarsest",
    "lod.moved_per_ecol": "faces that the first order moves per edge collapse",
    "lod.order_seconds": "time to make the face orders",
    "lod.permutation_bytes": "permutations of faces, of the order that has most",
    "lod.search_stopped_early": "whether `--order-seconds` made a search shorter",
    "lod.simplify_cpu_seconds": "processor time of simplification",
    "lod.stopped_because": "why simplification ended",
    "lod.triangles": "triangles of level 0",
    "name": "file name of the mesh",
    "options": "options that the bytes depend on; a weight below 0 stands for the default",
    "out_bytes": "size of the asset",
    "peak_rss_bytes": "most memory held at once",
    "program": "program and version",
    "repair.degenerate_triangles": "dropped: a vertex twice in one triangle",
    "repair.duplicate_triangles": "dropped: the vertices of an earlier triangle",
    "repair.flipped_triangles": "turned round, to agree with neighbours or to face outwards",
    "repair.non_manifold_edges": "edges that had more than two triangles",
    "repair.non_manifold_vertices": "vertices that had several fans of triangles, split",
    "repair.non_orientable_edges": "edges cut because no orientation agrees across them",
    "repair.unreferenced_vertices": "dropped: in no triangle",
    "repair.welded_vertices": "merged into a vertex at the same position",
    "retexture.charts": "`--retexture`: charts that the textures lie in now",
    "retexture.resolution": "texels along a side of their square",
    "retexture.seam_edges": "inner edges whose two triangles lie in different charts",
    "retexture.seconds": "time of that",
    "retexture.triangles": "triangles, with those that had to be cut",
    "seconds": "time of the whole bake",
    "source_hash": "of the file's content",
    "vgi.attribute_resolution": "samples of normals, colours and texture coordinates along a side of a chart",
    "vgi.buckets": "spatial parts in which clusters were made first",
    "vgi.bytes": "size of the atlas in the asset",
    "vgi.charts": "quad charts",
    "vgi.clusters": "clusters made; more than asked for where topology or stretch needs them",
    "vgi.coarse_charts": "charts without samples of the finest levels, because they are small or have few triangles",
    "vgi.features_on_borders": "share of the length of creases and of edges of colour or material that lies on borders",
    "vgi.flipped_triangles": "triangles turned over on a chart",
    "vgi.folded_cells": "cells of the finest level with a triangle that looks inwards, before samples are moved",
    "vgi.l2_stretch_rms": "L2 stretch over all charts; 1 is even",
    "vgi.l2_stretch_tutte": "the same before charts are evened out",
    "vgi.l2_stretch_worst": "L2 stretch of the worst chart",
    "vgi.lone_triangles": "triangles without neighbours, cut into four",
    "vgi.max_error": "largest distance between the finest level and the mesh, both ways, as a share of the diagonal",
    "vgi.missing_samples": "samples that lie in no triangle; 0 in every asset that is written",
    "vgi.not_recentred": "corners and centres of charts that stayed where they were",
    "vgi.resolution": "samples of positions along a side of the deepest chart",
    "vgi.rms_error": "root of the mean square of that distance, as a share of the diagonal",
    "vgi.rounds": "rounds of clustering; more than one where charts came out bad",
    "vgi.seconds.buckets": "time to cut the mesh into buckets",
    "vgi.seconds.cluster": "time to cluster inside them",
    "vgi.seconds.hierarchy": "time to measure errors of samples, pages and levels",
    "vgi.seconds.merge": "time to cluster everywhere",
    "vgi.seconds.parameterise": "time to lay out charts",
    "vgi.seconds.quadrangulate": "time to cut clusters into quads",
    "vgi.seconds.resample": "time to sample charts",
    "vgi.seconds.straighten": "time to straighten borders",
    "vgi.split_boundary_chords": "inner edges with both ends on the boundary, split",
    "vgi.split_long_edges": "edges split because they were long",
    "vgi.still_folded_cells": "as `folded_cells`, in the asset",
    "vgi.stretched_charts": "charts above `--worst-stretch`",
    "vgi.charts_without_leaves": "charts whose triangles are too thin to be cut into squares: they are drawn from samples",
    "vgi.leaf_triangles": "triangles of all leaves: the source's, cut along the sides of pages",
    "vgi.template_charts": "charts of components too small for clusters",
    "vgi.textures_baked": "whether what textures hold lies in the atlas",
    "vgi.uniform_charts": "charts laid out with equal weights, because better ones folded",
    "vgi.uniform_clusters": "clusters flattened with equal weights, likewise",
    "warnings": "what the reader warned of",
}
INFO = {
    "bytes": "size of the asset",
    "chunks[].bytes": "size of a chunk",
    "chunks[].hash": "of its content",
    "chunks[].name": "its name; [file-format.md](file-format.md) lists them",
    "discrete.levels[].error": "largest distance to the mesh, both ways",
    "discrete.levels[].rms_error": "the same, root of the mean square",
    "discrete.levels[].triangles": "triangles",
    "file": "file name of the asset",
    "format_version": "of the file format",
    "lod.bytes_per_triangle": "bytes of `stored_bytes` together, over the triangles that are there",
    "lod.diagonal": "of the box around the mesh, object units",
    "lod.distinct_errors": "how many different errors the levels have",
    "lod.errors[].error": "distance to the mesh, both ways: at least what is measured of this level and finer ones, object units",
    "lod.errors[].level": "a level with about 100, 50, 25, 10, 5, 2 or 1 percent of the triangles",
    "lod.errors[].triangles": "its triangles",
    "lod.largest_step": "largest share of the triangles that goes when an error grows by 1%, of 2,000 errors that draw more than 2,000 triangles",
    "lod.levels_missing": "with `--prefix`: how many levels are finer than those that are there; levels are numbered as in the whole file",
    "lod.median_step": "the median of these shares",
    "lod.orders[].keyframes": "levels at which this face order is made anew",
    "lod.orders[].moved_per_ecol": "faces it moves per edge collapse",
    "lod.orders[].name": "its name",
    "lod.orders[].permutation_bytes": "size of its permutations",
    "lod.stored_bytes.connectivity": "of the file, for the base and where each split lies",
    "lod.stored_bytes.errors": "for the errors of levels, and the ends of blocks",
    "lod.stored_bytes.orders": "for the face orders",
    "lod.stored_bytes.vertices": "for positions and attributes",
    "lod.vertices": "vertices with attributes of level 0",
    "options_hash": "of the options and the revision of the baker",
    "vgi.levels[].error": "largest distance to the mesh, both ways",
    "vgi.levels[].level": "0 is the source, of its leaves; 1 the finest samples",
    "vgi.levels[].triangles": "triangles of that level everywhere",
    "whole_bytes": "size of the asset when it was written; more than `bytes` where its end is missing",
}
VERIFY = {
    "checks[].message": "what is wrong; empty where nothing is",
    "checks[].name": "what was checked",
    "checks[].passed": "whether it holds",
    "file": "file name of the asset",
    "passed": "whether all hold; the exit code is 1 otherwise",
}
EXTRACT = {
    "error": "of the level, object units",
    "level": "0 is full detail",
    "triangles": "of the level",
}
ACMR = {
    "acmr_mean": "simulated vertex shader runs per triangle, mean over the levels",
    "atvr_mean": "the same per vertex; 1 is the limit",
    "atvr_worst": "the largest of a level",
    "bytes_per_ecol": "permutation data per edge collapse",
    "cache": "cache model",
    "cache_lines_per_ecol": "lines of 64 bytes of the index buffer written per edge collapse",
    "compare.classic.atvr_mean": "`--compare`: order `classic` of the asset",
    "compare.fresh_meshoptimizer.atvr_mean": "`--compare`: each level ordered anew by meshoptimizer",
    "compare.fresh_meshoptimizer_fifo.atvr_mean": "`--compare`: each level ordered anew by meshoptimizer, for a FIFO",
    "compare.fresh_tipsify.atvr_mean": "`--compare`: each level ordered anew by tipsify",
    "compare.random.atvr_mean": "`--compare`: the faces of each level shuffled",
    "compare.worst_case.atvr_mean": "`--compare`: three transforms for each triangle, what no order exceeds",
    "compare.static_meshoptimizer.atvr_mean": "`--compare`: meshoptimizer's order of full detail, dead faces taken out",
    "levels[].acmr": "of a level",
    "levels[].atvr": "of a level",
    "levels[].triangles": "its triangles",
    "levels[].vertices": "vertices they use",
    "moved_per_ecol": "faces moved per edge collapse",
    "order": "face order",
    "spacing": "how levels are spaced",
}

UNWRAP = {
    "baked": "whether textures were brought over",
    "charts": "pieces of the surface",
    "coverage": "share of the squares that triangles cover",
    "cut_share": "triangles that cuts have added, of those there were",
    "flipped_triangles": "turned over; 0, or there is no file",
    "gutter": "texels between charts",
    "l2_stretch_rms": "L2 stretch of all squares together, 1 where texels are spread evenly",
    "l2_stretch_worst": "that of the chart that is stretched most",
    "overlapping_pairs": "pairs of triangles that overlap; 0, or there is no file",
    "peak_rss_bytes": "most memory held at once",
    "resolution": "texels along a side of a square",
    "rounds": "rounds of clustering",
    "seam_edges": "inner edges between two charts",
    "seam_length": "length of them",
    "seconds.all": "time of the whole command",
    "seconds.bake": "time to bring textures over",
    "seconds.check": "time to look for flips and overlaps",
    "seconds.cluster": "time to divide the surface",
    "seconds.lay_out": "time to flatten charts",
    "seconds.pack": "time to pack charts and to put the mesh together",
    "seconds.read": "time to read and repair",
    "seconds.write": "time to write",
    "source_triangles": "triangles before, once repaired",
    "source_vertices": "vertices before",
    "textures": "squares",
    "triangles": "triangles written",
    "vertices": "points of the surface written",
}


def run(program, *arguments, folder=None):
    ended = subprocess.run([program, *arguments], cwd=folder, capture_output=True, text=True)
    if ended.returncode != 0:
        sys.exit(f"cli-docs: lodestone {' '.join(arguments)} ended with {ended.returncode}: {ended.stderr.strip()}")
    return ended.stdout


def help_of(program, *subcommand):
    """Description, and what follows it: usage, options, examples."""
    lines = [line.rstrip() for line in run(program, *subcommand, "--help").strip().splitlines()]
    usage = next(i for i, line in enumerate(lines) if line.startswith("Usage:"))
    return " ".join(lines[:usage]).strip(), "\n".join(lines[usage:]).strip()


def paths_of(value, known, path=""):
    """Every field, as a.b[].c. What `known` names and tells nothing of inside is not looked into."""
    inside = any(name.startswith((path + ".", path + "[")) for name in known)
    if (path in known and not inside) or not isinstance(value, (dict, list)):
        return {path}
    if isinstance(value, list):
        return set().union(*(paths_of(v, known, path + "[]") for v in value))
    return set().union(*(paths_of(v, known, f"{path}.{k}" if path else k) for k, v in value.items()))


def field_table(command, document, known, elsewhere=()):
    found = paths_of(json.loads(document), {**dict.fromkeys(elsewhere), **known}) - set(elsewhere)
    unknown, gone = sorted(found - set(known)), sorted(set(known) - found)
    if unknown or gone:
        sys.exit(f"cli-docs: {command} --json: scripts/cli-docs.py does not tell what {unknown} are, and names {gone} in vain")
    return "| field | meaning |\n|---|---|\n" + "".join(f"| `{name}` | {known[name]} |\n" for name in sorted(known))


def json_tables(program):
    with tempfile.TemporaryDirectory() as folder:
        run(program, "generate", "torus", "--triangles", "400", "-o", "torus.ply", folder=folder)
        run(program, "generate", "vase", "--triangles", "400", "-o", "vase.glb", folder=folder)
        small = ["--backends", "lod,vgi,discrete", "--clusters", "6", "--resolution", "9", "--error-samples", "1000", "--json"]
        run(program, "bake", "torus.ply", "-o", "torus.lode", *small, folder=folder)
        bake = run(program, "bake", "vase.glb", "-o", "vase.lode", "--retexture", *small, folder=folder)
        unwrap = run(program, "unwrap", "torus.ply", "-o", "torus.glb", "--json", folder=folder)
        of_asset = {name: run(program, name, "torus.lode", "--json", *more, folder=folder)
                    for name, more in (("info", []), ("verify", []), ("acmr", ["--levels", "2", "--compare"]),
                                        ("extract", ["--triangles", "100", "-o", "out.ply"]))}
    yield ("The bake report (`bake --json`, `bake --report`); `lod`, `vgi` and `discrete` are there where they were baked:",
           field_table("bake", bake, BAKE))
    yield ("`info --json` has of the bake report what the asset keeps (`name`, `program`, `options`, `input`, `repair`, `bounds`,\n"
           "`source_hash`, and some figures of `lod` and `vgi`), and:",
           field_table("info", of_asset["info"], INFO, BAKE))
    yield "`verify --json`:", field_table("verify", of_asset["verify"], VERIFY)
    yield "`extract --json`:", field_table("extract", of_asset["extract"], EXTRACT)
    yield "`unwrap --json`, `unwrap --report`:", field_table("unwrap", unwrap, UNWRAP)
    yield "`acmr --json`:", field_table("acmr", of_asset["acmr"], ACMR)


def page(program):
    description, text = help_of(program)
    subcommands = re.findall(r"^  (\w+) ", text.split("\nSubcommands:\n")[1].split("\n\n")[0], re.MULTILINE)
    codes = re.search(r"Exit codes: (.*?)\.\s", text, re.DOTALL)
    if not codes:
        sys.exit("cli-docs: lodestone --help does not tell the exit codes")
    helps = {name: help_of(program, name) for name in subcommands}
    with_json = ", ".join(f"`{name}`" for name, (_, body) in helps.items() if re.search(r"^  --json\b", body, re.MULTILINE))

    parts = [INTRODUCTION, f"{description}\n\n```\n{text}\n```\n", "## Exit codes\n\n| code | meaning |\n|---|---|\n" + "".join(
        "| {} | {} |\n".format(*code.split(" ", 1)) for code in re.split(r";\s+", codes.group(1))), STREAMS]
    for name, (about, body) in helps.items():
        parts.append(f"## {name}\n\n{about}.\n\n```\n{body}\n```\n")
    parts.append(FIELDS.format(json_commands=with_json))
    parts += [f"{heading}\n\n{table}" for heading, table in json_tables(program)]
    return "\n".join(parts)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=ROOT / "build/release/bin/lodestone", help="the built program")
    parser.add_argument("--check", action="store_true", help="compare, and write nothing")
    options = parser.parse_args()
    program = str(pathlib.Path(options.program).resolve())
    wanted = page(program)
    if not options.check:
        PAGE.write_text(wanted, encoding="utf-8")
        return 0
    there = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    sys.stdout.writelines(difflib.unified_diff(there.splitlines(True), wanted.splitlines(True), "docs/cli.md", "as the program has it"))
    if there != wanted:
        print("docs/cli.md is not what the program says: run scripts/cli-docs.py")
    return int(there != wanted)


if __name__ == "__main__":
    sys.exit(main())
