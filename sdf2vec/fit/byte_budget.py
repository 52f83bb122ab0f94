"""As many shapes as so many bytes of an export can say, of the sort that says most with them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

from msgspec import structs

from ..image import Picture
from ..quality import psnr_of
from ..render.tensors import SceneTensors, from_scene, to_scene
from ..scene import Scene
from .digits import fit_concisely
from .initialization import background_of
from .loop import Callback
from .settings import Settings
from .surroundings import View
from .targets import SLOPE
from .thinning import lighter
from .views import view_of

# Of a size limit, above 1 for what is too large. What also has `near(scene, picture)` says by that how near what is
# written then comes to a picture, in dB, if that is not what the scene's render does; `beside(picture)` makes what
# knows the picture.
Share = Callable[[Scene], float]
PROBED = (
    16,
    96,
)  # shapes of each sort that are tried first, at least and at most: half of what there is room for
FAR = 3.0  # times as many as were tried: where there is room for more, that sort is tried again
ENOUGH = 0.975  # of the limit, that is to be used
FITS = 3  # of full length, at most
# shapes, up to which other seeds come to something else by some tenths of a dB, and probes are no nearer: all fits
CHANCY = 64  # are made, of the most promising sorts
NEAREST = 2  # of these
RESOLUTION = 128  # pixels squared, where it is seen which shapes matter least


class Probe(NamedTuple):
    """One sort of shapes: how to fit them, how many there may be; how many were tried, how near they came, in dB."""

    settings: Settings
    wanted: int
    tried: int
    near: float

    def hoped(self, slope: float) -> float:
        """What PSNR is to be had where twice as many shapes bring so much."""
        return self.near + slope * math.log2(self.wanted / self.tried)


def within(picture: Picture, settings: Settings, share: Share, callback: Callback) -> tuple[Scene, float]:
    """The nearest scene found that keeps within the limit, and its share; else the ground alone."""
    share = getattr(share, "beside", lambda picture: share)(picture)
    view = view_of(picture.premultiplied, settings, RESOLUTION)
    nothing = _nothing(picture, settings, view)
    empty = share(nothing)
    best, near = (nothing, empty), psnr_of(nothing, picture)
    if empty >= 1.0:
        return best
    probes = _probes(picture, settings, share, callback)
    chancy = probes[0].wanted <= CHANCY
    for probe in probes[: NEAREST if chancy else 1]:
        count = probe.wanted
        for number in range(FITS):
            again = structs.replace(probe.settings, shapes=count, seed=settings.seed + number)
            scene = fit_concisely(picture, again, callback)
            taken = share(scene)
            each = (taken - empty) / count
            scene, taken = _trimmed(scene, view, share, each, taken)
            now = _near(share, scene, picture) if chancy else psnr_of(scene, picture)
            if now > near:
                best, near = (scene, taken), now
            more = min(math.floor((1.0 - empty) / each), settings.most)
            is_full = taken >= ENOUGH or more <= count
            if is_full and not chancy:
                break
            count = count if is_full else more
    return best


def _near(share: Share, scene: Scene, picture: Picture) -> float:
    """How near a scene comes to a picture as it is written, in dB."""
    found: float = getattr(share, "near", psnr_of)(scene, picture)
    return found


def _nothing(picture: Picture, settings: Settings, view: View) -> Scene:
    """The ground alone."""
    size = Scene(picture.width, picture.height, ()).extent
    ground = SceneTensors([], background_of(view.target), settings.compositing, size)
    return to_scene(ground, picture.width, picture.height)


def _sorts(settings: Settings) -> Iterator[Settings]:
    """Soft and sharp shapes, and circles, which a shader says in few words; whatever the user has left open."""
    edges = [None, 0.0] if settings.max_falloff is None else [settings.max_falloff]
    for edge in edges:
        yield structs.replace(settings, max_falloff=edge)
    if not settings.kind:
        yield structs.replace(settings, kind=("circle",))


def _probes(picture: Picture, settings: Settings, share: Share, callback: Callback) -> list[Probe]:
    """The sorts, the most promising first: the more there is room for, the more of each are tried."""
    least, most = PROBED
    sorts = list(_sorts(settings))
    first = _probe(sorts[0], picture, share, callback, least)
    count = min(max(first.wanted // 2, least), most)
    begun = [first] if count == least else []
    probes = begun + [_probe(sort, picture, share, callback, count) for sort in sorts[len(begun) :]]
    slope = SLOPE
    if count > least:  # where more bring less than usual, a sort of many has less to promise
        gained = max(probes[0].near - first.near, 0.0)
        slope = min(slope, gained / math.log2(count / first.tried))
    if count < most:
        for index, probe in enumerate(probes):
            if probe.wanted > FAR * count:
                more = min(probe.wanted // 2, most)
                probes[index] = _probe(probe.settings, picture, share, callback, more)
    return sorted(probes, key=lambda probe: -probe.hoped(slope))


def _probe(settings: Settings, picture: Picture, share: Share, callback: Callback, count: int) -> Probe:
    """What a fit of few shapes promises of one of as many as the limit can hold."""
    count = min(count, settings.most)
    few = fit_concisely(picture, structs.replace(settings, shapes=count, preset="fast"), callback)
    least, most = share(replace(few, layers=few.layers[:1])), share(few)
    each = max((most - least) / max(count - 1, 1), 1e-9)
    wanted = 1 + math.floor((1.0 - least) / each) if least <= 1.0 else 0
    return Probe(settings, min(max(wanted, 1), settings.most), count, _near(share, few, picture))


def _trimmed(scene: Scene, view: View, share: Share, each: float, taken: float) -> tuple[Scene, float]:
    """The scene without the shapes that matter least, as far as the limit asks for it."""
    tensors = from_scene(scene)
    while taken > 1.0 and tensors.layer_count:
        surplus = math.ceil((taken - 1.0) / each)
        tensors = lighter(tensors, view, min(max(surplus, 1), tensors.layer_count))
        scene = to_scene(tensors, scene.width, scene.height)
        taken = share(scene)
    return scene, taken
