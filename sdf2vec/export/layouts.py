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
from functools import cached_property

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
    """What a target's surroundings allow: layouts, and how many bytes of text weigh as much as a second."""

    layouts: tuple[str, ...]
    bytes_a_second: float
    beside: float = 15.0  # seconds that having to load a second file weighs


CONSTANT = ("table", "tiled")
PASTED = Host(
    ("readable", "table", "tiled", "packed"), 4000.0
)  # unless told readable, or packed: see `shader`
FILE = Host(("readable", "table", "tiled", "packed", "data"), 100_000.0)
EMBEDDED = Host(("readable", "data"), 100_000.0, beside=0.0)  # a module that holds its own data
MODULE = Host(("readable", "data"), 100_000.0)  # WGSL: indexing a constant array hangs some compilers
OLD = Host(("readable",), 100_000.0)  # GLSL ES 1.00 has neither constant arrays nor texelFetch


@dataclass(frozen=True)
class Choice:
    """A layout with its estimated costs, and with its lists for cells, if it has any."""

    layout: str
    tiles: Tiles | None
    text: int  # bytes
    compile: float  # seconds
    frame: float  # seconds

    def __str__(self) -> str:
        if self.tiles is None:
            return f"layout {self.layout}"
        across, depth = round(self.tiles.grid.per_unit), self.tiles.depth
        return f"layout {self.layout} ({across} cells across, {depth:.1f} layers each)"


def choose(scene: Scene, wanted: str, host: Host, slack: float = 0.0) -> Choice:
    """The layout that is wanted, or for "auto" the cheapest one. Raises Sdf2vecError if the host can't take it.

    Its lists leave room for edges to move by `slack`, in scene units.
    """
    possible = [layout for layout in host.layouts if layout not in CONSTANT or fits_constants(scene)]
    if wanted == "auto":
        considered = possible
    elif wanted not in host.layouts:
        raise Sdf2vecError(f"layout {wanted} is not possible here; choose from {', '.join(host.layouts)}")
    elif wanted not in possible:
        raise Sdf2vecError(f"layout {wanted}: too many shapes for a constant table; use {possible[-1]}")
    else:
        considered = [wanted]
    costs = _Costs(scene, host, slack)
    return min(map(costs.of, considered), key=lambda choice: _score(choice, host))


def fits_constants(scene: Scene) -> bool:
    """Whether the records of a scene are few enough for constant tables."""
    return scene.shape_count * form_of(scene).stride * 16 <= MOST_CONSTANTS


def _score(choice: Choice, host: Host) -> float:
    """Seconds until a user has seen enough, and the weight of the text; far more beyond what hosts take."""
    seconds = choice.compile + FRAMES * choice.frame + choice.text / host.bytes_a_second
    seconds += host.beside if choice.layout == "data" else 0.0
    return seconds * (10.0 if choice.text > TEXT_LIMIT else 1.0)


@dataclass(frozen=True)
class _Costs:
    """What layouts of a scene will cost."""

    scene: Scene
    host: Host
    slack: float

    def of(self, layout: str) -> Choice:
        """What one layout will cost."""
        cost, shapes = COSTS[layout], self.scene.shape_count
        tiles = self.tiles(layout)
        evaluated = shapes if tiles is None else tiles.depth * shapes / max(1, len(self.scene.layers))
        seconds = cost.compile + cost.compile_shape * shapes
        return Choice(
            layout, tiles, self.text(layout, tiles), seconds, cost.frame + cost.frame_shape * evaluated
        )

    def text(self, layout: str, tiles: Tiles | None) -> int:
        """Bytes of text."""
        shapes = self.scene.shape_count
        fixed, each = {"readable": (2500, 118), "packed": (3500, 46), "data": (3000, 0)}.get(
            layout, (2500, form_of(self.scene).stride * 4 * NUMBER)
        )
        return int(fixed + shapes * each) + (list_bytes(tiles) if tiles and layout == "tiled" else 0)

    def tiles(self, layout: str) -> Tiles | None:
        """The grid at which short lists and little text balance: that has to be read, and compiled.

        Lists that are data are as fine as it pays.
        """
        if layout == "data":
            return min(self.candidates, key=lambda tiles: tiles.depth + len(tiles.entries) * 1e-4)
        if layout != "tiled":
            return None
        weight = FRAMES * COSTS["tiled"].frame_shape
        seconds_a_byte = 1.0 / self.host.bytes_a_second + 1.0 / LIST_BYTES_A_SECOND
        return min(
            self.candidates, key=lambda tiles: weight * tiles.depth + list_bytes(tiles) * seconds_a_byte
        )

    @cached_property
    def candidates(self) -> list[Tiles]:
        """Lists for grids of more and more cells."""
        grids = [scene_grid(self.scene, across) for across in CELLS_ACROSS]
        few = [grid for grid in grids if grid.cells <= MOST_CELLS] or [Grid(1, 1, 1.0, grids[0].low)]
        return bin_layers(self.scene, few, self.slack)


def list_bytes(tiles: Tiles) -> int:
    """About how much text the lists of a grid are."""
    return 7 * len(tiles.starts) + 3 * len(tiles.entries)
