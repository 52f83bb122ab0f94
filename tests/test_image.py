"""Pictures in and out: known pixels through every format, colour model and orientation."""

import io
import os
import struct
import subprocess
import sys
import warnings
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst
from PIL import Image, ImageCms
from skimage.transform import resize as skimage_resize

from sdf2vec.errors import Sdf2vecError
from sdf2vec.image import encode_png, fitted_size, load, premultiply, resize, unpremultiply

# ----------------------------------------------------------------------------------------------- helpers


PILLOW_LIMIT = Image.MAX_IMAGE_PIXELS


@pytest.fixture(autouse=True)
def _no_warnings():
    """Recorded, not raised: `load` would take a raised one for damage and refuse the picture."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield
    assert [str(warning.message) for warning in caught] == []


def saved(image, file_format, **options):
    stream = io.BytesIO()
    image.save(stream, file_format, **options)
    return stream.getvalue()


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(width, height, depth, colour_type, rows, *chunks):
    """A PNG written out by hand. `rows`: each begins with its filter byte 0."""
    header = struct.pack(">IIBBBBB", width, height, depth, colour_type, 0, 0, 0)
    body = chunk(b"IHDR", header) + b"".join(chunks) + chunk(b"IDAT", zlib.compress(rows))
    return b"\x89PNG\r\n\x1a\n" + body + chunk(b"IEND", b"")


def levels(picture):
    return (picture.pixels * 255).tolist()


def refusal(source):
    with pytest.raises(Sdf2vecError) as caught:
        load(source)
    assert len(str(caught.value).splitlines()) == 1
    return str(caught.value)


def corners(width=48, height=32):
    """Four flat quarters of different colours, uint8 [height, width, 3]."""
    picture = np.zeros((height, width, 3), np.uint8)
    picture[: height // 2, : width // 2] = (250, 20, 20)
    picture[: height // 2, width // 2 :] = (20, 250, 20)
    picture[height // 2 :, : width // 2] = (20, 20, 250)
    picture[height // 2 :, width // 2 :] = (240, 240, 240)
    return picture


# ------------------------------------------------------------------------------------------------ sources


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


# ---------------------------------------------------------------------------------------- formats, colours


@pytest.mark.parametrize(
    ("file_format", "options", "tolerance"),
    [
        ("PNG", {}, 0),
        ("BMP", {}, 0),
        ("TIFF", {}, 0),
        ("TIFF", {"compression": "tiff_lzw"}, 0),
        ("WEBP", {"lossless": True}, 0),
        ("GIF", {}, 0),
        ("JPEG", {"quality": 98, "subsampling": 0}, 4),
        ("JPEG", {"quality": 98, "subsampling": 0, "progressive": True}, 4),
        ("AVIF", {"quality": 98, "subsampling": "4:4:4"}, 6),
    ],
)
def test_formats(file_format, options, tolerance):
    expected = corners()
    picture = load(saved(Image.fromarray(expected), file_format, **options))
    assert picture.pixels.shape == expected.shape
    assert np.abs(picture.pixels * 255 - expected).max() <= tolerance + 1e-4
    assert picture.notes == ()


def test_grey_palette_and_bilevel_pictures():
    grey = np.array([[0, 51, 255]], np.uint8)
    expected = [[[0, 0, 0], [51, 51, 51], [255, 255, 255]]]
    assert levels(load(saved(Image.fromarray(grey), "PNG"))) == expected
    palette = Image.fromarray(grey).convert("RGB").quantize(3)
    assert palette.mode == "P"
    assert levels(load(saved(palette, "PNG"))) == expected
    bilevel = png(3, 1, 1, 0, b"\0\x40")
    assert levels(load(bilevel)) == [[[0, 0, 0], [255, 255, 255], [0, 0, 0]]]


def test_alpha_is_kept_straight():
    rgba = np.array([[[200, 100, 50, 0], [200, 100, 50, 51], [1, 2, 3, 255]]], np.uint8)
    for file_format, options in [("PNG", {}), ("TIFF", {}), ("WEBP", {"lossless": True, "exact": True})]:
        picture = load(saved(Image.fromarray(rgba), file_format, **options))
        assert picture.has_alpha
        assert np.allclose(picture.pixels * 255, rgba)


def test_grey_with_alpha():
    picture = load(saved(Image.fromarray(rgba_grey := np.array([[[7, 0], [8, 128]]], np.uint8), "LA"), "PNG"))
    assert np.allclose(picture.pixels * 255, rgba_grey[..., [0, 0, 0, 1]])


def test_opaque_alpha_is_dropped():
    rgba = np.full((2, 2, 4), 255, np.uint8)
    assert not load(saved(Image.fromarray(rgba), "PNG")).has_alpha
    assert load(rgba).pixels.shape == (2, 2, 3)
    rgba[1, 1, 3] = 254
    assert load(rgba).has_alpha


def test_premultiplied_pillow_pictures_come_back_straight():
    straight = Image.new("RGBA", (1, 1), (200, 100, 50, 51))
    assert np.allclose(levels(load(straight.convert("RGBa"))), [[[200, 100, 50, 51]]], atol=5)
    grey = Image.new("LA", (1, 1), (200, 51))
    assert np.allclose(levels(load(grey.convert("La"))), [[[200, 200, 200, 51]]], atol=5)


PALETTE = chunk(b"PLTE", bytes([10, 20, 30, 40, 50, 60]))


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (
            png(2, 1, 8, 3, b"\0\0\1", PALETTE, chunk(b"tRNS", b"\x80\xff")),
            [[10, 20, 30, 128], [40, 50, 60, 255]],
        ),
        (png(2, 1, 8, 3, b"\0\0\1", PALETTE, chunk(b"tRNS", b"\0")), [[10, 20, 30, 0], [40, 50, 60, 255]]),
        (png(2, 1, 8, 0, b"\0\x40\x80", chunk(b"tRNS", b"\0\x80")), [[64, 64, 64, 255], [128, 128, 128, 0]]),
        (png(2, 1, 1, 0, b"\0\x40", chunk(b"tRNS", b"\0\1")), [[0, 0, 0, 255], [255, 255, 255, 0]]),
        (
            png(2, 1, 8, 2, b"\0\1\2\3\4\5\6", chunk(b"tRNS", struct.pack(">3H", 4, 5, 6))),
            [[1, 2, 3, 255], [4, 5, 6, 0]],
        ),
        (
            png(2, 1, 16, 2, b"\0\1\0\2\0\3\0\4\7\5\7\6\7", chunk(b"tRNS", b"\4\7\5\7\6\7")),
            [[1, 2, 3, 255], [4, 5, 6, 0]],
        ),
        (
            png(2, 1, 16, 0, b"\0\0\0\xff\xff", chunk(b"tRNS", b"\xff\xff")),
            [[0, 0, 0, 255], [255, 255, 255, 0]],
        ),
    ],
    ids=["palette", "short palette", "grey", "bilevel", "rgb", "rgb 16 bit", "grey 16 bit"],
)
def test_transparent_colours_of_a_png(data, expected):
    assert np.allclose(levels(load(data)), [expected], atol=1e-3)


def test_transparent_palette_entry_of_a_gif():
    image = Image.new("P", (2, 1))
    image.putpalette([10, 20, 30, 40, 50, 60])
    image.putpixel((1, 0), 1)
    picture = load(saved(image, "GIF", transparency=0))
    assert picture.pixels[0, :, 3].tolist() == [0, 1]
    assert np.allclose(picture.pixels[0, 1, :3] * 255, [40, 50, 60])


def test_sixteen_bit_grey_keeps_its_precision():
    values = np.array([[0, 1, 256, 40000, 65535]], np.uint16)
    expected = np.repeat(values[..., np.newaxis] / 65535, 3, axis=2)
    for data in (saved(Image.fromarray(values), "PNG"), saved(Image.fromarray(values), "TIFF")):
        assert np.allclose(load(data).pixels, expected, atol=1e-7)
    big_endian = Image.frombytes("I;16B", (5, 1), values.astype(">u2").tobytes())
    assert np.allclose(load(big_endian).pixels, expected, atol=1e-7)
    assert np.allclose(load(Image.fromarray(values.astype(np.int32))).pixels, expected, atol=1e-7)


@pytest.mark.parametrize(("colour_type", "channels"), [(2, 3), (4, 2), (6, 4)])
def test_sixteen_bit_colour(colour_type, channels):
    values = np.array([0xABCD, 0x1234, 0xFF00, 0x8001][:channels], ">u2")
    pixel = load(png(1, 1, 16, colour_type, b"\0" + values.tobytes())).pixels[0, 0]
    expected = values[[0, 0, 0, 1]] if channels == 2 else values
    assert np.allclose(pixel, expected / 65535, atol=1 / 255)


def test_float_pictures():
    values = np.array([[0, 0.25, 1]], np.float32)
    assert np.allclose(load(saved(Image.fromarray(values), "TIFF")).pixels[..., 1], values)
    wide = load(Image.fromarray(values * 255))
    assert np.allclose(wide.pixels[..., 1], values)
    assert wide.notes == ("picture: floats above 1, read as 0..255",)
    assert "0..1" in refusal(Image.fromarray(values * 1000))
    assert "NaN" in refusal(Image.fromarray(values * np.float32(np.nan)))


def test_integers_of_unknown_scale_are_refused():
    assert "32-bit integer samples" in refusal(Image.fromarray(np.array([[70000]], np.int32)))
    assert "32-bit integer samples" in refusal(Image.fromarray(np.array([[-1]], np.int32)))


@pytest.mark.parametrize("file_format", ["JPEG", "TIFF"])
def test_cmyk(file_format):
    pure = [(0, 0, 0, 0), (255, 255, 0, 0), (0, 0, 0, 255), (0, 255, 255, 0)]
    image = Image.new("CMYK", (64, 16))
    for i, ink in enumerate(pure):
        image.paste(ink, (16 * i, 0, 16 * i + 16, 16))
    picture = load(saved(image, file_format))
    expected = np.array([[255, 255, 255], [0, 0, 255], [0, 0, 0], [255, 0, 0]])
    assert np.abs(picture.pixels[8, 8::16] * 255 - expected).max() <= 3
    assert picture.notes == ("picture: CMYK without a colour profile, colours are approximate",)


@pytest.mark.parametrize("mode", ["YCbCr", "HSV", "RGBX"])
def test_other_colour_models(mode):
    image = Image.fromarray(corners()).convert(mode)
    assert np.abs(load(image).pixels * 255 - corners()).max() <= 3


def test_lab():
    # L* = 50 is 18.42 % of linear light, which sRGB codes as 119.
    assert np.allclose(levels(load(Image.new("LAB", (1, 1), (128, 128, 128)))), 119, atol=1)


def test_only_the_first_frame_counts_and_this_is_said(tmp_path):
    frames = [Image.new("RGB", (4, 4), colour) for colour in ((255, 0, 0), (0, 255, 0), (0, 0, 255))]
    for file_format, options in [("GIF", {}), ("TIFF", {}), ("PNG", {}), ("WEBP", {"lossless": True})]:
        path = tmp_path / f"photo.{file_format.lower()}"
        path.write_bytes(saved(frames[0], file_format, save_all=True, append_images=frames[1:], **options))
        picture = load(path)
        assert levels(picture)[0][0] == [255, 0, 0]
        assert picture.notes == (f"{path}: 3 frames, first one used",)


def test_a_jpeg_of_several_pictures_as_phones_write_it():
    frames = [Image.new("RGB", (8, 8), colour) for colour in ((255, 0, 0), (0, 255, 0))]
    picture = load(saved(frames[0], "MPO", save_all=True, append_images=frames[1:]))
    assert np.allclose(picture.pixels[0, 0], [1, 0, 0], atol=0.02)
    assert picture.notes == ("picture: 2 frames, first one used",)


def test_damage_in_a_later_frame_does_not_matter():
    noise = np.random.default_rng(0).integers(0, 255, (3, 40, 50, 3), np.uint8)
    frames = [Image.fromarray(frame) for frame in noise]
    data = saved(frames[0], "GIF", save_all=True, append_images=frames[1:])
    counted = {load(data[:end]).notes[0].split(",")[0] for end in range(len(data) * 2 // 3, len(data), 7)}
    assert counted <= {"picture: several frames", "picture: 2 frames", "picture: 3 frames"}
    assert "picture: several frames" in counted


# -------------------------------------------------------------------------------------------- orientation

# EXIF 2.32, 4.6.4.A: the side of the visible picture on which the stored row 0 and column 0 lie.
ORIENTATIONS = {
    1: ("top", "left"),
    2: ("top", "right"),
    3: ("bottom", "right"),
    4: ("bottom", "left"),
    5: ("left", "top"),
    6: ("right", "top"),
    7: ("right", "bottom"),
    8: ("left", "bottom"),
}


def as_stored(upright, orientation):
    row_0, column_0 = ORIENTATIONS[orientation]
    stored = upright.transpose(1, 0, 2) if row_0 in ("left", "right") else upright
    stored = stored[::-1] if row_0 in ("bottom", "right") else stored
    stored = stored[:, ::-1] if column_0 in ("bottom", "right") else stored
    return Image.fromarray(np.ascontiguousarray(stored))


@pytest.mark.parametrize("orientation", ORIENTATIONS)
@pytest.mark.parametrize("file_format", ["PNG", "JPEG", "WEBP", "TIFF", "AVIF"])
def test_exif_orientation(file_format, orientation):
    exif = Image.Exif()
    exif[0x0112] = orientation
    picture = load(saved(as_stored(corners(), orientation), file_format, exif=exif))
    assert picture.pixels.shape == (32, 48, 3)
    centres = np.s_[8::16, 12::24]
    assert np.abs(picture.pixels[centres] * 255 - corners()[centres]).max() <= 6


def test_exif_orientation_with_alpha_and_sixteen_bits():
    exif = Image.Exif()
    exif[0x0112] = 6
    rgba = np.dstack([corners(), np.full((32, 48), 128, np.uint8)])
    assert np.allclose(load(saved(as_stored(rgba, 6), "PNG", exif=exif)).pixels * 255, rgba)
    grey = np.array([[1, 2, 3], [4, 5, 60000]], np.uint16)
    stored = Image.fromarray(np.ascontiguousarray(np.rot90(grey)))  # row 0 is the visible right-hand side
    assert np.allclose(load(saved(stored, "PNG", exif=exif)).pixels[..., 0] * 65535, grey)


def test_damaged_exif_is_ignored():
    image = Image.fromarray(corners())
    for exif in (b"Exif\0\0", b"Exif\0\0MM\0\x2a\0\0\0\x08\xff\xff", b"Exif\0\0junk" * 9):
        assert load(saved(image, "WEBP", lossless=True, exif=exif)).pixels.shape == (32, 48, 3)
    exif_9 = Image.Exif()
    exif_9[0x0112] = 9
    assert np.allclose(load(saved(image, "PNG", exif=exif_9)).pixels * 255, corners())


# --------------------------------------------------------------------------------------------- ICC profiles


def icc_profile(colour_space, connection_space, tags):
    """An ICC version 2 profile (ICC.1:2001-04), written out by hand."""
    name = b"Made by hand\0"
    description = b"desc" + bytes(4) + struct.pack(">I", len(name)) + name + bytes(78)
    white = b"XYZ " + bytes(4) + fixed(0.9505, 1, 1.0891)  # D65, which is to become white all the same
    tags = {b"desc": description, b"wtpt": white, **tags}
    table, body = struct.pack(">I", len(tags)), b""
    for signature, data in tags.items():
        table += signature + struct.pack(">II", 132 + 12 * len(tags) + len(body), len(data))
        body += data + bytes(-len(data) % 4)
    header = bytes(8) + struct.pack(">I", 0x02400000) + b"scnr" + colour_space + connection_space
    header += struct.pack(">6H", 2024, 1, 1, 0, 0, 0) + b"acsp" + bytes(28) + fixed(0.9642, 1, 0.8249)
    whole = header.ljust(128, b"\0") + table + body
    return struct.pack(">I", len(whole)) + whole[4:]


def fixed(*numbers):
    return b"".join(struct.pack(">i", round(number * 65536)) for number in numbers)


LINEAR = b"curv" + bytes(8)
LINEAR_GREY = icc_profile(b"GRAY", b"XYZ ", {b"kTRC": LINEAR})
LINEAR_SRGB = icc_profile(  # the primaries of sRGB adapted to D50, without its transfer curve
    b"RGB ",
    b"XYZ ",
    {
        b"rXYZ": b"XYZ " + bytes(4) + fixed(0.43607, 0.22249, 0.01392),
        b"gXYZ": b"XYZ " + bytes(4) + fixed(0.38515, 0.71687, 0.09708),
        b"bXYZ": b"XYZ " + bytes(4) + fixed(0.14307, 0.06061, 0.71410),
        b"rTRC": LINEAR,
        b"gTRC": LINEAR,
        b"bTRC": LINEAR,
    },
)
RAMP = bytes(range(256))
BLACK_INK_ONLY = icc_profile(  # L* = 100 (1 - K), whatever the other inks
    b"CMYK",
    b"Lab ",
    {
        b"A2B0": b"mft1"
        + bytes(4)
        + bytes([4, 3, 2, 0])
        + fixed(1, 0, 0, 0, 1, 0, 0, 0, 1)
        + RAMP * 4
        + bytes([255, 128, 128, 0, 128, 128]) * 8
        + RAMP * 3
    },
)


def srgb_coded(linear):
    """IEC 61966-2-1, in 8-bit levels."""
    return 255 * np.where(
        linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055
    )


CONVERTED = ("picture: converted from its colour profile (Made by hand) to sRGB",)


def test_rgb_profile_is_converted():
    linear = corners()
    for file_format, options in [("PNG", {}), ("TIFF", {}), ("WEBP", {"lossless": True})]:
        picture = load(saved(Image.fromarray(linear), file_format, icc_profile=LINEAR_SRGB, **options))
        assert np.abs(picture.pixels * 255 - srgb_coded(linear / 255)).max() <= 2
        assert picture.notes == CONVERTED


def test_profile_leaves_alpha_alone():
    rgba = np.array([[[60, 60, 60, 7], [128, 128, 128, 99]]], np.uint8)
    picture = load(saved(Image.fromarray(rgba), "PNG", icc_profile=LINEAR_SRGB))
    assert np.allclose(picture.pixels[..., 3] * 255, rgba[..., 3])
    assert np.abs(picture.pixels[..., :3] * 255 - srgb_coded(rgba[..., :3] / 255)).max() <= 2


@pytest.mark.parametrize("mode", ["L", "LA", "I;16"])
def test_grey_profile_is_converted(mode):
    linear = np.array([[13, 64, 128, 255]], np.uint8)
    image = {
        "L": Image.fromarray(linear),
        "LA": Image.fromarray(np.dstack([linear, linear])),
        "I;16": Image.fromarray(linear.astype(np.uint16) * 257),
    }[mode]
    assert image.mode == mode
    picture = load(saved(image, "PNG", icc_profile=LINEAR_GREY))
    assert np.abs(picture.pixels[..., :3] * 255 - srgb_coded(linear / 255)[..., np.newaxis]).max() <= 2
    assert picture.notes == CONVERTED


def test_rgb_profile_on_a_grey_file_is_converted():
    linear = np.array([[13, 64, 128, 255]], np.uint8)
    picture = load(saved(Image.fromarray(linear), "JPEG", quality=100, icc_profile=LINEAR_SRGB))
    assert np.abs(picture.pixels[..., 0] * 255 - srgb_coded(linear / 255)).max() <= 4


def test_cmyk_profile_is_converted():
    image = Image.new("CMYK", (1, 1), (0, 0, 0, 127))
    picture = load(saved(image, "TIFF", icc_profile=BLACK_INK_ONLY))
    assert np.allclose(levels(picture), 119, atol=2)  # L* = 50; plain conversion gives 128
    assert picture.notes == CONVERTED


def test_an_srgb_profile_changes_nothing_and_is_not_mentioned():
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    noise = np.random.default_rng(0).integers(0, 255, (40, 50, 3), np.uint8)
    picture = load(saved(Image.fromarray(noise), "PNG", icc_profile=profile))
    assert np.allclose(picture.pixels * 255, noise, atol=1e-4)
    assert picture.notes == ()


@pytest.mark.parametrize("profile", [b"junk", LINEAR_SRGB[:200], LINEAR_GREY, BLACK_INK_ONLY])
def test_a_profile_that_cannot_be_used_is_mentioned(profile):
    picture = load(saved(Image.fromarray(corners()), "PNG", icc_profile=profile))
    assert np.allclose(picture.pixels * 255, corners(), atol=1e-4)
    assert picture.notes == ("picture: embedded colour profile cannot be used, colours taken as sRGB",)


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
    assert "megapixels" in refusal(png(2**31 - 1, 2**31 - 1, 8, 6, b""))
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


# --------------------------------------------------------------------------------------------- compositing


def test_premultiply_by_hand():
    straight = np.array([[[0.5, 1, 0.2, 0.5], [0.3, 0.6, 0.9, 0], [0.3, 0.6, 0.9, 1]]], np.float32)
    coded = np.array([[[0.25, 0.5, 0.1, 0.5], [0, 0, 0, 0], [0.3, 0.6, 0.9, 1]]], np.float32)
    assert np.allclose(premultiply(straight), coded)
    back = straight.copy()
    back[0, 1, :3] = 0
    assert np.allclose(unpremultiply(coded), back)


@given(npst.arrays(np.float32, (2, 3, 4), elements=st.floats(0.0078125, 1, width=32)))
def test_unpremultiply_undoes_premultiply(pixels):
    assert np.allclose(unpremultiply(premultiply(pixels)), pixels, atol=1e-6)


# ------------------------------------------------------------------------------------------------ resizing


def ramp(width, height):
    """Each pixel holds the position of its centre, as a fraction of width and height."""
    x, y = (np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height
    return np.stack(np.broadcast_arrays(x[None, :], y[:, None], 0.5), axis=2).astype(np.float32)


@pytest.mark.parametrize("size", [(60, 40), (30, 20), (37, 23), (20, 40), (90, 100), (240, 160), (90, 20)])
def test_resizing_shifts_nothing(size):
    result = resize(ramp(120, 80), *size)
    # The outermost pixels lack neighbours on one side.
    inside = np.s_[size[1] // 8 : -(size[1] // 8), size[0] // 8 : -(size[0] // 8)]
    assert result.shape == (size[1], size[0], 3)
    assert np.abs(result - ramp(*size))[inside].max() < 2e-3


def test_resizing_keeps_the_centre_of_mass():
    spot = np.zeros((64, 64, 3), np.float32)
    spot[20:24, 41:44] = 1
    result = resize(spot, 16, 16)[..., 0]
    y, x = (np.arange(16) + 0.5) / 16, (np.arange(16) + 0.5) / 16
    assert (result.sum(0) * x).sum() / result.sum() == pytest.approx(42.5 / 64, abs=5e-3)
    assert (result.sum(1) * y).sum() / result.sum() == pytest.approx(22 / 64, abs=5e-3)
    assert result.mean() == pytest.approx(12 / 64**2, rel=0.05)


@pytest.mark.parametrize("size", [(16, 12), (7, 11), (33, 50), (9, 40)])
def test_resizing_a_mirrored_picture_mirrors_the_result(size):
    pixels = np.random.default_rng(3).random((24, 21, 3)).astype(np.float32)
    result = resize(pixels, *size)
    assert np.allclose(resize(pixels[:, ::-1], *size), result[:, ::-1], atol=1e-6)
    assert np.allclose(resize(pixels[::-1], *size), result[::-1], atol=1e-6)


def test_shrinking_averages_and_does_not_alias():
    checks = np.indices((96, 96)).sum(0)[..., None].repeat(3, 2).astype(np.float32) % 2
    assert np.abs(resize(checks, 24, 24) - 0.5)[2:-2, 2:-2].max() < 1e-5
    assert np.abs(resize(checks, 19, 23) - 0.5)[2:-2, 2:-2].max() < 0.02


def test_shrinking_resembles_another_librarys_area_average():
    rng = np.random.default_rng(0)
    smooth = skimage_resize(rng.random((9, 12, 3)), (90, 120), order=3).clip(0, 1).astype(np.float32)
    blocks = smooth.reshape(30, 3, 40, 3, 3).mean((1, 3))
    assert np.abs(resize(smooth, 40, 30) - blocks).max() < 0.02


@given(st.integers(1, 40), st.integers(1, 40), st.integers(1, 40), st.integers(1, 40))
@settings(max_examples=50, deadline=None)
def test_flat_pictures_stay_flat(width, height, new_width, new_height):
    flat = np.full((height, width, 4), [0.2, 0.4, 1, 0.6], np.float32)
    assert np.allclose(resize(flat, new_width, new_height), flat[0, 0], atol=1e-5)


@pytest.mark.parametrize("size", [(4, 4), (40, 40)])
def test_colours_of_invisible_pixels_do_not_bleed(size):
    pixels = np.zeros((16, 16, 4), np.float32)
    pixels[:, :8] = (1, 0, 0, 1)
    pixels[:, 8:] = (0, 1, 0, 0)
    result = resize(pixels, *size)
    visible = result[..., 3] > 1e-3
    assert np.allclose(result[visible][:, :3], (1, 0, 0), atol=1e-3)
    assert result[..., 3].mean() == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize("size", [(5, 7), (37, 41)])
def test_resized_values_stay_in_range(channels, size):
    pixels = (np.random.default_rng(1).random((20, 20, channels)) > 0.5).astype(np.float32)
    result = resize(pixels, *size)
    assert result.dtype == np.float32
    assert 0 <= result.min() <= result.max() <= 1


def test_resizing_to_the_same_size_changes_nothing():
    pixels = np.random.default_rng(2).random((9, 7, 3)).astype(np.float32)
    assert np.array_equal(resize(pixels, 7, 9), pixels)


def test_fitted_size_by_hand():
    assert fitted_size(4000, 3000, 300) == (400, 300)
    assert fitted_size(3000, 4000, 300) == (300, 400)
    assert fitted_size(1, 500, 2) == (2, 1000)
    assert fitted_size(7, 5, 3) == (4, 3)


@given(st.integers(1, 10**5), st.integers(1, 10**5), st.integers(1, 10**4))
def test_fitted_size(width, height, shortest):
    new_width, new_height = fitted_size(width, height, shortest)
    assert min(new_width, new_height) == shortest
    assert abs(new_width - width * shortest / min(width, height)) <= 0.5
    assert abs(new_height - height * shortest / min(width, height)) <= 0.5


# ------------------------------------------------------------------------------------------------- writing


@given(npst.arrays(np.uint8, st.tuples(st.integers(1, 6), st.integers(1, 6), st.sampled_from([3, 4]))))
def test_png_round_trip(values):
    decoded = np.asarray(Image.open(io.BytesIO(encode_png(values / 255))))
    assert np.array_equal(decoded, values)
    assert np.array_equal(np.rint(load(encode_png(values / 255.0)).pixels[..., :3] * 255), values[..., :3])


def test_png_rounds_to_nearest_and_clips():
    values = np.array([[[0.4 / 255, 0.6 / 255, 100.49 / 255], [-3, 7, np.inf]]])
    assert np.asarray(Image.open(io.BytesIO(encode_png(values)))).tolist() == [[[0, 1, 100], [0, 255, 255]]]


def test_png_refuses_nan():
    with pytest.raises(Sdf2vecError, match="NaN"):
        encode_png(np.array([[[0, np.nan, 0]]]))


def test_pictures_load_without_torch():
    code = "import sys, sdf2vec.image; sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
