"""Small files that claim, or hold, very many pixels."""

import io
import struct
import zlib

from PIL import Image

from tests.image.files import chunk


def blank_png(width, height, depth, colour_type, samples):
    """A whole PNG of zeros, compressed row by row."""
    row = bytes(1 + -(-width * samples * depth // 8))
    packer = zlib.compressobj(9)
    data = b"".join(packer.compress(row) for _ in range(height)) + packer.flush()
    header = struct.pack(">IIBBBBB", width, height, depth, colour_type, 0, 0, 0)
    palette = chunk(b"PLTE", bytes(6)) if colour_type == 3 else b""
    body = chunk(b"IHDR", header) + palette + chunk(b"IDAT", data) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + body


def webp_header(width, height):
    """A lossless WebP that ends after its size."""
    bits = (width - 1) | (height - 1) << 14
    data = b"VP8L" + struct.pack("<I", 9) + b"\x2f" + struct.pack("<I", bits) + bytes(4) + bytes(1)
    return b"RIFF" + struct.pack("<I", 4 + len(data)) + b"WEBP" + data


def tiff(width, height, samples, bits, data, compression, *, rows=None, extra=()):
    """A TIFF of one strip, or of what is in it."""
    count = samples
    values = struct.pack(f"<{count}H", *[bits] * count)
    tags = [
        (256, 4, 1, struct.pack("<I", width)),
        (257, 4, 1, struct.pack("<I", height)),
        (258, 3, count, values),
        (259, 3, 1, struct.pack("<HH", compression, 0)),
        (262, 3, 1, struct.pack("<HH", 2 if samples >= 3 else 1, 0)),
        (273, 4, 1, None),
        (277, 3, 1, struct.pack("<HH", samples, 0)),
        (278, 4, 1, struct.pack("<I", rows or height)),
        (279, 4, 1, struct.pack("<I", len(data))),
    ]
    if extra:
        tags.append((338, 3, len(extra), struct.pack(f"<{len(extra)}H", *extra)))
    offset = 8 + 2 + 12 * len(tags) + 4
    beyond, directory = b"", struct.pack("<H", len(tags))
    for tag, kind, number, value in tags:
        value = struct.pack("<I", 0) if value is None else value
        if len(value) > 4:
            value, beyond = struct.pack("<I", offset + len(beyond)), beyond + value
        directory += struct.pack("<HHI", tag, kind, number) + value.ljust(4, b"\0")
    place = offset + len(beyond)
    directory = directory.replace(struct.pack("<HHII", 273, 4, 1, 0), struct.pack("<HHII", 273, 4, 1, place))
    return b"II*\0" + struct.pack("<I", 8) + directory + bytes(4) + beyond + data


def blank(width, height, mode, file_format, **options):
    stream = io.BytesIO()
    Image.new(mode, (width, height)).save(stream, file_format, **options)
    return stream.getvalue()
