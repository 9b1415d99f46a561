#!/usr/bin/env python3
"""Draws figures over commits from bench/history: scripts/plot-history.py FOLDER [PATTERN...]

A PATTERN is a wildcard for MEASUREMENT/ROW/FIGURE; without one, frame times and SSIM of flights at one pixel, and bakes. A plot for
each figure, FOLDER/FIGURE.svg, with a line for each row. Needs gnuplot.
"""
import csv
import fnmatch
import pathlib
import subprocess
import sys

HISTORY = pathlib.Path(__file__).resolve().parent.parent / "bench" / "history"
USUAL = ("flight-*/*/ms_median", "flight-*/*/ssim", "bake-*/*/seconds", "bake-*/*/out_bytes")


def chosen(patterns):
    """{figure: {measurement/row: [(commit number, value)]}}, and the commits from the oldest."""
    files = []
    for path in HISTORY.rglob("*.csv"):
        rows = list(csv.DictReader(path.open(encoding="utf-8")))
        if rows:
            files.append((rows[0]["date"], path.stem, rows))
    files.sort(key=lambda file: file[:2])
    plots = {}
    for place, (_, _, rows) in enumerate(files):
        for row in rows:
            name = f"{row['measurement']}/{row['row']}"
            if any(fnmatch.fnmatch(f"{name}/{row['figure']}", pattern) for pattern in patterns):
                plots.setdefault(row["figure"], {}).setdefault(name, []).append((place, float(row["value"])))
    return plots, [f"{date} {commit[:7]}" for date, commit, _ in files]


def draw(figure, lines, commits, folder):
    ticks = ", ".join(f'"{name}" {place}' for place, name in enumerate(commits))
    plots = ", ".join(f'"-" using 1:2 with linespoints title "{name}"' for name in lines)
    data = "".join("".join(f"{place} {value}\n" for place, value in points) + "e\n" for points in lines.values())
    program = (f'set terminal svg size 1100,{360 + 14 * len(lines)} font "sans-serif,12" background rgb "white" noenhanced\nset grid lc rgb "#dddddd"\n'
               f'set key outside below\nset output "{folder / (figure.replace(".", "-") + ".svg")}"\nset title "{figure}"\n'
               f"set xtics rotate by -30 ({ticks})\nset xrange [-0.2:{len(commits) - 0.8}]\nplot {plots}\n{data}")
    subprocess.run(["gnuplot"], input=program, text=True, check=True)


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    plots, commits = chosen(sys.argv[2:] or USUAL)
    if not plots:
        sys.exit("plot-history: no figure in bench/history has such a name")
    for figure, lines in plots.items():
        draw(figure, lines, commits, folder)
        print(folder / (figure.replace(".", "-") + ".svg"))


if __name__ == "__main__":
    main()
