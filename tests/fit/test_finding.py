"""The search for a drawing's shapes: when it ends, and what it leaves out."""

from dataclasses import replace

import numpy as np
import pytest

from sdf2vec import Scene
from sdf2vec.fit import finding
from sdf2vec.fit.descents import finished
from sdf2vec.fit.drawings import Drawn
from sdf2vec.fit.finding import Drawing
from sdf2vec.fit.pruning import FLOOR
from sdf2vec.fit.settings import settings_of
from sdf2vec.fit.sparse import Round
from sdf2vec.image import Picture
from sdf2vec.render.tensors import from_scene
from tests.fit.drawn import BLUE, SIDE, disc, hidden, noise, painted, sharp_disc


@pytest.mark.parametrize(
    ("color", "radius", "layers"), [((0.999, 0.999, 0.999), 5.0, 1), ((0.85, 0.85, 0.85), 1.5, 2)]
)
def test_what_shortens_the_description_stays_even_where_nothing_seems_missing(color, radius, layers):
    """Without a small grey dot the picture is 47 dB near; one of a quarter of a level does not pay for itself."""
    pixels = painted((disc(40, 40, 20), BLUE, 1.0), (disc(80, 80, radius), color, 1.0))
    drawing = Drawing(Drawn.of(Picture(pixels.astype(np.float32))), settings_of(), lambda progress: False)
    dot = sharp_disc(color, 80, 80, radius)
    scene = from_scene(Scene(SIDE, SIDE, (sharp_disc(BLUE, 40, 40), dot), (1.0, 1.0, 1.0)))
    drawing.scene = finished(scene, drawing.sizes, drawing.search)
    assert drawing._briefer(FLOOR).layer_count == layers


def test_a_round_that_only_takes_layers_away_does_not_end_the_search():
    """Its error may be a little higher than before: that says nothing about how many more are needed."""
    drawing = Drawing(replace(Drawn.of(noise()), flat=True), settings_of(), lambda progress: False)
    drawing.scene = from_scene(hidden(13, 0.5))
    assert not drawing._is_no_drawing(Round(from_scene(hidden(12, 0.5)), 2e-4, 1e-4))
    assert drawing._is_no_drawing(Round(from_scene(hidden(14, 0.5)), 2e-4, 1e-4))


@pytest.mark.parametrize(
    ("outlined", "gains", "made"),
    [
        (6, [3, 0.6, 0.6, 0.6, 0.6], 4),
        (6, [3, 0.6, 0.6, 3, 3, 3, 3], 7),
        (6, [9, 0.6, 0.6, 0.6, 0.6], 5),
        (14, [3, 0.6, 0.6, 0.6, 0.6], 5),
    ],
    ids=["slow", "quick again", "nearly there", "most layers outlined"],
)
def test_a_search_that_would_not_find_the_drawing_ends(outlined, gains, made, monkeypatch):
    """From 26 dB on, by so many dB a round; with 18 layers."""
    errors = [10 ** -(2.6 + sum(gains[:count]) / 10) for count in range(len(gains) + 1)]
    rounds = iter(
        [Round(from_scene(hidden(18, 0.5)), *pair) for pair in zip(errors[1:], errors, strict=False)]
    )
    monkeypatch.setattr(finding, "taken_apart", lambda *rest: from_scene(hidden(outlined, 0.5)))
    monkeypatch.setattr(finding, "grow", lambda *rest: rounds)
    monkeypatch.setattr(Drawing, "_finish", lambda self: None)
    Drawing(replace(Drawn.of(noise()), flat=True), settings_of(), lambda progress: False).found()
    assert len(list(rounds)) == len(gains) - made


@pytest.mark.parametrize(
    ("error", "bits", "is_told"), [(1e-4, 3.0, True), (1e-4, 4.0, False), (1e-5, 9.0, True)]
)
def test_what_is_near_but_leaves_much_to_be_told_is_not_the_drawing(error, bits, is_told, monkeypatch):
    """As of a soft photograph; what is nearer than anyone sees is, whatever is left."""
    drawing = Drawing(Drawn.of(noise()), settings_of(), lambda progress: False)
    values = drawing.sizes.last.target.numel()
    monkeypatch.setattr(finding, "description_length", lambda scene, view: bits * values)
    drawing.error = error
    assert drawing.explains(hidden(2, 0.5)) == is_told
