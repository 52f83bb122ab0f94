"""Pictures of upright rectangles: how many boxes tell them, and that nothing is off."""

import io

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


def told(pixels, most=256):
    """The boxes that a picture is made of."""
    found = mosaic(pixels, most)
    assert found is not None
    return found


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


def pairs_in(tiles, part=None):
    """Cells, and all that meet, two or four, which one of some rectangles covers."""
    return {
        (row, column, rows, columns)
        for top, bottom, left, right in tiles
        for rows in (1, 2)
        for columns in (1, 2)
        for row in range(top, bottom - rows + 1)
        for column in range(left, right - columns + 1)
        if part is None or part[row : row + rows, column : column + columns].all()
    }


@pytest.mark.parametrize("times", [1, 3, 8])
@pytest.mark.parametrize("cells", [code(9), code(21), sprite()], ids=["code", "larger code", "sprite"])
def test_boxes_show_every_pixel(cells, times):
    pixels = enlarged(cells, times)
    scene = told(pixels)
    assert np.abs(boxes_at(pixels, scene) - pixels).max() < 1e-4
    assert scene.shape_count <= 0.5 * cells.shape[0] * cells.shape[1]


def test_a_box_lies_below_what_is_on_it():
    """A frame is a box on a box, a cross two, a plaid a bar across others: not one box for each part that is seen."""
    cells = np.zeros((9, 9, 3), np.float32)
    cells[1:8, 1:8] = 1.0
    cells[2:7, 2:7] = 0.0
    assert told(enlarged(cells, 4)).shape_count == 2
    cells[:] = 0.0
    cells[3:6], cells[:, 3:6] = 0.5, 0.5
    assert told(enlarged(cells, 4)).shape_count == 2
    cells[:, 3:6] = 1.0
    assert told(enlarged(cells, 4)).shape_count == 2


def test_a_hidden_edge_is_not_where_one_is_seen():
    """There, at other sizes, a line of its colour would show beside what hides it."""
    cells = np.zeros((5, 12, 3), np.float32)
    cells[1:4, 1:11] = (1.0, 0.0, 0.0)
    cells[1:4, 4:11] = (0.0, 0.0, 1.0)
    scene = told(enlarged(cells, 4))
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
    found = told((pixels / 255).astype(np.float32))
    exact = told(enlarged(code(13, 2), 8))
    assert found.shape_count == exact.shape_count
    for one, other in zip(found.layers, exact.layers, strict=True):
        assert one.shapes[0].parameters == pytest.approx(other.shapes[0].parameters, abs=0.1 * found.pixel)


def test_soft_edges_are_falloffs():
    """Of one pixel's standard deviation, as scipy blurs; half of what is there at a box's edge is where it was."""
    cells = np.zeros((6, 6, 3), np.float32)
    cells[1:5:2, 1:5:2] = 1.0
    levels = (255 * ndimage.gaussian_filter(enlarged(cells, 16), (1.0, 1.0, 0.0))).round().astype(np.uint8)
    begun = told((levels / 255).astype(np.float32))
    for layer in begun.layers:
        _, _, *half, _, _ = layer.shapes[0].parameters
        assert np.multiply(2, half) + layer.falloff == pytest.approx(16 * begun.pixel, rel=0.02)
    found = fitted(levels).scene
    assert found.shape_count == begun.shape_count == 4
    assert all(0.8 < layer.falloff * 0.1814 / found.pixel < 1.2 for layer in found.layers)


def test_soft_edges_that_are_not_wanted_are_none():
    levels = (255 * ndimage.gaussian_filter(enlarged(code(3), 16), (1.0, 1.0, 0.0))).round().astype(np.uint8)
    count = told((levels / 255).astype(np.float32)).shape_count
    assert any(layer.falloff for layer in fit(levels, count).layers)
    assert not any(layer.falloff for layer in fit(levels, count, max_falloff=0.0, preset="fast").layers)


def test_a_code_out_of_a_jpeg_is_told():
    file, pixels = io.BytesIO(), enlarged(code(15), 7)
    Image.fromarray((255 * pixels).astype(np.uint8)).save(file, "JPEG", quality=85)
    found = fit(file.getvalue())
    assert found.shape_count == told(pixels).shape_count
    assert np.abs(boxes_at(pixels, found) - pixels).max() < 0.02


def test_a_target_is_met_by_boxes_or_by_others():
    """Edges of boxes are as soft as a pixel: of fields of four pixels they are about 30 dB from what they are."""
    pixels = enlarged(code(9), 4)
    count = told(pixels).shape_count
    near = fitted(pixels, "auto", target_psnr=20, max_shapes=64, preset="fast")
    assert near.met
    assert near.scene.shape_count <= count
    far = fitted(pixels, "auto", target_psnr=99, max_shapes=64, preset="fast")
    assert not far.met
    assert far.scene.shape_count == 64


@pytest.mark.parametrize(
    "pixels",
    [
        np.linspace(0, 1, 90, dtype=np.float32).reshape(1, 90, 1).repeat(3, 2),
        np.random.default_rng(0).random((40, 40, 3)).astype(np.float32),
        enlarged(np.random.default_rng(0).random((8, 8, 3)).astype(np.float32), 8),
        np.full((40, 40, 4), 0.5, np.float32) * enlarged(code(10)[..., :1], 4),
        np.maximum(np.linspace(0.4, 0.5, 48, dtype=np.float32)[:, None, None], enlarged(code(12), 4)),
    ],
    ids=["a gradient", "noise", "a colour for each cell", "half transparent", "squares on a gradient"],
)
def test_other_pictures_are_none(pixels):
    assert mosaic(pixels, 256) is None


def test_no_more_boxes_than_are_allowed():
    pixels = enlarged(code(21), 4)
    count = told(pixels).shape_count
    assert told(pixels, count).shape_count == count
    assert mosaic(pixels, count - 1) is None


def test_cells_that_meet_are_covered_by_one_rectangle():
    """Two or four: between boxes of one colour that only touch, a line or a point is seen at other sizes."""
    part = np.random.default_rng(5).random((24, 20)) > 0.35
    assert pairs_in(covered(part, part)) == pairs_in([(0, 24, 0, 20)], part)


def test_every_rectangle_is_needed():
    """The largest, in the middle, comes first: those around it cover all of it that nothing else does."""
    part = np.zeros((7, 7), bool)
    part[2:5, 2:5] = part[1:4, 0:3] = part[3:6, 4:7] = part[4:7, 1:4] = part[0:3, 3:6] = True
    tiles = covered(part, part)
    assert pairs_in(tiles) == pairs_in([(0, 7, 0, 7)], part)
    for index in range(len(tiles)):
        assert pairs_in(tiles[:index] + tiles[index + 1 :]) != pairs_in(tiles)


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
    assert told(disc).shape_count > 12
    (layer,) = fit(Picture(disc)).layers
    assert layer.shapes[0].kind == "circle"
    found = fit(Picture(sprite()))
    assert {layer.shapes[0].kind for layer in found.layers} == {"box"}
    assert np.abs(boxes_at(sprite(), found) - sprite()).max() < 1e-4


def test_translucent_boxes_are_no_more_than_they_are():
    """Where one lies on another there is a third colour, of a third box if they were opaque."""
    pixels = np.ones((90, 120, 3), np.float32)
    for rows, columns, color in (
        (slice(12, 60), slice(10, 80), (0.9, 0.1, 0.1)),
        (slice(30, 80), slice(50, 110), (0.1, 0.2, 0.9)),
    ):
        pixels[rows, columns] = 0.5 * pixels[rows, columns] + 0.5 * np.array(color, np.float32)
    assert told(pixels).shape_count == 3
    assert fit(Picture(pixels)).shape_count == 2


def test_few_boxes_are_kept_where_others_are_as_many():
    """Edges of four pixels: three discs are as near to them as boxes, whose edges are as soft as a pixel."""
    pixels = np.array([[[1, 0, 0], [0, 1, 0]], [[0, 0, 1], [1, 1, 0]]], np.float32)
    found = fit(Picture(pixels))
    assert found.shape_count == 3
    assert np.abs(boxes_at(pixels, found) - pixels).max() < 1e-4
