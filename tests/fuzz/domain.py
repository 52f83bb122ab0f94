"""Random scenes over the whole valid domain: every number anywhere in the range of its unit, ends and tiny ones too."""

import math
import random

from sdf2vec import Joint, Layer, Scene, Shape
from sdf2vec.blend import COMPOSITING, JOINS
from sdf2vec.layer import JOIN, LOOK
from sdf2vec.limits import CANVAS_SIDE
from sdf2vec.paints import BASE, PAINTS
from sdf2vec.scene import MAX_JOINED
from sdf2vec.shapes import KINDS

SOFT = tuple(name for name, kind in KINDS.items() if kind.patch is None)


def number(r, unit, positive=False, lowest=None):
    """Mostly ordinary, now and then anywhere: by its power of ten, or an end of the range."""
    low, high = unit.low if lowest is None else lowest, unit.high
    least = 10.0**-unit.decimals
    if r.random() < 0.5:
        value = r.uniform(max(low, -1.0), min(high, 1.0))
    elif r.random() < 0.7:
        value = 10 ** r.uniform(math.log10(least), math.log10(high)) * r.choice([1.0, -1.0])
    else:
        value = r.choice([low, high, 0.0, least, -least])
    value = min(max(value, low), high)
    return round(max(value, least) if positive else value, unit.decimals)


def numbers(r, parameters, lowest=None):
    """A flat row; `lowest`: of colours."""
    return tuple(
        number(r, p.unit, p.positive, lowest if p.unit is BASE.unit else None)
        for p in parameters
        for _ in range(p.width)
    )


def shape(r, kind, paint, lowest):
    own = numbers(r, PAINTS[paint].own, lowest)
    return Shape(kind, numbers(r, KINDS[kind].parameters), numbers(r, (BASE,), lowest), paint, own)


def layer(r, compositing, longest):
    lowest = COMPOSITING[compositing].lowest
    first = r.choice(list(KINDS))
    count = 1 if first not in SOFT or r.random() < 0.5 else min(longest, r.choice([2, 2, 3, 5, MAX_JOINED]))
    alike = r.random() < 0.5
    kinds = [first, *(first if alike else r.choice(SOFT) for _ in range(count - 1))]
    paint = r.choice(list(PAINTS))
    shapes = tuple(shape(r, kind, paint, lowest) for kind in kinds)
    joins = ["union"] if alike else list(JOINS)
    joints = tuple(Joint(r.choice(joins), number(r, JOIN.unit)) for _ in kinds[1:])
    look = {p.name: number(r, p.unit, p.positive, lowest) for p in LOOK}
    return Layer(shapes, max(0.0, look["falloff"]), look["opacity"], joints)


def side(r):
    return r.choice([1, 2, 3, 17, 60, 200, 1000, r.randint(1, CANVAS_SIDE), CANVAS_SIDE])


def scene(seed, layers=6, longest=5, compositing=None):
    """A valid scene; up to so many layers of up to so many shapes."""
    r = random.Random(seed)
    compositing = compositing or r.choice(list(COMPOSITING))
    made = tuple(layer(r, compositing, longest) for _ in range(r.randint(0, layers)))
    ground = r.choice([None, (r.random(), r.random(), 1.0), (r.random(), r.random(), 0.0, r.random())])
    width, height = (side(r), side(r)) if r.random() < 0.3 else (60, 40)
    return Scene(width, height, made, ground, compositing)
