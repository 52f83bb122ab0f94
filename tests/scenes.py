"""Random scenes for tests: every kind, unions, sharp and soft, opaque and translucent."""

import random
from collections.abc import Mapping

from sdf2vec import Layer, Scene, Shape
from sdf2vec.shapes import KINDS

ANY_UNION = dict.fromkeys(KINDS, (2, 3))


def random_shape(kind: str, r: random.Random, lowest: float = 0.0) -> Shape:
    color = (r.uniform(lowest, 1), r.uniform(lowest, 1), r.uniform(lowest, 1))
    x, y = r.uniform(-0.7, 0.7), r.uniform(-0.5, 0.5)
    size = r.uniform(0.05, 0.35)
    numbers = {
        "circle": lambda: (x, y, size),
        "ellipse": lambda: (x, y, size, size * r.uniform(0.2, 1.2), r.uniform(-7, 7)),
        "box": lambda: (x, y, size, size * r.uniform(0.2, 1.2), r.uniform(-7, 7), r.choice([0.0, 0.02, 0.5])),
        "triangle": lambda: tuple(c + r.uniform(-0.4, 0.4) for c in (x, y, x, y, x, y)),
        "displaced": lambda: (x, y, size, size * 0.2, r.uniform(5, 30), r.uniform(-30, -5)),
    }[kind]()
    return Shape(kind, numbers, color)


def random_layer(kind: str, r: random.Random, compositing: str, union: int = 1) -> Layer:
    lowest = -1.0 if compositing == "additive" else 0.0
    falloff = r.choice([0.0, 0.003, 0.05, 0.3])
    opacity = r.choice([1.0, r.uniform(lowest, 1.0)])
    shapes = tuple(random_shape(kind, r, lowest) for _ in range(union))
    return Layer(shapes, falloff, opacity, r.uniform(0.01, 0.1) if union > 1 else 0.0)


def random_scene(
    kinds: tuple[str, ...] = tuple(KINDS),
    compositing: str = "over",
    layers: int = 8,
    seed: int = 0,
    width: int = 60,
    height: int = 40,
    transparent: bool = False,
    unions: Mapping[str, tuple[int, ...]] = ANY_UNION,
) -> Scene:
    """A scene in which every third layer is a union, of as many shapes as `unions` allows for its kind."""
    r = random.Random(seed)
    made = []
    for i in range(layers):
        kind = kinds[i % len(kinds)]
        made.append(random_layer(kind, r, compositing, r.choice(unions.get(kind, (1,))) if i % 3 == 2 else 1))
    background = None if transparent else (r.random(), r.random(), r.random())
    return Scene(width, height, tuple(made), background, compositing)
