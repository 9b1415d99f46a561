"""Continuous level of detail for meshes: numpy arrays in, numpy arrays out.

    import lodestone

    mesh = lodestone.read("bunny.obj")
    small = lodestone.simplify(mesh, triangles=5000)
    small.write("bunny-5k.ply")

    asset = lodestone.bake(mesh, "bunny.lode", backends=["lod", "vgi"], resolution=65)
    picture = asset.render(backend="vgi", pixel_error=1)         # (720, 1280, 4) uint8
    positions = asset.atlas().positions(0)                       # (65, 65, 3) float32

Lengths are in object units, angles in radians. Arrays of meshes and atlases look into the memory of their object without a copy and are
read-only; copy one to change it. Work runs without the lock of the interpreter, and Ctrl-C stops it. Objects may be used by several
threads, a Cutter by one at a time.
"""
import json as _json
from typing import NamedTuple as _NamedTuple

from . import _lodestone
from ._errors import Error, FormatError, Interrupted, InvariantError, MachineError, UsageError
from ._lodestone import Atlas, Mesh, distance as _distance, generate, read, simplify

__version__ = _lodestone.version
__commit__ = _lodestone.commit

__all__ = ["Asset", "Atlas", "CacheCost", "Cut", "Cutter", "Distance", "Error", "FormatError", "Interrupted", "InvariantError", "Levels",
           "MachineError", "Mesh", "Unwrapped", "UsageError", "acmr", "bake", "cache_cost", "distance", "generate", "open", "read",
           "set_threads", "simplify", "unwrap"]


class CacheCost(_NamedTuple):
    """What an index order costs a vertex cache."""

    acmr: float  # transforms per triangle, 0.5 .. 3 on large meshes
    atvr: float  # transforms per vertex used, >= 1
    transforms: int  # vertex shader runs
    triangles: int  # those that are not degenerate
    vertices: int  # distinct ones of these


class Distance(_NamedTuple):
    """The two-sided distance of two surfaces, object units: the larger of both sides."""

    rms: float  # over points spread by area
    max: float  # at a point or a vertex


class Unwrapped(_NamedTuple):
    """A mesh with new texture coordinates, and what they are like."""

    mesh: "Mesh"  # uvs of 0 .. 1; of several squares, each has a material of its own
    report: dict  # charts, triangles, seam_length, l2_stretch_rms, coverage ... (docs/cli.md, `unwrap --json`), without times


class Levels(_NamedTuple):
    """The levels of an asset by number; 0 is full detail."""

    triangles: "numpy.ndarray"  # (levels,) uint64, never rising
    errors: "numpy.ndarray"  # (levels,) float64, object units, two-sided distance to the source, never falling


class Cut(_NamedTuple):
    """What is to be drawn of an object for a view."""

    vertices: "numpy.ndarray"  # (n,) of the fields position (3 float32, object units), normal (3), uv (2), colour (4 uint8, sRGB), material
    triangles: "numpy.ndarray"  # (m, 3) uint32, counter-clockwise seen from outside
    level: "int | None"  # of a progressive mesh; None of an atlas, and where nothing is seen
    pixel_error: float  # as asked; of an atlas raised where max_triangles asks for that
    settled: bool  # False: pages are on their way, and the same view will become finer


class Asset:
    """What a mesh was baked into: made by bake() and open()."""

    def __init__(self, opened):
        self._asset = opened

    @property
    def about(self):
        """What the asset tells of itself, a dict: name, program, options, input, repair, bounds, lod, vgi (docs/cli.md, `info --json`)."""
        return _json.loads(self._asset.about_text)

    @property
    def backends(self):
        """What it was baked for: of "full", "discrete", "lod" and "vgi"."""
        return self._asset.backends

    @property
    def bounds(self):
        """A sphere around the source mesh: ((x, y, z), radius), object units."""
        return self._asset.bounds

    def levels(self, backend="lod"):
        """The levels of "lod" or "vgi" as Levels."""
        return Levels(*self._asset.levels(backend))

    def extract(self, backend="lod", *, level=None, triangles=None, error=None, order=""):
        """A level as a Mesh, triangles in drawing order.

        One of: level, 0 for full detail; triangles, for the finest level of at most so many; error, object units, for the coarsest level
        within it. order: of "lod", the face order, the asset's first unless given.
        """
        return self._asset.extract(backend, self._asset.chosen_level(backend, level, triangles, error), order)

    def acmr(self, *, level=0, order="", cache="fifo16"):
        """The transforms per triangle of a level of "lod" as it is drawn; see acmr()."""
        return acmr(self.extract("lod", level=level, order=order).triangles, cache)

    def atlas(self):
        """The Atlas of "vgi", every page decoded."""
        return _lodestone.atlas_of(self._asset)

    def verify(self):
        """Checks every invariant; raises InvariantError or FormatError. Slow."""
        self._asset.verify()

    def cutter(self, backend="vgi", *, resident_bytes=1 << 30):
        """A Cutter of this object. resident_bytes: what the stated buffers of the backend may take."""
        return Cutter(_lodestone.open_cutter(self._asset, backend, resident_bytes), self.bounds)

    def render(self, *, backend="lod", eye=None, target=None, up=(0, 1, 0), fov_y=0.785, width=1280, height=720, pixel_error=1.0, level=None,
               order="", raster="", debug="none", shadows=True, environment="none", device="", progress=None):
        """A picture: (height, width, 4) uint8, sRGB, rows top to bottom; alpha is 255 where a surface was drawn and 0 elsewhere.

        Drawn off screen by Vulkan; MachineError where there is none. backend: "full", "discrete", "lod" or "vgi", as it was baked for.
        eye, target: world units; everything is in the frame unless eye is given, and looked at is the middle of the object unless target
        is. fov_y: radians from the bottom to the top. pixel_error: how far what is drawn may be off, pixels. level: draw this one instead.
        environment: light from all around: "sky", or the path of a Radiance picture. order, raster, debug, device: as the options of `lodestone render`.
        """
        return self._asset.render(backend=backend, eye=eye, target=target, up=up, fov_y=fov_y, width=width, height=height,
                                  pixel_error=pixel_error, level=level, order=order, raster=raster, debug=debug, shadows=shadows,
                                  environment=str(environment), device=device, progress=progress)

    def __repr__(self):
        return f"<lodestone.Asset {self.about['name']!r} of {', '.join(self.backends)}>"


class Cutter:
    """Chooses what of an object is drawn, view after view; made by Asset.cutter()."""

    def __init__(self, cutter, bounds):
        self._cutter, (self._centre, self._radius) = cutter, bounds

    def cut(self, eye, target=None, up=(0, 1, 0), *, fov_y=0.785, width=1280, height=720, pixel_error=1.0, max_triangles=0,
            culls_back_faces=False, wait=True):
        """The Cut for a view: arguments as those of Asset.render().

        max_triangles: 0 for no limit. wait: until all pages are there; else the cut is as fine as what is there.
        """
        return Cut(*self._cutter.cut(centre=self._centre, radius=self._radius, eye=eye, target=target, up=up, fov_y=fov_y, width=width,
                                     height=height, pixel_error=pixel_error, max_triangles=max_triangles, culls_back_faces=culls_back_faces,
                                     wait=wait))


def bake(mesh, path=None, *, progress=None, **options):
    """Bakes a Mesh and opens the Asset.

    path: the .lode file to write, which appears whole or not at all; None keeps the asset in a file without a name. progress: called with
    a stage (str) and a fraction (0 .. 1); what it raises stops the bake. options: those of `lodestone bake`, dashes as underscores, for
    instance backends=["lod", "vgi"], resolution=65, simplifier="openmesh".
    """
    return Asset(_lodestone.bake(mesh, path, progress=progress, **options))


def open(source):
    """Opens an asset: the path of a .lode file, or its bytes."""
    return Asset(_lodestone.open(source))


def acmr(triangles, cache="fifo16"):
    """Vertex transforms per triangle of an index order, 0.5 .. 3 on large meshes.

    triangles: (m, 3) whole numbers, in drawing order. cache: "fifo16", "lru32", "nvidia", "amd", "intel" ...
    """
    return cache_cost(triangles, cache).acmr


def cache_cost(triangles, cache="fifo16"):
    """The same with all that was counted, as CacheCost."""
    return CacheCost(*_lodestone.cache_cost(triangles, cache))


def distance(a, b, *, samples=200000):
    """How far two meshes are from each other, as Distance. samples: points on each surface."""
    return Distance(*_distance(a, b, samples))


def unwrap(mesh, *, progress=None, **options):
    """New texture coordinates for a Mesh, without overlaps, as Unwrapped; the mesh is repaired first.

    options: those of `lodestone unwrap` that say what becomes of the mesh, dashes as underscores: charts, worst_stretch, textures (squares),
    resolution (texels along a side), gutter (texels), bake=True to bring its textures over into new images. progress: as of bake().
    """
    made, report = _lodestone.unwrap(mesh, progress, **options)
    return Unwrapped(made, _json.loads(report))


def set_threads(threads):
    """How many threads work uses from now on; 0 for one per core. Results do not depend on it."""
    _lodestone.set_threads(threads)
