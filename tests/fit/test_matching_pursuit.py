"""The largest of gains that become less, and what a disc covers."""

import pytest
import torch

from sdf2vec.fit import matching_pursuit
from sdf2vec.fit.matching_pursuit import FARTHEST, WIDTH, Gains, Size


@pytest.mark.parametrize("block", [1, 7, 1024])
def test_the_largest_gain_is_found_while_others_are_taken_away(monkeypatch, block):
    monkeypatch.setattr(matching_pursuit, "BLOCK", block)
    generator = torch.Generator().manual_seed(0)
    own = [torch.rand(shape, generator=generator) - 0.3 for shape in ((9, 11), (4, 5), (1, 3), (30, 1))]
    gains, left = Gains.of(own), [each.clone() for each in own]
    count = 0
    while (found := gains.largest()) is not None:
        index, row, column = found
        assert left[index][row, column] == max(float(each.max()) for each in left)
        for which, part in ((index, (row, column)), (0, (slice(row, row + 2), slice(3, 6)))):
            left[which][part] = -1.0
            gains.grids[which][part] = -1.0
        count += 1
    assert all((each <= 0.0).all() for each in left)
    assert count > 50


@pytest.mark.parametrize(("y", "x"), [(0, 0), (10, 30), (23, 47)])
def test_a_disc_covers_what_its_gaussian_does_wherever_it_is(y, x):
    height, width, radius = 24, 48, 5.0
    cover = Size.of(radius, height, width).cover(y, x, height, width)
    down, across = torch.arange(height)[:, None] - y, torch.arange(width) - x
    wanted = torch.exp(-0.5 * (down.square() + across.square()) / (WIDTH * radius) ** 2)
    wanted[(down.abs() >= FARTHEST * WIDTH * radius).flatten()] = 0.0
    wanted[:, (across.abs() >= FARTHEST * WIDTH * radius).flatten()] = 0.0
    image = torch.zeros(1, height, width)
    cover.of(image).copy_(cover.amounts)
    assert torch.allclose(image[0], wanted, atol=1e-7)
