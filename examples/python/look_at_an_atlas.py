"""Shows an atlas: its charts as geometry images and normal maps, and where they lie on the surface.

    python3 look_at_an_atlas.py [MESH] [--triangles 100000] -o picture.png
"""
import argparse

import lodestone
import matplotlib.pyplot as plt
import numpy as np

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("mesh", nargs="?", help="a mesh file; a generated rock unless given")
parser.add_argument("--triangles", type=int, default=100000, help="of the rock")
parser.add_argument("-o", "--out", default="look_at_an_atlas.png")
options = parser.parse_args()

mesh = lodestone.read(options.mesh) if options.mesh else lodestone.generate("rock", options.triangles)
asset = lodestone.bake(mesh, backends="vgi", clusters=12)
atlas = asset.atlas()
low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)


def sheet(image_of):
    """All charts side by side, those with fewer samples in a corner of their square."""
    across = int(np.ceil(atlas.charts**0.5))
    side = atlas.cells + 1
    tiles = np.ones((across * side, across * side, 3))
    for chart in range(atlas.charts):
        image = image_of(chart)
        y, x = chart // across * side, chart % across * side
        tiles[y : y + len(image), x : x + len(image)] = image
    return tiles


def stretch(chart):
    """How far neighbouring samples are apart, times the mean: where sampling is even it is 1."""
    positions = atlas.positions(chart)
    apart = np.linalg.norm(np.diff(positions, axis=1), axis=2)[:-1] + np.linalg.norm(np.diff(positions, axis=0), axis=2)[:, :-1]
    return plt.cm.viridis(np.clip(apart / apart.mean() / 2, 0, 1))[..., :3]


figure, panels = plt.subplots(1, 4, figsize=(18, 4.8))
for panel, title, image in zip(panels, ("positions as colours", "normals", "distance between samples"), (
        sheet(lambda chart: (atlas.positions(chart) - low) / (high - low)), sheet(lambda chart: atlas.normals(chart) / 2 + 0.5), sheet(stretch))):
    panel.imshow(image)
    panel.set_title(title)
panels[3].set_title(f"{atlas.charts} charts; error {atlas.errors[0]:.3g}")
try:
    panels[3].imshow(asset.render(backend="vgi", debug="chart", width=600, height=600))
except lodestone.MachineError as error:  # there is no Vulkan
    panels[3].text(0.5, 0.5, f"not drawn: {error}", ha="center", wrap=True, transform=panels[3].transAxes)
for panel in panels:
    panel.set_axis_off()
figure.tight_layout()
figure.savefig(options.out, dpi=100)
print(options.out)
