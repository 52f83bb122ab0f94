"""The shaders of a page, which are made there from its one scene. Of a readable one: what is around the layers, and for
each sort of layer its lines with places for numbers. Of one that would be long, in a table: what is around its rows.

Lines and the numbers in them come from the exporter itself: it writes a layer of numbers that are like no others, and
where they, or what follows from them alone, stand in the text, there are places. A layer of which it says something
else (a number that makes a formula simpler) is kept as it is.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from msgspec import structs

from ..expr import Expr, const, constant
from ..graph import scalarize, substitute, walk
from ..layer import Formula, Structure, slots, variable_row
from ..lower.javascript import function_text
from ..lower.shader import literal
from ..operation import FLOAT
from ..scene import Layer, Scene
from .layouts import TEXT_LIMIT, fits_constants
from .options import Options
from .records import BELOW, first_records
from .shader import MOST_READABLE, TARGETS, shader, statements_of, statements_text
from .table_text import table_rows

NUMBER = re.compile(r"(?<![\w.])\d+\.\d+(?:e[-+]?\d+)?|\b50021\b")
FIRST = 50021  # the number of a shape that no text has
MARK = "@"  # before the number of a place; @0 is that of the layer's first shape
PLACE = re.compile(rf"{MARK}(\d+)")
LOWEST, STEP = 0.20011, 0.00037  # numbers that no text has
MOST_PARTS = 8  # shapes in a layer: those of more are kept as they are


@dataclass(frozen=True)
class Sort:
    """A sort of layers: its structure, and what stands at places of its lines, as expressions of its row."""

    structure: Structure
    compositing: str
    used: list[Expr] = field(default_factory=list)

    @property
    def key(self) -> str:
        """As the page's script calls it."""
        return ",".join(
            f"{part.join} {part.kind} {part.paint if part.adds else ''}" for part in self.structure
        )

    @cached_property
    def inputs(self) -> list[Expr]:
        """The variables of the row's numbers."""
        return [scalar for slot in slots(self.structure) for scalar in slot.parameter.scalars(slot.suffix)]

    @cached_property
    def numbers(self) -> list[float]:
        """A row of numbers that no text has."""
        return [round(LOWEST + STEP * i, 5) for i in range(len(self.inputs))]

    @cached_property
    def found(self) -> dict[str, Expr]:
        """By what the exporter writes of them: all numbers that follow from such a row alone."""
        drawn = Formula(self.structure, variable_row(self.structure)).draw(BELOW, self.compositing)
        known = set(self.inputs)
        texts: dict[str, Expr] = {}
        for node in walk([*self.inputs, *scalarize(drawn)]):
            if node.args and all(arg in known or arg.op == "const" for arg in node.args):
                known.add(node)
            if node in known and node.type is FLOAT:
                texts.setdefault(literal(constant(substitute(node, self._known(self.numbers)))), node)
        return texts

    def _known(self, numbers: Iterable[float]) -> dict[Expr, Expr]:
        return dict(zip(self.inputs, map(const, numbers), strict=True))

    def placed(self, text: str) -> str:
        """The text of a layer of `numbers` with places for what stands there."""

        def place(match: re.Match[str]) -> str:
            node = self.found.get(match[0])
            if match[0].removesuffix(".0") == str(FIRST):
                return f"{MARK}0{match[0].removeprefix(str(FIRST))}"
            if node is None:
                return match[0]
            if node not in self.used:
                self.used.append(node)
            return f"{MARK}{self.used.index(node) + 1}"

        return NUMBER.sub(place, text)

    def values(self, layer: Layer) -> list[str]:
        """What stands at the places for a layer."""
        known = self._known(layer.numbers)
        return [literal(constant(substitute(node, known))) for node in self.used]

    @property
    def function(self) -> str:
        """The same in JavaScript."""
        return function_text(f'PLACES["{self.key}"]', self.used, self.inputs).removeprefix("const ")


@dataclass(frozen=True)
class PageTexts:
    """The texts of a page by target, and the functions that say what stands at their places."""

    texts: Mapping[str, Any]
    functions: Sequence[str]

    @classmethod
    def of(cls, scene: Scene, names: Iterable[str], options: Options) -> PageTexts:
        """What is too long to be readable, or for a table, is as the exporter writes it."""
        sorts = {
            s: Sort(s, scene.compositing) for s in dict.fromkeys(layer.structure for layer in scene.layers)
        }
        texts = {name: _text(scene, name, options, sorts) for name in names}
        return cls(texts, [sort.function for sort in sorts.values() if sort.used])

    @property
    def tabled(self) -> bool:
        """Whether any is in a table."""
        return any("rows" in text for text in self.texts.values() if isinstance(text, dict))


def _text(scene: Scene, name: str, options: Options, sorts: Mapping[Structure, Sort]) -> Any:
    readable = structs.replace(options, layout="readable")
    if "table" not in TARGETS[name].host.layouts:
        return _around_layers(scene, name, readable, shader(scene, name, readable).text, sorts)
    text = shader(scene, name, readable).text if scene.shape_count <= MOST_READABLE else ""
    if text and len(text.encode()) <= TEXT_LIMIT:
        return _around_layers(scene, name, readable, text, sorts)
    if fits_constants(scene):
        return _around_rows(scene, name, structs.replace(options, layout="table"))
    return shader(scene, name, options).text


def _around_layers(
    scene: Scene, name: str, options: Options, text: str, sorts: Mapping[Structure, Sort]
) -> Any:
    """What is around the layers of a readable text, and the lines of each sort of them."""
    said = [statements_text([one]) for one in statements_of(scene, name, options)]
    if not said:
        return text
    head, tail = text.split("".join(said))
    lines = {
        sort.key: _lines(scene, name, options, sort)
        for sort in sorts.values()
        if len(sort.structure) <= MOST_PARTS
    }
    odd = {}
    firsts = first_records(scene.layers).tolist()
    for index, (layer, first, text) in enumerate(zip(scene.layers, firsts, said, strict=True)):
        sort = sorts[layer.structure]
        if sort.key not in lines or filled(lines[sort.key], first, sort.values(layer)) != text:
            odd[index] = text
    return {"around": [head, tail], "lines": lines, "odd": odd}


def _around_rows(scene: Scene, name: str, options: Options) -> dict[str, list[str]]:
    """What is around the rows of each of its tables."""
    text = shader(scene, name, options).text
    around = []
    for rows in table_rows(scene):
        before, found, text = text.partition(",\n".join(rows))
        assert found, "a table is written in lines"
        around.append(before)
    return {"rows": [*around, text]}


def _lines(scene: Scene, name: str, options: Options, sort: Sort) -> str:
    """What a text says of a sort of layers, with places."""
    alone = replace(scene, layers=(Layer.from_numbers(sort.structure, sort.numbers),))
    return sort.placed(statements_text(statements_of(alone, name, options, FIRST)))


def filled(lines: str, first: int, values: Sequence[str]) -> str:
    """Lines with what stands at their places, as the page's script fills them."""
    return PLACE.sub(lambda match: str(first) if match[1] == "0" else values[int(match[1]) - 1], lines)
