"""Layers of one shape by their places in the pixels of `drawn`'s pictures."""

from sdf2vec.scene import Layer, Shape
from tests.fit.drawn import SIDE


def rgb(color):
    red, green, blue = map(float, color)
    return red, green, blue


def sharp_box(color, left, top, right, bottom):
    """Upright, by its sides."""
    center = (left + right) / 2 / SIDE - 0.5, (top + bottom) / 2 / SIDE - 0.5
    half_size = (right - left) / 2 / SIDE, (bottom - top) / 2 / SIDE
    shape = Shape.of("box", rgb(color), center=center, half_size=half_size, angle=0.0, corner_radius=0.0)
    return Layer((shape,))


def sharp_triangle(color, *corners):
    """By its corners."""
    a, b, c = ((x / SIDE - 0.5, y / SIDE - 0.5) for x, y in corners)
    return Layer((Shape.of("triangle", rgb(color), a=a, b=b, c=c),))
