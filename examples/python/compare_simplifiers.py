"""Compares Lodestone's simplifier with OpenMesh's: measured distance to the source by triangles, and what both look like.

    python3 compare_simplifiers.py [MESH] [--triangles 100000] -o picture.png
"""
import argparse

import lodestone
import matplotlib.pyplot as plt

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("mesh", nargs="?", help="a mesh file; a generated rock unless given")
parser.add_argument("--triangles", type=int, default=100000, help="of the rock")
parser.add_argument("-o", "--out", default="compare_simplifiers.png")
options = parser.parse_args()

mesh = lodestone.read(options.mesh) if options.mesh else lodestone.generate("rock", options.triangles)
counts = [len(mesh.triangles) // 2**k for k in range(1, 8)]
diagonal = float(((mesh.positions.max(axis=0) - mesh.positions.min(axis=0)) ** 2).sum() ** 0.5)

figure, (curves, *pictures) = plt.subplots(1, 3, figsize=(15, 4.5))
for simplifier, panel in zip(("quadric", "openmesh"), pictures):
    made = {count: lodestone.simplify(mesh, triangles=count, simplifier=simplifier) for count in counts}
    far = [lodestone.distance(mesh, small, samples=50000) for small in made.values()]
    curves.loglog(counts, [d.rms / diagonal for d in far], "o-", label=f"{simplifier}, rms")
    curves.loglog(counts, [d.max / diagonal for d in far], "o:", label=f"{simplifier}, largest", color=curves.lines[-1].get_color())
    coarse = made[counts[-2]]
    panel.set_title(f"{simplifier}: {len(coarse.triangles)} triangles")
    panel.set_axis_off()
    try:
        panel.imshow(lodestone.bake(coarse, backends="full").render(backend="full", width=600, height=600, debug="triangle"))
    except lodestone.MachineError as error:  # there is no Vulkan
        panel.text(0.5, 0.5, f"not drawn: {error}", ha="center", wrap=True, transform=panel.transAxes)
curves.set_xlabel("triangles")
curves.set_ylabel("distance to the source, of the diagonal")
curves.legend()
figure.tight_layout()
figure.savefig(options.out, dpi=100)
print(options.out)
