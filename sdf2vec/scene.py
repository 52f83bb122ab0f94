"""The scene: what a fit returns, and all that a renderer or an exporter takes. JSON in and out.

Numbers are rounded when a scene is made (geometry to 6 decimals: 0.001 pixel at 1000 pixels; colours to 5),
so that the file says exactly what was rendered and `loads(dumps(scene)) == scene`.
"""

from __future__ import annotations

import json
import math
import os
import reprlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from .blend import COMPOSITING, JOINS, OVER, UNION
from .errors import Sdf2vecError
from .files import one_line, write_atomically
from .layer import Part, Structure
from .paints import BASE, FLAT, PAINTS, Paint
from .shapes import KINDS, Kind
from .units import COLOR_DECIMALS, GEOMETRY_DECIMALS, LONGEST_CANVAS, Parameter

FORMAT = "sdf2vec scene"
VERSION = 2
MAX_SHAPES = 65536
MAX_JOINED = 128  # shapes in one layer: each is a term of one formula
MAX_SIDE = 65536  # pixels

Color = tuple[float, float, float]
BLACK: Color = (0.0, 0.0, 0.0)


class SceneError(Sdf2vecError):
    """A malformed scene; `path` names the field, as in `layers[12].radius`."""

    def __init__(self, path: str, problem: str) -> None:
        super().__init__(f"{path}: {problem}" if path else problem)
        self.path = path
        self.problem = problem


@contextmanager
def _within(path: str) -> Iterator[None]:
    """Puts `path` before the path of an error raised inside."""
    try:
        yield
    except SceneError as error:
        joint = "" if not error.path or error.path.startswith("[") else "."
        raise SceneError(f"{path}{joint}{error.path}", error.problem) from None


# --- checking numbers --------------------------------------------------------------------------------------


def _number(value: Any, path: str, decimals: int = GEOMETRY_DECIMALS) -> float:
    """`value` as a rounded float; −0 becomes 0."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise SceneError(path, f"must be a number, got {_shown(value)}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise SceneError(path, f"must be finite, got {number}")
    return round(number, decimals) + 0.0


def _between(value: Any, path: str, low: float, high: float, decimals: int = GEOMETRY_DECIMALS) -> float:
    number = _number(value, path, decimals)
    if not low <= number <= high:
        raise SceneError(path, f"must be between {low:g} and {high:g}, got {number:g}")
    return number


def _color(value: Any, path: str) -> Color:
    if not isinstance(value, (list, tuple)) or len(value) != 3:
        raise SceneError(path, f"must be a list of 3 numbers, got {_shown(value)}")
    red, green, blue = (_number(v, f"{path}[{i}]", COLOR_DECIMALS) for i, v in enumerate(value))
    return red, green, blue


def _whole(value: Any, path: str, low: int, high: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise SceneError(path, f"must be a whole number, got {_shown(value)}")
    if not low <= value <= high:
        raise SceneError(path, f"must be between {low} and {high}, got {_shown(value)}")
    return value


def _shown(value: Any) -> str:
    text = _REPR.repr(value)
    return text if len(text) <= 40 else f"{text[:37]}..."


class _Repr(reprlib.Repr):
    """Short, and safe, whatever a file holds: a million numbers, a number of a thousand digits, deep nests."""

    def repr1(self, x: Any, level: int) -> str:
        return super().repr1(dict(x) if isinstance(x, dict) else x, level)


_REPR = _Repr()
_REPR.maxlevel = 3


def _field(name: str) -> str:
    """A field's name, of which a file may make anything, as part of a path."""
    return name if name.isidentifier() and len(name) <= 40 else _shown(name)


def _in_range(parameter: Parameter, value: float, path: str) -> None:
    low, high = parameter.unit.low, parameter.unit.high
    if parameter.positive and value <= low:
        raise SceneError(path, f"must be > {low:g}, got {value:g}")
    if value < low:
        raise SceneError(path, f"must be >= {low:g}, got {value:g}")
    if value > high:
        raise SceneError(path, f"must be <= {high:g}, got {value:g}")


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
        kind, paint = _kind(self.kind), _paint(self.paint)
        checked = _checked(self.parameters, kind.parameters, "parameters", f"a {kind.name}")
        object.__setattr__(self, "parameters", checked)
        own = _checked(self.paint_parameters, paint.own, "paint_parameters", f"the paint {paint.name}")
        object.__setattr__(self, "paint_parameters", own)
        object.__setattr__(self, "color", _color(self.color, "color"))

    @classmethod
    def of(
        cls, kind: str, color: Color = BLACK, paint: str = FLAT, **values: float | Sequence[float]
    ) -> Shape:
        """A shape from parameters by name: `Shape.of("circle", (1, 0, 0), center=(0, 0), radius=0.2)`."""
        own = {parameter.name for parameter in _paint(paint).own}
        shape = {name: value for name, value in values.items() if name not in own}
        painted = {name: value for name, value in values.items() if name in own}
        row = _flatten(_kind(kind).parameters, shape, f"a {kind}")
        return cls(kind, row, color, paint, _flatten(_paint(paint).own, painted, f"the paint {paint}"))

    def named(self) -> dict[str, float | tuple[float, ...]]:
        """The kind's parameters by name: a float, or a tuple for those of two components."""
        return _named(KINDS[self.kind].parameters, self.parameters)

    def painted(self) -> dict[str, float | tuple[float, ...]]:
        """The paint's parameters by name, `color` first."""
        return {"color": self.color, **_named(PAINTS[self.paint].own, self.paint_parameters)}

    @property
    def colors(self) -> tuple[Color, ...]:
        """All colours that the paint is made of."""
        return tuple(v for v in self.painted().values() if isinstance(v, tuple) and len(v) == 3)


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
        if not self.shapes:
            raise SceneError("shapes", "must hold at least 1 shape, got 0")
        if len(self.shapes) > MAX_JOINED:
            raise SceneError("shapes", f"at most {MAX_JOINED} shapes, got {len(self.shapes)}")
        if len(self.joints) != len(self.shapes) - 1:
            raise SceneError(
                "joints", f"one fewer than shapes ({len(self.shapes) - 1}), got {len(self.joints)}"
            )
        patches = [shape.kind for shape in self.shapes if KINDS[shape.kind].patch is not None]
        if patches and self.joints:
            raise SceneError("shapes", f"a {patches[0]} can't be joined with others")
        falloff = _between(self.falloff, "falloff", 0.0, LONGEST_CANVAS)
        object.__setattr__(self, "falloff", 0.0 if patches else falloff)
        object.__setattr__(self, "opacity", _between(self.opacity, "opacity", -1.0, 1.0, COLOR_DECIMALS))
        joints = tuple(_numbered(list(self.joints), "shapes", _joint, first=1))
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
        for index, shape in enumerate(self.shapes):
            row += [self.joints[index - 1].smoothness] if index else []
            row += [*shape.color, *shape.paint_parameters] if self.structure[index].adds else []
            row += shape.parameters
        return row

    @classmethod
    def from_numbers(cls, structure: Structure, numbers: Sequence[float]) -> Layer:
        """The layer of a row."""
        rest = iter(numbers)

        def take(parameters: Sequence[Parameter]) -> tuple[float, ...]:
            return tuple(next(rest) for parameter in parameters for _ in range(parameter.width))

        opacity, falloff = next(rest), next(rest)
        shapes, joints = [], []
        for part in structure:
            joints += [Joint(part.join, next(rest))] if part.join else []
            red, green, blue = take((BASE,)) if part.adds else BLACK
            own = take(PAINTS[part.paint].own)
            shape = take(KINDS[part.kind].parameters)
            shapes.append(Shape(part.kind, shape, (red, green, blue), part.paint, own))
        return cls(tuple(shapes), falloff, opacity, tuple(joints))


def _unpainted(shape: Shape, joint: Joint) -> Shape:
    """What only takes away has no colour."""
    return shape if JOINS[joint.join].adds else Shape(shape.kind, shape.parameters)


def _joint(joint: tuple[str, float]) -> Joint:
    join, smoothness = joint
    return Joint(_one_of(join, "join", JOINS), _between(smoothness, "smoothness", 0.0, LONGEST_CANVAS))


@dataclass(frozen=True)
class Scene:
    """Layers in draw order on a canvas of `width` × `height` pixels (the size of the fitted picture).

    Coordinates have their origin at the centre, y down; one unit is the shortest side. `background` is a
    colour, or None for transparent. `compositing` is "over" (colours 0..1) or "additive" (colours −1..1).
    Raises SceneError.
    """

    width: int
    height: int
    layers: tuple[Layer, ...]
    background: Color | None = (0.0, 0.0, 0.0)
    compositing: str = OVER

    def __post_init__(self) -> None:
        _whole(self.width, "width", 1, MAX_SIDE)
        _whole(self.height, "height", 1, MAX_SIDE)
        _one_of(self.compositing, "compositing", COMPOSITING)
        if self.background is not None:
            background = _color(self.background, "background")
            _check_color(background, "background", 0.0)
            object.__setattr__(self, "background", background)
        if self.shape_count > MAX_SHAPES:
            raise SceneError("layers", f"at most {MAX_SHAPES} shapes, got {self.shape_count}")
        lowest = COMPOSITING[self.compositing].lowest
        for index, layer in enumerate(self.layers):
            _check_layer_colors(layer, f"layers[{index}]", lowest)

    @property
    def shape_count(self) -> int:
        return sum(len(layer.shapes) for layer in self.layers)

    @property
    def extent(self) -> tuple[float, float]:
        """Width and height of the canvas in scene units; the smaller is 1."""
        shortest = min(self.width, self.height)
        return self.width / shortest, self.height / shortest


def _check_color(color: Color, path: str, lowest: float) -> None:
    for index, value in enumerate(color):
        if not lowest <= value <= 1.0:
            raise SceneError(f"{path}[{index}]", f"must be between {lowest:g} and 1, got {value:g}")


def _check_layer_colors(layer: Layer, path: str, lowest: float) -> None:
    if layer.opacity < lowest:
        raise SceneError(f"{path}.opacity", f"must be between {lowest:g} and 1, got {layer.opacity:g}")
    for index, shape in enumerate(layer.shapes):
        inner = f"{path}.shapes[{index}]" if layer.joints else path
        for name, value in shape.painted().items():
            if isinstance(value, tuple) and len(value) == 3:
                _check_color(value, f"{inner}.{name}", lowest)


def _one_of(value: Any, path: str, known: Mapping[str, Any]) -> str:
    if not isinstance(value, str) or value not in known:
        raise SceneError(path, f"must be one of {_listed(known)}, got {_shown(value)}")
    return value


def _kind(name: Any) -> Kind:
    return KINDS[_one_of(name, "kind", KINDS)]


def _listed(names: Mapping[str, Any] | Sequence[str]) -> str:
    return ", ".join(names)


def _paint(name: Any) -> Paint:
    return PAINTS[_one_of(name, "paint", PAINTS)]


def _checked(
    row: Sequence[float], parameters: Sequence[Parameter], path: str, owner: str
) -> tuple[float, ...]:
    """A flat row of numbers, rounded. Raises SceneError for a wrong number of them, or one out of range."""
    declared = [
        (parameter, f"{parameter.name}[{i}]" if parameter.width > 1 else parameter.name)
        for parameter in parameters
        for i in range(parameter.width)
    ]
    if len(row) != len(declared):
        raise SceneError(path, f"{owner} has {len(declared)} numbers, got {len(row)}")
    values = []
    for value, (parameter, name) in zip(row, declared, strict=True):
        values.append(_number(value, name, parameter.unit.decimals))
        _in_range(parameter, values[-1], name)
    return tuple(values)


def _named(parameters: Sequence[Parameter], row: Sequence[float]) -> dict[str, float | tuple[float, ...]]:
    rest = iter(row)
    return {p.name: p.values_from([next(rest) for _ in range(p.width)]) for p in parameters}


def _flatten(parameters: Sequence[Parameter], values: Mapping[str, Any], owner: str) -> tuple[float, ...]:
    flat: list[float] = []
    names = [parameter.name for parameter in parameters]
    for parameter in parameters:
        if parameter.name not in values:
            raise SceneError(parameter.name, f"missing; {owner} has {_listed(names)}")
        value = values[parameter.name]
        if parameter.width == 1:
            flat.append(value)
        elif isinstance(value, (list, tuple)) and len(value) == parameter.width:
            flat.extend(value)
        else:
            raise SceneError(
                parameter.name, f"must be a list of {parameter.width} numbers, got {_shown(value)}"
            )
    for name in values:
        if name not in names:
            raise SceneError(_field(name), f"unknown; {owner} has {_listed(names)}")
    return tuple(flat)


# --- writing -----------------------------------------------------------------------------------------------


def dumps(scene: Scene) -> str:
    """The scene as JSON text, one line a layer."""
    head = {
        "format": FORMAT,
        "version": VERSION,
        "width": scene.width,
        "height": scene.height,
        "compositing": scene.compositing,
        "background": scene.background,
    }
    lines = [f"  {json.dumps(key)}: {_json(value)}" for key, value in head.items()]
    layers = ",\n".join(f"    {_json(_layer_object(layer))}" for layer in scene.layers)
    lines.append(f'  "layers": [\n{layers}\n  ]' if layers else '  "layers": []')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def save(scene: Scene, path: str | os.PathLike[str]) -> None:
    """Writes the scene as JSON. Raises Sdf2vecError when the file can't be written."""
    write_atomically(path, dumps(scene).encode())


def _layer_object(layer: Layer) -> dict[str, Any]:
    rest: dict[str, Any] = {}
    if not layer.is_patch:
        rest["falloff"] = layer.falloff
    if layer.opacity != 1.0:
        rest["opacity"] = layer.opacity
    if not layer.joints:
        return _shape_object(layer.shapes[0]) | rest
    first, *others = layer.shapes
    joined = [
        joint._asdict() | _shape_object(shape, JOINS[joint.join].adds)
        for joint, shape in zip(layer.joints, others, strict=True)
    ]
    return {"shapes": [_shape_object(first), *joined]} | rest


def _shape_object(shape: Shape, painted: bool = True) -> dict[str, Any]:
    paint = {"paint": shape.paint} if painted and shape.paint != FLAT else {}
    return {"kind": shape.kind, **shape.named(), **paint, **(shape.painted() if painted else {})}


def _json(value: Any) -> str:
    return json.dumps(_short(value), ensure_ascii=False)


def _short(value: Any) -> Any:
    """Whole floats as integers, tuples as lists."""
    if isinstance(value, float):
        return int(value) if value.is_integer() else value
    if isinstance(value, dict):
        return {key: _short(item) for key, item in value.items()}
    return [_short(item) for item in value] if isinstance(value, (list, tuple)) else value


# --- reading -----------------------------------------------------------------------------------------------


def loads(text: str | bytes) -> Scene:
    """A scene from JSON text. Raises SceneError, whose one line names the offending field."""
    data = _object(_parse(text))
    if data.get("format") != FORMAT:
        raise SceneError("format", f"must be {FORMAT!r}, got {_shown(data.get('format'))}; not a scene file")
    version = data.get("version")
    if version not in (1, VERSION) or isinstance(version, bool):
        raise SceneError("version", f"this program reads versions 1 to {VERSION}, got {_shown(version)}")
    known = {"format", "version", "width", "height", "compositing", "background", "layers"}
    _refuse_unknown(data, known)
    layers = _required(data, "layers")
    if not isinstance(layers, list):
        raise SceneError("layers", f"must be a list, got {_shown(layers)}")
    if len(layers) > MAX_SHAPES:
        raise SceneError("layers", f"at most {MAX_SHAPES} shapes, got {len(layers)}")
    return Scene(
        width=_required(data, "width"),
        height=_required(data, "height"),
        layers=tuple(_numbered(layers, "layers", _read_first_version if version == 1 else _read_layer)),
        background=_required(data, "background"),
        compositing=_required(data, "compositing"),
    )


def load(path: str | os.PathLike[str]) -> Scene:
    """A scene from a JSON file. Raises Sdf2vecError, whose one line names the file and the field."""
    try:
        text = Path(path).read_bytes()
    except (OSError, ValueError) as error:  # ValueError: a NUL character in the path
        reason = getattr(error, "strerror", None) or error
        raise Sdf2vecError(f"{one_line(str(path))}: cannot read the scene ({reason})") from None
    try:
        return loads(text)
    except SceneError as error:
        raise Sdf2vecError(f"{one_line(str(path))}: {error}") from None


def _parse(text: str | bytes) -> Any:
    try:
        return json.loads(text, parse_int=_integer, object_pairs_hook=_Object)
    except json.JSONDecodeError as error:
        raise SceneError(
            "", f"not valid JSON: {error.msg} at line {error.lineno}, column {error.colno}"
        ) from None
    except UnicodeDecodeError:
        raise SceneError("", "not valid JSON: not UTF-8 text") from None
    except RecursionError:
        raise SceneError("", "not a scene: nested too deeply") from None


class _Object(dict[str, Any]):
    """A JSON object that knows which of its fields, if any, appeared more than once."""

    def __init__(self, pairs: list[tuple[str, Any]]) -> None:
        super().__init__(pairs)
        self.repeated: str | None = None
        if len(self) < len(pairs):
            self.repeated = Counter(name for name, _ in pairs).most_common(1)[0][0]


def _integer(digits: str) -> int | float:
    """Python refuses to read thousands of digits; the field's own check then refuses infinity."""
    return int(digits) if len(digits) <= 400 else math.copysign(math.inf, -1 if digits[0] == "-" else 1)


def _numbered(items: list[Any], path: str, read: Callable[[Any], Any], first: int = 0) -> Iterator[Any]:
    for index, item in enumerate(items, first):
        with _within(f"{path}[{index}]"):
            yield read(item)


def _object(value: Any) -> _Object:
    if not isinstance(value, _Object):
        raise SceneError("", f"must be an object, got {_shown(value)}")
    if value.repeated is not None:
        raise SceneError(_field(value.repeated), "appears twice in one object")
    return value


def _required(data: dict[str, Any], name: str) -> Any:
    if name not in data:
        raise SceneError(name, "missing")
    return data[name]


def _refuse_unknown(data: dict[str, Any], known: set[str]) -> None:
    for name in data:
        if name not in known:
            raise SceneError(_field(name), f"unknown field; known are {_listed(sorted(known))}")


def _read_layer(value: Any) -> Layer:
    data = _object(value)
    opacity = data.get("opacity", 1.0)
    if "shapes" not in data:
        shape = _read_shape({k: v for k, v in data.items() if k not in ("falloff", "opacity")})
        return Layer((shape,), _falloff(data, shape), opacity)
    _refuse_unknown(data, {"shapes", "falloff", "opacity"})
    if not isinstance(data["shapes"], list):
        raise SceneError("shapes", f"must be a list, got {_shown(data['shapes'])}")
    read = list(_numbered(data["shapes"], "shapes", _read_joined))
    if read and read[0][1] is not None:
        raise SceneError("shapes[0].join", "the first shape is joined to nothing")
    joints = tuple(joint or Joint() for _, joint in read[1:])
    return Layer(tuple(shape for shape, _ in read), _required(data, "falloff"), opacity, joints)


def _falloff(data: dict[str, Any], shape: Shape) -> Any:
    return data.get("falloff", 0.0) if KINDS[shape.kind].patch is not None else _required(data, "falloff")


def _read_joined(value: Any) -> tuple[Shape, Joint | None]:
    data = dict(_object(value))
    if "join" not in data and "smoothness" not in data:
        return _read_shape(data), None
    joint = _joint((_required(data, "join"), data.pop("smoothness", 0.0)))
    return _read_shape({k: v for k, v in data.items() if k != "join"}, joint.join), joint


def _read_shape(data: dict[str, Any], join: str = "") -> Shape:
    kind, paint = _kind(_required(data, "kind")), data.get("paint", FLAT)
    color = data.get("color", BLACK) if join and not JOINS[join].adds else _required(data, "color")
    values = {name: item for name, item in data.items() if name not in ("kind", "color", "paint")}
    return Shape.of(kind.name, color, paint, **values)


def _read_first_version(value: Any) -> Layer:
    """A layer of version 1: one shape, or a union of one smoothness."""
    data = _object(value)
    if "union" not in data:
        data.pop("smoothness", None)
        return _read_layer(data)
    _refuse_unknown(data, {"union", "falloff", "opacity", "smoothness"})
    if not isinstance(data["union"], list):
        raise SceneError("union", f"must be a list, got {_shown(data['union'])}")
    shapes = list(_numbered(data["union"], "union", lambda item: _read_shape(_object(item))))
    smoothness = _required(data, "smoothness") if len(shapes) > 1 else 0.0
    return Layer.union(shapes, smoothness, _required(data, "falloff"), data.get("opacity", 1.0))
