"""Known pixels through every format, colour model and number of bits, turned by EXIF."""

import struct

import numpy as np
import pytest
from PIL import Image

from sdf2vec.image import load
from tests.image.files import chunk, corners, levels, png, refusal, saved


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
