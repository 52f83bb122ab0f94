"""Units: ranges, starts and codecs of all numbers, by hand."""

import math

import pytest
import torch

from sdf2vec import units
from sdf2vec.expr import const, constant, operation, var
from sdf2vec.graph import components_of, scalarize, substitute
from sdf2vec.layer import JOIN, LOOK
from sdf2vec.operation import FLOAT, VECTOR
from sdf2vec.paints import PAINTS
from sdf2vec.shapes import KINDS
from sdf2vec.units import Fractions, Parameter, Placed, Room, Unit, grown

UNITS = [value for value in vars(units).values() if isinstance(value, Unit)]
PLACED = Placed(torch.tensor([[0.3, -0.2]]), torch.tensor([2.0]), torch.tensor([math.pi / 2]))
ROOM = Room((1.5, 1.0), 0.01, (0.1, 0.9))


def parameters():
    yield from (*LOOK, JOIN)
    for kind in KINDS.values():
        yield from kind.parameters
    for paint in PAINTS.values():
        yield from paint.parameters


def test_the_units_of_all_parameters_are_listed():
    assert {parameter.unit.name for parameter in parameters()} <= {unit.name for unit in UNITS}
    assert len({unit.name for unit in UNITS}) == len(UNITS)


@pytest.mark.parametrize(
    ("unit", "values", "start"),
    [
        (units.POSITION, (0.5, 0.25), (-0.2, 0.8)),  # a quarter turn, twice as large, moved
        (units.LENGTH, (0.5,), (1.0,)),
        (units.LENGTH, (0.5, 3.0), (1.0, 6.0)),
        (units.ANGLE, (0.25,), (0.25 + math.pi / 2,)),
        (units.FREQUENCY, (3.0, -1.0), (1.5, -0.5)),
        (units.DIRECTION, (0.5, 0.0), (0.0, 0.5)),  # in the shape's frame: of any size
        (units.SHIFT, (0.5,), (0.5,)),
        (units.RISE, (1.0, 0.5), (1.0, 0.5)),  # a quarter turn and twice the size: as it was
        (units.STOP, (0.25,), (0.25,)),
    ],
)
def test_starts_by_hand(unit, values, start):
    assert unit.start(values, PLACED)[0].tolist() == pytest.approx(start, abs=1e-6)


@pytest.mark.parametrize(
    ("unit", "values", "start"),
    [
        (units.LENGTH, (0.5, 3.0), (3.0, 3.0)),
        (units.LENGTH, (0.5,), (1.0,)),  # of no direction
        (units.POSITION, (0.5, 0.25), (0.05, 2.8)),
    ],
)
def test_starts_are_stretched_before_they_are_turned(unit, values, start):
    placed = PLACED._replace(stretches=torch.tensor([[3.0, 0.5]]))
    assert unit.start(values, placed)[0].tolist() == pytest.approx(start, abs=1e-6)


@pytest.mark.parametrize(
    ("unit", "values", "kept"),
    [
        (units.POSITION, (9.0, -9.0), (1.05, -0.8)),  # 0.3 beyond the canvas
        (units.ANGLE, (-1.0, 7.0), (math.tau - 1.0, 7.0 - math.tau)),
        (units.LENGTH, (-1.0, 9.0), (0.0, 2.25)),
        (units.FREQUENCY, (-1e3, 61.0), (-60.0, 60.0)),
        (units.DIRECTION, (-19.0, 0.5), (-10.0, 0.5)),
        (units.SHIFT, (7.0,), (6.0,)),
        (units.RISE, (-1.0, 19.0), (0.0, 10.0)),
        (units.STOP, (-0.5,), (0.02,)),
        (units.STOP, (1.5,), (0.98,)),
        (units.COLOR, (-0.5, 1.5), (0.0, 1.0)),
        (units.OPACITY, (-0.5, 1.5), (0.02, 1.0)),
        (units.FALLOFF, (0.0, 1.0), (0.1, 0.9)),
        (units.SMOOTHNESS, (-0.1, 9.0), (0.001, 1.5)),
        (units.SMOOTHNESS, (0.0, 1e-4), (0.0, 0.001)),  # what is sharp stays so
        (units.BACKGROUND, (-1.0, 0.5), (0.0, 0.5)),
    ],
)
def test_a_fit_keeps_numbers_in_range(unit, values, kept):
    numbers = torch.tensor([values])
    unit.project(numbers, False, ROOM)
    assert numbers[0].tolist() == pytest.approx(kept, abs=1e-6)


def test_what_is_positive_is_a_pixel_at_least_and_signed_colours_go_below_0():
    sizes, colors, opacity = torch.zeros(1, 2), torch.full((1, 3), -2.0), torch.full((1, 1), -0.5)
    units.LENGTH.project(sizes, True, ROOM)
    units.COLOR.project(colors, False, ROOM._replace(signed=True))
    units.OPACITY.project(opacity, False, ROOM._replace(signed=True))
    assert sizes[0].tolist() == pytest.approx([0.01, 0.01])
    assert (colors[0].tolist(), opacity.item()) == ([-1.0] * 3, -0.5)


# Lengths grow with the sixteenth power; ends are said with four decimals.
HALF_GROWN = ((round(0.001 ** (1 / 16), 4) + round(8.001 ** (1 / 16), 4)) / 2) ** 16 - 0.001


def decoded(unit: Unit, fraction: float, width: int = 1) -> list[float]:
    """The number at a fraction, in a box from (0.5, −1) of 3 by 4, with ranges 0..8 of everything."""
    corner, box = (operation("vec2", *map(const, pair)) for pair in ((0.5, -1.0), (3.0, 4.0)))
    value = var("v", VECTOR[width]) if width > 1 else var("v", FLOAT)
    found = unit.codec.decode(
        value, Fractions(corner, box, dict.fromkeys([each.name for each in UNITS], (0.0, 8.0)))
    )
    given = {scalar: const(fraction) for scalar in components_of(value)}
    return [constant(substitute(part, given)) for part in scalarize(found)]


@pytest.mark.parametrize(
    ("unit", "width", "wanted"),
    [
        (units.POSITION, 2, [2.0, 1.0]),
        (units.LENGTH, 1, [2.5]),  # half of the box's diagonal
        (units.ANGLE, 1, [math.pi]),
        (units.FREQUENCY, 2, [4.0, 4.0]),
        (units.DIRECTION, 2, [4.0, 4.0]),
        (units.COLOR, 3, [4.0, 4.0, 4.0]),
        (units.OPACITY, 1, [4.0]),
        (units.FALLOFF, 1, [HALF_GROWN]),
        (units.SMOOTHNESS, 1, [HALF_GROWN]),
    ],
)
def test_half_of_every_codec(unit, width, wanted):
    assert decoded(unit, 0.5, width) == pytest.approx(wanted)


@pytest.mark.parametrize("unit", UNITS, ids=[unit.name for unit in UNITS])
def test_the_roots_of_codecs_are_linear_in_the_fraction(unit):
    width = 2 if unit is units.POSITION else 1
    low, half, high = (decoded(unit, fraction, width)[0] for fraction in (0.0, 0.5, 1.0))
    root, value = unit.codec.root, unit.codec.value
    assert root(half) == pytest.approx((root(low) + root(high)) / 2)
    assert value(root(half)) == pytest.approx(half)


def test_grown_by_hand():
    assert constant(scalarize(grown(const(0.5)))[0]) == pytest.approx(1 / 65536 - 0.001)


def test_a_parameter_is_as_wide_as_its_start():
    pair = Parameter("pair", units.LENGTH, (1.0, 2.0))
    assert pair.scalars("_3") == components_of(pair.variable("_3")) == components_of(var("pair_3", VECTOR[2]))
    assert (pair.width, pair.values_from([1.0, 2.0]), JOIN.values_from([0.5])) == (2, (1.0, 2.0), 0.5)
