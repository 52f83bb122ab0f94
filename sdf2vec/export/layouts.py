"""How a shader holds its shapes, and a model of what that costs.

| layout | what it is |
|---|---|
| readable | one statement a layer, as one would write it |
| table | a loop over a constant table |
| tiled | the same table, and for each cell of a grid a list of the layers it needs |
| packed | the smallest text: fractions in a stream of bits, in a loop that skips what is elsewhere |
| data | records and lists in a texture (GLSL) or a storage buffer (WGSL), in files beside the text |

`choose` takes the cheapest. The figures of `COSTS` are from docs/shaders.md: software engines on a CPU, where
differences show; on a GPU all is faster and the order is the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from ..errors import Sdf2vecError
from ..scene import Scene
from .records import form_of
from .tiles import Grid, Tiles, bin_layers, scene_grid

TEXT_LIMIT = 64 * 1024  # bytes of text, and of one constant array, beyond which hosts refuse or crawl
MOST_CONSTANTS = (
    44 * 1024
)  # bytes of tables: from 48 KiB on Mesa's software driver does not end, ANGLE refuses 64
CELLS_ACROSS = (2, 4, 8, 12, 16, 24, 32, 48)
MOST_CELLS = 1 << 13
LIST_BYTES_A_SECOND = 20_000.0  # of constant lists that compilers take
FRAMES = 30  # frames that weigh as much as one compilation
WORD = 30  # bits of an integer in a text
NUMBER = 8.5  # characters of a number in a table, with its separator


@dataclass(frozen=True)
class Cost:
    """Seconds to compile (fixed, for a shape), seconds a frame of 512 × 512 (fixed, for a shape evaluated)."""

    compile: float
    compile_shape: float
    frame: float
    frame_shape: float


COSTS = {
    "readable": Cost(0.1, 0.009, 0.01, 0.0012),
    "table": Cost(0.1, 0.010, 0.01, 0.0050),
    "tiled": Cost(0.2, 0.005, 0.01, 0.0150),
    "packed": Cost(0.2, 0.008, 0.02, 0.0040),
    "data": Cost(0.2, 0.0, 0.01, 0.0080),
}


@dataclass(frozen=True)
class Host:
    """What a target's surroundings allow: layouts, and how many bytes of text weigh as much as a second.

    `frames`: how many of a software engine's frames weigh as much as they take.
    """

    layouts: tuple[str, ...]
    bytes_a_second: float
    frames: float = FRAMES
    beside: float = 15.0  # seconds that having to load a second file weighs


CONSTANT = ("table", "tiled")
PASTED = Host(
    ("readable", "table", "tiled", "packed"), 4000.0, frames=3.0
)  # seen on a GPU, where frames are quick
FILE = Host(("readable", "table", "tiled", "packed", "data"), 100_000.0)
EMBEDDED = Host(("readable", "data"), 100_000.0, beside=0.0)  # a module that holds its own data
MODULE = Host(("readable", "data"), 100_000.0)  # WGSL: indexing a constant array hangs some compilers
OLD = Host(("readable",), 100_000.0)  # GLSL ES 1.00 has neither constant arrays nor texelFetch


@dataclass(frozen=True)
class Choice:
    """A layout with its estimated costs; `across` is how many cells the shortest side has, 0 without a grid."""

    layout: str
    across: int
    depth: float  # layers that a pixel evaluates
    text: int  # bytes
    compile: float  # seconds
    frame: float  # seconds

    def __str__(self) -> str:
        grid = f" ({self.across} cells across, {self.depth:.1f} layers each)" if self.across else ""
        return f"layout {self.layout}{grid}"


def choose(scene: Scene, wanted: str, host: Host) -> Choice:
    """The layout that is wanted, or for "auto" the cheapest one. Raises Sdf2vecError if the host can't take it."""
    possible = [layout for layout in host.layouts if layout not in CONSTANT or fits_constants(scene)]
    if wanted != "auto":
        if wanted not in host.layouts:
            raise Sdf2vecError(f"layout {wanted} is not possible here; choose from {', '.join(host.layouts)}")
        if wanted not in possible:
            raise Sdf2vecError(f"layout {wanted}: too many shapes for a constant table; use {possible[-1]}")
        return estimate(scene, wanted, host)
    found = [estimate(scene, layout, host) for layout in possible]
    return min(found, key=lambda choice: _score(choice, host))


def fits_constants(scene: Scene) -> bool:
    """Whether the records of a scene are few enough for constant tables."""
    return scene.shape_count * form_of(scene).stride * 16 <= MOST_CONSTANTS


def _score(choice: Choice, host: Host) -> float:
    """Seconds until a user has seen enough, and the weight of the text; far more beyond what hosts take."""
    seconds = choice.compile + host.frames * choice.frame + choice.text / host.bytes_a_second
    seconds += host.beside if choice.layout == "data" else 0.0
    return seconds * (10.0 if choice.text > TEXT_LIMIT else 1.0)


@lru_cache(maxsize=64)
def estimate(scene: Scene, layout: str, host: Host) -> Choice:
    """What a layout will cost."""
    cost, layers = COSTS[layout], len(scene.layers)
    across, depth, text = _size(scene, layout, host)
    compile_seconds = cost.compile + cost.compile_shape * scene.shape_count
    shapes = depth * scene.shape_count / max(1, layers)
    return Choice(layout, across, depth, text, compile_seconds, cost.frame + cost.frame_shape * shapes)


def _size(scene: Scene, layout: str, host: Host) -> tuple[int, float, int]:
    """Cells across, layers that a pixel evaluates, bytes of text."""
    layers, shapes = len(scene.layers), scene.shape_count
    table = int(2500 + shapes * form_of(scene).stride * 4 * NUMBER)
    if layout in ("readable", "table"):
        return 0, float(layers), {"readable": 2500 + 105 * shapes, "table": table}[layout]
    if layout == "packed":
        return 0, float(layers), 3500 + 46 * shapes
    tiles = best_data_tiles(scene) if layout == "data" else best_tiles(scene, host.bytes_a_second)
    lists = 0 if layout == "data" else list_bytes(tiles)
    across = round(tiles.grid.per_unit)
    return across, tiles.depth, 3000 if layout == "data" else table + lists


@lru_cache(maxsize=64)
def best_tiles(scene: Scene, bytes_a_second: float, slack: float = 0.0) -> Tiles:
    """The grid at which short lists and little text balance: that has to be read, and compiled."""
    weight = FRAMES * COSTS["tiled"].frame_shape
    bytes_a_second = 1.0 / (1.0 / bytes_a_second + 1.0 / LIST_BYTES_A_SECOND)
    return min(
        _candidates(scene, slack), key=lambda tiles: weight * tiles.depth + list_bytes(tiles) / bytes_a_second
    )


@lru_cache(maxsize=64)
def best_data_tiles(scene: Scene, slack: float = 0.0) -> Tiles:
    """The grid for lists that are data: as fine as it pays."""
    return min(_candidates(scene, slack), key=lambda tiles: tiles.depth + len(tiles.entries) * 1e-4)


def _candidates(scene: Scene, slack: float) -> list[Tiles]:
    grids = [scene_grid(scene, across) for across in CELLS_ACROSS]
    return [bin_layers(scene, grid, slack) for grid in grids if grid.cells <= MOST_CELLS] or [
        bin_layers(scene, Grid(1, 1, 1.0, grids[0].low), slack)
    ]


def list_bytes(tiles: Tiles) -> int:
    """About how much text the lists of a grid are."""
    return 7 * len(tiles.starts) + 3 * len(tiles.entries)
