"""Some seconds of each attack, and what has failed before: see `python -m tests.fuzz`."""

import time

import pytest

import sdf2vec
from tests.fuzz import domain
from tests.fuzz.attacks import ATTACKS, attempt
from tests.fuzz.kills import ready

SHARES = {
    "pictures": (2000, 4.0),
    "arrays": (500, 2.0),
    "scenes": (24, 5.0),
    "unions": (11, 3.0),
    "options": (1000, 2.0),
    "fits": (20, 2.0),
    "kills": (5, 6.0),
}
"""How many seeds, and after how many seconds no further one is begun."""

FAILED = [(0, "svg"), (3, "svg")]
"""Kept: seeds of scenes that an export has failed at."""


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", ATTACKS)
def test_attacks(name):
    count, seconds = SHARES[name]
    if name == "kills":
        ready()  # takes longer than they do
    end = time.monotonic() + seconds
    for seed in range(count):
        assert attempt(name, seed) == ""
        if time.monotonic() > end:
            break


@pytest.mark.filterwarnings("ignore::sdf2vec.errors.Sdf2vecWarning")
def test_a_fit_that_has_failed_before():
    """A palette on a picture of five pixels: rounding its numbers made it worse than the ground."""
    assert attempt("fits", 1300357) == ""


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize(("seed", "target"), FAILED)
def test_what_has_failed_before(seed, target):
    assert sdf2vec.export(domain.scene(seed, 3, 5, "over"), target)
