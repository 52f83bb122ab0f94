"""What a kind of shape is: its formulas, its parameters, the frame that it is painted in."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from .expr import Expr, const, maximum, vec2
from .function import function
from .operation import VEC2
from .outlines import Outline
from .units import Parameter

SMALLEST = 1e-6  # scene units; keeps divisors away from 0 at zero size


@function("rotate", p=VEC2, axis=VEC2)
def rotate(p: Expr, axis: Expr) -> Expr:
    """p in the frame whose x axis points along axis (cosine, sine)."""
    return vec2(p.x * axis.x + p.y * axis.y, p.y * axis.x - p.x * axis.y)


@dataclass(frozen=True)
class Frame:
    """The coordinates in which a shape is painted: its middle, the direction of x, half its size; vec2 each."""

    origin: Expr
    axis: Expr
    half: Expr

    def at(self, p: Expr) -> Expr:
        """A point of the scene in the frame, in which the shape reaches from about −1 to 1 along both axes."""
        return rotate(p - self.origin, self.axis) / maximum(self.half, SMALLEST)


@dataclass(frozen=True)
class Patch:
    """Coverage of its own instead of a soft edge: `cover(p, pixel, *parameters)`, 0 from the distance
    `reach(pixel, *parameters)` on, within −1..1 where `signed`. `radial`: it only falls with the distance from the
    middle of the shape's frame, measured in halves of its size.
    """

    cover: Callable[..., Expr]
    reach: Callable[..., Expr]
    signed: bool = False
    radial: bool = False


def _upright_frame(extent: Callable[..., Expr], *parameters: Expr) -> Frame:
    """The box around a sharp shape."""
    box = extent(const(0.0), *parameters)
    low, high = vec2(box.x, box.y), vec2(box.z, box.w)
    return Frame((low + high) * 0.5, vec2(1.0, 0.0), (high - low) * 0.5)


@dataclass(frozen=True, eq=False)
class Kind:
    """A kind of shape.

    `distance(p, *parameters)` is the signed distance, negative inside. `exact` says whether it is the true
    Euclidean distance everywhere. `slope(*parameters)` bounds how fast it changes, which is 1 for a distance.
    `extent(margin, *parameters)` is a box (low x, low y, high x, high y)
    that holds every point with distance ≤ margin, for margin ≥ 0. `outline(offset, *parameters)` is the
    contour at `distance = offset`, where it has a simple form. `area(*parameters)` is what it covers when sharp,
    and `thickness(*parameters)` its least width; both may be those of a simpler shape near it. `frame(*parameters)`
    is what it is painted in, the box around it unless told. A `patch` has coverage of its own; the distance then
    only says where it is, and it can't be joined with others. A number `at_most` the least of another changes nothing
    beyond it.
    """

    name: str
    parameters: tuple[Parameter, ...]
    distance: Callable[..., Expr]
    extent: Callable[..., Expr]
    area: Callable[..., Expr]
    thickness: Callable[..., Expr]
    exact: bool
    outline: Callable[..., Outline] | None = None
    slope: Callable[..., Expr] = lambda *parameters: const(1.0)
    own_frame: Callable[..., Frame] | None = None
    patch: Patch | None = None
    at_most: tuple[tuple[str, str], ...] = ()

    def frame(self, *parameters: Expr) -> Frame:
        """What the shape is painted in."""
        return self.own_frame(*parameters) if self.own_frame else _upright_frame(self.extent, *parameters)

    def variables(self, suffix: str = "") -> tuple[Expr, ...]:
        """One variable for each parameter."""
        return tuple(parameter.variable(suffix) for parameter in self.parameters)

    def scalars(self, suffix: str = "") -> tuple[Expr, ...]:
        """The float variables behind `variables`, in the order of a flat parameter row."""
        return tuple(scalar for parameter in self.parameters for scalar in parameter.scalars(suffix))
