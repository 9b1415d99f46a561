"""Flies towards an object and counts what both techniques draw for an error of a pixel; shows the cut of an atlas as it is drawn.

    python3 triangles_by_distance.py [MESH] [--triangles 100000] -o picture.png
"""
import argparse

import lodestone
import matplotlib.pyplot as plt
import numpy as np

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("mesh", nargs="?", help="a mesh file; a generated rock unless given")
parser.add_argument("--triangles", type=int, default=100000, help="of the rock")
parser.add_argument("-o", "--out", default="triangles_by_distance.png")
options = parser.parse_args()

mesh = lodestone.read(options.mesh) if options.mesh else lodestone.generate("rock", options.triangles)
asset = lodestone.bake(mesh, backends=["lod", "vgi"], order="static")
centre, radius = asset.bounds
towards = np.array([0.5, 0.4, 1])
towards /= np.linalg.norm(towards)
distances = radius * np.geomspace(100, 2, 16)

figure, (curves, near, far) = plt.subplots(1, 3, figsize=(15, 4.5))
for backend in ("lod", "vgi"):
    cutter = asset.cutter(backend)
    for pixel_error, style in ((1, "-"), (4, ":")):
        drawn = [len(cutter.cut(centre + d * towards, width=1920, height=1080, pixel_error=pixel_error).triangles) for d in distances]
        curves.loglog(distances / radius, drawn, style, label=f"{backend}, {pixel_error} px")
curves.axhline(len(mesh.triangles), color="grey", linewidth=0.5)
curves.set_xlabel("distance, radii")
curves.set_ylabel("triangles drawn at 1920 x 1080")
curves.legend()

cutter = asset.cutter("vgi")
right = np.cross((0, 1, 0), towards)
right /= np.linalg.norm(right)
plane = np.stack([right, np.cross(towards, right)], axis=1)
for panel, d in ((near, 4), (far, 40)):
    cut = cutter.cut(centre + d * radius * towards, pixel_error=2)
    x, y = ((cut.vertices["position"] - centre) @ plane).T
    facing = cut.vertices["normal"] @ towards
    corners = cut.triangles[facing[cut.triangles].mean(axis=1) > 0]
    panel.tripcolor(x, y, corners, facing, edgecolors="k", linewidth=0.1, cmap="copper")
    panel.set_title(f"cut from {d} radii at 2 px: {len(cut.triangles)} triangles")
    panel.set_aspect("equal")
    panel.set_axis_off()
figure.tight_layout()
figure.savefig(options.out, dpi=100, bbox_inches="tight")
print(options.out)
