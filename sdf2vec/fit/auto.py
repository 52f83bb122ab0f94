"""How many shapes: no more than a picture needs.

A drawing is made of few shapes, which are found one by one (`sparse`); anything else is painted with as many as are
allowed, or with as few as meet a target.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

import torch
from msgspec import structs

from ..arrays import Float32Array
from ..image import Picture
from ..paints import FLAT as ONE_COLOR
from ..quality import psnr_of
from ..render.tensors import SceneTensors, from_scene, to_scene
from ..scene import Scene
from ..threads import threads_of_its_own
from .backends import CPU, choose
from .byte_budget import Share, within
from .descents import Sizes, descended, fine_enough, finished, sharper, softer
from .description import description_length
from .digits import concise, fit_concisely
from .drawings import FLAT, Drawn, is_photograph
from .initialization import FAINTEST_GROUND, Layers, background_of, empty_groups
from .jagged import ALIKE
from .joining import Search
from .loop import Callback, Progress, Stopped
from .mending import SLIGHTLY, exchanged, merged
from .offers import common_color
from .one_more import gain_of_one_more
from .pens import lined
from .presets import Phase
from .pruning import BRIEF, FLOOR, THOROUGH, USUAL, pruned
from .ramps import KIND, grounded
from .repainting import ground_shade, repainted
from .settings import AUTO, Settings, preset_of
from .shades import Gradient
from .shading import Shading
from .simplify import sharing, simplified
from .sparse import Round, grow, needed, taken_apart
from .surroundings import View, error_of
from .targets import meeting, missed, wanted
from .views import pixel_of, scaled, view_of

THOROUGHLY = 12  # layers, at most, which in the end are tried without even where they matter
SEARCH, JOINT, LAST, LARGEST = 56, 128, 320, 1024  # pixels squared
SHARPENED = Phase("sharpened", 60, 0, rate=0.03, end_rate=0.003)  # larger steps lose more than they bring
HARDLY_LARGER = 1.5  # times that, up to which a picture is looked at as it is
FEW = 4  # shapes that are placed by trial, of any picture, also where their number is given
SOME = 256  # shapes that are, of a drawing, where their number is given
# of the error so much, 2 dB less, is left by so many rounds that no longer find much; from so many layers on
LAST_ROUNDS, SLOW, SEVERAL = 3, 10**-0.2, 16
GROWN = 1.5  # times the layers that could be told by their outlines, where these are not most of the drawing
UNLIKELY = 1.5  # of the most shapes: a picture that needs more is no drawing
SOFT_MOST = 16  # shapes of a soft drawing
SAMPLES = 4  # across a pixel, of a drawing that is antialiased
SMALL = 72  # pixels along the longer side, at most, of a picture that is looked at by these: larger ones gain little
GOOD = 10**-3.5  # mean squared error, 35 dB, of what is surely found
WORSE = 2.0  # times the error that a picture without its gradients is found with: with them it is no worse
FAR = 10**-2.5  # 25 dB, of what is not yet the picture
DOMINANT = 0.15  # share of the most common colour, of a picture that has a ground
# times the shapes found that are fitted where these alone are not the drawing; then, as many as allowed
MORE = 2, 4, 12
COARSER = 1.5  # times the error, step by step, that fewer shapes may have where FLIP is wanted
CLEARLY = 0.97  # of the description before, at most, that more shapes come to: they take more in a file


@dataclass(frozen=True)
class Fitted:
    """A scene, what was decided about the number of its shapes, and whether a target was met."""

    scene: Scene
    reason: str = ""
    met: bool = True


def fitted_picture(
    picture: Picture,
    settings: Settings,
    callback: Callback = lambda progress: False,
    share: Share | None = None,
) -> Fitted:
    """Fits shapes to a picture, as many as the settings say or as it needs. The same settings give the same scene.

    `share` says how much of a size limit a scene takes; where the number of shapes is auto, it takes at most all.

    The callback runs after every step; when it returns True, the fit ends and what is there is returned. Raises
    Sdf2vecError where the start scene does not suit the picture or the settings, and for a device that is not here.
    """
    choose(settings.device)  # drawings are searched on the CPU, but what is asked for must be there
    with threads_of_its_own():
        if settings.shapes != AUTO:
            return _few(picture, settings, callback) or _painted(picture, settings, callback)
        if share is None:
            found = _few(picture, settings, callback) or _painted(picture, settings, callback)
        else:
            found = _within(picture, settings, callback, share)
        layers = Layers(settings.drawn_kinds or settings.kinds, settings.compositing, 1, settings.paint)
        search = Search(
            layers, preset_of(settings).falloff, torch.Generator(), lambda loss: None, pixel_of(picture)
        )
        gain = gain_of_one_more(found.scene, view_of(picture.premultiplied, settings, JOINT), search)
        return replace(found, reason=f"{found.reason}; one more would gain {gain:.2f} dB")


def _within(picture: Picture, settings: Settings, callback: Callback, share: Share) -> Fitted:
    """What a size limit holds: the shapes of a drawing, those that meet a target, or as many as there is room for."""
    has_target = _has_target(settings)
    found = _few(picture, settings, callback)
    if has_target and found is None:
        found = _painted(picture, settings, callback)
    if found is not None and share(found.scene) <= 1.0:
        return found
    scene, taken = within(picture, settings, share, callback)
    met = taken <= 1.0 and not (has_target and missed(scene, picture, settings) > 0)
    unreached = f"; {wanted(settings)} is not reached" if has_target else ""
    return Fitted(scene, f"{_counted(scene)}: {taken:.0%} of the size limit{unreached}", met)


def _few(picture: Picture, settings: Settings, callback: Callback) -> Fitted | None:
    """The scene of a drawing, or of few shapes; None where it is to be painted."""
    if not _may_be_few(settings):
        return None
    drawn = Drawn.of(picture)
    shading = None if drawn.flat else Shading.of(drawn.pixels, FLAT)
    if shading is None:
        if not _is_searched(drawn, settings):
            return None
        drawn = drawn.antialiased
        shading = Shading.of(drawn.pixels) if drawn.flat else None
    if shading is None:
        return _searched(drawn, settings, callback)
    ground = _ground_shade(shading, settings)
    fewer = settings if ground is None else _one_less(settings)
    found = _searched(drawn.flattened(shading.flattened), fewer, callback)
    if found is None:
        return None
    drawing = Drawing(drawn, settings, callback)
    drawing.good = max(drawing.good, WORSE * 10 ** (-psnr_of(found.scene, shading.flattened) / 10))
    scene = drawing.finished(repainted(found.scene, shading, ground))
    return _needed(drawing, scene, callback)


def _searched(drawn: Drawn, settings: Settings, callback: Callback) -> Fitted | None:
    """The same of a picture without gradients."""
    drawing, picture = Drawing(drawn, settings, callback), drawn.picture
    found = drawing.found()
    if drawing.stopped:
        return _told(found, picture, settings)
    if settings.shapes == AUTO:
        return None if drawing.gave_up else _needed(drawing, found, callback)
    found = drawing.sharpened(found)
    is_whole = settings.shapes == found.shape_count and settings.loss is None
    if is_whole and drawing.error <= drawing.floor:  # a fit that goes on would only follow the antialiasing
        return _told(found, picture, settings)
    going_on = _going_on(settings, found)
    anew = [settings] if _is_some(settings) and found.layers and drawing.error > drawing.good else []
    made = [fit_concisely(picture, each, callback) for each in (going_on, *anew)]
    if is_whole:
        made.append(found)
    return _told(_nearest(made, picture), picture, settings)


def _needed(drawing: Drawing, found: Scene, callback: Callback) -> Fitted:
    """What was found, or what goes on from it where that is not the drawing, or not as near as wanted."""
    picture, settings = drawing.picture, drawing.settings
    if settings.shapes == AUTO and not _has_target(settings) and drawing.error > drawing.good:
        more = _enough(picture, settings, found, drawing.sizes.last, callback)
        if more is not found:
            return Fitted(more, _counted(more))
    found = drawing.sharpened(found)
    if not _has_target(settings):
        return _told(found, picture, settings)
    if missed(found, picture, settings) <= 0:
        return Fitted(found, f"{_counted(found)}: {wanted(settings)} is reached")
    scene, _ = meeting(picture, _going_on(settings, found), callback)
    nearest = min((scene, found), key=partial(missed, picture=picture, settings=settings))
    return _told(nearest, picture, settings)


def _ground_shade(shading: Shading, settings: Settings) -> Gradient | None:
    """The gradient of a picture's ground, if it has one, and one more shape may show it."""
    ground = ground_of(scaled(shading.flattened.premultiplied, JOINT))
    shade = ground_shade(ground, shading)
    return shade if settings.most > 1 and KIND in settings.drawn_kinds else None


def _one_less(settings: Settings) -> Settings:
    """The settings of a fit with one shape less."""
    if settings.shapes == AUTO:
        return structs.replace(settings, max_shapes=settings.most - 1)
    return structs.replace(settings, shapes=settings.shapes - 1)


def _enough(picture: Picture, settings: Settings, found: Scene, view: View, callback: Callback) -> Scene:
    """What goes on from what was found with ever more shapes, as long as that makes the description clearly shorter;
    what is far from the picture tries them all.
    """
    best, shortest = found, description_length(from_scene(found), view)
    counts = (min(max(times * max(found.shape_count, 1), FEW), settings.most) for times in (*MORE, math.inf))
    for count in dict.fromkeys(counts):
        if count <= best.shape_count:
            continue
        more = structs.replace(settings, start=best if best.layers else None, shapes=int(count))
        tried = fit_concisely(picture, more, callback)
        length = description_length(from_scene(tried), view)
        if length < CLEARLY * shortest:
            best, shortest = tried, length
        elif error_of(from_scene(best), view) <= FAR:
            break
    return best


def _nearest(scenes: Sequence[Scene], picture: Picture) -> Scene:
    """The first of those with the highest PSNR."""
    near = [psnr_of(scene, picture) for scene in scenes]
    return scenes[near.index(max(near))]


def _told(scene: Scene, picture: Picture, settings: Settings) -> Fitted:
    """A scene with what there is to say of it."""
    if settings.shapes != AUTO:
        return Fitted(scene)
    if not _has_target(settings):
        return Fitted(scene, _counted(scene))
    met = missed(scene, picture, settings) <= 0
    return Fitted(scene, f"{_counted(scene)}: {wanted(settings)} is {'' if met else 'not '}reached", met)


def _may_be_few(settings: Settings) -> bool:
    plain = settings.compositing == "over" and settings.union == 1 and settings.start is None
    plain = plain and settings.paint == ONE_COLOR and settings.min_area is None
    more = settings.palette or settings.colors or settings.cuts or settings.trials
    most = SOME if preset_of(settings).searches else FEW
    few = settings.shapes == AUTO or settings.shapes <= most
    return plain and few and not more and bool(settings.drawn_kinds)


def _is_searched(drawn: Drawn, settings: Settings) -> bool:
    """Whether shapes are looked for in a picture: in any if they are few, else in drawings."""
    if settings.shapes != AUTO and not _is_some(settings):
        return True
    return (drawn.flat or settings.shapes == AUTO) and not is_photograph(drawn)


def _is_some(settings: Settings) -> bool:
    """Whether more shapes are told than are placed by trial of any picture."""
    return settings.shapes != AUTO and settings.shapes > FEW


def _going_on(settings: Settings, found: Scene) -> Settings:
    """The settings of a fit that goes on from what was found, where that is something."""
    return structs.replace(settings, start=found if found.layers else None, shapes=settings.most)


# --- drawings -------------------------------------------------------------------------------------------------


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
        return view._replace(samples=SAMPLES) if is_small and not _has_target(self.settings) else view

    def _is_told(self) -> bool:
        """Whether nothing is missing but how edges are antialiased."""
        if not self.scene.groups or self.settings.shapes != AUTO or _has_target(self.settings):
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


def ground_of(target: torch.Tensor) -> torch.Tensor:
    """A colour of a picture [C, H, W] that dominates, that of its rim before the most common, else the mean; none where
    it has holes.
    """
    if len(target) == 4:
        return background_of(target) if float(target[3].min()) >= FAINTEST_GROUND else torch.zeros(4)
    colors, rim = target.flatten(1).T, torch.ones(target.shape[1:])
    rim[1:-1, 1:-1] = 0.0
    for weights in (rim.flatten(), torch.ones(len(colors))):
        common = common_color(colors, weights)
        near = (colors - common).abs().amax(1) < ALIKE
        if float(near.float().mean()) >= DOMINANT:
            return torch.cat([common, torch.ones(1)])
    return torch.cat([colors.mean(0), torch.ones(1)])


# --- paintings ------------------------------------------------------------------------------------------------


def _painted(picture: Picture, settings: Settings, callback: Callback) -> Fitted:
    """The fit of a picture that is no drawing."""
    if settings.shapes != AUTO:
        return Fitted(fit_concisely(picture, settings, callback))
    if not _has_target(settings):
        scene = fit_concisely(picture, settings, callback)
        return Fitted(
            scene, f"{_counted(scene)}: as many as are allowed, for it is no drawing (--max-shapes)"
        )
    scene, is_met = meeting(picture, settings, callback)
    if not is_met:
        return Fitted(scene, f"{_counted(scene)}: {wanted(settings)} is not reached (--max-shapes)", False)
    return Fitted(scene, f"{_counted(scene)} reach {wanted(settings)}")


def _has_target(settings: Settings) -> bool:
    return (settings.target_psnr, settings.target_flip) != (None, None)


def _counted(scene: Scene) -> str:
    """How many shapes of which kinds."""
    kinds = Counter(shape.kind for layer in scene.layers for shape in layer.shapes)
    listed = ", ".join(f"{count} {kind}" for kind, count in kinds.most_common())
    layers = "1 layer" if len(scene.layers) == 1 else f"{len(scene.layers)} layers"
    joined = f" in {layers}" if len(scene.layers) < scene.shape_count else ""
    return scene.count_text + joined + (f" ({listed})" if listed else "")
