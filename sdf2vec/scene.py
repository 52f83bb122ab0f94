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
from typing import Any

from .blend import COMPOSITING
from .errors import Sdf2vecError
from .files import one_line, write_atomically
from .shapes import KINDS, LARGEST, Kind, Parameter

FORMAT = "sdf2vec scene"
VERSION = 1
MAX_SHAPES = 65536
MAX_UNION = 128  # shapes in one layer: each is a term of one formula
MAX_SIDE = 65536  # pixels
GEOMETRY_DECIMALS = 6
COLOR_DECIMALS = 5

Color = tuple[float, float, float]


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
    if parameter.positive and value <= parameter.minimum:
        raise SceneError(path, f"must be > {parameter.minimum:g}, got {value:g}")
    if value < parameter.minimum:
        raise SceneError(path, f"must be >= {parameter.minimum:g}, got {value:g}")
    if value > parameter.maximum:
        raise SceneError(path, f"must be <= {parameter.maximum:g}, got {value:g}")


# --- the scene ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Shape:
    """One shape: kind, parameters as one flat row in the order that the kind declares them, colour.

    Raises SceneError for an unknown kind or a parameter out of range.
    """

    kind: str
    parameters: tuple[float, ...]
    color: Color

    def __post_init__(self) -> None:
        declared = _scalar_names(_kind(self.kind))
        if len(self.parameters) != len(declared):
            raise SceneError(
                "parameters", f"a {self.kind} has {len(declared)} numbers, got {len(self.parameters)}"
            )
        values = []
        for value, (parameter, path) in zip(self.parameters, declared, strict=True):
            values.append(_number(value, path))
            _in_range(parameter, values[-1], path)
        object.__setattr__(self, "parameters", tuple(values))
        object.__setattr__(self, "color", _color(self.color, "color"))

    @classmethod
    def of(cls, kind: str, color: Color, **parameters: float | Sequence[float]) -> Shape:
        """A shape from parameters by name: `Shape.of("circle", (1, 0, 0), center=(0, 0), radius=0.2)`."""
        return cls(kind, _flatten(_kind(kind), parameters), color)

    def named(self) -> dict[str, float | tuple[float, ...]]:
        """Parameters by name: a float, or a tuple for those of two components."""
        rest = iter(self.parameters)
        return {
            parameter.name: tuple(next(rest) for _ in parameter.start)
            if len(parameter.start) > 1
            else next(rest)
            for parameter in KINDS[self.kind].parameters
        }


@dataclass(frozen=True)
class Layer:
    """One shape, or several of one kind joined by the exponential smooth minimum.

    `falloff` and `smoothness` (of the union; 0 for one shape) are lengths in scene units. `opacity` is 0..1;
    in an additive scene it is what the layer adds to alpha, −1..1. Raises SceneError.
    """

    shapes: tuple[Shape, ...]
    falloff: float
    opacity: float = 1.0
    smoothness: float = 0.0

    def __post_init__(self) -> None:
        if not self.shapes:
            raise SceneError("union", "must hold at least 1 shape, got 0")
        if len(self.shapes) > MAX_UNION:
            raise SceneError("union", f"at most {MAX_UNION} shapes, got {len(self.shapes)}")
        kinds = dict.fromkeys(shape.kind for shape in self.shapes)
        if len(kinds) > 1:
            raise SceneError("union", f"shapes must be of one kind, got {' and '.join(kinds)}")
        object.__setattr__(self, "falloff", _between(self.falloff, "falloff", 0.0, LARGEST))
        object.__setattr__(self, "opacity", _between(self.opacity, "opacity", -1.0, 1.0, COLOR_DECIMALS))
        object.__setattr__(self, "smoothness", self._checked_smoothness())

    def _checked_smoothness(self) -> float:
        smoothness = _between(self.smoothness, "smoothness", 0.0, LARGEST)
        if len(self.shapes) == 1:
            return 0.0
        if smoothness == 0.0:
            raise SceneError("smoothness", "must be > 0, got 0")
        return smoothness

    @property
    def kind(self) -> str:
        return self.shapes[0].kind


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
    compositing: str = "over"

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
        lowest = -1.0 if self.compositing == "additive" else 0.0
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
        inner = f"{path}.union[{index}]" if len(layer.shapes) > 1 else path
        _check_color(shape.color, f"{inner}.color", lowest)


def _one_of(value: Any, path: str, known: Mapping[str, Any]) -> str:
    if not isinstance(value, str) or value not in known:
        raise SceneError(path, f"must be one of {_listed(known)}, got {_shown(value)}")
    return value


def _kind(name: Any) -> Kind:
    return KINDS[_one_of(name, "kind", KINDS)]


def _listed(names: Mapping[str, Any] | Sequence[str]) -> str:
    return ", ".join(names)


def _scalar_names(kind: Kind) -> list[tuple[Parameter, str]]:
    """Each float of a flat parameter row: what it belongs to, and its path."""
    return [
        (parameter, f"{parameter.name}[{i}]" if len(parameter.start) > 1 else parameter.name)
        for parameter in kind.parameters
        for i in range(len(parameter.start))
    ]


def _flatten(kind: Kind, parameters: Mapping[str, Any]) -> tuple[float, ...]:
    flat: list[float] = []
    names = [parameter.name for parameter in kind.parameters]
    for parameter in kind.parameters:
        if parameter.name not in parameters:
            raise SceneError(parameter.name, f"missing; a {kind.name} has {_listed(names)}")
        value = parameters[parameter.name]
        count = len(parameter.start)
        if count == 1:
            flat.append(value)
        elif isinstance(value, (list, tuple)) and len(value) == count:
            flat.extend(value)
        else:
            raise SceneError(parameter.name, f"must be a list of {count} numbers, got {_shown(value)}")
    for name in parameters:
        if name not in names:
            raise SceneError(_field(name), f"unknown; a {kind.name} has {_listed(names)}")
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
    rest: dict[str, Any] = {"falloff": layer.falloff}
    if layer.opacity != 1.0:
        rest["opacity"] = layer.opacity
    if len(layer.shapes) == 1:
        return _shape_object(layer.shapes[0]) | rest
    return {"union": [_shape_object(shape) for shape in layer.shapes], "smoothness": layer.smoothness} | rest


def _shape_object(shape: Shape) -> dict[str, Any]:
    return {"kind": shape.kind, **shape.named(), "color": shape.color}


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
    if data.get("version") != VERSION or isinstance(data["version"], bool):
        raise SceneError(
            "version", f"this program reads version {VERSION}, got {_shown(data.get('version'))}"
        )
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
        layers=tuple(_numbered(layers, "layers", _read_layer)),
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


def _numbered(items: list[Any], path: str, read: Callable[[Any], Any]) -> Iterator[Any]:
    for index, item in enumerate(items):
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
    outer = {name: data[name] for name in ("falloff", "opacity", "smoothness") if name in data}
    falloff = _required(data, "falloff")
    if "union" not in data:
        outer.pop("smoothness", None)
        shapes: tuple[Shape, ...] = (_shape({k: v for k, v in data.items() if k not in outer}),)
    else:
        _refuse_unknown(data, {"union", "falloff", "opacity", "smoothness"})
        if not isinstance(data["union"], list):
            raise SceneError("union", f"must be a list, got {_shown(data['union'])}")
        shapes = tuple(_numbered(data["union"], "union", _read_shape))
    return Layer(shapes, falloff, outer.get("opacity", 1.0), outer.get("smoothness", 0.0))


def _read_shape(value: Any) -> Shape:
    return _shape(_object(value))


def _shape(data: dict[str, Any]) -> Shape:
    kind = _kind(_required(data, "kind"))
    color = _required(data, "color")
    parameters = {name: item for name, item in data.items() if name not in ("kind", "color")}
    return Shape(kind.name, _flatten(kind, parameters), color)
