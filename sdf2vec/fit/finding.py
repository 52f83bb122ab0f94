"""The search for the few shapes that a drawing is made of, from a bare ground to the last descent."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial

import torch

from ..arrays import Float32Array
from ..render.tensors import SceneTensors, from_scene, to_scene
from ..scene import Scene
from .backends import CPU
from .descents import Sizes, descended, fine_enough, finished, sharper, softer
from .description import description_length
from .digits import concise
from .drawings import Drawn
from .initialization import Layers, empty_groups
from .joining import Search
from .loop import Callback, Progress, Stopped
from .mending import SLIGHTLY, exchanged, merged
from .pens import lined
from .presets import Phase
from .pruning import BRIEF, FLOOR, THOROUGH, USUAL, pruned
from .ramps import ground_of, grounded
from .settings import AUTO, Settings, preset_of
from .simplify import sharing, simplified
from .sparse import Round, grow, needed, taken_apart
from .surroundings import View, error_of
from .targets import missed
from .views import pixel_of, view_of

THOROUGHLY = 12  # layers, at most, which in the end are tried without even where they matter
SEARCH, JOINT, LAST, LARGEST = 56, 128, 320, 1024  # pixels squared
SHARPENED = Phase("sharpened", 60, 0, rate=0.03, end_rate=0.003)  # larger steps lose more than they bring
HARDLY_LARGER = 1.5  # times that, up to which a picture is looked at as it is
# of the error so much, 2 dB less, is left by so many rounds that no longer find much; from so many layers on
LAST_ROUNDS, SLOW, SEVERAL = 3, 10**-0.2, 16
GROWN = 1.5  # times the layers that could be told by their outlines, where these are not most of the drawing
UNLIKELY = 1.5  # of the most shapes: a picture that needs more is no drawing
SOFT_MOST = 16  # shapes of a soft drawing
SAMPLES = 4  # across a pixel, of a drawing that is antialiased
SMALL = 72  # pixels along the longer side, at most, of a picture that is looked at by these: larger ones gain little
GOOD = 10**-3.5  # mean squared error, 35 dB, of what is surely found,
UNTOLD = 3.5  # and bits of the description of each value of a picture
COARSER = 1.5  # times the error, step by step, that fewer shapes may have where FLIP is wanted


class Drawing:
    """The search for the few shapes that a picture is made of."""

    def __init__(self, drawn: Drawn, settings: Settings, callback: Callback) -> None:
        self.picture, self.settings, self.callback, self.flat = drawn.picture, settings, callback, drawn.flat
        self.stopped, self.gave_up, self.error = False, False, math.inf
        pixel = pixel_of(self.picture)
        self.size = (self.picture.width * pixel, self.picture.height * pixel)
        generator = torch.Generator().manual_seed(settings.seed)
        layers = Layers(settings.drawn_kinds, settings.compositing)
        self.search = Search(layers, preset_of(settings).falloff, generator, self._tick, pixel)
        self.pixels, self.worst = drawn.wanted(settings.target_psnr)
        self.floor = self.worst if settings.target_psnr is not None else max(FLOOR, self.worst)
        self.good = self.floor if settings.target_psnr is not None else max(GOOD, self.worst)
        self.sizes = Sizes(*(self._seen(resolution) for resolution in (SEARCH, JOINT, LAST)))
        self.scene = SceneTensors([], ground_of(self.sizes.joint.target), settings.compositing, self.size)

    def found(self) -> Scene:
        """The scene, as simple as it may be."""
        try:
            self._announce_compiling()
            self.scene = grounded(self.scene, self.sizes.joint, self.search)
            self.scene = taken_apart(self.scene, self.sizes, self.search, self.settings.most)
            self.sizes, self.search = fine_enough(self.sizes, self.search, self.scene)
            outlined, helped = self.scene.layer_count, []
            rounds = grow(self.scene, self.sizes, self.search, self.settings.most, self.floor)
            for made in () if self._is_told() else rounds:
                if self._is_no_drawing(made):
                    self.gave_up = not self._was_good(made)
                    break
                self.scene = made.scene
                helped.append(made)
                is_enough = self._has_met(self.scene) or self._is_told()
                if is_enough or self._are_slow(helped[-LAST_ROUNDS:], outlined):
                    break
            if not self.gave_up:
                self._finish_as_wanted()
        except Stopped:
            self.stopped = True
        self.error = error_of(self.scene, self.sizes.last)
        return concise(self._made(), self.picture, self.settings)

    def finished(self, scene: Scene) -> Scene:
        """A scene after a last descent, without what is needless."""
        self.scene = from_scene(scene)
        with suppress(Stopped):
            self.scene = finished(self.scene, self.sizes, self.search)
            if self.settings.shapes == AUTO and self.scene.layer_count <= THOROUGHLY:
                self.scene = self._briefer(self.floor)
        self.error = error_of(self.scene, self.sizes.last)
        return concise(self._made(), self.picture, self.settings)

    def sharpened(self, scene: Scene) -> Scene:
        """A scene after a descent at the picture's own size, where it is larger than it was looked at: edges are
        sharper there. A FLIP that is reached is kept.
        """
        if self.sizes.last.target.shape[1:] == (self.picture.height, self.picture.width):
            return scene
        before, view = from_scene(scene), looked_at(self.pixels, self.settings, LARGEST)
        with suppress(Stopped):
            made = descended(before, view, self.search, SHARPENED, simple=True)
            is_nearer = error_of(made, view) < error_of(before, view)
            if is_nearer and (not self._has_met(before) or self._has_met(made)):
                return concise(self._scene_of(made), self.picture, self.settings)
        return scene

    def explains(self, found: Scene) -> bool:
        """Whether what was found is the drawing: near to it, and it leaves little that would have to be told."""
        if self.floor < self.error <= self.good:
            view = self.sizes.last
            return description_length(from_scene(found), view) <= UNTOLD * view.target.numel()
        return self.error <= self.good

    def _made(self) -> Scene:
        return self._scene_of(self.scene)

    def _scene_of(self, tensors: SceneTensors) -> Scene:
        return to_scene(tensors, self.picture.width, self.picture.height)

    def _has_met(self, scene: SceneTensors) -> bool:
        """Whether a scene comes as near by FLIP as is wanted."""
        if self.settings.target_flip is None:
            return False
        return missed(self._scene_of(scene), self.picture, self.settings) <= 0

    def _seen(self, resolution: int) -> View:
        """The pixels at a resolution; of a small picture, of which edges are most, as they are antialiased, but where
        it is said how near shapes are to come: that is measured as the renderer draws them.
        """
        view = looked_at(self.pixels, self.settings, resolution)
        is_small = max(self.picture.width, self.picture.height) <= SMALL
        return view._replace(samples=SAMPLES) if is_small and not self.settings.has_target else view

    def _is_told(self) -> bool:
        """Whether nothing is missing but how edges are antialiased."""
        if not self.scene.groups or self.settings.shapes != AUTO or self.settings.has_target:
            return False
        return error_of(self.scene, self.sizes.joint._replace(samples=SAMPLES)) <= self.floor

    def _finish_as_wanted(self) -> None:
        """Finishes the scene. A FLIP that it has reached is kept, by no more layers than that takes."""
        reached = self.scene if self._has_met(self.scene) else None
        self._finish()
        if self._has_met(self.scene):
            self.scene = self._fewest(self.scene)
        elif reached:
            self.scene = reached

    def _fewest(self, scene: SceneTensors) -> SceneTensors:
        """The scene without layers that the FLIP that is wanted does not ask for: ever more error is allowed."""
        worst = max(self.floor, error_of(scene, self.sizes.joint))
        while scene.layer_count and worst < 1.0:
            worst *= COARSER
            fewer = pruned(scene, self.sizes, self.search, worst)
            if fewer.layer_count == scene.layer_count:
                continue
            fewer = finished(fewer, self.sizes, self.search)
            if not self._has_met(fewer):
                break
            scene = fewer
        return scene

    def _finish(self) -> None:
        worst, sizes, search = self.worst, self.sizes, self.search
        self.scene = merged(self.scene, sizes, search, self.floor)
        self.scene = softer(self.scene, sizes.joint, search)
        if error_of(self.scene, sizes.joint) > worst:
            self.scene = exchanged(self.scene, sizes, search, SLIGHTLY)
        few = self.scene.layer_count <= THOROUGHLY
        if worst or few:
            hope = THOROUGH if few else USUAL
            self.scene = pruned(self.scene, sizes, search, self.floor, hope)
        self.scene = simplified(self.scene, sizes.joint._replace(samples=1), search, worst)
        self.scene = sharper(finished(self.scene, sizes, search), sizes, search, FLOOR)
        self.scene = self._briefer(self.floor)
        self.scene = sharing(lined(self.scene, sizes.last, search, worst), sizes.last, worst)

    def _briefer(self, worst: float) -> SceneTensors:
        """The scene without what is needless now that all is simple, where it is told as shortly."""
        sizes, search = self.sizes, self.search
        fewer = pruned(self.scene, sizes._replace(joint=sizes.last), search, worst, BRIEF)
        if fewer.layer_count == self.scene.layer_count:
            return self.scene
        fewer = finished(fewer, sizes, search)
        return min(fewer, self.scene, key=partial(description_length, view=sizes.last))

    def _is_no_drawing(self, made: Round) -> bool:
        """Whether far more shapes would be needed than there may be."""
        if self.settings.shapes != AUTO:
            return False
        most = UNLIKELY * self.settings.most if self.flat else SOFT_MOST
        grown = made.scene.layer_count > self.scene.layer_count  # what only became simpler says nothing
        return grown and made.scene.layer_count + needed(made, self.flat, self.floor) > most

    def _are_slow(self, rounds: Sequence[Round], outlined: int) -> bool:
        """Whether the last rounds helped so little that as many more would not find the drawing, few layers of which
        could be told by their outlines: it is made of other things.
        """
        enough = max(SEVERAL, GROWN * outlined)
        few = len(rounds) < LAST_ROUNDS or rounds[-1].scene.layer_count < enough
        if few or self.settings.target_psnr is not None:
            return False
        left = rounds[-1].error / rounds[0].before
        return left > SLOW and rounds[-1].error * left > self.good

    def _was_good(self, made: Round) -> bool:
        """Whether all was found before a round that only begins to follow the steps of a jagged edge."""
        return self.settings.target_psnr is None and made.before <= self.good

    def _announce_compiling(self) -> None:
        kinds = replace(self.scene, groups=empty_groups(self.search.layers))
        if not CPU.is_compiled(kinds, len(self.sizes.joint.target)):
            self._say("compiling kernels (once)", math.nan)

    def _tick(self, loss: float) -> None:
        self._say("finding shapes", loss)

    def _say(self, phase: str, loss: float) -> None:
        count = self.scene.layer_count
        steps = max(count + 1, self.settings.most)
        if self.callback(Progress(phase, count, steps, loss, self._made)):
            raise Stopped


def looked_at(pixels: Float32Array, settings: Settings, resolution: int) -> View:
    """A picture at a resolution, or as it is where it is hardly larger: scaled by so little, edges become softer than
    any of a shape.
    """
    own = math.sqrt(pixels.shape[0] * pixels.shape[1])
    return view_of(pixels, settings, own if own < HARDLY_LARGER * resolution else resolution)
