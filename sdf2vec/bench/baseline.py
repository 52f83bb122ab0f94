"""Whether fits have become worse: five small pictures made by code, every kind, `fast`, against figures kept before."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path

import msgspec
import numpy as np

from .. import api
from ..arrays import Float32Array
from ..errors import Sdf2vecError, Sdf2vecWarning
from ..files import write_atomically
from ..image import load
from ..quality import psnr_of
from ..shapes import KINDS
from . import hard_pictures as pictures
from .timing import picture, scene, seconds, step

SHAPES = 8
SEEDS = 6  # fits of which mean and spread are kept; what one of them finds is chance, on another processor as well
DROP = 0.3  # dB
SPREADS = 3  # standard errors that a mean may be below another besides
SLOWER = 1.5
COUNT, SIDE = 64, 64  # shapes and pixels of the step whose time is taken

PICTURES: Mapping[str, Callable[[int], Float32Array]] = {
    "discs": pictures.discs,
    "hills": pictures.scene_like,
    "ring": pictures.ring,
    "letters": pictures.lettering,
    "strip": lambda seed: np.ascontiguousarray(pictures.strip(2 * seed + 1)[:, ::12]),
}


def decibels(kind: str, seed: int = 0) -> float:
    """The mean PSNR of fits of one kind to two of the pictures, which all kinds together share evenly."""
    found, makes, place = [], list(PICTURES.values()), list(KINDS).index(kind)
    for step_on in (0, 2):
        pixels = makes[(place + step_on) % len(makes)](1)
        options = {"kind": kind, "compositing": "additive"} if KINDS[kind].patch else {"kind": kind}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Sdf2vecWarning)
            found_scene = api.fit(pixels, SHAPES, preset="fast", seed=seed, **options)  # type: ignore[arg-type]
        found.append(psnr_of(found_scene, load(pixels)))
    return float(np.mean(found))


def times_faster(kind: str) -> float:
    """A dense step against one of ours, measured side by side."""
    target = picture(SIDE)
    slow, fast = (
        seconds(step(scene((kind,), COUNT, target), target, dense), least=0.2) for dense in (True, False)
    )
    return slow / fast


class Figures(msgspec.Struct):
    """What is kept: of each kind its dB, their spread, and how many times faster than a dense step one of ours is."""

    decibels: dict[str, float]
    spreads: dict[str, float]
    times_faster: dict[str, float]

    def least(self, kind: str, fits: int = 1) -> float:
        """The mean dB that so many fits of a kind have at least, unless they have become worse."""
        chance = self.spreads[kind] * math.sqrt(1 / SEEDS + 1 / fits)
        return self.decibels[kind] - DROP - SPREADS * chance


def measured() -> Figures:
    """Now."""
    found = {kind: [decibels(kind, seed) for seed in range(SEEDS)] for kind in KINDS}
    return Figures(
        {kind: round(float(np.mean(some)), 2) for kind, some in found.items()},
        {kind: round(float(np.std(some, ddof=1)), 2) for kind, some in found.items()},
        {kind: round(times_faster(kind), 1) for kind in KINDS},
    )


def kept(path: Path) -> Figures:
    """Before. Raises Sdf2vecError for a file that is none."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=Figures)
    except (OSError, msgspec.MsgspecError) as error:
        raise Sdf2vecError(f"{path}: no baseline ({error}); remove it, and it is made anew") from error


def worse(before: Figures, now: Figures) -> list[str]:
    """A line for each kind that has lost dB or speed."""
    lines = [
        f"{kind}: {now.decibels[kind]:.2f} dB, {was:.2f} before"
        for kind, was in before.decibels.items()
        if not now.decibels.get(kind, -np.inf) >= before.least(kind, SEEDS)
    ]
    lines += [
        f"{kind}: a step is {now.times_faster[kind]:.0f} times faster than a dense one, {was:.0f} before"
        for kind, was in before.times_faster.items()
        if now.times_faster.get(kind, 0.0) < was / SLOWER
    ]
    return lines


def check(path: Path, say: Callable[[str], None]) -> bool:
    """Compares with what a file holds, or writes it; whether anything is worse."""
    now = measured()
    if not path.exists():
        write_atomically(path, msgspec.json.format(msgspec.json.encode(now), indent=1) + b"\n")
        say(f"{path}: written")
        return False
    before = kept(path)
    for kind, value in now.decibels.items():
        say(
            f"{kind}: {value:.2f} dB ({before.decibels.get(kind, float('nan')):.2f}), "
            f"{now.times_faster[kind]:.0f} times faster than dense ({before.times_faster.get(kind, float('nan')):.0f})"
        )
    lines = worse(before, now)
    for line in lines:
        say(f"worse: {line}")
    return bool(lines)
