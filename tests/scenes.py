"""Random scenes for tests: every kind and paint, joins, sharp and soft, opaque and translucent."""

import random
from collections.abc import Sequence

from sdf2vec import Joint, Layer, Scene, Shape
from sdf2vec.blend import COMPOSITING, JOINS
from sdf2vec.layer import Part, Structure
from sdf2vec.shapes import KINDS

PATCHES = tuple(name for name, kind in KINDS.items() if kind.patch is not None)
# in base64, of version 1, in steps of 12 bits: see tests/scene/test_compact_files.py
FIRST_COMPACT = (
    "iXNkZgH6HvgGP/////7j08sezKA2ad2XDyAAMW/wAAAGMYx/3p/9Pvxn/en/en/O//en+eP3v+On/6I2r//yP/2f/gDg07aKJFpFLtpP/9/JZXMxd8"
    "4CMkRdOfR5g2LH"
)
# one layer after the other
PAINTED = ("flat", "linear", "flat", "radial", "flat", "linear3", "flat", "radial3")
SOFT = tuple(name for name in KINDS if name not in PATCHES)  # kinds with a soft edge, which can be joined


def random_shape(kind: str, r: random.Random, lowest: float = 0.0, paint: str = "flat") -> Shape:
    def color():
        return (r.uniform(lowest, 1), r.uniform(lowest, 1), r.uniform(lowest, 1))

    first = color()
    x, y = r.uniform(-0.7, 0.7), r.uniform(-0.5, 0.5)
    size = r.uniform(0.05, 0.35)

    def patch():
        return (x, y, size * 0.5, size * 0.5 * r.uniform(0.3, 1.2), r.uniform(-7, 7))

    def gradient():
        end, across, down = color(), r.uniform(-1, 1), r.uniform(-1, 1)
        return (*end, across, down, across * down)

    def rings():
        *end, across, down, shift = gradient()
        return (*end, across, down, 1.0 + 0.5 * across, 1.0 - 0.5 * down, shift)

    def with_middle(own):
        end, numbers = own[:3], own[3:]
        other = random.Random(first[0])  # of its own: what is drawn after it stays the same
        return (*(other.uniform(lowest, 1) for _ in range(3)), *end, other.uniform(0.1, 0.9), *numbers)

    numbers = {
        "circle": lambda: (x, y, size),
        "ellipse": lambda: (x, y, size, size * r.uniform(0.2, 1.2), r.uniform(-7, 7)),
        "box": lambda: (x, y, size, size * r.uniform(0.2, 1.2), r.uniform(-7, 7), r.choice([0.0, 0.02, 0.5])),
        "triangle": lambda: tuple(c + r.uniform(-0.4, 0.4) for c in (x, y, x, y, x, y)),
        "rounded_triangle": lambda: (
            x,
            y - size,
            x + size,
            y + size * r.uniform(0, 1),
            x - size,
            y,
            size * 0.2,
        ),
        "arc": lambda: (x, y, x + size * r.uniform(-1, 1), y + size, size * r.uniform(-1.5, 1.5), size * 0.2),
        "displaced": lambda: (x, y, size, size * 0.2, r.uniform(5, 30), r.uniform(-30, -5)),
        "gaussian": patch,
        "gabor": lambda: (*patch(), r.uniform(-40, 40), r.uniform(0, 6)),
    }[kind]()
    own = {"flat": tuple, "linear": gradient, "radial": rings}[paint.rstrip("3")]()
    return Shape(kind, numbers, first, paint, with_middle(own) if paint.endswith("3") else own)


def random_layer(
    kinds: Sequence[str],
    r: random.Random,
    compositing: str,
    paint: str = "flat",
    joins: Sequence[str] = ("union",),
) -> Layer:
    """A layer of one shape of each kind, joined in one of these ways."""
    structure = (Part(kinds[0], paint), *(Part(kind, paint, r.choice(joins)) for kind in kinds[1:]))
    return random_layer_of(structure, r, compositing)


def random_layer_of(structure: Structure, r: random.Random, compositing: str) -> Layer:
    """A layer of this structure."""
    lowest = COMPOSITING[compositing].lowest
    falloff = r.choice([0.0, 0.003, 0.05, 0.3])
    opacity = r.choice([1.0, r.uniform(lowest, 1.0)])
    shapes = tuple(random_shape(part.kind, r, lowest, part.paint) for part in structure)
    joints = tuple(Joint(part.join, r.choice([0.0, r.uniform(0.01, 0.1)])) for part in structure[1:])
    return Layer(shapes, falloff, opacity, joints)


def random_scene(
    kinds: Sequence[str] = tuple(KINDS),
    compositing: str = "over",
    layers: int = 8,
    seed: int = 0,
    width: int = 60,
    height: int = 40,
    transparent: bool = False,
    paints: Sequence[str] = PAINTED,
    joins: Sequence[str] = tuple(JOINS),
) -> Scene:
    """A scene in which every third layer is joined of two or three shapes, where there are joins."""
    r = random.Random(seed)
    made = []
    for i in range(layers):
        kind = kinds[i % len(kinds)]
        turn = 0 if len(kinds) % 3 else i // len(kinds)  # else the same kinds would always be joined
        several = (i + turn) % 3 == 2 and kind in SOFT and bool(joins)
        more = r.choices([k for k in kinds if k in SOFT], k=r.choice((1, 2))) if several else ()
        made.append(random_layer((kind, *more), r, compositing, paints[i % len(paints)], joins))
    background = None if transparent else (r.random(), r.random(), r.random())
    return Scene(width, height, tuple(made), background, compositing)


# Every kind, paint and join, in families of few structures: each structure costs seconds to compile.
FAMILIES: dict[str, list[Structure]] = {
    "plain": [(Part("circle"),), (Part("box"),), (Part("arc"),), (Part("rounded_triangle"),)],
    "union": [(Part("circle"), Part("triangle", "linear", "union")), (Part("ellipse", "linear"),)],
    "cut": [
        (Part("box", "linear3"), Part("circle", join="subtraction"), Part("ellipse", join="intersection")),
        (Part("displaced"),),
    ],
    "patches": [(Part("gaussian", "radial"),), (Part("gabor"),), (Part("gaussian", "radial3"),)],
}


def scene_of(family, compositing="over", layers=12, seed=0, size=(60, 40), transparent=False):
    """Random layers of a family's structures, each of which is present: one compiled module serves all tests."""
    r = random.Random(seed)
    count = max(layers, len(FAMILIES[family]))
    made = [
        random_layer_of(FAMILIES[family][i % len(FAMILIES[family])], r, compositing) for i in range(count)
    ]
    background = None if transparent else (r.random(), r.random(), r.random())
    return Scene(size[0], size[1], tuple(made), background, compositing)
