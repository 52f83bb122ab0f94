"""Strokes drawn in numpy: coverage by sixteen samples a pixel, from distances written down here."""

import numpy as np

FINER, HEIGHT, WIDTH = 4, 100, 120
y, x = (
    np.mgrid[: HEIGHT * FINER, : WIDTH * FINER] + 0.5
) / FINER - 0.5  # the middle of the first pixel is 0, 0


def seen(inside):
    """Coverage [HEIGHT, WIDTH] of what is true at the samples."""
    return inside.reshape(HEIGHT, FINER, WIDTH, FINER).mean(axis=(1, 3))


def line(start, end, half, square=False):
    """Within `half` of a line."""
    (ax, ay), (bx, by) = start, end
    length = np.hypot(bx - ax, by - ay)
    u, v = (bx - ax) / length, (by - ay) / length
    along, across = (x - ax) * u + (y - ay) * v, np.abs((x - ax) * v - (y - ay) * u)
    beyond = np.maximum(np.maximum(-along, along - length), 0.0)
    return (np.maximum(beyond, across) if square else np.hypot(beyond, across)) <= half


def bow(middle, radius, first, span, half, square=False):
    """Within `half` of a part of a circle; angles in degrees."""
    dx, dy = x - middle[0], y - middle[1]
    turn = np.degrees(np.arctan2(dy, dx))
    inside = (np.abs(np.hypot(dx, dy) - radius) <= half) & (np.mod(turn - first, 360.0) <= span)
    ends = () if square else np.radians([first, first + span])
    for end in ends:
        inside |= np.hypot(dx - radius * np.cos(end), dy - radius * np.sin(end)) <= half
    return inside


def frame(middle, sides, radius, half):
    """Within `half` of a rectangle's outline with round corners."""
    beyond_x, beyond_y = (
        np.abs(at - own) - side + radius
        for at, own, side in ((x, middle[0], sides[0]), (y, middle[1], sides[1]))
    )
    outer = np.hypot(np.maximum(beyond_x, 0.0), np.maximum(beyond_y, 0.0))
    return np.abs(outer + np.minimum(np.maximum(beyond_x, beyond_y), 0.0) - radius) <= half
