"""Pictures of text are told from others: drawn with Pillow's own font, from photographs and from drawings."""

import numpy as np
import pytest
from PIL import Image, ImageDraw, ImageFont

from sdf2vec import lettering
from sdf2vec.converting import HINT
from tests.cli.command import SHORT, picture


def levels(image):
    return np.asarray(image, np.float32) / np.float32(255)


def drawn(draw, size=(160, 96), ground="white"):
    image = Image.new("RGB", size, ground)
    draw(ImageDraw.Draw(image))
    return levels(image)


def text(words, size, fill="black"):
    font = ImageFont.load_default(size)
    return lambda canvas: canvas.multiline_text((6, 4), words, fill, font)


@pytest.mark.parametrize(
    ("pixels", "found"),
    [
        (drawn(text("Hello World", 24)), True),
        (drawn(text("A line of words\nand another one,\nrather small", 14)), True),
        (drawn(text("White on blue", 20, "white"), ground="#114488"), True),
        (drawn(text("Hi", 40)), False),
        (drawn(lambda c: [c.ellipse((20 * i, 30, 20 * i + 16, 46), "red") for i in range(8)]), False),
        (
            drawn(lambda c: [c.rectangle((9 * i, 5 * i, 9 * i + 30, 5 * i + 9), "navy") for i in range(9)]),
            False,
        ),
        (drawn(lambda c: None), False),
        (levels(picture(160, 96)), False),
        (np.random.default_rng(0).random((96, 160, 3), np.float32), False),
    ],
    ids=["word", "lines", "white", "two letters", "discs", "bars", "nothing", "soft", "noise"],
)
def test_what_looks_like_text(pixels, found):
    assert lettering.is_lettering(pixels) == found


def test_photographs_and_icons_do_not():
    data = pytest.importorskip("skimage.data")
    for name in ("coffee", "astronaut", "camera", "horse"):
        pixels = levels(Image.fromarray(getattr(data, name)()).convert("RGB"))
        assert not lettering.is_lettering(pixels), name


def test_letters_on_nothing():
    image = Image.new("RGBA", (160, 48), (0, 0, 0, 0))
    text("On nothing", 24)(ImageDraw.Draw(image))
    assert lettering.is_lettering(levels(image))
    assert not lettering.is_lettering(np.zeros((8, 9, 4), np.float32))


def test_the_command_line_says_so(folder, run):
    Image.fromarray((255 * drawn(text("Hello World", 24))).astype(np.uint8)).save(folder / "text.png")
    assert HINT.encode() in run("text.png", *SHORT, "-o", "a.json").out
    assert HINT.encode() not in run("photo.jpg", *SHORT, "-o", "b.json").out
