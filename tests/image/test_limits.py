"""Budgets: what a picture may take of memory and time, and how large ones are read."""

import os
import resource
import subprocess
import sys
import threading
import zlib
from struct import pack

import numpy as np
import pytest
from PIL import Image

from sdf2vec import image
from sdf2vec.errors import Sdf2vecError
from sdf2vec.export import EXPORTERS
from sdf2vec.export.options import Options
from sdf2vec.image import encode_png, load
from sdf2vec.limits import FITTED, whole_number
from sdf2vec.scene import Scene
from tests.image.bombs import blank, blank_png, tiff, webp_header
from tests.image.files import chunk, corners, png, refusal, saved

MEMORY, SECONDS = 2e9, 20  # bytes; as promised in docs/reliability.md
READER = """
import re, sys
from pathlib import Path
from sdf2vec.errors import Sdf2vecError
from sdf2vec.image import load
try:
    picture = load(sys.argv[1])
    print(*picture.pixels.shape[1::-1])
except Sdf2vecError as error:
    print(error)
status = Path("/proc/self/status").read_text()  # what getrusage says holds for the process that started it, too
print(int(re.search("VmHWM: *\\s*([0-9]+)", status)[1]) * 1024)
"""

BOMBS = {
    "one.png": (lambda: blank_png(14_000, 14_000, 1, 0, 1), "2800 2800"),
    "alpha.png": (lambda: blank_png(9_000, 9_000, 8, 6, 4), "3000 3000"),
    "long.png": (lambda: blank_png(10**6, 20, 8, 2, 3), "62500 2"),
    "tall.png": (lambda: blank_png(20, 10**6, 8, 2, 3), "2 62500"),
    "taller.png": (lambda: blank_png(1, 2 * 10**6, 1, 0, 1), "a side is longer than 1000000 pixels"),
    "header.webp": (lambda: webp_header(14_000, 14_000), "more than 66 megapixels"),
    "small-header.webp": (lambda: webp_header(8_000, 8_000), "damaged file"),
    "whole.webp": (lambda: blank(6_000, 6_000, "RGB", "WEBP", lossless=True), "3000 3000"),
    "strip.tif": (lambda: tiff(14_000, 14_000, 4, 16, bytes(200), 8, extra=(2,)), "more than 66 megapixels"),
    "small-strip.tif": (lambda: tiff(8_000, 8_000, 4, 16, bytes(200), 8, extra=(2,)), "damaged file"),
    "progressive.jpg": (lambda: blank(8_000, 8_000, "RGB", "JPEG", progressive=True, quality=5), "2000 2000"),
}


def read_apart(path, address_space=None):
    """What a process of its own reads, and the memory that it took."""

    def limited():
        resource.setrlimit(resource.RLIMIT_AS, (address_space, address_space))

    before = limited if address_space else None
    command = [sys.executable, "-c", READER, str(path)]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=SECONDS, preexec_fn=before, check=True
    )
    assert done.stderr == ""
    said, memory = done.stdout.splitlines()
    return said, float(memory)


@pytest.mark.parametrize("name", BOMBS)
def test_bombs_take_less_than_promised(name, tmp_path):
    made, expected = BOMBS[name]
    (tmp_path / name).write_bytes(made())
    said, memory = read_apart(tmp_path / name)
    assert expected in said
    assert memory < MEMORY


def test_too_little_memory_is_one_line(tmp_path):
    (tmp_path / "grey.png").write_bytes(blank_png(14_000, 14_000, 8, 0, 1))
    said, _ = read_apart(tmp_path / "grey.png", 300_000_000)
    assert said == f"{tmp_path / 'grey.png'}: its pixels do not fit in memory; shrink it first"


def noise(channels, dtype=np.uint8, height=1000, width=1300):
    values = np.random.default_rng(0).integers(0, np.iinfo(dtype).max, (height, width, channels), dtype)
    return values[..., 0] if channels == 1 else values


def means(pixels, factor):
    """Of blocks, premultiplied where there is alpha; the last ones smaller."""
    alpha = pixels[..., 3:] if pixels.shape[2] == 4 else np.ones_like(pixels[..., :1])
    sums = [
        np.add.reduceat(np.add.reduceat(a, range(0, len(a), factor), 0), range(0, a.shape[1], factor), 1)
        for a in (pixels[..., :3] * alpha, alpha, np.ones_like(alpha))
    ]
    colour = sums[0] / np.maximum(sums[1], 1e-9)
    return colour if pixels.shape[2] == 3 else np.concatenate([colour, sums[1] / sums[2]], axis=2)


PALETTED = Image.fromarray(noise(3)).quantize(16, method=Image.Quantize.FASTOCTREE)
LARGE = {
    "grey": Image.fromarray(noise(1)),
    "grey and alpha": Image.fromarray(noise(2), "LA"),
    "colour": Image.fromarray(noise(3)),
    "colour and alpha": Image.fromarray(noise(4)),
    "palette": PALETTED,
    "16 bits": Image.fromarray(noise(1, np.uint16)),
    "floats": Image.fromarray((noise(1) / np.float32(255)).astype(np.float32)),
}


@pytest.mark.parametrize("name", LARGE)
def test_large_pictures_are_read_as_means_of_blocks(name, monkeypatch):
    data = saved(LARGE[name], "TIFF" if name == "floats" else "PNG")
    whole = load(data)
    assert whole.notes == ()
    monkeypatch.setenv(FITTED.variable, "1")
    monkeypatch.setattr(image, "_STRIP", 100_000)
    small = load(data)
    (note,) = small.notes
    assert note.startswith(
        "picture: 1300 × 1000 pixels are read as 650 × 500: at most 1 megapixels (SDF2VEC_FIT_"
    )
    tolerance = 0.6 / 255 if whole.pixels.shape[2] == 3 else 3 / 255
    difference = np.abs(small.pixels - means(whole.pixels.astype(float), 2))
    assert np.quantile(difference, 0.99) <= tolerance


def test_transparent_colours_of_large_palettes(monkeypatch):
    data = saved(PALETTED, "PNG", transparency=bytes([0, 100, 255, 255] * 4))
    whole = load(data)
    monkeypatch.setenv(FITTED.variable, "1")
    assert np.abs(load(data).pixels[..., 3] - means(whole.pixels.astype(float), 2)[..., 3]).max() < 1 / 255


def test_large_pictures_are_turned_upright(monkeypatch):
    monkeypatch.setenv(FITTED.variable, "1")
    turned = Image.fromarray(corners(1400, 1000))
    exif = Image.Exif()
    exif[0x0112] = 6
    picture = load(saved(turned, "PNG", exif=exif))
    assert (picture.width, picture.height) == (500, 700)
    assert np.allclose(picture.pixels[10, 10] * 255, (20, 20, 250))  # what lay at the lower left


class Endless:
    name = "endless"

    def read(self, count):
        return b"\0" * count


def test_streams_that_do_not_end(tmp_path, monkeypatch):
    monkeypatch.setenv("SDF2VEC_MAX_MEGABYTES", "3")
    line = "more than 3 MB; shrink it first, or raise the limit: SDF2VEC_MAX_MEGABYTES=6"
    assert refusal(Endless()) == f"endless: {line}"
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)

    def fill():
        with open(pipe, "wb") as stream, pytest.raises(BrokenPipeError):
            stream.write(bytes(10**7))

    writer = threading.Thread(target=fill)
    writer.start()
    assert refusal(pipe) == f"{pipe}: {line}"
    writer.join()
    with open(tmp_path / "sparse.webp", "wb") as stream:
        stream.truncate(10**12)
    assert refusal(tmp_path / "sparse.webp").endswith(line)


def test_limits_can_be_raised_and_lowered(monkeypatch):
    data = png(3000, 1000, 1, 0, b"")
    monkeypatch.setenv("SDF2VEC_MAX_MEGAPIXELS", "1")
    refused = refusal(data)
    assert refused.endswith(
        "more than 1 megapixels; shrink it first, or raise the limit: SDF2VEC_MAX_MEGAPIXELS=3"
    )
    monkeypatch.setenv("SDF2VEC_MAX_MEGAPIXELS", "3")
    assert "truncated" in refusal(data)


@pytest.mark.parametrize("text", ["0", "-1", "²", "1.5", "many", "9" * 30, "1000000001"])
def test_limits_that_are_no_number_are_refused(text, monkeypatch):
    monkeypatch.setenv("SDF2VEC_MAX_MEGAPIXELS", text)
    assert "SDF2VEC_MAX_MEGAPIXELS: a whole number from 1 to" in refusal(encode_png(np.ones((2, 2, 3))))
    with pytest.raises(Sdf2vecError):
        whole_number("SDF2VEC_MAX_MEGAPIXELS", 1)


# --------------------------------------------------------------------------------------------- odd pictures


def test_tiff_samples_of_an_unknown_kind_are_left_out_or_named():
    pixels = corners(6, 4)
    with_extra = np.concatenate([pixels, np.full((4, 6, 1), 77, np.uint8)], axis=2).tobytes()
    picture = load(tiff(6, 4, 4, 8, with_extra, 1, extra=(1000,)))
    assert np.allclose(picture.pixels * 255, pixels)
    grey = np.arange(48, dtype=np.uint8).reshape(4, 6, 2)
    picture = load(tiff(6, 4, 2, 8, grey.tobytes(), 1, extra=(999,)))
    assert np.allclose(picture.pixels[..., 1] * 255, grey[..., 0])
    assert "ExtraSamples" in refusal(tiff(6, 4, 4, 8, zlib.compress(with_extra), 8, extra=(1000,)))


def test_palettes_with_too_many_alphas():
    alphas = bytes([128, 255]) * 200
    data = png(2, 1, 8, 3, b"\0\0\1", chunk(b"PLTE", bytes([10, 20, 30, 40, 50, 60])), chunk(b"tRNS", alphas))
    assert np.allclose(load(data).pixels[0] * 255, [[10, 20, 30, 128], [40, 50, 60, 255]])


def pages(count):
    """A TIFF of one pixel a page."""
    first = tiff(1, 1, 1, 8, b"\7", 1)
    size = len(first) - 8
    directory = first[8:]
    data = b"II*\0" + pack("<I", 8)
    for index in range(count):
        start = 8 + index * size
        page = bytearray(directory)
        after = 2 + 12 * 9
        page[after : after + 4] = pack("<I", start + size if index + 1 < count else 0)
        where = 2 + 12 * 5 + 8
        page[where : where + 4] = pack("<I", start + size - 1)
        data += bytes(page)
    return data


def test_pages_of_a_tiff_are_counted_to_a_bound():
    assert load(pages(1)).notes == ()
    assert load(pages(3)).notes == ("picture: 3 frames, first one used",)
    assert load(pages(1000)).notes == ("picture: 1000 frames, first one used",)
    assert load(pages(1500)).notes == ("picture: more than 1000 frames, first one used",)


def test_what_pillow_logs_is_not_printed(tmp_path):
    path = tmp_path / "samples.tif"
    path.write_bytes(tiff(2, 2, 42, 8, bytes(168), 1))
    said, _ = read_apart(path)  # which wants nothing on standard error
    assert "cannot be read" in said


def test_what_libtiff_prints_is_said_in_the_line(tmp_path, capfd):
    data = bytearray(
        saved(Image.fromarray(noise(1, height=64, width=64)).convert("1"), "TIFF", compression="group4")
    )
    data[60:120] = bytes(range(60))
    path = tmp_path / "fax.tif"
    path.write_bytes(bytes(data))
    message = refusal(path)
    assert message.startswith(f"{path}: damaged file (")
    assert capfd.readouterr().err == ""


def test_renders_above_the_limit_are_refused(monkeypatch):
    monkeypatch.setenv("SDF2VEC_MAX_MEGAPIXELS", "1")
    with pytest.raises(Sdf2vecError, match="SDF2VEC_MAX_MEGAPIXELS=4"):
        EXPORTERS["png"].write(Scene(10, 10, ()), Options(size=2000))
