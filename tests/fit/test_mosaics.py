"""Pictures of upright rectangles: how many boxes tell them, and that nothing is off."""

import numpy as np
import pytest
from PIL import Image
from scipy import ndimage

from sdf2vec import fit, fitted
from sdf2vec.engines import resvg
from sdf2vec.exports import Exports
from sdf2vec.fit.mosaics import covered, mosaic
from sdf2vec.image import Picture

HEART = (
    "..XXX.XXX..",
    ".XOOOXOOOX.",
    "XOWOOOOOOOX",
    "XOOOOOOOOOX",
    ".XOOOOOOOX.",
    "...XOOOX...",
    ".....X.....",
)
PALETTE = {".": (0, 0, 0, 0), "X": (40, 0, 0, 255), "O": (220, 30, 40, 255), "W": (255, 220, 220, 255)}


def enlarged(cells, times):
    """Cells [R, Q] or [R, Q, C] as pixels, so many times as large."""
    return np.kron(cells, np.ones((times, times) + (1,) * (cells.ndim - 2), cells.dtype))


def code(side, seed=1):
    """Cells [R, R, 3], black or white by chance."""
    chance = np.random.default_rng(seed)
    return np.repeat((chance.random((side, side, 1)) > 0.5).astype(np.float32), 3, axis=2)


def sprite():
    return np.array([[PALETTE[letter] for letter in row] for row in HEART], np.float32) / 255


def boxes_at(pixels, scene):
    """What sharp boxes of whole pixels show: painted here, one after the other."""
    found = np.zeros_like(pixels)
    if scene.background is not None:
        found[:] = (*scene.background, 1.0)[: pixels.shape[2]]
    for layer in scene.layers:
        (shape,) = layer.shapes
        x, y, across, down, *_ = shape.parameters
        ends = ((x - across, x + across), (y - down, y + down))
        sides = ((scene.width, ends[0]), (scene.height, ends[1]))
        (left, right), (top, bottom) = (
            [round(0.5 * side + end / scene.pixel) for end in both] for side, both in sides
        )
        found[top:bottom, left:right] = (*shape.color, 1.0)[: pixels.shape[2]]
    return found


@pytest.mark.parametrize("times", [1, 3, 8])
@pytest.mark.parametrize("cells", [code(9), code(21), sprite()], ids=["code", "larger code", "sprite"])
def test_boxes_show_every_pixel(cells, times):
    pixels = enlarged(cells, times)
    scene = mosaic(pixels, 256)
    assert np.abs(boxes_at(pixels, scene) - pixels).max() < 1e-4
    assert scene.shape_count <= 0.5 * cells.shape[0] * cells.shape[1]


def test_a_box_lies_below_what_is_on_it():
    """A frame is a box on a box, a cross two, a plaid a bar across others: not one box for each part that is seen."""
    cells = np.zeros((9, 9, 3), np.float32)
    cells[1:8, 1:8] = 1.0
    cells[2:7, 2:7] = 0.0
    assert mosaic(enlarged(cells, 4), 256).shape_count == 2
    cells[:] = 0.0
    cells[3:6], cells[:, 3:6] = 0.5, 0.5
    assert mosaic(enlarged(cells, 4), 256).shape_count == 2
    cells[:, 3:6] = 1.0
    assert mosaic(enlarged(cells, 4), 256).shape_count == 2


def test_a_hidden_edge_is_not_where_one_is_seen():
    """There, at other sizes, a line of its colour would show beside what hides it."""
    cells = np.zeros((5, 12, 3), np.float32)
    cells[1:4, 1:11] = (1.0, 0.0, 0.0)
    cells[1:4, 4:11] = (0.0, 0.0, 1.0)
    scene = mosaic(enlarged(cells, 4), 256)
    assert scene.shape_count == 2
    x, _, across, *_ = scene.layers[0].shapes[0].parameters
    assert x - across == pytest.approx(
        (10 - 24) * scene.pixel, abs=1e-5
    )  # half way from 16, where it ends, to 4


def test_antialiased_edges_are_lines_within_pixels():
    large = enlarged(code(13, 2), 40)
    pixels = np.asarray(
        Image.fromarray((large * 255).astype(np.uint8)).resize((150, 150), Image.Resampling.BOX)
    )
    found = mosaic((pixels / 255).astype(np.float32), 256)
    exact = mosaic(enlarged(code(13, 2), 8), 256)
    assert found.shape_count == exact.shape_count
    for one, other in zip(found.layers, exact.layers, strict=True):
        assert one.shapes[0].parameters == pytest.approx(other.shapes[0].parameters, abs=0.1 * found.pixel)


def test_soft_edges_are_falloffs():
    """Of one pixel's standard deviation, as scipy blurs; half of what is there at a box's edge is where it was."""
    cells = np.zeros((6, 6, 3), np.float32)
    cells[1:5:2, 1:5:2] = 1.0
    levels = (255 * ndimage.gaussian_filter(enlarged(cells, 16), (1.0, 1.0, 0.0))).round().astype(np.uint8)
    begun = mosaic((levels / 255).astype(np.float32), 256)
    for layer in begun.layers:
        _, _, *half, _, _ = layer.shapes[0].parameters
        assert np.multiply(2, half) + layer.falloff == pytest.approx(16 * begun.pixel, rel=0.02)
    found = fitted(levels).scene
    assert found.shape_count == begun.shape_count == 4
    assert all(0.8 < layer.falloff * 0.1814 / found.pixel < 1.2 for layer in found.layers)


@pytest.mark.parametrize(
    "pixels",
    [
        np.linspace(0, 1, 90, dtype=np.float32).reshape(1, 90, 1).repeat(3, 2),
        np.random.default_rng(0).random((40, 40, 3)).astype(np.float32),
        enlarged(np.random.default_rng(0).random((8, 8, 3)).astype(np.float32), 8),
        np.full((40, 40, 4), 0.5, np.float32) * enlarged(code(10)[..., :1], 4),
        np.maximum(np.linspace(0.4, 0.5, 24, dtype=np.float32)[:, None, None], enlarged(code(6), 4)),
    ],
    ids=["a gradient", "noise", "a colour for each cell", "half transparent", "squares on a gradient"],
)
def test_other_pictures_are_none(pixels):
    assert mosaic(pixels, 256) is None


def test_no_more_boxes_than_are_allowed():
    pixels = enlarged(code(21), 4)
    count = mosaic(pixels, 256).shape_count
    assert mosaic(pixels, count).shape_count == count
    assert mosaic(pixels, count - 1) is None


def test_rectangles_that_others_make_needless_are_left_out():
    """The largest, in the middle, comes first: four others cover all of it that nothing else does."""
    part = np.zeros((7, 7), bool)
    part[2:5, 2:5] = part[1:4, 0:3] = part[3:6, 4:7] = part[4:7, 1:4] = part[0:3, 3:6] = True
    tiles = covered(part, part)
    shown = np.zeros_like(part)
    for top, bottom, left, right in tiles:
        shown[top:bottom, left:right] = True
    assert (shown == part).all()
    for index in range(len(tiles)):
        rest = np.zeros_like(part)
        for top, bottom, left, right in tiles[:index] + tiles[index + 1 :]:
            rest[top:bottom, left:right] = True
        assert (rest != part).any()


def test_an_svg_of_pixel_art_is_the_picture():
    """By resvg, pixel by pixel, at its own size and at three times it; more boxes than are written one by one."""
    pixels = enlarged(code(15), 4)
    scene = fit(Picture(pixels))
    assert scene.shape_count > 32
    text = str(Exports(scene, Picture(pixels)).export("svg").data)
    assert 'viewBox="0 0 60 60"' in text
    for times in (1, 3):
        large = enlarged(pixels, times)
        drawn = resvg.render(text, large.shape[1], large.shape[0])
        assert np.abs(np.asarray(drawn)[..., :3] - large).max() < 0.004


def test_a_jagged_disc_is_a_disc_and_a_sprite_is_its_pixels():
    rows, columns = np.mgrid[:96, :96] + 0.5
    inside = (rows - 48) ** 2 + (columns - 46) ** 2 < 37**2
    disc = np.where(inside[..., None], (0.9, 0.1, 0.2), (1.0, 1.0, 1.0)).astype(np.float32)
    assert mosaic(disc, 256).shape_count > 12
    (layer,) = fit(Picture(disc)).layers
    assert layer.shapes[0].kind == "circle"
    found = fit(Picture(sprite()))
    assert {layer.shapes[0].kind for layer in found.layers} == {"box"}
    assert np.abs(boxes_at(sprite(), found) - sprite()).max() < 1e-4
