"""How many shapes meet a target, with fits that come as near as they are told to."""

import math

import numpy as np
import pytest

from sdf2vec import Layer, Scene, Shape
from sdf2vec.fit import targets
from sdf2vec.fit.settings import settings_of
from sdf2vec.image import load

DISC = Layer((Shape.of("circle", (1, 0, 0), center=(0, 0), radius=0.2),), 0.1)


@pytest.fixture
def fits(monkeypatch):
    """Fits come `near(shapes)` dB near, short ones a little less; which were made."""
    made: list[tuple[str, int]] = []

    def install(near):
        def fit(picture, settings, callback, found=None):
            most = 1 if made and made[-1][0] == "fast" else 2  # what was found in a short fit is not grown
            assert (found is not None) == (bool(made) and 0.5 <= settings.shapes / made[-1][1] <= most)
            assert not found or len(found.layers) == made[-1][1] // settings.union
            made.append((settings.preset, settings.shapes))
            return Scene(8, 8, (DISC,) * (settings.shapes // settings.union))

        def psnr_of(scene, picture):
            return near(len(scene.layers)) - (0.3 if made[-1][0] == "fast" else 0.0)

        for name in ("fit_picture", "fit_concisely"):
            monkeypatch.setattr(targets, name, fit)
        monkeypatch.setattr(targets, "psnr_of", psnr_of)
        return made

    return install


def met_by(target, **options):
    picture = load(np.full((8, 8, 3), 0.5, np.float32))
    settings = settings_of("auto", target_psnr=target, **{"max_shapes": 256, **options})
    scene, is_met = targets.meeting(picture, settings, lambda progress: False)
    assert is_met == (targets.missed(scene, picture, settings) <= 0.0)
    return len(scene.layers)


@pytest.mark.parametrize("slope", [1.2, 1.7, 2.4])
@pytest.mark.parametrize("fewest", [20, 50, 130, 240])
def test_about_the_fewest_are_found_in_few_fits(fits, slope, fewest):
    made = fits(lambda shapes: 24.0 + slope * math.log2(shapes / fewest))
    assert fewest <= met_by(24.0) <= max(1.3 * fewest, fewest + 2)
    assert [preset for preset, _ in made].count("balanced") <= 2
    assert [preset for preset, _ in made].count("fast") <= 2


@pytest.mark.parametrize("slope", [0.3, 6.0])
def test_so_they_are_where_shapes_are_worth_far_more_or_less(fits, slope):
    made = fits(lambda shapes: 24.0 + slope * math.log2(shapes / 100))
    assert 100 <= met_by(24.0) <= 256
    assert len(made) <= 2 + targets.TRIES + 1


def test_what_even_the_most_do_not_meet_is_tried_once_with_them(fits):
    made = fits(lambda shapes: 20.0 + math.log2(shapes))
    assert met_by(40.0) == 256
    assert made == [("fast", 64), ("balanced", 256)]


def test_the_fast_preset_is_not_foretold(fits):
    made = fits(lambda shapes: 24.3 + 1.7 * math.log2(shapes / 64))
    assert met_by(24.0, preset="fast") == 64
    assert made == [("fast", 64)]


def test_a_union_counts_as_many_shapes_as_it_has(fits):
    made = fits(lambda layers: 24.0 + 1.7 * math.log2(layers / 90))
    met_by(24.0, union=3, max_shapes=255)
    assert all(shapes % 3 == 0 for _, shapes in made)


def test_what_goes_on_from_a_scene_may_need_fewer_shapes_than_that_has(fits):
    fits(lambda shapes: 24.0 + 1.7 * math.log2(shapes / 30))
    assert 30 <= met_by(24.0, start=Scene(8, 8, (DISC,) * 100)) <= 40
