"""What is drawn in fewer numbers is said in fewer: colours that are shared, one colour instead of a ramp."""

import numpy as np
import pytest
import torch

from sdf2vec import Scene, fit
from sdf2vec.fit import simplify
from sdf2vec.fit.drawings import Drawn
from sdf2vec.fit.finding import Drawing
from sdf2vec.fit.initialization import Layers
from sdf2vec.fit.joining import Search
from sdf2vec.fit.ramps import grounded, lowest
from sdf2vec.fit.settings import settings_of
from sdf2vec.fit.simplify import sharing, simplified
from sdf2vec.fit.surroundings import View
from sdf2vec.image import Picture
from sdf2vec.quality import quality
from sdf2vec.render.draw import draw
from sdf2vec.render.tensors import from_scene, to_scene
from sdf2vec.scene import Joint, Layer, Shape

RED, ALMOST = (0.8, 0.1, 0.2), (0.802, 0.1, 0.199)


def as_simple_as_drawn(scene, drawn, worst=0.0):
    view = View(draw(drawn)[:3], None)
    search = Search(
        Layers(("circle", "box", "triangle", "rounded_triangle", "arc"), "over"),
        (0.0, 1.0),
        torch.Generator(),
        lambda loss: None,
        1 / 48,
    )
    made = simplified(from_scene(scene), view, search, worst)
    return to_scene(sharing(made, view, worst), 48, 48)


def scene(*shapes):
    return Scene(48, 48, tuple(Layer((shape,)) for shape in shapes), (1.0, 1.0, 1.0))


def disc(color, x):
    return Shape.of("circle", color, center=(x, 0.0), radius=0.2)


def box(end=None):
    paint = {"paint": "linear", "color_end": end, "direction": (0.5, 0.0)} if end else {}
    return Shape.of(
        "box", RED, **paint, center=(0.0, 0.0), half_size=(0.3, 0.2), angle=0.0, corner_radius=0.0
    )


def pierced(smoothness, hole=0.1):
    """A disc with a hole."""
    shapes = disc(RED, 0.0), Shape.of("circle", RED, center=(0.02, 0.0), radius=hole)
    return Scene(48, 48, (Layer(shapes, joints=(Joint("subtraction", smoothness),)),), (1.0, 1.0, 1.0))


def test_joins_become_sharp_where_they_are():
    """A smooth join makes a hole larger: a smaller one had come to the same."""
    drawn = pierced(0.0)
    (layer,) = as_simple_as_drawn(pierced(0.03, 0.09), drawn, 1e-4).layers
    assert [joint.smoothness for joint in layer.joints] == [0.0]
    assert abs(layer.shapes[1].parameters[2] - 0.1) < 0.003


def test_joins_that_are_seen_to_be_smooth_stay_so():
    shapes = (disc(RED, -0.15), disc(RED, 0.15))
    joined = Scene(48, 48, (Layer(shapes, joints=(Joint("union", 0.06),)),), (1.0, 1.0, 1.0))
    (layer,) = as_simple_as_drawn(joined, joined).layers
    assert layer.joints[0].smoothness > 0.04


def triangle(kind, a, b, c, **rest):
    return scene(Shape.of(kind, RED, a=a, b=b, c=c, **rest))


def test_a_triangle_whose_corners_are_hardly_round_has_sharp_ones():
    """Sides of 0.6, 0.8 and 1, a circle of 0.2 within; those of the other lie a fiftieth farther in."""
    wanted = triangle("triangle", (-0.32, -0.32), (0.48, -0.32), (-0.32, 0.28))
    begun = triangle("rounded_triangle", (-0.3, -0.3), (0.42, -0.3), (-0.3, 0.24), corner_radius=0.02)
    (layer,) = from_scene(begun).groups
    ((sharp, _),) = simplify._triangle(layer, View(torch.zeros(3, 48, 48), None))
    assert sharp.rows()[0, -6:].tolist() == pytest.approx((-0.32, -0.32, 0.48, -0.32, -0.32, 0.28), abs=1e-6)
    (found,) = as_simple_as_drawn(begun, wanted, 1e-4).layers[0].shapes
    assert found.kind == "triangle"


def test_corners_that_are_seen_to_be_round_stay_so():
    own = triangle("rounded_triangle", (-0.2, -0.2), (0.2, -0.2), (-0.2, 0.2), corner_radius=0.15)
    (found,) = as_simple_as_drawn(own, own, 1e-6).layers[0].shapes
    assert found.kind == "rounded_triangle"


def arc(sagitta):
    numbers = {"a": (-0.3, -0.1), "b": (0.3, 0.1), "sagitta": sagitta, "half_width": 0.06}
    return scene(Shape.of("arc", RED, **numbers))


def test_what_is_hardly_bent_is_straight():
    (found,) = as_simple_as_drawn(arc(0.005), arc(0.001), 1e-5).layers[0].shapes
    assert found.parameters[4] == 0.0


def test_what_is_seen_to_be_bent_stays_so():
    (found,) = as_simple_as_drawn(arc(0.018), arc(0.018), 1e-7).layers[0].shapes
    assert found.parameters[4] > 0.01


def test_colours_that_are_close_become_one():
    """Half a level apart, which nobody sees."""
    blue = Shape.of("circle", (0.1, 0.1, 0.9), center=(0.0, 0.35), radius=0.1)
    drawn = scene(disc(RED, -0.25), disc(ALMOST, 0.25), blue)
    first, second, third = (layer.shapes[0].color for layer in as_simple_as_drawn(drawn, drawn).layers)
    assert first == second != third


def test_colours_that_are_seen_to_differ_stay():
    other = (0.83, 0.13, 0.2)
    drawn = scene(disc(RED, -0.25), disc(other, 0.25))
    first, second = (layer.shapes[0].color for layer in as_simple_as_drawn(drawn, drawn).layers)
    assert np.allclose((first, second), (RED, other), atol=0.004)


def test_a_ramp_of_one_colour_is_flat():
    (layer,) = as_simple_as_drawn(scene(box(ALMOST)), scene(box())).layers
    assert layer.shapes[0].paint == "flat"
    steep = scene(box((0.1, 0.5, 0.9)))
    (layer,) = as_simple_as_drawn(steep, steep).layers
    assert layer.shapes[0].paint == "linear"


def ramp_of(slope, width=64, height=40):
    """Two colours mixed along a direction, by no formula of ours."""
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    t = (0.2 + (x * slope[0] + y * slope[1]) * 0.6)[..., None]
    first, last = np.array([0.1, 0.2, 0.7], np.float32), np.array([0.9, 0.6, 0.2], np.float32)
    return np.round((first * (1 - t) + last * t) * 255).astype(np.float32) / 255


def test_a_ramp_is_one_box():
    picture = Picture(ramp_of((1 / 64, 0.3 / 40)))
    found = fit(picture)
    (layer,) = found.layers
    assert [(shape.kind, shape.paint) for shape in layer.shapes] == [("box", "linear")]
    assert quality(found, picture).psnr >= 48


def test_a_ramp_is_found_under_shapes():
    pixels = ramp_of((0.0, 1 / 40))
    bare = pixels.copy()
    pixels[10:30, 20:50] = (1.0, 1.0, 1.0)
    drawing = Drawing(Drawn.of(Picture(pixels)), settings_of(), lambda progress: False)
    on_ramp = grounded(drawing.scene, drawing.sizes.joint, drawing.search)
    assert lowest(on_ramp) == 1
    assert quality(to_scene(on_ramp, 64, 40), Picture(bare)).psnr >= 40
