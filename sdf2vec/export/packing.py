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
from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial

import numpy as np
import torch

from ..arrays import Float32Array, Float64Array, IntArray
from ..blend import COMPOSITING, MIN_FALLOFF_PIXELS
from ..expr import Expr, const, constant, operation, var
from ..graph import components_of, scalarize, substitute
from ..layer import JOIN, LOOK, slots
from ..operation import VEC2, VECTOR
from ..paints import PAINTS
from ..render import reference
from ..render.draw import draw, is_large
from ..render.tensors import from_scene
from ..scene import Joint, Layer, Scene, Shape
from ..shapes import KINDS
from ..threads import threads_of_its_own
from ..units import ANGLE, COLOR, COLOR_DECIMALS, FREQUENCY, Fractions, Parameter
from .layouts import WORD
from .packed_bits import (
    COUNT_BITS,
    OWN,
    Boxes,
    Layout,
    Precision,
    Stream,
    by_precision,
)
from .packed_numbers import Coder, Ends
from .records import first_records, joins_of, variant_of, variants_of
from .tiles import Grid, layer_bounds

LIMIT = 0.95  # 8-bit levels: largest error of the picture; drawing adds less than 0.05
CANVAS = (1920, 1080)  # pixels, for which the error is measured
SAMPLE = 1 << 21  # shapes × pixels that are looked at where no kernels are worth compiling
BLOCKS, MANY = 4, 256  # of cells along a side, where there are more layers than so many
LEAST_BITS, MOST_BITS = 4, 24  # of a fraction; a float holds no more
FEWER = 5  # bits that all layers begin without, when the fewest are looked for
BRIEF = 1e-3  # scene units: the step of the corner and the side of a single box
# words of layers that are all alike, up to which a shader reads them without a window: some compilers copy all of them
# wherever one is read
SHORT = 48
ROUNDS = 60
BLAME = (
    0.97  # of the largest share that a layer has in what is off at a pixel: who has so much gets more bits
)
WORST = 4096  # pixels that are looked at in each round
BLAMED = 1 << 20  # layers × pixels that are looked at at a time
GREY = 0.1 / 255.0  # by which the channels of a grey may differ
FAINT = 0.05  # opacity below which layers are not told apart

Limits = tuple[float, float]

CORNER, BOX = var("corner", VEC2), var("box", VEC2)


FIELDS = ("places", "falloff", "color", "opacity")
FINEST = Precision(14.0, 20, 16, 16)


Ranges = dict[str, Limits]  # by the name of a unit: between which values the fractions of a scene lie


@dataclass(frozen=True)
class Packed:
    """A packed scene: the words, how to read them, and how far its picture is off, in 8-bit levels."""

    words: tuple[int, ...]
    bits: int
    grid: Grid
    least: int  # bits of a fraction, at least
    precision: Precision
    ranges: Ranges
    layout: Layout
    error: float

    @property
    def is_short(self) -> bool:
        """Whether a shader may look at all words wherever it reads one."""
        return self.layout.is_plain and len(self.words) <= SHORT


# --- what a fraction stands for ----------------------------------------------------------------------------


def decoded(parameter: Parameter, fractions: Sequence[Expr], ranges: Ranges) -> Expr:
    """A parameter from its fractions 0..1, or a single one of all its components; `corner` and `box` are the layer's
    cells.
    """
    width = parameter.width
    value = fractions[0] if width == 1 else operation(VECTOR[width].value, *fractions)
    return parameter.unit.codec.decode(value, Fractions(CORNER, BOX, ranges))


def ranges_of(scene: Scene) -> Ranges:
    """The least and the largest of a scene's numbers, by unit."""
    found: Ranges = {}
    for layer in scene.layers:
        rest = iter(layer.numbers)
        for slot in slots(layer.structure):
            values = [next(rest) for _ in range(slot.parameter.width)]
            low, high = found.get(slot.parameter.unit.name, (math.inf, -math.inf))
            found[slot.parameter.unit.name] = (min(low, *values), max(high, *values))
    compositing = COMPOSITING[scene.compositing]
    whole = {"opacity": (compositing.lowest, 1.0)} | ({} if compositing.signed else {"color": (0.0, 1.0)})
    return found | whole


# --- packing ------------------------------------------------------------------------------------------------


def pack(scene: Scene, slack: float = 0.0, limit: float = LIMIT) -> Packed:
    """The scene in the fewest bits that keep its picture within `limit` levels on a full HD canvas."""
    packer = Packer(scene, slack)
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


def _largest(difference: Float32Array) -> float:
    return float(np.abs(difference).max()) * 255.0


def _fewest_bits(
    packer: Packer, view: _View, precision: Precision, limit: float
) -> tuple[list[int], float] | None:
    """Bits of each layer's fractions: few at first, more for those whose edges pass where the picture is off.

    None where that does not end.
    """
    counts = np.array(packer.bit_counts(precision)) - FEWER
    picture = view.picture(packer.scene)
    for _ in range(ROUNDS):
        counts = np.maximum(counts, max(LEAST_BITS, counts.max() - packer.layout.boxes.spread))
        off = np.abs(view.picture(packer.quantised(precision, counts.tolist())) - picture).max(axis=0) * 255.0
        if off.max() <= limit:
            return counts.tolist(), float(off.max())
        wrong = np.nonzero(off > limit)[0]
        worst = wrong[np.argsort(-off[wrong], kind="stable")[:WORST]]
        before = counts.copy()
        counts[packer.to_blame(view, worst, counts)] += 1
        counts = np.minimum(counts, MOST_BITS)
        if np.array_equal(counts, before):  # nobody can have more: no further round helps
            return None
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
        self.width, self.height = CANVAS if scene.width >= scene.height else CANVAS[::-1]
        pixels = self.width * self.height
        self.whole = is_large(scene, self.width, self.height)
        step = 1 if self.whole else max(1, math.isqrt(scene.shape_count * pixels // SAMPLE))
        self.tensors = from_scene(scene)
        x, y, self.pixel = reference.canvas(self.tensors, self.width, self.height)
        self.x, self.y = (v.reshape(self.height, self.width)[::step, ::step].flatten() for v in (x, y))

    def picture(self, scene: Scene) -> Float32Array:
        """The scene's pixels, [4, P]."""
        if self.whole:
            pixels: Float32Array = draw(scene, self.width, self.height).numpy()
            return pixels.reshape(4, -1)
        with torch.no_grad(), threads_of_its_own():
            image = reference.composite_points(from_scene(scene), self.x, self.y, self.pixel)
            sample: Float32Array = reference.displayed(image).numpy()
            return sample

    def coverages(self, layers: IntArray, chosen: IntArray) -> Float32Array:
        """Coverage of some layers, in draw order, at some of the pixels, [L, B]."""
        wanted = torch.from_numpy(layers)
        picked = [(group, torch.isin(group.order, wanted)) for group in self.tensors.groups]
        groups = [group.each(partial(_rows, which)) for group, which in picked if which.any()]
        part = replace(self.tensors, groups=groups)
        covers, _ = reference.layers_at(part, self.x[chosen], self.y[chosen], self.pixel)
        found: Float32Array = covers.numpy()
        return found


def _rows(which: torch.Tensor, tensor: torch.Tensor) -> torch.Tensor:
    return tensor[which]


class Packer:
    """Turns the layers of one scene into bits and back. Their cells leave room for edges to move by `slack`."""

    def __init__(self, scene: Scene, slack: float, boxes: Boxes = OWN, grey: float = GREY) -> None:
        self.scene = scene
        self.ranges = ranges_of(scene)
        self.variants, self.joins = variants_of(scene), joins_of(scene)
        self.layout = Layout(self.variants, self.joins, boxes, is_grey=_is_grey(scene, grey))
        bounds = _bounds(scene, slack, boxes) if scene.layers else None
        self.grid = Grid(1, 1, 1.0, (0.0, 0.0)) if bounds is None else _grid_of(bounds, boxes.across)
        self.cells = [] if bounds is None else _cells_of(bounds, self.grid)
        self.finest = min(CANVAS)
        self._ends = cache(lambda cells, parameter: _ends_of(parameter, self.ranges, *self._box(cells)))
        self._said: dict[int, tuple[int, Precision, Layer]] = {}  # of each layer the last that was asked for

    def quantised(self, precision: Precision, counts: Sequence[int]) -> Scene:
        """The scene as a shader will read it, with so many bits for the fractions of each layer."""
        for index, count in enumerate(counts):
            if self._said.get(index, ())[:2] != (count, precision):
                said = self._layer(self.scene.layers[index], self.cells[index], count, precision)[1]
                self._said[index] = (count, precision, said)
        return replace(self.scene, layers=tuple(self._said[index][2] for index in range(len(counts))))

    def bit_counts(self, precision: Precision) -> list[int]:
        """Bits of a layer's fractions: as many as its edge is sharp against the size of its box."""
        wanted = [
            self._wanted(layer, cells, precision)
            for layer, cells in zip(self.scene.layers, self.cells, strict=True)
        ]
        highest = min(MOST_BITS, max([LEAST_BITS, *wanted]))
        least = max(LEAST_BITS, highest - self.layout.boxes.spread)
        return [min(max(count, least), highest) for count in wanted]

    def _wanted(self, layer: Layer, cells: tuple[int, ...], precision: Precision) -> int:
        turning = any(
            parameter.unit in (ANGLE, FREQUENCY)
            for shape in layer.shapes
            for parameter in KINDS[shape.kind].parameters
        )
        return math.ceil(math.log2(self._steepness(layer, cells)) + precision.places + 2 * turning)

    def _steepness(self, layer: Layer, cells: tuple[int, ...]) -> float:
        """How much a picture changes when the layer moves by the size of its cells, in full steps of colour."""
        softness = max(layer.falloff, MIN_FALLOFF_PIXELS / self.finest) / max(abs(layer.opacity), FAINT)
        sizes = (cells[2] - cells[0] + 1, cells[3] - cells[1] + 1)
        return math.hypot(*sizes) / self.grid.per_unit / softness

    @cached_property
    def _all_steepness(self) -> Float64Array:
        pairs = zip(self.scene.layers, self.cells, strict=True)
        return np.array([self._steepness(*pair) for pair in pairs], np.float64)

    def to_blame(self, view: _View, chosen: IntArray, counts: IntArray) -> IntArray:
        """The layers whose coarse places can be why the picture is off at some pixels."""
        heavy, guilty = (self._all_steepness * 0.5**counts)[:, None], np.zeros(len(counts), bool)
        for layers, pixels in self._near(view, chosen):
            for some in np.array_split(pixels, -(-len(pixels) * len(layers) // BLAMED)):
                cover = np.abs(view.coverages(layers, some))
                share = cover * (1.0 - cover) * heavy[layers]
                guilty[layers] |= ((share >= BLAME * share.max(axis=0)) & (share > 0.0)).any(axis=1)
        return np.nonzero(guilty)[0]

    def _near(self, view: _View, chosen: IntArray) -> Iterator[tuple[IntArray, IntArray]]:
        """Layers and pixels that may have to do with each other: each block of cells with what touches it."""
        boxes = np.array(self.cells)
        across = self.layout.boxes.across
        side = across // BLOCKS if len(boxes) > MANY else across
        low, per_unit = self.grid.low, self.grid.per_unit
        columns = np.floor((view.x[chosen].numpy() - low[0]) * per_unit).astype(int) // side
        rows = np.floor((view.y[chosen].numpy() - low[1]) * per_unit).astype(int) // side
        for column, row in {*zip(columns.tolist(), rows.tolist(), strict=True)}:
            first, last = np.array([column, row]) * side, np.array([column, row]) * side + side - 1
            layers = np.nonzero(((boxes[:, :2] <= last) & (boxes[:, 2:] >= first)).all(axis=1))[0]
            if len(layers):
                yield layers, chosen[(columns == column) & (rows == row)]

    def moved(self, scene: Scene, slack: float) -> Packer:
        """The same for layers that have moved a little: they keep their cells where they are still within."""
        packer, now = copy(self), _cells_of(_bounds(scene, slack, self.layout.boxes), self.grid)
        kept = [
            old if old[0] <= new[0] and old[1] <= new[1] and old[2] >= new[2] and old[3] >= new[3] else new
            for old, new in zip(self.cells, now, strict=True)
        ]
        packer.scene, packer.cells, packer._said = scene, kept, {}
        return packer

    def ends(self, index: int, parameter: Parameter) -> Ends:
        """What the fractions of a layer's parameter lie between."""
        return self._ends(self.cells[index], parameter)

    def pack(self, precision: Precision, counts: Sequence[int], error: float = 0.0) -> Packed:
        least = min(counts, default=1)
        stream, last = Stream(), 0
        for layer, cells, count in zip(self.scene.layers, self.cells, counts, strict=True):
            for place in cells:
                stream.put(place, self.layout.boxes.cell)
            stream.put(count - least, self.layout.boxes.choice)
            for value, bits in self._layer(layer, cells, count, precision)[0]:
                stream.put(value, bits)
            last = stream.bits - self.layout.longest(precision, count)  # where the last shape may begin
        words = stream.words((stream.bits - 1) // WORD + 2)
        packed = Packed(words, stream.bits, self.grid, least, precision, self.ranges, self.layout, error)
        if packed.is_short:
            return packed
        window = self.layout.window(precision, least + self.layout.boxes.spread)
        return replace(packed, words=stream.words(last // WORD + window))

    def _layer(
        self, layer: Layer, cells: tuple[int, ...], count: int, precision: Precision
    ) -> tuple[list[tuple[int, int]], Layer]:
        """The numbers of a layer with their bits, and the layer that they say."""
        coder = Coder(partial(self._ends, cells), precision, count)
        if self.joins:
            coder.whole(len(layer.shapes) - 1, COUNT_BITS)
        else:
            coder.whole(self.variants.index(variant_of(layer.shapes[0])), self.layout.variant_bits)
        falloff = coder.value(layer.falloff, LOOK[1])
        opacity = coder.value(layer.opacity, LOOK[0])
        shapes, joints = [], []
        for index, shape in enumerate(layer.shapes):
            joint, said = self._shape(shape, layer.joints[index - 1] if index else None, coder)
            shapes.append(said)
            joints.append(joint)
        return coder.numbers, Layer(tuple(shapes), falloff, opacity, tuple(joints[1:]))

    def _shape(self, shape: Shape, joint: Joint | None, coder: Coder) -> tuple[Joint, Shape]:
        start, said = coder.bits, Joint()
        if self.joins:
            joint = joint or Joint(self.joins[0], 0.0)
            coder.whole(self.variants.index(variant_of(shape)), self.layout.variant_bits)
            coder.whole(self.joins.index(joint.join), self.layout.join_bits)
            said = Joint(joint.join, coder.value(joint.smoothness, JOIN))
        values: dict[Parameter, list[float]] = {}
        given = _by_parameter(shape)
        for parameter in by_precision(given):
            if self.layout.width(parameter) < parameter.width:
                level = coder.level(given[parameter], parameter)
                values[parameter] = [level] * parameter.width
            else:
                values[parameter] = coder.values(given[parameter], parameter)
        if self.joins:
            coder.fill(start + self.layout.longest(coder.precision, coder.count))
        color, *own = (values[parameter] for parameter in PAINTS[shape.paint].parameters)
        row = [value for parameter in KINDS[shape.kind].parameters for value in values[parameter]]
        return said, Shape(
            shape.kind,
            tuple(row),
            (color[0], color[1], color[2]),
            shape.paint,
            tuple(v for part in own for v in part),
        )

    def _box(self, cells: tuple[int, ...]) -> tuple[Limits, Limits]:
        """Low corner and size of a layer's cells, in scene units."""
        low = [c / self.grid.per_unit + start for c, start in zip(cells[:2], self.grid.low, strict=True)]
        high = [
            (c + 1) / self.grid.per_unit + start for c, start in zip(cells[2:], self.grid.low, strict=True)
        ]
        return (low[0], low[1]), (high[0] - low[0], high[1] - low[1])


def _ends_of(parameter: Parameter, ranges: Ranges, corner: Limits, box: Limits) -> Ends:
    """What all fractions 0, and all fractions 1, of a parameter of a layer stand for."""
    names = (*components_of(CORNER), *components_of(BOX))
    known = dict(zip(names, map(const, (*corner, *box)), strict=True))

    def at(end: float) -> list[float]:
        meaning = decoded(parameter, [const(end)] * parameter.width, ranges)
        return [constant(substitute(scalar, known)) for scalar in scalarize(meaning)]

    return at(0.0), at(1.0)


def _by_parameter(shape: Shape) -> dict[Parameter, list[float]]:
    """All numbers of a shape by what they are."""
    rest = iter((*shape.color, *shape.paint_parameters, *shape.parameters))
    declared = (*PAINTS[shape.paint].parameters, *KINDS[shape.kind].parameters)
    return {parameter: [next(rest) for _ in range(parameter.width)] for parameter in declared}


def _is_grey(scene: Scene, within: float) -> bool:
    """Whether the channels of each colour differ by no more."""
    colors = [
        values
        for layer in scene.layers
        for shape in layer.shapes
        for parameter, values in _by_parameter(shape).items()
        if parameter.unit is COLOR
    ]
    return all(max(values) - min(values) <= within for values in colors)


def _grid_of(boxes: Float64Array, across: int) -> Grid:
    """A grid that holds everything."""
    low, high = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
    size = float((high - low).max()) * (1.0 + 1e-5)
    if across == 1:
        corner = (_floor(low[0]), _floor(low[1]))
        return Grid(1, 1, 1.0 / _floor(size + 2.0 * BRIEF), corner)
    corner = (_rounded(low[0] - 2e-6 * size), _rounded(low[1] - 2e-6 * size))
    return Grid(across, across, _rounded_down(across / size), corner)


def _cells_of(boxes: Float64Array, grid: Grid) -> list[tuple[int, ...]]:
    """The cells (low x, low y, high x, high y) that each layer may touch."""
    places = np.floor((boxes - np.array([*grid.low, *grid.low])) * grid.per_unit + [-1e-4, -1e-4, 1e-4, 1e-4])
    return [tuple(box) for box in np.clip(places, 0, grid.columns - 1).astype(int).tolist()]


def _bounds(scene: Scene, slack: float, boxes: Boxes) -> Float64Array:
    """For each layer a box that holds its shapes, also those that only take away, and where it has a box of its own
    its coverage; [L, 4].
    """
    alone = (
        Layer((shape,), 0.0 if boxes.is_shared else layer.falloff)
        for layer in scene.layers
        for shape in layer.shapes
    )
    shapes = layer_bounds(replace(scene, layers=tuple(alone)), slack).boxes
    firsts = first_records(scene.layers)
    low, high = np.minimum.reduceat(shapes[:, :2], firsts), np.maximum.reduceat(shapes[:, 2:], firsts)
    if not boxes.is_shared:
        covered = layer_bounds(scene, slack).boxes
        low, high = np.minimum(covered[:, :2], low), np.maximum(covered[:, 2:], high)
    return np.concatenate([low, high], axis=1)


def _rounded(value: float) -> float:
    return float(np.float32(round(value, COLOR_DECIMALS)))


def _floor(value: float) -> float:
    """The same with few digits, no more than it was."""
    return round(math.floor(value / BRIEF) * BRIEF, COLOR_DECIMALS)


def _rounded_down(value: float) -> float:
    return math.floor(value * 1e4) / 1e4 if value > 1.0 else value
