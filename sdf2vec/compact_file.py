"""The compact scene file, `.sdf`: a scene in steps, in as few bytes as a range coder takes. See docs/compact.md.

What its numbers are steps of are the codecs of their units, which packed shaders have, too. `scene_file` reads it as
it reads JSON; `export.compact_scene` decides how fine the steps are.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from .blend import COMPOSITING, JOINS, OVER
from .entropy import Coder, EndedError, Name, Reader, Writer
from .layer import LOOK, Part, Slot, Structure, slots
from .limits import CANVAS_SIDE
from .paints import FLAT, PAINTS
from .scene import (
    GROUND,
    MAX_JOINED,
    MAX_SHAPES,
    SHEER,
    Ground,
    Layer,
    Scene,
    SceneError,
    one_of,
    within,
)
from .shapes import KINDS
from .units import ANGLE, Parameter, Unit

MAGIC = b"\x89sdf"
VERSION = 2  # the latest; a file is of the first that has all its numbers
PRECISIONS = ("place", "falloff", "color", "opacity")  # of codecs
MOST_BITS = 24
BITS_OF_BITS = 5
GROUND_BITS = 12
THOUSANDTHS = 1000  # a scale ends at whole ones
LONGEST_WORD = 40  # characters
MOST_PARTS = 1024  # sorts of shapes in a scene

Bits = Mapping[str, int]  # by precision


class Scale(NamedTuple):
    """What the steps of a unit lie between, as roots, in thousandths; and how many bits a step has."""

    low: int
    high: int
    bits: int

    @property
    def most(self) -> int:
        return (1 << self.bits) - 1

    @property
    def ends(self) -> tuple[float, float]:
        """The roots of the first step and the last."""
        return self.low / THOUSANDTHS, self.high / THOUSANDTHS

    def step(self, value: Any, unit: Unit) -> Any:
        """Where a value, or many, lies among the steps; not rounded."""
        value = value % math.tau if unit is ANGLE else value
        return unit.codec.step(value, *self.ends, self.most)

    def value(self, step: Any, unit: Unit) -> Any:
        """What a step says."""
        return unit.codec.said(step, *self.ends, self.most)


Scales = Mapping[str, Scale]  # by the name of a unit


@dataclass(frozen=True)
class Numbering:
    """How the numbers of a scene are written: its sorts of shapes, a scale for each unit, the bits of steps, and the
    version of the file.
    """

    parts: tuple[Part, ...]
    scales: Scales
    bits: Bits
    version: int

    @classmethod
    def of(cls, scene: Scene, bits: Bits) -> Numbering:
        """Scales that reach from the least to the largest number of the scene."""
        found: dict[str, list[float]] = defaultdict(list)
        parts: dict[Part, None] = {}
        for layer in scene.layers:
            parts |= dict.fromkeys(layer.structure)
            rest = iter(layer.numbers)
            for slot in slots(layer.structure):
                values = [next(rest) for _ in range(slot.parameter.width)]
                if is_said(slot, layer.structure):
                    found[slot.parameter.unit.name] += values
        units = units_of(parts)
        scales = {u.name: _scale(u, found[u.name], bits) for u in units}
        since = [parameter.since for part in parts for parameter in part.parameters]
        return cls(tuple(parts), scales, bits, max(since, default=1))


def _scale(unit: Unit, values: Iterable[float], bits: Bits) -> Scale:
    """The least scale that holds some values: of opacities and colours 0 and 1 as well, of angles the whole turn."""
    codec = unit.codec
    usual = {"opacity": [0.0, 1.0], "color": [0.0, 1.0]}.get(codec.precision, [])
    roots = [codec.root(v) for v in (*values, *usual)] if unit is not ANGLE else [0.0, math.tau]
    low, high = (
        math.floor(min(roots, default=0.0) * THOUSANDTHS),
        math.ceil(max(roots, default=0.0) * THOUSANDTHS),
    )
    return Scale(low, high, bits[codec.precision])


def units_of(parts: Iterable[Part], version: int = VERSION) -> list[Unit]:
    """The units of all numbers that some sorts of shapes and their layers have in files of a version, in the order in
    which they first appear.
    """
    parameters = (*LOOK, *(parameter for part in parts for parameter in part.parameters))
    return list(dict.fromkeys(parameter.unit for parameter in parameters if parameter.since <= version))


def is_said(slot: Slot, structure: Structure, version: int = VERSION) -> bool:
    """Whether a number is in files of a version: a patch has no falloff."""
    is_there = slot.parameter is not LOOK[1] or KINDS[structure[0].kind].patch is None
    return is_there and slot.parameter.since <= version


# --- what writing and reading have in common -----------------------------------------------------------------


class _Layers:
    """The numbers of layers one after another, with what is known of those before."""

    def __init__(self, coder: Coder, steps: Numbering) -> None:
        self.coder, self.steps = coder, steps
        self.index_bits = (len(steps.parts) - 1).bit_length()
        self.joins = any(part.join for part in steps.parts)

    def structure(self, given: Structure = ()) -> Structure:
        """A layer's sorts of shapes: after each whether there is another."""
        coder, parts = self.coder, self.steps.parts
        found: list[Part] = []
        while True:
            index = parts.index(given[len(found)]) if given else 0
            place = coder.leading(("part", len(found) > 0), index, self.index_bits)
            if place >= len(parts) or len(found) == MAX_JOINED:
                raise SceneError("shapes", "no such sort of shape, or too many in a layer")
            found.append(parts[place])
            last = int(len(found) < len(given))
            if not self.joins or not coder.code(last, coder.models["more", len(found) > 1]):
                return tuple(found)

    def numbers(self, structure: Structure, given: Iterable[int] = ()) -> list[int]:
        """The steps of a layer's numbers; 0 where none is said."""
        rest = iter(given)
        found: list[int] = []
        before: dict[tuple[int | None, str], list[int]] = defaultdict(list)
        for slot in slots(structure):
            known = before[slot.part, slot.parameter.unit.name]
            for component in range(slot.parameter.width):
                value = next(rest, 0)
                if is_said(slot, structure, self.steps.version):
                    value = self._number(slot, component, value, known)
                    known.append(value)
                found.append(value)
        return found

    def _number(self, slot: Slot, component: int, value: int, known: list[int]) -> int:
        """One step: its difference from one that it is near, if there is one."""
        unit = slot.parameter.unit
        scale, stride = self.steps.scales[unit.name], unit.codec.stride
        name: Name = (unit.name, component)
        if stride and len(known) >= stride:
            near = known[-stride]
            found = near + self.coder.difference((unit.name,), value - near)
        else:
            found = self.coder.leading(name, value, scale.bits)
        if not 0 <= found <= scale.most:
            raise SceneError(slot.parameter.name, "is beyond its scale")
        return found


# --- writing -----------------------------------------------------------------------------------------------


def written(scene: Scene, bits: Bits) -> bytes:
    """A scene as a file, its numbers in steps of so many bits. Raises SceneError for what no file can say."""
    return encoded(scene, Numbering.of(scene, bits))


def encoded(scene: Scene, steps: Numbering) -> bytes:
    """The same in steps that may be those of another scene of the same sorts of shapes."""
    coder = Writer()
    _head(coder, scene)
    if len(steps.parts) > MOST_PARTS:
        raise SceneError("layers", f"more than {MOST_PARTS} sorts of shapes")
    coder.count(len(steps.parts))
    for part in steps.parts:
        for name, usual in zip(part, (None, FLAT, None), strict=True):
            _word(coder, "" if name == usual else name)
    for name in PRECISIONS:
        coder.raw(steps.bits[name], BITS_OF_BITS)
    for scale in steps.scales.values():
        coder.signed(scale.low)
        coder.count(scale.high - scale.low)
    coder.count(len(scene.layers))
    layers = _Layers(coder, steps)
    for layer in scene.layers:
        layers.numbers(layers.structure(layer.structure), _steps_of(layer, steps.scales))
    return MAGIC + bytes([steps.version]) + coder.done()


def _steps_of(layer: Layer, scales: Scales) -> list[int]:
    """The steps of a layer's row."""
    rest = iter(layer.numbers)
    found: list[int] = []
    for slot in slots(layer.structure):
        unit = slot.parameter.unit
        for _ in range(slot.parameter.width):
            step = scales[unit.name].step(next(rest), unit)
            found.append(round(min(max(step, 0.0), scales[unit.name].most)))
    return found


def _head(coder: Coder, scene: Scene) -> None:
    coder.count(scene.width - 1)
    coder.count(scene.height - 1)
    _word(coder, "" if scene.compositing == OVER else scene.compositing)
    channels = scene.background or ()
    coder.count(len(channels))
    for channel in channels:
        coder.raw(round(channel * ((1 << GROUND_BITS) - 1)), GROUND_BITS)


def _word(coder: Coder, text: str) -> None:
    if not (text.isascii() and text.isprintable() and len(text) <= LONGEST_WORD):
        raise SceneError("", f"the name {text[:LONGEST_WORD]!r} can't be in a compact scene")
    for letter in (*text.encode(), 0):
        coder.raw(letter, 7)


# --- reading -----------------------------------------------------------------------------------------------


def is_compact(data: bytes) -> bool:
    """Whether a file is, or claims to be, a compact scene."""
    return data[: len(MAGIC)] == MAGIC


def read(data: bytes) -> Scene:
    """The scene of a file. Raises SceneError, whose one line says what is wrong."""
    if not is_compact(data) or len(data) <= len(MAGIC):
        raise SceneError("", "no compact scene")
    if not 1 <= (version := data[len(MAGIC)]) <= VERSION:
        raise SceneError(
            "version", f"this program reads compact scenes of versions 1 to {VERSION}, got {version}"
        )
    try:
        coder = Reader(data, len(MAGIC) + 1)
        scene = _read(coder, version)
    except EndedError:
        raise SceneError("", "the compact scene ends too early") from None
    if coder.left:
        raise SceneError("", "the compact scene goes on after its end")
    return scene


def _read(coder: Coder, version: int) -> Scene:
    width, height = (_counted(coder, CANVAS_SIDE - 1, side) + 1 for side in ("width", "height"))
    compositing = one_of(_read_word(coder) or OVER, "compositing", COMPOSITING)
    ground = _read_ground(coder)
    parts = tuple(_read_part(coder) for _ in range(_counted(coder, MOST_PARTS, "parts")))
    bits = {name: coder.raw(0, BITS_OF_BITS) for name in PRECISIONS}
    if not all(1 <= count <= MOST_BITS for count in bits.values()):
        raise SceneError("bits", f"must be 1 to {MOST_BITS}, got {list(bits.values())}")
    units = units_of(parts, version)
    steps = Numbering(
        parts, {unit.name: _read_scale(coder, bits[unit.codec.precision]) for unit in units}, bits, version
    )
    count = _counted(coder, MAX_SHAPES if parts else 0, "layers")
    layers = _Layers(coder, steps)
    found: list[Layer] = []
    shapes = 0
    for index in range(count):
        with within(f"layers[{index}]"):
            structure = layers.structure()
            shapes += len(structure)
            if shapes > MAX_SHAPES:
                raise SceneError("shapes", f"at most {MAX_SHAPES}")
            found.append(Layer.from_numbers(structure, _values(structure, layers.numbers(structure), steps)))
    return Scene(width, height, tuple(found), ground, compositing)


def _values(structure: Structure, row: Iterable[int], steps: Numbering) -> list[float]:
    """A layer's row from its steps; 0 for what the file does not say."""
    rest, found = iter(row), []
    for slot in slots(structure):
        for _ in range(slot.parameter.width):
            step, unit = next(rest), slot.parameter.unit
            found.append(
                _legal(steps.scales[unit.name].value(step, unit), slot.parameter)
                if is_said(slot, structure, steps.version)
                else 0.0
            )
    return found


def _legal(value: float, parameter: Parameter) -> float:
    """What a scene takes: a length that must be positive may have become 0."""
    unit = parameter.unit
    return min(max(value, unit.low + (10.0**-unit.decimals if parameter.positive else 0.0)), unit.high)


def _counted(coder: Coder, most: int, path: str) -> int:
    if (count := coder.count()) > most:
        raise SceneError(path, f"must be at most {most}, got {count}")
    return count


def _read_ground(coder: Coder) -> Ground:
    widths = (0, GROUND.width, SHEER.width)
    count = _counted(coder, max(widths), "background")
    if count not in widths:
        raise SceneError("background", f"must be of {widths} numbers, got {count}")
    most = (1 << GROUND_BITS) - 1
    if not count:
        return None
    red, green, blue, *alpha = [coder.raw(0, GROUND_BITS) / most for _ in range(count)]
    return (red, green, blue, alpha[0]) if alpha else (red, green, blue)


def _read_part(coder: Coder) -> Part:
    kind, paint, join = (_read_word(coder) for _ in Part._fields)
    with within("parts"):
        one_of(kind, "kind", KINDS)
        one_of(paint or FLAT, "paint", PAINTS)
        one_of(join, "join", ("", *JOINS))
    return Part(kind, paint or FLAT, join)


def _read_scale(coder: Coder, bits: int) -> Scale:
    low = coder.signed()
    return Scale(low, low + coder.count(), bits)


def _read_word(coder: Coder) -> str:
    letters = bytearray()
    while letter := coder.raw(0, 7):
        letters.append(letter)
        if len(letters) > LONGEST_WORD:
            raise SceneError("", "a name of the compact scene is too long")
    return letters.decode()
