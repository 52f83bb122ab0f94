"""Regions of a picture that are of one colour, or gradients."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from ..arrays import BoolArray, Float32Array, IntArray
from .bends import BentShade
from .region_graph import connected, largest
from .shades import Gradient, bent_gradient, gradient_of, places_in
from .slopes import BENT

SMALLEST = 3  # pixels of a side, for anything to be even
LEAST = 9  # pixels of a region
KNEE, LEAST_KNEE = 3, 6  # pixels from where a gradient bends sharply to what is beside that; of such a place
UNLIKE = 6.0 / 255  # from a region's colour, of what is none of it
WHITE = 255  # levels
GROUND = 0.2  # share of a region that is of one colour, at least, where gradients run into that
NEAR = 1.5 / 255  # how far what is of that colour is from it at most
MANY = 200  # pixels of such a gradient, at least
COLORS = 3  # of a paint
ALIKE = 3.0 / 255  # how far two regions of one gradient are from it, at most


class Region(NamedTuple):
    """Where it is [H, W], and what it is painted with."""

    inside: BoolArray
    shade: Gradient


def regions_of(pixels: Float32Array, calm: BoolArray, least: float) -> tuple[IntArray, list[Gradient]]:
    """The regions of a picture [H, W, C] that are gradients or one colour, by number from 1 [H, W], and what these are,
    the largest first: none, if they are less than a share of the picture. `calm`: where it is even [H, W].
    """
    labels, shades = np.zeros(pixels.shape[:2], np.int64), list[Gradient]()
    for inside, shade in chain.from_iterable(map(_parts, _over_knees(_told(pixels, calm, least), pixels))):
        same = (
            number
            for number, other in enumerate(shades, 1)
            if other.is_flat == shade.is_flat and _apart(other, inside, pixels).mean() < ALIKE
        )
        number = next(same, len(shades) + 1)
        if number > len(shades):
            shades.append(shade)
        labels[inside] = number
    return labels, shades


def _told(pixels: Float32Array, calm: BoolArray, least: float) -> list[Region]:
    """The regions by themselves; none as soon as it is clear that they are too little."""
    parts = list(_smooth(pixels, calm))
    share, found = sum(float(part.mean()) for part in parts), list[Region]()
    for inside in parts:
        if share < least:
            return []
        shade = gradient_of(inside, pixels)
        own = _on_ground(inside, pixels) if shade is None else [Region(inside, shade)]
        found += own
        share -= float(inside.mean()) - sum(float(region.inside.mean()) for region in own)
    return found if share >= least else []


def _on_ground(inside: BoolArray, pixels: Float32Array) -> list[Region]:
    """What is inside [H, W] of a picture that is no gradient: what is of its most frequent colour, and gradients that
    run into that.
    """
    levels = np.rint(pixels[inside] * WHITE).astype(np.int64)
    colors, counts = np.unique(levels, axis=0, return_counts=True)
    if counts.max() < GROUND * len(levels):
        return []
    color = (colors[counts.argmax()] / WHITE).astype(np.float32)
    flat = inside & (np.abs(pixels - color).max(axis=2) <= NEAR)
    ground = gradient_of(flat, pixels)
    if ground is None or not ground.is_flat:
        return []
    rest = largest(ndimage.label(inside & ~flat)[0], MANY)
    told = ((part, gradient_of(part, pixels)) for part in rest)
    found = [Region(part, shade) for part, shade in told if shade is not None and not shade.is_flat]
    return [Region(flat, ground), *found] if found else []


def _parts(region: Region) -> Iterator[Region]:
    """A region; of one with more colours than a paint may have, parts with as many of these each."""
    inside, shade = region
    if not isinstance(shade, BentShade) or len(shade.stops.values) <= COLORS:
        yield region
        return
    values = shade.stops.values
    along = np.full(inside.shape, np.nan)
    along[inside] = shade.along(*places_in(inside))
    for first in range(0, len(values) - 1, COLORS - 1):
        own = slice(first, first + COLORS)
        low = -np.inf if first == 0 else values[first]
        high = np.inf if first + COLORS >= len(values) else values[first + COLORS - 1]
        yield Region((along >= low) & (along < high), replace(shade, stops=shade.stops.some(own)))


def _over_knees(found: list[Region], pixels: Float32Array) -> list[Region]:
    """The same: two gradients that meet in one colour are one of three colours or more, if they are such."""
    joined = list[Region]()
    for region in found:
        joined.append(region)
        while (more := _over_knee(joined, pixels)) is not None:
            joined = more
    return joined


def _over_knee(found: list[Region], pixels: Float32Array) -> list[Region] | None:
    """The same, where the last is one with another; None where it is not."""
    inside, shade = found[-1]
    if shade.is_flat:
        return None
    wide = ndimage.binary_dilation(inside, iterations=KNEE)
    for index, (other, beside) in enumerate(found[:-1]):
        if beside.is_flat or not (wide & other).any():
            continue
        knee = wide & ndimage.binary_dilation(other, iterations=KNEE)
        for one in (shade, beside):
            knee[knee] = _apart(one, knee, pixels) <= UNLIKE
        both = inside | other | knee
        if knee.sum() >= LEAST_KNEE and (bent := bent_gradient(both, pixels)) is not None:
            return [*found[:index], *found[index + 1 : -1], Region(both, bent)]
    return None


def _apart(shade: Gradient, inside: BoolArray, pixels: Float32Array) -> Float32Array:
    """How far a gradient is from a picture where it is inside, the worst of the channels [P]."""
    found: Float32Array = np.abs(shade.at(*places_in(inside)) - pixels[inside]).max(axis=1)
    return found


def _smooth(pixels: Float32Array, calm: BoolArray) -> Iterator[BoolArray]:
    """Masks [H, W] of connected pixels of a picture where colours hardly bend, and change the same way; the largest
    first.
    """
    if min(pixels.shape[:2]) < SMALLEST:
        return
    slopes = np.concatenate([np.gradient(pixels, axis=axis) for axis in (0, 1)], axis=2)
    parts = connected(calm, lambda one, other: np.abs(slopes[one] - slopes[other]).max(axis=2) <= BENT)
    yield from largest(parts, LEAST)
