"""The compact scene: how fine the steps of its numbers are for what may be lost; see docs/compact.md."""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache, partial
from typing import TYPE_CHECKING

from ..compact_file import MOST_BITS, PRECISIONS, Numbering, encoded, is_said, read, written
from ..layer import Slot, slots
from ..scene import Scene
from ..steps import Steps
from .exported import Exported
from .options import Options
from .rounding import Bits, Chooser, Rounded, Rounding

if TYPE_CHECKING:
    from ..render.tensors import Group

MEDIA_TYPE = "application/x-sdf2vec"
USUAL = 44.0  # dB to the render
LOOKED_AT = dict(zip(PRECISIONS, (9, 6, 6, 6), strict=True))  # bits at which errors are looked at
FREE = dict.fromkeys(PRECISIONS, 16)
MOST = dict.fromkeys(PRECISIONS, MOST_BITS)
LEAST = dict.fromkeys(PRECISIONS, 2)
MANY = 4096  # layers: what more want is not looked for


def sdf(scene: Scene, options: Options) -> Exported:
    """The scene as a compact file, its numbers rounded."""
    return _exported(scene, fine(scene, USUAL))


def sdf_uri(scene: Scene, options: Options) -> Exported:
    """The same as a data URI, for the attribute `src` of `<sdf-image>`."""
    return _as_uri(sdf(scene, options))


def sdf_rounding(scene: Scene, options: Options) -> Rounding:
    """The file of a scene that suits it, as coarse as it may be."""
    bits_of = _bits_of(scene)

    @cache
    def rounded(aim: float) -> Rounded:
        numbering = Numbering.of(scene, bits_of(aim))

        def write(said: Scene) -> tuple[Exported, Scene]:
            data = encoded(said, numbering)
            return _exported(said, data), read(data)

        return Rounded(partial(_steps, numbering), write)

    return rounded


def sdf_uri_rounding(scene: Scene, options: Options) -> Rounding:
    """The same as a data URI."""
    plain = sdf_rounding(scene, options)

    def rounded(aim: float) -> Rounded:
        steps_of, write = plain(aim)

        def write_uri(said: Scene) -> tuple[Exported, Scene]:
            made, found = write(said)
            return _as_uri(made), found

        return Rounded(steps_of, write_uri)

    return rounded


def fine(scene: Scene, aim: float) -> bytes:
    """A compact file that is so many dB from the scene's render, about, and not fitted again."""
    return written(scene, _bits_of(scene)(aim))


def _as_uri(made: Exported) -> Exported:
    return replace(made, data=f"data:{MEDIA_TYPE};base64,{base64.b64encode(made.raw).decode()}")


def _exported(scene: Scene, data: bytes) -> Exported:
    each = (f"sdf: {8 * len(data) / scene.shape_count:.0f} bits a shape",) if scene.shape_count else ()
    return Exported(data, notes=each)


def _bits_of(scene: Scene) -> Callable[[float], Bits]:
    """For how near a file is to be to the scene's render, in dB, the bits of its numbers."""
    if len(scene.layers) > MANY:
        return lambda aim: FREE
    return Chooser.of(
        scene, _counts(scene), lambda bits: read(written(scene, bits)), LOOKED_AT, LEAST, MOST
    ).bits


def _counts(scene: Scene) -> dict[str, int]:
    """How many numbers there are of each precision."""
    found = dict.fromkeys(PRECISIONS, 0)
    for layer in scene.layers:
        for slot in slots(layer.structure):
            if is_said(slot, layer.structure):
                found[slot.parameter.unit.codec.precision] += slot.parameter.width
    return {name: count for name, count in found.items() if count}


def _steps(numbering: Numbering, group: Group) -> Mapping[Slot, Steps]:
    """The steps of a group's numbers."""
    said = (
        (slot, numbering.scales[slot.parameter.unit.name])
        for slot in group.values
        if is_said(slot, group.structure)
    )
    return {slot: Steps.between(*scale.ends, scale.most) for slot, scale in said}
