"""Least squares by damped Gauss-Newton steps (Levenberg 1944, Marquardt 1963), many candidates at a time.

What is wrong at a point depends on the numbers of a candidate and on nothing at other points. So without kernels all
derivatives come from one pass backward in which every point has numbers of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
import torch

from ..arrays import Float64Array, IntArray

if TYPE_CHECKING:
    from .constraints import Ranges

Equations = tuple[Float64Array, Float64Array]  # matrices [G, F, F], and right sides [G, F]
Descended = tuple[torch.Tensor, torch.Tensor]  # rows [G, U], and their mean squares [G]
Tick = Callable[[float], None]  # told of the error after steps; raises to stop

FIRST_DAMPING, LESS, MORE = 0.1, 0.3, 5.0  # of a step; after one that helps, after one that does not
MOST_DAMPED, LEAST_DAMPED = 1e4, 1e-7
HARDLY, PATIENCE = 1e-3, 6  # share of the error; steps
FAINT = 1e-3  # of the greatest effect of a number, in squares
TINY = 1e-9


class Problem(Protocol):
    """How wrong candidates are, from their rows [G, U]."""

    def residuals(self, rows: torch.Tensor) -> torch.Tensor:
        """What is wrong, [G, C, P]."""

    def errors(self, rows: torch.Tensor) -> Float64Array:
        """Mean squares [G]."""

    def descended(self, rows: torch.Tensor, numbers: Numbers, steps: int, tick: Tick) -> Descended:
        """The rows after so many steps down these; `tick` is told the least of them."""


class Derived(Protocol):
    """One that says how these depend on the numbers."""

    def errors(self, rows: torch.Tensor) -> Float64Array:
        """Mean squares [G]."""

    def normal(self, rows: torch.Tensor, free: IntArray) -> Equations:
        """The normal equations by the free numbers."""


class Dense(NamedTuple):
    """What is wrong, [G, C, P], from rows [G, U, P or 1]; and the number of points."""

    wrong: Callable[[torch.Tensor], torch.Tensor]
    points: int

    def residuals(self, rows: torch.Tensor) -> torch.Tensor:
        """What is wrong, [G, C, P]."""
        return self.wrong(rows[..., None])

    def errors(self, rows: torch.Tensor) -> Float64Array:
        """Mean squares [G]."""
        return _array(self.residuals(rows).square().mean(dim=(1, 2)))

    def descended(self, rows: torch.Tensor, numbers: Numbers, steps: int, tick: Tick) -> Descended:
        """The rows after so many steps down these; `tick` is told the least of them."""
        return descend(rows, self, numbers, steps, tick)

    def normal(self, rows: torch.Tensor, free: IntArray) -> Equations:
        """The normal equations, by autograd."""
        wrong, slopes = self._slopes(rows, torch.from_numpy(free))
        return _array(slopes @ slopes.mT), _array((slopes @ wrong[..., None])[..., 0])

    def _slopes(self, rows: torch.Tensor, free: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Residuals [G, C · P] and their derivatives by the free numbers [G, F, C · P]."""
        spread = rows[..., None].repeat(1, 1, self.points).requires_grad_()
        with torch.enable_grad():
            wrong = self.wrong(spread)
            sums = wrong.sum(dim=(0, 2)).unbind()
        channels = [torch.autograd.grad(total, spread, retain_graph=True)[0][:, free] for total in sums]
        return wrong.detach().flatten(1), torch.stack(channels, dim=2).flatten(2)


def _array(tensor: torch.Tensor) -> Float64Array:
    return tensor.detach().numpy().astype(np.float64)


class Numbers(NamedTuple):
    """Which numbers of a row move [F], how far each may in one step [F], and what all may be."""

    free: IntArray
    longest: Float64Array
    ranges: Ranges

    @classmethod
    def where(cls, moves: Sequence[bool], longest: torch.Tensor, ranges: Ranges) -> Numbers:
        """Those that move, of all numbers of a row."""
        free = np.flatnonzero(moves).astype(np.int64)
        return cls(free, _array(longest)[free], ranges)

    def without(self, fixed: torch.Tensor) -> Numbers:
        """Those but the ones that are fixed [U]."""
        moving = ~fixed.numpy()[self.free]
        return self._replace(free=self.free[moving], longest=self.longest[moving])


@torch.no_grad()
def descend(rows: torch.Tensor, problem: Derived, numbers: Numbers, steps: int, tick: Tick) -> Descended:
    """Candidates [G, U] after so many steps down their mean squared residuals; and these, [G].

    A step that does not help is not made; it ends early where `PATIENCE` steps have hardly helped any candidate. `tick`
    is told the least of the errors after every step.
    """
    idle, equations = 0, None
    damping = np.full(len(rows), FIRST_DAMPING)
    errors = problem.errors(rows)
    for _ in range(steps):
        moved = rows.clone()
        equations = equations or problem.normal(rows, numbers.free)
        step = _step(*equations, damping, numbers.longest)
        moved.numpy()[:, numbers.free] -= step.clip(-numbers.longest, numbers.longest)
        numbers.ranges.hold(moved)
        found = problem.errors(moved)
        better = found < errors
        idle = 0 if (found < errors * (1.0 - HARDLY)).any() else idle + 1
        equations = None if better.any() else equations
        rows = torch.where(torch.from_numpy(better)[:, None], moved, rows)
        errors = np.where(better, found, errors)
        damping = (damping * np.where(better, LESS, MORE)).clip(LEAST_DAMPED, MOST_DAMPED)
        tick(float(errors.min()))
        if idle == PATIENCE:
            break
    return rows, torch.from_numpy(errors).to(rows.dtype)


def _step(
    normal: Float64Array, right: Float64Array, damping: Float64Array, longest: Float64Array
) -> Float64Array:
    """How far the free numbers are too large by the damped normal equations, [G, F].

    What a longest step of a number does is damped as if it were at least a share of what one of any other does: else
    a number that does nothing here would be moved far, whatever the damping. No way at all where two numbers do the
    same to within rounding: then the next step is damped more.
    """
    scale = normal.diagonal(axis1=1, axis2=2)
    effect = scale * longest**2
    scale = np.maximum(effect, FAINT * effect.max(1, keepdims=True)) / longest**2
    damped = normal.copy()
    np.einsum("gff->gf", damped)[:] += scale * damping[:, None] + TINY
    step, failed = torch.linalg.solve_ex(torch.from_numpy(damped), torch.from_numpy(right))
    return np.where(failed.numpy()[:, None] == 0, step.numpy(), 0.0)
