"""No more shapes than a target asks for: short fits foretell how many, fits as asked for find out."""

from __future__ import annotations

import math
from typing import NamedTuple

from msgspec import structs

from ..image import Picture
from ..quality import psnr_of, quality
from ..scene import Scene
from .digits import fit_concisely
from .loop import Callback, fit_picture
from .settings import Settings

SLOPE = 1.7  # dB for twice the shapes, about
FALL = 0.3  # FLIP falls with this power of their number, about
STEEP = 1.0, 8.0  # what it is taken for where it is measured
APART = 1.35  # times so many shapes are needed for that
FIRST = 64  # shapes that are tried first
FAR = 2.0  # times as many or as few shapes, of which these do not tell enough, nor is it gone on from them
PILOT = "fast"  # preset of the fits that foretell
NEARER = {"balanced": 0.35, "best": 0.6}  # dB that others come nearer to a picture than it, about
SPARE = 0.25  # dB by which a target is meant to be met
ENOUGH = 0.5  # dB by which it may be met, for no fewer shapes to be tried;
ENOUGH_FLIP = 0.4  # of FLIP, 5 %
CLOSE = 1.12  # times the shapes that were too few: nothing between is tried
TRIES = 4  # fits, before as many shapes are tried as there may be


class Attempt(NamedTuple):
    """A fit of so many layers, and by how many dB it misses the target."""

    layers: int
    missed: float
    scene: Scene


def meeting(picture: Picture, settings: Settings, callback: Callback) -> tuple[Scene, bool]:
    """The scene of about the fewest shapes that meets the settings' targets; where none does, that of the most, and
    False.
    """
    most = max(settings.most // settings.union, 1)
    layers, slope, before = _foretold(picture, settings, callback, most)
    enough = ENOUGH if settings.target_flip is None else ENOUGH_FLIP
    low, high, best = 0, most + 1, None
    scene = before.scene if before and layers <= before.layers else None
    for number in range(1, TRIES + 2):
        some = structs.replace(settings, shapes=layers * settings.union)
        near_by = scene is not None and _apart(layers, len(scene.layers)) <= FAR
        scene = fit_concisely(picture, some, callback, scene if near_by else None)
        by = missed(scene, picture, settings)
        if before and _apart(layers, before.layers) > APART:
            slope = _steepness(layers, by, before)
        before = Attempt(layers, by, scene)
        if by > 0.0:
            low = layers
        else:
            high, best = layers, scene
        near = -enough <= by <= 0.0 or high <= max(low * CLOSE, low + 1)
        if low == most or (best and (near or number >= TRIES)):
            break
        layers = min(max(_scaled(layers, by, slope), low + 1), high - 1) if best or number < TRIES else most
    assert scene is not None
    return best or scene, best is not None


def missed(scene: Scene, picture: Picture, settings: Settings) -> float:
    """By how many dB, or about so many, a target is missed; negative where it is more than met."""
    if settings.target_flip is None:
        return (settings.target_psnr or 0.0) - psnr_of(scene, picture)
    seen = quality(scene, picture)
    ratio = seen.flip / max(settings.target_flip, 1e-6)
    by = SLOPE / FALL * math.log2(max(ratio, 1e-6))
    return by if settings.target_psnr is None else max(by, settings.target_psnr - seen.psnr)


def wanted(settings: Settings) -> str:
    """The targets in words."""
    psnr, flip = settings.target_psnr, settings.target_flip
    words = [f"PSNR {psnr:g} dB"] if psnr is not None else []
    return " and ".join([*words, *([f"FLIP {flip:g}"] if flip is not None else [])])


def _foretold(
    picture: Picture, settings: Settings, callback: Callback, most: int
) -> tuple[int, float, Attempt | None]:
    """With how many layers, at most so many, the target is to be tried first; dB that twice as many are worth; and a
    short fit, where there is one, with by how many dB one as asked for is about to miss it.
    """
    begun = len(settings.start.layers) if settings.start else 0
    first = min(max(FIRST, 2 * begun), most)
    if settings.preset not in NEARER or begun:
        return first, SLOPE, None
    nearer = NEARER[settings.preset]
    pilot = structs.replace(settings, preset=PILOT, trials=0, cuts=0)

    def tried(layers: int) -> Attempt:
        scene = fit_picture(picture, structs.replace(pilot, shapes=layers * settings.union), callback)
        return Attempt(layers, missed(scene, picture, settings) - nearer, scene)

    before = tried(first)
    second = min(_scaled(first, before.missed, SLOPE), most)
    if second == most or _apart(first, second) <= FAR:
        return second, SLOPE, before
    again = tried(second)
    slope = _steepness(second, again.missed, before)
    return min(_scaled(second, again.missed, slope), most), slope, again


def _apart(one: int, other: int) -> float:
    """How many times as many layers one number is as another, or the other way round."""
    return max(one, 1) / max(other, 1) if one > other else max(other, 1) / max(one, 1)


def _steepness(layers: int, by: float, before: Attempt) -> float:
    """How many dB twice as many are worth, from what two numbers of them, which are not about the same, miss."""
    slope = (before.missed - by) / math.log2(layers / before.layers)
    return min(max(slope, STEEP[0]), STEEP[1])


def _scaled(layers: int, by: float, slope: float) -> int:
    """How many meet a target that so many miss by so many dB."""
    scaled: float = layers * 2.0 ** ((by + SPARE) / slope)
    return max(1, math.ceil(scaled))
