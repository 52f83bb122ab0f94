"""Attacks: each takes a seed, and fails by anything but an Sdf2vecError of one line."""

import io
import random
import traceback
from typing import Any
from xml.etree import ElementTree

import numpy as np
from PIL import Image

import sdf2vec
from sdf2vec import Sdf2vecError
from sdf2vec.declared import checked
from sdf2vec.export import EXPORTERS
from sdf2vec.export.options import GLSL_VERSIONS, LAYOUTS, SVG_PROFILES, Options
from sdf2vec.fit.settings import Settings, settings_of
from sdf2vec.image import load
from sdf2vec.scene import MAX_JOINED
from tests.fuzz import domain
from tests.fuzz.fits import attack_fits
from tests.fuzz.kills import attack_kills

TARGETS = tuple(name for name in EXPORTERS if name != "pdf")  # whose drawing is that of the portable SVG
ODD = [
    "",
    "0",
    "-1",
    "1e400",
    "nan",
    "²",
    "\0",
    "\n",
    "🙂" * 50,
    -1,
    0,
    2**70,
    1e400,
    float("nan"),
    None,
    [],
    {},
    b"x",
]
FORMATS = {
    "PNG": [{}, {"optimize": True}],
    "JPEG": [{}, {"progressive": True}],
    "WEBP": [{}, {"lossless": True}],
    "TIFF": [{}, {"compression": "tiff_lzw"}],
    "GIF": [{}],
    "BMP": [{}],
}
MODES = ("1", "L", "LA", "P", "RGB", "RGBA", "CMYK", "I;16", "F")


def picture_file(r):
    """The bytes of a small picture of any kind; a new kind where a format does not take it."""
    while True:
        name = r.choice(list(FORMATS))
        values = np.random.default_rng(r.randrange(2**32)).integers(
            0, 256, (r.randint(1, 20), r.randint(1, 20), 3)
        )
        stream = io.BytesIO()
        mode = r.choice(MODES)
        options = {"compression": "group4"} if (name, mode) == ("TIFF", "1") else r.choice(FORMATS[name])
        try:
            Image.fromarray(values.astype(np.uint8)).convert(mode).save(stream, name, **options)
        except (OSError, ValueError, KeyError):
            continue
        return stream.getvalue()


def attack_pictures(seed):
    """A picture file with bytes changed, cut out or doubled."""
    r = random.Random(seed)
    data = bytearray(picture_file(r))
    for _ in range(r.choice([0, 1, 1, 2, 5, 20])):
        where = r.randrange(min(len(data), r.choice([64, 10**6])))
        how = r.random()
        if how < 0.7:
            data[where] = r.choice([0, 1, 127, 128, 255, r.randrange(256)])
        elif how < 0.85:
            del data[where : where + r.choice([1, 4, 100])]
        else:
            data[where:where] = data[where : where + r.choice([1, 4, 100])]
        if not data:
            return
    pixels = load(bytes(data)).pixels
    assert pixels.dtype == np.float32
    assert 0 <= pixels.min() <= pixels.max() <= 1


def attack_arrays(seed):
    """An array of any shape, type and values."""
    r = random.Random(seed)
    shape = [r.choice([0, 1, 2, 3, 4, 5, 17]) for _ in range(r.choice([0, 1, 2, 2, 3, 3, 3, 4]))]
    kind = r.choice(["bool", "u1", "u2", "i4", ">u2", "f2", "f4", ">f8", "c8", "O", "U3"])
    values = np.random.default_rng(seed).random(shape) * r.choice([1, 1, 1.005, 255, 1e30, -1])
    with np.errstate(all="ignore"):
        array = np.asarray(values).astype(kind)
    if array.size and kind.endswith(("f4", "f8")) and r.random() < 0.3:
        array.flat[0] = r.choice([np.nan, np.inf, -np.inf, -0.0])
    assert load(array).pixels.shape[2] in (3, 4)


def attack_scenes(seed):
    """A scene over the whole valid domain, through an export with any options."""
    r = random.Random(seed)
    target = r.choice(TARGETS)
    over = "over" if target in ("svg", "data-uri") else None  # an additive scene would be fitted again
    scene = domain.scene(seed, r.choice([1, 3, 6]), r.choice([2, 5]), over)
    assert sdf2vec.loads(sdf2vec.dumps(scene)) == scene
    options: dict[str, Any] = {
        "glsl": r.choice(list(GLSL_VERSIONS)),
        "layout": r.choice([LAYOUTS[0], *LAYOUTS]),
        "svg_profile": r.choice(SVG_PROFILES),
        "max_bytes": r.choice([None, None, 2000, 20_000]),
        "title": r.choice(["a", "</script>-->]]>*/\n\"'&\u202e\udc80"]),
        "size": r.choice([None, 1, 30]) if target == "png" else None,
        "alone": r.random() < 0.3,
    }
    if target == "png" and options["size"] is None and scene.width * scene.height > 10**6:
        options["size"] = 1
    if max(scene.extent) > 100 and target == "png":
        return
    data = sdf2vec.export(
        scene, target, **{name: value for name, value in options.items() if value is not None}
    )
    assert data
    if target == "svg":
        ElementTree.fromstring(data)
    if isinstance(data, str):
        assert "nan" not in data.lower().split()


LIMITS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("svg", {}),
    ("svg", {"svg_profile": "portable"}),
    ("svg", {"max_bytes": 20_000}),
    ("pdf", {}),
    ("html", {}),
    ("glsl", {}),
    ("wgsl", {}),
    ("shadertoy", {}),
    ("shadertoy", {"layout": "packed"}),
    ("shadertoy", {"max_bytes": 20_000}),
    ("sdf", {}),
)


def attack_unions(seed):
    """A scene of the longest unions there may be, through an export or a form of one."""
    target, options = LIMITS[seed % len(LIMITS)]
    assert sdf2vec.export(domain.scene(seed, 2, MAX_JOINED, "over"), target, **options)


def attack_options(seed):
    """Options of fits and exports with a value that may be anything."""
    r = random.Random(seed)
    if r.random() < 0.5:
        given: dict[str, Any] = {r.choice(Settings.__struct_fields__): r.choice(ODD)}
        settings_of(**given)
    else:
        checked(Options, {r.choice(Options.__struct_fields__): r.choice(ODD)})


ATTACKS = {
    "pictures": attack_pictures,
    "arrays": attack_arrays,
    "scenes": attack_scenes,
    "unions": attack_unions,
    "options": attack_options,
    "fits": attack_fits,
    "kills": attack_kills,
}


def attempt(name, seed):
    """What went wrong, in a line with its place; empty where nothing did."""
    try:
        ATTACKS[name](seed)
    except Sdf2vecError as error:
        return "" if str(error) and len(str(error).splitlines()) == 1 else f"not one line: {error!r}"
    except Exception as error:
        frame = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__}: {str(error)[:100]} ({frame.filename}, line {frame.lineno})"
    return ""
