"""Pictures in and out. File formats, orientation, colour, alpha and pixel centres are settled here only.

Everywhere else a picture is a float array [H, W, 3] (opaque) or [H, W, 4] (straight alpha) of sRGB-coded
values 0..1, upright, row 0 at the top. Pixel (row, column) has its centre at (column + 0.5, row + 0.5).
"""

from __future__ import annotations

import functools
import io
import os
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray
from PIL import ExifTags, Image, ImageChops, ImageCms, PngImagePlugin

from sdf2vec.errors import Sdf2vecError
from sdf2vec.files import one_line

from .arrays import Float32Array
from .decoding import (
    check_file,
    check_size,
    decode,
    frame_notes,
    opened_image,
    quiet_pillow,
    read_all,
    shrinking,
)
from .limits import CANVAS_SIDE, FITTED

_FULL_SCALE = {"bool": 1, "uint8": 255, "uint16": 65535}
_RANGE_SLACK = 0.01  # resampling overshoots 0..1 by a little; more than this is another scale

_COLOUR_MODES = {"1": "L", "L": "L", "LA": "L", "CMYK": "CMYK", "I": "I", "F": "F"}  # any other mode: RGB
_STRAIGHT_MODES = {"La": "LA", "RGBa": "RGBA"}  # Pillow's premultiplied modes
_STRIP = 1 << 24  # pixels that are reduced at a time
_TURNS = {
    2: Image.Transpose.FLIP_LEFT_RIGHT,
    3: Image.Transpose.ROTATE_180,
    4: Image.Transpose.FLIP_TOP_BOTTOM,
    5: Image.Transpose.TRANSPOSE,
    6: Image.Transpose.ROTATE_270,
    7: Image.Transpose.TRANSVERSE,
    8: Image.Transpose.ROTATE_90,
}  # by EXIF's orientation
_CHANNELS = {1: [0, 0, 0], 2: [0, 0, 0, 1], 3: [0, 1, 2], 4: [0, 1, 2, 3]}  # grey, grey + alpha, RGB, RGBA


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture ready to be fitted, with what a user should know about how it was read."""

    pixels: Float32Array  # [H, W, 3] opaque or [H, W, 4] straight alpha; sRGB-coded, 0..1
    notes: tuple[str, ...] = ()

    @property
    def width(self) -> int:
        """Pixels across."""
        return int(self.pixels.shape[1])

    @property
    def height(self) -> int:
        """Pixels down."""
        return int(self.pixels.shape[0])

    @property
    def has_alpha(self) -> bool:
        """Whether any pixel is less than fully opaque."""
        return bool(self.pixels.shape[2] == 4)

    @property
    def premultiplied(self) -> Float32Array:
        """Its pixels [H, W, 3], or with alpha [H, W, 4], premultiplied."""
        return premultiply(self.pixels) if self.has_alpha else self.pixels


@functools.singledispatch
def load(source: Any) -> Picture:
    """Read a picture from a path, bytes, a binary file, a Pillow image or a numpy array; a Picture stays what it is.

    Files: PNG, JPEG, WebP, AVIF, TIFF, GIF, BMP, of any colour model and depth that Pillow reads. The first
    frame counts, EXIF orientation is applied, an embedded ICC profile is converted to sRGB (8 bits a channel;
    relative colorimetric, black point compensated), and an alpha channel that is opaque all over is dropped.

    Arrays: [H, W], [H, W, 1] grey, [H, W, 2] grey and straight alpha, [H, W, 3] RGB, [H, W, 4] straight RGBA;
    bool, uint8, uint16, or floats 0..1. The array is copied.

    A file of more than `limits.FITTED` pixels is read at a half, a third and so on of its size. Raises
    Sdf2vecError for anything that is no such picture, and for more than `limits.PIXELS` pixels.
    """
    name = one_line(str(getattr(source, "name", "picture")))
    try:
        stream = read_all(source, name)
    except AttributeError as error:
        raise Sdf2vecError(
            f"cannot read a picture from {type(source).__name__}; "
            "give a path, bytes, a binary file, a Pillow image or a numpy array"
        ) from error
    except (TypeError, UnicodeDecodeError) as error:
        raise Sdf2vecError(f"{name}: gives text, not bytes; open it in binary mode") from error
    except OSError as error:
        raise Sdf2vecError(f"{name}: cannot be read ({error.strerror or error})") from error
    return _load_stream(stream, name)


@load.register(Picture)
def _(source: Picture) -> Picture:
    return source


@load.register(bytes)
@load.register(bytearray)
@load.register(memoryview)
def _(source: bytes | bytearray | memoryview) -> Picture:
    return _load_stream(io.BytesIO(source), "picture")


@load.register(str)
@load.register(os.PathLike)
def _(source: str | os.PathLike[str]) -> Picture:
    path = os.fsdecode(source)
    name = one_line(path)
    with _opened_file(path, name) as stream:
        check_file(stream, name)
        # A pipe cannot be wound back, which naming what is wrong with it needs.
        return _load_stream(stream if stream.seekable() else read_all(stream, name), name)


@load.register(Image.Image)
def _(source: Image.Image) -> Picture:
    name = one_line(os.path.basename(getattr(source, "filename", "")) or "picture")
    with quiet_pillow():
        return _picture(_parts(source, name), name)


@load.register(np.ndarray)
def _(source: NDArray[Any]) -> Picture:
    values = source[..., np.newaxis] if source.ndim == 2 else source
    if values.ndim != 3 or values.shape[2] not in _CHANNELS:
        shape = " × ".join(map(str, source.shape))
        raise Sdf2vecError(f"array: shape {shape}; a picture is [H, W] or [H, W, C] with C = 1, 2, 3 or 4")
    check_size(values.shape[1], values.shape[0], "array")
    return Picture(_without_opaque_alpha(_unit(values, "array")[..., _CHANNELS[values.shape[2]]]))


def _opened_file(path: str, name: str) -> BinaryIO:
    try:
        return open(path, "rb")
    except FileNotFoundError as error:
        raise Sdf2vecError(f"{name}: no such file") from error
    except IsADirectoryError as error:
        raise Sdf2vecError(f"{name}: is a folder, not a picture") from error
    except PermissionError as error:
        raise Sdf2vecError(f"{name}: no permission to read it") from error
    except (OSError, ValueError) as error:  # ValueError: a NUL character in the path
        raise Sdf2vecError(f"{name}: cannot be read ({getattr(error, 'strerror', None) or error})") from error


def _load_stream(stream: BinaryIO, name: str) -> Picture:
    try:
        with quiet_pillow():
            with closing(opened_image(stream, name)) as image:  # closed, so that its pixels are let go of
                parts = _parts(image, name)
            return _picture(parts, name)
    except MemoryError as error:
        raise Sdf2vecError(f"{name}: its pixels do not fit in memory; shrink it first") from error


@dataclass(frozen=True, eq=False)
class _Parts:
    """A decoded picture, upright and small enough."""

    colour: Image.Image  # mode L, I;16, I, F, RGB, CMYK
    alpha: Image.Image | None  # mode L
    profile: bytes | None
    notes: tuple[str, ...]


def _parts(image: Image.Image, name: str) -> _Parts:
    width, height = image.size
    decode(image, name)
    try:
        factor = shrinking(*image.size)
        colour, alpha = _split_alpha(image) if factor == 1 else _reduced(image, factor)
        turned = _turn(image)
        small = () if colour.size == (width, height) else (_shrunk_note(width, height, colour),)
        if turned is not None:
            colour, alpha = colour.transpose(turned), alpha.transpose(turned) if alpha else None
        return _Parts(colour, alpha, image.info.get("icc_profile"), (*frame_notes(image), *small))
    except (ValueError, OSError, KeyError, IndexError, SystemError) as error:  # a damaged palette, say
        raise Sdf2vecError(
            f"{name}: damaged file ({one_line(str(error))}); re-save or re-download it"
        ) from error


def _shrunk_note(width: int, height: int, colour: Image.Image) -> str:
    limits = f"at most {FITTED.number} megapixels ({FITTED.variable}) and {CANVAS_SIDE} a side"
    return f"{width} × {height} pixels are read as {colour.width} × {colour.height}: {limits}"


def _picture(parts: _Parts, name: str) -> Picture:
    colour, colour_notes = _in_srgb(parts.colour, parts.profile)
    values, scale_notes = _samples(colour, name)
    pixels = _unit(values, name)[..., _CHANNELS[values.shape[2]]]
    if parts.alpha is not None:
        pixels = np.concatenate([pixels, np.asarray(parts.alpha, np.float32)[..., np.newaxis] / 255], axis=2)
    notes = (*parts.notes, *colour_notes, *scale_notes)
    return Picture(_without_opaque_alpha(pixels), tuple(f"{name}: {note}" for note in notes))


def _turn(image: Image.Image) -> Image.Transpose | None:
    """What makes a picture upright."""
    try:
        return _TURNS.get(image.getexif().get(ExifTags.Base.Orientation, 1))
    except Exception:  # damaged EXIF data says nothing about the pixels
        return None


def _reduced(image: Image.Image, factor: int) -> tuple[Image.Image, Image.Image | None]:
    """What `_split_alpha` gives, each pixel the mean of so many across and down; made strip by strip."""
    width, height = image.size
    size = -(-width // factor), -(-height // factor)
    rows = factor * max(1, _STRIP // (width * factor))
    whole: list[Image.Image] = []
    for top in range(0, height, rows):
        strip = image.crop((0, top, width, min(top + rows, height)))
        parts = [part for part in _reduced_strip(*_split_alpha(strip), factor) if part is not None]
        whole = whole or [Image.new(part.mode, size) for part in parts]
        for into, part in zip(whole, parts, strict=True):
            into.paste(part, (0, top // factor))
    return whole[0], whole[1] if len(whole) == 2 else None


def _reduced_strip(
    colour: Image.Image, alpha: Image.Image | None, factor: int
) -> tuple[Image.Image, Image.Image | None]:
    if colour.mode.startswith("I;16"):  # which Pillow does not reduce
        wide = Image.fromarray(np.asarray(colour).astype(np.int32)).reduce(factor)
        colour = Image.fromarray(np.asarray(wide).astype(np.uint16))
        return colour, alpha and alpha.reduce(factor)
    if alpha is None:
        return colour.reduce(factor), None
    colour.putalpha(alpha)
    both = colour.reduce(factor)  # premultiplied meanwhile
    return both.convert(both.mode[:-1]), both.getchannel("A")


def _split_alpha(image: Image.Image) -> tuple[Image.Image, Image.Image | None]:
    """Colour in one of the modes L, I;16, I, F, RGB, CMYK, and alpha in mode L where there is any; both new."""
    if image.mode.startswith("I;16"):
        return image.copy(), _keyed_alpha(image)
    image = _with_whole_palette(image)
    image = image.convert(_STRAIGHT_MODES.get(image.mode, image.mode))
    mode = _COLOUR_MODES.get(image.mode, "RGB")
    if mode not in ("L", "RGB") or not image.has_transparency_data:
        return image.convert(mode), None
    with_alpha = _with_eight_bit_key(image).convert(mode + "A")
    return with_alpha.convert(mode), with_alpha.getchannel("A")


def _with_whole_palette(image: Image.Image) -> Image.Image:
    """A palette has 256 colours at most; a PNG may give more alphas, which Pillow does not take."""
    alphas = image.info.get("transparency")
    if image.mode == "P" and isinstance(alphas, bytes) and len(alphas) > 256:
        image.info["transparency"] = alphas[:256]
    return image


def _keyed_alpha(image: Image.Image) -> Image.Image | None:
    """Alpha of a 16-bit grey PNG with one transparent level, which Pillow's conversions leave out."""
    key = image.info.get("transparency")
    if key is None:
        return None
    return Image.fromarray(np.where(np.asarray(image) == key, 0, 255).astype(np.uint8))


def _with_eight_bit_key(image: Image.Image) -> Image.Image:
    """Pillow cuts 16-bit RGB to its high bytes and leaves the transparent colour at 16 bits: cut it too."""
    if image.mode != "RGB" or max(image.info["transparency"]) <= 255:
        return image
    image = image.copy()
    image.info["transparency"] = tuple(level >> 8 for level in image.info["transparency"])
    return image


@functools.cache
def _srgb_profile() -> ImageCms.ImageCmsProfile:
    return ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB"))


def _in_srgb(colour: Image.Image, profile_bytes: bytes | None) -> tuple[Image.Image, tuple[str, ...]]:
    """`colour` converted from its embedded ICC profile to sRGB, and remarks about that."""
    if not profile_bytes:
        return colour, ("CMYK without a colour profile, colours are approximate",) * (colour.mode == "CMYK")
    try:
        profile = ImageCms.ImageCmsProfile(io.BytesIO(profile_bytes))
        description = one_line(ImageCms.getProfileDescription(profile).strip())
        converted = _converted(colour, profile)
    except (ImageCms.PyCMSError, ImportError, OSError, TypeError, ValueError):
        return colour, ("embedded colour profile cannot be used, colours taken as sRGB",)
    if colour.mode in ("L", "RGB") and _largest_difference(colour.convert("RGB"), converted) <= 1:
        return colour, ()  # an sRGB profile: its round trip would only add rounding
    return converted, (f"converted from its colour profile ({description}) to sRGB",)


def _converted(colour: Image.Image, profile: ImageCms.ImageCmsProfile) -> Image.Image:
    for_rgb = profile.profile.xcolor_space.strip() == "RGB"  # on grey files too, though it should not be
    source = colour.convert("RGB") if for_rgb and colour.mode == "L" else colour
    transform = ImageCms.buildTransform(
        profile,
        _srgb_profile(),
        source.mode,
        "RGB",
        ImageCms.Intent.RELATIVE_COLORIMETRIC,
        ImageCms.Flags.BLACKPOINTCOMPENSATION,
    )
    converted = ImageCms.applyTransform(source, transform)
    assert converted is not None  # it is None only for a transform in place
    return converted


def _largest_difference(a: Image.Image, b: Image.Image) -> int:
    """Over all bands, in 8-bit levels; both RGB."""
    return int(np.asarray(ImageChops.difference(a, b)).max())


def _samples(colour: Image.Image, name: str) -> tuple[NDArray[Any], tuple[str, ...]]:
    """[H, W, 1 or 3] in a scale that `_unit` knows; Pillow leaves that of its 32-bit modes open."""
    values = np.asarray(colour.convert("RGB") if colour.mode == "CMYK" else colour)
    notes: tuple[str, ...] = ()
    if colour.mode == "I":
        values = _as_sixteen_bits(values, name)
    elif colour.mode == "F" and 1 + _RANGE_SLACK < values.max() <= 255:
        values, notes = values / 255, ("floats above 1, read as 0..255",)
    return values.reshape(*values.shape[:2], -1), notes


def _as_sixteen_bits(values: NDArray[Any], name: str) -> NDArray[np.uint16]:
    if values.min() < 0 or values.max() > 65535:
        raise Sdf2vecError(f"{name}: 32-bit integer samples; save it with 8 or 16 bits a channel")
    return values.astype(np.uint16)


def _unit(values: NDArray[Any], name: str) -> Float32Array:
    """A new array of the same shape, 0..1."""
    full_scale = _FULL_SCALE.get(values.dtype.name)
    if full_scale:
        unit = values.astype(np.float32)
        unit /= full_scale
        return unit
    if values.dtype.kind != "f":
        raise Sdf2vecError(f"{name}: {values.dtype} samples; use bool, uint8, uint16, or floats in 0..1")
    if not np.isfinite(values).all():
        raise Sdf2vecError(f"{name}: holds NaN or infinity; floats must lie in 0..1")
    low, high = values.min(), values.max()
    if low < -_RANGE_SLACK or high > 1 + _RANGE_SLACK:
        raise Sdf2vecError(f"{name}: values from {low:.6g} to {high:.6g}; floats must lie in 0..1")
    unit = values.astype(np.float32)
    return np.clip(unit, 0, 1, out=unit)


def _without_opaque_alpha(pixels: Float32Array) -> Float32Array:
    opaque = pixels.shape[2] == 4 and pixels[..., 3].min() >= 1
    return np.ascontiguousarray(pixels[..., :3] if opaque else pixels)


def premultiply(pixels: Float32Array) -> Float32Array:
    """Straight to premultiplied alpha: colour times alpha. [H, W, 4], a new array."""
    return np.concatenate([pixels[..., :3] * pixels[..., 3:], pixels[..., 3:]], axis=2)


def unpremultiply(pixels: Float32Array) -> Float32Array:
    """Premultiplied to straight alpha: colour over alpha, black where alpha is 0. [H, W, 4]; [H, W, 3] as it is."""
    if pixels.shape[2] == 3:
        return pixels
    alpha = pixels[..., 3:]
    colour = np.divide(pixels[..., :3], alpha, out=np.zeros_like(pixels[..., :3]), where=alpha > 0)
    return np.concatenate([colour, alpha], axis=2)


def resize(pixels: Float32Array, width: int, height: int) -> Float32Array:
    """Resample [H, W, 3 or 4] (straight, 0..1) to [height, width, 3 or 4], clipped to 0..1.

    Both pictures cover the same rectangle and pixel centres are at half-integers, so nothing shifts.
    Shrinking weighs all pixels that a new one covers (Pillow's HAMMING filter); enlarging is bicubic.
    Alpha is resampled premultiplied, so that colours of invisible pixels do not bleed.
    """
    has_alpha = pixels.shape[2] == 4
    source = premultiply(pixels) if has_alpha else pixels
    shrinks = width <= source.shape[1] and height <= source.shape[0]
    method = Image.Resampling.HAMMING if shrinks else Image.Resampling.BICUBIC
    planes = [_resized_plane(source[..., c], width, height, method) for c in range(source.shape[2])]
    result = np.clip(np.stack(planes, axis=2), 0, 1)
    # Bicubic overshoot may carry a colour past its alpha, hence the second clip.
    return np.clip(unpremultiply(result), 0, 1) if has_alpha else result


def _resized_plane(plane: Float32Array, width: int, height: int, method: Image.Resampling) -> Float32Array:
    image = Image.fromarray(np.ascontiguousarray(plane, np.float32))  # [H, W], Pillow's mode F
    return np.asarray(image.resize((width, height), method))


def fitted_size(width: int, height: int, shortest: int) -> tuple[int, int]:
    """(width, height) in pixels, of the same aspect but for rounding, with that shortest side. All >= 1."""
    side = min(width, height)
    return max(1, round(width * shortest / side)), max(1, round(height * shortest / side))


def encode_png(pixels: NDArray[np.floating[Any]]) -> bytes:
    """An 8-bit PNG of [H, W, 3] or straight [H, W, 4], sRGB-coded 0..1; clipped, rounded to nearest.

    Raises Sdf2vecError for NaN.
    """
    return encode(pixels, "PNG")


def encode(pixels: NDArray[np.floating[Any]], form: str, made_by: str = "") -> bytes:
    """The same in one of the formats PNG, JPEG (without alpha) and WEBP, whose metadata says what made it."""
    if np.isnan(pixels).any():
        raise Sdf2vecError("the picture to write holds NaN")
    levels = np.rint(np.clip(pixels, 0, 1) * 255).astype(np.uint8)
    stream = io.BytesIO()
    Image.fromarray(levels).save(stream, form, **_SAVED[form](made_by))
    return stream.getvalue()


def _png_text(made_by: str) -> dict[str, Any]:
    text = PngImagePlugin.PngInfo()
    if made_by:
        text.add_text("Software", made_by)
    return {"pnginfo": text}


def _exif(made_by: str) -> Image.Exif:
    exif = Image.Exif()
    if made_by:
        exif[ExifTags.Base.Software] = made_by
    return exif


_SAVED: dict[str, Callable[[str], dict[str, Any]]] = {
    "PNG": _png_text,
    "JPEG": lambda made_by: {"quality": 92, "subsampling": 0, "comment": made_by},
    "WEBP": lambda made_by: {"quality": 92, "method": 4, "exif": _exif(made_by)},
}
