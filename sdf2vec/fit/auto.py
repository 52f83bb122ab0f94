"""How many shapes: no more than a picture needs.

A drawing is made of few shapes, which are found one by one (`sparse`); anything else is painted with as many as are
allowed, or with as few as meet a target.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import torch
from msgspec import structs

from ..image import Picture, unpremultiply
from ..paints import FLAT as ONE_COLOR
from ..quality import psnr_of
from ..render.tensors import from_scene
from ..scene import Scene
from ..threads import threads_of_its_own
from .backends import choose
from .byte_budget import Share, within
from .description import description_length
from .digits import fit_concisely
from .drawings import FLAT, Drawn, is_photograph
from .finding import JOINT, Drawing
from .initialization import Layers
from .jagged import is_jagged
from .joining import Search
from .loop import Callback
from .mosaics import KIND as BOX
from .mosaics import mosaic
from .one_more import gain_of_one_more
from .ramps import KIND, ground_of
from .repainting import ground_shade, repainted
from .settings import AUTO, Settings, preset_of
from .shades import Gradient
from .shading import Shading
from .surroundings import View, error_of
from .targets import meeting, missed, wanted
from .views import pixel_of, scaled, view_of

# boxes, up to which a picture that is made of them may as well be of fewer other shapes
SIMPLE = 12
NOISE = 16 / 255  # by which pixels of one box may differ where compression was taken away
NEARLY, NEAR = 0.5, 35.0  # dB that other shapes are less near than boxes, at most; what is near
FEW = 4  # shapes that are placed by trial, of any picture, also where their number is given
SOME = 256  # shapes that are, of a drawing, where their number is given
WORSE = 2.0  # times the error that a picture without its gradients is found with: with them it is no worse
FAR = 10**-2.5  # 25 dB, of what is not yet the picture
# times the shapes found that are fitted where these alone are not the drawing; then, as many as allowed
MORE = 2, 4, 12
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
    has_target = settings.has_target
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
    boxes = _mosaic(drawn, settings, callback)
    if boxes is None:
        return _explained(drawn, settings, callback)
    if settings.has_target or len(boxes.layers) <= SIMPLE or is_jagged(drawn.pixels):
        found = _explained(drawn, settings, callback)
        if found is not None and _is_as_good(found, boxes, drawn, settings):
            return found
    return _told(boxes, picture, settings)


def _mosaic(drawn: Drawn, settings: Settings, callback: Callback) -> Scene | None:
    """The boxes of a picture that is made of them alone, as many as are told and as near as is wanted."""
    if BOX not in settings.drawn_kinds:
        return None
    found = mosaic(drawn.pixels, settings.most, NOISE if drawn.off else 0.0)
    if found is None or settings.shapes not in (AUTO, len(found.layers)):
        return None
    softest = max((layer.falloff for layer in found.layers), default=0.0)
    if softest > preset_of(settings).falloff[1]:
        return None
    if softest:
        found = Drawing(drawn, settings, callback).finished(found)
    is_near = not settings.has_target or missed(found, drawn.picture, settings) <= 0
    return found if is_near else None


def _is_as_good(found: Fitted, boxes: Scene, drawn: Drawn, settings: Settings) -> bool:
    """Whether what was found are fewer shapes than boxes, and tell the picture, with smooth edges, about as well, or as
    near as is wanted.
    """
    if found.scene.shape_count >= boxes.shape_count:
        return False
    if settings.has_target:
        return found.met
    smooth = Picture(unpremultiply(drawn.antialiased.pixels))
    return psnr_of(found.scene, smooth) >= min(psnr_of(boxes, smooth) - NEARLY, NEAR)


def _explained(drawn: Drawn, settings: Settings, callback: Callback) -> Fitted | None:
    """The scene of a drawing in shapes of any kind; None where it is to be painted."""
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
    if settings.shapes == AUTO and not settings.has_target and not drawing.explains(found):
        more = _enough(picture, settings, found, drawing.sizes.last, callback)
        if more is not found:
            return Fitted(more, _counted(more))
    found = drawing.sharpened(found)
    if not settings.has_target:
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
    what is far from the picture tries them all, and any that are not are better.
    """
    best, shortest = found, description_length(from_scene(found), view)
    counts = (min(max(times * max(found.shape_count, 1), FEW), settings.most) for times in (*MORE, math.inf))
    for count in dict.fromkeys(counts):
        if count <= best.shape_count:
            continue
        more = structs.replace(settings, start=best if best.layers else None, shapes=int(count))
        tried = fit_concisely(picture, more, callback)
        length, is_far = description_length(from_scene(tried), view), error_of(from_scene(best), view) > FAR
        if length < CLEARLY * shortest or (is_far and error_of(from_scene(tried), view) <= FAR):
            best, shortest = tried, length
        elif not is_far:
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
    if not settings.has_target:
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


# --- paintings ------------------------------------------------------------------------------------------------


def _painted(picture: Picture, settings: Settings, callback: Callback) -> Fitted:
    """The fit of a picture that is no drawing."""
    if settings.shapes != AUTO:
        return Fitted(fit_concisely(picture, settings, callback))
    if not settings.has_target:
        scene = fit_concisely(picture, settings, callback)
        return Fitted(
            scene, f"{_counted(scene)}: as many as are allowed, for it is no drawing (--max-shapes)"
        )
    scene, is_met = meeting(picture, settings, callback)
    if not is_met:
        return Fitted(scene, f"{_counted(scene)}: {wanted(settings)} is not reached (--max-shapes)", False)
    return Fitted(scene, f"{_counted(scene)} reach {wanted(settings)}")


def _counted(scene: Scene) -> str:
    """How many shapes of which kinds."""
    kinds = Counter(shape.kind for layer in scene.layers for shape in layer.shapes)
    listed = ", ".join(f"{count} {kind}" for kind, count in kinds.most_common())
    layers = "1 layer" if len(scene.layers) == 1 else f"{len(scene.layers)} layers"
    joined = f" in {layers}" if len(scene.layers) < scene.shape_count else ""
    return scene.count_text + joined + (f" ({listed})" if listed else "")
