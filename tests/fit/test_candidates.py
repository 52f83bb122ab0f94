"""Which shapes could be joined to a layer: least squares, regions and masks, on pictures drawn by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from sdf2vec.fit import laying, levenberg, surroundings
from sdf2vec.fit.constraints import Ranges, project_group, ranges_of
from sdf2vec.fit.joining import layer_of
from sdf2vec.fit.laying import Laid
from sdf2vec.fit.levenberg import Dense, Numbers, descend
from sdf2vec.fit.regions import ellipses, strokes
from sdf2vec.fit.surroundings import GLANCE, MOST_COMPILED, Surroundings, View
from sdf2vec.layer import Part, row_width, slots
from sdf2vec.render.reference import rows_coverage
from sdf2vec.render.tensors import from_scene
from sdf2vec.scene import Layer, Scene, Shape
from sdf2vec.units import ANGLE, SMOOTHNESS, Room


def anything(count: int) -> Ranges:
    """Of so many numbers that may be what they will."""
    ends = np.full(count, -np.inf, np.float32), np.full(count, np.inf, np.float32)
    none = np.zeros(count, np.float32), np.zeros(count, np.int64)
    return Ranges(*ends, *none, np.zeros((0, 3), np.int64), np.zeros(0, np.float32))


def test_a_line_is_found_in_one_undamped_step_or_a_few_damped_ones():
    """Two lines a·x + b through points, each with another a and b."""
    x = torch.linspace(-1.0, 1.0, 7)
    wanted = torch.tensor([[2.0, -1.0], [0.5, 3.0]])
    heights = wanted[:, :1] * x + wanted[:, 1:]
    problem = Dense(lambda rows: (rows[:, 0] * x + rows[:, 1] - heights)[:, None], len(x))
    free = Numbers.where([True, True], torch.tensor([9.0, 9.0]), anything(2))
    rows, errors = descend(torch.zeros(2, 2), problem, free, 12, lambda error: None)
    assert rows.numpy() == pytest.approx(wanted.numpy(), abs=1e-3)
    assert float(errors.max()) < 1e-6


def test_a_number_that_is_not_free_stays():
    x = torch.linspace(-1.0, 1.0, 7)
    problem = Dense(lambda rows: (rows[:, 0] * x + rows[:, 1] - 1.0)[:, None], len(x))
    free = Numbers.where([False, True], torch.tensor([9.0, 0.1]), anything(2))
    rows, _ = descend(torch.tensor([[0.25, 0.0]]), problem, free, 3, lambda error: None)
    assert rows[0].tolist() == pytest.approx([0.25, 0.3])  # a tenth in each step


def test_two_numbers_that_do_the_same_are_damped_until_they_can_be_told_apart(monkeypatch):
    """Undamped there is no solution."""
    monkeypatch.setattr(levenberg, "FIRST_DAMPING", 0.0)
    slopes = 1000.0 * torch.linspace(1.0, 2.0, 5)
    problem = Dense(lambda rows: ((rows[:, 0] + rows[:, 1] - 1.0) * slopes)[:, None], len(slopes))
    free = Numbers.where([True, True], torch.ones(2), anything(2))
    rows, errors = descend(torch.zeros(1, 2), problem, free, 12, lambda error: None)
    assert float(errors) < 1e-3
    assert float(rows.sum()) == pytest.approx(1.0, abs=1e-4)


def test_a_bar_gives_an_ellipse_along_it():
    gain = np.zeros((40, 60), np.float32)
    gain[10:14, 20:40] = 1.0
    ((x, y, long, short, turn),) = ellipses(gain)
    assert (x, y) == (30.0, 12.0)
    assert long == pytest.approx(10.0, abs=0.5)
    assert short == pytest.approx(2.0, abs=0.5)
    assert math.sin(turn) == pytest.approx(0.0, abs=1e-6)


def test_two_squares_give_also_one_ellipse_through_both_that_ends_with_them():
    gain = np.zeros((40, 40), np.float32)
    gain[4:8, 18:22] = gain[32:36, 18:22] = 1.0
    *single, (x, y, long, short, turn) = ellipses(gain)
    assert len(single) == 2
    assert (x, y) == (20.0, 20.0)
    assert long == pytest.approx(16.0, abs=0.5)
    assert short == pytest.approx(2.0, abs=0.5)
    assert abs(math.sin(turn)) == pytest.approx(1.0)


def test_an_angle_gives_its_two_strokes():
    region = np.zeros((40, 40), bool)
    region[5:35, 5:9] = region[31:35, 5:30] = True
    upright, level = strokes(region)
    assert (int(upright.sum()), int(level.sum())) == (30 * 4, 25 * 4)
    assert upright[5:35, 5:9].all()
    assert level[31:35, 5:30].all()


def test_a_bar_and_a_square_have_no_strokes():
    for rows, columns in ((slice(10, 14), slice(5, 35)), (slice(5, 35), slice(5, 35))):
        region = np.zeros((40, 40), bool)
        region[rows, columns] = True
        assert strokes(region) == []


def test_where_nothing_is_wanted_there_is_no_ellipse():
    assert ellipses(np.full((8, 8), -1.0, np.float32)) == []


STRUCTURES = [
    (Part("circle"),),
    (Part("triangle", "linear"),),
    (Part("displaced"),),
    (Part("ellipse"), Part("box", join="subtraction")),
]


@pytest.mark.parametrize("parts", [MOST_COMPILED, MOST_COMPILED + 1])
@pytest.mark.parametrize("side", [40, 56])
def test_kernels_are_compiled_but_for_a_glance_at_many_shapes(parts, side):
    scene = from_scene(Scene(side, side, (Layer((Shape("circle", (0, 0, 0.3), (1, 0, 0)),), 0.1),)))
    around = Surroundings.of(scene, 0, View(torch.zeros(3, side, side), None))
    structure = (Part("circle"), *[Part("box", join="subtraction")] * (parts - 1))
    is_glance = side * side < GLANCE and parts > MOST_COMPILED
    assert isinstance(around.problem(structure), Dense if is_glance else Laid)


def in_the_middle(channels: int) -> Surroundings:
    """Those of a layer between two others, at a size that fills no block of pixels."""
    draw = torch.Generator().manual_seed(3)
    below = Layer((Shape("circle", (-0.1, 0.0, 0.3), (0.9, 0.2, 0.1)),), 0.1, 0.8)
    above = Layer((Shape("circle", (0.2, 0.1, 0.25), (0.1, 0.5, 0.7)),), 0.05, 0.6)
    scene = from_scene(Scene(31, 25, (below, below, above), (0.4, 0.5, 0.6)))
    view = View(torch.rand(channels, 25, 31, generator=draw), torch.rand(25, 31, generator=draw))
    return Surroundings.of(scene, 1, view)


ROOM = Room((1.0, 0.8), 0.02, (0.001, 0.5))


def some_of(structure: tuple[Part, ...]) -> tuple[torch.Tensor, Numbers]:
    """Candidates, and all of their numbers but the third as such that move."""
    rows = 0.05 + 0.3 * torch.rand(5, row_width(structure), generator=torch.Generator().manual_seed(5))
    width = rows.shape[1]
    moves = [number != 2 for number in range(width)]
    return rows, Numbers.where(moves, torch.full((width,), 0.05), ranges_of(structure, ROOM))


@pytest.mark.parametrize("structure", STRUCTURES, ids=lambda parts: "-".join(part.kind for part in parts))
@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize("counted", [False, True])
@pytest.mark.parametrize("steps", [0, 1, 4])
def test_each_candidate_goes_in_kernels_where_it_goes_alone_by_autograd(
    structure, channels, counted, steps, monkeypatch
):
    around = in_the_middle(channels)
    rows, numbers = some_of(structure)
    counts = torch.rand(5, 25 * 31, generator=torch.Generator().manual_seed(7)) if counted else None
    kernels = around.problem(structure, counts)
    assert isinstance(kernels, Laid)
    found, errors = kernels.descended(rows, numbers, steps, lambda error: None)
    monkeypatch.setattr(surroundings, "MOST_COMPILED", 0)
    monkeypatch.setattr(surroundings, "GLANCE", 10**6)
    for index in range(len(rows)):
        alone = around.problem(structure, None if counts is None else counts[index : index + 1])
        assert isinstance(alone, Dense)
        wanted, error = alone.descended(rows[index : index + 1], numbers, steps, lambda error: None)
        assert float(errors[index]) == pytest.approx(float(error), rel=1e-4)
        assert found[index].numpy() == pytest.approx(wanted[0].numpy(), abs=1e-3)


@pytest.mark.parametrize("compositing", ["over", "additive"])
@pytest.mark.parametrize(
    "structure",
    [*STRUCTURES, (Part("box", "linear"), Part("arc", "linear", "union")), (Part("gabor", "linear"),)],
    ids=lambda parts: "-".join(part.kind for part in parts),
)
def test_coverage_is_that_of_the_reference_whatever_the_look(structure, compositing):
    scene = replace(in_the_middle(3).scene, compositing=compositing)
    around = Surroundings.of(scene, 1, View(torch.zeros(3, 25, 31), None))
    rows, _ = some_of(structure)
    wanted, _ = rows_coverage(structure, rows[..., None], compositing, *around.points)
    assert around.covers(structure, rows).numpy() == pytest.approx(wanted.numpy(), abs=1e-5)
    assert wanted.max() - wanted.min() > 0.5


def test_a_candidate_that_is_hardly_helped_any_more_stays():
    """After a dozen steps or so, of which the last few still gain something."""
    problem, (rows, numbers) = in_the_middle(3).problem(STRUCTURES[3]), some_of(STRUCTURES[3])
    made = [problem.descended(rows, numbers, steps, lambda error: None)[0] for steps in (3, 60, 61)]
    assert torch.equal(made[1], made[2])
    assert not torch.equal(made[0], made[1])


def test_candidates_are_the_same_in_any_number_of_threads(monkeypatch):
    monkeypatch.setattr(laying, "WORTH_A_THREAD", 1)
    made = []
    for count in ("1", "3"):
        monkeypatch.setenv("SDF2VEC_THREADS", count)
        rows, numbers = some_of(STRUCTURES[0])
        made.append(in_the_middle(3).problem(STRUCTURES[0]).descended(rows, numbers, 4, lambda error: None))
    assert torch.equal(made[0][0], made[1][0])
    assert torch.equal(made[0][1], made[1][1])


def test_what_has_no_effect_stays_and_what_gets_nowhere_is_told_so():
    """A layer that is not seen: no number of it matters but its opacity, which may not move."""
    structure = STRUCTURES[0]
    rows, numbers = some_of(structure)
    rows[:, 0] = 0.0
    hidden = numbers.without(torch.tensor([True] + [False] * (rows.shape[1] - 1)))
    heard: list[float] = []
    hidden = hidden._replace(ranges=anything(rows.shape[1]))
    found, errors = in_the_middle(3).problem(structure).descended(rows, hidden, 8, heard.append)
    assert torch.equal(found, rows)
    assert heard == [float(errors.min())]


@pytest.mark.parametrize(
    "structure",
    [*STRUCTURES, (Part("box"), Part("box", join="union")), (Part("gabor", "linear"),)],
    ids=lambda parts: "-".join(part.kind for part in parts),
)
def test_rows_are_held_in_their_ranges_as_layers_are(structure):
    """By the projection that fits take, of numbers far beyond them and in them."""
    rows = 3.0 * torch.randn(200, row_width(structure), generator=torch.Generator().manual_seed(1))
    rows[::3] *= 0.05
    columns = [slot.parameter.unit for slot in slots(structure) for _ in range(slot.parameter.width)]
    rows[::2, [index for index, unit in enumerate(columns) if unit is SMOOTHNESS]] = 0.0
    wanted = layer_of(structure, torch.zeros(1, dtype=torch.int64), rows.clone())
    project_group(wanted, ROOM)
    ranges_of(structure, ROOM).hold(rows)
    turns = [index for index, unit in enumerate(columns) if unit is ANGLE]
    assert rows.numpy() == pytest.approx(wanted.rows().numpy(), abs=1e-6)
    assert ((rows[:, turns] >= 0.0) & (rows[:, turns] <= 2 * math.pi)).all()
