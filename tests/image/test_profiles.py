"""Colour profiles, written by hand: converted to sRGB, or said not to be."""

import struct

import numpy as np
import pytest
from PIL import Image, ImageCms

from sdf2vec.image import load
from tests.image.files import corners, levels, saved


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
