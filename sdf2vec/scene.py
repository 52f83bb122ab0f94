"""The scene: what a fit returns, and all that a renderer or an exporter takes. `scene_file` reads and writes it.

Numbers are rounded when a scene is made (geometry to 6 decimals: 0.001 pixel at 1000 pixels; colours to 5),
so that its file says exactly what was rendered. msgspec checks them against what their units declare.
"""

from __future__ import annotations

import math
import re
import reprlib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice
from typing import Annotated, Any, NamedTuple

import msgspec
from msgspec import Meta

from .blend import COMPOSITING, JOINS, OVER, UNION
from .errors import Sdf2vecError
from .layer import JOIN, LOOK, Part, Structure
from .limits import CANVAS_SIDE
from .paints import BASE, FLAT, PAINTS
from .shapes import KINDS
from .units import BACKGROUND, COLOR, Parameter

MAX_SHAPES = 65536
MAX_JOINED = 128  # shapes in one layer: each is a term of one formula

Side = Annotated[int, Meta(ge=1, le=CANVAS_SIDE)]  # pixels
Joined = Annotated[list[Any], Meta(min_length=1, max_length=MAX_JOINED)]
Color = tuple[float, float, float]
Ground = Color | tuple[float, float, float, float] | None  # opaque, with an alpha of its own, none
Value = float | tuple[float, ...]  # of a parameter
BLACK: Color = (0.0, 0.0, 0.0)
GROUND = Parameter("background", BACKGROUND, BLACK)
SHEER = Parameter("background", BACKGROUND, (*BLACK, 0.0))  # with an alpha of its own


class SceneError(Sdf2vecError):
    """A malformed scene; `path` names the field, as in `layers[12].radius`."""

    def __init__(self, path: str, problem: str) -> None:
        super().__init__(f"{path}: {problem}" if path else problem)
        self.path = path
        self.problem = problem


@contextmanager
def within(path: str) -> Iterator[None]:
    """Puts `path` before the path of an error raised inside."""
    try:
        yield
    except SceneError as error:
        dot = "" if not error.path or error.path.startswith("[") else "."
        raise SceneError(f"{path}{dot}{error.path}", error.problem) from None


# --- checking ----------------------------------------------------------------------------------------------

_NOUNS = {"float": "number", "int": "whole number", "array": "list"}
_REFUSAL = re.compile(  # what msgspec says of a value
    r"(?:Object missing required field `(?P<missing>\w+)`|Expected `(?P<kind>\w+)`(?: (?P<bound>[<>]=? \S+))?"
    r"(?P<length> of length (?:[<>]= )?\d+)?(?:, got .*?)?|Number out of range)(?: - at `\$\.?(?P<path>.*)`)?"
)


def checked(hint: Any, value: Any) -> Any:
    """A value as a type. Raises SceneError, which says what is wrong where in it."""
    try:
        return msgspec.convert(value, hint)
    except msgspec.ValidationError as error:
        raise _refusal(str(error), value) from None


def _refusal(error: str, value: Any) -> SceneError:
    """What msgspec says of a value, in our words."""
    missing, kind, bound, length, path = _REFUSAL.fullmatch(error).groups(default="")  # type: ignore[union-attr]
    if missing:
        return SceneError(missing, "missing")
    for name, index in re.findall(r"(\w+)|\[(\d+)\]", path):
        value = value[name or int(index)]
    wanted = f"a {_NOUNS.get(kind)}{length}"
    if not kind or (isinstance(value, float) and not math.isfinite(value)):
        wanted = "finite"
    elif bound:
        sign, limit = bound.split()
        wanted = f"{sign} {float(limit):g}"
    return SceneError(path, f"must be {wanted}, got {shown(value)}")


def shown(value: Any) -> str:
    """Anything, a million numbers or a deep nest, in at most 40 characters of a message."""
    text = f"{value:g}" if isinstance(value, float) else reprlib.repr(value)
    return text if len(text) <= 40 else f"{text[:37]}..."


def one_of(value: Any, path: str, known: Collection[str]) -> str:
    """A known name. Raises SceneError."""
    if not isinstance(value, str) or value not in known:
        raise SceneError(path, f"must be one of {', '.join(known)}, got {shown(value)}")
    return value


def refuse_unknown(names: Iterable[str], known: Sequence[str]) -> None:
    """Raises SceneError for the first field that is not known."""
    for name in names:
        if name not in known:
            raise SceneError(field_of(name), f"unknown; known are {', '.join(known)}")


def field_of(name: str) -> str:
    """A field's name, of which a file may make anything, as part of a path."""
    return name if name.isidentifier() and len(name) <= 40 else shown(name)


@lru_cache(maxsize=4096)
def _record(parameters: tuple[Parameter, ...]) -> type[msgspec.Struct]:
    """A field for each parameter: its number, or as many as it has, in the range of its unit."""
    fields: list[Any] = []
    for parameter in parameters:
        low, high = parameter.unit.low, parameter.unit.high
        least = Meta(gt=low) if parameter.positive else Meta(ge=low)
        number = Annotated[float, least, Meta(le=high)]
        hint: Any = number if parameter.width == 1 else tuple[(number,) * parameter.width]  # type: ignore[misc]
        default = [parameter.usual] if parameter.optional else []
        fields.append((parameter.name, hint, *default))
    return msgspec.defstruct("Numbers", fields, kw_only=True)


def numbers_of(
    parameters: tuple[Parameter, ...], values: Mapping[str, Any], others: Sequence[str] = ()
) -> tuple[float, ...]:
    """The flat row of some parameters, rounded, from their values by name. `others` may stand beside them.

    Raises SceneError for a value that is missing, unknown or out of range.
    """
    given = {p.name: _rounded(values[p.name], p.unit.decimals) for p in parameters if p.name in values}
    if len(given) < len(values):
        refuse_unknown(values, [*others, *(parameter.name for parameter in parameters)])
    record = checked(_record(parameters), given)
    flat: list[float] = []
    for value in msgspec.structs.astuple(record):
        flat += value if isinstance(value, tuple) else (value,)
    return tuple(flat)


def _rounded(value: Any, decimals: int) -> Any:
    """A float, or those of a list, rounded; −0 becomes 0. Whatever else as it is."""
    if isinstance(value, (list, tuple)):
        return [round(float(v), decimals) + 0.0 if isinstance(v, float) else v for v in value]
    return round(float(value), decimals) + 0.0 if isinstance(value, float) else value


def named(parameters: Iterable[Parameter], row: Iterable[float]) -> dict[str, Value]:
    """Values by name from the numbers that come next in a row."""
    rest = iter(row)
    return {p.name: p.values_from([next(rest) for _ in range(p.width)]) for p in parameters}


# What a notebook can show of a scene, by media type: `api` says it, since a scene knows nothing of rendering.
SHOWN: dict[str, Callable[[Scene], str]] = {}


# --- the scene ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Shape:
    """One shape: kind, parameters as one flat row in the order that the kind declares them, colour.

    `paint` names what is made of the colour, with `paint_parameters` as one flat row of what it declares after that.
    Raises SceneError for an unknown kind or paint, or a number out of range.
    """

    kind: str
    parameters: tuple[float, ...]
    color: Color = BLACK
    paint: str = FLAT
    paint_parameters: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        kind, paint = KINDS[one_of(self.kind, "kind", KINDS)], PAINTS[one_of(self.paint, "paint", PAINTS)]
        row = _checked_row(kind.parameters, self.parameters, "parameters", f"a {kind.name}")
        own = _checked_row(paint.own, self.paint_parameters, "paint_parameters", f"the paint {paint.name}")
        object.__setattr__(self, "parameters", row)
        object.__setattr__(self, "paint_parameters", own)
        object.__setattr__(self, "color", numbers_of((BASE,), {BASE.name: self.color}))

    @classmethod
    def of(cls, kind: str, color: Color = BLACK, paint: str = FLAT, **values: Any) -> Shape:
        """A shape from parameters by name: `Shape.of("circle", (1, 0, 0), center=(0, 0), radius=0.2)`."""
        part = Part(one_of(kind, "kind", KINDS), one_of(paint, "paint", PAINTS))
        return cls.from_numbers(part, iter(numbers_of(part.parameters, {BASE.name: color, **values})))

    @classmethod
    def from_numbers(cls, part: Part, rest: Iterator[float]) -> Shape:
        """The shape of the numbers that come next in a layer's row, after the smoothness."""
        paint = PAINTS[part.paint]
        red, green, blue, *own = _taken(rest, paint.parameters) if part.adds else BLACK
        row = _taken(rest, KINDS[part.kind].parameters)
        return cls(part.kind, row, (red, green, blue), part.paint, tuple(own))

    def named(self) -> dict[str, Value]:
        """The kind's parameters by name: a float, or a tuple for those of several components."""
        return named(KINDS[self.kind].parameters, self.parameters)

    def painted(self) -> dict[str, Value]:
        """The paint's parameters by name, `color` first."""
        return named(PAINTS[self.paint].parameters, (*self.color, *self.paint_parameters))

    @property
    def colors(self) -> tuple[Color, ...]:
        """All colours that the paint is made of."""
        return tuple(v for v in self.painted().values() if isinstance(v, tuple) and len(v) == 3)


def _taken(rest: Iterator[float], parameters: Iterable[Parameter]) -> tuple[float, ...]:
    """The numbers of some parameters, which come next in a row."""
    return tuple(islice(rest, sum(parameter.width for parameter in parameters)))


def _checked_row(
    parameters: tuple[Parameter, ...], row: Sequence[float], path: str, owner: str
) -> tuple[float, ...]:
    """A flat row of numbers, rounded. Raises SceneError for a wrong number of them, or one out of range."""
    count = sum(parameter.width for parameter in parameters)
    if len(row) != count:
        raise SceneError(path, f"{owner} has {count} numbers, got {len(row)}")
    return numbers_of(parameters, named(parameters, row)) if parameters else ()


class Joint(NamedTuple):
    """How a shape is joined to those before it in its layer: a name in `blend.JOINS`, and a length in scene units."""

    join: str = UNION
    smoothness: float = 0.0


@dataclass(frozen=True)
class Layer:
    """A sequence of shapes joined left to right by smooth union, subtraction or intersection.

    `falloff` is a length in scene units, 0 for a patch. `opacity` is 0..1; in an additive scene it is
    what the layer adds to alpha, −1..1. `joints` say how each shape but the first is joined, 0 being sharp.
    Raises SceneError.
    """

    shapes: tuple[Shape, ...]
    falloff: float = 0.0
    opacity: float = 1.0
    joints: tuple[Joint, ...] = ()

    def __post_init__(self) -> None:
        with within("shapes"):
            checked(Joined, self.shapes)
        if len(self.joints) != len(self.shapes) - 1:
            raise SceneError("joints", f"must be {len(self.shapes) - 1}, got {len(self.joints)}")
        patches = [shape.kind for shape in self.shapes if KINDS[shape.kind].patch is not None]
        if patches and self.joints:
            raise SceneError("shapes", f"a {patches[0]} can't be joined with others")
        opacity, falloff = numbers_of(LOOK, {"opacity": self.opacity, "falloff": self.falloff})
        object.__setattr__(self, "falloff", 0.0 if patches else falloff)
        object.__setattr__(self, "opacity", opacity)
        joints = tuple(_joint(index, *joint) for index, joint in enumerate(self.joints, 1))
        object.__setattr__(self, "joints", joints)
        object.__setattr__(self, "shapes", (self.shapes[0], *map(_unpainted, self.shapes[1:], joints)))

    @classmethod
    def union(cls, shapes: Sequence[Shape], smoothness: float, falloff: float, opacity: float = 1.0) -> Layer:
        """Shapes joined by unions of one smoothness."""
        return cls(tuple(shapes), falloff, opacity, (Joint(UNION, smoothness),) * (len(shapes) - 1))

    @property
    def structure(self) -> Structure:
        """What decides its formula."""
        joins = ("", *(joint.join for joint in self.joints))
        return tuple(
            Part(shape.kind, shape.paint, join) for shape, join in zip(self.shapes, joins, strict=True)
        )

    @property
    def seen(self) -> tuple[Shape, ...]:
        """The shapes whose colours are seen: all but those that only take away."""
        return tuple(s for s, part in zip(self.shapes, self.structure, strict=True) if part.adds)

    @property
    def colors(self) -> tuple[Color, ...]:
        """All colours that its shapes are painted with."""
        return tuple(color for shape in self.seen for color in shape.colors)

    @property
    def is_patch(self) -> bool:
        """Whether it has coverage of its own instead of a soft edge."""
        return KINDS[self.shapes[0].kind].patch is not None

    @property
    def numbers(self) -> list[float]:
        """Its row: see `layer.slots`."""
        row = [self.opacity, self.falloff]
        for shape, joint in zip(self.shapes, (None, *self.joints), strict=True):
            row += [joint.smoothness] if joint else []
            row += [*shape.color, *shape.paint_parameters] if not joint or JOINS[joint.join].adds else []
            row += shape.parameters
        return row

    @classmethod
    def from_numbers(cls, structure: Structure, numbers: Sequence[float]) -> Layer:
        """The layer of a row."""
        rest = iter(numbers)
        opacity, falloff = next(rest), next(rest)
        shapes, joints = [], []
        for part in structure:
            joints += [Joint(part.join, next(rest))] if part.join else []
            shapes.append(Shape.from_numbers(part, rest))
        return cls(tuple(shapes), falloff, opacity, tuple(joints))


def _unpainted(shape: Shape, joint: Joint) -> Shape:
    """What only takes away has no colour."""
    return shape if JOINS[joint.join].adds else Shape(shape.kind, shape.parameters)


def _joint(index: int, join: str, smoothness: float) -> Joint:
    with within(f"shapes[{index}]"):
        return Joint(one_of(join, "join", JOINS), *numbers_of((JOIN,), {JOIN.name: smoothness}))


@dataclass(frozen=True)
class Scene:
    """Layers in draw order on a canvas of `width` × `height` pixels (the size of the fitted picture).

    Coordinates have their origin at the centre, y down; one unit is the shortest side. `background` is a
    colour, one with an alpha (straight RGBA), or None for transparent: an alpha of 1 is left out, and one of 0 is None.
    `compositing` is "over" (colours 0..1) or "additive" (colours −1..1).
    Raises SceneError.
    """

    width: int
    height: int
    layers: tuple[Layer, ...]
    background: Ground = BLACK
    compositing: str = OVER

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            with within(name):
                checked(Side, getattr(self, name))
        one_of(self.compositing, "compositing", COMPOSITING)
        object.__setattr__(self, "background", _checked_ground(self.background))
        if self.shape_count > MAX_SHAPES:
            raise SceneError("layers", f"at most {MAX_SHAPES} shapes, got {self.shape_count}")
        if not COMPOSITING[self.compositing].signed:
            for index, layer in enumerate(self.layers):
                _refuse_signs(layer, f"layers[{index}]")

    def __repr__(self) -> str:
        kinds = dict.fromkeys(shape.kind for layer in self.layers for shape in layer.shapes)
        told = f"{self.count_text} in {len(self.layers)} layers" + (f": {', '.join(kinds)}" if kinds else "")
        ground = "" if self.opaque else ", transparent"
        return f"<Scene {self.width} × {self.height}, {told}; {self.compositing}{ground}>"

    def _repr_mimebundle_(
        self, include: Collection[str] | None = None, exclude: Collection[str] | None = None
    ) -> dict[str, str]:
        """What a notebook shows: the first of `SHOWN`, which is quick, unless others are asked for."""
        asked = list(SHOWN)[:1] if include is None else [kind for kind in SHOWN if kind in include]
        return {kind: SHOWN[kind](self) for kind in asked if kind not in (exclude or ())}

    @property
    def shape_count(self) -> int:
        return sum(len(layer.shapes) for layer in self.layers)

    @property
    def pixel(self) -> float:
        """The side of a pixel of the fitted picture, in scene units."""
        return 1.0 / min(self.width, self.height)

    @property
    def count_text(self) -> str:
        """How many shapes it has, for people."""
        return "1 shape" if self.shape_count == 1 else f"{self.shape_count} shapes"

    @property
    def ground(self) -> tuple[float, float, float, float]:
        """What is below all layers, premultiplied RGBA."""
        red, green, blue, *given = self.background or (*BLACK, 0.0)
        alpha = given[0] if given else 1.0
        return red * alpha, green * alpha, blue * alpha, alpha

    @property
    def opaque(self) -> bool:
        """Whether nothing shines through."""
        return self.ground[3] == 1.0

    @property
    def extent(self) -> tuple[float, float]:
        """Width and height of the canvas in scene units; the smaller is 1."""
        shortest = min(self.width, self.height)
        return self.width / shortest, self.height / shortest


def _checked_ground(ground: Ground) -> Ground:
    """A background, rounded. Raises SceneError."""
    if ground is None:
        return None
    parameter = SHEER if isinstance(ground, (list, tuple)) and len(ground) == 4 else GROUND
    red, green, blue, *alpha = numbers_of((parameter,), {parameter.name: ground})
    if not alpha or alpha[0] == 1.0:
        return red, green, blue
    return (red, green, blue, alpha[0]) if alpha[0] else None


def _refuse_signs(layer: Layer, path: str) -> None:
    """Raises SceneError for an opacity or a colour below 0."""
    if layer.opacity < 0.0:
        raise SceneError(f"{path}.opacity", f"must be >= 0, got {layer.opacity:g}")
    for index, shape in enumerate(layer.shapes):
        inner = f"{path}.shapes[{index}]" if layer.joints else path
        rest = iter((*shape.color, *shape.paint_parameters))
        for parameter in PAINTS[shape.paint].parameters:
            numbers = _taken(rest, (parameter,))
            if parameter.unit is COLOR and min(numbers) < 0.0:
                place = f"{inner}.{parameter.name}[{numbers.index(min(numbers))}]"
                raise SceneError(place, f"must be >= 0, got {min(numbers):g}")
