"""The scene file: JSON in and out, so that `loads(dumps(scene)) == scene`. See docs/scene.md.

What a shape or a layer has in a file is what its kind, its paint and its join declare; what is as usual is left out.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from .blend import JOINS, UNION
from .compact_file import is_compact, read
from .errors import Sdf2vecError
from .files import one_line, write_atomically
from .layer import JOIN, LOOK, Part
from .paints import FLAT, PAINTS
from .scene import (
    MAX_SHAPES,
    Joined,
    Layer,
    Scene,
    SceneError,
    checked,
    field_of,
    named,
    numbers_of,
    one_of,
    refuse_unknown,
    shown,
    within,
)
from .shapes import KINDS
from .units import Parameter

FORMAT = "sdf2vec scene"
VERSION = 2


class _File(msgspec.Struct):
    """What is in a file; `Scene` checks what is not checked here."""

    format: Any
    version: Any
    width: Any
    height: Any
    compositing: Any
    background: Any
    layers: Annotated[list[Any], Meta(max_length=MAX_SHAPES)]


# --- writing -----------------------------------------------------------------------------------------------


def dumps(scene: Scene) -> str:
    """The scene as JSON text, one line a layer."""
    head = {"format": FORMAT, "version": VERSION, "width": scene.width, "height": scene.height}
    head |= {"compositing": scene.compositing, "background": scene.background}
    lines = [f"  {json.dumps(key)}: {_json(value)}" for key, value in head.items()]
    layers = ",\n".join(f"    {_json(_layer_object(layer))}" for layer in scene.layers)
    lines.append(f'  "layers": [\n{layers}\n  ]' if layers else '  "layers": []')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def save(scene: Scene, path: str | os.PathLike[str]) -> None:
    """Writes the scene as JSON. Raises Sdf2vecError when the file can't be written."""
    write_atomically(path, dumps(scene).encode())


def _layer_object(layer: Layer) -> dict[str, Any]:
    rest = iter(layer.numbers)
    look = _told(LOOK, rest)
    shapes = [_words(part) | _told(part.parameters, rest) for part in layer.structure]
    return (shapes[0] if len(shapes) == 1 else {"shapes": shapes}) | look


def _words(part: Part) -> dict[str, str]:
    join = {} if part.join in ("", UNION) else {"join": part.join}
    return join | {"kind": part.kind} | ({} if part.paint == FLAT else {"paint": part.paint})


def _told(parameters: tuple[Parameter, ...], rest: Iterator[float]) -> dict[str, Any]:
    """What a file says of some parameters, whose numbers come next in a row."""
    values = named(parameters, rest)
    return {p.name: values[p.name] for p in parameters if not p.optional or values[p.name] != p.usual}


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
    """A scene from JSON text, or from a compact file. Raises SceneError, whose one line names the offending field."""
    if isinstance(text, bytes) and is_compact(text):
        return read(text)
    data = _object(_parse(text))
    if data.get("format") != FORMAT:
        raise SceneError("format", f"must be {FORMAT!r}, got {shown(data.get('format'))}; not a scene file")
    version = data.get("version")
    if version not in (1, VERSION) or isinstance(version, bool):
        raise SceneError("version", f"this program reads versions 1 to {VERSION}, got {shown(version)}")
    refuse_unknown(data, _File.__struct_fields__)
    file = checked(_File, data)
    # In version 1 all joins of a layer were unions of one smoothness, which the layer had.
    several, shared = ("union", (JOIN,)) if version == 1 else ("shapes", ())
    layers = []
    for index, item in enumerate(file.layers):
        with within(f"layers[{index}]"):
            layers.append(_read_layer(item, several, shared))
    return Scene(file.width, file.height, tuple(layers), file.background, file.compositing)


def load(path: str | os.PathLike[str]) -> Scene:
    """A scene from a file, JSON or compact. Raises Sdf2vecError, whose one line names the file and the field."""
    try:
        return loads(Path(path).read_bytes())
    except SceneError as error:
        raise Sdf2vecError(f"{one_line(str(path))}: {error}") from None
    except (OSError, ValueError) as error:  # ValueError: a NUL character in the path
        reason = getattr(error, "strerror", None) or error
        raise Sdf2vecError(f"{one_line(str(path))}: cannot read the scene ({reason})") from None


class _Repeated:
    """A JSON object in which a field appears more than once."""

    def __init__(self, field: str) -> None:
        self.field = field


def _parse(text: str | bytes) -> Any:
    try:
        return json.loads(text, parse_int=_integer, object_pairs_hook=_pairs)
    except json.JSONDecodeError as error:
        problem = f"not valid JSON: {error.msg} at line {error.lineno}, column {error.colno}"
        raise SceneError("", problem) from None
    except UnicodeDecodeError:
        raise SceneError("", "not valid JSON: not UTF-8 text") from None
    except RecursionError:
        raise SceneError("", "not a scene: nested too deeply") from None


def _integer(digits: str) -> int | float:
    """Python refuses to read thousands of digits; what is too large for a float becomes infinite."""
    return int(digits) if len(digits) < 20 else float(digits)


def _pairs(pairs: list[tuple[str, Any]]) -> dict[str, Any] | _Repeated:
    if len(made := dict(pairs)) == len(pairs):
        return made
    return _Repeated(Counter(name for name, _ in pairs).most_common(1)[0][0])


def _object(value: Any) -> dict[str, Any]:
    if isinstance(value, _Repeated):
        raise SceneError(field_of(value.field), "appears twice in one object")
    if not isinstance(value, dict):
        raise SceneError("", f"must be an object, got {shown(value)}")
    return value


def _read_layer(value: Any, several: str, shared: tuple[Parameter, ...]) -> Layer:
    """A layer of one shape, or of those in its list `several`, for whose joins it says what is `shared`."""
    data = _object(value)
    if several not in data:
        part, row = _read_part(data, LOOK)
        return Layer.from_numbers((part,), row)
    look = numbers_of((*LOOK, *shared), data, (several,))
    common = named(shared, look[len(LOOK) :])
    with within(several):
        items = checked(Joined, data[several])
    parts: list[Part] = []
    numbers = [*look[: len(LOOK)]]
    for index, item in enumerate(items):
        with within(f"{several}[{index}]"):
            part, row = _read_part(_object(item) | (common if index else {}), joined=index > 0)
        parts.append(part)
        numbers += row
    return Layer.from_numbers(tuple(parts), numbers)


def _read_part(
    data: dict[str, Any], look: tuple[Parameter, ...] = (), joined: bool = False
) -> tuple[Part, tuple[float, ...]]:
    """A shape's names, and its row of numbers, which begins with those of `look`."""
    kind = one_of(data.get("kind"), "kind", KINDS)
    paint = one_of(data.get("paint", FLAT), "paint", PAINTS)
    join = one_of(data.get("join", UNION), "join", JOINS) if joined else ""
    part = Part(kind, paint, join)
    words = ("kind", *(("paint",) if part.adds else ()), *(("join",) if joined else ()))
    return part, numbers_of((*look, *part.parameters), data, words)
