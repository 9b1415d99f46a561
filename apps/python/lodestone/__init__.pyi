"""Types of lodestone; shapes and units stand beside each array."""
from os import PathLike
from typing import Any, Callable, Literal, NamedTuple, Optional, Sequence, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str
__commit__: str

Path = Union[str, "PathLike[str]"]
Progress = Optional[Callable[[str, float], object]]  # stage, fraction of it
LevelBackend = Literal["lod", "vgi"]
Backend = Literal["full", "discrete", "lod", "vgi"]

class Error(Exception): ...
class UsageError(Error, ValueError): ...
class FormatError(Error, ValueError): ...
class InvariantError(Error): ...
class MachineError(Error, OSError): ...
class Interrupted(Error): ...

class CacheCost(NamedTuple):
    acmr: float
    atvr: float
    transforms: int
    triangles: int
    vertices: int

class Distance(NamedTuple):
    rms: float  # object units
    max: float  # object units

class Levels(NamedTuple):
    triangles: NDArray[np.uint64]  # (levels,)
    errors: NDArray[np.float64]  # (levels,), object units

class Cut(NamedTuple):
    vertices: NDArray[np.void]  # (n,), fields position, normal, uv, colour, material
    triangles: NDArray[np.uint32]  # (m, 3)
    level: Optional[int]
    pixel_error: float  # pixels
    settled: bool

class Mesh:
    def __init__(
        self,
        positions: ArrayLike,  # (n, 3), object units
        triangles: ArrayLike,  # (m, 3), whole numbers below n
        *,
        normals: Optional[ArrayLike] = None,  # (n, 3), any length
        uvs: Optional[ArrayLike] = None,  # (n, 2), origin at the top left
        colours: Optional[NDArray[np.uint8]] = None,  # (n, 4), sRGB and alpha
        name: str = "arrays",
    ) -> None: ...
    @property
    def positions(self) -> NDArray[np.float32]: ...  # (n, 3), object units
    @property
    def triangles(self) -> NDArray[np.uint32]: ...  # (m, 3)
    @property
    def normals(self) -> Optional[NDArray[np.float32]]: ...  # (n, 3), unit length
    @property
    def uvs(self) -> Optional[NDArray[np.float32]]: ...  # (n, 2)
    @property
    def second_uvs(self) -> Optional[NDArray[np.float32]]: ...  # (n, 2)
    @property
    def tangents(self) -> Optional[NDArray[np.float32]]: ...  # (n, 4), unit length and a sign, or zeros
    @property
    def colours(self) -> Optional[NDArray[np.uint8]]: ...  # (n, 4), sRGB and alpha
    @property
    def materials(self) -> Optional[NDArray[np.uint16]]: ...  # (n,), into material_table
    @property
    def material_table(self) -> list[dict[str, Any]]: ...  # docs/materials.md: name, shading, textures and more
    @property
    def images(self) -> list[NDArray[np.uint8]]: ...  # (height, width, 4) each, sRGB and alpha
    @property
    def name(self) -> str: ...
    def write(self, path: Path) -> None: ...

class Unwrapped(NamedTuple):
    mesh: Mesh
    report: dict[str, Any]

class Atlas:
    @property
    def charts(self) -> int: ...
    @property
    def levels(self) -> int: ...
    @property
    def cells(self) -> int: ...  # per side of a whole chart's positions
    @property
    def attribute_cells(self) -> int: ...  # per side of a whole chart's attributes
    @property
    def step(self) -> float: ...  # object units between lattice points
    @property
    def origin(self) -> tuple[float, float, float]: ...  # object units
    @property
    def errors(self) -> NDArray[np.float32]: ...  # (levels,), object units
    @property
    def clusters(self) -> NDArray[np.uint32]: ...  # (charts,)
    @property
    def sides(self) -> NDArray[np.int32]: ...  # (charts, 4, 2): chart (-1: the surface ends) and side glued to
    def lattice(self, chart: int) -> NDArray[np.uint16]: ...  # (s, s, 3), lattice points
    def error_codes(self, chart: int) -> NDArray[np.uint8]: ...  # (s, s)
    def colours(self, chart: int) -> Optional[NDArray[np.uint8]]: ...  # (t, t, 4), sRGB and alpha
    def materials(self, chart: int) -> Optional[NDArray[np.uint16]]: ...  # (t, t)
    def positions(self, chart: int) -> NDArray[np.float32]: ...  # (s, s, 3), object units, a copy
    def normals(self, chart: int) -> NDArray[np.float32]: ...  # (t, t, 3), unit length, a copy
    def uvs(self, chart: int) -> Optional[NDArray[np.float32]]: ...  # (t, t, 2), a copy

class Cutter:
    def cut(
        self,
        eye: Sequence[float],
        target: Optional[Sequence[float]] = None,
        up: Sequence[float] = (0, 1, 0),
        *,
        fov_y: float = 0.785,
        width: int = 1280,
        height: int = 720,
        pixel_error: float = 1.0,
        max_triangles: int = 0,
        culls_back_faces: bool = False,
        wait: bool = True,
    ) -> Cut: ...

class Asset:
    @property
    def about(self) -> dict[str, Any]: ...
    @property
    def backends(self) -> list[str]: ...
    @property
    def bounds(self) -> tuple[tuple[float, float, float], float]: ...
    def levels(self, backend: LevelBackend = "lod") -> Levels: ...
    def extract(
        self,
        backend: LevelBackend = "lod",
        *,
        level: Optional[int] = None,
        triangles: Optional[int] = None,
        error: Optional[float] = None,
        order: str = "",
    ) -> Mesh: ...
    def acmr(self, *, level: int = 0, order: str = "", cache: str = "fifo16") -> float: ...
    def atlas(self) -> Atlas: ...
    def verify(self) -> None: ...
    def cutter(self, backend: LevelBackend = "vgi", *, resident_bytes: int = ...) -> Cutter: ...
    def render(
        self,
        *,
        backend: Backend = "lod",
        eye: Optional[Sequence[float]] = None,
        target: Optional[Sequence[float]] = None,
        up: Sequence[float] = (0, 1, 0),
        fov_y: float = 0.785,
        width: int = 1280,
        height: int = 720,
        pixel_error: float = 1.0,
        level: Optional[int] = None,
        order: str = "",
        raster: str = "",
        debug: str = "none",
        shadows: bool = True,
        environment: Path = "none",
        device: str = "",
        progress: Progress = None,
    ) -> NDArray[np.uint8]: ...  # (height, width, 4), sRGB

def read(path: Path, **options: Any) -> Mesh: ...
def generate(shape: str, triangles: int, seed: int = 1) -> Mesh: ...
def simplify(
    mesh: Mesh,
    *,
    triangles: Optional[int] = None,
    error: Optional[float] = None,
    simplifier: Literal["quadric", "openmesh"] = "quadric",
    progress: Progress = None,
) -> Mesh: ...
def unwrap(mesh: Mesh, *, progress: Progress = None, **options: Any) -> Unwrapped: ...
def bake(mesh: Mesh, path: Optional[Path] = None, *, progress: Progress = None, **options: Any) -> Asset: ...
def open(source: Union[Path, bytes, bytearray, memoryview]) -> Asset: ...
def acmr(triangles: ArrayLike, cache: str = "fifo16") -> float: ...
def cache_cost(triangles: ArrayLike, cache: str = "fifo16") -> CacheCost: ...
def distance(a: Mesh, b: Mesh, *, samples: int = 200000) -> Distance: ...
def set_threads(threads: int) -> None: ...
