"""Whether a picture is one of text, which outlines serve better than soft shapes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .arrays import BoolArray, Float32Array
from .deferred import deferred

LARGEST = 512  # pixels across that are looked at, by leaving out others
LETTERS = 5  # at least
INK = 0.45  # of the picture, at most
CONTRAST = 0.25  # of the two tones, at least
TWO_TONES = 0.8  # of the pixels are near one of two tones
NEAR = 0.2  # of the contrast
THIN = 0.22  # strokes of a letter are no wider, half across, than this part of its height
ALIKE = 0.6  # of the letters have a height between half and twice the usual
SMALLEST = 4  # pixels: a letter's height
LEVELS, PEAK = 32, 5  # of a picture's range; so many of them are one tone

distance_transform: Callable[..., Any] = deferred("scipy.ndimage", "distance_transform_edt")
label: Callable[..., Any] = deferred("skimage.measure", "label")
regionprops: Callable[..., Any] = deferred("skimage.measure", "regionprops")
threshold_otsu: Callable[..., Any] = deferred("skimage.filters", "threshold_otsu")


def is_lettering(pixels: Float32Array) -> bool:
    """Whether most of what is drawn on the ground of a picture [H, W, 3 or 4] are thin marks of one height in lines."""
    ink = _ink(pixels)
    if ink is None:
        return False
    depth = distance_transform(ink)
    marks = [mark for mark in regionprops(label(ink, connectivity=2)) if _height(mark.bbox) >= SMALLEST]
    if len(marks) < LETTERS:
        return False
    heights = np.array([_height(mark.bbox) for mark in marks])
    deepest = np.array([depth[mark.slice][mark.image].max() for mark in marks])
    usual = float(np.median(heights))
    alike = (heights > 0.5 * usual) & (heights < 2.0 * usual)
    thin = deepest <= np.maximum(THIN * heights, 1.5)
    return bool(np.mean(alike & thin) >= ALIKE and usual < 0.5 * ink.shape[0])


def _height(box: tuple[int, ...]) -> int:
    return box[2] - box[0]


def _on_other_tone(tones: Float32Array, alpha: Float32Array) -> Float32Array:
    """What is transparent shows what is unlike the rest, as far as there is any."""
    drawn = tones[alpha > 0.5]
    other = np.float32(drawn.size > 0 and drawn.mean() < 0.5)
    return tones * alpha + other * (1 - alpha)


def _in_two_peaks(tones: Float32Array) -> float:
    """The share of the pixels that have one of the two tones which most have: of a photograph it is small."""
    counts, total = np.histogram(tones, LEVELS)[0], 0.0
    for _ in range(2):
        peaks = np.convolve(counts, np.ones(PEAK), "same")
        best = int(peaks.argmax())
        total += peaks[best]
        counts[max(0, best - PEAK // 2) : best + PEAK // 2 + 1] = 0
    return total / tones.size


def _ink(pixels: Float32Array) -> BoolArray | None:
    """Where the rarer of two tones is, [H, W]; None where there are more tones, or none."""
    step = -(-max(pixels.shape[:2]) // LARGEST)
    seen = pixels[::step, ::step]
    tones = seen[..., :3].mean(axis=2)
    if seen.shape[2] == 4:
        tones = _on_other_tone(tones, seen[..., 3])
    if float(np.ptp(tones)) < CONTRAST or _in_two_peaks(tones) < TWO_TONES:
        return None
    dark = tones < threshold_otsu(tones)
    ink = dark if dark.mean() < 0.5 else ~dark
    one, other = float(np.median(tones[ink])), float(np.median(tones[~ink]))
    contrast = abs(one - other)
    near = (np.abs(tones - one) < NEAR * contrast) | (np.abs(tones - other) < NEAR * contrast)
    return ink if contrast >= CONTRAST and ink.mean() <= INK and near.mean() >= TWO_TONES else None
