"""Where pictures come from: paths, bytes, pipes, arrays; and what is refused."""

import io
import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from sdf2vec.errors import Sdf2vecError
from sdf2vec.image import encode_png, fitted_size, load, resize
from tests.image.files import corners, png, refusal, saved

PILLOW_LIMIT = Image.MAX_IMAGE_PIXELS


def test_every_kind_of_source_gives_the_same_pixels(tmp_path):
    expected = corners()
    data = encode_png(expected / 255.0)
    path = tmp_path / "photo.png"
    path.write_bytes(data)
    lazy = Image.open(path)
    sources = [str(path), path, data, bytearray(data), memoryview(data), io.BytesIO(data), lazy, expected]
    for source in sources:
        picture = load(source)
        assert picture.pixels.dtype == np.float32
        assert np.array_equal(picture.pixels, np.float32(expected) / np.float32(255))
        assert (picture.width, picture.height, picture.has_alpha, picture.notes) == (48, 32, False, ())
    lazy.close()
    with path.open("rb") as stream:
        assert np.array_equal(load(stream).pixels, load(path).pixels)


def test_a_pipe_is_read_though_it_cannot_be_wound_back():
    reader, writer = os.pipe()
    with open(writer, "wb") as stream:
        stream.write(encode_png(np.ones((2, 3, 3))))
    with open(reader, "rb") as stream:
        assert load(stream).width == 3
    reader, writer = os.pipe()
    with open(writer, "wb") as stream:
        stream.write(encode_png(np.ones((2, 3, 3))))
    assert load(f"/dev/fd/{reader}").width == 3
    os.close(reader)
    reader, writer = os.pipe()
    os.write(writer, b"hello, this is text")
    os.close(writer)
    assert "not a picture that can be read" in refusal(f"/dev/fd/{reader}")
    os.close(reader)


def test_the_given_array_is_neither_changed_nor_shared():
    source = np.full((2, 2, 4), 0.5, np.float32)
    load(source).pixels[:] = 9
    assert (source == 0.5).all()


@pytest.mark.parametrize("size", [(1, 1), (1, 500), (500, 1), (4000, 3000)])
def test_sizes(size):
    picture = load(saved(Image.new("RGB", size, (255, 0, 51)), "PNG"))
    assert (picture.width, picture.height) == size
    assert np.allclose(picture.pixels[-1, -1], [1, 0, 0.2])
    smaller = resize(picture.pixels, *fitted_size(picture.width, picture.height, 1))
    assert np.allclose(smaller, [1, 0, 0.2], atol=1e-6)


# ------------------------------------------------------------------------------------------------- arrays


@pytest.mark.parametrize(
    ("array", "expected"),
    [
        (np.array([[51]], np.uint8), [0.2, 0.2, 0.2]),
        (np.array([[13107]], np.uint16), [0.2, 0.2, 0.2]),
        (np.array([[13107]], ">u2"), [0.2, 0.2, 0.2]),
        (np.array([[True]]), [1, 1, 1]),
        (np.array([[0.25]], np.float16), [0.25, 0.25, 0.25]),
        (np.array([[[0.25]]]), [0.25, 0.25, 0.25]),
        (np.array([[[0.25, 0.5]]]), [0.25, 0.25, 0.25, 0.5]),
        (np.array([[[0.1, 0.2, 0.3]]], ">f4"), [0.1, 0.2, 0.3]),
        (np.array([[[0.1, 0.2, 0.3, 0.4]]]), [0.1, 0.2, 0.3, 0.4]),
        (np.array([[[-1e-7, 1 + 1e-7, 0.3]]]), [0, 1, 0.3]),
    ],
)
def test_arrays(array, expected):
    picture = load(array)
    assert picture.pixels.shape == (1, 1, len(expected))
    assert np.allclose(picture.pixels[0, 0], expected, atol=1e-7)
    assert 0 <= picture.pixels.min() <= picture.pixels.max() <= 1


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (np.zeros((3, 8, 8)), "array: shape 3 × 8 × 8; a picture is [H, W]"),
        (np.zeros(5), "shape 5;"),
        (np.zeros((1, 2, 3, 4)), "shape 1 × 2 × 3 × 4;"),
        (np.zeros((0, 5, 3)), "array: has no pixels (5 × 0)"),
        (np.broadcast_to(np.uint8(0), (20_000, 20_000)), "array: 20000 × 20000 is more than 200 megapixels"),
        (np.array([[np.nan]]), "array: holds NaN"),
        (np.array([[np.inf]]), "array: holds NaN or infinity"),
        (np.array([[0.0, 255.0]]), "values from 0 to 255; floats must lie in 0..1"),
        (np.array([[-0.5]]), "values from -0.5 to -0.5"),
        (np.array([[1e300]]), "values from 1e+300"),
        (np.array([[1]]), "array: int64 samples; use"),
        (np.array([[1j]]), "array: complex128 samples"),
        (np.array([[None]]), "array: object samples"),
        (np.array([["a"]]), "array: <U1 samples"),
    ],
)
def test_arrays_that_are_no_picture_are_refused(array, message):
    assert message in refusal(array)


# ------------------------------------------------------------------------------------------------ refusals


def test_paths_that_cannot_be_read(tmp_path):
    missing = tmp_path / "photo.png"
    assert refusal(missing) == f"{missing}: no such file"
    assert refusal(tmp_path) == f"{tmp_path}: is a folder, not a picture"
    assert refusal("") == "'': no such file"
    assert "nul\\x00.png: cannot be read" in refusal("nul\0.png")
    assert "cannot be read" in refusal("x" * 5000)
    assert "two\\nlines.png: no such file" in refusal("two\nlines.png")


def test_no_permission(tmp_path, monkeypatch):
    path = tmp_path / "photo.png"
    path.write_bytes(encode_png(np.ones((1, 1, 3))))
    path.chmod(0)
    was_root = os.geteuid() == 0
    if was_root:
        monkeypatch.chdir(tmp_path)  # an ordinary user may not enter the folders above
        tmp_path.chmod(0o755)
        os.seteuid(65534)
    try:
        assert refusal("photo.png" if was_root else path).endswith("photo.png: no permission to read it")
    finally:
        if was_root:
            os.seteuid(0)


def test_things_that_are_no_source():
    assert "cannot read a picture from int" in refusal(3)
    assert "NoneType" in refusal(None)
    assert "open it in binary mode" in refusal(io.StringIO("text"))
    with open(__file__) as stream:
        assert "open it in binary mode" in refusal(stream)


def test_files_that_are_no_picture(tmp_path):
    path = tmp_path / "photo.png"
    for data in (b"hello, this is text", bytes(100), b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n"):
        path.write_bytes(data)
        assert refusal(path).startswith(f"{path}: not a picture that can be read; give one of PNG, JPEG")
    path.write_bytes(b"")
    assert refusal(path) == f"{path}: empty file (0 bytes); re-save or re-download it"


@pytest.mark.parametrize("file_format", ["PNG", "JPEG", "WEBP", "AVIF", "TIFF", "GIF", "BMP"])
def test_truncated_files_are_refused_wherever_they_are_cut(file_format, tmp_path):
    noise = np.random.default_rng(0).integers(0, 255, (40, 50, 3), np.uint8)
    data = saved(Image.fromarray(noise), file_format)
    path = tmp_path / "photo.jpg"
    for end in np.linspace(20, len(data) - 100, 12).astype(int):
        path.write_bytes(data[:end])
        message = refusal(path)
        assert message.startswith((f"{path}: truncated file (", f"{path}: truncated or damaged file ("))
        assert message.endswith("; re-save or re-download it")


def test_damaged_pixels_are_refused():
    data = bytearray(saved(Image.fromarray(corners()), "PNG"))
    data[60] ^= 0xFF
    assert "damaged file (" in refusal(bytes(data)) or "truncated file (" in refusal(bytes(data))


def test_absurd_sizes_are_refused_before_they_are_decoded():
    assert "30000 × 30000 is more than 200 megapixels" in refusal(png(30_000, 30_000, 8, 2, b""))
    assert "14143 × 14143 is more than 200 megapixels" in refusal(png(14_143, 14_143, 1, 0, b""))
    assert "truncated" in refusal(png(14_142, 14_142, 1, 0, b""))  # just small enough: it is tried
    assert "longer than 1000000 pixels" in refusal(png(2**31 - 1, 2**31 - 1, 8, 6, b""))
    assert Image.MAX_IMAGE_PIXELS == PILLOW_LIMIT
    assert PILLOW_LIMIT is not None


def test_pictures_without_pixels_are_refused():
    assert "has no pixels (0 × 5)" in refusal(Image.new("RGB", (0, 5)))
    assert "file" in refusal(png(0, 5, 8, 2, b""))


SEEDS = [
    saved(Image.fromarray(corners()), file_format)
    for file_format in ("PNG", "JPEG", "WEBP", "TIFF", "GIF", "BMP")
]


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(SEEDS), st.lists(st.tuples(st.floats(0, 0.999), st.integers(0, 255)), max_size=8))
def test_damaged_files_load_or_are_refused_in_one_line(data, changes):
    damaged = bytearray(data)
    for where, value in changes:
        damaged[int(where * len(damaged))] = value
    try:
        pixels = load(bytes(damaged)).pixels
    except Sdf2vecError:
        refusal(bytes(damaged))
    else:
        assert pixels.ndim == 3
        assert 0 <= pixels.min() <= pixels.max() <= 1
