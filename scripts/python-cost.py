#!/usr/bin/env python3
"""What calls cost from Python over the same calls from C++: CPU seconds, the least of several tries, one thread.

    PYTHONPATH=build/release/python /usr/bin/python3 scripts/python-cost.py [--triangles 1000000] [--repeats 3]
"""
import argparse
import json
import pathlib
import subprocess
import time

import lodestone
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent


def least(repeats, call):
    times = []
    for _ in range(repeats):
        begun = time.process_time()
        call()
        times.append(time.process_time() - begun)
    return min(times)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=ROOT / "build/release/bin/bench_embed_calls")
    parser.add_argument("--triangles", type=int, default=1000000)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    lodestone.set_threads(1)
    rock = lodestone.generate("rock", options.triangles)
    positions, triangles = np.array(rock.positions), np.array(rock.triangles)
    mesh = lodestone.Mesh(positions, triangles)
    here = {
        "Mesh": least(5 * options.repeats, lambda: lodestone.Mesh(positions, triangles)),
        "simplify": least(options.repeats, lambda: lodestone.simplify(mesh, triangles=len(triangles) // 10)),
        "cache_cost": least(5 * options.repeats, lambda: lodestone.cache_cost(triangles)),
    }
    there = json.loads(subprocess.run([options.program, str(options.triangles), str(options.repeats)], check=True, capture_output=True).stdout)
    print(f"{len(triangles)} triangles\n| call | Python, s | C++, s | times |\n|---|---|---|---|")
    for call, seconds in here.items():
        print(f"| {call} | {seconds:.4f} | {there[call]:.4f} | {seconds / there[call]:.3f} |")


if __name__ == "__main__":
    main()
