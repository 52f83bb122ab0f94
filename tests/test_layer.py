"""The formula of a layer against one written a second time in numpy, and its bounds and derivatives."""

import random
from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.special import expit, logsumexp

from sdf2vec import Joint, Layer, Scene, Shape
from sdf2vec.blend import COMPOSITING
from sdf2vec.graph import components_of
from sdf2vec.layer import PIXEL, Formula, P, Part, constant_row, is_flat, row_width, slots
from sdf2vec.lower.torch import compile_torch
from sdf2vec.paints import PAINTS, Paint
from sdf2vec.render.reference import composite, render
from sdf2vec.render.tensors import from_scene
from sdf2vec.scene_file import loads
from sdf2vec.shapes import KINDS
from sdf2vec.units import ANGLE, Parameter
from tests.scenes import FAMILIES, random_layer_of, scene_of

STRUCTURES = [structure for structures in FAMILIES.values() for structure in structures]
NAMES = [str(Formula.of(structure)) for structure in STRUCTURES]


def lowered(structure, *exprs):
    """A function of a layer, points and the size of a pixel that gives expressions' components [P], in float64."""
    function = compile_torch(exprs, [*components_of(P), *Formula.of(structure).uniforms])

    def values(layer, x, y, pixel=0.01):
        numbers = [torch.as_tensor(v, dtype=torch.float64) for v in (x, y, pixel, *layer.numbers)]
        return [part.expand(len(x)).numpy() for part in function(*numbers)]

    return values


def points(count=4000, seed=0):
    return np.random.default_rng(seed).uniform(-1.2, 1.2, (2, count))


def cover_of(layer, x, y, pixel=0.01, compositing="over"):
    (cover,) = lowered(layer.structure, Formula.of(layer.structure).cover(compositing))(layer, x, y, pixel)
    return cover


def circle(x, y, radius, color=(0, 0, 0), *paint):
    return Shape("circle", (x, y, radius), color, *paint)


# --- what a layer is ---------------------------------------------------------------------------------------


def test_a_row_has_a_place_for_every_number():
    structure = (
        Part("circle", "linear"),
        Part("box", "linear", "subtraction"),
        Part("gabor", "flat", "union"),
    )
    named = [f"{slot.parameter.name}{slot.suffix}" for slot in slots(structure)]
    assert named == [
        *("opacity", "falloff", "color_0", "color_end_0", "direction_0", "shift_0", "center_0", "radius_0"),
        *("smoothness_1", "center_1", "half_size_1", "angle_1", "corner_radius_1"),
        *("smoothness_2", "color_2", "center_2", "radii_2", "angle_2", "frequency_2", "phase_2"),
    ]
    assert row_width(structure) == 2 + 9 + 3 + 1 + 6 + 1 + 3 + 7


@pytest.mark.parametrize(
    ("kind", "paint", "word"),
    [("angle", "direction", ""), ("angle", "angle", "angle"), ("falloff", "direction", "falloff")],
)
def test_a_name_means_one_thing(kind, paint, word, monkeypatch):
    """A file tells the numbers of a shape apart by name, so none of kind, paint and layer may share one."""
    named = replace(KINDS["circle"], name="toy", parameters=(Parameter(kind, ANGLE),))
    monkeypatch.setitem(KINDS, "toy", named)
    monkeypatch.setitem(PAINTS, "veil", Paint("veil", PAINTS["flat"].color, (Parameter(paint, ANGLE),)))
    if not word:
        assert [p.name for p in Part("toy", "veil").parameters] == ["color", "direction", "angle"]
        return
    with pytest.raises(ValueError, match=f"kind toy with the paint veil: two things are called {word};"):
        slots((Part("toy", "veil"),))


def test_the_colour_of_what_is_cut_off_has_no_place():
    assert is_flat((Part("circle"), Part("box", "linear", "subtraction"), Part("box", join="intersection")))
    assert not is_flat((Part("circle"), Part("box", join="union")))
    assert not is_flat((Part("circle", "linear"),))


def test_a_layer_of_constants_is_the_layer_of_variables():
    x, y = points(50)
    for structure in STRUCTURES:
        layer = random_layer_of(structure, random.Random(1), "additive")
        formula, fixed = Formula.of(structure), Formula(structure, constant_row(structure, layer.numbers))
        plain = compile_torch([fixed.cover("additive"), fixed.color], [*components_of(P), PIXEL])
        got = plain(*(torch.as_tensor(v, dtype=torch.float64) for v in (x, y, 0.01)))
        want = lowered(structure, formula.cover("additive"), formula.color)(layer, x, y)
        for one, other in zip(got, want, strict=True):
            np.testing.assert_allclose(one.expand(50).numpy(), other, atol=1e-12)


# --- values by numpy ---------------------------------------------------------------------------------------

ROUND = ((-0.1, 0.0, 0.3), (0.2, 0.1, 0.2), (0.0, -0.2, 0.25))


def circles_apart(x, y):
    """Signed distances [3, P] of three circles."""
    return np.stack([np.hypot(x - a, y - b) - radius for a, b, radius in ROUND])


@pytest.mark.parametrize("smoothness", [0.0, 0.03, 0.2])
def test_joins_go_from_left_to_right(smoothness):
    joints = (Joint("subtraction", smoothness), Joint("union", 2 * smoothness))
    layer = Layer(tuple(circle(*row) for row in ROUND), 0.1, 1.0, joints)
    x, y = points()
    a, b, c = circles_apart(x, y)
    k = max(smoothness, 1e-6)
    cut = k * logsumexp([a / k, -b / k], axis=0)
    want = -max(2 * smoothness, 1e-6) * logsumexp([-v / max(2 * smoothness, 1e-6) for v in (cut, c)], axis=0)
    (got,) = lowered(layer.structure, Formula.of(layer.structure).distance)(layer, x, y)
    np.testing.assert_allclose(got, want, atol=1e-9)
    if smoothness == 0.0:
        np.testing.assert_allclose(got, np.minimum(np.maximum(a, -b), c), atol=2e-6)


def test_unions_of_one_smoothness_do_not_depend_on_the_order():
    """Distance and colour are those of the smooth minimum of all, by its weights."""
    colors = np.array([[1, 0, 0.2], [0, 1, 0.4], [0.5, 0.25, 1]])
    shapes = [circle(*row, tuple(color)) for row, color in zip(ROUND, colors, strict=True)]
    x, y = points()
    d = -circles_apart(x, y) / 0.07
    weights = np.exp(d - logsumexp(d, axis=0))
    for order in ([0, 1, 2], [2, 0, 1]):
        layer = Layer.union([shapes[i] for i in order], 0.07, 0.1)
        formula = Formula.of(layer.structure)
        distance, *color = lowered(layer.structure, formula.distance, formula.color)(layer, x, y)
        np.testing.assert_allclose(distance, -0.07 * logsumexp(d, axis=0), atol=1e-12)
        np.testing.assert_allclose(color, colors.T @ weights, atol=1e-12)


def in_frame(x, y, center, half, angle):
    along, across = x - center[0], y - center[1]
    c, s = np.cos(angle), np.sin(angle)
    return (along * c + across * s) / half[0], (across * c - along * s) / half[1]


def test_a_gaussian_by_hand():
    """1 in the middle, e^(−1/2) one standard deviation away on its own axes, as wide as a pixel at least."""
    patch = Layer((Shape("gaussian", (0.1, 0.2, 0.4, 0.2, np.pi / 6), (1, 1, 1)),))
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    x, y = 0.1 + np.array([0, 0.4 * c, -0.2 * s, 0.8 * c]), 0.2 + np.array([0, 0.4 * s, 0.2 * c, 0.8 * s])
    got = cover_of(patch, x, y, 1e-6)
    np.testing.assert_allclose(got, [1.0, 0.60653066, 0.60653066, 0.13533528], atol=2.5e-3)


def test_a_patch_is_blurred_by_the_pixel():
    """Against the mean over a pixel of what is finer: a Gaussian's peak, a wave's height."""
    pixel, deviation, frequency = 0.2, 0.15, 9.0
    fine = (np.arange(2000) + 0.5) / 2000 * pixel - pixel / 2
    bell = np.exp(-0.5 * (fine / deviation) ** 2)
    wave = Layer((Shape("gabor", (0, 0, 40.0, 40.0, 0.0, frequency, 0.0), (1, 1, 1)),))
    narrow = Layer((Shape("gaussian", (0, 0, deviation, deviation, 0.0), (1, 1, 1)),))
    origin = np.zeros(1)
    assert cover_of(wave, origin, origin, pixel, "additive") == pytest.approx(
        np.cos(frequency * fine).mean(), abs=0.02
    )
    assert cover_of(narrow, origin, origin, pixel) == pytest.approx(bell.mean() ** 2, abs=0.02)


def test_a_gabor_patch_by_numpy():
    center, radii, angle, frequency, phase = (0.1, -0.2), (0.3, 0.15), 0.7, 14.0, 0.8
    patch = Layer((Shape("gabor", (*center, *radii, angle, frequency, phase), (1, 1, 1)),))
    x, y = points()
    u, v = in_frame(x, y, center, radii, angle)
    want = np.exp(-0.5 * (u * u + v * v)) * np.cos(frequency * u * radii[0] + phase)
    np.testing.assert_allclose(cover_of(patch, x, y, 1e-5, "additive"), want, atol=2.5e-3)
    np.testing.assert_allclose(cover_of(patch, x, y, 1e-5), np.maximum(want, 0.0), atol=2.5e-3)


@pytest.mark.parametrize(("falloff", "pixel"), [(0.2, 0.001), (0.0, 0.05), (0.04, 0.1)])
def test_the_edge_of_a_shape_is_a_sigmoid_of_its_distance(falloff, pixel):
    x, y = points()
    softness = max(falloff, 1.6 * pixel)
    want = expit(10 * (falloff / 2 - (np.hypot(x, y) - 0.4)) / softness)
    got = cover_of(Layer((circle(0, 0, 0.4),), falloff), x, y, pixel)
    np.testing.assert_allclose(got, np.clip((want - 1 / 512) / (1 - 2 / 512), 0, 1), atol=1e-12)


FIRST_VERSION = """{"format": "sdf2vec scene", "version": 1, "width": 6, "height": 4, "compositing": "over",
"background": [0.2, 0.4, 0.6], "layers": [
{"union": [{"kind": "circle", "center": [-0.2, 0.05], "radius": 0.3, "color": [1, 0.2, 0]},
           {"kind": "circle", "center": [0.15, -0.1], "radius": 0.25, "color": [0, 0.5, 1]},
           {"kind": "circle", "center": [0.4, 0.2], "radius": 0.15, "color": [0.3, 0.9, 0.1]}],
 "smoothness": 0.08, "falloff": 0.2, "opacity": 0.75},
{"kind": "box", "center": [0.3, 0.1], "half_size": [0.2, 0.1], "angle": 0.4, "corner_radius": 0.02,
 "color": [0.9, 0.8, 0.1], "falloff": 0.02}]}"""
DRAWN_BY_THE_FIRST_VERSION = [  # red and blue
    [
        [0.2028969, 0.3133793, 0.3513086, 0.1134412, 0.1363435, 0.199197],
        [0.3100171, 0.7765502, 0.6826975, 0.2194053, 0.1145927, 0.195716],
        [0.3870945, 0.7945675, 0.7828097, 0.6669904, 0.8557572, 0.2838206],
        [0.218823, 0.6087656, 0.6857135, 0.3427507, 0.2977361, 0.2247527],
    ],
    [
        [0.5978579, 0.5186368, 0.5421755, 0.8176562, 0.7326975, 0.6015134],
        [0.5178393, 0.1705531, 0.26675, 0.7387436, 0.8010513, 0.5990833],
        [0.4599573, 0.1548963, 0.1671027, 0.2985479, 0.1153208, 0.3800685],
        [0.5859093, 0.2942531, 0.2387108, 0.4510518, 0.2848943, 0.4888854],
    ],
]


def test_a_scene_of_the_first_version_looks_as_it_did():
    got = render(loads(FIRST_VERSION), dtype=torch.float64)[[0, 2]]
    np.testing.assert_allclose(got.numpy(), DRAWN_BY_THE_FIRST_VERSION, atol=1e-7)


# --- bounds and derivatives --------------------------------------------------------------------------------


@pytest.mark.parametrize("compositing", COMPOSITING)
@pytest.mark.parametrize("structure", STRUCTURES, ids=NAMES)
def test_bounds_hold(structure, compositing):
    """Coverage is exactly 0 beyond the box and the reach, exactly 1 within the saturation."""
    r, formula = random.Random(5), Formula.of(structure)
    measured = lowered(structure, formula.cover(compositing), formula.distance, *formula.bounds())
    x, y = points(3000)
    for _ in range(25):
        layer = random_layer_of(structure, r, compositing)
        cover, distance, *bounds = measured(layer, x, y)
        left, top, right, bottom, far, near, _ = (bound[0] for bound in bounds)
        outside = (x < left) | (x > right) | (y < top) | (y > bottom) | (distance > far)
        assert not cover[outside].any()
        assert (cover[distance < near] == 1.0).all()
        assert outside.any()


@pytest.mark.parametrize("structure", STRUCTURES, ids=NAMES)
def test_distances_change_no_faster_than_the_slope(structure):
    r, step, formula = random.Random(6), 1e-4, Formula.of(structure)
    measured = lowered(structure, formula.distance, formula.bounds()[-1])
    x, y = points(3000)
    turns = np.random.default_rng(1).uniform(0, 7, len(x))
    moved = x + step * np.cos(turns), y + step * np.sin(turns)
    for _ in range(15):
        layer = random_layer_of(structure, r, "over")
        (here, slope), (there, _) = measured(layer, x, y), measured(layer, *moved)
        assert (np.abs(there - here) <= slope * step * (1 + 1e-6) + 1e-9).all()


@pytest.mark.parametrize("compositing", COMPOSITING)
@pytest.mark.parametrize("family", FAMILIES)
def test_derivatives_of_every_number(family, compositing):
    """Against central differences in float64, for a soft layer of each structure."""
    scene = scene_of(family, compositing, layers=2, seed=3)
    smooth = [
        Layer(layer.shapes, 0.2, layer.opacity, tuple(Joint(joint.join, 0.05) for joint in layer.joints))
        for layer in scene.layers
    ]
    tensors = from_scene(Scene(60, 40, tuple(smooth), scene.background, compositing), torch.float64)
    weights = torch.randn((4, 12, 18), generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    leaves = [tensor.requires_grad_() for group in tensors.groups for tensor in group.values.values()]

    def loss():
        return (composite(tensors, 18, 12) * weights).sum()

    for leaf, grad in zip(leaves, torch.autograd.grad(loss(), leaves), strict=True):
        flat = leaf.detach().view(-1)
        for index, slope in enumerate(grad.flatten().tolist()):
            before, found = float(flat[index]), []
            for step in (1e-6, -1e-6):
                flat[index] = before + step
                with torch.no_grad():
                    found.append(float(loss()))
            flat[index] = before
            assert slope == pytest.approx((found[0] - found[1]) / 2e-6, rel=1e-4, abs=1e-5)


def test_a_wave_leaves_an_opaque_ground_opaque():
    """Under `additive` the troughs of a Gabor patch take light away, not alpha."""
    wave = Shape("gabor", (0, 0, 0.2, 0.2, 0, 40, 0), (0.3, 0.3, 0.3))
    image = render(Scene(40, 40, (Layer((wave,)),), (0.5, 0.5, 0.5), "additive"))
    assert torch.all(image[3] == 1.0)
    assert image[:3].min() < 0.35
    assert image[:3].max() > 0.65
