"""Stops that stand for the curve of a soft edge."""

import numpy as np
import pytest

from sdf2vec.export.svg.gradient_stops import FEWEST, MOST, edge_stops, stop_count
from sdf2vec.export.svg.sampling import edge_profile, edge_range


@pytest.mark.parametrize("start", [-0.1, 0.0, 0.4])
def test_stops_begin_where_they_are_told_and_end_where_coverage_does(start):
    places, covers = np.array(edge_stops(start, 8)).T
    assert (len(places), places[0]) == (8, start)
    assert places[-1] == pytest.approx(edge_range()[1])
    assert covers[-1] == 0
    assert (np.diff(places) > 0).all()
    assert (np.diff(covers) < 0).all()


def test_the_number_of_stops_keeps_the_error():
    assert stop_count(0.0, 0.2) == FEWEST
    assert stop_count(1.0, 1e-6) == MOST
    count = stop_count(1.0, 0.5)
    x = np.linspace(0.0, edge_range()[1], 5001)
    errors = []
    for n in (count - 1, count):
        drawn = np.interp(x, *np.array(edge_stops(0.0, n)).T)
        errors.append(255 * np.sqrt(np.mean((drawn - edge_profile(x)) ** 2)))
    assert errors[1] <= 0.505
    assert errors[0] > 0.5
