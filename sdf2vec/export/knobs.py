"""What a pasted shader offers to change: names on top of its text, and the formulas that heed them."""

from __future__ import annotations

from typing import NamedTuple

from ..blend import coverage
from ..expr import Expr, absolute, const, select, sin, var, vec2
from ..function import function
from ..graph import substitute, walk
from ..operation import FLOAT, VEC2, VEC4

BREATH = 0.004  # scene units
GROUND = "GROUND"
AMPLITUDE, SPEED, SOFTNESS, DRAG = (var(name) for name in ("AMPLITUDE", "SPEED", "SOFTNESS", "DRAG"))
TIME, MOUSE = var("iTime"), var("iMouse", VEC4)  # Shadertoy's names


class Knob(NamedTuple):
    """A name, what stands for it, and a remark."""

    name: str
    value: str
    remark: str


def knobs_of(ground: str, layout: str, moves: bool) -> list[Knob]:
    """The names that a text needs; the smallest has few. Lists of layers leave shapes room for a little."""
    is_readable = layout == "readable"
    found = [] if layout == "packed" else [Knob(GROUND, ground, "behind all shapes, premultiplied")]
    if is_readable or moves:
        how = "is a little" if is_readable else "at most"
        found += [
            Knob(
                "AMPLITUDE",
                str(BREATH if moves else 0.0),
                f"how far shapes breathe, of the shortest side: {BREATH} {how}",
            ),
            Knob("SPEED", "1.0", "how fast"),
        ]
    if is_readable:
        found += [
            Knob("SOFTNESS", "1.0", "of every edge: 0.0 is sharp, 3.0 a mist"),
            Knob("DRAG", "1.0", "how far the mouse takes the picture, 0.0 to hold it"),
        ]
    return found


@function("breath", index=FLOAT)
def breath(index: Expr) -> Expr:
    """How far a shape has drawn in its edge by now, each at its own pace."""
    return AMPLITUDE * sin(SPEED * TIME * (1.0 + 0.3 * sin(index)) + index)


@function("edge", d=FLOAT, falloff=FLOAT, pixel=FLOAT, index=FLOAT)
def edge(d: Expr, falloff: Expr, pixel: Expr, index: Expr) -> Expr:
    """Coverage at distance d of a shape that breathes; where it is 1/2 stays where it is, however soft."""
    moved = d + breath(index) + 0.5 * (SOFTNESS - 1.0) * falloff
    return coverage(moved, SOFTNESS * falloff, pixel)


def turned(drawn: Expr, index: int) -> Expr:
    """A layer whose edge heeds the names on top; `index` is that of its first shape."""
    edges = [node for node in walk([drawn]) if node.payload is coverage]
    return substitute(drawn, {node: edge(*node.args, const(index)) for node in edges})


@function("dragged", p=VEC2, pixel=FLOAT)
def dragged(p: Expr, pixel: Expr) -> Expr:
    """The point that is seen at p while the mouse drags the picture: iMouse is where it is, and where it went down."""
    way = vec2(MOUSE.x - absolute(MOUSE.z), absolute(MOUSE.w) - MOUSE.y)
    return p - way * select(MOUSE.z > 0.0, DRAG * pixel, 0.0)
