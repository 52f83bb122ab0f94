"""Picture files made for tests, and what is read from them."""

import io
import struct
import zlib

import numpy as np
import pytest

from sdf2vec.errors import Sdf2vecError
from sdf2vec.image import load


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
