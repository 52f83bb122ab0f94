"""As few digits as a picture needs."""

import numpy as np
import pytest

from sdf2vec import Scene, fit, render
from sdf2vec.fit.constraints import thicknesses_of
from sdf2vec.fit.digits import concise, fit_concisely
from sdf2vec.fit.settings import settings_of
from sdf2vec.image import Picture
from sdf2vec.render.tensors import from_scene
from sdf2vec.scene import Layer, Shape
from sdf2vec.scene_file import dumps, loads

DISC = Layer(
    (Shape.of("circle", (0.81234, 0.21357, 0.43213), center=(0.012347, -0.034561), radius=0.254321),)
)
SCENE = Scene(64, 48, (DISC,), (0.91234, 0.87654, 0.76543))


def psnr(one, other):
    return -10 * np.log10(float(np.square(one - other).mean()) + 1e-20)


def digits(scene):
    numbers = [*scene.layers[0].numbers, *scene.background]
    return [len(repr(number).partition(".")[2]) for number in numbers if number % 1]


@pytest.mark.parametrize("noise", [0.0, 0.05], ids=["exact", "far off"])
def test_a_scene_has_the_digits_that_its_picture_needs(noise):
    """Fewer where it is far from the picture anyway, which it comes as near to as before."""
    pixels = render(SCENE) + np.float32(noise) * np.random.default_rng(0).standard_normal(
        (48, 64, 3), np.float32
    )
    picture = Picture(np.ascontiguousarray(pixels.clip(0, 1)))
    found = concise(SCENE, picture, settings_of(1))
    assert max(digits(found)) <= (4 if noise else 5) < max(digits(SCENE))
    if noise:
        assert abs(psnr(render(found), picture.pixels) - psnr(render(SCENE), picture.pixels)) < 0.01
    else:
        assert psnr(render(found), render(SCENE)) > 68  # a tenth of a level
    assert loads(dumps(found)) == found


@pytest.mark.usefixtures("few_steps")
def test_a_palette_stays_what_it_is():
    picture = Picture(np.random.default_rng(0).random((16, 16, 3), np.float32))
    scene = fit(picture, 5, preset="fast", palette="#123456,#fedcba")
    exact = {tuple(round(v / 255, 5) for v in color) for color in ((0x12, 0x34, 0x56), (0xFE, 0xDC, 0xBA))}
    assert {color for layer in scene.layers for color in layer.colors} <= exact


def test_nothing_gets_thinner_than_a_pixel():
    """A picture that asks for few digits, and triangles whose shortest altitude is a pixel."""
    r = np.random.default_rng(1)
    picture, layers = Picture(r.random((32, 32, 3), np.float32)), []
    for turn in r.random(24) * 6.28:
        along, across = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
        first = r.uniform(-0.2, 0.2, 2)
        a, b, c = map(tuple, (first, first + 0.4 * along, first + 0.2 * along + across / 32))
        layers.append(Layer((Shape.of("triangle", tuple(r.random(3).tolist()), a=a, b=b, c=c),)))
    found = concise(Scene(32, 32, tuple(layers), (0, 0, 0)), picture, settings_of(24))
    moved = sum(one.numbers != other.numbers for one, other in zip(layers, found.layers, strict=True))
    (widths,) = thicknesses_of(from_scene(found))
    assert moved > 12
    assert float(widths.min()) > 0.9999 / 32


@pytest.mark.usefixtures("few_steps")
@pytest.mark.parametrize("count", [12, 30])
def test_a_fit_goes_on_from_about_as_many_in_half_the_steps(count):
    """And comes about as near as one from nothing: half a dB less on average; not where it ends with trials."""
    y, x = np.mgrid[-1:1:48j, -1:1:64j].astype(np.float32)
    waves = 0.5 + 0.4 * np.stack([np.sin(7 * x + 3 * y), np.cos(5 * y * x), np.sin(9 * np.hypot(x, y))], 2)
    picture = Picture(waves.astype(np.float32))
    steps = []

    def seen(progress):
        steps.append(progress.steps)
        return False

    some = settings_of(count, preset="fast")
    begun = fit_concisely(picture, settings_of(20, preset="fast"), seen)
    anew = fit_concisely(picture, some, seen)
    all_steps = steps[-1]
    on = fit_concisely(picture, some, seen, begun)
    assert steps[-1] < 0.5 * all_steps
    assert len(on.layers) == count
    assert psnr(render(on), picture.pixels) > psnr(render(anew), picture.pixels) - 2.5
    fit_concisely(picture, settings_of(count, preset="fast", trials=1), seen, begun)
    assert steps[-1] > all_steps
