"""From bytes to a decoded Pillow image: what is no picture, damaged or too large is refused in one line."""

from __future__ import annotations

import io
import logging
import os
import stat
import tempfile
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import BinaryIO

from PIL import Image, TiffImagePlugin, UnidentifiedImageError

from .errors import Sdf2vecError
from .files import one_line
from .limits import BYTES, CANVAS_SIDE, FITTED, LONGEST_SIDE, PIXELS

# Pillow reads more formats than these, some by starting other programs (EPS), so the list is closed.
_FORMATS = ("PNG", "JPEG", "WEBP", "AVIF", "TIFF", "GIF", "BMP")
_READABLE = "PNG, JPEG, WebP, AVIF, TIFF, GIF, BMP"
_COPIES = {"WEBP": 3, "AVIF": 3, "TIFF": 3}  # of all pixels that a decoder holds at once
_PIECE = 1 << 20  # bytes read at a time
_COUNTED = 1000  # frames of a TIFF
_EXTRA_SAMPLES = 338  # the tag
_KNOWN_EXTRA_SAMPLES = (0, 1, 2)  # unspecified, premultiplied alpha, straight alpha

logging.getLogger("PIL").addHandler(logging.NullHandler())  # what it logs is in the exceptions, too

_pillow_lock = threading.RLock()


@contextmanager
def quiet_pillow() -> Iterator[None]:
    """Pillow without its warnings and its own size limit, in place of which `check_size` stands."""
    with _pillow_lock, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        limit = Image.MAX_IMAGE_PIXELS
        Image.MAX_IMAGE_PIXELS = None
        try:
            yield
        finally:
            Image.MAX_IMAGE_PIXELS = limit


def read_all(stream: BinaryIO, name: str) -> io.BytesIO:
    """All bytes of a stream, wound back. Raises Sdf2vecError where there are more than `limits.BYTES`."""
    held, most = io.BytesIO(), BYTES.most
    while piece := stream.read(_PIECE):
        held.write(piece)
        if held.tell() > most:
            raise _too_many_bytes(name)
    held.seek(0)
    return held


def check_file(stream: BinaryIO, name: str) -> None:
    """Raises Sdf2vecError for a file of more than `limits.BYTES`."""
    status = os.fstat(stream.fileno())
    if stat.S_ISREG(status.st_mode) and status.st_size > BYTES.most:
        raise _too_many_bytes(name)


def _too_many_bytes(name: str) -> Sdf2vecError:
    return Sdf2vecError(f"{name}: more than {BYTES.number} MB; shrink it first, {BYTES.advice()}")


def opened_image(stream: BinaryIO, name: str) -> Image.Image:
    """The picture with its header read. Pillow's parsers raise nearly every exception on damaged files."""
    try:
        return Image.open(stream, formats=_FORMATS)
    except MemoryError:
        raise
    except Exception as error:
        if isinstance(error, UnidentifiedImageError) and (image := _opened_tiff(stream)):
            return image
        raise Sdf2vecError(f"{name}: {_not_opened(stream)}") from error


class _LenientTiff(TiffImagePlugin.TiffImageFile):
    """A TIFF whose samples beyond colour are of a kind that nobody knows: they are left out."""

    def _setup(self) -> None:
        extra = self.tag_v2.get(_EXTRA_SAMPLES, ())
        self.tag_v2[_EXTRA_SAMPLES] = tuple(kind if kind in _KNOWN_EXTRA_SAMPLES else 0 for kind in extra)
        super()._setup()


def _opened_tiff(stream: BinaryIO) -> Image.Image | None:
    stream.seek(0)
    if not _is_of("TIFF", stream.read(16)):
        return None
    stream.seek(0)
    try:
        return _LenientTiff(stream)
    except Exception:  # damaged after all
        return None


def _is_of(file_format: str, start: bytes) -> bool:
    accepts = Image.OPEN[file_format][1]
    return accepts is not None and bool(accepts(start))


def _not_opened(stream: BinaryIO) -> str:
    stream.seek(0)
    start = stream.read(16)
    if not start:
        return "empty file (0 bytes); re-save or re-download it"
    if any(_is_of(file_format, start) for file_format in _FORMATS):
        return "truncated or damaged file (its header cannot be read); re-save or re-download it"
    return f"not a picture that can be read; give one of {_READABLE}"


def check_size(width: int, height: int, name: str, copies: int = 1) -> None:
    """Raises Sdf2vecError for no pixels, and for so many that decoding, at so many copies, would take too much."""
    if min(width, height) < 1:
        raise Sdf2vecError(f"{name}: has no pixels ({width} × {height})")
    if max(width, height) > LONGEST_SIDE:
        raise Sdf2vecError(
            f"{name}: {width} × {height}: a side is longer than {LONGEST_SIDE} pixels; cut it first"
        )
    if width * height * copies > PIXELS.most:
        limit = PIXELS.number // copies
        advice = PIXELS.advice(width * height * copies)
        raise Sdf2vecError(
            f"{name}: {width} × {height} is more than {limit} megapixels; shrink it first, {advice}"
        )


def decode(image: Image.Image, name: str) -> None:
    """Decodes the first frame, a JPEG of too many pixels at a half or less. Raises Sdf2vecError."""
    check_size(image.width, image.height, name, _COPIES.get(image.format or "", 1))
    factor = shrinking(image.width, image.height)
    if factor > 1:
        image.draft(None, (image.width // factor, image.height // factor))
    problem, error = "", None  # type: str, Exception | None
    with tempfile.TemporaryFile() as said:
        try:
            with _stderr_to(said, image.format == "TIFF"):
                image.load()
        except MemoryError:
            raise
        except Exception as caught:  # see `opened_image`
            problem, error = str(caught) or "its pixels cannot be read", caught
        said.seek(0)
        problem = said.readline(1000).decode(errors="replace").strip() or problem
    if problem:
        raise _damaged(name, problem) from error


def shrinking(width: int, height: int) -> int:
    """By which whole number a picture is to be divided so that it can be fitted."""
    factor, most = max(1, -(-max(width, height) // CANVAS_SIDE)), FITTED.most
    while -(-width // factor) * -(-height // factor) > most:
        factor += 1
    return factor


def _damaged(name: str, reason: str) -> Sdf2vecError:
    reason = one_line(reason)
    kind = "truncated" if "truncated" in reason.lower() else "damaged"
    return Sdf2vecError(f"{name}: {kind} file ({reason}); re-save or re-download it")


@contextmanager
def _stderr_to(stream: BinaryIO, wanted: bool) -> Iterator[None]:
    """What libtiff prints by itself (errors only, Pillow has turned its warnings off) goes to a file."""
    try:
        before = os.dup(2) if wanted else -1
    except OSError:  # standard error is closed
        before = -1
    if before < 0:
        yield
        return
    os.dup2(stream.fileno(), 2)
    try:
        yield
    finally:
        os.dup2(before, 2)
        os.close(before)


def frame_notes(image: Image.Image) -> tuple[str, ...]:
    """That there are several frames, of which the first is used; how many, where they are soon counted."""
    if not getattr(image, "is_animated", False):
        return ()
    try:
        count = _tiff_frames(image) if image.format == "TIFF" else str(getattr(image, "n_frames", 1))
    except Exception:  # counting reads later frames, which may be damaged where the first is not
        count = "several"
    return (f"{count} frames, first one used",)


def _tiff_frames(image: Image.Image) -> str:
    """Pillow's own counting takes the square of the number."""
    count = 1
    with suppress(EOFError):
        for count in range(1, _COUNTED + 1):
            image.seek(count)
        return f"more than {_COUNTED}"
    return str(count)
