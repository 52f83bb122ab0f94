"""The soft edge as gradient stops."""

from __future__ import annotations

from functools import cache

import numpy as np

from .sampling import edge_profile, edge_range

FEWEST, MOST = 5, 16  # stops of an edge


@cache
def edge_stops(start: float, count: int) -> tuple[tuple[float, float], ...]:
    """`count` pairs of distance (in falloffs, from `start` to where coverage ends) and coverage.

    Places are dense where the curve bends; the values are those of the broken line nearest to the curve
    (least squares), which halves the error of a line through the curve's own points.
    """
    x = np.linspace(start, edge_range()[1], 2001)
    y = edge_profile(x)
    bend = np.abs(np.gradient(np.gradient(y, x), x)) ** 0.4 + 1e-3
    total = np.concatenate([[0.0], np.cumsum((bend[1:] + bend[:-1]) / 2)])
    places = np.interp(np.linspace(0, total[-1], count), total, x)
    hats = np.stack([np.interp(x, places, row) for row in np.eye(count)], axis=1)
    inner = hats[:, :-1]  # the last value stays 0: nothing is painted outside
    values, *_ = np.linalg.lstsq(inner, y, rcond=None)
    return tuple(zip(places.tolist(), [*np.clip(values, 0.0, 1.0).tolist(), 0.0], strict=True))


def stop_count(contrast: float, levels: float) -> int:
    """How many stops keep the error of an edge below so many 8-bit levels (root mean square).

    `contrast` is the mean squared change of the picture where coverage goes from 0 to 1.
    """
    worst = 255.0 * contrast**0.5
    return next((n for n in range(FEWEST, MOST) if worst * _stops_error(n) <= levels), MOST)


@cache
def _stops_error(count: int) -> float:
    """Root mean square error of coverage along an edge drawn with so many stops."""
    x = np.linspace(0.0, edge_range()[1], 1001)
    places, values = np.array(edge_stops(0.0, count)).T
    drawn = np.interp(x, places, values)
    return float(np.sqrt(np.mean((drawn - edge_profile(x)) ** 2)))
