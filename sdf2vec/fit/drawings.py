"""Whether a picture is a drawing, and what was drawn, before it was compressed or where it has no antialiasing."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch

from ..arrays import Float32Array
from ..image import Picture
from .jagged import ALIKE, alike, is_jagged, smoothed
from .matching_pursuit import Painted, find_discs
from .ringing import has_ringing, restored
from .views import scaled

FINEST = 1280  # pixels squared, beyond which neither steps nor ringing are seen where shapes are looked for
# of the squares of what is changed so much is still wrong, at most: of steps, where the edge is in its pixels; of noise
UNSURE, UNSURE_OF_NOISE = 0.5, 0.2
STEADY = 1.5 / 255  # by which pixels of one flat colour differ at most in a drawing: photographs have noise
FLAT = 0.6  # share of pixels next to the same colour, of a drawing in flat colours
PHOTOGRAPH, STILL_FLAT = 128, 0.58  # pixels squared, and how flat a drawing is there
CLEAN = 0.76  # the same where ringing has been taken away, as it has from photographs, too
QUICK = 256  # pixels squared of a picture in which ringing is looked for however flat it is;
UNCLEAN = 0.5  # the same of larger ones, where it is
DISCS = 24  # of a soft drawing so many discs leave at most
LEFT = 0.15  # this share of its variance,
LITTLE_LEFT = 0.08  # or this, where it is as rough as photographs are
SMOOTH = 0.6  # share of pixels that are about the mean of those beside them, of what is smooth
DISC_RESOLUTION = 48


@dataclass(frozen=True, eq=False)
class Drawn:
    """A picture and the premultiplied pixels [H, W, C] that were drawn: its own, or those without what a file or a want
    of antialiasing made of them; whether they are flat colours but for edges, the mean squared error between, and that
    which they leave unsure.
    """

    picture: Picture
    pixels: Float32Array
    flat: bool
    off: float = 0.0
    unsure: float = 0.0

    @classmethod
    def of(cls, picture: Picture) -> Drawn:
        """What was drawn of a picture, with its edges in steps."""
        pixels = picture.premultiplied
        found = cls(picture, pixels, flatness(pixels, STEADY) >= FLAT)
        if found._may_ring and has_ringing(pixels):
            clean = restored(pixels)
            if _small_flatness(clean) >= CLEAN:
                return replace(found._with(clean, UNSURE_OF_NOISE), flat=True)
        return found

    @property
    def _may_ring(self) -> bool:
        """Whether it is worth the time to look for ringing: of photographs seldom."""
        quick = self.picture.width * self.picture.height <= QUICK**2
        return self._is_fine and (quick or _small_flatness(self.pixels) >= UNCLEAN)

    @cached_property
    def antialiased(self) -> Drawn:
        """The same with smooth edges."""
        if self._is_fine and is_jagged(self.pixels):
            return self._with(smoothed(self.pixels), UNSURE)
        return self

    @property
    def _is_fine(self) -> bool:
        """Whether ringing and steps are seen where shapes are looked for."""
        return self.picture.width * self.picture.height <= FINEST**2

    def _with(self, pixels: Float32Array, share: float) -> Drawn:
        """With other pixels, of which a share of the squares of what that changes is unsure."""
        off = float(np.mean((pixels - self.picture.premultiplied) ** 2))
        unsure = self.unsure + share * float(np.mean((pixels - self.pixels) ** 2))
        return replace(self, pixels=pixels, off=off, unsure=unsure)

    def flattened(self, picture: Picture) -> Drawn:
        """The same without its gradients, in flat colours."""
        return replace(self, picture=picture, pixels=picture.premultiplied, flat=True)

    def wanted(self, target_psnr: float | None) -> tuple[Float32Array, float]:
        """The pixels that are looked for and the mean squared error that any scene may have: what these leave unsure,
        or of a target, of which the difference from the picture takes its part. The picture as it is where nothing else
        meets that.
        """
        if target_psnr is None:
            return self.pixels, self.unsure
        allowed: float = 10 ** (-target_psnr / 10)
        if allowed > self.off:
            return self.pixels, allowed - self.off
        return self.picture.premultiplied, allowed


def flatness(pixels: np.ndarray, levels: float = ALIKE) -> float:
    """The share of pixels [H, W, C] that have the colour of their neighbours, about."""
    across, down = alike(pixels[:, 1:], pixels[:, :-1], levels), alike(pixels[1:], pixels[:-1], levels)
    return min(share(across), share(down))


def is_photograph(drawn: Drawn) -> bool:
    """Whether a picture is no drawing: not in flat colours, or not where it is small; nor soft."""
    flat = drawn.flat and _small_flatness(drawn.pixels) >= STILL_FLAT
    return not flat and not _is_soft(drawn.pixels)


def _small_flatness(pixels: Float32Array) -> float:
    """The flatness of pixels where they are scaled down."""
    return flatness(scaled(pixels, PHOTOGRAPH).permute(1, 2, 0).numpy())


def share(chosen: np.ndarray) -> float:
    """The share of what is true; of nothing, all."""
    return float(chosen.mean()) if chosen.size else 1.0


def _is_soft(pixels: Float32Array) -> bool:
    """Whether a few discs come near to a picture, as they do not to a photograph."""
    target = scaled(pixels, DISC_RESOLUTION)
    image = target.flatten(1).median(1).values[:, None, None].expand_as(target).clone()
    before = (image - target).square().mean()
    find_discs(Painted(image, target, torch.ones(target.shape[1:])), DISCS)
    left = LEFT if smoothness(pixels) >= SMOOTH else LITTLE_LEFT
    return bool((image - target).square().mean() <= left * before)


def smoothness(pixels: np.ndarray) -> float:
    """The share of pixels [H, W, C] that are the mean of those beside them, to within a level, about."""
    bent = (np.abs(np.diff(pixels, 2, axis=axis)).max(axis=2, initial=0.0) for axis in (0, 1))
    return min(share(each <= STEADY) for each in bent)
