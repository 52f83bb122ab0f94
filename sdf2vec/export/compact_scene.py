"""The compact scene: how fine the steps of its numbers must be for what is lost; see docs/compact.md.

An error of rounding falls by half with every bit, so that looking once at each sort of numbers tells how many bits
each wants: such that one bit less would cost all the same (Lagrange).
"""

from __future__ import annotations

import base64
import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np

from ..arrays import Float32Array
from ..compact_file import MOST_BITS, PRECISIONS, Bits, Steps, is_said, read, written
from ..deferred import deferred
from ..layer import slots
from ..scene import Scene
from .byte_limit import ByteLimit
from .exported import Exported
from .options import Options

drawn: Callable[..., Float32Array] = deferred("sdf2vec.export.compact_refit", "drawn")  # torch
refitted: Callable[..., Scene] = deferred("sdf2vec.export.compact_refit", "refitted")

MEDIA_TYPE = "application/x-sdf2vec"
USUAL = 44.0  # dB to the render, where nobody knows how near that is to a picture
BELOW = 12.3  # dB that the loss lies below what the fit has left: 0.25 dB of it in all
SHORT = 0.6  # dB that it may be short of that: then it is 0.28
FINEST, COARSEST = 56.0, 20.0  # dB
STEP = 1.5  # dB between two forms
GAINED = 2.0  # dB, about, that fitting again brings
TRIES = 2
LOOKED_AT = dict(zip(PRECISIONS, (9, 6, 6, 6), strict=True))  # bits at which errors are looked at
FREE = dict.fromkeys(PRECISIONS, 16)
LEAST_BITS = 2
MANY = 4096  # layers: what more want is not looked for


def sdf(scene: Scene, options: Options) -> Exported:
    """The scene as a compact file that loses at most 0.3 dB to the picture."""
    return sdf_forms(scene, options)[0]()


def sdf_forms(scene: Scene, options: Options) -> list[Callable[[], Exported]]:
    """The same, and ever coarser ones; under a size limit from about the first on that keeps to it."""
    sizer = _Sizer(scene)
    first = (
        FINEST
        if options.near == math.inf
        else min(max((options.near or USUAL - BELOW) + BELOW, COARSEST), FINEST)
    )
    aims = [first - STEP * i for i in range(1 + math.floor((first - COARSEST) / STEP))]
    if options.max_bytes is not None:
        limit = ByteLimit.of(options.max_bytes)
        fitting = (
            i for i, a in enumerate(aims) if limit.share(written(scene, sizer.bits(a - GAINED))) <= 1.0
        )
        aims = aims[next(fitting, len(aims) - 1) :]
    return [*(partial(_made, sizer, aim) for aim in aims), partial(_smallest, sizer)]


def sdf_uri(scene: Scene, options: Options) -> Exported:
    """The same as a data URI, for the attribute `src` of `<sdf-image>`."""
    return sdf_uri_forms(scene, options)[0]()


def sdf_uri_forms(scene: Scene, options: Options) -> list[Callable[[], Exported]]:
    """The same, and ever coarser ones."""
    return [partial(_as_uri, make) for make in sdf_forms(scene, options)]


def _as_uri(make: Callable[[], Exported]) -> Exported:
    made = make()
    return replace(made, data=f"data:{MEDIA_TYPE};base64,{base64.b64encode(made.raw).decode()}")


def fine(scene: Scene, aim: float) -> bytes:
    """A compact file that is so many dB from the scene's render, and not fitted again."""
    many = len(scene.layers) > MANY
    return written(scene, FREE if many else _Sizer(scene).bits(aim))


def _smallest(sizer: _Sizer) -> Exported:
    """As coarse as can be, quickly."""
    return _told(sizer, written(sizer.scene, sizer.bits(COARSEST - GAINED)))


def _made(sizer: _Sizer, aim: float) -> Exported:
    """The file that is so many dB from the render, or more."""
    asked, best, nearest = aim - GAINED, b"", -math.inf
    for _ in range(TRIES):
        bits = sizer.bits(asked)
        plain = written(sizer.scene, bits)
        tried = [plain, written(refitted(sizer.scene, Steps.of(sizer.scene, bits).scales), bits)]
        near, data = max((sizer.near(file), file) for file in tried)
        if near > nearest:
            best, nearest = data, near
        if nearest >= aim - SHORT:
            break
        asked += aim - near + 0.2
    return _told(sizer, best)


def _told(sizer: _Sizer, data: bytes) -> Exported:
    scene = sizer.scene
    each = f", {8 * len(data) / scene.shape_count:.0f} bits a shape" if scene.shape_count else ""
    return Exported(data, notes=(f"sdf: {sizer.near(data):.1f} dB from the render{each}",))


class _Sizer:
    """How near a scene's render files of some bits come, on a small canvas."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.wanted = drawn(scene)
        self.counts = _counts(scene)
        self.errors = {name: self._error({**FREE, name: LOOKED_AT[name]}) for name in self.counts}

    def bits(self, aim: float) -> dict[str, int]:
        """The bits of each precision for so many dB, when numbers are rounded to the nearest step."""
        allowed = 10.0 ** (-aim / 10.0)
        each = allowed / max(1, sum(self.counts.values()))
        choices = {name: [LEAST_BITS] for name in PRECISIONS}
        for name, error in self.errors.items():
            even = LOOKED_AT[name] + 0.5 * math.log2(max(error, 1e-20) / (each * self.counts[name]))
            around = (math.floor(even) + more for more in (-1, 0, 1, 2))
            choices[name] = sorted({min(max(bits, LEAST_BITS), MOST_BITS) for bits in around})
        tried = [dict(zip(choices, bits, strict=True)) for bits in product(*choices.values())]
        enough = [bits for bits in tried if self._expected(bits) <= allowed]
        return min(enough or tried[-1:], key=lambda bits: (self._bytes(bits), self._expected(bits)))

    def near(self, data: bytes) -> float:
        """How near a file comes, in dB."""
        error = self._off(read(data))
        return -10.0 * math.log10(error) if error > 0.0 else math.inf

    def _expected(self, bits: Bits) -> float:
        return sum(error * 4.0 ** (LOOKED_AT[name] - bits[name]) for name, error in self.errors.items())

    def _bytes(self, bits: Bits) -> float:
        return sum(count * bits[name] for name, count in self.counts.items()) / 8.0

    def _error(self, bits: Bits) -> float:
        return self._off(read(written(self.scene, bits)))

    def _off(self, scene: Scene) -> float:
        return float(np.mean(np.square(drawn(scene) - self.wanted)))


def _counts(scene: Scene) -> dict[str, int]:
    """How many numbers there are of each precision."""
    found = dict.fromkeys(PRECISIONS, 0)
    for layer in scene.layers:
        for slot in slots(layer.structure):
            if is_said(slot, layer.structure):
                found[slot.parameter.unit.codec.precision] += slot.parameter.width
    return {name: count for name, count in found.items() if count}
