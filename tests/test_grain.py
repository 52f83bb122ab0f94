"""Units of small drawings: as many as asked for, about, and in the proportions of the picture."""

import pytest
import resvg_py

from sdf2vec import Layer, Scene, Shape
from sdf2vec.engines.engine import pixels_of
from sdf2vec.export.options import Options
from sdf2vec.export.svg import small_svg
from sdf2vec.fit.drawable import rounded
from sdf2vec.grain import GRAINS, is_of_pixels

DISC = Layer((Shape.of("circle", (1.0, 0.0, 0.0), center=(0.0, 0.0), radius=0.3),))


@pytest.mark.parametrize(
    ("width", "height"), [(200, 150), (600, 400), (333, 500), (1023, 769), (769, 1023), (300, 7), (7, 300)]
)
@pytest.mark.parametrize("grain", [GRAINS[0], GRAINS[2], GRAINS[-1]], ids=lambda grain: grain.name)
def test_what_is_drawn_by_its_width_has_the_pictures_height(width, height, grain):
    """resvg rounds the sides of a viewBox, and what that makes of the height up."""
    scene = Scene(width, height, (DISC,), (1.0, 1.0, 1.0))
    text = str(small_svg(rounded(scene, grain), Options(), grain).data)
    drawn = pixels_of(resvg_py.svg_to_bytes(svg_string=text, width=width))
    assert drawn.shape[:2] == (height, width)


@pytest.mark.parametrize(("width", "height"), [(200, 150), (1023, 769), (1, 300), (10001, 5000)])
@pytest.mark.parametrize("grain", GRAINS, ids=lambda grain: grain.name)
def test_units_are_about_as_many_as_asked_for(width, height, grain):
    units = grain.for_scene(Scene(width, height, (DISC,), (1.0, 1.0, 1.0))).units
    assert abs(units - grain.units) <= 0.1 * grain.units


@pytest.mark.parametrize(
    ("numbers", "falloff", "whole"),
    [
        ((0.0, 0.0, 0.25, 0.125, 0.0, 0.0), 0.0, True),  # from 4 to 12 and from 6 to 10 of 16 pixels
        ((0.03125, 0.0, 0.28125, 0.125, 0.0, 0.0), 0.0, True),
        ((0.03125, 0.0, 0.25, 0.125, 0.0, 0.0), 0.0, False),  # half a pixel
        ((0.0, 0.0, 0.25, 0.125, 0.1, 0.0), 0.0, False),
        ((0.0, 0.0, 0.25, 0.125, 0.0, 0.01), 0.0, False),
        ((0.0, 0.0, 0.25, 0.125, 0.0, 0.0), 0.1, False),
    ],
    ids=["even", "odd", "between pixels", "turned", "round", "soft"],
)
def test_boxes_of_whole_pixels_are_drawn_in_pixels(numbers, falloff, whole):
    scene = Scene(16, 16, (Layer((Shape("box", numbers, (1.0, 0.0, 0.0)),), falloff),))
    assert is_of_pixels(scene) == whole
    assert all((grain.for_scene(scene).units == 16) == whole for grain in GRAINS)
