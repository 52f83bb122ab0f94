"""Ever fewer of a scene's shapes: those that matter least are left out, and the rest descends a little."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import suppress

import torch

from ..image import Picture
from ..render.tensors import SceneTensors, from_scene, to_scene
from ..scene import Scene
from ..threads import threads_of_its_own
from .constraints import least_length
from .descents import descended
from .draw_order import without, without_all
from .initialization import Layers
from .joining import Search
from .loop import Stopped
from .presets import Phase
from .settings import Settings, preset_of
from .surroundings import View, error_of
from .views import view_of

RESOLUTION = 128  # pixels squared
REFIT = Phase("fewer", 30, 0, rate=0.3, end_rate=0.05)
STEP = math.sqrt(0.5)  # of the layers, that are left by one step
FEW = 12  # layers that are left out one by one


def thinned(
    scene: Scene, picture: Picture, settings: Settings, stop: Callable[[], bool] = lambda: False
) -> Iterator[Scene]:
    """Scenes of ever fewer layers of a scene, down to the ground alone; about two for each halving of their number.

    `stop` is asked after every step of a descent; when it says so, there are no more.
    """

    def tick(loss: float) -> None:
        if stop():
            raise Stopped

    layers = Layers(settings.kinds, scene.compositing)
    tensors = from_scene(scene)
    generator, least = torch.Generator(), least_length(tensors, scene.pixel)
    search = Search(layers, preset_of(settings).falloff, generator, tick, scene.pixel, least)
    view = view_of(picture.premultiplied, settings, RESOLUTION)
    is_small = tensors.layer_count <= FEW
    with threads_of_its_own(), suppress(Stopped):
        while count := tensors.layer_count:
            left = count - 1 if is_small else math.floor(count * STEP)
            tensors = descended(lighter(tensors, view, count - left), view, search, REFIT)
            yield to_scene(tensors, scene.width, scene.height)


def lighter(scene: SceneTensors, view: View, count: int) -> SceneTensors:
    """The scene without so many layers: those without one of which it is least wrong."""
    errors = [error_of(without(scene, order), view) for order in range(scene.layer_count)]
    least = sorted(range(len(errors)), key=errors.__getitem__)[:count]
    return without_all(scene, sorted(least))
