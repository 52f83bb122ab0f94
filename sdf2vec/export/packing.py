"""A scene in as few bits as its picture allows, written as integers: the smallest text.

Layers follow each other in one stream of bits. Each begins with the box of cells that it may touch, so that a
pixel elsewhere skips the rest; its positions and lengths are fractions of that box, in as many bits as the
sharpness of its edge wants. How many that is, and how many bits colours and falloffs have, is decided by the
error of the picture: the smallest numbers with which it stays below `LIMIT` on a full HD canvas.

A word of the text is a decimal number of 30 bits: of all ways to write a bit as an integer the shortest, and
the same to every compiler.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..expr import (
    FLOAT,
    VEC2,
    VEC3,
    Expr,
    components_of,
    const,
    constant,
    function,
    length,
    let,
    scalarize,
    substitute,
    var,
    vec2,
    vec3,
)
from ..lower.shader import Dialect, expression
from ..scene import COLOR_DECIMALS, GEOMETRY_DECIMALS, Layer, Scene, Shape
from ..shapes import KINDS, Parameter
from .records import P
from .tiles import Grid, layer_bounds

LIMIT = 0.95  # 8-bit levels: largest error of the picture; drawing adds less than 0.05
CANVAS = (1920, 1080)  # pixels, for which the error is measured
WORD = 30  # bits
SAMPLE = 1 << 21  # shapes × pixels that are looked at where no kernels are worth compiling
CELLS = 16  # along the longer side of the grid
CELL_BITS = 4
CHOICE_BITS = 3  # say how many more bits than the least a layer's fractions have
LEAST_BITS, MOST_BITS = 4, 24  # of a fraction; a float holds no more
FEWER = 5  # bits that all layers begin without, when the fewest are looked for
ROUNDS = 24
WORST = 4096  # pixels that are looked at in each round

Floats = NDArray[np.float32]

CORNER, BOX, SPAN = var("corner", VEC2), var("box", VEC2), length(var("box", VEC2))
V = tuple(var(f"v[{i}]") for i in range(8))


@dataclass(frozen=True)
class Precision:
    """Bits of each field. `places` is how finely positions are said: −log2 of the step, in falloffs."""

    places: float = 4.0
    falloff: int = 8
    color: int = 7
    opacity: int = 7

    def finer(self, field: str, steps: float = 1) -> Precision:
        return replace(self, **{field: getattr(self, field) + steps})


FIELDS = ("places", "falloff", "color", "opacity")
FINEST = Precision(14.0, 20, 16, 16)


@dataclass(frozen=True)
class Ranges:
    """Between which values the fractions of a scene lie."""

    falloff: float
    smoothness: float
    color: tuple[float, float]
    opacity: tuple[float, float]
    frequency: tuple[float, float]


@dataclass(frozen=True)
class Packed:
    """A packed scene: the words, how to read them, and how far its picture is off, in 8-bit levels."""

    words: tuple[int, ...]
    bits: int
    grid: Grid
    least: int  # bits of a fraction, at least
    precision: Precision
    ranges: Ranges
    error: float


# --- what a fraction stands for ----------------------------------------------------------------------------


def dequantised(parameter: Parameter, fractions: Sequence[Expr], ranges: Ranges) -> Expr:
    """A parameter from its fractions 0..1; `corner` and `box` are the layer's cells."""
    if parameter.unit == "position":
        return CORNER + BOX * vec2(*fractions)
    scale: dict[str, Callable[[Expr], Expr]] = {
        "length": lambda v: SPAN * v,
        "angle": lambda v: 2.0 * math.pi * v,
        "frequency": lambda v: linear(v, ranges.frequency),
    }
    values = [scale[parameter.unit](fraction) for fraction in fractions]
    return vec2(*values) if parameter.type is VEC2 else values[0]


@function("grown", v=FLOAT, largest=FLOAT)
def grown(v: Expr, largest: Expr) -> Expr:
    """A length from its fraction, finer near 0."""
    square = let("square", v * v)
    return square * square * largest


def linear(v: Expr, limits: tuple[float, float]) -> Expr:
    """A value between limits from its fraction."""
    low, high = limits
    return low + (high - low) * v


def distance(kind: str, ranges: Ranges) -> Expr:
    """Signed distance of the point `p` from the fractions v[0], v[1], …"""
    rest = iter(V)
    parameters = (
        dequantised(parameter, [next(rest) for _ in parameter.start], ranges)
        for parameter in KINDS[kind].parameters
    )
    return KINDS[kind].distance(P, *parameters)


def fraction_count(kind: str) -> int:
    """How many fractions a shape's parameters are."""
    return len(KINDS[kind].scalars())


def ranges_of(scene: Scene) -> Ranges:
    """The ranges of a scene's numbers."""
    shapes = [shape for layer in scene.layers for shape in layer.shapes]
    colors = [channel for shape in shapes for channel in shape.color]
    frequencies = [
        value
        for shape in shapes
        for parameter, value in zip(_units(shape.kind), shape.parameters, strict=True)
        if parameter.unit == "frequency"
    ]
    signed = scene.compositing == "additive"
    return Ranges(
        falloff=max((layer.falloff for layer in scene.layers), default=0.0),
        smoothness=max((layer.smoothness for layer in scene.layers), default=0.0),
        color=(min(colors, default=0.0), max(colors, default=1.0)) if signed else (0.0, 1.0),
        opacity=(-1.0, 1.0) if signed else (0.0, 1.0),
        frequency=(min(frequencies, default=0.0), max(frequencies, default=0.0)),
    )


def _units(kind: str) -> list[Parameter]:
    """The parameter that each number of a flat row belongs to."""
    return [parameter for parameter in KINDS[kind].parameters for _ in parameter.start]


# --- packing ------------------------------------------------------------------------------------------------


def pack(scene: Scene, slack: float = 0.0, limit: float = LIMIT) -> Packed:
    """The scene in the fewest bits that keep its picture within `limit` levels on a full HD canvas."""
    packer = _Packer(scene, slack)
    if not scene.layers:
        return packer.pack(Precision(), [], 0.0)
    view = _View(scene)
    picture = view.picture(scene)
    limit = limit if view.whole else limit / 3.0  # a sample may miss the worst pixel

    def error(precision: Precision) -> float:
        return _largest(view.picture(packer.quantised(precision, packer.bit_counts(precision))) - picture)

    precision, found = choose_precision(error, limit)
    counts, found = _fewest_bits(packer, view, precision, limit) or (packer.bit_counts(precision), found)
    return packer.pack(precision, counts, found)


def _largest(difference: Floats) -> float:
    return float(np.abs(difference).max()) * 255.0


def _fewest_bits(
    packer: _Packer, view: _View, precision: Precision, limit: float
) -> tuple[list[int], float] | None:
    """Bits of each layer's fractions: few at first, more for those whose edges pass where the picture is off.

    None where that does not end.
    """
    counts = np.array(packer.bit_counts(precision)) - FEWER
    picture = view.picture(packer.scene)
    for _ in range(ROUNDS):
        counts = np.maximum(counts, max(LEAST_BITS, counts.max() - 2**CHOICE_BITS + 1))
        off = np.abs(view.picture(packer.quantised(precision, counts.tolist())) - picture).max(axis=0) * 255.0
        if off.max() <= limit:
            return counts.tolist(), float(off.max())
        worst = np.argsort(-off, kind="stable")[:WORST]
        counts[packer.to_blame(view, worst[off[worst] > limit], counts)] += 1
        counts = np.minimum(counts, MOST_BITS)
    return None


def choose_precision(error: Callable[[Precision], float], limit: float) -> tuple[Precision, float]:
    """The coarsest precision whose error is within the limit, and that error.

    Halving a step halves its error, so one look at each field tells about how many bits it wants.
    """
    start, share = Precision(), 0.6 * limit
    alone = {field: error(replace(FINEST, **{field: getattr(start, field)})) for field in FIELDS}
    precision = start
    for field, seen in alone.items():
        precision = precision.finer(field, max(0, math.ceil(math.log2(max(seen, 1e-9) / share))))
    found = error(precision)
    while found > limit and precision.places < FINEST.places:
        precision = precision.finer("places").finer("falloff")
        if found > 1.5 * limit:
            precision = precision.finer("color").finer("opacity")
        found = error(precision)
    return precision, found


class _View:
    """The pixels at which pictures are compared: a full HD canvas, or of a small scene an even sample of it."""

    def __init__(self, scene: Scene) -> None:
        from ..render import reference
        from ..render.draw import is_large
        from ..render.tensors import from_scene

        self.width, self.height = CANVAS if scene.width >= scene.height else CANVAS[::-1]
        pixels = self.width * self.height
        self.whole = is_large(scene, self.width, self.height)
        step = 1 if self.whole else max(1, math.isqrt(scene.shape_count * pixels // SAMPLE))
        x, y, self.pixel = reference.canvas(from_scene(scene), self.width, self.height)
        self.x, self.y = (v.reshape(self.height, self.width)[::step, ::step].flatten() for v in (x, y))

    def picture(self, scene: Scene) -> Floats:
        """The scene's pixels, [4, P]."""
        import torch

        from ..render import reference
        from ..render.draw import draw
        from ..render.tensors import from_scene
        from ..threads import threads_of_its_own

        if self.whole:
            pixels: Floats = draw(scene, self.width, self.height).numpy()
            return pixels.reshape(4, -1)
        with torch.no_grad(), threads_of_its_own():
            image = reference.composite_points(from_scene(scene), self.x, self.y, self.pixel)
            sample: Floats = reference.displayed(image).numpy()
            return sample

    def coverages(self, scene: Scene, chosen: NDArray[np.int64]) -> Floats:
        """Coverage of every layer at some of the pixels, [L, B]."""
        from ..render import reference
        from ..render.tensors import from_scene

        covers, _ = reference.layers_at(from_scene(scene), self.x[chosen], self.y[chosen], self.pixel)
        found: Floats = covers.numpy()
        return found


class _Packer:
    """Turns the layers of one scene into bits and back."""

    def __init__(self, scene: Scene, slack: float) -> None:
        self.scene = scene
        self.ranges = ranges_of(scene)
        self.kinds = [k for k in KINDS if any(layer.kind == k for layer in scene.layers)]
        self.unions = any(len(layer.shapes) > 1 for layer in scene.layers)
        self.grid, self.cells = _cell_boxes(scene, slack)
        self.finest = min(CANVAS)

    def quantised(self, precision: Precision, counts: Sequence[int]) -> Scene:
        """The scene as a shader will read it, with so many bits for the fractions of each layer."""
        layers = [
            self._layer(layer, cells, count, precision)[1]
            for layer, cells, count in zip(self.scene.layers, self.cells, counts, strict=True)
        ]
        return replace(self.scene, layers=tuple(layers))

    def bit_counts(self, precision: Precision) -> list[int]:
        """Bits of a layer's fractions: as many as its edge is sharp against the size of its box."""
        wanted = [
            self._wanted(layer, cells, precision)
            for layer, cells in zip(self.scene.layers, self.cells, strict=True)
        ]
        highest = min(MOST_BITS, max(wanted, default=0))
        least = max(LEAST_BITS, highest - 2**CHOICE_BITS + 1)
        return [min(max(count, least), highest) for count in wanted]

    def _wanted(self, layer: Layer, cells: tuple[int, ...], precision: Precision) -> int:
        turning = any(parameter.unit in ("angle", "frequency") for parameter in KINDS[layer.kind].parameters)
        return math.ceil(math.log2(self._steepness(layer, cells)) + precision.places + 2 * turning)

    def _steepness(self, layer: Layer, cells: tuple[int, ...]) -> float:
        """How much a picture changes when the layer moves by the size of its cells, in full steps of colour."""
        softness = max(layer.falloff, 1.6 / self.finest) / max(abs(layer.opacity), 0.05)
        sizes = (cells[2] - cells[0] + 1, cells[3] - cells[1] + 1)
        return math.hypot(*sizes) / self.grid.per_unit / softness

    def to_blame(
        self, view: _View, chosen: NDArray[np.int64], counts: NDArray[np.int64]
    ) -> NDArray[np.int64]:
        """The layers whose coarse places can be why the picture is off at some pixels."""
        cover = view.coverages(self.scene, chosen)
        steep = np.array([self._steepness(*pair) for pair in zip(self.scene.layers, self.cells, strict=True)])
        share = cover * (1.0 - cover) * (steep * 0.5**counts)[:, None]
        guilty = (share >= 0.5 * share.max(axis=0)) & (share > 0.0)
        return np.nonzero(guilty.any(axis=1))[0]

    def pack(self, precision: Precision, counts: Sequence[int], error: float) -> Packed:
        least = min(counts, default=1)
        stream = _Stream()
        for layer, cells, count in zip(self.scene.layers, self.cells, counts, strict=True):
            for place in cells:
                stream.put(place, CELL_BITS)
            stream.put(count - least, CHOICE_BITS)
            for value, bits in self._layer(layer, cells, count, precision)[0]:
                stream.put(value, bits)
        words = stream.words()
        return Packed(words, stream.bits, self.grid, least, precision, self.ranges, error)

    def _layer(
        self, layer: Layer, cells: tuple[int, ...], count: int, precision: Precision
    ) -> tuple[list[tuple[int, int]], Layer]:
        """The numbers of a layer with their bits, and the layer that they say."""
        ranges, coder = self.ranges, _Coder()
        if len(self.kinds) > 1:
            coder.whole(self.kinds.index(layer.kind), KIND_BITS)
        if self.unions:
            coder.whole(len(layer.shapes) - 1, UNION_BITS)
        falloff = coder.root(layer.falloff, ranges.falloff, precision.falloff)
        opacity = coder.linear(layer.opacity, ranges.opacity, precision.opacity)
        smoothness = (
            coder.root(layer.smoothness, ranges.smoothness, precision.falloff) if self.unions else 0.0
        )
        shapes = [self._shape(shape, cells, count, precision, coder) for shape in layer.shapes]
        return coder.numbers, Layer(tuple(shapes), falloff, opacity, smoothness)

    def _shape(
        self, shape: Shape, cells: tuple[int, ...], count: int, precision: Precision, coder: _Coder
    ) -> Shape:
        red, green, blue = (coder.linear(c, self.ranges.color, precision.color) for c in shape.color)
        starts, ends = self._limits(shape.kind, cells)
        values = [
            coder.linear(_turned(value, parameter), (start, end), count)
            for value, parameter, start, end in zip(
                shape.parameters, _units(shape.kind), starts, ends, strict=True
            )
        ]
        legal = [_legal(v, parameter) for v, parameter in zip(values, _units(shape.kind), strict=True)]
        return Shape(shape.kind, tuple(legal), (red, green, blue))

    def _limits(self, kind: str, cells: tuple[int, ...]) -> tuple[list[float], list[float]]:
        """The parameters for all fractions 0, and for all fractions 1."""
        low = [
            place / self.grid.per_unit + start for place, start in zip(cells[:2], self.grid.low, strict=True)
        ]
        high = [
            (place + 1) / self.grid.per_unit + start
            for place, start in zip(cells[2:], self.grid.low, strict=True)
        ]
        box = (high[0] - low[0], high[1] - low[1])
        zeros, ones = _extremes(kind, self.ranges, (low[0], low[1]), box)
        return zeros, ones


KIND_BITS = (len(KINDS) - 1).bit_length()
UNION_BITS = 7


def _turned(value: float, parameter: Parameter) -> float:
    """An angle within one turn."""
    return value % (2.0 * math.pi) if parameter.unit == "angle" else value


def _legal(value: float, parameter: Parameter) -> float:
    """What a scene takes: a length that must be positive may have become 0."""
    least = parameter.minimum + (10.0**-GEOMETRY_DECIMALS if parameter.positive else 0.0)
    return min(max(value, least), parameter.maximum)


def _extremes(
    kind: str, ranges: Ranges, low: tuple[float, float], box: tuple[float, float]
) -> tuple[list[float], list[float]]:
    found: list[list[float]] = []
    for end in (0.0, 1.0):
        known = _known(low, box)
        values = []
        for parameter in KINDS[kind].parameters:
            meaning = dequantised(parameter, [const(end)] * len(parameter.start), ranges)
            values += [constant(substitute(scalar, known)) for scalar in scalarize(meaning)]
        found.append(values)
    return found[0], found[1]


def _known(low: tuple[float, float], box: tuple[float, float]) -> dict[Expr, Expr]:
    names = (*components_of(CORNER), *components_of(BOX))
    return dict(zip(names, map(const, (*low, *box)), strict=True))


class _Coder:
    """Collects whole numbers with their bits; each method returns the value that its number says."""

    def __init__(self) -> None:
        self.numbers: list[tuple[int, int]] = []

    def whole(self, value: int, bits: int) -> int:
        self.numbers.append((value, bits))
        return value

    def linear(self, value: float, limits: tuple[float, float], bits: int) -> float:
        low, high = limits
        fraction = (value - low) / (high - low) if high > low else 0.0
        return low + (high - low) * self._fraction(fraction, bits)

    def root(self, value: float, largest: float, bits: int) -> float:
        fraction = (value / largest) ** 0.25 if largest else 0.0
        return largest * self._fraction(fraction, bits) ** 4

    def _fraction(self, fraction: float, bits: int) -> float:
        most = (1 << bits) - 1
        return self.whole(round(min(max(fraction, 0.0), 1.0) * most), bits) / most


class _Stream:
    """Bits one after another, as words."""

    def __init__(self) -> None:
        self._value = 0
        self.bits = 0

    def put(self, value: int, bits: int) -> None:
        assert 0 <= value < 1 << bits, f"{value} has more than {bits} bits"
        self._value |= value << self.bits
        self.bits += bits

    def words(self) -> tuple[int, ...]:
        """All words, and enough empty ones that a shader may read ahead."""
        count = -(-self.bits // WORD) + AHEAD
        raw = self._value
        mask = (1 << WORD) - 1
        return tuple((raw >> (WORD * i)) & mask for i in range(count))


AHEAD = 16  # more than the longest shape has fractions


def joined(numbers: Sequence[int], bits: int, per: int) -> list[int]:
    """`per` numbers of so many bits in each word, the first in its lowest bits."""
    groups = (numbers[i : i + per] for i in range(0, len(numbers), per))
    return [sum(number << (bits * place) for place, number in enumerate(group)) for group in groups]


def _cell_boxes(scene: Scene, slack: float) -> tuple[Grid, list[tuple[int, int, int, int]]]:
    """A grid that holds everything, and the cells (low x, low y, high x, high y) that each layer may touch."""
    if not scene.layers:
        return Grid(1, 1, 1.0, (0.0, 0.0)), []
    boxes = layer_bounds(scene, slack).boxes
    low, high = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
    size = float((high - low).max()) * (1.0 + 1e-5)
    corner = (_rounded(low[0] - 2e-6 * size), _rounded(low[1] - 2e-6 * size))
    per_unit = _rounded_down(CELLS / size)
    grid = Grid(CELLS, CELLS, per_unit, corner)
    places = np.floor((boxes - np.array([*corner, *corner])) * per_unit + [-1e-4, -1e-4, 1e-4, 1e-4])
    clipped = np.clip(places, 0, CELLS - 1).astype(int).tolist()
    return grid, [(a, b, c, d) for a, b, c, d in clipped]


def _rounded(value: float) -> float:
    return float(np.float32(round(value, COLOR_DECIMALS)))


def _rounded_down(value: float) -> float:
    return math.floor(value * 1e4) / 1e4 if value > 1.0 else value


# --- reading it in a shader ---------------------------------------------------------------------------------


class PackedText:
    """The parts of a shader that read a packed scene."""

    def __init__(self, scene: Scene, packed: Packed, dialect: Dialect) -> None:
        self.packed, self.dialect = packed, dialect
        self.kinds = [k for k in KINDS if any(layer.kind == k for layer in scene.layers)]
        self.unions = any(len(layer.shapes) > 1 for layer in scene.layers)
        self.distances = [distance(kind, packed.ranges) for kind in self.kinds]

    def part(self) -> dict[str, Any]:
        """What the template takes."""
        packed, bits = self.packed, self.packed.precision
        low, high = var("low", VEC2), var("high", VEC2)
        corner = vec2(*map(const, packed.grid.low)) + low * (1.0 / packed.grid.per_unit)
        values = {
            "place": (P - vec2(*map(const, packed.grid.low))) * packed.grid.per_unit,
            "corner": corner,
            "box": (high - low) * (1.0 / packed.grid.per_unit),
            "tint": linear_vector(var("tint", VEC3), packed.ranges.color),
        }
        return {
            **{name: expression(value, self.dialect) for name, value in values.items()},
            **self._fields(),
            "words": packed.words,
            "word": WORD,
            "end": packed.bits,
            "cell": CELL_BITS,
            "choice": CHOICE_BITS,
            "least": packed.least,
            "color": bits.color,
            "most": max(map(fraction_count, self.kinds), default=1),
            "union": self.unions,
            "kinds": [
                (kind, expression(value, self.dialect))
                for kind, value in zip(self.kinds, self.distances, strict=True)
            ],
        }

    def _fields(self) -> dict[str, str | int]:
        """Where a layer's own numbers are, and what they mean."""
        bits, ranges = self.packed.precision, self.packed.ranges
        place = 4 * CELL_BITS + CHOICE_BITS
        fields: dict[str, str | int] = {}

        def head(width: int) -> str:
            """A whole number in the first word."""
            nonlocal place
            place += width
            return f"head >> {place - width} & {(1 << width) - 1}"

        def part(width: int) -> Expr:
            nonlocal place
            place += width
            return var(f"part(start + {place - width}, {width})")

        if len(self.kinds) > 1:
            fields["kind"] = head(KIND_BITS)
        if self.unions:
            fields["count"] = head(UNION_BITS)
        assert place <= WORD
        fields["falloff"] = self._say(grown(part(bits.falloff), ranges.falloff))
        fields["opacity"] = self._say(linear(part(bits.opacity), ranges.opacity))
        if self.unions:
            fields["smoothness"] = self._say(grown(part(bits.falloff), ranges.smoothness))
        most = max(map(fraction_count, self.kinds), default=1)
        longest = WORD + place + 3 * bits.color + most * (self.packed.least + 2**CHOICE_BITS - 1)
        return fields | {"head": place, "size": self._shape_bits(), "window": -(-longest // WORD) + 1}

    def _say(self, value: Expr) -> str:
        return expression(value, self.dialect)

    def _shape_bits(self) -> str:
        """Bits of one shape, of its kind and `n`."""
        colors = 3 * self.packed.precision.color
        *others, last = [f"{fraction_count(kind)} * n" for kind in self.kinds]
        chosen = "".join(f"kind == {i} ? {text} : " for i, text in enumerate(others)) + last
        return f"{colors} + ({chosen})" if others else f"{chosen} + {colors}"


def linear_vector(v: Expr, limits: tuple[float, float]) -> Expr:
    """`linear` for three fractions."""
    low, high = limits
    return v if limits == (0.0, 1.0) else vec3(low) + v * (high - low)
