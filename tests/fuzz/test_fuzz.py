"""Half a minute of the attacks, and what has failed before: see `python -m tests.fuzz`."""

import time

import pytest

from tests.fuzz.attacks import ATTACKS, attempt

SHARES = {"pictures": (2000, 6.0), "arrays": (500, 2.0), "scenes": (60, 20.0), "options": (1000, 2.0)}
"""How many seeds, and after how many seconds no further one is begun."""

FAILED = [("scenes", 0), ("scenes", 3)]
"""Kept: what has failed once, by name and seed."""


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", ATTACKS)
def test_attacks(name):
    count, seconds = SHARES[name]
    end = time.monotonic() + seconds
    for seed in range(count):
        assert attempt(name, seed) == ""
        if time.monotonic() > end:
            break


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize(("name", "seed"), FAILED)
def test_what_has_failed_before(name, seed):
    assert attempt(name, seed) == ""
